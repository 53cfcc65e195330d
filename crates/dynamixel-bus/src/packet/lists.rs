//! The lists in sync and bulk instructions: devices, addresses, lengths, data.

use super::DeviceId;

/// A span of one device's control table, for a bulk read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadSpan {
    /// The device to read.
    pub id: DeviceId,
    /// First address.
    pub address: u16,
    /// Number of bytes.
    pub length: u16,
}

impl ReadSpan {
    /// Bytes of a span in a packet.
    pub const WIRE_LEN: usize = 5;

    /// The span in a packet: ID, address, length, little-endian.
    #[must_use]
    pub const fn to_wire(self) -> [u8; Self::WIRE_LEN] {
        let [address_low, address_high] = self.address.to_le_bytes();
        let [length_low, length_high] = self.length.to_le_bytes();
        [self.id.get(), address_low, address_high, length_low, length_high]
    }

    fn from_wire(wire: &[u8; Self::WIRE_LEN]) -> Option<Self> {
        let [id, address_low, address_high, length_low, length_high] = *wire;
        Some(Self {
            id: DeviceId::new(id)?,
            address: u16::from_le_bytes([address_low, address_high]),
            length: u16::from_le_bytes([length_low, length_high]),
        })
    }
}

/// The spans of a bulk read, in the order in which the devices answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadSpans<'a>(&'a [[u8; ReadSpan::WIRE_LEN]]); // each with a valid device ID

impl<'a> ReadSpans<'a> {
    /// From spans of [`ReadSpan::to_wire`]; none when one of them has an invalid ID.
    #[must_use]
    pub fn new(wire: &'a [[u8; ReadSpan::WIRE_LEN]]) -> Option<Self> {
        wire.iter()
            .all(|span| ReadSpan::from_wire(span).is_some())
            .then_some(Self(wire))
    }

    /// From spans of [`ReadSpan::to_wire`], whose IDs are valid by type.
    #[must_use]
    pub const fn from_valid(wire: &'a [[u8; ReadSpan::WIRE_LEN]]) -> Self {
        Self(wire)
    }

    pub(super) fn from_parameters(parameters: &'a [u8]) -> Option<Self> {
        let (wire, rest) = parameters.as_chunks();
        if rest.is_empty() { Self::new(wire) } else { None }
    }

    pub(super) fn as_bytes(self) -> &'a [u8] {
        self.0.as_flattened()
    }

    /// The spans one by one.
    pub fn iter(self) -> impl Iterator<Item = ReadSpan> + Clone + 'a {
        self.0.iter().filter_map(ReadSpan::from_wire)
    }
}

/// The writes of a sync write: the same addresses of several devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SyncWrites<'a> {
    length: u16,       // at least 1
    records: &'a [u8], // a multiple of 1 + length: ID, data
}

impl<'a> SyncWrites<'a> {
    /// From records of an ID and `length` bytes each; none when they do not divide evenly or have an invalid ID.
    #[must_use]
    pub fn new(length: u16, records: &'a [u8]) -> Option<Self> {
        let record_len = usize::from(length) + 1;
        let whole = length > 0 && records.len().is_multiple_of(record_len);
        let writes = Self { length, records };
        (whole && writes.ids_are_valid()).then_some(writes)
    }

    fn ids_are_valid(&self) -> bool {
        self.iter().count() == self.records.len() / (usize::from(self.length) + 1)
    }

    /// Number of bytes for each device.
    #[must_use]
    pub const fn length(&self) -> u16 {
        self.length
    }

    pub(super) const fn as_bytes(&self) -> &'a [u8] {
        self.records
    }

    /// Device and data, one by one.
    pub fn iter(&self) -> impl Iterator<Item = (DeviceId, &'a [u8])> + Clone + 'a {
        self.records
            .chunks_exact(usize::from(self.length) + 1)
            .filter_map(|record| {
                let (&id, data) = record.split_first()?;
                Some((DeviceId::new(id)?, data))
            })
    }
}

/// One write of a bulk write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BulkWrite<'a> {
    /// The device to write.
    pub id: DeviceId,
    /// First address.
    pub address: u16,
    /// The bytes.
    pub data: &'a [u8],
}

/// The writes of a bulk write: any span of each of several devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BulkWrites<'a>(&'a [u8]); // whole records: span, then as many bytes as it says

impl<'a> BulkWrites<'a> {
    /// From records of a [`ReadSpan`] on the wire followed by as many bytes as it says; none when they are not
    /// whole or have an invalid ID.
    #[must_use]
    pub fn new(records: &'a [u8]) -> Option<Self> {
        let mut rest = records;
        while !rest.is_empty() {
            (_, rest) = split_write(rest)?;
        }
        Some(Self(records))
    }

    pub(super) const fn as_bytes(self) -> &'a [u8] {
        self.0
    }

    /// The writes one by one.
    pub fn iter(self) -> impl Iterator<Item = BulkWrite<'a>> + Clone + 'a {
        let mut rest = self.0;
        core::iter::from_fn(move || {
            let (write, behind) = split_write(rest)?;
            rest = behind;
            Some(write)
        })
    }
}

fn split_write(records: &[u8]) -> Option<(BulkWrite<'_>, &[u8])> {
    let (wire, rest) = records.split_first_chunk()?;
    let span = ReadSpan::from_wire(wire)?;
    let (data, rest) = rest.split_at_checked(usize::from(span.length))?;
    Some((
        BulkWrite {
            id: span.id,
            address: span.address,
            data,
        },
        rest,
    ))
}
