//! A servo's recording as the search sees it.

use crate::bench::ServoRecording;
use crate::explain::search::bins::{Bin, Bins};
use worm_physics::servo::Command;

/// Length of a bin, s, and its fewest readings.
const BIN_S: f64 = 0.05;
const MIN_READINGS: usize = 2;
/// Half the window over which positions are smoothed for velocity and acceleration, s.
const SMOOTHED_S: f64 = 0.04;

/// A run.
#[derive(Debug, Clone)]
pub(super) struct Observed<'a> {
    pub recording: &'a ServoRecording,
    pub gain: f64,
    /// Number of its trajectory in the campaign, and a name for it.
    pub trajectory: usize,
    pub trajectory_name: String,
    pub bins: Bins,
    /// Of the smoothed positions, rad/s and rad/s².
    pub velocity_rad_s: Vec<f64>,
    pub acceleration_rad_s2: Vec<f64>,
}

impl<'a> Observed<'a> {
    pub fn new(recording: &'a ServoRecording, gain: f64, trajectory: usize, trajectory_name: String) -> Self {
        let (velocity_rad_s, acceleration_rad_s2) = smoothed(&recording.time_s, &recording.position_rad);
        Self {
            bins: bins(&recording.time_s),
            recording,
            gain,
            trajectory,
            trajectory_name,
            velocity_rad_s,
            acceleration_rad_s2,
        }
    }

    /// What the servo is told from a reading on.
    pub fn command(&self, reading: usize) -> Command {
        Command {
            gain: self.gain,
            goal_rad: self.recording.goal_rad[reading],
            torque_enabled: self.recording.torque_enabled[reading],
        }
    }

    /// Name of the run: that of its file.
    pub fn name(&self) -> String {
        self.recording.source.display().to_string()
    }
}

/// Bins of equal time; whole seconds since the start are what a worm's cycles are.
fn bins(time_s: &[f64]) -> Bins {
    let start_s = time_s.first().copied().unwrap_or(0.0);
    let mut bins: Vec<Bin> = Vec::new();
    let mut from = 0;
    while from < time_s.len() {
        let number = ((time_s[from] - start_s) / BIN_S).floor();
        let to = from + time_s[from..].partition_point(|time_s| ((time_s - start_s) / BIN_S).floor() <= number);
        if to - from >= MIN_READINGS {
            let phase = time_s[from..to].iter().sum::<f64>() / (to - from) as f64 - start_s;
            bins.push(Bin {
                samples: from..to,
                number: number as i64,
                phase,
                cycle: phase as usize,
                leading: 0,
                of_step: phase.fract(),
            });
        }
        from = to;
    }
    Bins {
        cycles: bins.last().map_or(0, |bin| bin.cycle + 1),
        bins,
        per_step: (1.0 / BIN_S).round() as usize,
        start_phase: 0.0,
        steps: 1,
    }
}

/// First and second derivatives, by a parabola through the readings about each.
fn smoothed(time_s: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let of_reading = |at: usize| {
        let from = time_s.partition_point(|time| *time < time_s[at] - SMOOTHED_S);
        let to = time_s.partition_point(|time| *time <= time_s[at] + SMOOTHED_S);
        // Sums of powers of the time for the normal equations of a parabola.
        let (mut powers, mut products) = ([0.0; 5], [0.0; 3]);
        for reading in from..to {
            let after = (time_s[reading] - time_s[at]) / SMOOTHED_S;
            let mut power = 1.0;
            for (number, sum) in powers.iter_mut().enumerate() {
                *sum += power;
                if let Some(product) = products.get_mut(number) {
                    *product += power * values[reading];
                }
                power *= after;
            }
        }
        let normal = nalgebra::Matrix3::from_fn(|row, column| powers[row + column]);
        let found = normal.lu().solve(&nalgebra::Vector3::from(products));
        found.map_or((0.0, 0.0), |found| {
            (found[1] / SMOOTHED_S, 2.0 * found[2] / SMOOTHED_S.powi(2))
        })
    };
    (0..time_s.len()).map(of_reading).unzip()
}
