//! DYNAMIXEL Protocol 2.0: bytes on the wire ⇄ valid values, in both directions.
//!
//! A packet on the wire:
//!
//! | byte | 0 | 1 | 2 | 3 | 4 | 5, 6 | 7 | 8 … | last two |
//! |---|---|---|---|---|---|---|---|---|---|
//! | | `FF` | `FF` | `FD` | `00` | ID | length (little-endian) | instruction | parameters | CRC-16 (little-endian) |
//!
//! The length counts everything after it. The CRC covers everything before it. Inside instruction and
//! parameters, `FF FF FD` is followed by an extra `FD` (byte stuffing), so that a header never occurs in a payload.
//!
//! In the order in which a transaction uses them:
//!
//! 1. [`InstructionPacket`] is a request of the controller; [`encode`](InstructionPacket::encode) writes it into any buffer.
//! 2. [`Decoder`] turns a stream of bytes, however cut and however noisy, into [`Packet`]s.
//! 3. [`StatusPacket`] is the answer of one device: an error, an alert, data.
//! 4. [`FastReply`] is the joint answer of several devices to a fast sync or fast bulk read: a single packet from the broadcast ID,
//!    **not** byte-stuffed. Each segment has a CRC of its own, so that the first device's data is good even when the second one is
//!    silent. [`FastReplyWriter`] is the devices' side of it.
//!
//! Both ends use the same types: the controller encodes instructions and decodes statuses, a device the reverse.
//! Nothing here allocates, blocks or panics, whatever the input.
//!
//! Source: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0"; byte-exact against the examples there and the official SDK.

mod decoder;
mod encode;
mod fast;
mod id;
mod instruction;
mod lists;
mod status;
#[cfg(test)]
mod tests;

pub use decoder::{DecodeError, Decoder};
pub use encode::EncodeError;
pub use fast::{FastReply, FastReplyWriter, FastSegment, SegmentError};
pub use id::{BROADCAST_ID, DeviceId, Recipient};
pub use instruction::{BackupAction, Instruction, InstructionPacket, MalformedInstruction, ResetScope};
pub use lists::{BulkWrite, BulkWrites, ReadSpan, ReadSpans, SyncWrites};
pub use status::{StatusError, StatusFlags, StatusPacket};

use crc::{CRC_16_UMTS, Crc, Digest, Table};

/// Longest packet that is encoded or decoded here, in bytes, header and CRC included.
///
/// The protocol allows more, but few control tables are longer than this. A longer length field is taken for noise.
pub const MAX_PACKET_LEN: usize = 512;

/// The layout of a packet.
mod field {
    use core::ops::Range;

    pub(super) const HEADER: [u8; 4] = [0xFF, 0xFF, 0xFD, 0x00];
    pub(super) const ID: usize = 4;
    pub(super) const LENGTH: Range<usize> = 5..7;
    /// First byte that the length field counts.
    pub(super) const INSTRUCTION: usize = 7;
    pub(super) const PARAMETERS: usize = 8;
    pub(super) const CRC_LEN: usize = 2;
    /// Instruction and CRC: the smallest value of a length field.
    pub(super) const MIN_LENGTH_FIELD: usize = 3;
    /// Instruction code that marks an answer.
    pub(super) const STATUS_INSTRUCTION: u8 = 0x55;
}

// Sixteen tables (8 KiB) instead of one: the CRC dominates the cost of encoding and decoding.
static CRC: Crc<u16, Table<16>> = Crc::<u16, Table<16>>::new(&CRC_16_UMTS);

fn crc_of(bytes: &[u8]) -> u16 {
    CRC.checksum(bytes)
}

fn crc_digest() -> Digest<'static, u16, Table<16>> {
    CRC.digest()
}

/// A packet from the [`Decoder`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packet<'a> {
    /// From the controller (or an echo of one's own request).
    Instruction(InstructionPacket<'a>),
    /// From one device.
    Status(StatusPacket<'a>),
    /// From all devices of a fast read together.
    FastReply(FastReply<'a>),
}
