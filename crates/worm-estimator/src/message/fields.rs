//! The fields of a message one by one, whatever its type: what every form of a message but its memory layout is made from.

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

/// What a field holds.
#[derive(Debug, Clone, Copy)]
pub enum FieldKind {
    /// A number; `NaN` where it is not known.
    Number,
    /// A number for each cell in use.
    PerCell,
    /// A count, or a time in ns.
    U64,
    /// A count, an index or a mask.
    U32,
    /// A whole number with a sign.
    I32,
    /// A value of an enumeration.
    Code(&'static Codes),
}

/// The values of an enumeration.
#[derive(Debug)]
pub struct Codes {
    /// The enumeration's name, as `HoldReason`.
    pub name: &'static str,
    /// Each value's code and its name, as `lease-lapsed`.
    pub values: &'static [(u32, &'static str)],
}

impl Codes {
    /// The name of a code; `None` where this version knows none.
    pub fn name_of(&self, code: u32) -> Option<&'static str> {
        let mut values = self.values.iter();
        values.find(|(known, _)| *known == code).map(|&(_, name)| name)
    }
}

/// The value of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FieldValue<'m> {
    /// Of a [`FieldKind::Number`].
    Number(f64),
    /// Of a [`FieldKind::PerCell`], for the cells in use.
    PerCell(&'m [f64]),
    /// Of a [`FieldKind::U64`].
    U64(u64),
    /// Of a [`FieldKind::U32`].
    U32(u32),
    /// Of a [`FieldKind::I32`].
    I32(i32),
    /// Of a [`FieldKind::Code`].
    Code(u32),
    /// Of an optional field that is missing.
    Missing,
}

/// Documentation without rustdoc markup, and without mention of codes, which are names in every form that people read.
pub(super) fn prose(documentation: &str) -> String {
    ["[`", "`]", "`", "super::", "Self::", " as a code"]
        .iter()
        .fold(documentation.trim().to_owned(), |text, mark| text.replace(mark, ""))
}
