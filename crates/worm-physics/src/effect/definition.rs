//! What an effect is.

use super::error::SettingError;
use crate::physics::Physics;
use crate::servo::ServoPhysics;

/// Most parameters of one effect.
pub const MAX_PARAMETERS: usize = 3;

/// Which cells an effect concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The whole worm.
    Worm,
    /// One cell, which must be given.
    OneCell,
    /// One cell where it is given, else all.
    AnyCells,
}

/// Which measurement shows an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visible {
    /// Positions, however the gait phase was found.
    Positions,
    /// Positions against a recorded gait phase only.
    RecordedPhase,
    /// The times at which the gait passes its phases, and no positions.
    PhaseTime,
}

/// Which senses of an effect's severity physics allows, about the value at which it does nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// Above it and below.
    Either,
    /// Above it, unless something is odd: a payload may be mass that is missing.
    UsuallyPositive,
    /// Above it: what changes the other way has another cause.
    Positive,
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
    /// Whether its least value stands for none of it: a shape that is as possible as any above.
    pub none_at_min: bool,
}

impl Parameter {
    /// Whether an end of its range is as possible as anything between: of a fraction of a whole both are.
    pub fn may_be_at_end(&self, value: f64) -> bool {
        self.is_fraction() || self.none_at_min && value - self.min < self.max - value
    }

    /// Whether it is a fraction of a whole.
    pub fn is_fraction(&self) -> bool {
        self.unit.is_empty() && (self.min, self.max) == (0.0, 1.0)
    }
}

/// Where a search starts in the parameters of shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShapeStarts {
    /// At their neutral values; also for an effect without any.
    Neutral,
    /// At every combination of these values: a list for each parameter of shape.
    Grid(&'static [&'static [f64]]),
    /// All along the canal. The effect acts on a stretch of it: parameter 1 is where the stretch begins, m, and parameter 2 how
    /// long it is, m. The likelihood has a local maximum for almost every place.
    AlongCanal {
        /// Distance from one place to the next, m.
        spacing_m: f64,
        /// Lengths to try at each place, m.
        lengths_m: &'static [f64],
    },
}

/// What an effect does to the physics of the machine that it belongs to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Apply {
    /// To a worm: on the cell (from 0) where one is given, with the values of its parameters.
    Worm(fn(&mut Physics, Option<usize>, &[f64])),
    /// To a servo, with the values of its parameters.
    Servo(fn(&mut ServoPhysics, &[f64])),
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
    /// How it shows in cell positions.
    pub signature: &'static str,
    /// Names of the effects of the library that no cell positions can distinguish from it where both concern all cells.
    pub twins: &'static [&'static str],
    /// Descriptions of whatever else no cell positions can distinguish from it.
    pub described_twins: &'static [&'static str],
    /// Which experiment distinguishes it from its neighbours.
    pub separated_by: &'static str,
    /// Which cells it concerns.
    pub scope: Scope,
    /// Which measurement shows it.
    pub visible: Visible,
    /// Its parameters, the severity first; from 1 to [`MAX_PARAMETERS`], none of a table.
    pub parameters: &'static [Parameter],
    /// Where a search starts in the parameters after the severity.
    pub shape_starts: ShapeStarts,
    /// Which senses its severity may have.
    pub sense: Sense,
    /// Standard deviation of the severity that care with building the machine and laying it down leaves, where they set it.
    pub care: Option<f64>,
    /// Whether it may begin or end in mid-run: what changes the worm or its load may, what says in its law where or for how long it acts
    /// has that there, and a measurement does not change by itself.
    pub may_begin: bool,
    /// What it does.
    pub(super) apply: Apply,
}

impl Effect {
    /// How strong it is: the first parameter.
    pub fn severity(&self) -> &'static Parameter {
        &self.parameters[0]
    }

    /// The value of a parameter that was left out: a shape has a usual one, unless it is a place in the canal.
    pub(super) fn usual(&self, parameter: &Parameter) -> Option<f64> {
        let has_usual = matches!(self.shape_starts, ShapeStarts::Grid(_)) && parameter.name != self.severity().name;
        has_usual.then_some(parameter.neutral)
    }

    /// Whether positions show it, given whether the gait phase was recorded.
    pub fn is_visible_in_positions(&self, phase_recorded: bool) -> bool {
        match self.visible {
            Visible::Positions => true,
            Visible::RecordedPhase => phase_recorded,
            Visible::PhaseTime => false,
        }
    }

    /// Whether it changes when things happen and not where.
    pub fn shows_in_time_alone(&self) -> bool {
        self.visible == Visible::PhaseTime
    }

    /// Whether no positions can distinguish it from another effect, where both concern all cells.
    pub fn is_twin_of(&self, other: &Self) -> bool {
        self.twins.contains(&other.name)
    }

    /// Names and descriptions of all that no positions can distinguish from it. On a single cell, an effect that may concern all
    /// cells has none.
    pub fn all_twins(&self, cell: Option<usize>) -> Vec<&'static str> {
        let named = self.twins.iter().filter(|_| cell.is_none());
        let described = self.described_twins.iter();
        let described = described.filter(|_| cell.is_none() || self.scope != Scope::AnyCells);
        named.chain(described).copied().collect()
    }

    /// Whether a worm of `cells` has the cell (from 0), and the effect takes one.
    pub(super) fn check_cell(&self, cell: Option<usize>, cells: usize) -> Result<(), SettingError> {
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
