//! What the cam makes of its phase: how far each cell stands ahead in the body.

use super::CELLS;
use super::deviations::Deviations;
use super::parameters::WormParameters;
use super::unmodelled::UnmodelledEffect;
use std::f64::consts::TAU;

/// The cam with everything that may be wrong with it.
#[derive(Debug, Clone)]
pub struct CamProfile {
    stroke_m: [f64; CELLS],
    /// Place of each cell in the step order, from 0.
    slot: [f64; CELLS],
    rounding: f64,
    play_m: f64,
    overlap: f64,
    /// Height of each cell's wave in the cam's profile, m.
    wave_m: [f64; CELLS],
}

impl CamProfile {
    pub fn new(parameters: &WormParameters, deviations: &Deviations, unmodelled: Option<&UnmodelledEffect>) -> Self {
        let mut slot = [0.0; CELLS];
        for (place, &cell) in parameters.step_order.iter().enumerate() {
            slot[cell] = place as f64;
        }
        let wave_m = match unmodelled {
            Some(UnmodelledEffect::ProfileError { wave_share }) => {
                wave_share.map(|fraction| fraction * parameters.stroke_m)
            }
            _ => [0.0; CELLS],
        };
        Self {
            stroke_m: deviations.stroke_factor.map(|factor| factor * parameters.stroke_m),
            slot,
            rounding: parameters.rounding,
            play_m: deviations.play_m,
            overlap: deviations.overlap,
            wave_m,
        }
    }

    /// How far each cell stands ahead of where it stood before its first step, m; `phase` in gait cycles.
    pub fn extensions_m(&self, phase: f64) -> [f64; CELLS] {
        let cells = CELLS as f64;
        std::array::from_fn(|cell| {
            let begun = phase * cells - self.slot[cell] + self.overlap;
            let turns = (begun / cells).floor();
            let done = ((begun - turns * cells) / (1.0 + self.overlap)).min(1.0);
            let displacement_m = (self.stroke_m[cell] * self.fraction(done) - self.play_m).max(0.0);
            let wave_m = if done < 1.0 && self.wave_m[cell] != 0.0 {
                self.wave_m[cell] * (TAU * done).sin()
            } else {
                0.0
            };
            turns * (self.stroke_m[cell] - self.play_m) + displacement_m + wave_m
        })
    }

    /// The cell whose step it is, from 0.
    pub fn stepping(&self, phase: f64) -> usize {
        let place = (phase * CELLS as f64).floor().rem_euclid(CELLS as f64);
        let found = self.slot.iter().position(|&slot| slot == place);
        found.unwrap_or(0)
    }

    /// Share of its way that a cell has done at a share of its step: even acceleration, speed and braking.
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
