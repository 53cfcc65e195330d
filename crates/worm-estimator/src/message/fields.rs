//! The fields of a message one by one, whatever its type: what every form of a message but its memory layout is made from.

use super::field_kind::{FieldKind, FieldValue, prose};
use super::json::JsonMessage;

/// A message whose fields can be listed, read and set by their place in its table.
pub trait FieldAccess: JsonMessage {
    /// Its fields, in the order of the table.
    const FIELDS: &'static [Field];

    /// What the type is about.
    const DOCUMENTATION: &'static str;

    /// Place of the field that [`made_ns`](JsonMessage::made_ns) returns.
    const TIME_FIELD: usize;

    /// A message with nothing in it: numbers zero, lists without values, what is optional missing.
    fn empty() -> Self;

    /// How many cells are in use; 0 in a message that is not about cells.
    fn cells(&self) -> usize;

    /// The value of the field at this place; `None` if there is none.
    fn field(&self, place: usize) -> Option<FieldValue<'_>>;

    /// Sets the field at this place; returns whether there is one that takes such a value.
    fn set_field(&mut self, place: usize, value: FieldValue<'_>) -> bool;
}

/// One row of a message's table.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Its name, the unit in it.
    pub name: &'static str,
    /// Its meaning and unit, as in the code's documentation.
    pub documentation: &'static str,
    /// What it holds.
    pub kind: FieldKind,
    /// Whether it may be missing.
    pub is_optional: bool,
}

impl Field {
    /// Its meaning and unit, for people who do not read the code.
    pub fn description(&self) -> String {
        prose(self.documentation)
    }
}
