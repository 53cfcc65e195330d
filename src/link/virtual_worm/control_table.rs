//! A device's control table: bytes at addresses, registers with an access and a range, and what may be read and written.
//!
//! Source of the rules: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0", "Status Packet, Error", and "Control Table, Area".

use crate::link::Register;
use dynamixel_bus::packet::StatusError;

/// Where a register lives, which says who may write it and what a restart does to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Area {
    /// Told by the device, never written.
    ReadOnly,
    /// Kept over a restart; written only while torque is off.
    Eeprom,
    /// Set to its initial value by a restart.
    Ram,
}

/// A register with its rules.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) register: Register,
    pub(super) area: Area,
    pub(super) initial: i64,
    pub(super) min: i64, // below 0: the register is signed
    pub(super) greatest: i64,
}

/// A register that only the device sets.
pub(super) const fn read_only(register: Register, initial: i64) -> Entry {
    Entry {
        register,
        area: Area::ReadOnly,
        initial,
        min: i32::MIN as i64,
        greatest: i32::MAX as i64,
    }
}

/// A register that is kept over a restart.
pub(super) const fn eeprom(register: Register, initial: i64, min: i64, greatest: i64) -> Entry {
    Entry {
        register,
        area: Area::Eeprom,
        initial,
        min,
        greatest,
    }
}

/// A register that a restart resets.
pub(super) const fn ram(register: Register, initial: i64, min: i64, greatest: i64) -> Entry {
    Entry {
        register,
        area: Area::Ram,
        initial,
        min,
        greatest,
    }
}

/// The bytes of a device.
#[derive(Debug, Clone)]
pub(super) struct ControlTable {
    entries: &'static [Entry],
    bytes: Vec<u8>,
}

impl ControlTable {
    /// Every register at its initial value; `len` is the first address behind the table.
    pub(super) fn new(entries: &'static [Entry], len: u16) -> Self {
        let mut table = Self {
            entries,
            bytes: vec![0; usize::from(len)],
        };
        for entry in entries {
            table.set(entry.register, entry.initial);
        }
        table
    }

    /// Sets the registers of an area to their initial values, but for those that `spare` names.
    pub(super) fn reset(&mut self, area: Area, spare: &[Register]) {
        for entry in self.entries {
            if entry.area == area && !spare.contains(&entry.register) {
                self.set(entry.register, entry.initial);
            }
        }
    }

    /// A copy of the bytes of an area, for a backup; bytes of other areas are 0.
    pub(super) fn copy_of(&self, area: Area) -> Vec<u8> {
        let mut copy = vec![0; self.bytes.len()];
        for range in self.ranges_of(area) {
            copy[range.clone()].copy_from_slice(&self.bytes[range]);
        }
        copy
    }

    /// Takes the bytes of an area from a copy.
    pub(super) fn take_from(&mut self, area: Area, copy: &[u8]) {
        for range in self.ranges_of(area) {
            self.bytes[range.clone()].copy_from_slice(&copy[range]);
        }
    }

    /// Takes these registers from a copy.
    pub(super) fn take_registers(&mut self, registers: &[Register], copy: &[u8]) {
        for register in registers {
            let range = usize::from(register.address)..usize::from(register.end());
            self.bytes[range.clone()].copy_from_slice(&copy[range]);
        }
    }

    fn ranges_of(&self, area: Area) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let in_area = self.entries.iter().filter(move |entry| entry.area == area);
        in_area.map(|entry| usize::from(entry.register.address)..usize::from(entry.register.end()))
    }

    /// Value of an unsigned register.
    pub(super) fn get(&self, register: Register) -> u32 {
        self.signed(register) as u32 & (u32::MAX >> (32 - 8 * u32::from(register.size)))
    }

    /// Value of a signed register.
    pub(super) fn signed(&self, register: Register) -> i32 {
        let from = usize::from(register.address);
        read_signed(&self.bytes[from..from + usize::from(register.size)])
    }

    /// Sets a register, keeping as many low bytes as it has.
    pub(super) fn set(&mut self, register: Register, value: i64) {
        let from = usize::from(register.address);
        let size = usize::from(register.size);
        self.bytes[from..from + size].copy_from_slice(&value.to_le_bytes()[..size]);
    }

    /// A stretch of the table. Gaps between registers read as 0.
    ///
    /// # Errors
    /// [`StatusError::Access`] beyond the table, [`StatusError::DataLength`] for no bytes at all.
    pub(super) fn read(&self, address: u16, length: u16) -> Result<&[u8], StatusError> {
        if length == 0 {
            return Err(StatusError::DataLength);
        }
        let from = usize::from(address);
        self.bytes
            .get(from..from + usize::from(length))
            .ok_or(StatusError::Access)
    }

    /// The registers that a write would set, with their values, after the rules that need only the table.
    ///
    /// # Errors
    /// [`StatusError::Access`] for a gap, a read-only register, one behind the table, and EEPROM while `torque_on`;
    /// [`StatusError::DataLength`] when the last register gets too few bytes; [`StatusError::DataRange`].
    pub(super) fn check_write(
        &self,
        address: u16,
        data: &[u8],
        torque_on: bool,
    ) -> Result<Vec<(&'static Entry, i64)>, StatusError> {
        if data.is_empty() {
            return Err(StatusError::DataLength);
        }
        let mut writes = Vec::new();
        let mut rest = data;
        let mut at = address;
        while !rest.is_empty() {
            let entry = self.entries.iter().find(|entry| entry.register.address == at);
            let entry = entry.ok_or(StatusError::Access)?;
            if entry.area == Area::ReadOnly || (entry.area == Area::Eeprom && torque_on) {
                return Err(StatusError::Access);
            }
            let (value, behind) = rest
                .split_at_checked(usize::from(entry.register.size))
                .ok_or(StatusError::DataLength)?;
            let value = if entry.min < 0 {
                i64::from(read_signed(value))
            } else {
                i64::from(read_unsigned(value))
            };
            if !(entry.min..=entry.greatest).contains(&value) {
                return Err(StatusError::DataRange);
            }
            writes.push((entry, value));
            (rest, at) = (behind, entry.register.end());
        }
        Ok(writes)
    }
}

fn read_unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

fn read_signed(bytes: &[u8]) -> i32 {
    let unused_bits = 32 - 8 * bytes.len() as u32; // registers have 1, 2 or 4 bytes
    (read_unsigned(bytes) << unused_bits) as i32 >> unused_bits
}
