//! The torque at the cam, as the motor's current shows it: evidence of forces, which no positions are.
//!
//! Between two samples the cam takes the work of its torque along the way that it turns, less what the inertia takes.

use super::gears::GearErrors;
use crate::recording::{Motor, Recording};
use std::f64::consts::TAU;
use std::ops::Range;
use worm_estimator::self_sensing::GearModel;
use worm_estimator::winding::Reported;

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
        (seen as f64 >= SHOWN * increment_j.len() as f64).then_some(Self {
            gear: *gear,
            increment_j,
        })
    }

    /// Work that the cam takes between two samples, J; `NaN` where part of it was not seen.
    pub fn work_j(&self, samples: Range<usize>) -> f64 {
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
    let winding_a = gear.winding_current_a(&Reported {
        current_a: motor.current_a[sample],
        bus_voltage_v: motor.voltage_v[sample],
        duty: motor.duty[sample],
        velocity_rad_per_s: velocity,
        temperature_c: motor.temperature_c[sample],
    });
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

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 100.0;
    const CYCLES: f64 = 2.0;

    fn gear() -> GearModel {
        GearModel {
            dry_n_m: 0.01,
            viscous_n_m_s_per_rad: 0.004,
            ..GearModel::plain(0.4, 3.0, 0.002)
        }
    }

    /// A motor that comes from 1 to 3 rad/s over two cycles while the cam takes a torque, N m; its angle and currents follow by the
    /// work done. `seen` is whether the current of a sample was.
    fn recorded(cam_n_m: f64, seen: impl Fn(usize) -> bool) -> (Recording, Vec<f64>) {
        let angle_rad = CYCLES * TAU;
        let acceleration = (9.0 - 1.0) / (2.0 * angle_rad);
        let samples = (2.0 / acceleration * RATE_HZ) as usize;
        let time_s: Vec<f64> = (0..=samples).map(|sample| sample as f64 / RATE_HZ).collect();
        let velocity = |&at_s: &f64| 1.0 + acceleration * at_s;
        let angle = |&at_s: &f64| at_s + 0.5 * acceleration * at_s * at_s;
        let mut motor = Motor::default();
        for (sample, at_s) in time_s.iter().enumerate() {
            let torque_n_m = cam_n_m + 0.01 + 0.004 * velocity(at_s) + 0.002 * acceleration;
            motor.angle_rad.push(angle(at_s));
            motor.velocity_rad_s.push(velocity(at_s));
            motor
                .current_a
                .push(if seen(sample) { torque_n_m / 0.4 } else { f64::NAN });
            motor.voltage_v.push(5.0);
            motor.duty.push(f64::NAN);
            motor.temperature_c.push(f64::NAN);
        }
        let phase: Vec<f64> = time_s.iter().map(|at_s| angle(at_s) / TAU).collect();
        let recording = Recording {
            source: "two cycles".into(),
            cell_names: Vec::new(),
            position_m: Vec::new(),
            gait_phase: Some(phase.clone()),
            motor: Some(motor),
            warnings: Vec::new(),
            repairs: Vec::new(),
            time_s,
        };
        (recording, phase)
    }

    #[test]
    fn the_cam_takes_what_friction_and_inertia_leave() {
        let (recording, phase) = recorded(0.03, |_| true);
        let torque = MeasuredTorque::new(&recording, &phase, &gear()).expect("it has a current");
        let done_j = torque.cumulative_j(&phase, &GearErrors::default());
        let turned = phase.last().expect("samples") - phase[0];
        // The inertia is taken from averaged velocities, which miss half a sample at either end.
        let expected_j = 0.03 * TAU * turned;
        let found_j = done_j.last().expect("samples");
        assert!((found_j / expected_j - 1.0).abs() < 2e-3, "{found_j} of {expected_j} J");
        let corrected = GearErrors {
            offset_n_m: 0.01,
            ..GearErrors::default()
        };
        let less_j = torque.cumulative_j(&phase, &corrected);
        let saved_j = found_j - less_j.last().expect("samples");
        assert!((saved_j - 0.01 * TAU * turned).abs() < 1e-9, "{saved_j}");
    }

    #[test]
    fn gaps_in_the_current_are_bridged_as_long_as_they_are_few() {
        let (recording, phase) = recorded(0.03, |sample| !(200..220).contains(&sample));
        let torque = MeasuredTorque::new(&recording, &phase, &gear()).expect("most of it is there");
        let done_j = torque.cumulative_j(&phase, &GearErrors::default());
        let expected_j = 0.03 * TAU * (phase.last().expect("samples") - phase[0]);
        assert!((done_j.last().expect("samples") / expected_j - 1.0).abs() < 5e-3);
        let (recording, phase) = recorded(0.03, |sample| sample % 4 != 0);
        assert!(MeasuredTorque::new(&recording, &phase, &gear()).is_none());
    }
}
