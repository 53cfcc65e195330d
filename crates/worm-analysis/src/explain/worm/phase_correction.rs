//! Corrects a phase that was identified as if one cell stepped at a time, where two do for part of each step.
//!
//! With the displacement of the body free, the phase that fits best is the one in which the cell in the middle of its step is right.
//! With overlap o and n cells, the phase found while the cam is in step k + t is k + x, piecewise linear with
//!
//! | t | −o/2 | 0 | 1 − o | 1 − o/2 |
//! |---|---|---|---|---|
//! | x | d n/(n − 1) | 2 d | 1 − 2 d | 1 − d n/(n − 1) |
//!
//! and d = o / (2 (1 + o)), the distance of two cells from their ends when one takes over from the other.

/// The correction for one overlap.
#[derive(Debug)]
pub(in crate::explain) struct PhaseCorrection {
    cells: f64,
    /// Phase found and phase of the cam, both in steps since the start of the step.
    knots: [(f64, f64); 4],
}

impl PhaseCorrection {
    /// `overlap` as [`Laws::overlap`](worm_physics::physics::Laws::overlap).
    pub fn new(overlap: f64, cells: usize) -> Self {
        let cells = cells as f64;
        let off = 0.5 * overlap / (1.0 + overlap);
        let shared = off * cells / (cells - 1.0);
        Self {
            cells,
            knots: [
                (shared, -0.5 * overlap),
                (2.0 * off, 0.0),
                (1.0 - 2.0 * off, 1.0 - overlap),
                (1.0 - shared, 1.0 - 0.5 * overlap),
            ],
        }
    }

    /// The cam's phase where this one was found, cycles.
    pub fn corrected(&self, phase: f64) -> f64 {
        let steps = phase * self.cells;
        let step = steps.floor();
        let [first, .., last] = self.knots;
        let read = (steps - step).clamp(first.0, last.0);
        let segment = self.knots.windows(2).find(|pair| read <= pair[1].0);
        let within = segment.map_or(last.1, |pair| {
            let fraction = (read - pair[0].0) / (pair[1].0 - pair[0].0);
            pair[0].1 + fraction * (pair[1].1 - pair[0].1)
        });
        (step + within) / self.cells
    }
}

#[cfg(test)]
mod tests {
    use super::PhaseCorrection;

    const CELLS: usize = 4;
    const FINE: i32 = 2000;

    /// How many steps each cell has made at a cam phase, in steps, where step k lasts from k − o to k + 1.
    fn made(steps: f64, overlap: f64) -> [f64; CELLS] {
        std::array::from_fn(|cell| {
            let begun = steps - cell as f64 + overlap;
            let turns = (begun / CELLS as f64).floor();
            turns + ((begun - turns * CELLS as f64) / (1.0 + overlap)).min(1.0)
        })
    }

    /// The phase, in steps, at which cells that step one at a time come nearest to these, wherever the body is: by trying all that
    /// are less than a step from the cam's.
    fn read(cam_steps: f64, overlap: f64) -> f64 {
        let seen = made(cam_steps, overlap);
        let chi_squared = |steps: f64| {
            let alone = made(steps, 0.0);
            let off: [f64; CELLS] = std::array::from_fn(|cell| seen[cell] - alone[cell]);
            let mean = off.iter().sum::<f64>() / CELLS as f64;
            off.iter().map(|off| (off - mean).powi(2)).sum::<f64>()
        };
        let tried = (-FINE..FINE).map(|place| cam_steps + f64::from(place) / f64::from(FINE));
        tried
            .min_by(|a, b| chi_squared(*a).total_cmp(&chi_squared(*b)))
            .unwrap_or(f64::NAN)
    }

    #[test]
    fn the_cam_is_where_the_cells_say_by_brute_force() {
        for overlap in [0.03, 0.15, 0.4] {
            let phase_correction = PhaseCorrection::new(overlap, CELLS);
            // A whole turn, away from where the reading leaps from one step to the next.
            for place in 0..40 {
                let steps = CELLS as f64 + 0.05 + 0.1 * f64::from(place);
                let since_leap = (steps + 0.5 * overlap).rem_euclid(1.0);
                if !(0.01..0.99).contains(&since_leap) {
                    continue;
                }
                let phase = read(steps, overlap) / CELLS as f64;
                let corrected = phase_correction.corrected(phase) * CELLS as f64;
                assert!(
                    (corrected - steps).abs() < 3.0 / f64::from(FINE),
                    "overlap {overlap}, cam at {steps} steps: {corrected}"
                );
            }
        }
    }
}
