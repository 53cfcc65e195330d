//! The device: bytes and a time in, bytes out. It needs neither `std` nor an allocator, only the codec.
//!
//! Its control table, little-endian:
//!
//! | address | bytes | access | what |
//! |---|---|---|---|
//! | 0 | 2 | read | model number |
//! | 6 | 1 | read | firmware version |
//! | 7 | 1 | read, write | ID, 0 to 252 |
//! | 68 | 1 | read, write | status return level: 0 answers pings, 1 pings and reads, 2 everything |
//! | 125 | 2 | read | pitch of the body in 0.01°, signed, growing up the canal; −32768 without an inertial sensor |
//! | 127 | 1 | read | switches: bit 0 is set while the emergency stop is pressed |
//! | 128 | 4 | read | sample counter, one more with each capture |
//! | 132 | 4 | read | time of the capture in µs, wraps |
//! | 136 | 1 | read | number of cells |
//! | 137 | 2 | read | valid mask: bit *i* is set when cell *i* was seen in this capture |
//! | 139 + 4 *i* | 4 | read | position of cell *i* in µm, signed; the last one known when it was not seen |
//!
//! Several devices may share the line. When one request is for several of them, each waits for its turn:
//! - Sync and bulk read: a device sends its status after it has heard the status of the device before it.
//! - Fast sync and fast bulk read: a device appends its segment when the last byte of the segment before it has passed.
//! - Broadcast ping: each ID has a time slot of its own.
//!
//! So a device behind a silent one stays silent, as the protocol has it.

use super::capture::{Capture, MAX_CELLS};
use dynamixel_bus::Register;
use dynamixel_bus::packet::{
    DecodeError, Decoder, DeviceId, FastReply, FastReplyWriter, FastSegment, Instruction, MAX_PACKET_LEN,
    MalformedInstruction, Packet, ReadSpan, Recipient, StatusError, StatusFlags, StatusPacket,
};

/// Model number: "WM", high byte first.
pub const MODEL: u16 = 0x574D;
/// Version of this firmware.
pub const FIRMWARE: u8 = 1;

/// Pitch of a device that does not know it.
pub const NO_PITCH: i16 = i16::MIN;

/// A packet whose end does not come within this time is given up, µs.
const IDLE_US: u64 = 5_000;
/// Time slot of each ID after a broadcast ping, µs. The maker's SDK allows 3 ms.
const PING_SLOT_US: u64 = 2_000;
/// A fast reply has room for no more devices than this: 4 bytes each behind a header of 8.
const MAX_FAST_DEVICES: usize = (MAX_PACKET_LEN - FAST_HEADER_LEN) / FAST_SEGMENT_OVERHEAD;
/// Bytes in front of the first segment of a fast reply.
const FAST_HEADER_LEN: usize = 8;
/// Error byte, ID and CRC of a segment.
const FAST_SEGMENT_OVERHEAD: usize = 4;

const MODEL_NUMBER: Register = Register::new(0, 2, "model number");
const FIRMWARE_VERSION: Register = Register::new(6, 1, "firmware version");
const ID: Register = Register::new(7, 1, "ID");
const STATUS_RETURN_LEVEL: Register = Register::new(68, 1, "status return level");
const PITCH: Register = Register::new(125, 2, "pitch");
const SWITCHES: Register = Register::new(127, 1, "switches");
const SAMPLE: Register = Register::new(128, 4, "sample counter");
const CAPTURE_TIME: Register = Register::new(132, 4, "capture time");
const CELL_COUNT: Register = Register::new(136, 1, "cell count");
const VALID_MASK: Register = Register::new(137, 2, "valid mask");
const FIRST_POSITION: Register = Register::new(139, 4, "cell position");

const TABLE_LEN: usize = FIRST_POSITION.address as usize + MAX_CELLS * FIRST_POSITION.size as usize;

/// A tracker on a DYNAMIXEL bus.
pub struct Tracker {
    decoder: Decoder,
    last_byte_us: u64,
    device: Device,
}

impl Tracker {
    /// A tracker of `cells` cells, at most [`MAX_CELLS`], that answers everything.
    pub fn new(id: DeviceId, cells: usize) -> Self {
        Self {
            decoder: Decoder::new(),
            last_byte_us: 0,
            device: Device {
                id,
                cells: cells.min(MAX_CELLS),
                status_return_level: 2,
                emergency_stop: false,
                pitch: NO_PITCH,
                turn: Turn::None,
            },
        }
    }

    /// Notes whether the emergency stop is pressed. Call it before each [`receive`](Self::receive), so that an answer never says what
    /// was true a while ago.
    pub fn set_emergency_stop(&mut self, pressed: bool) {
        self.device.emergency_stop = pressed;
    }

    /// Notes the pitch that an inertial sensor measures, in 0.01°: the mean over some hundredths of a second. [`NO_PITCH`] while it does not.
    pub fn set_pitch(&mut self, counts: i16) {
        self.device.pitch = counts;
    }

    /// Takes a byte from the line. `send` gets what is to be sent at once, if anything.
    ///
    /// The receiver has to be off while the device sends: its own bytes must not come back here.
    pub fn receive(&mut self, byte: u8, now_us: u64, mut send: impl FnMut(&[u8])) {
        if now_us.saturating_sub(self.last_byte_us) > IDLE_US {
            // What was begun has not been completed: a length got damaged, or its sender was switched off.
            self.decoder.clear();
            if let Turn::AfterSegments(queue) = &self.device.turn
                && queue.heard > 0
            {
                self.device.turn = Turn::None;
            }
        }
        self.last_byte_us = now_us;
        self.decoder.push(&[byte]);
        let mut out = [0; MAX_PACKET_LEN];
        if self.device.turn.is_at_own_segment() {
            if let Some(reply) = self.decoder.unfinished_fast_reply()
                && let Some((from, to)) = self.device.own_segment(reply, now_us, &mut out)
            {
                send(&out[from..to]);
                // The reply goes on where this device stops, so the decoder has to hear all of it.
                self.decoder.push(&out[from..to]);
            }
            self.device.turn = Turn::None;
        }
        while let Some(packet) = self.decoder.next_packet() {
            let len = self.device.take(packet, now_us, &mut out);
            if len > 0 {
                send(&out[..len]);
            }
        }
    }

    /// Lets time pass. `send` gets what is due: the answer to a broadcast ping waits for its time slot. Call it at least
    /// each millisecond.
    pub fn poll(&mut self, now_us: u64, mut send: impl FnMut(&[u8])) {
        if let Turn::Ping { due_us } = self.device.turn
            && now_us >= due_us
        {
            self.device.turn = Turn::None;
            let mut out = [0; MAX_PACKET_LEN];
            let len = self.device.identity(&mut out);
            send(&out[..len]);
        }
    }
}

/// What this device waits for before it sends.
#[expect(
    clippy::large_enum_variant,
    reason = "there is no allocator for a box, and a device has one of these"
)]
enum Turn {
    /// Nothing: it was not asked.
    None,
    /// Its time slot after a broadcast ping.
    Ping { due_us: u64 },
    /// The status of the device before it in a sync or bulk read.
    AfterStatus { previous: DeviceId, own: ReadSpan },
    /// The segments of the devices before it in a fast reply.
    AfterSegments(FastQueue),
}

impl Turn {
    /// Counts a byte of a fast reply; whether it is the last one before this device's own segment.
    fn is_at_own_segment(&mut self) -> bool {
        let Self::AfterSegments(queue) = self else {
            return false;
        };
        queue.heard += 1;
        queue.heard == queue.own_from
    }
}

/// The devices that answer a fast read together.
struct FastQueue {
    spans: [ReadSpan; MAX_FAST_DEVICES],
    devices: usize, // in 0..=MAX_FAST_DEVICES
    /// Index of this device.
    own: usize,
    /// Where this device's segment begins in the reply.
    own_from: usize,
    /// Bytes of the reply so far.
    heard: usize,
}

impl FastQueue {
    /// The queue of a request, when this device is in it and the reply fits into a packet.
    fn new(id: DeviceId, spans: impl Iterator<Item = Option<ReadSpan>>) -> Option<Self> {
        let empty = ReadSpan {
            id,
            address: 0,
            length: 0,
        };
        let mut queue = Self {
            spans: [empty; MAX_FAST_DEVICES],
            devices: 0,
            own: MAX_FAST_DEVICES,
            own_from: FAST_HEADER_LEN,
            heard: 0,
        };
        for span in spans {
            let span = span?;
            *queue.spans.get_mut(queue.devices)? = span;
            if queue.own == MAX_FAST_DEVICES {
                if span.id == id {
                    queue.own = queue.devices;
                } else {
                    queue.own_from += usize::from(span.length) + FAST_SEGMENT_OVERHEAD;
                }
            }
            queue.devices += 1;
        }
        (queue.own < MAX_FAST_DEVICES).then_some(queue)
    }

    fn lengths(&self) -> impl Iterator<Item = u16> + Clone + use<'_> {
        self.spans[..self.devices].iter().map(|span| span.length)
    }
}

/// Everything but the decoder.
struct Device {
    id: DeviceId,
    cells: usize,            // in 0..=MAX_CELLS
    status_return_level: u8, // in 0..=2
    emergency_stop: bool,
    pitch: i16, // 0.01°
    turn: Turn,
}

impl Device {
    /// Takes what came along the line. Writes an answer to the front of `out` and returns its length, 0 for none.
    fn take(&mut self, packet: Result<Packet<'_>, DecodeError>, now_us: u64, out: &mut [u8]) -> usize {
        match packet {
            Ok(Packet::Instruction(packet)) => {
                self.turn = Turn::None;
                match packet.recipient {
                    Recipient::One(id) if id != self.id => 0,
                    Recipient::One(_) => self.obey(packet.instruction, now_us, out),
                    Recipient::All => self.obey_broadcast(packet.instruction, now_us, out),
                }
            }
            Ok(Packet::Status(status)) => match core::mem::replace(&mut self.turn, Turn::None) {
                Turn::AfterStatus { previous, own } if status.id == previous => self.answer_read(own, now_us, out),
                waiting => {
                    self.turn = waiting;
                    0
                }
            },
            Ok(Packet::FastReply(_)) => 0,
            // For another device, or for this one: whoever sent it will ask again.
            Err(DecodeError::Crc { .. } | DecodeError::ReservedId { .. } | DecodeError::EmptyStatus { .. }) => 0,
            Err(DecodeError::Instruction { recipient, error }) => {
                self.turn = Turn::None;
                let error = match error {
                    MalformedInstruction::UnknownCode { .. } => StatusError::Instruction,
                    MalformedInstruction::Parameters { .. } => StatusError::DataLength,
                };
                let asked = recipient == Recipient::One(self.id);
                if asked && self.status_return_level >= 2 {
                    status(self.id, Some(error), &[], out)
                } else {
                    0
                }
            }
        }
    }

    /// An instruction for this device alone.
    fn obey(&mut self, instruction: Instruction<'_>, now_us: u64, out: &mut [u8]) -> usize {
        match instruction {
            Instruction::Ping => self.identity(out),
            Instruction::Read { address, length } => {
                let own = ReadSpan {
                    id: self.id,
                    address,
                    length,
                };
                self.answer_read(own, now_us, out)
            }
            change => {
                // The answer comes from the ID that was asked. A write that raises the level to 2 is answered, too.
                let (id, level) = (self.id, self.status_return_level);
                let error = self.change(change).err();
                if level.max(self.status_return_level) >= 2 {
                    status(id, error, &[], out)
                } else {
                    0
                }
            }
        }
    }

    /// An instruction for several devices.
    fn obey_broadcast(&mut self, instruction: Instruction<'_>, now_us: u64, out: &mut [u8]) -> usize {
        match instruction {
            Instruction::Ping => {
                let due_us = now_us + u64::from(self.id.get()) * PING_SLOT_US;
                self.turn = Turn::Ping { due_us };
                0
            }
            Instruction::SyncRead { address, length, ids } => self.join_read(spans(ids, address, length), now_us, out),
            Instruction::BulkRead(spans) => self.join_read(spans.iter().map(Some), now_us, out),
            Instruction::FastSyncRead { address, length, ids } => {
                self.join_fast_read(spans(ids, address, length), now_us, out)
            }
            Instruction::FastBulkRead(spans) => self.join_fast_read(spans.iter().map(Some), now_us, out),
            Instruction::SyncWrite { address, writes } => {
                for (id, data) in writes.iter() {
                    if id == self.id {
                        // A sync write is not answered, so nobody learns of an error.
                        let _unanswered = self.change(Instruction::Write { address, data });
                    }
                }
                0
            }
            Instruction::BulkWrite(writes) => {
                for write in writes.iter() {
                    if write.id == self.id {
                        let (address, data) = (write.address, write.data);
                        let _unanswered = self.change(Instruction::Write { address, data });
                    }
                }
                0
            }
            change => {
                let _unanswered = self.change(change);
                0
            }
        }
    }

    /// A plain sync or bulk read: answers at once when this device comes first, and waits for its turn otherwise.
    fn join_read(&mut self, spans: impl Iterator<Item = Option<ReadSpan>>, now_us: u64, out: &mut [u8]) -> usize {
        let mut previous = None;
        for span in spans {
            match span {
                Some(own) if own.id == self.id => {
                    return match previous {
                        None => self.answer_read(own, now_us, out),
                        Some(previous) => {
                            self.turn = Turn::AfterStatus { previous, own };
                            0
                        }
                    };
                }
                Some(other) => previous = Some(other.id),
                None => return 0, // no device has this ID, so nobody behind it ever gets a turn
            }
        }
        0
    }

    /// A fast sync or bulk read, likewise.
    fn join_fast_read(&mut self, spans: impl Iterator<Item = Option<ReadSpan>>, now_us: u64, out: &mut [u8]) -> usize {
        if self.status_return_level < 1 {
            return 0;
        }
        let Some(queue) = FastQueue::new(self.id, spans) else {
            return 0;
        };
        let own = queue.spans[queue.own];
        if queue.own > 0 {
            self.turn = Turn::AfterSegments(queue);
            return 0;
        }
        let Ok(mut reply) = FastReplyWriter::new(out, queue.lengths()) else {
            return 0;
        };
        match self.push_segment(own, now_us, &mut reply) {
            Some(()) => reply.len(),
            None => 0,
        }
    }

    /// This device's segment behind those of `reply`, written to `out` from and to the places returned. Nothing when an
    /// earlier segment came damaged: the controller cannot use what comes behind it.
    fn own_segment(&self, reply: FastReply<'_>, now_us: u64, out: &mut [u8]) -> Option<(usize, usize)> {
        let Turn::AfterSegments(queue) = &self.turn else {
            return None;
        };
        // The CRC of a segment covers everything before it.
        let mut writer = FastReplyWriter::new(out, queue.lengths()).ok()?;
        for segment in reply.segments(queue.spans[..queue.own].iter().copied()) {
            writer.push(segment.ok()?).ok()?;
        }
        let from = writer.len();
        self.push_segment(queue.spans[queue.own], now_us, &mut writer)?;
        Some((from, writer.len()))
    }

    fn push_segment<I>(&self, own: ReadSpan, now_us: u64, reply: &mut FastReplyWriter<'_, I>) -> Option<()>
    where
        I: Iterator<Item = u16> + Clone,
    {
        let table = self.table(now_us);
        let no_data = [0; MAX_PACKET_LEN];
        let (error, data) = match slice_of(&table, own) {
            Ok(data) => (None, data),
            // With an error the data are of no use, but the place is kept.
            Err(error) => (Some(error), no_data.get(..usize::from(own.length))?),
        };
        let flags = StatusFlags { alert: false, error };
        reply
            .push(FastSegment {
                id: self.id,
                flags,
                data,
            })
            .ok()
    }

    fn answer_read(&self, own: ReadSpan, now_us: u64, out: &mut [u8]) -> usize {
        if self.status_return_level < 1 {
            return 0;
        }
        match slice_of(&self.table(now_us), own) {
            Ok(data) => status(self.id, None, data, out),
            Err(error) => status(self.id, Some(error), &[], out),
        }
    }

    fn identity(&self, out: &mut [u8]) -> usize {
        let [model_low, model_high] = MODEL.to_le_bytes();
        status(self.id, None, &[model_low, model_high, FIRMWARE], out)
    }

    fn change(&mut self, instruction: Instruction<'_>) -> Result<(), StatusError> {
        match instruction {
            Instruction::Write { address, data } => self.write(address, data),
            Instruction::Reboot => {
                self.status_return_level = 2;
                Ok(())
            }
            _ => Err(StatusError::Instruction),
        }
    }

    fn write(&mut self, address: u16, data: &[u8]) -> Result<(), StatusError> {
        let writable = [ID, STATUS_RETURN_LEVEL]
            .into_iter()
            .find(|register| register.address == address);
        let register = writable.ok_or(StatusError::Access)?;
        let value = match *data {
            [] => return Err(StatusError::DataLength),
            [value] => value,
            _ => return Err(StatusError::Access), // it reaches beyond the register, where nothing can be written
        };
        if register == ID {
            self.id = DeviceId::new(value).ok_or(StatusError::DataRange)?;
        } else if value <= 2 {
            self.status_return_level = value;
        } else {
            return Err(StatusError::DataRange);
        }
        Ok(())
    }

    /// The control table with the newest capture. It is made for each read, so that a read never mixes two captures.
    fn table(&self, now_us: u64) -> [u8; TABLE_LEN] {
        let capture = Capture::newest(now_us, self.cells);
        let mut table = [0; TABLE_LEN];
        let mut put = |register: Register, value: &[u8]| {
            let from = usize::from(register.address);
            table[from..from + value.len()].copy_from_slice(value);
        };
        put(MODEL_NUMBER, &MODEL.to_le_bytes());
        put(FIRMWARE_VERSION, &[FIRMWARE]);
        put(ID, &[self.id.get()]);
        put(STATUS_RETURN_LEVEL, &[self.status_return_level]);
        put(PITCH, &self.pitch.to_le_bytes());
        put(SWITCHES, &[u8::from(self.emergency_stop)]);
        put(SAMPLE, &capture.sample.to_le_bytes());
        put(CAPTURE_TIME, &capture.time_us.to_le_bytes());
        put(CELL_COUNT, &[self.cells as u8]);
        put(VALID_MASK, &capture.valid_mask.to_le_bytes());
        for (cell, position_um) in capture.positions_um[..self.cells].iter().enumerate() {
            let address = FIRST_POSITION.address + FIRST_POSITION.size * cell as u16;
            put(
                Register {
                    address,
                    ..FIRST_POSITION
                },
                &position_um.to_le_bytes(),
            );
        }
        table
    }
}

/// The spans of a sync read. Nothing for an ID that no device can have.
fn spans(ids: &[u8], address: u16, length: u16) -> impl Iterator<Item = Option<ReadSpan>> + use<'_> {
    ids.iter().map(move |&id| {
        let id = DeviceId::new(id)?;
        Some(ReadSpan { id, address, length })
    })
}

/// A stretch of the table. Gaps between registers read as 0.
fn slice_of(table: &[u8; TABLE_LEN], span: ReadSpan) -> Result<&[u8], StatusError> {
    let from = usize::from(span.address);
    match span.length {
        0 => Err(StatusError::DataLength),
        length => table.get(from..from + usize::from(length)).ok_or(StatusError::Access),
    }
}

/// Writes a status packet to the front of `out` and returns its length.
fn status(id: DeviceId, error: Option<StatusError>, data: &[u8], out: &mut [u8]) -> usize {
    let flags = StatusFlags { alert: false, error };
    // The table is shorter than a packet, so it fits.
    StatusPacket { id, flags, data }.encode(out).unwrap_or(0)
}
