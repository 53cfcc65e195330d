//! Where the cells are now: a Kalman filter over gait phase and time, causal, one update a tracker sample.
//!
//! # State
//! The positions X₁…Xₙ of the cells, m; the rate v at which the body gives way, m per step; the rate s at which the
//! stepping cell c extends, m per step. With u the gait phase counted in steps,
//!
//! ```text
//! dXᵢ = v du  (i ≠ c)        dX_c = (v + s) du
//! ```
//!
//! v is what the quasi-static solver would calculate; here it is measured. s is the stroke of the cell in hand, carried from
//! its last step, so a cell that lost a part of its stroke shows as a cell that lost it.
//!
//! # Noise model
//! v is a random walk in u, wide enough for the corners it has where a tip starts to slide, and forgotten at every step
//! boundary, which the encoder tells exactly. s is a slower one. All cells together walk in time, for a worm may slip while
//! its cam stands; each cell walks a little in u, for a body is not quite rigid.
//!
//! # Observation
//! Each position by itself, white noise of variance r. r is followed from the accepted innovations, within a factor
//! of ten in standard deviation around the configured one.
//!
//! # What is not entirely sound
//! - v has corners, not a random walk: behind a corner the filter lags by a few samples. The cycle report therefore does
//!   not rest on this filter but on [`fit`](super::fit), which sees both sides of every corner.
//! - A gate is not a likelihood. A position beyond it is dropped, unless most cells are off by the same amount twice
//!   running (the body moved) or one cell stays off for [`REACQUIRE_AFTER`] samples (it moved, or its first sample was an outlier).
//! - The stroke of a cell is carried to its next step without its correlations.

use super::gait::StepSequence;
use crate::config::Config;
use worm_physics::MAX_CELLS;

/// Positions, v and s.
const DIMENSION: usize = MAX_CELLS + 2;
/// Rejections in a row after which a cell's position is taken up anew.
pub(super) const REACQUIRE_AFTER: u32 = 8;
/// Standard deviation of v at the start of a step, strokes per step: anything from standing to giving way altogether.
const RATE_SPREAD: f64 = 0.5;
/// Walk of v, strokes per step per √step: a corner of a quarter stroke per step within a quarter of a step.
const RATE_WALK: f64 = 0.5;
/// Standard deviation of a stroke never seen before, strokes.
const STROKE_SPREAD: f64 = 0.1;
/// Walk of s within a step, strokes per √step.
const STROKE_WALK: f64 = 0.1;
/// Walk of each cell by itself, strokes per √step.
const CELL_WALK: f64 = 2e-3;
/// Walk of the whole body in time, m/√s: a slip of the body by a millimetre in a quarter of a second is plausible.
const BODY_WALK_M_PER_SQRT_S: f64 = 5e-4;
/// Weight of one accepted innovation in the followed noise variance.
const NOISE_GAIN: f64 = 1.0 / 400.0;
/// How far the followed variance may leave the configured one.
const NOISE_RANGE: f64 = 100.0;

/// The filter. Fixed size; phases are gait cycles times cells, so that a step is a unit.
#[derive(Debug, Clone)]
pub(super) struct BodyFilter {
    gait: StepSequence,
    stroke_m: f64,
    gate: f64, // standard deviations
    configured_variance: f64,
    variance: f64, // of one position, m²
    state: [f64; DIMENSION],
    covariance: [[f64; DIMENSION]; DIMENSION],
    known: [bool; MAX_CELLS],
    rejections: [u32; MAX_CELLS],
    strokes: [(f64, f64); MAX_CELLS], // mean and variance carried to the cell's next step
    step: i64,
    at: Option<(f64, f64)>, // phase in steps and time of the state
    sign: f64,              // of the last motion of the phase
    jump_m: Option<f64>,    // by which most cells were off in the last sample
}

impl BodyFilter {
    pub(super) fn new(config: &Config, gait: StepSequence) -> Self {
        let stroke_m = config.worm.stroke_m;
        let configured_variance = config.tracker.noise_m * config.tracker.noise_m;
        Self {
            gait,
            stroke_m,
            gate: config.estimator.outlier_sigmas,
            configured_variance,
            variance: configured_variance,
            state: [0.0; DIMENSION],
            covariance: [[0.0; DIMENSION]; DIMENSION],
            known: [false; MAX_CELLS],
            rejections: [0; MAX_CELLS],
            strokes: [(stroke_m, square(STROKE_SPREAD * stroke_m)); MAX_CELLS],
            step: 0,
            at: None,
            sign: 0.0,
            jump_m: None,
        }
    }

    /// Forgets where the cells are, not how long their strokes are.
    pub(super) fn forget(&mut self) {
        self.at = None;
        self.known = [false; MAX_CELLS];
        self.rejections = [0; MAX_CELLS];
        self.sign = 0.0;
        self.jump_m = None;
    }

    /// Phase in steps and time of the last prediction; none before the first sample.
    pub(super) fn at(&self) -> Option<(f64, f64)> {
        self.at
    }

    /// Begins at a phase with no cell seen yet.
    pub(super) fn begin(&mut self, steps: f64, time_s: f64) {
        self.at = Some((steps, time_s));
        self.covariance = [[0.0; DIMENSION]; DIMENSION];
        self.enter(steps.floor() as i64);
    }

    /// The step boundary that lies between the filter's phase and `steps`, if any.
    pub(super) fn boundary_before(&self, steps: f64) -> Option<f64> {
        let (at, _) = self.at?;
        let boundary = if steps > at {
            (self.step + 1) as f64
        } else {
            self.step as f64
        };
        ((steps > at && steps >= boundary) || (steps < at && steps < boundary)).then_some(boundary)
    }

    /// Goes over into the step beyond a boundary that [`predict`](Self::predict) has reached.
    pub(super) fn cross(&mut self, forward: bool) {
        self.enter(if forward { self.step + 1 } else { self.step - 1 });
    }

    /// Carries the state on to a phase within the present step, or on its boundary.
    pub(super) fn predict(&mut self, steps: f64, time_s: f64) {
        let Some((at, since_s)) = self.at else { return };
        let n = self.gait.cells();
        let (v, s, cell) = (n, n + 1, self.stepping_cell());
        let du = steps - at;
        if du * self.sign < 0.0 {
            self.forget_rate(); // The tips that slid now load, and the other way round.
        }
        if du != 0.0 {
            self.sign = du.signum();
        }
        for i in 0..n {
            self.state[i] += self.state[v] * du;
        }
        self.state[cell] += self.state[s] * du;
        // P ← F P Fᵀ with F = 1 + du (Σᵢ eᵢ e_vᵀ + e_c e_sᵀ): rows, then columns.
        for j in 0..n + 2 {
            let (from_v, from_s) = (self.covariance[v][j] * du, self.covariance[s][j] * du);
            for i in 0..n {
                self.covariance[i][j] += from_v;
            }
            self.covariance[cell][j] += from_s;
        }
        for row in &mut self.covariance[..n + 2] {
            let (from_v, from_s) = (row[v] * du, row[s] * du);
            for entry in &mut row[..n] {
                *entry += from_v;
            }
            row[cell] += from_s;
        }
        let walked = du.abs();
        let body = square(BODY_WALK_M_PER_SQRT_S) * (time_s - since_s).max(0.0);
        for i in 0..n {
            for entry in &mut self.covariance[i][..n] {
                *entry += body;
            }
            self.covariance[i][i] += square(CELL_WALK * self.stroke_m) * walked;
        }
        self.covariance[v][v] += square(RATE_WALK * self.stroke_m) * walked;
        self.covariance[s][s] += square(STROKE_WALK * self.stroke_m) * walked;
        self.at = Some((steps, time_s));
    }

    /// Takes up one tracker sample at the phase last predicted; `NaN` where a cell was not seen. Bit i of the answer is
    /// set when cell i's position was believed.
    pub(super) fn observe(&mut self, position_m: &[f64]) -> u32 {
        let n = self.gait.cells();
        let mut innovations = [f64::NAN; MAX_CELLS];
        for i in 0..n {
            if position_m[i].is_finite() && !self.known[i] {
                self.take_up(i, position_m[i]);
            }
            innovations[i] = position_m[i] - self.state[i];
        }
        self.follow_common_jump(&innovations[..n]);
        let mut accepted = 0;
        for (i, &position) in position_m[..n].iter().enumerate() {
            if !position.is_finite() {
                continue;
            }
            let innovation = position - self.state[i];
            let expected = self.covariance[i][i] + self.variance;
            if square(innovation) > square(self.gate) * expected {
                self.rejections[i] += 1;
                if self.rejections[i] >= REACQUIRE_AFTER {
                    self.take_up(i, position);
                }
                continue;
            }
            self.rejections[i] = 0;
            accepted |= 1 << i;
            self.update(i, innovation, expected);
        }
        accepted
    }

    fn update(&mut self, i: usize, innovation: f64, expected: f64) {
        let n = self.gait.cells();
        let excess_m2 = square(innovation) - expected;
        let range = self.configured_variance / NOISE_RANGE..=self.configured_variance * NOISE_RANGE;
        self.variance = (self.variance + NOISE_GAIN * excess_m2).clamp(*range.start(), *range.end());
        let column = self.covariance[i];
        for a in 0..n + 2 {
            let gain = column[a] / expected;
            self.state[a] += gain * innovation;
            for (entry, along) in self.covariance[a][..n + 2].iter_mut().zip(&column) {
                *entry -= gain * along;
            }
        }
    }

    /// When most cells are beyond the gate by the same amount, the body has moved: that is no outlier.
    fn follow_common_jump(&mut self, innovations: &[f64]) {
        let n = innovations.len();
        let mut sorted = [f64::INFINITY; MAX_CELLS];
        let mut seen = 0;
        for &innovation in innovations.iter().filter(|innovation| innovation.is_finite()) {
            sorted[seen] = innovation;
            seen += 1;
        }
        if seen < 2 {
            self.jump_m = None;
            return;
        }
        sorted[..seen].sort_unstable_by(f64::total_cmp);
        let median = sorted[(seen - 1) / 2];
        let tolerance = square(self.gate) * 2.0 * self.variance;
        let together = (0..n)
            .filter(|&i| {
                square(innovations[i]) > square(self.gate) * (self.covariance[i][i] + self.variance)
                    && square(innovations[i] - median) < tolerance
            })
            .count();
        // Two outliers may agree by chance; not twice running.
        let jump_m = (2 * together > seen).then_some(median);
        let before_m = std::mem::replace(&mut self.jump_m, jump_m);
        if let (Some(jump_m), Some(before_m)) = (jump_m, before_m)
            && jump_m * before_m > 0.0
        {
            for row in &mut self.covariance[..n] {
                for entry in &mut row[..n] {
                    *entry += square(median);
                }
            }
        }
    }

    /// Believes a position without regard to what was known of the cell.
    fn take_up(&mut self, cell: usize, position_m: f64) {
        let n = self.gait.cells();
        self.state[cell] = position_m;
        for j in 0..n + 2 {
            self.covariance[cell][j] = 0.0;
            self.covariance[j][cell] = 0.0;
        }
        self.covariance[cell][cell] = 4.0 * self.variance;
        self.known[cell] = true;
        self.rejections[cell] = 0;
    }

    /// Leaves the present step, keeping its stroke, and enters another.
    fn enter(&mut self, step: i64) {
        let n = self.gait.cells();
        let (s, cell) = (n + 1, self.stepping_cell());
        if self.covariance[s][s] > 0.0 {
            let spread = square(0.02 * self.stroke_m);
            self.strokes[cell] = (self.state[s], self.covariance[s][s].clamp(spread, 25.0 * spread));
        }
        self.step = step;
        let (mean, variance) = self.strokes[self.stepping_cell()];
        self.clear_row(s);
        self.state[s] = mean;
        self.covariance[s][s] = variance;
        self.forget_rate();
    }

    /// v at a step's start: what all contacts equally loaded would give, and a wide spread.
    fn forget_rate(&mut self) {
        let n = self.gait.cells();
        self.clear_row(n);
        self.state[n] = -self.stroke_m / n as f64;
        self.covariance[n][n] = square(RATE_SPREAD * self.stroke_m);
    }

    fn clear_row(&mut self, row: usize) {
        for j in 0..self.gait.cells() + 2 {
            self.covariance[row][j] = 0.0;
            self.covariance[j][row] = 0.0;
        }
    }

    /// The cell in whose step the filter is.
    pub(super) fn stepping_cell(&self) -> usize {
        self.gait.cell_of_step(self.step)
    }

    /// How far the stepping cell is ahead of the mean of the others, m.
    pub(super) fn lead_m(&self) -> f64 {
        let stepping = self.stepping_cell();
        let others = (0..self.gait.cells()).filter(|&cell| cell != stepping);
        let sum_m: f64 = others.map(|cell| self.position_m(cell)).sum();
        self.position_m(stepping) - sum_m / (self.gait.cells() - 1) as f64
    }

    /// Filtered position of a cell, m; `NaN` before it was seen.
    pub(super) fn position_m(&self, cell: usize) -> f64 {
        if self.known[cell] { self.state[cell] } else { f64::NAN }
    }

    /// Standard deviation of a filtered position, m.
    pub(super) fn sigma_m(&self, cell: usize) -> f64 {
        self.covariance[cell][cell].max(0.0).sqrt()
    }

    /// Standard deviation of one measured position as followed from the innovations, m.
    pub(super) fn noise_m(&self) -> f64 {
        self.variance.sqrt()
    }
}

fn square(value: f64) -> f64 {
    value * value
}
