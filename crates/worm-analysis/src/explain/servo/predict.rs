//! The motion that a hypothesis predicts for a run: from its first reading on, never reset.

use super::nuisance::{Nuisance, free_table};
use super::observed::Observed;
use crate::explain::search::hypothesis::Hypothesis;
use worm_physics::servo::{Energy, LONGEST_STEP_S, ServoMotion, ServoPhysics};

/// Temperature of a servo that does not report it, °C.
const USUAL_C: f64 = 30.0;

/// A predicted run.
#[derive(Debug, Clone, Default)]
pub(super) struct Predicted {
    /// At every reading.
    pub angle_rad: Vec<f64>,
    pub velocity_rad_s: Vec<f64>,
    /// Duty and winding current, A, of the step before every reading.
    pub duty: Vec<f64>,
    pub current_a: Vec<f64>,
    pub energy: Energy,
}

/// The physics of a hypothesis.
pub(super) fn physics(nominal: &ServoPhysics, hypothesis: &Hypothesis, at: &[f64]) -> ServoPhysics {
    let mut physics = nominal.clone();
    let mut entries_n_m = Vec::new();
    for (free, &value) in hypothesis.free.iter().zip(at) {
        match Nuisance::of(free.what) {
            Some(Nuisance::Table(_)) => entries_n_m.push(value),
            Some(nuisance) => nuisance.apply(value, &mut physics),
            None => {}
        }
    }
    physics.laws.tables.extend(free_table(entries_n_m));
    physics.with(&hypothesis.settings(at))
}

/// A run by some physics.
pub(super) fn predict(observed: &Observed<'_>, physics: &ServoPhysics) -> Predicted {
    let recording = observed.recording;
    let case_c = recording.temperature_c.first().copied().unwrap_or(USUAL_C);
    let mut motion = ServoMotion::new(recording.position_rad[0], recording.velocity_rad_s[0], case_c);
    let readings = recording.readings();
    let mut predicted = Predicted {
        angle_rad: Vec::with_capacity(readings),
        velocity_rad_s: Vec::with_capacity(readings),
        duty: Vec::with_capacity(readings),
        current_a: Vec::with_capacity(readings),
        energy: Energy::default(),
    };
    for reading in 0..readings {
        let command = observed.command(reading.saturating_sub(1));
        if reading > 0 {
            let passed_s = recording.time_s[reading] - recording.time_s[reading - 1];
            motion.advance(physics, &command, passed_s, LONGEST_STEP_S);
        }
        predicted.angle_rad.push(motion.angle_rad());
        predicted.velocity_rad_s.push(motion.velocity_rad_s());
        predicted.duty.push(motion.duty());
        predicted.current_a.push(motion.current_a(physics, &command));
    }
    predicted.energy = motion.energy();
    predicted
}
