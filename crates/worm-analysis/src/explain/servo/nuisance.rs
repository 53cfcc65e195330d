//! What is not known exactly of a servo, with priors, and the friction table of the free form.

use crate::explain::search::parameter::{Free, What};
use crate::least_squares::Quantity;
use std::sync::Arc;
use worm_physics::servo::{ServoMotor, ServoPhysics};
use worm_physics::{ActsOn, Axis, Table};

/// A quantity of the servo that is not known exactly and that no effect is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Nuisance {
    /// Logarithm of a factor on the torque constant.
    TorqueConstant,
    /// Logarithm of a factor on the resistance of winding and bridge.
    Winding,
    /// Logarithm of a factor on the rotor's inertia.
    Rotor,
    /// Dry friction, N m.
    Dry,
    /// Viscous friction, N m s/rad.
    Viscous,
    /// Angle at which the arm hangs down, beyond the nominal one, rad.
    Zero,
    /// An entry of the free friction table, N m.
    Table(usize),
}

const OF_ALL: [Nuisance; 6] = [
    Nuisance::TorqueConstant,
    Nuisance::Winding,
    Nuisance::Rotor,
    Nuisance::Dry,
    Nuisance::Viscous,
    Nuisance::Zero,
];
/// Standard deviation of the prior, limits about the centre, and step of derivatives: of the logarithms, the torque constant as a data sheet
/// gives it, the winding with bridge and leads, the rotor by a guess.
const TORQUE_CONSTANT: (f64, f64, f64) = (0.1, 0.4, 5e-3);
const WINDING: (f64, f64, f64) = (0.25, 0.8, 5e-3);
const ROTOR: (f64, f64, f64) = (0.4, 1.5, 2e-2);
/// An arm is put on by eye: about 1°.
const ZERO_RAD: (f64, f64, f64) = (0.02, 0.1, 1e-3);
/// Of frictions, beside the nominal value, which is the standard deviation, too: the largest, and the step.
const DRY_N_M: (f64, f64) = (0.2, 5e-4);
const VISCOUS_N_M_S: (f64, f64) = (0.1, 2e-4);
/// Standard deviation, largest value and step of an entry of the free friction table, N m.
const TABLE_N_M: (f64, f64, f64) = (0.1, 0.5, 1e-3);
/// Speeds and loads at which it has its entries.
const TABLE_SPEEDS_RAD_S: [f64; 5] = [0.0, 0.4, 1.5, 4.0, 10.0];
const TABLE_LOADS_N_M: [f64; 4] = [0.0, 0.15, 0.35, 0.7];
const TABLE_ENTRIES: usize = TABLE_SPEEDS_RAD_S.len() * TABLE_LOADS_N_M.len();

impl Nuisance {
    /// Everything that the recalibration may change.
    pub fn all(motor: &ServoMotor) -> Vec<Free> {
        OF_ALL.into_iter().map(|nuisance| nuisance.free(motor)).collect()
    }

    /// The free friction table.
    pub fn table(motor: &ServoMotor) -> Vec<Free> {
        (0..TABLE_ENTRIES).map(|entry| Self::Table(entry).free(motor)).collect()
    }

    /// What a free quantity is; none for an effect's.
    pub fn of(what: What) -> Option<Self> {
        let What::Nuisance(number) = what else {
            return None;
        };
        Some(
            OF_ALL
                .get(number)
                .copied()
                .unwrap_or_else(|| Self::Table(number - OF_ALL.len())),
        )
    }

    fn number(self) -> usize {
        match self {
            Self::Table(entry) => OF_ALL.len() + entry,
            other => OF_ALL.iter().position(|one| *one == other).unwrap_or(0),
        }
    }

    fn free(self, motor: &ServoMotor) -> Free {
        let about = |centre: f64, (sigma, reach, step): (f64, f64, f64)| Quantity {
            centre,
            sigma,
            min: centre - reach,
            max: centre + reach,
            step,
        };
        let friction = |nominal: f64, least: f64, (max, step): (f64, f64)| Quantity {
            centre: nominal,
            sigma: nominal.max(least),
            min: 0.0,
            max,
            step,
        };
        let quantity = match self {
            Self::TorqueConstant => about(0.0, TORQUE_CONSTANT),
            Self::Winding => about(0.0, WINDING),
            Self::Rotor => about(0.0, ROTOR),
            Self::Dry => friction(motor.dry_n_m, 5e-3, DRY_N_M),
            Self::Viscous => friction(motor.viscous_n_m_s, 2e-3, VISCOUS_N_M_S),
            Self::Zero => about(0.0, ZERO_RAD),
            Self::Table(_) => about(0.0, TABLE_N_M),
        };
        Free {
            what: What::Nuisance(self.number()),
            quantity,
        }
    }

    /// Gives a servo this value; an entry of the free table counts in [`free_table`] alone.
    pub fn apply(self, value: f64, physics: &mut ServoPhysics) {
        let motor = &mut physics.motor;
        match self {
            Self::TorqueConstant => motor.torque_constant *= value.exp(),
            Self::Winding => motor.winding_ohm *= value.exp(),
            Self::Rotor => motor.rotor_inertia_kg_m2 *= value.exp(),
            Self::Dry => motor.dry_n_m = value,
            Self::Viscous => motor.viscous_n_m_s = value,
            Self::Zero => physics.pendulum.zero_rad += value,
            Self::Table(_) => {}
        }
    }
}

/// Friction over speed and load with these entries, N m: for each speed those of the loads; none without entries.
pub(super) fn free_table(entries_n_m: Vec<f64>) -> Option<Arc<Table>> {
    let axes = [
        (Axis::MotorSpeed, TABLE_SPEEDS_RAD_S.to_vec()),
        (Axis::GearLoad, TABLE_LOADS_N_M.to_vec()),
    ];
    let table = Table::new(ActsOn::MotorFriction, &axes, entries_n_m, None);
    table.ok().map(Arc::new)
}
