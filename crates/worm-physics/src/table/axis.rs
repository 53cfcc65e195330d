//! What a table depends on, and what it gives.

use super::TableError;

/// Largest force of a table, N, largest factor, and largest displacement, m.
const MAX_FORCE_N: f64 = 100.0;
const MAX_FACTOR: f64 = 20.0;
const MAX_DISPLACEMENT_M: f64 = 0.1;

/// What a table depends on, for each cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Deformation of the pad, m: positive where the cell is ahead of its tip.
    Deformation,
    /// Rate at which the deformation changes, m/s.
    DeformationRate,
    /// Velocity of the cell along the canal, m/s.
    Speed,
    /// Force that the drive holds the cell with, N: that of its contact, its weight along the canal and constant forces.
    Load,
    /// Place of the tip along the canal, m.
    Place,
    /// Part of a gait cycle since the cell's own step began, 0 to 1.
    Phase,
    /// Slope of the canal, degrees.
    Slope,
    /// Gait cycles since the motion began.
    Time,
}

impl Axis {
    /// Every axis.
    pub const ALL: [Self; 8] = [
        Self::Deformation,
        Self::DeformationRate,
        Self::Speed,
        Self::Load,
        Self::Place,
        Self::Phase,
        Self::Slope,
        Self::Time,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Deformation => "deformation",
            Self::DeformationRate => "deformation-rate",
            Self::Speed => "speed",
            Self::Load => "load",
            Self::Place => "place",
            Self::Phase => "phase",
            Self::Slope => "slope",
            Self::Time => "time",
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Deformation | Self::Place => "m",
            Self::DeformationRate | Self::Speed => "m/s",
            Self::Load => "N",
            Self::Phase | Self::Time => "cycles",
            Self::Slope => "deg",
        }
    }

    /// The axis of a name.
    ///
    /// # Errors
    /// [`TableError::Axis`].
    pub fn named(name: &str) -> Result<Self, TableError> {
        let found = Self::ALL.into_iter().find(|axis| axis.name() == name);
        found.ok_or_else(|| TableError::Axis {
            name: name.to_owned(),
            names: Self::ALL.map(Self::name).join(", "),
        })
    }

    /// Whether it changes with the motion within an increment: a force over it is balanced together with the motion.
    pub(super) fn changes_with_motion(self) -> bool {
        matches!(
            self,
            Self::Deformation | Self::DeformationRate | Self::Speed | Self::Load
        )
    }

    /// Whether one cycle cannot be like the next where something depends on it.
    pub(super) fn is_aperiodic(self) -> bool {
        matches!(self, Self::Place | Self::Time)
    }

    /// Where a point of it lies for a worm of some cells that is seen from the other end of the canal. In reverse a step ends where it
    /// began.
    pub(super) fn mirrored(self, at: f64, cells: usize) -> f64 {
        match self {
            Self::Time => at,
            Self::Phase => ((cells as f64).recip() - at).rem_euclid(1.0),
            _ => -at,
        }
    }
}

/// What a table gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActsOn {
    /// A force on each cell beside that of its contact, N, positive towards smaller positions.
    ContactForce,
    /// A factor on the friction of each tip.
    FrictionFactor,
    /// How far ahead of where its cam has it the drive holds each cell, m.
    DriveDisplacement,
}

impl ActsOn {
    /// Everything that there is.
    pub const ALL: [Self; 3] = [Self::ContactForce, Self::FrictionFactor, Self::DriveDisplacement];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::ContactForce => "contact-force",
            Self::FrictionFactor => "friction-factor",
            Self::DriveDisplacement => "drive-displacement",
        }
    }

    /// Unit of the values; empty for none.
    pub fn unit(self) -> &'static str {
        match self {
            Self::ContactForce => "N",
            Self::FrictionFactor => "",
            Self::DriveDisplacement => "m",
        }
    }

    /// The value that changes nothing.
    pub fn neutral(self) -> f64 {
        match self {
            Self::ContactForce | Self::DriveDisplacement => 0.0,
            Self::FrictionFactor => 1.0,
        }
    }

    /// Smallest and largest value.
    pub fn range(self) -> [f64; 2] {
        match self {
            Self::ContactForce => [-MAX_FORCE_N, MAX_FORCE_N],
            Self::FrictionFactor => [0.0, MAX_FACTOR],
            Self::DriveDisplacement => [-MAX_DISPLACEMENT_M, MAX_DISPLACEMENT_M],
        }
    }

    /// What a name means.
    ///
    /// # Errors
    /// [`TableError::ActsOn`].
    pub fn named(name: &str) -> Result<Self, TableError> {
        let found = Self::ALL.into_iter().find(|acts_on| acts_on.name() == name);
        found.ok_or_else(|| TableError::ActsOn { name: name.to_owned() })
    }
}
