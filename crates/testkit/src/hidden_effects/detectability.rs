//! How clearly a hidden effect shows: what it changes in the positions, in standard deviations of what hides it.
//!
//! The difference between the noise-free runs with the effect and without it is compared with everything by which it could be
//! explained away: camera noise, friction that scatters from cycle to cycle, the places of the cells, and the recalibration of
//! friction, stiffness, stroke, slope and clock within priors. What recalibration does to the positions is taken from a
//! quasi-static worm, a spring in series with a slider for each cell. With f(x) what all that does to the positions, x in units of
//! the priors, and r the difference, both in standard deviations of the noise, the significance is the square root of the least
//! |r - f(x)|² + |x|²: for a linear f the generalised distance after Mahalanobis. `crates/testkit/mujoco/detectability.py` computes
//! the same for the worm in MuJoCo.

use super::parameters::WormParameters;
use super::scene::MotionCapture;
use crate::nominal::GRAVITY_M_S2;
use nalgebra::{DMatrix, DVector};

/// Bins in each step of a cell.
const BINS: usize = 12;
/// Standard deviations of what is not known of a clean worm, of all cells together and of each: friction, stiffness, stroke.
const PRIORS: [[f64; 2]; 3] = [[0.08, 0.02], [0.05, 0.02], [0.01, 0.003]];
const SLOPE_DEG: f64 = 0.3;
const CLOCK_S: f64 = 2e-3;
const PLACE_M: f64 = 0.01;
/// Change for the derivatives, in standard deviations of the priors.
const SMALL: f64 = 0.05;
/// Halvings of the interval in which the body's shift is looked for, and its half width, m.
const HALVINGS: usize = 40;
const MAX_SHIFT_M: f64 = 0.02;

/// One run as it is compared.
#[derive(Debug, Clone, Copy)]
pub struct ComparedRun {
    pub slope_deg: f64,
    /// Whole cycles.
    pub cycles: usize,
    pub cycle_s: f64,
}

impl ComparedRun {
    /// The phases at which it is compared, cycles since its first whole cycle.
    pub fn phases(&self, cells: usize) -> impl Iterator<Item = f64> {
        let per_cycle = cells * BINS;
        (0..self.cycles * per_cycle).map(move |bin| (bin as f64 + 0.5) / per_cycle as f64)
    }
}

/// Positions of a quasi-static worm at the middle of every bin, less those at its first whole cycle: `[bin][cell]`.
fn quasi_static(parameters: &WormParameters, factors: [&[f64]; 3], slope_deg: f64, cycles: usize) -> Vec<Vec<f64>> {
    let cells = parameters.cells;
    let [friction, stiffness, stroke] = factors;
    let k: Vec<f64> = (0..cells)
        .map(|cell| parameters.stiffness_n_per_m[cell] * stiffness[cell])
        .collect();
    let bound_m: Vec<f64> = (0..cells)
        .map(|cell| parameters.friction_n[cell] * friction[cell] / k[cell])
        .collect();
    let weight_n = parameters.mass_kg * GRAVITY_M_S2 * slope_deg.to_radians().sin();
    let mut deformation_m = vec![-weight_n / k.iter().sum::<f64>(); cells];
    let mut position_m = vec![0.0; cells];
    // Every second row is the middle of a bin; those between are the bins' ends, and with them the steps'.
    let per_step = 2 * BINS;
    let mut out = Vec::with_capacity(cycles * cells * BINS);
    let mut begun_m = vec![0.0; cells];
    // One cycle more, in which the crawl becomes periodic.
    for row in 1..=(cycles + 1) * cells * per_step {
        let stepping = parameters.step_order[(row - 1) / per_step % cells];
        let mut trial_m = deformation_m.clone();
        let step_m = parameters.stroke_m * stroke[stepping] / per_step as f64;
        trial_m[stepping] += step_m;
        let force_n = |shift_m: f64| -> f64 {
            let each = (0..cells).map(|cell| k[cell] * (trial_m[cell] + shift_m).clamp(-bound_m[cell], bound_m[cell]));
            each.sum::<f64>() + weight_n
        };
        let (mut low_m, mut high_m) = (-MAX_SHIFT_M, MAX_SHIFT_M);
        for _ in 0..HALVINGS {
            let middle_m = 0.5 * (low_m + high_m);
            if force_n(middle_m) > 0.0 {
                high_m = middle_m;
            } else {
                low_m = middle_m;
            }
        }
        let shift_m = 0.5 * (low_m + high_m);
        for cell in 0..cells {
            deformation_m[cell] = (trial_m[cell] + shift_m).clamp(-bound_m[cell], bound_m[cell]);
            position_m[cell] += shift_m + if cell == stepping { step_m } else { 0.0 };
        }
        let counted = row as isize - (cells * per_step) as isize;
        if counted == 0 {
            begun_m.clone_from(&position_m);
        } else if counted > 0 && counted % 2 == 1 {
            out.push((0..cells).map(|cell| position_m[cell] - begun_m[cell]).collect());
        }
    }
    out
}

/// What hides an effect in the runs of one campaign, ready to be compared with what the effect does.
pub struct Detector {
    parameters: WormParameters,
    runs: Vec<ComparedRun>,
    /// All that could explain a difference, about the clean worm: a row for every bin and cell of every run, a column for each cause in
    /// units of its prior. Those of the recalibration come first, then the slope of each run, then what is linear.
    columns: DMatrix<f64>,
    /// Standard deviation of the camera's noise in a bin of each run, m.
    noise_m: Vec<f64>,
}

/// Steps of the recalibration at most, the fraction of what remains by which another must lower it, and halvings of a step.
const STEPS: usize = 8;
const WORTH_A_STEP: f64 = 1e-3;
const STEP_HALVINGS: i32 = 6;

impl Detector {
    /// Of one worm before one camera.
    pub fn new(parameters: &WormParameters, capture: &MotionCapture, runs: &[ComparedRun]) -> Self {
        let cells = parameters.cells;
        let of_time: usize = runs.iter().map(|run| run.cycles.saturating_sub(1) + cells).sum();
        let rows: usize = runs.iter().map(|run| run.cycles * cells * BINS * cells).sum();
        let noise_m: Vec<f64> = runs
            .iter()
            .map(|run| noise_in_bin_m(capture, run.cycle_s / (cells * BINS) as f64))
            .collect();
        let shared = shared(cells);
        let mut detector = Self {
            parameters: parameters.clone(),
            runs: runs.to_vec(),
            columns: DMatrix::zeros(rows, shared + runs.len() + 1 + of_time),
            noise_m,
        };
        let neutral = vec![0.0; shared + runs.len()];
        let mut columns = std::mem::take(&mut detector.columns);
        detector.recalibrated_columns(&neutral, &mut columns);
        let (clock, mut column) = (shared + runs.len(), shared + runs.len() + 1);
        let mut first = 0;
        for (number, run) in runs.iter().enumerate() {
            let clean = detector.positions_m(&neutral, number);
            let noise_m = detector.noise_m[number];
            let mut put = |column: usize, of: &dyn Fn(usize, usize) -> f64| {
                for bin in 0..clean.len() {
                    for cell in 0..cells {
                        columns[(first + bin * cells + cell, column)] = of(bin, cell) / noise_m;
                    }
                }
            };
            let bin_s = run.cycle_s / (cells * BINS) as f64;
            put(clock, &|bin, cell| {
                let (before, after) = (bin.saturating_sub(1), (bin + 1).min(clean.len() - 1));
                CLOCK_S * (clean[after][cell] - clean[before][cell]) / ((after - before) as f64 * bin_s)
            });
            // An advance of its own in each cycle, from the scatter of the friction.
            let scatter_m = parameters.scatter * detector.advance_by_friction_m(number);
            for cycle in 1..run.cycles {
                let begun = |bin: usize| bin >= cycle * cells * BINS;
                put(column, &|bin, _| if begun(bin) { scatter_m } else { 0.0 });
                column += 1;
            }
            for place in 0..cells {
                put(column, &|_, cell| if cell == place { PLACE_M } else { 0.0 });
                column += 1;
            }
            first += clean.len() * cells;
        }
        detector.columns = columns;
        detector
    }

    /// Positions of a run of the quasi-static worm, recalibrated by so many standard deviations of each prior, as [`quasi_static`].
    fn positions_m(&self, recalibration: &[f64], run: usize) -> Vec<Vec<f64>> {
        let cells = self.parameters.cells;
        let factors: Vec<Vec<f64>> = PRIORS
            .iter()
            .enumerate()
            .map(|(what, [of_all, of_each])| {
                let own = &recalibration[what * (cells + 1)..];
                let all = of_all * own[0];
                own[1..=cells].iter().map(|one| (all + of_each * one).exp()).collect()
            })
            .collect();
        let slope_deg = self.runs[run].slope_deg + SLOPE_DEG * recalibration[shared(cells) + run];
        let factors = [&factors[0][..], &factors[1], &factors[2]];
        quasi_static(&self.parameters, factors, slope_deg, self.runs[run].cycles)
    }

    /// Fills the columns of the recalibration about some values.
    fn recalibrated_columns(&self, about: &[f64], columns: &mut DMatrix<f64>) {
        let cells = self.parameters.cells;
        let mut first = 0;
        for (run, noise_m) in self.noise_m.iter().enumerate() {
            let here = self.positions_m(about, run);
            for column in (0..shared(cells)).chain([shared(cells) + run]) {
                let mut changed = about.to_vec();
                changed[column] += SMALL;
                let moved = self.positions_m(&changed, run);
                for (bin, (moved, here)) in moved.iter().zip(&here).enumerate() {
                    for (cell, (moved_m, here_m)) in moved.iter().zip(here).enumerate() {
                        columns[(first + bin * cells + cell, column)] = (moved_m - here_m) / SMALL / noise_m;
                    }
                }
            }
            first += here.len() * cells;
        }
    }

    /// Standard deviation of a run's advance where the friction of every tip has its own factor, per relative deviation, m.
    fn advance_by_friction_m(&self, run: usize) -> f64 {
        let cells = self.parameters.cells;
        let neutral = vec![0.0; shared(cells) + self.runs.len()];
        let body_m = |positions_m: &[Vec<f64>]| {
            let last = positions_m.last().map_or(0.0, |cells| cells.iter().sum());
            last / cells as f64
        };
        let clean_m = body_m(&self.positions_m(&neutral, run));
        let of_cell = |cell: usize| {
            let mut changed = neutral.clone();
            changed[1 + cell] += SMALL;
            let change_m = body_m(&self.positions_m(&changed, run)) - clean_m;
            change_m / (SMALL * PRIORS[0][1]) / self.runs[run].cycles as f64
        };
        (0..cells).map(|cell| of_cell(cell).powi(2)).sum::<f64>().sqrt()
    }

    /// What the quasi-static worm does when it is recalibrated, in standard deviations of the camera's noise.
    fn by_recalibration(&self, recalibration: &[f64]) -> DVector<f64> {
        let neutral = vec![0.0; recalibration.len()];
        let of_run = |(run, noise_m): (usize, &f64)| -> Vec<f64> {
            let (moved, clean) = (self.positions_m(recalibration, run), self.positions_m(&neutral, run));
            let pairs = moved.into_iter().flatten().zip(clean.into_iter().flatten());
            pairs.map(|(moved_m, clean_m)| (moved_m - clean_m) / noise_m).collect()
        };
        DVector::from_vec(self.noise_m.iter().enumerate().flat_map(of_run).collect())
    }

    /// A difference in standard deviations of the camera's noise, in the order of the rows.
    fn whitened(&self, differences_m: &[Vec<Vec<f64>>]) -> DVector<f64> {
        let runs = differences_m.iter().zip(&self.noise_m);
        let each = runs.flat_map(|(run, noise_m)| run.iter().flatten().map(move |m| m / noise_m));
        DVector::from_vec(each.collect())
    }

    /// What the best recalibration leaves of a difference, and the square of that with what its priors cost, by damped Gauss-Newton steps:
    /// a change of a few priors is no straight line.
    fn recalibrate(&self, difference: &DVector<f64>) -> (DVector<f64>, f64) {
        let bent = shared(self.parameters.cells) + self.runs.len();
        let mut columns = self.columns.clone();
        let mut at = DVector::zeros(columns.ncols());
        let straight = self.columns.columns(bent, columns.ncols() - bent);
        let remains = |at: &DVector<f64>| {
            let recalibrated = self.by_recalibration(&at.as_slice()[..bent]);
            difference - recalibrated - straight * at.rows(bent, at.len() - bent)
        };
        let mut remaining = difference.clone();
        let mut square = remaining.norm_squared();
        for step in 0..STEPS {
            if step > 0 {
                self.recalibrated_columns(&at.as_slice()[..bent], &mut columns);
            }
            let normal = columns.tr_mul(&columns) + DMatrix::identity(columns.ncols(), columns.ncols());
            let Some(factor) = nalgebra::Cholesky::new(normal) else {
                break;
            };
            let whole = factor.solve(&(columns.tr_mul(&remaining) - &at));
            let tried = (0..STEP_HALVINGS).find_map(|halved| {
                let next = &at + &whole * 0.5_f64.powi(halved);
                let remaining = remains(&next);
                let here = remaining.norm_squared() + next.norm_squared();
                (here < square).then_some((next, remaining, here))
            });
            let Some((next, left, here)) = tried else {
                break;
            };
            let gain = square - here;
            (at, remaining, square) = (next, left, here);
            if gain < WORTH_A_STEP * square {
                break;
            }
        }
        (remaining, square)
    }

    /// Root mean square of what recalibration leaves of a difference, of each run `[bin][cell]`, both in m.
    pub fn remaining_m(&self, differences_m: &[Vec<Vec<f64>>]) -> f64 {
        let (remaining, _) = self.recalibrate(&self.whitened(differences_m));
        let noise_m = differences_m.iter().zip(&self.noise_m).flat_map(|(run, &noise_m)| {
            let values = run.iter().map(Vec::len).sum();
            std::iter::repeat_n(noise_m, values)
        });
        let squares = remaining
            .iter()
            .zip(noise_m)
            .map(|(value, noise_m)| (value * noise_m).powi(2));
        (squares.sum::<f64>() / remaining.len().max(1) as f64).sqrt()
    }

    /// Standard deviations of a difference, of each run `[bin][cell]` in m, that nothing else explains.
    pub fn sigma(&self, differences_m: &[Vec<Vec<f64>>]) -> f64 {
        self.recalibrate(&self.whitened(differences_m)).1.max(0.0).sqrt()
    }
}

/// Quantities of the recalibration that all runs share.
fn shared(cells: usize) -> usize {
    PRIORS.len() * (cells + 1)
}

/// Standard deviation of the mean position of a bin, m; the correlated part by its density at low frequencies.
fn noise_in_bin_m(capture: &MotionCapture, bin_s: f64) -> f64 {
    let samples = (capture.camera.rate_hz * bin_s).max(1.0);
    let white = capture.camera.noise_m.powi(2) / samples;
    (white + capture.drift_m.powi(2) * 2.0 * capture.drift_s / bin_s).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUN: ComparedRun = ComparedRun {
        slope_deg: 30.0,
        cycles: 4,
        cycle_s: 2.5,
    };

    /// Figures of an independent simulation of the paper's worm.
    #[test]
    fn the_quasi_static_worm_advances_as_the_paper_says() {
        let worm = WormParameters::nominal();
        for (slope_deg, advance_mm) in [(0.0, 6.833), (30.0, 4.611), (45.0, 2.072)] {
            let ones = [1.0; 4];
            let positions_m = quasi_static(&worm, [&ones; 3], slope_deg, 4);
            let cycle = 4 * BINS;
            let found_mm = 1e3 * (positions_m[3 * cycle][0] - positions_m[2 * cycle][0]);
            // A cell that slides both ways within one bin is resolved to a bin only.
            assert!(
                (found_mm - advance_mm).abs() < 0.03,
                "{found_mm} mm at {slope_deg} degrees"
            );
        }
    }

    #[test]
    fn what_recalibration_explains_does_not_show() {
        let worm = WormParameters::nominal();
        let detector = Detector::new(&worm, &MotionCapture::usual(), &[RUN]);
        let ones = [1.0; 4];
        let clean = quasi_static(&worm, [&ones; 3], RUN.slope_deg, RUN.cycles);
        let sigma = |friction: [f64; 4]| {
            let changed = quasi_static(&worm, [&friction, &ones, &ones], RUN.slope_deg, RUN.cycles);
            let difference = changed.iter().zip(&clean).map(|(one, other)| {
                let each = one.iter().zip(other).map(|(one, other)| one - other);
                each.collect()
            });
            detector.sigma(&[difference.collect()])
        };
        assert_eq!(sigma([1.0; 4]), 0.0);
        let (everywhere, in_one_cell) = (sigma([1.25; 4]), sigma([1.0, 1.2, 1.0, 1.0]));
        // ln 1.25 is 2.8 standard deviations of its prior, however far the positions move.
        assert!(
            everywhere < 2.8,
            "a common change of friction is recalibrated: {everywhere}"
        );
        // With all cells by c and each by its own, priors alone leave the least of (ln 1.2 - c)²/0.02² + 3 c²/0.02² + c²/0.08².
        let (own, all) = (0.02_f64.powi(-2), 0.08_f64.powi(-2));
        let common = own * 1.2_f64.ln() / (4.0 * own + all);
        let priors = own * (1.2_f64.ln() - common).powi(2) + (3.0 * own + all) * common * common;
        assert!(
            in_one_cell > 0.9 * priors.sqrt() && in_one_cell < priors.sqrt(),
            "one cell's own friction costs what its prior says: {in_one_cell} of {}",
            priors.sqrt()
        );
    }
}
