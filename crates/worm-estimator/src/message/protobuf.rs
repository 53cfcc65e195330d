//! The Protocol Buffers form of messages (proto3), which reads back to the last bit, and the descriptor that goes with it.
//!
//! The form follows from the table of a message:
//! - a field's number is its place in the table, from 1; the message's name is its [`TYPE_NAME`](JsonMessage::TYPE_NAME);
//! - a number is a `double`, `NaN` where it is not known; a list over cells ends with the last cell in use;
//! - an enumeration has its values as `HOLD_REASON_LEASE_LAPSED`; a code without a name stays a number;
//! - a text is a `string`;
//! - what may be missing is `optional`;
//! - the message's own time is `fixed64` and comes first, all else as compact as usual. A log repeats that time before each message, and its
//!   compression finds the eight bytes again: 6 bytes a tick less than with a varint in the order of the table.
//!
//! Written by hand and not by a library, because those leave out a negative zero, and allocate for each list.

mod descriptor;
mod wire;

use super::field_kind::{FieldKind, FieldValue};
use super::fields::FieldAccess;
#[cfg(doc)]
use super::json::JsonMessage;
use super::short_text::ShortText;
use wire::{Reader, Truncated, Wire};
use worm_physics::MAX_CELLS;

/// A message with a form in Protocol Buffers.
pub trait ProtobufMessage: FieldAccess {
    /// Appends the message to `out`.
    fn write_protobuf(&self, out: &mut Vec<u8>) {
        write_field(self, Self::TIME_FIELD, out);
        for place in (0..Self::FIELDS.len()).filter(|&place| place != Self::TIME_FIELD) {
            write_field(self, place, out);
        }
    }

    /// Reads a message. What is left out is zero, or missing where it may be; of a field that comes twice, the last one counts.
    ///
    /// # Errors
    /// [`ProtobufError`] when it is cut off, has a field that the type does not have or of another type, a value out of range, or a list
    /// that is not as long as there are cells.
    fn read_protobuf(bytes: &[u8]) -> Result<Self, ProtobufError> {
        const { assert!(Self::FIELDS.len() <= MAX_FIELDS, "ListLengths has no place for so many") };
        let mut message = Self::empty();
        let mut reader = Reader::new(bytes);
        let mut lengths = ListLengths::default();
        while !reader.is_empty() {
            let (number, wire) = reader
                .tag()
                .map_err(|_| ProtobufError::CutOff("the number of a field"))?;
            read_field(&mut message, &mut reader, number, wire, &mut lengths)?;
        }
        let cells = message.cells();
        for (place, field) in Self::FIELDS.iter().enumerate() {
            let length = lengths.of(place);
            if matches!(field.kind, FieldKind::PerCell) && length != cells {
                let name = field.name;
                return Err(ProtobufError::WrongLength { name, length, cells });
            }
        }
        Ok(message)
    }

    /// The descriptor of the type: a serialised `google.protobuf.FileDescriptorSet`, the documentation of the fields in it.
    fn descriptor_set() -> Vec<u8> {
        descriptor::of::<Self>()
    }
}

impl<T: FieldAccess> ProtobufMessage for T {}

/// Why bytes are no message of their type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProtobufError {
    /// They end too early.
    #[error("ends within {0}")]
    CutOff(&'static str),
    /// There is no field of this number.
    #[error("{type_name} has no field {number}")]
    UnknownField {
        /// Name of the message's type.
        type_name: &'static str,
        /// The number that was found.
        number: u64,
    },
    /// A field is encoded as another type.
    #[error("{0} is encoded as another type than it has")]
    WrongType(&'static str),
    /// A value does not fit.
    #[error("{0} is out of range")]
    OutOfRange(&'static str),
    /// A list is not as long as there are cells.
    #[error("{name} has {length} values for {cells} cells")]
    WrongLength {
        /// Name of the field.
        name: &'static str,
        /// How many values it has.
        length: usize,
        /// How many cells are in use.
        cells: usize,
    },
}

/// How a field crosses the wire.
fn wire_of<T: FieldAccess>(place: usize, kind: FieldKind) -> Wire {
    match kind {
        FieldKind::Number => Wire::Fixed64,
        FieldKind::PerCell | FieldKind::Text => Wire::LengthDelimited,
        FieldKind::U64 if place == T::TIME_FIELD => Wire::Fixed64,
        FieldKind::U64 | FieldKind::U32 | FieldKind::I32 | FieldKind::Code(_) => Wire::Varint,
    }
}

fn write_field<T: FieldAccess>(message: &T, place: usize, out: &mut Vec<u8>) {
    let (Some(field), Some(value)) = (T::FIELDS.get(place), message.field(place)) else {
        return;
    };
    let wire = wire_of::<T>(place, field.kind);
    // What is optional is written even if it is zero, so that it is not missing.
    let is_left_out = |is_zero: bool| is_zero && !field.is_optional;
    let number = place as u64 + 1;
    match value {
        FieldValue::Number(value) if !is_left_out(value.to_bits() == 0) => {
            wire::tag(number, wire, out);
            out.extend(value.to_le_bytes());
        }
        FieldValue::PerCell(values) if !values.is_empty() => {
            wire::tag(number, wire, out);
            wire::varint(size_of_val(values) as u64, out);
            for value in values {
                out.extend(value.to_le_bytes());
            }
        }
        FieldValue::Text(text) if !is_left_out(text.is_empty()) => {
            wire::tag(number, wire, out);
            wire::varint(text.len() as u64, out);
            out.extend(text.as_bytes());
        }
        FieldValue::U64(value) if !is_left_out(value == 0) => {
            wire::tag(number, wire, out);
            match wire {
                Wire::Fixed64 => out.extend(value.to_le_bytes()),
                _ => wire::varint(value, out),
            }
        }
        FieldValue::U32(value) if !is_left_out(value == 0) => {
            wire::tag(number, wire, out);
            wire::varint(value.into(), out);
        }
        FieldValue::I32(value) if !is_left_out(value == 0) => {
            wire::tag(number, wire, out);
            wire::varint(wire::zigzag(value).into(), out);
        }
        FieldValue::Code(value) if !is_left_out(value == 0) => {
            wire::tag(number, wire, out);
            // Enumerations are signed, so what is beyond their range is negative.
            wire::varint(i64::from(value.cast_signed()).cast_unsigned(), out);
        }
        _ => {}
    }
}

fn read_field<T: FieldAccess>(
    message: &mut T,
    reader: &mut Reader<'_>,
    number: u64,
    wire: Wire,
    lengths: &mut ListLengths,
) -> Result<(), ProtobufError> {
    let unknown = ProtobufError::UnknownField {
        type_name: T::TYPE_NAME,
        number,
    };
    let place = number.checked_sub(1).and_then(|place| usize::try_from(place).ok());
    let Some((place, field)) = place.and_then(|place| Some((place, T::FIELDS.get(place)?))) else {
        return Err(unknown);
    };
    let name = field.name;
    if wire != wire_of::<T>(place, field.kind) {
        return Err(ProtobufError::WrongType(name));
    }
    let cut_off = |_: Truncated| ProtobufError::CutOff(name);
    let out_of_range = || ProtobufError::OutOfRange(name);
    let mut values = [f64::NAN; MAX_CELLS];
    let value = match field.kind {
        FieldKind::Number => FieldValue::Number(f64::from_le_bytes(reader.fixed64().map_err(cut_off)?)),
        FieldKind::PerCell => {
            let bytes = reader.bytes().map_err(cut_off)?;
            let (list, rest) = bytes.as_chunks::<8>();
            let used = values.get_mut(..list.len()).ok_or_else(out_of_range)?;
            if !rest.is_empty() {
                return Err(ProtobufError::CutOff(name));
            }
            for (value, bytes) in used.iter_mut().zip(list) {
                *value = f64::from_le_bytes(*bytes);
            }
            lengths.note(place, list.len());
            FieldValue::PerCell(used)
        }
        FieldKind::Text => {
            let bytes = reader.bytes().map_err(cut_off)?;
            let text = std::str::from_utf8(bytes).ok();
            let fitting = text.filter(|text| ShortText::exact(text).is_some());
            FieldValue::Text(fitting.ok_or_else(out_of_range)?)
        }
        FieldKind::U64 if wire == Wire::Fixed64 => {
            FieldValue::U64(u64::from_le_bytes(reader.fixed64().map_err(cut_off)?))
        }
        kind => {
            let value = reader.varint().map_err(cut_off)?;
            let small = || u32::try_from(value).map_err(|_| out_of_range());
            match kind {
                FieldKind::U32 => FieldValue::U32(small()?),
                FieldKind::I32 => FieldValue::I32(wire::from_zigzag(small()?)),
                FieldKind::Code(_) => {
                    let code = i32::try_from(value.cast_signed()).map_err(|_| out_of_range())?;
                    FieldValue::Code(code.cast_unsigned())
                }
                _ => FieldValue::U64(value),
            }
        }
    };
    message
        .set_field(place, value)
        .then_some(())
        .ok_or(ProtobufError::WrongType(name))
}

/// Most fields that a message has.
const MAX_FIELDS: usize = 64;

/// How long the lists of a message are, by their places.
struct ListLengths([u8; MAX_FIELDS]);

impl Default for ListLengths {
    fn default() -> Self {
        Self([0; MAX_FIELDS])
    }
}

impl ListLengths {
    fn note(&mut self, place: usize, length: usize) {
        self.0[place] = length as u8;
    }

    fn of(&self, place: usize) -> usize {
        self.0[place].into()
    }
}

#[cfg(test)]
mod tests;
