//! Registers of a control table.

/// A register of a device's control table: the address of a value and its size (little-endian).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register {
    /// First address.
    pub address: u16,
    /// Number of bytes: 1, 2 or 4.
    pub size: u16,
    /// Name in the manual.
    pub name: &'static str,
}

impl Register {
    /// A register of `size` bytes (1, 2 or 4) at `address`.
    #[must_use]
    pub const fn new(address: u16, size: u16, name: &'static str) -> Self {
        Self { address, size, name }
    }

    /// The first address after the register.
    #[must_use]
    pub const fn end(self) -> u16 {
        self.address + self.size
    }
}

impl core::fmt::Display for Register {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} (register {})", self.name, self.address)
    }
}

/// A block that was read from a control table. Registers are read from it by their addresses in the table.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a, const LEN: usize> {
    /// Address of the first byte.
    pub first_address: u16,
    /// The bytes from there on.
    pub bytes: &'a [u8; LEN],
}

impl<const LEN: usize> Block<'_, LEN> {
    fn at<const SIZE: usize>(&self, register: Register) -> [u8; SIZE] {
        let from = usize::from(register.address - self.first_address);
        core::array::from_fn(|byte| self.bytes[from + byte])
    }

    /// A register as `u8`; it must lie within the block.
    #[must_use]
    pub fn u8(&self, register: Register) -> u8 {
        u8::from_le_bytes(self.at(register))
    }

    /// A register as `u16`; it must lie within the block.
    #[must_use]
    pub fn u16(&self, register: Register) -> u16 {
        u16::from_le_bytes(self.at(register))
    }

    /// A register as `i16`; it must lie within the block.
    #[must_use]
    pub fn i16(&self, register: Register) -> i16 {
        i16::from_le_bytes(self.at(register))
    }

    /// A register as `u32`; it must lie within the block.
    #[must_use]
    pub fn u32(&self, register: Register) -> u32 {
        u32::from_le_bytes(self.at(register))
    }

    /// A register as `i32`; it must lie within the block.
    #[must_use]
    pub fn i32(&self, register: Register) -> i32 {
        i32::from_le_bytes(self.at(register))
    }
}
