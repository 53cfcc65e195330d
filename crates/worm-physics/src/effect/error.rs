//! Why an effect cannot be switched on.

use crate::table::TableError;
use thiserror::Error;

/// Why an effect cannot be switched on as requested.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SettingError {
    /// No such effect.
    #[error("there is no effect `{name}`{}: the library has {names}", suggestion(*nearest))]
    Unknown {
        /// The name given.
        name: String,
        /// The effect whose name is nearest, where one is near.
        nearest: Option<&'static str>,
        /// All names there are.
        names: String,
    },
    /// No such parameter.
    #[error("effect `{effect}` has no parameter `{parameter}`: it has {names}")]
    NoParameter {
        /// The effect.
        effect: &'static str,
        /// The one given.
        parameter: String,
        /// All names there are.
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
        /// The one given.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A table that is none.
    #[error("effect `table`: {0}")]
    Table(#[from] TableError),
    /// A table by parameters, or with something left out.
    #[error("effect `table` needs {0}")]
    TableMissing(String),
    /// A law of the servo among those of the worm, or the other way round.
    #[error("effect `table`: acts_on = \"{acts_on}\" {belongs}")]
    Elsewhere {
        /// What it acts on.
        acts_on: &'static str,
        /// Where it belongs.
        belongs: &'static str,
    },
    /// A grid for an effect that has none.
    #[error("effect `{effect}` has no `{field}`: only `table` has, the library's effects have parameters")]
    NoTable {
        /// The effect.
        effect: String,
        /// What was given.
        field: &'static str,
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

fn suggestion(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |nearest| format!(" (did you mean `{nearest}`?)"))
}
