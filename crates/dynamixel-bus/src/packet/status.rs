//! The answer of one device.

use super::encode::PacketWriter;
use super::{DeviceId, EncodeError, field};

/// Why a device did not execute an instruction (low seven bits of the error byte).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum StatusError {
    /// Code 1.
    #[error("it failed to process the instruction")]
    ResultFail,
    /// Code 2.
    #[error("it does not know the instruction, or got an Action without a Reg Write")]
    Instruction,
    /// Code 3.
    #[error("the instruction reached it with a wrong CRC: check cable, baud rate and noise")]
    Crc,
    /// Code 4.
    #[error("the value is out of range, or the register is locked by a latched bus watchdog")]
    DataRange,
    /// Code 5.
    #[error("the data is shorter than the register")]
    DataLength,
    /// Code 6.
    #[error("the value exceeds the limit configured in the device")]
    DataLimit,
    /// Code 7.
    #[error("the register cannot be accessed: read-only, absent, or locked while torque is on")]
    Access,
    /// A code that the protocol does not define.
    #[error("unknown error code {0}")]
    Unknown(u8),
}

impl StatusError {
    const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0 => return None,
            1 => Self::ResultFail,
            2 => Self::Instruction,
            3 => Self::Crc,
            4 => Self::DataRange,
            5 => Self::DataLength,
            6 => Self::DataLimit,
            7 => Self::Access,
            other => Self::Unknown(other),
        })
    }

    const fn to_code(self) -> u8 {
        match self {
            Self::ResultFail => 1,
            Self::Instruction => 2,
            Self::Crc => 3,
            Self::DataRange => 4,
            Self::DataLength => 5,
            Self::DataLimit => 6,
            Self::Access => 7,
            Self::Unknown(code) => code & !ALERT,
        }
    }
}

/// Set while the device has a hardware error: its register "hardware error status" says which.
const ALERT: u8 = 0x80;

/// The error byte of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StatusFlags {
    /// The device has a hardware error (bit 0x80); the instruction may have been executed nevertheless.
    pub alert: bool,
    /// Why the instruction was not executed.
    pub error: Option<StatusError>,
}

impl StatusFlags {
    /// Executed, and no hardware error.
    pub const OK: Self = Self {
        alert: false,
        error: None,
    };

    /// From the byte on the wire.
    #[must_use]
    pub const fn from_wire(byte: u8) -> Self {
        Self {
            alert: byte & ALERT != 0,
            error: StatusError::from_code(byte & !ALERT),
        }
    }

    /// The byte on the wire.
    #[must_use]
    pub const fn to_wire(self) -> u8 {
        let code = match self.error {
            None => 0,
            Some(error) => error.to_code(),
        };
        if self.alert { code | ALERT } else { code }
    }
}

/// The answer of one device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StatusPacket<'a> {
    /// The device.
    pub id: DeviceId,
    /// Its error and its alert.
    pub flags: StatusFlags,
    /// The data read; for a ping, the model number (two bytes, little-endian) and the firmware version.
    pub data: &'a [u8],
}

impl StatusPacket<'_> {
    /// Writes the packet to the front of `out` and returns its length.
    ///
    /// # Errors
    /// [`EncodeError`] when it does not fit; the content of `out` is then undefined.
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, EncodeError> {
        let mut writer = PacketWriter::new(out, self.id.get(), field::STATUS_INSTRUCTION);
        writer.byte(self.flags.to_wire());
        writer.bytes(self.data);
        writer.finish()
    }
}
