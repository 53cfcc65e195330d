//! The balance of the body within one increment.

use super::{Crawl, Increment, Trial};
use crate::mechanics::Mechanics;
use crate::pad::{Hold, Loaded, Pad, PadLaw, Rate};
use crate::play::Play;
use crate::table::{Slopes, Tables, Whereabouts};
use crate::worm::SlidesDown;

/// Tolerance of the balance, as a fraction of what the tips can hold.
const BALANCE_FRACTION: f64 = 1e-7;
/// How far the body may be from where it balances, m: where nearly every tip slides, little force is much way.
const BALANCE_M: f64 = 1e-10;
/// Most iterations of an increment: bisection alone would have converged by then.
const MAX_ITERATIONS: usize = 120;
/// Displacement of the body in one increment beyond which it counts as sliding down, m.
const LOST_M: f64 = 0.5;
/// Tolerance of a cell's displacement against its drive, m.
const OWN_WAY_M: f64 = 1e-12;
/// Width at which a bracket is no longer halved, m.
const NARROW_M: f64 = 1e-16;

/// Unbalanced force of one trial of an increment.
#[derive(Clone, Copy)]
pub(super) struct Balance {
    excess_n: f64,
    slope_n_per_m: f64,
}

impl Balance {
    /// Whether what is left over is little force, and little way. Where every tip slides there is no way that it would take.
    fn is_within(&self, tolerance_n: f64) -> bool {
        let excess_n = self.excess_n.abs();
        excess_n <= tolerance_n && (excess_n <= BALANCE_M * self.slope_n_per_m || self.slope_n_per_m <= 0.0)
    }
}

impl Crawl {
    /// The translation that balances the body, m; every cell's trial is the one at it.
    pub(super) fn solve(&mut self, mechanics: &Mechanics, increment: &Increment) -> Result<f64, SlidesDown> {
        let tolerance_n = BALANCE_FRACTION * mechanics.full_force_n.max(1e-6);
        let (mut low_m, mut high_m) = (f64::NEG_INFINITY, f64::INFINITY);
        // Without mass several translations may balance: the one nearest to rest is the solution. With mass the body goes on as it moves.
        let mut at_m = if increment.inertia_n_per_m > 0.0 {
            let cells = &self.cell[..self.cells];
            let driven_m: f64 = cells.iter().map(|cell| cell.trial.driven_m).sum();
            let velocity_m_s = self.velocity_m_s + 0.5 * self.acceleration_m_s2 * increment.step_s;
            velocity_m_s * increment.step_s - driven_m / self.cells as f64
        } else {
            0.0
        };
        let mut reach_m = 1e-4;
        let mut balance = self.try_out(mechanics, increment, at_m);
        for _ in 0..MAX_ITERATIONS {
            if balance.is_within(tolerance_n) || high_m - low_m < NARROW_M {
                break;
            }
            if balance.excess_n > 0.0 {
                high_m = at_m;
            } else {
                low_m = at_m;
            }
            let newton_m = if balance.slope_n_per_m > 0.0 {
                at_m - balance.excess_n / balance.slope_n_per_m
            } else {
                f64::NAN
            };
            at_m = if newton_m > low_m && newton_m < high_m {
                newton_m
            } else if low_m.is_finite() && high_m.is_finite() {
                0.5 * (low_m + high_m)
            } else {
                reach_m *= 4.0;
                at_m - balance.excess_n.signum() * reach_m
            };
            if at_m.abs() > LOST_M {
                return Err(self.slides(mechanics));
            }
            balance = self.try_out(mechanics, increment, at_m);
        }
        Ok(at_m)
    }

    pub(super) fn slides(&self, mechanics: &Mechanics) -> SlidesDown {
        let pull_n = mechanics.pull_n + mechanics.laws.tether_n_per_m * self.travelled_m;
        let held = self.cell[..self.cells].iter().zip(&mechanics.pad);
        SlidesDown {
            pull_n,
            hold_n: held
                .map(|(cell, law)| cell.trial.friction * if pull_n >= 0.0 { law.backward_n } else { law.forward_n })
                .sum(),
        }
    }

    /// Evaluates a translation; afterwards every cell's trial is the one at it.
    pub(super) fn try_out(&mut self, mechanics: &Mechanics, increment: &Increment, translation_m: f64) -> Balance {
        let laws = &mechanics.laws;
        let drag = increment.drag_n_per_m;
        let (mut excess_n, mut slope_n_per_m) = (mechanics.pull_n, 0.0);
        // The displacement of the cells' mean, and its derivative by the translation of the body.
        let (mut mean_shift_m, mut yields) = (0.0, 0.0);
        let tables = mechanics.tables.have_force().then_some(&mechanics.tables);
        for (index, (cell, law)) in self.cell[..self.cells].iter_mut().zip(&mechanics.pad).enumerate() {
            let trial = &mut cell.trial;
            let driven_m = trial.driven_m + translation_m;
            let (shift_m, loaded, gives) = if increment.is_drive_rigid {
                let loaded = law.load(&cell.pad, driven_m, &mut trial.hold, increment.rate);
                (driven_m, loaded, 1.0)
            } else {
                let way = Way {
                    law,
                    pad: &cell.pad,
                    rate: increment.rate,
                    compliance_m_per_n: laws.compliance_m_per_n,
                    play: increment.play,
                    behind_m: cell.behind_m,
                    resting_m: cell.behind_m + trial.driven_m,
                    standing_n: mechanics.standing_n[index],
                };
                way.load(driven_m, &mut trial.hold)
            };
            (trial.shift_m, trial.loaded) = (shift_m, loaded);
            excess_n += loaded.force_n + drag * shift_m;
            slope_n_per_m += (loaded.tangent_n_per_m + drag) * gives;
            if let Some(tables) = tables {
                let (pushed_n, moving_slope) = push(tables, mechanics, index, &cell.pad, trial, increment);
                trial.pushed_n = pushed_n;
                excess_n += pushed_n;
                slope_n_per_m += moving_slope * gives;
            }
            mean_shift_m += shift_m;
            yields += gives;
        }
        let cells = self.cells as f64;
        mean_shift_m /= cells;
        yields /= cells;
        excess_n += laws.tether_n_per_m * (self.travelled_m + mean_shift_m);
        slope_n_per_m += laws.tether_n_per_m.max(0.0) * yields;
        if increment.inertia_n_per_m > 0.0 {
            excess_n += mechanics.mass_kg * self.acceleration_after(mean_shift_m, increment);
            slope_n_per_m += increment.inertia_n_per_m * yields;
        }
        Balance {
            excess_n,
            slope_n_per_m,
        }
    }

    /// Acceleration at the end of an increment with this displacement of the cells' mean, by Newmark's method.
    pub(super) fn acceleration_after(&self, mean_shift_m: f64, increment: &Increment) -> f64 {
        let step_s = increment.step_s;
        4.0 / (step_s * step_s) * (mean_shift_m - self.velocity_m_s * step_s) - self.acceleration_m_s2
    }
}

/// Force of tables on a cell at what is tried out, N, and its derivative by the cell's displacement, N/m. Apart from the loop over cells, so
/// that worms without tables do not pay for it.
#[cold]
#[inline(never)]
fn push(
    tables: &Tables,
    mechanics: &Mechanics,
    index: usize,
    pad: &Pad,
    trial: &Trial,
    increment: &Increment,
) -> (f64, f64) {
    let (loaded, step_s) = (&trial.loaded, increment.step_s);
    let here = Whereabouts {
        deformation_m: loaded.deformation_m,
        deformation_rate_m_s: (loaded.deformation_m - pad.deformation_m) / step_s,
        speed_m_s: trial.shift_m / step_s,
        load_n: loaded.force_n + mechanics.standing_n[index],
        recent_deformation_m: std::array::from_fn(|table| {
            let recent_m = trial.here.recent_deformation_m[table];
            (recent_m + loaded.deformation_m - pad.deformation_m) * increment.remembered[table]
        }),
        ..trial.here
    };
    let slopes = Slopes {
        deformation: (loaded.tangent_n_per_m / mechanics.pad[index].stiffness_n_per_m).clamp(0.0, 1.0),
        load_n_per_m: loaded.tangent_n_per_m,
        per_s: step_s.recip(),
        remembered: increment.remembered,
    };
    let (moving_n, moving_slope) = tables.moving_n(index, &here, &slopes);
    (trial.standing_n + moving_n, moving_slope)
}

/// A cell, between a drive that yields to it and its tip.
struct Way<'a> {
    law: &'a PadLaw,
    pad: &'a Pad,
    rate: Rate,
    compliance_m_per_n: f64,
    play: Option<Play>,
    behind_m: f64,  // in the play, at the increment's start
    resting_m: f64, // at its end if it stays where it is in the body
    standing_n: f64,
}

impl Way<'_> {
    /// The cell's displacement when its drive moves by `driven_m`, the state of its tip, and the derivative of the displacement.
    fn load(&self, driven_m: f64, hold: &mut Hold) -> (f64, Loaded, f64) {
        if self.law.presliding > 0.0 && self.law.is_linear() && self.play.is_none() {
            let compliance = self.compliance_m_per_n;
            let loaded = self.law.load_bristles(self.pad, driven_m, hold, self.rate, compliance);
            let shift_m = driven_m - compliance * (loaded.force_n - self.pad.force_n);
            return (shift_m, loaded, 1.0 / (1.0 + compliance * loaded.tangent_n_per_m));
        }
        self.load_yielding(driven_m, hold)
    }

    /// How far a contact force pushes the cell back in the drive's play in the increment, m, and the derivative of that, m/N.
    fn gives(&self, contact_n: f64) -> (f64, f64) {
        self.play.map_or((0.0, 0.0), |play| {
            let (behind_m, m_per_n) = play.behind_m(self.resting_m, contact_n + self.standing_n);
            (behind_m - self.behind_m, m_per_n)
        })
    }

    /// The cell yields by C (F − F before), and within its play: a monotone equation, solved like that of the body.
    fn load_yielding(&self, driven_m: f64, hold: &mut Hold) -> (f64, Loaded, f64) {
        let compliance = self.compliance_m_per_n;
        let (mut low_m, mut high_m) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut shift_m = driven_m / (1.0 + compliance * self.law.stiffness_n_per_m);
        let mut loaded = self.law.load(self.pad, shift_m, hold, self.rate);
        for _ in 0..MAX_ITERATIONS {
            let (gives_m, play_m_per_n) = self.gives(loaded.force_n);
            let excess_m = shift_m + compliance * (loaded.force_n - self.pad.force_n) + gives_m - driven_m;
            if excess_m.abs() <= OWN_WAY_M || high_m - low_m < NARROW_M {
                break;
            }
            if excess_m > 0.0 {
                high_m = shift_m;
            } else {
                low_m = shift_m;
            }
            let newton_m = shift_m - excess_m / (1.0 + (compliance + play_m_per_n) * loaded.tangent_n_per_m);
            let is_within = newton_m > low_m && newton_m < high_m;
            shift_m = if is_within || !(low_m.is_finite() && high_m.is_finite()) {
                newton_m
            } else {
                0.5 * (low_m + high_m)
            };
            loaded = self.law.load(self.pad, shift_m, hold, self.rate);
        }
        let yields_m_per_n = compliance + self.gives(loaded.force_n).1;
        (shift_m, loaded, 1.0 / (1.0 + yields_m_per_n * loaded.tangent_n_per_m))
    }
}
