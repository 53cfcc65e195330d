//! From a stream of bytes to packets.

use super::encode::unstuff;
use super::{
    BROADCAST_ID, DeviceId, FastReply, Instruction, InstructionPacket, MAX_PACKET_LEN, MalformedInstruction, Packet,
    Recipient, StatusFlags, StatusPacket, crc_of, field,
};

/// Capacity of a decoder, bytes: an incomplete packet, and what follows it.
const BUFFER_LEN: usize = 2 * MAX_PACKET_LEN;

/// Finds packets in a stream of bytes.
///
/// Bytes go in as they come, by [`push`](Self::push) or directly by [`free_space`](Self::free_space) and
/// [`commit`](Self::commit); packets come out of [`next_packet`](Self::next_packet). After noise it continues at the
/// next header. A packet with a wrong CRC is reported, and searched for another header, because its length may be what is damaged, and
/// may include the next packet. A fast reply with a wrong CRC is returned nevertheless: see [`FastReply::is_intact`], and use the
/// segments that are good.
#[derive(Debug, Clone)]
pub struct Decoder {
    buffer: [u8; BUFFER_LEN],
    start: usize, // in 0..=end
    end: usize,   // in start..=BUFFER_LEN
    garbage_bytes: u64,
}

/// Why bytes that look like a packet are not a valid one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The CRC is wrong.
    #[error("a packet of {packet_len} bytes, ID {id}, came with a wrong CRC: check cable, baud rate and noise")]
    Crc {
        /// Raw ID; it may itself be damaged.
        id: u8,
        /// Length that its header claims.
        packet_len: usize,
    },
    /// The CRC is right, but the ID is reserved.
    #[error("a packet with the reserved ID {id}")]
    ReservedId {
        /// Raw ID.
        id: u8,
    },
    /// The CRC is right, but an answer has no error byte.
    #[error("an empty answer from ID {id}")]
    EmptyStatus {
        /// Raw ID.
        id: u8,
    },
    /// The CRC is right, but the instruction is not valid.
    #[error("for ID {id}: {error}", id = recipient.to_wire())]
    Instruction {
        /// Its recipient.
        recipient: Recipient,
        /// What is wrong with it.
        error: MalformedInstruction,
    },
}

/// The front of the buffer.
enum Front {
    Incomplete,
    Packet { len: usize },
}

impl Decoder {
    /// An empty decoder.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            buffer: [0; BUFFER_LEN],
            start: 0,
            end: 0,
            garbage_bytes: 0,
        }
    }

    /// Free space for incoming bytes. Never empty after [`next_packet`](Self::next_packet) has returned none.
    pub fn free_space(&mut self) -> &mut [u8] {
        if self.start == self.end {
            (self.start, self.end) = (0, 0);
        } else if self.start > 0 {
            self.buffer.copy_within(self.start..self.end, 0);
            (self.start, self.end) = (0, self.end - self.start);
        }
        &mut self.buffer[self.end..]
    }

    /// Says that the first `count` bytes of [`free_space`](Self::free_space) have been filled.
    pub fn commit(&mut self, count: usize) {
        self.end = (self.end + count).min(BUFFER_LEN);
    }

    /// Adds as many of `bytes` as there is room for, and returns how many.
    pub fn push(&mut self, bytes: &[u8]) -> usize {
        let room = self.free_space();
        let taken = room.len().min(bytes.len());
        room[..taken].copy_from_slice(&bytes[..taken]);
        self.commit(taken);
        taken
    }

    /// The next packet or its error; none until more bytes come.
    pub fn next_packet(&mut self) -> Option<Result<Packet<'_>, DecodeError>> {
        let Front::Packet { len } = self.find_front() else {
            return None;
        };
        let packet = self.start..self.start + len;
        let (content, crc) = self.buffer[packet.clone()].split_at(len - field::CRC_LEN);
        if crc == crc_of(content).to_le_bytes() {
            self.start = packet.end;
            return Some(parse(&mut self.buffer[packet]));
        }
        let id = content[field::ID];
        self.skip_garbage(1);
        // A damaged fast reply may hold good segments: each has a CRC of its own.
        Some(match FastReply::new(&self.buffer[packet], false) {
            Some(reply) => Ok(Packet::FastReply(reply)),
            None => Err(DecodeError::Crc { id, packet_len: len }),
        })
    }

    /// The beginning of an incomplete fast reply: a device was silent, or bytes were lost. Its segments are checked one by one.
    ///
    /// Call it at the end of the wait; before, the rest may still come. Bytes in front of the reply are discarded.
    pub fn unfinished_fast_reply(&mut self) -> Option<FastReply<'_>> {
        while self.start < self.end {
            let unread = self.start..self.end;
            if FastReply::new(&self.buffer[unread.clone()], false).is_some() {
                return FastReply::new(&self.buffer[unread], false);
            }
            self.skip_garbage(1);
        }
        None
    }

    /// Gives up an incomplete packet: the search for a header continues after its first byte.
    ///
    /// A device calls it when the line has been idle, so that it does not wait for ever because of a damaged length.
    pub fn give_up_unfinished(&mut self) {
        if self.start < self.end {
            self.skip_garbage(1);
        }
    }

    /// Discards all bytes; returns how many there were. They do not count as garbage.
    pub fn clear(&mut self) -> usize {
        let forgotten = self.end - self.start;
        (self.start, self.end) = (0, 0);
        forgotten
    }

    /// Whether there are no bytes.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.start == self.end
    }

    /// Bytes outside of packets so far.
    #[must_use]
    pub const fn garbage_bytes(&self) -> u64 {
        self.garbage_bytes
    }

    fn skip_garbage(&mut self, count: usize) {
        self.start += count;
        self.garbage_bytes += count as u64;
    }

    /// Steps to the next header and says whether its packet is complete.
    fn find_front(&mut self) -> Front {
        loop {
            let unread = &self.buffer[self.start..self.end];
            let garbage = position_of_header(unread);
            if garbage > 0 {
                self.skip_garbage(garbage);
                continue;
            }
            let Some(&[low, high]) = unread.get(field::LENGTH) else {
                return Front::Incomplete;
            };
            let counted = usize::from(u16::from_le_bytes([low, high]));
            let len = field::INSTRUCTION + counted;
            if counted < field::MIN_LENGTH_FIELD || len > MAX_PACKET_LEN {
                self.skip_garbage(1);
                continue;
            }
            return if unread.len() < len {
                Front::Incomplete
            } else {
                Front::Packet { len }
            };
        }
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

/// Position of the first header, or of what may become one.
fn position_of_header(bytes: &[u8]) -> usize {
    let may_begin_at = |from: usize| {
        let candidate = &bytes[from..];
        let compared = candidate.len().min(field::HEADER.len());
        candidate[..compared] == field::HEADER[..compared]
    };
    (0..bytes.len()).find(|&from| may_begin_at(from)).unwrap_or(bytes.len())
}

/// Parses a whole packet whose CRC is right.
fn parse(packet: &mut [u8]) -> Result<Packet<'_>, DecodeError> {
    let id = packet[field::ID];
    let instruction = packet[field::INSTRUCTION];
    if instruction == field::STATUS_INSTRUCTION && id == BROADCAST_ID {
        return FastReply::new(packet, true)
            .map(Packet::FastReply)
            .ok_or(DecodeError::ReservedId { id });
    }
    let crc_from = packet.len() - field::CRC_LEN;
    // The instruction takes part: it can be the first byte of a stuffed pattern.
    let content = &mut packet[field::INSTRUCTION..crc_from];
    let content_len = unstuff(content);
    let parameters = &content[1..content_len];
    if instruction == field::STATUS_INSTRUCTION {
        let id = DeviceId::new(id).ok_or(DecodeError::ReservedId { id })?;
        let (&flags, data) = parameters
            .split_first()
            .ok_or(DecodeError::EmptyStatus { id: id.get() })?;
        return Ok(Packet::Status(StatusPacket {
            id,
            flags: StatusFlags::from_wire(flags),
            data,
        }));
    }
    let recipient = Recipient::from_wire(id).ok_or(DecodeError::ReservedId { id })?;
    match Instruction::parse(instruction, parameters) {
        Ok(instruction) => Ok(Packet::Instruction(InstructionPacket { recipient, instruction })),
        Err(error) => Err(DecodeError::Instruction { recipient, error }),
    }
}
