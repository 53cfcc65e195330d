//! Why a table cannot be used.

use thiserror::Error;

/// Why a table cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TableError {
    /// No such axis.
    #[error("axis \"{name}\": give one of {names}, or two of them as a list")]
    Axis {
        /// The one given.
        name: String,
        /// All that there are.
        names: String,
    },
    /// Nothing that a table can act on.
    #[error("acts_on = \"{name}\": give {names}")]
    ActsOn {
        /// What was given.
        name: String,
        /// All that there are, with their units.
        names: String,
    },
    /// A quantity of a cell for something of the motor, or the other way round.
    #[error("acts_on = \"{acts_on}\" cannot depend on {axis}: give {names}")]
    Dependence {
        /// What it acts on.
        acts_on: &'static str,
        /// The axis that was given.
        axis: &'static str,
        /// What it may depend on.
        names: String,
    },
    /// None or more than two axes, or one of them twice.
    #[error("{0} axes: give one, or two different ones")]
    Axes(usize),
    /// The grid is no grid.
    #[error("grid of {axis}: {problem}")]
    Grid {
        /// Its axis.
        axis: &'static str,
        /// What is wrong and what to do.
        problem: String,
    },
    /// Values that do not fit the grid.
    #[error("value: {given} values for {expected} points of the grid: give one for each{}", if *two_axes { ", a list for each point of the first axis" } else { "" })]
    Count {
        /// How many were given.
        given: usize,
        /// How many points there are.
        expected: usize,
        /// Whether there are two axes.
        two_axes: bool,
    },
    /// A value out of range.
    #[error("value {value} of {acts_on}: must be from {min} to {max}{}{unit}", if unit.is_empty() { "" } else { " " })]
    Value {
        /// The one given.
        value: f64,
        /// What it acts on.
        acts_on: &'static str,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
        /// Its unit; empty for none.
        unit: &'static str,
    },
    /// A period that cannot be one.
    #[error("period = {period}: {problem}")]
    Period {
        /// The one given.
        period: f64,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A time that cannot be remembered.
    #[error("memory_s = {memory_s}: {problem}")]
    Memory {
        /// The one given.
        memory_s: f64,
        /// What is wrong and what to do.
        problem: String,
    },
}
