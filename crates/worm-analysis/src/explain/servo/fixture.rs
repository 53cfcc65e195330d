//! A servo that follows the goals of the real recordings, for tests: simulated, without noise, in counts.

use super::explain::Bench;
use super::recorded_servo::RecordedServo;
use crate::bench::{BenchCampaign, ServoRecording};
use crate::explain::search::fit::Fit;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::plant::Plant;
use crate::explain::search::recalibrate::{measure_noise, recalibrate};
use std::path::Path;
use worm_physics::servo::{COUNT_RAD, Command, LONGEST_STEP_S, ServoMotion, ServoPhysics};

/// Scale of the discrepancy, as `wormd explain` has it.
const DISCREPANCY: f64 = 0.1;

/// The campaign of the real recordings.
pub(super) fn campaign() -> BenchCampaign {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/xl330-bench/bench.toml");
    BenchCampaign::load(&file).expect("the campaign that is shipped")
}

/// What a servo records in it whose dry friction grows by so many times itself in a run.
pub(super) fn record(campaign: &BenchCampaign, physics: &ServoPhysics, grows: f64) -> Vec<ServoRecording> {
    let mut recordings = campaign.open_all().expect("the recordings that are shipped");
    for (run, recording) in campaign.runs.iter().zip(&mut recordings) {
        let mut growing = physics.clone();
        let mut motion = ServoMotion::new(recording.position_rad[0], 0.0, 30.0);
        for reading in 0..recording.readings() {
            let before = reading.saturating_sub(1);
            let command = Command {
                gain: run.gain,
                goal_rad: recording.goal_rad[before],
                torque_enabled: recording.torque_enabled[before],
            };
            let passed_s = recording.time_s[reading] - recording.time_s[before];
            if reading > 0 {
                let done = (recording.time_s[reading] - recording.time_s[0]) / recording.duration_s();
                growing.motor.dry_n_m = physics.motor.dry_n_m * (1.0 + grows * done);
                motion.advance(&growing, &command, passed_s, LONGEST_STEP_S);
            }
            recording.position_rad[reading] = (motion.angle_rad() / COUNT_RAD).round() * COUNT_RAD;
            recording.velocity_rad_s[reading] = motion.velocity_rad_s();
        }
        recording.input_v.clear();
    }
    recordings
}

/// The model of a campaign, recalibrated by some recordings, and what is asked about it.
pub(super) fn recalibrated<T>(
    campaign: &BenchCampaign,
    recordings: &[ServoRecording],
    ask: impl Fn(&RecordedServo<'_>, &Fit) -> T,
) -> T {
    let bench = Bench::new(campaign, recordings);
    let nominal = bench.model.on(bench.pendulum, bench.supply_v, bench.duty_limit);
    let mut servo = RecordedServo::new(bench.observed(), nominal);
    let base = Hypothesis::new(&servo.nuisances(), &[]);
    let at = measure_noise(&mut servo, &base).expect("the servo could have made them");
    let (_, _, fit) = recalibrate(&servo, &base, at, DISCREPANCY);
    ask(&servo, &fit)
}
