//! The JSON form of messages: one object with a member for each field, which reads back to the last bit.
//!
//! JSON cannot express some values, so these rules hold, and the schema of each type states them:
//! - a number that is not known (`NaN`) is `null`; an infinite one is `"Infinity"` or `"-Infinity"`;
//! - a list over cells ends with the last cell in use; the rest is `NaN` in a message that was read;
//! - a coded value is its name, or the bare code where this version knows no name; `u32::MAX` for "none" is `null`.
//!
//! Schemas give one plain type for each member, though it may be `null`: viewers such as Foxglove do not accept unions of types.

use super::field_kind::{Codes, FieldKind, FieldValue, prose};
use serde::de::{DeserializeOwned, Error, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Value, json};
use std::fmt;
use std::marker::PhantomData;
use worm_physics::MAX_CELLS;

/// A message with a JSON form.
pub trait JsonMessage: Copy {
    /// Name and version of the type, the same as on its topic.
    const TYPE_NAME: &'static str;

    /// When it was made, ns of `CLOCK_MONOTONIC`; 0 for an estimate before the first state.
    fn made_ns(&self) -> u64;

    /// Appends the message to `out` as one JSON object.
    ///
    /// # Errors
    /// None: every value of every field can be written.
    fn write_json(&self, out: &mut Vec<u8>) -> serde_json::Result<()>;

    /// Reads a message.
    ///
    /// # Errors
    /// With line and column, when it is not JSON, or a member is missing, unknown or of the wrong type.
    fn read_json(text: &[u8]) -> serde_json::Result<Self>;

    /// The JSON Schema of the type.
    fn schema() -> Value;
}

/// The JSON form of a field of type `T`, and what the field is in every other form.
pub(super) trait Form<T>: Serialize + DeserializeOwned {
    /// What the field holds.
    const KIND: FieldKind;
    /// Whether it may be missing.
    const IS_OPTIONAL: bool = false;
    /// Its value in an empty message.
    const EMPTY: T;
    /// The form of `value` in a message with so many cells.
    fn of(value: T, cells: usize) -> Self;
    /// The value itself.
    fn value(&self) -> T;
    /// The type, as JSON Schema names it.
    fn schema() -> Value;
    /// For how many cells it has values, where it is a list over cells.
    fn cells(&self) -> Option<usize> {
        None
    }
    /// The value of a field in a message with so many cells.
    fn read(field: &T, cells: usize) -> FieldValue<'_>;
    /// Sets a field; returns whether it takes such a value.
    fn assign(field: &mut T, value: FieldValue<'_>) -> bool;
}

/// A field type that has only one form.
pub(super) trait Plain: Sized {
    type Form: Form<Self>;
}

macro_rules! whole_numbers {
    ($($type:ty = $kind:ident)+) => {$(
        impl Plain for $type { type Form = Self; }
        impl Form<$type> for $type {
            const KIND: FieldKind = FieldKind::$kind;
            const EMPTY: Self = 0;
            fn of(value: $type, _: usize) -> Self { value }
            fn value(&self) -> $type { *self }
            fn schema() -> Value { json!({"type": "integer"}) }
            fn read(field: &$type, _: usize) -> FieldValue<'_> { FieldValue::$kind(*field) }
            fn assign(field: &mut $type, value: FieldValue<'_>) -> bool {
                let FieldValue::$kind(value) = value else { return false };
                *field = value;
                true
            }
        }
    )+};
}
whole_numbers! { u64 = U64 u32 = U32 i32 = I32 }

/// A number, known or not.
#[derive(Debug, Clone, Copy)]
pub(super) struct Number(f64);

impl Plain for f64 {
    type Form = Number;
}

impl Form<f64> for Number {
    const KIND: FieldKind = FieldKind::Number;
    const EMPTY: f64 = 0.0;

    fn of(value: f64, _: usize) -> Self {
        Self(value)
    }

    fn value(&self) -> f64 {
        self.0
    }

    fn schema() -> Value {
        json!({"type": "number"})
    }

    fn read(field: &f64, _: usize) -> FieldValue<'_> {
        FieldValue::Number(*field)
    }

    fn assign(field: &mut f64, value: FieldValue<'_>) -> bool {
        let FieldValue::Number(value) = value else {
            return false;
        };
        *field = value;
        true
    }
}

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.is_finite() {
            serializer.serialize_f64(self.0)
        } else if self.0.is_nan() {
            serializer.serialize_unit()
        } else {
            serializer.serialize_str(if self.0 > 0.0 { "Infinity" } else { "-Infinity" })
        }
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Numbers;
        impl Visitor<'_> for Numbers {
            type Value = Number;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, null, \"Infinity\" or \"-Infinity\"")
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Number, E> {
                Ok(Number(value))
            }

            fn visit_u64<E: Error>(self, value: u64) -> Result<Number, E> {
                Ok(Number(value as f64))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Number, E> {
                Ok(Number(value as f64))
            }

            fn visit_unit<E: Error>(self) -> Result<Number, E> {
                Ok(Number(f64::NAN))
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Number, E> {
                match text {
                    "Infinity" => Ok(Number(f64::INFINITY)),
                    "-Infinity" => Ok(Number(f64::NEG_INFINITY)),
                    _ => Err(E::invalid_value(Unexpected::Str(text), &self)),
                }
            }
        }
        deserializer.deserialize_any(Numbers)
    }
}

/// A number for each cell in use.
#[derive(Debug, Clone, Copy)]
pub(super) struct PerCell {
    values: [f64; MAX_CELLS],
    cells: usize,
}

impl Plain for [f64; MAX_CELLS] {
    type Form = PerCell;
}

impl Form<[f64; MAX_CELLS]> for PerCell {
    const KIND: FieldKind = FieldKind::PerCell;
    const EMPTY: [f64; MAX_CELLS] = [f64::NAN; MAX_CELLS];

    fn of(values: [f64; MAX_CELLS], cells: usize) -> Self {
        let cells = cells.min(MAX_CELLS);
        Self { values, cells }
    }

    fn value(&self) -> [f64; MAX_CELLS] {
        self.values
    }

    fn schema() -> Value {
        json!({"type": "array", "items": {"type": "number"}, "maxItems": MAX_CELLS})
    }

    fn cells(&self) -> Option<usize> {
        Some(self.cells)
    }

    fn read(field: &[f64; MAX_CELLS], cells: usize) -> FieldValue<'_> {
        FieldValue::PerCell(&field[..cells.min(MAX_CELLS)])
    }

    fn assign(field: &mut [f64; MAX_CELLS], value: FieldValue<'_>) -> bool {
        let FieldValue::PerCell(values) = value else {
            return false;
        };
        let Some((used, rest)) = field.split_at_mut_checked(values.len()) else {
            return false;
        };
        used.copy_from_slice(values);
        rest.fill(f64::NAN);
        true
    }
}

impl Serialize for PerCell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.values[..self.cells].iter().map(|&value| Number(value)))
    }
}

impl<'de> Deserialize<'de> for PerCell {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Lists;
        impl<'de> Visitor<'de> for Lists {
            type Value = PerCell;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a list of at most {MAX_CELLS} numbers")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<PerCell, A::Error> {
                let (mut values, mut cells) = ([f64::NAN; MAX_CELLS], 0);
                while let Some(Number(value)) = list.next_element()? {
                    *values
                        .get_mut(cells)
                        .ok_or_else(|| A::Error::invalid_length(cells + 1, &self))? = value;
                    cells += 1;
                }
                Ok(PerCell { values, cells })
            }
        }
        deserializer.deserialize_seq(Lists)
    }
}

/// An enumeration that crosses topics as a code and is a name in JSON.
pub(super) trait Coded: Copy + TryFrom<u32> + 'static {
    const WHAT: &'static str;
    const VALUES: &'static [Self];
    const CODES: &'static Codes;
    fn name_of(self) -> &'static str;
    fn code_of(self) -> u32;
}

/// A code, by its name.
#[derive(Debug, Clone, Copy)]
pub(super) struct Name<T>(u32, PhantomData<T>);

impl<T: Coded> Form<u32> for Name<T> {
    const KIND: FieldKind = FieldKind::Code(T::CODES);
    const EMPTY: u32 = 0;

    fn of(code: u32, _: usize) -> Self {
        Self(code, PhantomData)
    }

    fn value(&self) -> u32 {
        self.0
    }

    fn schema() -> Value {
        let names: Vec<_> = T::VALUES.iter().map(|&value| value.name_of()).collect();
        json!({"type": "string", "enum": names})
    }

    fn read(field: &u32, _: usize) -> FieldValue<'_> {
        FieldValue::Code(*field)
    }

    fn assign(field: &mut u32, value: FieldValue<'_>) -> bool {
        let FieldValue::Code(code) = value else {
            return false;
        };
        *field = code;
        true
    }
}

impl<T: Coded> Serialize for Name<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match T::try_from(self.0) {
            Ok(value) => serializer.serialize_str(value.name_of()),
            Err(_) => serializer.serialize_u32(self.0),
        }
    }
}

impl<'de, T: Coded> Deserialize<'de> for Name<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Names<T>(PhantomData<T>);
        impl<T: Coded> Visitor<'_> for Names<T> {
            type Value = Name<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "the name or code of a {}", T::WHAT)
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Name<T>, E> {
                let named = T::VALUES.iter().find(|value| value.name_of() == text);
                let value = named.ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self))?;
                Ok(Name(value.code_of(), PhantomData))
            }

            fn visit_u64<E: Error>(self, code: u64) -> Result<Name<T>, E> {
                let code = u32::try_from(code).map_err(|_| E::invalid_value(Unexpected::Unsigned(code), &self))?;
                Ok(Name(code, PhantomData))
            }
        }
        deserializer.deserialize_any(Names(PhantomData))
    }
}

/// A code or an index, or `null` for `u32::MAX`.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct OrNone<F>(Option<F>);

impl<F: Form<u32>> Form<u32> for OrNone<F> {
    const KIND: FieldKind = F::KIND;
    const IS_OPTIONAL: bool = true;
    const EMPTY: u32 = u32::MAX;

    fn of(value: u32, cells: usize) -> Self {
        Self((value != u32::MAX).then(|| F::of(value, cells)))
    }

    fn value(&self) -> u32 {
        self.0.as_ref().map_or(u32::MAX, F::value)
    }

    fn schema() -> Value {
        F::schema()
    }

    fn read(field: &u32, cells: usize) -> FieldValue<'_> {
        match *field {
            u32::MAX => FieldValue::Missing,
            _ => F::read(field, cells),
        }
    }

    fn assign(field: &mut u32, value: FieldValue<'_>) -> bool {
        match value {
            FieldValue::Missing => *field = u32::MAX,
            value => return F::assign(field, value),
        }
        true
    }
}

/// Reads a required member: where `null` is allowed, serde would accept a missing one as `null`.
pub(super) fn present<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    T::deserialize(deserializer)
}

/// One member of a schema.
pub(super) fn member(name: &str, documentation: &str, mut schema: Value) -> Value {
    schema["title"] = name.replace('_', " ").into();
    schema["description"] = prose(documentation).into();
    schema
}

/// The error for a list whose length is not the number of cells.
pub(super) fn wrong_length(name: &str, length: usize, cells: usize) -> serde_json::Error {
    serde_json::Error::custom(format!("{name} has {length} values for {cells} cells"))
}

#[cfg(test)]
mod tests;
