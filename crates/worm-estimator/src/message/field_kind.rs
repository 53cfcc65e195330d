//! What a field of a message can hold, below all its forms.

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
    /// A short text.
    Text,
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
    /// Of a [`FieldKind::Text`].
    Text(&'m str),
    /// Of an optional field that is missing.
    Missing,
}

/// Documentation without rustdoc markup, and without mention of codes, which are names in every form that people read.
pub(super) fn prose(documentation: &str) -> String {
    ["[`", "`]", "`", "super::", "Self::", " as a code"]
        .iter()
        .fold(documentation.trim().to_owned(), |text, mark| text.replace(mark, ""))
}
