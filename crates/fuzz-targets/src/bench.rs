//! A servo on a bench: campaigns, models, and recordings.

use crate::readable;
use std::path::Path;
use worm_analysis::bench::{BenchCampaign, ServoModel, ServoRecording, plant_of};

/// A campaign, or a model's file: what is accepted has physics, and a model reads back the same from a file of its own.
pub(crate) fn bench_toml(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    if let Err(error) = plant_of(text, Path::new("bench.toml")) {
        drop(readable(error));
    }
    match BenchCampaign::from_toml(text, Path::new("no-such-folder/bench.toml")) {
        Ok(campaign) => {
            assert!(!campaign.runs.is_empty() && campaign.supply_v > 0.0);
            assert!(campaign.pendulum.inertia_kg_m2() > 0.0);
        }
        Err(error) => drop(readable(error)),
    }
    match ServoModel::from_toml(text, Path::new("model.toml")) {
        Ok(model) => {
            assert!(model.motor.winding_ohm > 0.0 && model.motor.rotor_inertia_kg_m2 > 0.0);
            let again = ServoModel::from_toml(&model.to_toml(), Path::new("model.toml"));
            // Tiny values may be rounded to nothing in the file.
            if let Ok(again) = again {
                assert_eq!(again.effects.len(), model.effects.len());
            }
        }
        Err(error) => drop(readable(error)),
    }
}

/// A recording: what is accepted has as many of everything, finite and in order.
pub(crate) fn servo_csv(data: &[u8]) {
    match ServoRecording::read(data, Path::new("servo.csv")) {
        Ok(recording) => {
            let readings = recording.readings();
            assert!(recording.time_s.windows(2).all(|pair| pair[0] < pair[1]), "in order");
            assert_eq!(recording.torque_enabled.len(), readings);
            for values in [
                &recording.goal_rad,
                &recording.position_rad,
                &recording.velocity_rad_s,
                &recording.current_a,
            ] {
                assert!(values.len() == readings && values.iter().all(|value| value.is_finite()));
            }
        }
        Err(error) => drop(readable(error)),
    }
}
