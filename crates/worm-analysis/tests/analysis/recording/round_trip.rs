//! What is written is read back, and nothing that is read makes the reader panic.

use proptest::prelude::*;
use testkit::recording_files::{Folder, as_csv, crawl, difference, simulated};
use worm_analysis::recording::{Motor, Recording};

fn seen_or_not(value: impl Strategy<Value = f64>) -> impl Strategy<Value = f64> {
    prop_oneof![9 => value, 1 => Just(f64::NAN)]
}

prop_compose! {
    /// Any recording that can be read, with values of any size between noise and a metre.
    fn any_recording()(cells in 2usize..=16, samples in 12usize..40)(
        noise in proptest::collection::vec(proptest::collection::vec(seen_or_not(-1e-3..1e-3f64), samples), cells),
        period_s in 1e-3..0.05f64,
        phase in proptest::option::of(proptest::collection::vec(-1e6..1e6f64, samples)),
        motor in proptest::option::of(proptest::collection::vec(seen_or_not(proptest::num::f64::NORMAL), samples)),
    ) -> Recording {
        let samples = noise[0].len();
        let position_m = noise.iter().enumerate().map(|(cell, noise)| {
            noise.iter().enumerate().map(|(sample, noise)| {
                // Seen often enough, and getting ahead.
                let noise = if sample % 3 == 0 && noise.is_nan() { 0.0 } else { *noise };
                0.02 * sample as f64 - 0.05 * cell as f64 + noise
            }).collect()
        }).collect();
        Recording {
            source: "any".into(),
            cell_names: (1..=noise.len()).map(|cell| format!("x{cell}_m")).collect(),
            time_s: (0..samples).map(|sample| sample as f64 * period_s).collect(),
            position_m,
            gait_phase: phase,
            motor: motor.map(|series| Motor {
                angle_rad: series.clone(),
                velocity_rad_s: series.iter().map(|value| value / 3.0).collect(),
                current_a: vec![f64::NAN; samples],
                voltage_v: series,
                duty: vec![0.5; samples],
                temperature_c: vec![f64::NAN; samples],
            }),
            warnings: Vec::new(),
            repairs: Vec::new(),
        }
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_back_to_the_last_bit(recording in any_recording()) {
        let read = Folder::new().open("any.csv", as_csv(&recording)).expect("what was written can be read");
        prop_assert_eq!(&read.time_s, &recording.time_s);
        prop_assert_eq!(&read.cell_names, &recording.cell_names);
        prop_assert_eq!(&read.gait_phase, &recording.gait_phase);
        for (read_m, written_m) in read.position_m.iter().zip(&recording.position_m) {
            prop_assert_eq!(difference(read_m, written_m), 0.0);
        }
        prop_assert_eq!(read.motor.is_some(), recording.motor.is_some());
        for (read, written) in read.motor.iter().zip(&recording.motor) {
            for (read, written) in read.series().into_iter().zip(written.series()) {
                prop_assert_eq!(difference(read, written), 0.0);
            }
        }
    }

    #[test]
    fn no_damage_makes_the_reader_panic(at in 0usize..400, byte: u8, length in 0usize..1500) {
        let mut bytes = as_csv(&simulated(&crawl())).into_bytes();
        bytes.truncate(length);
        if let Some(place) = bytes.get_mut(at) {
            *place = byte;
        }
        if let Err(error) = Folder::new().open("damaged.csv", &bytes) {
            prop_assert!(error.to_string().contains("damaged.csv"));
        }
    }
}
