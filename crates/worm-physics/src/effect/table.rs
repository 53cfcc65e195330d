//! A law that nobody derived.

use super::definition::{Apply, Effect, Scope, Sense, ShapeStarts, Visible};

/// A [`Table`](crate::Table): what no effect describes. It is none of the library, for it names no cause: nothing searches for it by name.
/// Its law stands in the setting ([`Setting::of_table`](super::Setting::of_table)), so it has no parameters.
pub static TABLE: Effect = Effect {
    name: "table",
    sentence: "A law without a name, at the points of a grid.",
    formula: "Fᵢ = f(axis), or μN = f(axis) · μN₀",
    signature: "that of its axis",
    twins: &[],
    described_twins: &[],
    separated_by: "a run that covers more of its axis",
    scope: Scope::AnyCells,
    visible: Visible::Positions,
    parameters: &[],
    shape_starts: ShapeStarts::Neutral,
    sense: Sense::Either,
    care: None,
    may_begin: false,
    apply: Apply::Worm(|_, _, _| ()),
};
