//! A recording as a log, as a live worm would have published it.

use crate::recording::Recording;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::SystemTime;
use worm_estimator::config::Config;
use worm_estimator::message::{Mode, State};
use worm_log::{Origin, WriteError, Writer};

/// Writes a recording as a log of states, one for each sample, over whatever is at `path`.
///
/// `text` is the configuration file's, if there is one. Sample times are kept as they are; the states' own times begin at
/// a second, in whole nanoseconds. A worm that turns its cam is crawling.
///
/// # Errors
/// [`WriteError`] when the file cannot be written.
pub fn write(recording: &Recording, config: &Config, text: Option<&str>, path: &Path) -> Result<(), WriteError> {
    let refused = |error: std::io::Error| WriteError {
        file: path.to_owned(),
        problem: error.to_string(),
    };
    let origin = Origin {
        worm: config.worm.name.clone(),
        cells: recording.cells(),
        config: text.map(str::to_owned),
        begun: SystemTime::now(),
        begun_ns: BEGIN_NS,
    };
    let file = File::create(path).map_err(refused)?;
    let mut writer = Writer::new(BufWriter::new(file), path, &origin)?;
    for sample in 0..recording.samples() {
        writer.write(&state(recording, sample))?;
    }
    let file = writer.finish()?;
    let file = file.into_inner().map_err(|error| refused(error.into_error()))?;
    file.sync_all().map_err(refused)
}

/// Time of the first state, ns: 0 would mean that there is no state.
const BEGIN_NS: u64 = 1_000_000_000;

fn state(recording: &Recording, sample: usize) -> State {
    let since_first_s = recording.time_s[sample] - recording.time_s[0];
    let mut state = State {
        sequence: sample as u64,
        time_ns: BEGIN_NS + (since_first_s * 1e9).round() as u64,
        sample_time_s: recording.time_s[sample],
        sample: sample as u64 + 1,
        sample_is_new: 1,
        ..State::unknown(recording.cells())
    };
    for (cell, position_m) in recording.position_m.iter().enumerate() {
        state.position_m[cell] = position_m[sample];
        state.valid_mask |= u32::from(position_m[sample].is_finite()) << cell;
    }
    if let Some(phase) = &recording.gait_phase {
        state.phase = phase[sample];
        state.mode = Mode::Crawling.code();
    }
    if let Some(motor) = &recording.motor {
        state.motor_angle_rad = motor.angle_rad[sample];
        state.motor_velocity_rad_s = motor.velocity_rad_s[sample];
        state.goal_velocity_rad_s = motor.velocity_rad_s[sample];
        state.motor_current_a = motor.current_a[sample];
        state.bus_voltage_v = motor.voltage_v[sample];
        state.motor_duty = motor.duty[sample];
        state.motor_temperature_c = motor.temperature_c[sample];
        state.motor_is_new = 1;
    }
    state
}
