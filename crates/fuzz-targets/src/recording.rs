//! Recordings: this project's own CSV, and motion capture.

use crate::{MAX_WARNINGS_LEN, readable};
use std::io::Cursor;
use std::path::Path;
use worm_analysis::recording::{Motor, OpenOptions, Recording, Wanted, read_from, write_csv};
use worm_physics::MAX_CELLS;

/// A recording as a table of named columns, of positions and of the motor alone.
pub(crate) fn recording_csv(data: &[u8]) {
    read(data, "worm.csv", &OpenOptions::default());
    let of_motor = OpenOptions {
        wanted: Wanted::PositionsOrMotor { window_s: 0.0 },
        cells: Some(4),
        ..OpenOptions::default()
    };
    read(data, "worm.csv", &of_motor);
}

/// Trajectories of markers as Vicon Nexus exports them, with the canal's direction found and given.
pub(crate) fn vicon_csv(data: &[u8]) {
    markers(data, "trial.csv");
}

/// Markers as C3D, with the canal's direction found and given.
pub(crate) fn c3d(data: &[u8]) {
    markers(data, "trial.c3d");
}

fn markers(data: &[u8], name: &str) {
    read(data, name, &OpenOptions::default());
    let given = OpenOptions {
        from_s: Some(0.1),
        to_s: Some(1e6),
        axis: "x".parse().ok(),
        ..OpenOptions::default()
    };
    read(data, name, &given);
}

fn read(data: &[u8], name: &str, options: &OpenOptions) {
    match read_bytes(data, name, options) {
        Ok(recording) => check(&recording),
        Err(error) => drop(readable(error)),
    }
}

fn read_bytes(data: &[u8], name: &str, options: &OpenOptions) -> Result<Recording, worm_log::ReadError> {
    let mut reported = 0.0;
    let mut progress = |fraction| {
        assert!(
            (reported..=1.0).contains(&fraction),
            "progress of {fraction} after {reported}"
        );
        reported = fraction;
    };
    read_from(
        Cursor::new(data),
        data.len() as u64,
        Path::new(name),
        options,
        &mut progress,
    )
}

/// What an analysis takes for granted, and that the recording reads back the same from a file of its own.
pub(crate) fn check(recording: &Recording) {
    let samples = recording.samples();
    assert!(
        (2..=MAX_CELLS).contains(&recording.cells()),
        "{} cells",
        recording.cells()
    );
    assert_eq!(recording.cell_names.len(), recording.cells(), "a name for each cell");
    assert!(recording.time_s.iter().all(|time_s| time_s.is_finite()), "a time");
    assert!(recording.time_s.windows(2).all(|pair| pair[0] < pair[1]), "time grows");
    let motor = recording.motor.iter().flat_map(Motor::series);
    for series in recording.position_m.iter().chain(motor).chain(&recording.gait_phase) {
        assert_eq!(series.len(), samples, "as many values as samples");
        assert!(!series.iter().any(|value| value.is_infinite()), "an infinite value");
    }
    let phase = recording.gait_phase.iter().flatten();
    assert!(
        phase.into_iter().all(|phase| phase.is_finite()),
        "a phase that is not known"
    );
    let warnings: usize = recording.warnings.iter().map(String::len).sum();
    assert!(warnings <= MAX_WARNINGS_LEN, "{warnings} bytes of warnings");
    let filled = recording.filled();
    assert!(
        !filled.iter().flatten().any(|value| value.is_infinite()),
        "bridged by an infinite value"
    );

    let mut text = Vec::new();
    write_csv(recording, &mut text).expect("memory can be written");
    // What was accepted with longer gaps than usual is accepted again.
    let options = OpenOptions {
        max_gap_s: f64::MAX,
        wanted: Wanted::PositionsOrMotor {
            window_s: Wanted::USUAL_WINDOW_S,
        },
        ..OpenOptions::default()
    };
    let again = read_bytes(&text, "again.csv", &options).expect("what was written can be read");
    assert_eq!(again.time_s, recording.time_s, "the same times");
    assert_eq!(again.position_m.len(), recording.position_m.len(), "the same cells");
    let series = |of: &Recording| {
        let motor: Vec<Vec<f64>> = of.motor.iter().flat_map(Motor::series).cloned().collect();
        let series = of.position_m.iter().cloned().chain(motor).chain(of.gait_phase.clone());
        series
            .map(|values| values.iter().map(|value| value.to_bits() | unseen(*value)).collect())
            .collect::<Vec<Vec<u64>>>()
    };
    assert_eq!(series(&again), series(recording), "the same values");
}

/// All values that are not a number count as the same.
fn unseen(value: f64) -> u64 {
    if value.is_nan() { u64::MAX } else { 0 }
}
