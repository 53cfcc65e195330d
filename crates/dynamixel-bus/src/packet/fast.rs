//! The joint answer to a fast sync or fast bulk read.
//!
//! | `FF FF FD 00` | `FE` | length | `55` | segment of the first device | segment of the second | … |
//! |---|---|---|---|---|---|---|
//!
//! where a segment is `error, ID, data …, CRC low, CRC high`. The first device sends the header with the length of the whole
//! packet; each further one appends its segment when it has heard the one before. So
//! - each segment's CRC covers **everything** from the header on, earlier segments and their CRCs included, and the last
//!   one is the CRC of the packet;
//! - nothing is byte-stuffed, because the first device does not know the data of the others;
//! - when a device is silent the packet ends early, and the segments before it are still good.
//!
//! Source: e-manual "Fast Bulk Read"; its example's CRCs are in the tests.

use super::encode::EncodeError;
use super::{BROADCAST_ID, DeviceId, MAX_PACKET_LEN, ReadSpan, StatusFlags, crc_digest, crc_of, field};

/// Error byte, ID and CRC: what a segment adds to its data.
const SEGMENT_OVERHEAD: usize = 4;

/// A fast reply, whole or cut short.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FastReply<'a> {
    bytes: &'a [u8], // begins with a whole header, at least field::PARAMETERS long
    crc_checked: bool,
}

/// The part of one device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FastSegment<'a> {
    /// The device.
    pub id: DeviceId,
    /// Its error and its alert.
    pub flags: StatusFlags,
    /// The data read.
    pub data: &'a [u8],
}

/// Why a fast reply has no valid data of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SegmentError {
    /// The reply ends before or within the segment.
    #[error("the reply ends before the data of device {0}: is it connected, powered and of this baud rate?")]
    Missing(DeviceId),
    /// The segment or an earlier one is damaged.
    #[error("the CRC of device {0}'s segment is wrong: check cable, length and termination")]
    Crc(DeviceId),
    /// Another device answered in its place.
    #[error("device {expected} was asked, ID {found} answered in its place: look for a device with a doubled ID")]
    WrongId {
        /// The device that was asked.
        expected: DeviceId,
        /// Raw ID found.
        found: u8,
    },
}

impl<'a> FastReply<'a> {
    /// From bytes that begin with a header; none when it is not the header of a fast reply.
    pub(super) fn new(bytes: &'a [u8], crc_checked: bool) -> Option<Self> {
        let head = bytes.get(..field::PARAMETERS)?;
        let is_fast_reply = head.starts_with(&field::HEADER)
            && head[field::ID] == BROADCAST_ID
            && head[field::INSTRUCTION] == field::STATUS_INSTRUCTION;
        is_fast_reply.then_some(Self { bytes, crc_checked })
    }

    /// Whether it is whole and its last CRC, which covers all of it, is right.
    #[must_use]
    pub const fn is_intact(&self) -> bool {
        self.crc_checked
    }

    /// The segments in the order of the request, each checked by its own CRC.
    ///
    /// `spans` are those of the request. After the first error every further device has an error, too, because a segment can be
    /// located only by the ones before it.
    pub fn segments<I>(self, spans: I) -> impl Iterator<Item = Result<FastSegment<'a>, SegmentError>>
    where
        I: IntoIterator<Item = ReadSpan>,
    {
        let mut from = field::PARAMETERS;
        let mut digest = crc_digest();
        let mut digested = 0;
        let mut broken: Option<fn(DeviceId) -> SegmentError> = None;
        spans.into_iter().map(move |span| {
            if let Some(error) = broken {
                return Err(error(span.id));
            }
            let data_end = from + 2 + usize::from(span.length);
            let segment_end = data_end + field::CRC_LEN;
            let Some(&[error_byte, id, ref rest @ ..]) = self.bytes.get(from..segment_end) else {
                broken = Some(SegmentError::Missing);
                return Err(SegmentError::Missing(span.id));
            };
            let (data, crc) = rest.split_at(usize::from(span.length));
            if !self.crc_checked {
                digest.update(&self.bytes[digested..data_end]);
                digested = data_end;
                if crc != digest.clone().finalize().to_le_bytes() {
                    broken = Some(SegmentError::Crc);
                    return Err(SegmentError::Crc(span.id));
                }
            }
            if id != span.id.get() {
                broken = Some(SegmentError::Missing);
                return Err(SegmentError::WrongId {
                    expected: span.id,
                    found: id,
                });
            }
            from = segment_end;
            Ok(FastSegment {
                id: span.id,
                flags: StatusFlags::from_wire(error_byte),
                data,
            })
        })
    }
}

/// Writes a fast reply as the devices on a bus build it: header, then one segment after another.
///
/// The first [`len`](Self::len) bytes are valid at any time: for a silent device, push no further segment.
#[derive(Debug)]
pub struct FastReplyWriter<'o, I> {
    out: &'o mut [u8],
    len: usize,
    expected_lengths: I,
}

impl<'o, I: Iterator<Item = u16> + Clone> FastReplyWriter<'o, I> {
    /// Begins a reply in `out`. `data_lengths` are the numbers of bytes requested from the devices, in the order of the request.
    ///
    /// # Errors
    /// [`EncodeError`] when the whole reply is too long for `out` or for a packet.
    pub fn new(out: &'o mut [u8], data_lengths: I) -> Result<Self, EncodeError> {
        let segments_len: usize = data_lengths
            .clone()
            .map(|length| usize::from(length) + SEGMENT_OVERHEAD)
            .sum();
        let packet_len = field::PARAMETERS + segments_len;
        if packet_len > MAX_PACKET_LEN {
            return Err(EncodeError::TooLong);
        }
        if packet_len > out.len() {
            return Err(EncodeError::BufferTooSmall { buffer_len: out.len() });
        }
        let counted = (packet_len - field::INSTRUCTION) as u16; // at most MAX_PACKET_LEN
        out[..field::HEADER.len()].copy_from_slice(&field::HEADER);
        out[field::ID] = BROADCAST_ID;
        out[field::LENGTH].copy_from_slice(&counted.to_le_bytes());
        out[field::INSTRUCTION] = field::STATUS_INSTRUCTION;
        Ok(Self {
            out,
            len: field::PARAMETERS,
            expected_lengths: data_lengths,
        })
    }

    /// Appends the next device's segment.
    ///
    /// # Errors
    /// [`EncodeError::SegmentLength`] when the data has another length than requested from this device.
    pub fn push(&mut self, segment: FastSegment<'_>) -> Result<(), EncodeError> {
        let expected = usize::from(self.expected_lengths.next().unwrap_or(0));
        let found = segment.data.len();
        let room = self.out.get_mut(self.len..self.len + found + SEGMENT_OVERHEAD);
        let (true, Some(room)) = (found == expected, room) else {
            return Err(EncodeError::SegmentLength { expected, found });
        };
        room[0] = segment.flags.to_wire();
        room[1] = segment.id.get();
        room[2..2 + found].copy_from_slice(segment.data);
        let data_end = self.len + 2 + found;
        let crc = crc_of(&self.out[..data_end]);
        self.out[data_end..data_end + field::CRC_LEN].copy_from_slice(&crc.to_le_bytes());
        self.len = data_end + field::CRC_LEN;
        Ok(())
    }

    /// Number of bytes to send.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "never empty: it begins with a header")]
    pub const fn len(&self) -> usize {
        self.len
    }
}
