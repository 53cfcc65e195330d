//! The torque at the cam, as the motor's current shows it: evidence of forces, which no positions are.
//!
//! Between two samples the cam takes the work of its torque along the way that it turns, less what the inertia takes. A bin's torque is
//! the work in it over that way, and so is the model's, whatever happens within the bin.

use super::gears::GearErrors;
use super::observed::Observed;
use super::predicted::Predicted;
use crate::explain::search::bins::Bins;
use crate::recording::{Motor, Recording};
use std::f64::consts::TAU;
use std::ops::Range;
use worm_estimator::self_sensing::GearModel;

/// Samples on either side over which the velocity is averaged: servos report it in coarse steps.
const BESIDE: usize = 1;
/// Least part of the samples that must show a current.
const SHOWN: f64 = 0.9;

/// What the current shows of a run.
#[derive(Debug, Clone)]
pub(in crate::explain) struct MeasuredTorque {
    /// What was assumed of the gears.
    pub gear: GearModel,
    /// Work that the cam takes from each sample to the next, J; `NaN` where not seen.
    increment_j: Vec<f64>,
}

impl MeasuredTorque {
    /// By the currents of a recording with a phase; none where it has too few of them.
    pub fn new(recording: &Recording, phase: &[f64], gear: &GearModel) -> Option<Self> {
        let motor = recording.motor.as_ref()?;
        let samples = phase.len();
        let velocity = smoothed(&motor.velocity_rad_s);
        let torque_n_m: Vec<f64> = (0..samples).map(|sample| cam_torque_n_m(motor, gear, sample)).collect();
        let increment_j: Vec<f64> = (1..samples)
            .map(|after| {
                let before = after - 1;
                let turned_rad = TAU * (phase[after] - phase[before]);
                let kinetic_j = 0.5 * gear.inertia_kg_m2 * (velocity[after].powi(2) - velocity[before].powi(2));
                0.5 * (torque_n_m[before] + torque_n_m[after]) * turned_rad - kinetic_j
            })
            .collect();
        let seen = increment_j.iter().filter(|increment_j| increment_j.is_finite()).count();
        (seen as f64 >= SHOWN * increment_j.len() as f64).then(|| Self {
            gear: *gear,
            increment_j,
        })
    }

    /// Work that the cam takes between two samples, J; `NaN` where part of it was not seen.
    fn work_j(&self, samples: Range<usize>) -> f64 {
        self.increment_j[samples].iter().sum()
    }

    /// Work that the cam took up to each sample, J, by gears that are wrong by this much; where no current was seen, the torque is that
    /// before.
    pub fn cumulative_j(&self, phase: &[f64], gears: &GearErrors) -> Vec<f64> {
        let (mut done_j, mut torque_n_m) = (0.0, 0.0);
        let mut cumulative_j = vec![0.0];
        for (increment_j, ends) in self.increment_j.iter().zip(phase.windows(2)) {
            let turned_rad = TAU * (ends[1] - ends[0]);
            if increment_j.is_finite() && turned_rad > 0.0 {
                torque_n_m = gears.cam_n_m(increment_j / turned_rad);
            }
            done_j += torque_n_m * turned_rad;
            cumulative_j.push(done_j);
        }
        cumulative_j
    }
}

/// Torque that the cam takes at a sample, and that the inertia takes, N m.
fn cam_torque_n_m(motor: &Motor, gear: &GearModel, sample: usize) -> f64 {
    let velocity = motor.velocity_rad_s[sample];
    let winding_v = motor.voltage_v[sample] * motor.duty[sample];
    let winding_a = gear.winding_current_a(motor.current_a[sample], winding_v, velocity, motor.temperature_c[sample]);
    gear.cam_torque_n_m(winding_a, velocity, motor.angle_rad[sample])
}

/// Means over neighbouring samples.
fn smoothed(values: &[f64]) -> Vec<f64> {
    (0..values.len())
        .map(|sample| {
            let beside = &values[sample.saturating_sub(BESIDE)..(sample + BESIDE + 1).min(values.len())];
            beside.iter().sum::<f64>() / beside.len() as f64
        })
        .collect()
}

/// The samples at the ends of a bin: its first, and the first of the next.
fn ends(observed: &Observed<'_>, samples: &Range<usize>) -> Range<usize> {
    samples.start..samples.end.min(observed.samples() - 1)
}

/// Mean torque in each bin, N m: measured, and as a model has it shown by the current. `NaN` where it was not seen; nothing of a run without
/// a current.
pub(in crate::explain) fn in_bins(observed: &Observed<'_>, bins: &Bins, predicted: &Predicted) -> Vec<[f64; 2]> {
    let Some(torque) = &observed.torque else {
        return Vec::new();
    };
    let pairs_n_m: Vec<[f64; 2]> = bins
        .bins
        .iter()
        .map(|bin| {
            let samples = ends(observed, &bin.samples);
            let turned_rad = TAU * (observed.phase[samples.end] - observed.phase[samples.start]);
            let model_j = predicted.work_j[samples.end] - predicted.work_j[samples.start];
            if turned_rad > 0.0 {
                let measured_n_m = torque.work_j(samples) / turned_rad;
                [measured_n_m, model_j / turned_rad]
            } else {
                [f64::NAN; 2]
            }
        })
        .collect();
    let with_lead = |bin: usize| {
        let [measured_n_m, model_n_m] = pairs_n_m[bin];
        let lead_n_m = predicted.gears.lead_s / observed.cycle_s * rise_n_m(bins, &pairs_n_m, bin);
        [measured_n_m, predicted.gears.shown_n_m(model_n_m + lead_n_m)]
    };
    (0..bins.len()).map(with_lead).collect()
}

/// By how much the model's torque rises at a bin within its step, N m in each cycle of phase.
fn rise_n_m(bins: &Bins, pairs_n_m: &[[f64; 2]], bin: usize) -> f64 {
    let step_of = |bin: usize| bins.bins[bin].number.div_euclid(bins.per_step as i64);
    let is_same_step = |other: &usize| *other < bins.len() && step_of(*other) == step_of(bin);
    let before = bin.checked_sub(1).filter(is_same_step).unwrap_or(bin);
    let after = Some(bin + 1).filter(is_same_step).unwrap_or(bin);
    let rise_n_m = pairs_n_m[after][1] - pairs_n_m[before][1];
    let phase = bins.bins[after].phase - bins.bins[before].phase;
    if phase > 0.0 && rise_n_m.is_finite() {
        rise_n_m / phase
    } else {
        0.0
    }
}

/// What a prediction leaves of the torque in each bin, N m; as [`in_bins`].
pub(in crate::explain) fn residual_n_m(observed: &Observed<'_>, bins: &Bins, predicted: &Predicted) -> Vec<f64> {
    let pairs = in_bins(observed, bins, predicted);
    pairs.iter().map(|[measured, model]| measured - model).collect()
}
