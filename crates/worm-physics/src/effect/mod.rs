//! The library of effects that the paper's theory leaves out, one file each.
//!
//! An [`Effect`] says in a sentence and a formula what happens, with which parameters, what it looks like in positions, what
//! no position could ever tell it from (its exact twins), and which experiment tells it from its neighbours. A [`Setting`] is
//! an effect switched on with values; settings compose by [`Physics::with`].
//!
//! A parameter's *neutral* value is the one at which the effect does nothing; its *severity* parameter comes first, parameters of
//! shape (a time constant, a place) follow.

use super::physics::Physics;
use std::collections::BTreeMap;
use thiserror::Error;

mod actuator_compliance;
mod backlash;
mod breakaway_friction;
mod constant_drag;
mod directional_friction;
mod lost_stroke;
mod motor_droop;
mod pad_creep;
mod pad_hardening;
mod pad_hysteresis;
mod payload;
mod sensor_latency;
mod sensor_scale;
mod slick_patch;
mod slope_clamping;
mod slope_error;
mod step_overlap;
mod tether_drag;
mod unequal_clamping;
mod unequal_stiffness;
mod viscous_drag;
mod wear;

/// Most parameters of one effect.
pub const MAX_PARAMETERS: usize = 3;

/// Every effect, in the order in which they are told.
pub static LIBRARY: [&Effect; 22] = [
    &unequal_clamping::EFFECT,
    &unequal_stiffness::EFFECT,
    &directional_friction::EFFECT,
    &breakaway_friction::EFFECT,
    &pad_hardening::EFFECT,
    &pad_creep::EFFECT,
    &pad_hysteresis::EFFECT,
    &viscous_drag::EFFECT,
    &constant_drag::EFFECT,
    &payload::EFFECT,
    &slope_error::EFFECT,
    &tether_drag::EFFECT,
    &lost_stroke::EFFECT,
    &actuator_compliance::EFFECT,
    &backlash::EFFECT,
    &step_overlap::EFFECT,
    &slick_patch::EFFECT,
    &wear::EFFECT,
    &motor_droop::EFFECT,
    &sensor_scale::EFFECT,
    &sensor_latency::EFFECT,
    &slope_clamping::EFFECT,
];

/// The one effect that shows in when things happen, not where.
pub static MOTOR_DROOP: &Effect = &motor_droop::EFFECT;

/// The effect of a name.
///
/// # Errors
/// [`SettingError::Unknown`] with the nearest name.
pub fn named(name: &str) -> Result<&'static Effect, SettingError> {
    let found = LIBRARY.iter().find(|effect| effect.name == name);
    found.copied().ok_or_else(|| SettingError::Unknown {
        name: name.to_owned(),
        names: LIBRARY.map(|effect| effect.name).join(", "),
    })
}

/// Which cells an effect concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The whole worm.
    Worm,
    /// One cell, which must be named.
    OneCell,
    /// One cell where it is named, else all.
    AnyCells,
}

/// What positions can tell of an effect, and with what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visible {
    /// By positions, however the gait phase was found.
    Positions,
    /// By positions against a recorded gait phase only.
    RecordedPhase,
    /// By when the gait phase passes.
    PhaseTime,
}

/// A quantity of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name in files and on the command line.
    pub name: &'static str,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// What it is.
    pub about: &'static str,
    /// The value at which the effect does nothing; for a parameter of shape, where a search may begin.
    pub neutral: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// A change of it that is usually just noticed: the scale of searches and derivatives.
    pub notable: f64,
}

/// An effect of the library.
#[derive(Debug)]
pub struct Effect {
    /// Its name everywhere.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub sentence: &'static str,
    /// What it does, as a formula.
    pub formula: &'static str,
    /// What it looks like in cell positions.
    pub signature: &'static str,
    /// Effects, or descriptions of them, that no cell positions can tell from it.
    pub twins: &'static [&'static str],
    /// Which experiment tells it from its neighbours.
    pub separated_by: &'static str,
    /// Which cells it concerns.
    pub scope: Scope,
    /// What shows it.
    pub visible: Visible,
    /// Its parameters, the severity first; at most [`MAX_PARAMETERS`].
    pub parameters: &'static [Parameter],
    pub(super) apply: fn(&mut Physics, Option<usize>, &[f64]),
}

/// Why an effect cannot be switched on like that.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SettingError {
    /// No such effect.
    #[error("there is no effect `{name}`: the library has {names}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// What there is.
        names: String,
    },
    /// No such parameter.
    #[error("effect `{effect}` has no parameter `{parameter}`: it has {names}")]
    NoParameter {
        /// The effect.
        effect: &'static str,
        /// What was given.
        parameter: String,
        /// What there is.
        names: String,
    },
    /// A parameter that was left out.
    #[error("effect `{effect}` needs `{parameter}`: {about}")]
    Missing {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// What it is.
        about: &'static str,
    },
    /// A value out of its range.
    #[error("effect `{effect}`: {parameter} = {value}: must be from {min} to {max} {unit}")]
    OutOfRange {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// What was given.
        value: f64,
        /// Least value.
        min: f64,
        /// Largest value.
        max: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A cell too many, too few, or one that the worm does not have.
    #[error("effect `{effect}`: {problem}")]
    Cell {
        /// The effect.
        effect: &'static str,
        /// What is wrong and what to do.
        problem: String,
    },
}

/// An effect switched on.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    effect: &'static Effect,
    cell: Option<usize>,
    values: [f64; MAX_PARAMETERS], // the first `parameters.len()` count
}

impl PartialEq for Setting {
    fn eq(&self, other: &Self) -> bool {
        self.effect.name == other.effect.name && self.cell == other.cell && self.values() == other.values()
    }
}

impl Setting {
    /// An effect with values in the order of its parameters, for the cell where one is meant (from 0) of a worm of `cells`.
    ///
    /// # Errors
    /// [`SettingError`].
    ///
    /// # Panics
    /// When there is not one value for each parameter.
    pub fn new(
        effect: &'static Effect,
        cell: Option<usize>,
        values: &[f64],
        cells: usize,
    ) -> Result<Self, SettingError> {
        assert_eq!(values.len(), effect.parameters.len(), "one value for each parameter");
        effect.check_cell(cell, cells)?;
        for (parameter, &value) in effect.parameters.iter().zip(values) {
            if !(parameter.min..=parameter.max).contains(&value) {
                return Err(SettingError::OutOfRange {
                    effect: effect.name,
                    parameter: parameter.name,
                    value,
                    min: parameter.min,
                    max: parameter.max,
                    unit: parameter.unit,
                });
            }
        }
        Ok(Self::within(effect, cell, values))
    }

    /// An effect by names, as files and the command line give it; `cell` counts from 0.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn by_names(
        name: &str,
        cell: Option<usize>,
        parameters: &BTreeMap<String, f64>,
        cells: usize,
    ) -> Result<Self, SettingError> {
        let effect = named(name)?;
        let known = |given: &str| effect.parameters.iter().any(|parameter| parameter.name == given);
        if let Some(unknown) = parameters.keys().find(|given| !known(given)) {
            let names: Vec<&str> = effect.parameters.iter().map(|parameter| parameter.name).collect();
            return Err(SettingError::NoParameter {
                effect: effect.name,
                parameter: unknown.clone(),
                names: names.join(", "),
            });
        }
        let mut values = Vec::with_capacity(effect.parameters.len());
        for parameter in effect.parameters {
            let value = parameters.get(parameter.name).ok_or(SettingError::Missing {
                effect: effect.name,
                parameter: parameter.name,
                about: parameter.about,
            })?;
            values.push(*value);
        }
        Self::new(effect, cell, &values, cells)
    }

    /// An effect with values that are put into their ranges.
    pub fn within(effect: &'static Effect, cell: Option<usize>, values: &[f64]) -> Self {
        let mut kept = [0.0; MAX_PARAMETERS];
        for ((kept, parameter), value) in kept.iter_mut().zip(effect.parameters).zip(values) {
            *kept = value.clamp(parameter.min, parameter.max);
        }
        Self {
            effect,
            cell,
            values: kept,
        }
    }

    /// Whether a worm of so many cells has the cell that it names.
    ///
    /// # Errors
    /// [`SettingError::Cell`].
    pub fn check_cells(&self, cells: usize) -> Result<(), SettingError> {
        self.effect.check_cell(self.cell, cells)
    }

    /// The effect.
    pub fn effect(&self) -> &'static Effect {
        self.effect
    }

    /// The cell where one is meant, from 0.
    pub fn cell(&self) -> Option<usize> {
        self.cell
    }

    /// The values, in the order of the effect's parameters.
    pub fn values(&self) -> &[f64] {
        &self.values[..self.effect.parameters.len()]
    }

    /// Adds it to some physics.
    pub(super) fn apply(&self, physics: &mut Physics) {
        (self.effect.apply)(physics, self.cell, self.values());
    }
}

impl Effect {
    fn check_cell(&self, cell: Option<usize>, cells: usize) -> Result<(), SettingError> {
        let problem = match (self.scope, cell) {
            (Scope::Worm, Some(_)) => "it concerns the whole worm: leave `cell` out".to_owned(),
            (Scope::OneCell, None) => format!("say which `cell` it concerns, 1 to {cells}"),
            (_, Some(cell)) if cell >= cells => {
                format!("cell {} of {cells}: give 1 to {cells}", cell.wrapping_add(1))
            }
            _ => return Ok(()),
        };
        Err(SettingError::Cell {
            effect: self.name,
            problem,
        })
    }
}
