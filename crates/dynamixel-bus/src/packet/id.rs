//! IDs of devices.

/// The ID that all devices listen to, and that a fast reply comes from.
pub const BROADCAST_ID: u8 = 0xFE;

/// The ID of one device, 0 to 252.
///
/// 253 and 255 are reserved by the protocol, 254 is [`BROADCAST_ID`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DeviceId(u8); // in 0..=252

impl DeviceId {
    /// The greatest ID a device can have.
    pub const MAX: Self = Self(252);

    /// The device with this ID; none for 253 to 255.
    #[must_use]
    pub const fn new(id: u8) -> Option<Self> {
        if id <= Self::MAX.0 { Some(Self(id)) } else { None }
    }

    /// The byte on the wire.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl core::fmt::Display for DeviceId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.0.fmt(f)
    }
}

/// The recipient of an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recipient {
    /// One device.
    One(DeviceId),
    /// Every device on the bus.
    All,
}

impl Recipient {
    /// The recipient with this ID on the wire; none for the reserved IDs 253 and 255.
    #[must_use]
    pub const fn from_wire(id: u8) -> Option<Self> {
        if id == BROADCAST_ID {
            return Some(Self::All);
        }
        match DeviceId::new(id) {
            Some(device) => Some(Self::One(device)),
            None => None,
        }
    }

    /// The byte on the wire.
    #[must_use]
    pub const fn to_wire(self) -> u8 {
        match self {
            Self::One(device) => device.get(),
            Self::All => BROADCAST_ID,
        }
    }
}
