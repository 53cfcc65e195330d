//! Writing packets into a buffer, with byte stuffing.

use super::{MAX_PACKET_LEN, crc_of, field};

/// Why a packet could not be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EncodeError {
    /// The buffer is too small.
    #[error("the packet does not fit into a buffer of {buffer_len} bytes: give it {MAX_PACKET_LEN}")]
    BufferTooSmall {
        /// Its size.
        buffer_len: usize,
    },
    /// The packet is longer than any receiver here accepts.
    #[error("the packet is longer than {MAX_PACKET_LEN} bytes: split it into several")]
    TooLong,
    /// A segment of a fast reply has another length than requested.
    #[error("a segment of {found} bytes where the request asked for {expected}: answer what was asked")]
    SegmentLength {
        /// Bytes requested from this device; zero when the request has no further device.
        expected: usize,
        /// Bytes given.
        found: usize,
    },
}

/// Appends stuffed bytes after a header; length and CRC are filled in at the end.
pub(super) struct PacketWriter<'o> {
    out: &'o mut [u8],
    len: usize,
    buffer_len: usize,
    overflowed: bool,
}

impl<'o> PacketWriter<'o> {
    pub(super) fn new(out: &'o mut [u8], id: u8, instruction: u8) -> Self {
        let buffer_len = out.len();
        let usable = buffer_len.min(MAX_PACKET_LEN);
        let mut writer = Self {
            out: &mut out[..usable],
            len: 0,
            buffer_len,
            overflowed: false,
        };
        writer.raw(&field::HEADER);
        writer.raw(&[id, 0, 0, instruction]);
        writer
    }

    fn raw(&mut self, bytes: &[u8]) {
        match self.out.get_mut(self.len..self.len + bytes.len()) {
            Some(room) => {
                room.copy_from_slice(bytes);
                self.len += bytes.len();
            }
            None => self.overflowed = true,
        }
    }

    /// Appends a parameter byte, and an extra `FD` after each `FF FF FD`.
    pub(super) fn byte(&mut self, byte: u8) {
        self.raw(&[byte]);
        if byte == 0xFD && !self.overflowed && self.out[..self.len].ends_with(&[0xFF, 0xFF, 0xFD]) {
            self.raw(&[0xFD]);
        }
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.byte(byte);
        }
    }

    pub(super) fn word(&mut self, word: u16) {
        self.bytes(&word.to_le_bytes());
    }

    /// Fills in length and CRC. Returns the length of the packet.
    pub(super) fn finish(mut self) -> Result<usize, EncodeError> {
        if !self.overflowed {
            let counted = (self.len + field::CRC_LEN - field::INSTRUCTION) as u16; // at most MAX_PACKET_LEN
            self.out[field::LENGTH].copy_from_slice(&counted.to_le_bytes());
            let crc = crc_of(&self.out[..self.len]);
            self.raw(&crc.to_le_bytes());
        }
        if !self.overflowed {
            Ok(self.len)
        } else if self.buffer_len < MAX_PACKET_LEN {
            Err(EncodeError::BufferTooSmall {
                buffer_len: self.buffer_len,
            })
        } else {
            Err(EncodeError::TooLong)
        }
    }
}

/// Removes the extra `FD` after each `FF FF FD`, in place. Returns the number of bytes that remain at the front.
pub(super) fn unstuff(bytes: &mut [u8]) -> usize {
    // Most payloads contain no `FF FF FD` and stay as they are.
    let Some(first) = bytes.windows(4).position(|window| window == [0xFF, 0xFF, 0xFD, 0xFD]) else {
        return bytes.len();
    };
    let mut kept = first + 3;
    let mut from = first + 4;
    while let Some(&byte) = bytes.get(from) {
        bytes[kept] = byte;
        kept += 1;
        from += 1;
        // The pattern is searched in the kept bytes, because the removed byte is not part of the payload.
        let closes_header = byte == 0xFD && bytes[..kept].ends_with(&[0xFF, 0xFF, 0xFD]);
        if closes_header && bytes.get(from) == Some(&0xFD) {
            from += 1;
        }
    }
    kept
}
