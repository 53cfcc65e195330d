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
    /// What it is about.
    pub documentation: &'static str,
    /// Its values, in the order of the codes.
    pub values: &'static [CodeValue],
}

/// One value of an enumeration.
#[derive(Debug)]
pub struct CodeValue {
    /// What crosses the topic.
    pub code: u32,
    /// Its name, as `lease-lapsed`.
    pub name: &'static str,
    /// Its meaning.
    pub documentation: &'static str,
}

impl Codes {
    /// The name of a code; `None` where this version knows none.
    pub fn name_of(&self, code: u32) -> Option<&'static str> {
        let mut values = self.values.iter();
        values.find(|value| value.code == code).map(|value| value.name)
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
pub fn prose(documentation: &str) -> String {
    ["[`", "`]", "`", "super::", "Self::", " as a code"]
        .iter()
        .fold(documentation.trim().to_owned(), |text, mark| text.replace(mark, ""))
}
