//! Messages in Protocol Buffers: there and back, and by their descriptor alone, as the viewers read them.

use super::{ProtobufError, ProtobufMessage};
use crate::message::{
    Alarm, AlarmKind, CommandRecord, Cycle, Estimate, FieldAccess, FieldValue, HoldReason, Mode, RecordingStatus,
    State, Timing,
};
use proptest::prelude::*;
use prost_reflect::{DescriptorPool, DynamicMessage, Kind, MessageDescriptor, Value};
use worm_physics::MAX_CELLS;

fn written<T: ProtobufMessage>(message: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    message.write_protobuf(&mut bytes);
    bytes
}

/// The type as another implementation knows it from the descriptor.
fn described<T: ProtobufMessage>() -> MessageDescriptor {
    let pool = DescriptorPool::decode(T::descriptor_set().as_slice()).expect("a descriptor set");
    pool.get_message_by_name(T::TYPE_NAME).expect("the message")
}

/// Whether another implementation finds in the bytes what is in the message.
fn check_described<T: ProtobufMessage>(descriptor: &MessageDescriptor, message: &T) -> Result<(), TestCaseError> {
    let bytes = written(message);
    let dynamic = DynamicMessage::decode(descriptor.clone(), bytes.as_slice())
        .map_err(|error| TestCaseError::fail(error.to_string()))?;
    prop_assert_eq!(dynamic.unknown_fields().count(), 0);
    for (place, field) in T::FIELDS.iter().enumerate() {
        let theirs = dynamic.get_field_by_name(field.name).expect("the field");
        let is_there = dynamic.has_field_by_name(field.name);
        let same = match (message.field(place).expect("a field"), &*theirs) {
            (FieldValue::Number(ours), Value::F64(theirs)) => ours.to_bits() == theirs.to_bits(),
            (FieldValue::PerCell(ours), Value::List(theirs)) => {
                let theirs = theirs.iter().map(|value| value.as_f64().map(f64::to_bits));
                theirs.eq(ours.iter().map(|value| Some(value.to_bits())))
            }
            (FieldValue::U64(ours), Value::U64(theirs)) => ours == *theirs,
            (FieldValue::U32(ours), Value::U32(theirs)) => ours == *theirs && (is_there || !field.is_optional),
            (FieldValue::I32(ours), Value::I32(theirs)) => ours == *theirs,
            (FieldValue::Code(ours), Value::EnumNumber(theirs)) => ours == theirs.cast_unsigned(),
            (FieldValue::Text(ours), Value::String(theirs)) => ours == theirs,
            (FieldValue::Missing, _) => !is_there && field.is_optional,
            _ => false,
        };
        prop_assert!(same, "{}: {:?}, {:?}", field.name, message.field(place), theirs);
    }
    Ok(())
}

/// Any message of the type: whatever a topic may carry, with so many cells.
fn any_message<T: ProtobufMessage>(bits: &[u64], cells: usize) -> T {
    let mut message = T::empty();
    let mut bits = bits.iter().copied().cycle();
    let mut next = || bits.next().expect("endless");
    for (place, field) in T::FIELDS.iter().enumerate() {
        use crate::message::FieldKind::{Code, I32, Number, PerCell, Text, U32, U64};
        let list: Vec<f64> = (0..cells).map(|_| f64::from_bits(next())).collect();
        let text = "ä".repeat((next() % 17) as usize);
        let value = match field.kind {
            Number => FieldValue::Number(f64::from_bits(next())),
            PerCell => FieldValue::PerCell(&list),
            U64 => FieldValue::U64(next()),
            U32 if field.name == "cell_count" => FieldValue::U32(cells as u32),
            U32 => FieldValue::U32(next() as u32),
            I32 => FieldValue::I32(next() as i32),
            Code(_) => FieldValue::Code(next() as u32),
            Text => FieldValue::Text(&text),
        };
        assert!(message.set_field(place, value), "{}", field.name);
    }
    message
}

fn check<T: ProtobufMessage>(bits: &[u64], cells: usize) -> Result<(), TestCaseError> {
    let message: T = any_message(bits, cells);
    let bytes = written(&message);
    let read = T::read_protobuf(&bytes).map_err(|error| TestCaseError::fail(error.to_string()))?;
    for (place, field) in T::FIELDS.iter().enumerate() {
        // Compared as written, for `NaN` is not equal to itself.
        let text = |message: &T| format!("{:?}", message.field(place));
        prop_assert_eq!(text(&message), text(&read), "{}", field.name);
    }
    prop_assert_eq!(&bytes, &written(&read), "written again");
    check_described(&described::<T>(), &message)
}

proptest! {
    #[test]
    fn every_message_reads_back_to_the_last_bit_here_and_elsewhere(
        bits in proptest::collection::vec(
            prop_oneof![
                any::<u64>(),
                Just(0),
                Just((-0.0_f64).to_bits()),
                Just(f64::NAN.to_bits()),
                Just(u64::MAX),
                0..1000_u64,
            ],
            1..200,
        ),
        cells in 0..=MAX_CELLS,
    ) {
        check::<State>(&bits, cells)?;
        check::<Timing>(&bits, cells)?;
        check::<Estimate>(&bits, cells)?;
        check::<Cycle>(&bits, cells)?;
        check::<Alarm>(&bits, cells)?;
        check::<CommandRecord>(&bits, cells)?;
        check::<RecordingStatus>(&bits, cells)?;
    }

    #[test]
    fn any_bytes_are_a_message_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(state) = State::read_protobuf(&bytes) {
            prop_assert!(State::read_protobuf(&written(&state)).is_ok());
        }
    }

    #[test]
    fn a_message_cut_anywhere_never_has_a_wrong_value(at in 0..400_usize) {
        let state: State = any_message(&[0x4009_21fb_5444_2d18, 77, 12], 4);
        let bytes = written(&state);
        if let Ok(cut) = State::read_protobuf(&bytes[..at.min(bytes.len())]) {
            // Only between two fields, when the lists are there, and then the rest is empty.
            for (place, field) in State::FIELDS.iter().enumerate() {
                let (found, empty) = (cut.field(place), State::empty());
                prop_assert!(found == state.field(place) || found == empty.field(place), "{}", field.name);
            }
        }
    }
}

#[test]
fn the_descriptor_says_what_a_field_is() {
    let state = described::<State>();
    let file = state.parent_file();
    assert_eq!((file.name(), state.fields().len()), ("wormd_state_v4.proto", 30));
    assert_eq!(format!("{:?}", file.syntax()), "proto3");
    let field = |name: &str| state.get_field_by_name(name).expect(name);
    assert_eq!(field("time_ns").kind(), Kind::Fixed64);
    assert_eq!(field("sequence").kind(), Kind::Uint64);
    assert_eq!(field("phase").kind(), Kind::Double);
    assert!(field("position_m").is_list() && field("position_m").is_packed());
    assert_eq!(field("position_m").json_name(), "position_m");
    assert!(field("emergency_stop").supports_presence() && !field("cell_count").supports_presence());
    let Kind::Enum(reasons) = field("hold_reason").kind() else {
        panic!("{:?}", field("hold_reason").kind());
    };
    let name = reasons.get_value(HoldReason::LeaseLapsed.code().cast_signed());
    assert_eq!(name.expect("a value").name(), "HOLD_REASON_LEASE_LAPSED");
    let Kind::Enum(alarms) = field("fault_alarm").kind() else {
        panic!("{:?}", field("fault_alarm").kind());
    };
    assert_eq!(alarms.full_name(), "wormd_state_v4.AlarmKind");
    let comments = file
        .file_descriptor_proto()
        .source_code_info
        .as_ref()
        .expect("comments");
    let of_phase = comments.location.iter().find(|location| location.path == [4, 0, 2, 2]);
    assert_eq!(
        of_phase.expect("a comment").leading_comments(),
        "Gait cycles done, unwrapped: the cam angle over one turn, zero at the configured home."
    );
}

#[test]
fn a_text_that_is_none_or_too_long_is_refused() {
    let mut fields = CommandRecord::FIELDS.iter();
    let place = fields.position(|field| field.name == "sender").expect("a sender");
    let number = place as u8 + 1;
    for text in [&[0xff; 3][..], &[b'x'; 33], b"a\0b"] {
        let bytes = [&[number << 3 | 2, text.len() as u8], text].concat();
        let refused = CommandRecord::read_protobuf(&bytes).expect_err("no sender");
        assert_eq!(refused.to_string(), "sender is out of range", "{text:?}");
    }
}

#[test]
fn what_is_no_message_is_refused_with_the_reason() {
    let mut state = State::unknown(2);
    (state.mode, state.fault_alarm) = (Mode::Crawling.code(), AlarmKind::MotorStall.code());
    let bytes = written(&state);
    assert_eq!(State::read_protobuf(&bytes).map(|state| state.fault_alarm), Ok(0));
    let refused = |bytes: &[u8]| State::read_protobuf(bytes).expect_err("is no state").to_string();
    for (bytes, expected) in [
        (&[0xff, 0xff][..], "ends within the number of a field"),
        (&[0x0b], "ends within the number of a field"),
        (&[0xf8, 0x01, 1], "wormd_state_v4 has no field 31"),
        (&[0x00, 1], "wormd_state_v4 has no field 0"),
        (
            &[0x09, 0, 0, 0, 0, 0, 0, 0, 0],
            "sequence is encoded as another type than it has",
        ),
        (&[0x19, 1, 2, 3], "ends within phase"),
        (&[0x6a, 7, 0, 0, 0, 0, 0, 0, 0], "ends within position_m"),
        (&[0x6a, 136, 1], "ends within position_m"),
        (&[0x90, 1, 0xff, 0xff, 0xff, 0xff, 0x7f], "cell_count is out of range"),
        (&[0x90, 1, 2], "position_m has 0 values for 2 cells"),
    ] {
        assert_eq!(refused(bytes), expected, "{bytes:?}");
    }
    let long = [&[0x6a, 0x88, 1][..], &[0; 136]].concat();
    assert_eq!(refused(&long), "position_m is out of range");
    assert_eq!(
        State::read_protobuf(&[&bytes[..], &[0xf8, 1, 0]].concat()),
        Err(ProtobufError::UnknownField {
            type_name: "wormd_state_v4",
            number: 31
        })
    );
}
