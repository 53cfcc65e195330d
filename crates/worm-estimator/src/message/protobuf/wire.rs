//! The wire format of Protocol Buffers: tags, varints and runs of bytes.

/// How a field is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wire {
    Varint = 0,
    Fixed64 = 1,
    LengthDelimited = 2,
    Fixed32 = 5,
}

/// Most bytes of a varint.
const MAX_VARINT: usize = 10;

pub(super) fn tag(number: u64, wire: Wire, out: &mut Vec<u8>) {
    varint(number << 3 | wire as u64, out);
}

pub(super) fn varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// Numbers near zero as small ones, whatever their sign.
pub(super) const fn zigzag(value: i32) -> u32 {
    (value << 1 ^ value >> 31).cast_unsigned()
}

pub(super) const fn from_zigzag(value: u32) -> i32 {
    (value >> 1).cast_signed() ^ -(value & 1).cast_signed()
}

/// The bytes end before what they announce, or are no wire format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Truncated;

/// Reads from the front of some bytes.
pub(super) struct Reader<'b>(&'b [u8]);

impl<'b> Reader<'b> {
    pub(super) const fn new(bytes: &'b [u8]) -> Self {
        Self(bytes)
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// A field's number and how it is laid out.
    pub(super) fn tag(&mut self) -> Result<(u64, Wire), Truncated> {
        let tag = self.varint()?;
        let wire = match tag & 7 {
            0 => Wire::Varint,
            1 => Wire::Fixed64,
            2 => Wire::LengthDelimited,
            5 => Wire::Fixed32,
            _ => return Err(Truncated),
        };
        Ok((tag >> 3, wire))
    }

    pub(super) fn varint(&mut self) -> Result<u64, Truncated> {
        let mut value = 0_u64;
        for (place, &byte) in self.0.iter().take(MAX_VARINT).enumerate() {
            let part = u64::from(byte & 0x7f);
            if place + 1 == MAX_VARINT && part > 1 {
                return Err(Truncated);
            }
            value |= part << (7 * place);
            if byte & 0x80 == 0 {
                self.0 = &self.0[place + 1..];
                return Ok(value);
            }
        }
        Err(Truncated)
    }

    pub(super) fn fixed64(&mut self) -> Result<[u8; 8], Truncated> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or(Truncated)?;
        self.0 = rest;
        Ok(*bytes)
    }

    /// As many bytes as the length before them says.
    pub(super) fn bytes(&mut self) -> Result<&'b [u8], Truncated> {
        let length = usize::try_from(self.varint()?).map_err(|_| Truncated)?;
        let (bytes, rest) = self.0.split_at_checked(length).ok_or(Truncated)?;
        self.0 = rest;
        Ok(bytes)
    }
}
