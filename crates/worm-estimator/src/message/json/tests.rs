//! Messages as JSON, there and back.

use crate::message::{Alarm, CommandRecord, Cycle, Estimate, JsonMessage, State, Timing};
use proptest::prelude::*;
use worm_physics::MAX_CELLS;

/// Any message: its bytes at random, which every topic must stand, and as many cells as a worm can have.
fn message<T: JsonMessage>(bytes: &[u8; 1024], set_cells: impl Fn(&mut T)) -> T {
    assert!(size_of::<T>() <= bytes.len());
    // SAFETY: the messages are plain numbers and arrays of them, for which every pattern of bytes is valid.
    let mut message: T = unsafe { bytes.as_ptr().cast::<T>().read_unaligned() };
    set_cells(&mut message);
    message
}

/// Written, read and written again, a message is the same text; so it is the same value, but for what is not in use.
fn round<T: JsonMessage>(message: T) -> Result<T, TestCaseError> {
    let (mut once, mut twice) = (Vec::new(), Vec::new());
    message.write_json(&mut once).expect("can be written");
    let read = T::read_json(&once).map_err(|error| TestCaseError::fail(error.to_string()))?;
    read.write_json(&mut twice).expect("can be written");
    prop_assert_eq!(once, twice);
    Ok(read)
}

proptest! {
    #[test]
    fn every_message_reads_back_to_the_last_bit(
        bytes in proptest::array::uniform32(proptest::array::uniform32(any::<u8>())),
        cells in 0..=MAX_CELLS,
    ) {
        let bytes: [u8; 1024] = bytes.concat().try_into().expect("32 by 32 bytes");
        let state: State = message(&bytes, |state: &mut State| state.cell_count = cells as u32);
        let read = round(state)?;
        let bits = |value: f64| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() };
        macro_rules! same { ($($field:ident)+) => {$( prop_assert_eq!(read.$field, state.$field); )+}; }
        macro_rules! same_bits {
            ($($field:ident)+) => {$( prop_assert_eq!(bits(read.$field), bits(state.$field), "{}", stringify!($field)); )+};
        }
        same! { sequence time_ns sample samples_missed link_failures cell_count valid_mask sample_is_new motor_is_new }
        same! { mode fault fault_alarm hardware_error }
        same_bits! { phase motor_angle_rad motor_velocity_rad_s goal_velocity_rad_s motor_current_a motor_duty }
        same_bits! { bus_voltage_v motor_temperature_c sample_time_s }
        for cell in 0..MAX_CELLS {
            let expected = if cell < cells { state.position_m[cell] } else { f64::NAN };
            prop_assert_eq!(bits(read.position_m[cell]), bits(expected));
        }
        round(message(&bytes, |_: &mut Timing| ()))?;
        round(message(&bytes, |estimate: &mut Estimate| estimate.cell_count = cells as u32))?;
        round(message(&bytes, |cycle: &mut Cycle| cycle.cell_count = cells as u32))?;
        round(message(&bytes, |_: &mut Alarm| ()))?;
        round(message(&bytes, |_: &mut CommandRecord| ()))?;
    }
}

#[test]
fn a_message_says_what_it_holds() {
    let mut state = State::unknown(2);
    state.position_m[0] = -0.0;
    state.phase = f64::INFINITY;
    state.sequence = u64::MAX;
    let mut text = Vec::new();
    state.write_json(&mut text).expect("can be written");
    let text = String::from_utf8(text).expect("is text");
    for part in [
        r#""sequence":18446744073709551615,"#,
        r#""phase":"Infinity","motor_angle_rad":null"#,
        r#""position_m":[-0.0,null],"#,
        r#""mode":"disarmed","fault":"none","fault_alarm":null"#,
    ] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    for (whole, broken, complaint) in [
        ("[-0.0,null]", "[1.0]", "position_m has 1 values for 2 cells"),
        (
            "\"disarmed\"",
            "\"asleep\"",
            "expected the name or code of a controller mode",
        ),
        ("\"mode\"", "\"mood\"", "unknown field `mood`"),
        (",\"fault_alarm\":null", "", "missing field `fault_alarm`"),
        ("\"Infinity\"", "\"far\"", "expected a number, null"),
    ] {
        let error = State::read_json(text.replace(whole, broken).as_bytes()).expect_err(complaint);
        assert!(error.to_string().contains(complaint), "{error}");
    }
}

#[test]
fn the_schema_describes_every_member() {
    let schema = State::schema();
    let mut text = Vec::new();
    State::unknown(4).write_json(&mut text).expect("can be written");
    let members: serde_json::Map<_, _> = serde_json::from_slice(&text).expect("an object");
    let properties = schema["properties"].as_object().expect("an object");
    assert_eq!(
        members.keys().collect::<Vec<_>>(),
        properties.keys().collect::<Vec<_>>()
    );
    for (name, property) in properties {
        assert!(
            property["description"].as_str().is_some_and(|text| text.len() > 10),
            "{name}"
        );
        // Viewers refuse anything but one plain type.
        assert!(property["type"].is_string(), "{name}");
    }
    assert_eq!(
        properties["motor_current_a"]["description"],
        "Current in the motor winding, A."
    );
    assert_eq!(properties["mode"]["enum"][2], "crawling");
}
