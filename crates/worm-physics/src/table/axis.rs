//! What a table depends on, and what it gives.

use super::TableError;

/// Largest force of a table, N, largest factor, largest displacement, m, and largest torque, N m.
const MAX_FORCE_N: f64 = 100.0;
const MAX_FACTOR: f64 = 20.0;
const MAX_DISPLACEMENT_M: f64 = 0.1;
const MAX_TORQUE_N_M: f64 = 10.0;

/// What a table depends on: a quantity of each cell, or one of the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Deformation of the pad, m: positive where the cell is ahead of its tip.
    Deformation,
    /// Rate at which the deformation changes, m/s.
    DeformationRate,
    /// Deformation beyond its own mean over the time that the table remembers, m: what a pad that relaxes still feels.
    RecentDeformation,
    /// Velocity of the cell along the canal, m/s.
    Speed,
    /// Force that the drive holds the cell with, N: that of its contact, its weight along the canal and constant forces.
    Load,
    /// Place of the tip along the canal, m.
    Place,
    /// How far the tip has slid, either way, in the time that the table remembers, m.
    RecentSlide,
    /// Part of a gait cycle since the cell's own step began, 0 to 1.
    Phase,
    /// Slope of the canal, degrees.
    Slope,
    /// Gait cycles since the motion began.
    Time,
    /// Speed of the motor's output either way, rad/s.
    MotorSpeed,
    /// Torque on the gears, N m: the mean of what the motor gives and what holds the output, without its sign.
    GearLoad,
    /// Torque that holds the output, N m: above 0 where it resists the motion, below where it drives the motor.
    OutputLoad,
    /// Angle of the motor's output, rad.
    MotorAngle,
}

impl Axis {
    /// Every axis.
    pub const ALL: [Self; 14] = [
        Self::Deformation,
        Self::DeformationRate,
        Self::RecentDeformation,
        Self::Speed,
        Self::Load,
        Self::Place,
        Self::RecentSlide,
        Self::Phase,
        Self::Slope,
        Self::Time,
        Self::MotorSpeed,
        Self::GearLoad,
        Self::OutputLoad,
        Self::MotorAngle,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Deformation => "deformation",
            Self::DeformationRate => "deformation-rate",
            Self::RecentDeformation => "recent-deformation",
            Self::Speed => "speed",
            Self::Load => "load",
            Self::Place => "place",
            Self::RecentSlide => "recent-slide",
            Self::Phase => "phase",
            Self::Slope => "slope",
            Self::Time => "time",
            Self::MotorSpeed => "motor-speed",
            Self::GearLoad => "gear-load",
            Self::OutputLoad => "output-load",
            Self::MotorAngle => "motor-angle",
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Deformation | Self::RecentDeformation | Self::Place | Self::RecentSlide => "m",
            Self::DeformationRate | Self::Speed => "m/s",
            Self::Load => "N",
            Self::Phase | Self::Time => "cycles",
            Self::Slope => "deg",
            Self::MotorSpeed => "rad/s",
            Self::GearLoad | Self::OutputLoad => "N m",
            Self::MotorAngle => "rad",
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

    /// Whether it is a quantity of the motor, and not of a cell.
    pub fn is_of_motor(self) -> bool {
        matches!(
            self,
            Self::MotorSpeed | Self::GearLoad | Self::OutputLoad | Self::MotorAngle
        )
    }

    /// Whether it depends on a time that is remembered.
    pub fn has_memory(self) -> bool {
        matches!(self, Self::RecentDeformation | Self::RecentSlide)
    }

    /// Whether it changes with the motion within an increment: a force over it is balanced together with the motion.
    pub(super) fn changes_with_motion(self) -> bool {
        matches!(
            self,
            Self::Deformation | Self::DeformationRate | Self::RecentDeformation | Self::Speed | Self::Load
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
            Self::Time | Self::RecentSlide => at,
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
    /// Friction in the motor's gears beside every other, N m.
    MotorFriction,
    /// A torque on the motor's output that returns with the angle, N m, in the direction of the motor's.
    MotorTorque,
}

impl ActsOn {
    /// Everything that there is.
    pub const ALL: [Self; 5] = [
        Self::ContactForce,
        Self::FrictionFactor,
        Self::DriveDisplacement,
        Self::MotorFriction,
        Self::MotorTorque,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::ContactForce => "contact-force",
            Self::FrictionFactor => "friction-factor",
            Self::DriveDisplacement => "drive-displacement",
            Self::MotorFriction => "motor-friction",
            Self::MotorTorque => "motor-torque",
        }
    }

    /// Unit of the values; empty for none.
    pub fn unit(self) -> &'static str {
        match self {
            Self::ContactForce => "N",
            Self::FrictionFactor => "",
            Self::DriveDisplacement => "m",
            Self::MotorFriction | Self::MotorTorque => "N m",
        }
    }

    /// The value that changes nothing.
    pub fn neutral(self) -> f64 {
        match self {
            Self::ContactForce | Self::DriveDisplacement | Self::MotorFriction | Self::MotorTorque => 0.0,
            Self::FrictionFactor => 1.0,
        }
    }

    /// Smallest and largest value.
    pub fn range(self) -> [f64; 2] {
        match self {
            Self::ContactForce => [-MAX_FORCE_N, MAX_FORCE_N],
            Self::FrictionFactor => [0.0, MAX_FACTOR],
            Self::DriveDisplacement => [-MAX_DISPLACEMENT_M, MAX_DISPLACEMENT_M],
            Self::MotorFriction | Self::MotorTorque => [-MAX_TORQUE_N_M, MAX_TORQUE_N_M],
        }
    }

    /// Whether it is about the motor, and not about a cell.
    pub fn is_of_motor(self) -> bool {
        matches!(self, Self::MotorFriction | Self::MotorTorque)
    }

    /// Whether it may depend on a quantity: of the motor on the motor's alone, and a torque that returns with the angle on that.
    pub fn may_depend_on(self, axis: Axis) -> bool {
        match self {
            Self::ContactForce | Self::FrictionFactor | Self::DriveDisplacement => !axis.is_of_motor(),
            Self::MotorFriction => axis.is_of_motor() && axis != Axis::MotorAngle,
            Self::MotorTorque => axis == Axis::MotorAngle,
        }
    }

    /// What a name means.
    ///
    /// # Errors
    /// [`TableError::ActsOn`].
    pub fn named(name: &str) -> Result<Self, TableError> {
        let found = Self::ALL.into_iter().find(|acts_on| acts_on.name() == name);
        found.ok_or_else(|| TableError::ActsOn {
            name: name.to_owned(),
            names: Self::names_with_units(),
        })
    }

    /// Every name with the unit of its values, as a message lists them.
    pub fn names_with_units() -> String {
        let each = Self::ALL.map(|acts_on| match acts_on.unit() {
            "" => format!("\"{}\"", acts_on.name()),
            unit => format!("\"{}\" (values in {unit})", acts_on.name()),
        });
        let (last, others) = each
            .split_last()
            .map_or(("", &[][..]), |(last, others)| (last.as_str(), others));
        format!("{} or {last}", others.join(", "))
    }
}
