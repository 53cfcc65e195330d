//! The descriptor of a message: what `protoc` would make of its definition, as a `google.protobuf.FileDescriptorSet`.
//!
//! The numbers of the fields written here are those of `descriptor.proto`, which every implementation of Protocol Buffers brings along.

use super::wire::{self, Wire};
use super::wire_of;
use crate::message::field_kind::{CodeValue, Codes, FieldKind, prose};
use crate::message::fields::{Field, FieldAccess};

/// A message of `descriptor.proto` while it is built.
#[derive(Default)]
struct Builder(Vec<u8>);

impl Builder {
    fn text(&mut self, number: u64, text: &str) {
        self.bytes(number, text.as_bytes());
    }

    fn number(&mut self, number: u64, value: u64) {
        wire::tag(number, Wire::Varint, &mut self.0);
        wire::varint(value, &mut self.0);
    }

    fn message(&mut self, number: u64, message: &Self) {
        self.bytes(number, &message.0);
    }

    fn packed(&mut self, number: u64, values: &[u64]) {
        let mut packed = Vec::new();
        for value in values {
            wire::varint(*value, &mut packed);
        }
        self.bytes(number, &packed);
    }

    fn bytes(&mut self, number: u64, bytes: &[u8]) {
        wire::tag(number, Wire::LengthDelimited, &mut self.0);
        wire::varint(bytes.len() as u64, &mut self.0);
        self.0.extend(bytes);
    }
}

/// The descriptor of the type.
pub(super) fn of<T: FieldAccess>() -> Vec<u8> {
    // FileDescriptorProto
    let mut file = Builder::default();
    file.text(1, &format!("{}.proto", T::TYPE_NAME));
    file.message(4, &message::<T>());
    file.message(9, &source_info::<T>());
    file.text(12, "proto3");
    let mut set = Builder::default();
    set.message(1, &file);
    set.0
}

fn message<T: FieldAccess>() -> Builder {
    // DescriptorProto
    let mut message = Builder::default();
    message.text(1, T::TYPE_NAME);
    let mut optional = 0;
    for (place, row) in T::FIELDS.iter().enumerate() {
        // In proto3, a field that may be missing stands in a `oneof` of its own.
        let oneof = row.is_optional.then_some(optional);
        optional += u64::from(row.is_optional);
        message.message(2, &field::<T>(place, row, oneof));
    }
    let mut enumerations: Vec<&Codes> = Vec::new();
    for row in T::FIELDS {
        if let FieldKind::Code(codes) = row.kind
            && !enumerations.iter().any(|known| known.name == codes.name)
        {
            enumerations.push(codes);
            message.message(4, &enumeration(codes));
        }
    }
    for row in T::FIELDS.iter().filter(|row| row.is_optional) {
        // OneofDescriptorProto
        let mut oneof = Builder::default();
        oneof.text(1, &format!("_{}", row.name));
        message.message(8, &oneof);
    }
    message
}

fn field<T: FieldAccess>(place: usize, row: &Field, oneof: Option<u64>) -> Builder {
    const OPTIONAL: u64 = 1;
    const REPEATED: u64 = 3;
    let (label, of_type) = match row.kind {
        FieldKind::Number => (OPTIONAL, 1),
        FieldKind::PerCell => (REPEATED, 1),
        FieldKind::U64 if wire_of::<T>(place, row.kind) == Wire::Fixed64 => (OPTIONAL, 6),
        FieldKind::U64 => (OPTIONAL, 4),
        FieldKind::U32 => (OPTIONAL, 13),
        FieldKind::I32 => (OPTIONAL, 17), // sint32
        FieldKind::Text => (OPTIONAL, 9),
        FieldKind::Code(_) => (OPTIONAL, 14),
    };
    // FieldDescriptorProto
    let mut field = Builder::default();
    field.text(1, row.name);
    field.number(3, place as u64 + 1);
    field.number(4, label);
    field.number(5, of_type);
    if let FieldKind::Code(codes) = row.kind {
        field.text(6, &format!(".{}.{}", T::TYPE_NAME, codes.name));
    }
    if let Some(oneof) = oneof {
        field.number(9, oneof);
        field.number(17, 1);
    }
    // The name in JSON would otherwise lose its underscores.
    field.text(10, row.name);
    field
}

fn enumeration(codes: &Codes) -> Builder {
    // EnumDescriptorProto
    let mut enumeration = Builder::default();
    enumeration.text(1, codes.name);
    for &CodeValue { code, name, .. } in codes.values {
        // EnumValueDescriptorProto
        let mut value = Builder::default();
        value.text(1, &value_name(codes.name, name));
        value.number(2, code.into());
        enumeration.message(2, &value);
    }
    enumeration
}

/// `HOLD_REASON_LEASE_LAPSED` of `HoldReason` and `lease-lapsed`: the enumeration's name is in it, because the values of all enumerations of
/// a message share one scope.
fn value_name(enumeration: &str, value: &str) -> String {
    let mut name = String::new();
    for letter in enumeration.chars() {
        if letter.is_ascii_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.push(letter.to_ascii_uppercase());
    }
    name.push('_');
    name.push_str(&value.replace('-', "_").to_ascii_uppercase());
    name
}

/// The documentation, as comments before the message and its fields.
fn source_info<T: FieldAccess>() -> Builder {
    const FIRST_MESSAGE: [u64; 2] = [4, 0];
    let comment = |path: &[u64], documentation: &str| {
        // SourceCodeInfo.Location; there is no source to point at.
        let mut location = Builder::default();
        location.packed(1, path);
        location.packed(2, &[0, 0, 0]);
        location.text(3, &prose(documentation));
        location
    };
    let mut info = Builder::default();
    info.message(1, &comment(&FIRST_MESSAGE, T::DOCUMENTATION));
    for (place, row) in T::FIELDS.iter().enumerate() {
        let path = [FIRST_MESSAGE[0], FIRST_MESSAGE[1], 2, place as u64];
        info.message(1, &comment(&path, row.documentation));
    }
    info
}
