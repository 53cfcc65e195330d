//! Bytes of a file that may be truncated or damaged: every access is checked.

/// Byte order and number format of the computer that wrote a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Processor {
    /// Little-endian, IEEE 754.
    Intel,
    /// Little-endian words, VAX floating point.
    Dec,
    /// Big-endian, IEEE 754.
    Mips,
}

impl Processor {
    /// By the number in the parameter section's header.
    pub(super) fn from_code(code: u8) -> Option<Self> {
        match code {
            84 => Some(Self::Intel),
            85 => Some(Self::Dec),
            86 => Some(Self::Mips),
            _ => None,
        }
    }
}

/// A view of bytes, and how to read numbers from them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bytes<'b> {
    pub(super) bytes: &'b [u8],
    pub(super) processor: Processor,
}

impl<'b> Bytes<'b> {
    pub(super) fn slice(&self, at: usize, length: usize) -> Option<&'b [u8]> {
        self.bytes.get(at..at.checked_add(length)?)
    }

    fn array<const N: usize>(&self, at: usize) -> Option<[u8; N]> {
        self.slice(at, N)?.try_into().ok()
    }

    pub(super) fn u8(&self, at: usize) -> Option<u8> {
        self.bytes.get(at).copied()
    }

    pub(super) fn u16(&self, at: usize) -> Option<u16> {
        let bytes = self.array(at)?;
        Some(match self.processor {
            Processor::Mips => u16::from_be_bytes(bytes),
            Processor::Intel | Processor::Dec => u16::from_le_bytes(bytes),
        })
    }

    pub(super) fn i16(&self, at: usize) -> Option<i16> {
        self.u16(at).map(u16::cast_signed)
    }

    pub(super) fn f32(&self, at: usize) -> Option<f32> {
        let bytes: [u8; 4] = self.array(at)?;
        Some(match self.processor {
            Processor::Intel => f32::from_le_bytes(bytes),
            Processor::Mips => f32::from_be_bytes(bytes),
            // The same layout with its words swapped, and an exponent that is larger by 2.
            Processor::Dec => f32::from_le_bytes([bytes[2], bytes[3], bytes[0], bytes[1]]) / 4.0,
        })
    }
}
