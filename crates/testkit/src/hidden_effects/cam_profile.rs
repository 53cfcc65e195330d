//! The cam: how far each cell stands ahead in the body at a phase.

use super::MAX_CELLS;
use super::deviations::Deviations;
use super::parameters::{WormParameters, each_of};
use super::unmodelled::UnmodelledEffect;
use std::f64::consts::TAU;

/// The cam with all its deviations.
#[derive(Debug, Clone)]
pub struct CamProfile {
    cells: usize,
    stroke_m: [f64; MAX_CELLS],
    /// Place of each cell in the step order, from 0.
    slot: [f64; MAX_CELLS],
    rounding: f64,
    overlap: f64,
    /// What makes the strokes differ from cycle to cycle.
    changing: Option<UnmodelledEffect>,
    /// Height of each cell's wave in the cam's profile, m.
    wave_m: [f64; MAX_CELLS],
}

impl CamProfile {
    pub fn new(parameters: &WormParameters, deviations: &Deviations, unmodelled: Option<&UnmodelledEffect>) -> Self {
        let mut slot = [0.0; MAX_CELLS];
        for (place, &cell) in parameters.step_order.iter().enumerate() {
            slot[cell] = place as f64;
        }
        let wave_m = match unmodelled {
            Some(UnmodelledEffect::ProfileError { wave_share }) => {
                wave_share.map(|fraction| fraction * parameters.stroke_m)
            }
            _ => [0.0; MAX_CELLS],
        };
        Self {
            cells: parameters.cells,
            stroke_m: deviations.stroke_factor.map(|factor| factor * parameters.stroke_m),
            slot,
            rounding: parameters.rounding,
            overlap: deviations.overlap,
            changing: unmodelled.filter(|unmodelled| unmodelled.changes_stroke()).cloned(),
            wave_m,
        }
    }

    /// How far each cell stands ahead of where it stood before its first step, m; `phase` in gait cycles.
    pub fn extensions_m(&self, phase: f64) -> [f64; MAX_CELLS] {
        let cells = self.cells as f64;
        each_of(self.cells, |cell| {
            let begun = phase * cells - self.slot[cell] + self.overlap;
            let turns = (begun / cells).floor();
            let done = ((begun - turns * cells) / (1.0 + self.overlap)).min(1.0);
            let (factor, factors) = self.factors(cell, turns);
            let stroke_m = self.stroke_m[cell];
            let wave_m = if done < 1.0 && self.wave_m[cell] != 0.0 {
                self.wave_m[cell] * (TAU * done).sin()
            } else {
                0.0
            };
            stroke_m * (factors + factor * self.fraction(done)) + wave_m
        })
    }

    /// Factor on the stroke of a cell in a cycle, and the sum of those before.
    fn factors(&self, cell: usize, turns: f64) -> (f64, f64) {
        match &self.changing {
            // The step before the first one ended where the cell stands at the start, whatever its length was.
            Some(unmodelled) if turns >= 0.0 => {
                let before = (0..turns as usize).map(|turn| unmodelled.stroke_factor(cell, turn as f64));
                (unmodelled.stroke_factor(cell, turns), before.sum())
            }
            _ => (1.0, turns),
        }
    }

    /// The cell whose step it is, from 0.
    pub fn stepping(&self, phase: f64) -> usize {
        let cells = self.cells as f64;
        let place = (phase * cells).floor().rem_euclid(cells);
        let found = self.slot[..self.cells].iter().position(|&slot| slot == place);
        found.unwrap_or(0)
    }

    /// Fraction of its stroke that a cell has made at a fraction of its step: constant acceleration, speed and braking.
    fn fraction(&self, done: f64) -> f64 {
        let rounding = self.rounding;
        let corner = |done: f64| 0.5 * done * done / (rounding * (1.0 - rounding));
        if done < rounding {
            corner(done)
        } else if done > 1.0 - rounding {
            1.0 - corner(1.0 - done)
        } else {
            (done - 0.5 * rounding) / (1.0 - rounding)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// A cam cannot jump, so a phase that is hardly further moves every cell hardly further, whatever its strokes are.
    #[test]
    fn no_cell_jumps_where_strokes_differ_from_cycle_to_cycle() {
        let parameters = WormParameters::draw(&mut Xoshiro256PlusPlus::seed_from_u64(1));
        let alternating = UnmodelledEffect::AlternatingStroke { fraction: 0.08 };
        let wandering = UnmodelledEffect::WanderingStroke {
            fraction: 0.1,
            period_cycles: 3.3,
        };
        for changing in [alternating, wandering] {
            let cam = CamProfile::new(&parameters, &Deviations::default(), Some(&changing));
            let mut before_m = cam.extensions_m(-1.0);
            for step in 1..=5000 {
                let here_m = cam.extensions_m(-1.0 + f64::from(step) * 1e-3);
                for (before_m, here_m) in before_m.iter().zip(&here_m) {
                    // The fastest cell makes a stroke in a step: 1e-3 of a cycle is less than a fiftieth of it.
                    let moved = (here_m - before_m).abs() / parameters.stroke_m;
                    assert!(moved < 0.02, "{}: {moved} of a stroke", changing.name());
                }
                before_m = here_m;
            }
        }
    }
}
