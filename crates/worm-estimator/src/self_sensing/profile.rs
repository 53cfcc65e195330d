//! The torque of one gait cycle, folded into bins of the phase.
//!
//! A bin holds the mean over its stretch of the phase (each reading counts by how far the cam turned), so that torque times angle stays
//! the work. At the end of the cycle the torque of the inertia is taken out, J/2 (ω₂² − ω₁²) over the bin's angle: the velocities at its
//! edges are means over the quarter bins on either side, for the servo's velocity is read in coarse steps. Where a fast cam leaves an edge
//! without readings, ω² is linear between the edges around it, so that no work of the inertia stays in the profile.

use std::f64::consts::TAU;
use worm_physics::MAX_CELLS;

/// Bins in each step.
pub const BINS_PER_STEP: usize = 32;
/// Most bins in a cycle.
pub const MAX_BINS: usize = BINS_PER_STEP * MAX_CELLS;
/// Share of the bins that must have readings.
const FILLED_SHARE: f64 = 0.95;

#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    count: f64,
    turned: f64, // cycles of phase
    torque: f64, // N m × cycles
    squares: f64,
    early: Edge,
    late: Edge,
}

/// Velocity in the first or last quarter of a bin.
#[derive(Debug, Clone, Copy, Default)]
struct Edge {
    count: f64,
    velocity: f64,
}

/// The open cycle.
#[derive(Debug, Clone)]
pub(super) struct Profile {
    bins: usize,
    bin: Box<[Bin; MAX_BINS]>,
    torque_n_m: Box<[f64; MAX_BINS]>,
    variance: f64,
    swept: f64, // velocity over the phase of the open cycle, rad/s × cycles
    velocity_rad_per_s: f64,
}

impl Profile {
    pub(super) fn new(cells: usize) -> Self {
        Self {
            bins: cells * BINS_PER_STEP,
            bin: Box::new([Bin::default(); MAX_BINS]),
            torque_n_m: Box::new([0.0; MAX_BINS]),
            variance: 0.0,
            swept: 0.0,
            velocity_rad_per_s: 0.0,
        }
    }

    pub(super) fn clear(&mut self) {
        self.bin.fill(Bin::default());
        self.swept = 0.0;
    }

    /// Adds a reading in the middle of a stretch of `turned` cycles; `fraction` is the phase within the cycle, 0 to 1.
    #[inline]
    pub(super) fn add(&mut self, fraction: f64, turned: f64, torque_n_m: f64, velocity_rad_per_s: f64) {
        self.swept += turned * velocity_rad_per_s;
        let place = fraction * self.bins as f64;
        let at = (place as usize).min(self.bins - 1);
        let bin = &mut self.bin[at];
        bin.count += 1.0;
        bin.turned += turned;
        bin.torque += turned * torque_n_m;
        bin.squares += turned * torque_n_m * torque_n_m;
        let within = place - at as f64;
        for (edge, is_here) in [(&mut bin.early, within < 0.25), (&mut bin.late, within >= 0.75)] {
            if is_here {
                edge.count += 1.0;
                edge.velocity += velocity_rad_per_s;
            }
        }
    }

    /// Closes the cycle: fills the means, or says that too many readings are missing.
    pub(super) fn close(&mut self, inertia_kg_m2: f64) -> bool {
        let filled = self.bin[..self.bins].iter().filter(|bin| bin.turned > 0.0).count();
        if (filled as f64) < FILLED_SHARE * self.bins as f64 {
            return false;
        }
        let bin_rad = TAU / self.bins as f64;
        let squares = self.squared_velocity_at_edges();
        let (mut last_n_m, mut variance, mut counted) = (0.0, 0.0, 0.0);
        for at in 0..self.bins {
            let bin = &self.bin[at];
            if bin.turned <= 0.0 {
                self.torque_n_m[at] = last_n_m;
                continue;
            }
            let inertia_n_m = 0.5 * inertia_kg_m2 * (squares[at + 1] - squares[at]) / bin_rad;
            let mean_n_m = bin.torque / bin.turned;
            last_n_m = mean_n_m - inertia_n_m;
            self.torque_n_m[at] = last_n_m;
            variance += (bin.squares / bin.turned - mean_n_m * mean_n_m).max(0.0) / bin.count;
            counted += 1.0;
        }
        self.variance = variance / counted;
        let turned: f64 = self.bin[..self.bins].iter().map(|bin| bin.turned).sum();
        self.velocity_rad_per_s = self.swept / turned;
        true
    }

    /// Square of the velocity at the edge before each bin, and after the last one, rad²/s²; 0 where no edge has readings.
    fn squared_velocity_at_edges(&self) -> [f64; MAX_BINS + 1] {
        let mut squares = [0.0; MAX_BINS + 1];
        let mut last: Option<usize> = None;
        for edge in 0..=self.bins {
            let Some(velocity) = self.velocity_at(edge) else {
                continue;
            };
            let square = velocity * velocity;
            match last {
                Some(before) => {
                    let rise = (square - squares[before]) / (edge - before) as f64;
                    for between in before + 1..edge {
                        squares[between] = squares[before] + (between - before) as f64 * rise;
                    }
                }
                None => squares[..edge].fill(square),
            }
            squares[edge] = square;
            last = Some(edge);
        }
        if let Some(last) = last {
            let known = squares[last];
            squares[last + 1..].fill(known);
        }
        squares
    }

    /// Velocity at the edge before a bin.
    fn velocity_at(&self, edge: usize) -> Option<f64> {
        let before = edge.checked_sub(1).map_or(Edge::default(), |at| self.bin[at].late);
        let after = if edge < self.bins {
            self.bin[edge].early
        } else {
            Edge::default()
        };
        let count = before.count + after.count;
        (count > 0.0).then(|| (before.velocity + after.velocity) / count)
    }

    /// Mean torque of each bin of the closed cycle, N m.
    pub(super) fn torque_n_m(&self) -> &[f64] {
        &self.torque_n_m[..self.bins]
    }

    /// Mean velocity of the cam over the phase of the closed cycle, rad/s.
    pub(super) fn velocity_rad_per_s(&self) -> f64 {
        self.velocity_rad_per_s
    }

    /// Variance of such a mean by the scatter of the readings within bins, N² m².
    pub(super) fn variance(&self) -> f64 {
        self.variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inertia_is_taken_out_and_gaps_are_bridged() {
        let mut profile = Profile::new(4);
        let ticks = 2500;
        for tick in (0..ticks).filter(|tick| tick % 100 < 97) {
            let fraction = (f64::from(tick) + 0.5) / f64::from(ticks);
            let velocity = 2.5 + 0.2 * (TAU * fraction).sin();
            let acceleration = 0.2 * (TAU * fraction).cos() * velocity; // dω/dθ · ω
            profile.add(fraction, 1.0 / f64::from(ticks), 0.01 + 1e-3 * acceleration, velocity);
        }
        assert!(profile.close(1e-3));
        let off: Vec<f64> = profile
            .torque_n_m()
            .iter()
            .map(|torque| (torque - 0.01).abs())
            .collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let furthest = off.into_iter().fold(0.0, f64::max);
        // Of 0.5 mN m: most is left where a bin has its edge at a gap, or at the end of the cycle.
        assert!(mean < 2e-5 && furthest < 1.5e-4, "{mean}, {furthest}");
        let velocity = profile.velocity_rad_per_s();
        assert!((velocity / 2.5 - 1.0).abs() < 0.01, "{velocity} rad/s");
        profile.clear();
        assert!(!profile.close(1e-3));
    }

    /// Six cells in 1.1 s, of which a loop of 250 Hz sees 1.5 readings in a bin, and between them no reading at every fourth edge.
    #[test]
    fn the_inertia_is_taken_out_where_readings_are_few() {
        let mut profile = Profile::new(6);
        let ticks = 279;
        for tick in 0..ticks {
            let fraction = (f64::from(tick) + 0.5) / f64::from(ticks);
            let velocity = 5.6 + 0.15 * (6.0 * TAU * fraction).sin();
            let acceleration = 0.15 * 6.0 * (6.0 * TAU * fraction).cos() * velocity;
            profile.add(fraction, 1.0 / f64::from(ticks), 0.01 + 2e-3 * acceleration, velocity);
        }
        let edges = 0..=profile.bins;
        let without = edges.filter(|edge| profile.velocity_at(*edge).is_none()).count();
        assert!(without > 40, "{without} edges without readings");
        assert!(profile.close(2e-3));
        let squares = |torque_n_m: &[f64]| torque_n_m.iter().map(|torque| (torque - 0.01).powi(2)).sum::<f64>();
        let rms_n_m = (squares(profile.torque_n_m()) / profile.bins as f64).sqrt();
        // Of 7.1 mN m: readings lie beside the edges that they stand for. Without what is put between them 5.3 would be left.
        assert!((rms_n_m - 2.04e-3).abs() < 0.1e-3, "{rms_n_m}");
    }
}
