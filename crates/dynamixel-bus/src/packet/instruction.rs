//! Instructions of the controller.

use super::encode::PacketWriter;
use super::{BulkWrites, EncodeError, ReadSpans, Recipient, SyncWrites};

/// Instruction codes, e-manual "Protocol 2.0", "Instruction".
mod code {
    pub(super) const PING: u8 = 0x01;
    pub(super) const READ: u8 = 0x02;
    pub(super) const WRITE: u8 = 0x03;
    pub(super) const REG_WRITE: u8 = 0x04;
    pub(super) const ACTION: u8 = 0x05;
    pub(super) const FACTORY_RESET: u8 = 0x06;
    pub(super) const REBOOT: u8 = 0x08;
    pub(super) const CLEAR: u8 = 0x10;
    pub(super) const CONTROL_TABLE_BACKUP: u8 = 0x20;
    pub(super) const SYNC_READ: u8 = 0x82;
    pub(super) const SYNC_WRITE: u8 = 0x83;
    pub(super) const FAST_SYNC_READ: u8 = 0x8A;
    pub(super) const BULK_READ: u8 = 0x92;
    pub(super) const BULK_WRITE: u8 = 0x93;
    pub(super) const FAST_BULK_READ: u8 = 0x9A;
}

/// What to clear (the multi-turn position), then a key that guards against accident: "DXL" and 0x22.
const CLEAR_MULTI_TURN: [u8; 5] = *b"\x01DXL\x22";
/// Guards Control Table Backup against accident: "CTRL".
const BACKUP_KEY: [u8; 4] = *b"CTRL";

/// The scope of a factory reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResetScope {
    /// All settings (0xFF). Devices refuse it from the broadcast ID.
    All,
    /// All but the ID (0x01).
    AllButId,
    /// All but the ID and the baud rate (0x02).
    AllButIdAndBaudRate,
}

/// What Control Table Backup does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BackupAction {
    /// Copies the settings to the backup area (0x01); refused while torque is on.
    Store,
    /// Takes the EEPROM settings from the backup area, then restarts (0x02).
    Restore,
}

/// An instruction with its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instruction<'a> {
    /// Answer with model number and firmware version.
    Ping,
    /// Answer with these bytes.
    Read {
        /// First address.
        address: u16,
        /// Number of bytes.
        length: u16,
    },
    /// Write these bytes.
    Write {
        /// First address.
        address: u16,
        /// What to write there.
        data: &'a [u8],
    },
    /// Write these bytes at the next [`Action`](Self::Action).
    RegWrite {
        /// First address.
        address: u16,
        /// What to write there.
        data: &'a [u8],
    },
    /// Execute a Reg Write.
    Action,
    /// Reset settings.
    FactoryReset(ResetScope),
    /// Restart, which also clears a hardware error.
    Reboot,
    /// Clear whole turns: the present position becomes one within a turn. Refused while the motor moves.
    ClearMultiTurn,
    /// Store or restore settings.
    ControlTableBackup(BackupAction),
    /// Several devices answer with the same addresses, each with a status packet.
    SyncRead {
        /// First address.
        address: u16,
        /// Number of bytes.
        length: u16,
        /// Raw IDs in the order of the answers.
        ids: &'a [u8],
    },
    /// Several devices write bytes to the same address.
    SyncWrite {
        /// First address.
        address: u16,
        /// Device and data.
        writes: SyncWrites<'a>,
    },
    /// As [`SyncRead`](Self::SyncRead), answered in one [`FastReply`](super::FastReply).
    FastSyncRead {
        /// First address.
        address: u16,
        /// Number of bytes.
        length: u16,
        /// Raw IDs in the order of the answers.
        ids: &'a [u8],
    },
    /// Several devices answer with a span each, each with a status packet.
    BulkRead(ReadSpans<'a>),
    /// Several devices write bytes, each to its own address.
    BulkWrite(BulkWrites<'a>),
    /// As [`BulkRead`](Self::BulkRead), answered in one [`FastReply`](super::FastReply).
    FastBulkRead(ReadSpans<'a>),
}

/// An instruction that is not valid, though its CRC is right.
///
/// A device answers it with [`StatusError::Instruction`](super::StatusError::Instruction) when it does not know the code, and
/// [`StatusError::DataLength`](super::StatusError::DataLength) otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MalformedInstruction {
    /// No such instruction.
    #[error("unknown instruction 0x{code:02X}")]
    UnknownCode {
        /// What was found.
        code: u8,
    },
    /// Known, but its parameters are too few, too many or not defined.
    #[error("instruction 0x{code:02X} with {parameter_len} bytes of parameters that do not fit it")]
    Parameters {
        /// The instruction.
        code: u8,
        /// Number of bytes of its parameters.
        parameter_len: usize,
    },
}

impl<'a> Instruction<'a> {
    const fn code(&self) -> u8 {
        match self {
            Self::Ping => code::PING,
            Self::Read { .. } => code::READ,
            Self::Write { .. } => code::WRITE,
            Self::RegWrite { .. } => code::REG_WRITE,
            Self::Action => code::ACTION,
            Self::FactoryReset(_) => code::FACTORY_RESET,
            Self::Reboot => code::REBOOT,
            Self::ClearMultiTurn => code::CLEAR,
            Self::ControlTableBackup(_) => code::CONTROL_TABLE_BACKUP,
            Self::SyncRead { .. } => code::SYNC_READ,
            Self::SyncWrite { .. } => code::SYNC_WRITE,
            Self::FastSyncRead { .. } => code::FAST_SYNC_READ,
            Self::BulkRead(_) => code::BULK_READ,
            Self::BulkWrite(_) => code::BULK_WRITE,
            Self::FastBulkRead(_) => code::FAST_BULK_READ,
        }
    }

    fn write_parameters(&self, writer: &mut PacketWriter<'_>) {
        match *self {
            Self::Ping | Self::Action | Self::Reboot => {}
            Self::Read { address, length } => {
                writer.word(address);
                writer.word(length);
            }
            Self::Write { address, data } | Self::RegWrite { address, data } => {
                writer.word(address);
                writer.bytes(data);
            }
            Self::FactoryReset(scope) => writer.byte(match scope {
                ResetScope::All => 0xFF,
                ResetScope::AllButId => 0x01,
                ResetScope::AllButIdAndBaudRate => 0x02,
            }),
            Self::ClearMultiTurn => writer.bytes(&CLEAR_MULTI_TURN),
            Self::ControlTableBackup(action) => {
                writer.byte(match action {
                    BackupAction::Store => 0x01,
                    BackupAction::Restore => 0x02,
                });
                writer.bytes(&BACKUP_KEY);
            }
            Self::SyncRead { address, length, ids } | Self::FastSyncRead { address, length, ids } => {
                writer.word(address);
                writer.word(length);
                writer.bytes(ids);
            }
            Self::SyncWrite { address, writes } => {
                writer.word(address);
                writer.word(writes.length());
                writer.bytes(writes.as_bytes());
            }
            Self::BulkRead(spans) | Self::FastBulkRead(spans) => writer.bytes(spans.as_bytes()),
            Self::BulkWrite(writes) => writer.bytes(writes.as_bytes()),
        }
    }

    /// From a code and its unstuffed parameters.
    pub(super) fn parse(code: u8, parameters: &'a [u8]) -> Result<Self, MalformedInstruction> {
        let parsed = match code {
            code::PING => parameters.is_empty().then_some(Self::Ping),
            code::READ => match split_words(parameters) {
                Some((address, length, [])) => Some(Self::Read { address, length }),
                _ => None,
            },
            code::WRITE => split_word(parameters).map(|(address, data)| Self::Write { address, data }),
            code::REG_WRITE => split_word(parameters).map(|(address, data)| Self::RegWrite { address, data }),
            code::ACTION => parameters.is_empty().then_some(Self::Action),
            code::FACTORY_RESET => match parameters {
                [0xFF] => Some(Self::FactoryReset(ResetScope::All)),
                [0x01] => Some(Self::FactoryReset(ResetScope::AllButId)),
                [0x02] => Some(Self::FactoryReset(ResetScope::AllButIdAndBaudRate)),
                _ => None,
            },
            code::REBOOT => parameters.is_empty().then_some(Self::Reboot),
            code::CLEAR => (*parameters == CLEAR_MULTI_TURN).then_some(Self::ClearMultiTurn),
            code::CONTROL_TABLE_BACKUP => match parameters {
                [0x01, key @ ..] if *key == BACKUP_KEY => Some(Self::ControlTableBackup(BackupAction::Store)),
                [0x02, key @ ..] if *key == BACKUP_KEY => Some(Self::ControlTableBackup(BackupAction::Restore)),
                _ => None,
            },
            code::SYNC_READ => {
                split_words(parameters).map(|(address, length, ids)| Self::SyncRead { address, length, ids })
            }
            code::FAST_SYNC_READ => {
                split_words(parameters).map(|(address, length, ids)| Self::FastSyncRead { address, length, ids })
            }
            code::SYNC_WRITE => split_words(parameters).and_then(|(address, length, records)| {
                SyncWrites::new(length, records).map(|writes| Self::SyncWrite { address, writes })
            }),
            code::BULK_READ => ReadSpans::from_parameters(parameters).map(Self::BulkRead),
            code::FAST_BULK_READ => ReadSpans::from_parameters(parameters).map(Self::FastBulkRead),
            code::BULK_WRITE => BulkWrites::new(parameters).map(Self::BulkWrite),
            _ => return Err(MalformedInstruction::UnknownCode { code }),
        };
        parsed.ok_or(MalformedInstruction::Parameters {
            code,
            parameter_len: parameters.len(),
        })
    }
}

fn split_word(bytes: &[u8]) -> Option<(u16, &[u8])> {
    let (word, rest) = bytes.split_first_chunk()?;
    Some((u16::from_le_bytes(*word), rest))
}

fn split_words(bytes: &[u8]) -> Option<(u16, u16, &[u8])> {
    let (first, rest) = split_word(bytes)?;
    let (second, rest) = split_word(rest)?;
    Some((first, second, rest))
}

/// An instruction and its recipient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InstructionPacket<'a> {
    /// The recipient. Sync and bulk instructions are for [`Recipient::All`].
    pub recipient: Recipient,
    /// What to do.
    pub instruction: Instruction<'a>,
}

impl InstructionPacket<'_> {
    /// Writes the packet to the front of `out` and returns its length.
    ///
    /// # Errors
    /// [`EncodeError`] when it does not fit; the content of `out` is then undefined.
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, EncodeError> {
        let mut writer = PacketWriter::new(out, self.recipient.to_wire(), self.instruction.code());
        self.instruction.write_parameters(&mut writer);
        writer.finish()
    }
}
