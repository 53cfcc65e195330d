//! The fields of a message one by one, whatever its type: what every form of a message but its memory layout is made from.

use super::field_kind::{FieldKind, FieldValue, prose};
use super::json::JsonMessage;

/// A message whose fields can be listed, read and set by their place in its table.
pub trait FieldAccess: JsonMessage + InMemory {
    /// Its fields, in the order of the table.
    const FIELDS: &'static [Field] = Self::LAYOUT.fields;

    /// What the type is about.
    const DOCUMENTATION: &'static str = Self::LAYOUT.documentation;

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

/// A structure that other languages read where it lies in shared memory.
pub trait InMemory {
    /// How it lies there.
    const LAYOUT: Layout;
}

/// How a structure lies in memory.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// Its name here, as `State`.
    pub name: &'static str,
    /// Its name and version on the service, as `wormd_state_v4`.
    pub type_name: &'static str,
    /// What it is about.
    pub documentation: &'static str,
    /// How much memory it takes, bytes.
    pub size: usize,
    /// Its address is a multiple of so many bytes.
    pub alignment: usize,
    /// Its fields, in the order in which they lie there.
    pub fields: &'static [Field],
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
    /// Where it begins in memory, bytes from the beginning of the structure.
    pub offset: usize,
    /// How much it takes there, bytes.
    pub size: usize,
}

impl Field {
    /// Its meaning and unit, for people who do not read the code.
    pub fn description(&self) -> String {
        prose(self.documentation)
    }
}
