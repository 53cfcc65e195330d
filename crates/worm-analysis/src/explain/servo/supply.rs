//! What the voltages that a servo reports say of its supply.
//!
//! They are read while the bridge switches, so each scatters by a volt; their mean falls by the supply's resistance times its current.

use super::observed::Observed;
use worm_physics::servo::ServoPhysics;

/// Spread of the supply's current that is needed, A.
const MIN_SPREAD_A: f64 = 0.1;
/// Least standard error that is believed, Ω, and the factor on that of independent readings: neighbours are not.
const LEAST_OHM: f64 = 0.15;
const NEIGHBOURS: f64 = 4.0;

/// The supply's resistance as read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SupplyReading {
    pub ohm: f64,
    pub sigma_ohm: f64,
    /// Voltage without load, V.
    pub unloaded_v: f64,
}

/// Reads the supply off the voltages; none where they or the currents hardly differ.
pub(super) fn read(observed: &[Observed<'_>], physics: &ServoPhysics) -> Option<SupplyReading> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for run in observed {
        let recording = run.recording;
        for (reading, &volt) in recording.input_v.iter().enumerate() {
            let command = run.command(reading.saturating_sub(1));
            if command.torque_enabled {
                let duty = physics.duty(command.gain, command.goal_rad, recording.position_rad[reading]);
                let current_a = physics.current_a(duty, run.velocity_rad_s[reading], 25.0);
                points.push((duty * current_a, volt));
            }
        }
    }
    let count = points.len() as f64;
    let (sum_a, sum_v) = points
        .iter()
        .fold((0.0, 0.0), |(a, v), point| (a + point.0, v + point.1));
    let (mean_a, mean_v) = (sum_a / count, sum_v / count);
    let square = points.iter().map(|(a, _)| (a - mean_a).powi(2)).sum::<f64>();
    if points.is_empty() || (square / count).sqrt() < MIN_SPREAD_A {
        return None;
    }
    let slope = points.iter().map(|(a, v)| (a - mean_a) * (v - mean_v)).sum::<f64>() / square;
    let rest = points
        .iter()
        .map(|(a, v)| (v - mean_v - slope * (a - mean_a)).powi(2))
        .sum::<f64>()
        / count;
    if rest == 0.0 {
        return None; // a voltage that was written down once
    }
    Some(SupplyReading {
        ohm: (-slope).max(0.0),
        sigma_ohm: (NEIGHBOURS * (rest / square).sqrt()).max(LEAST_OHM),
        unloaded_v: mean_v - slope * mean_a,
    })
}
