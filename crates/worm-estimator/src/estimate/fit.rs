//! How the cells moved over a finished gait cycle: a penalised least-squares fit along the phase.
//!
//! # Unknowns
//! In a window of one or two cycles, with knots at every [`INTERVALS`]th of a step, positions are
//!
//! ```text
//! Xᵢ = b + Lᵢⱼ                                  outside the cell's own step, j times after the window's start
//! Xᵢ = b + Lᵢⱼ (1 − τ) + Lᵢⱼ₊₁ τ + g            within it, τ from 0 to 1
//! ```
//!
//! The body's translation b and the departure g of the stepping cell from a straight extension are continuous lines with a
//! corner at every knot; g is 0 at both ends of a step. The levels L are free, so every stroke Lᵢⱼ₊₁ − Lᵢⱼ is measured,
//! not assumed: a cell that jams shows as one. All cells measure b together, which takes most of the noise away.
//!
//! # Penalty
//! A corner costs its size squared over its variance, and the variances follow the corners found (iteratively reweighted:
//! few large corners rather than many small ones). At step boundaries, which the encoder tells exactly, b may turn at
//! will. Nothing says where or how much it turns: friction may be anything.
//!
//! # What is not entirely sound
//! - Cells outside their own step are taken to keep their distances. What they do otherwise ends in the residuals, which
//!   widen the standard errors.
//! - The standard errors are those of the last reweighted problem, as if its corner variances had been known.

use super::bordered_band::BorderedBandMatrix;
use super::gait::StepSequence;
use super::window::{CYCLES, INTERVALS, Window};

/// First standard deviation of a corner of b within a step, strokes.
const BODY_CORNER: f64 = 3e-3;
/// Least standard deviation of a corner of b within a step, strokes.
const BODY_CORNER_FLOOR: f64 = 2e-4;
/// The same for the standard errors: it stands for corners that were there and were not found.
const BODY_CORNER_DOUBT: f64 = 2e-3;
/// Standard deviation of a corner of b at a step boundary, strokes: its rate may change by a whole stroke per step.
const BOUNDARY_CORNER: f64 = 1.0 / INTERVALS as f64;
/// Least and first standard deviation of a corner of g, strokes.
const CELL_CORNER_FLOOR: f64 = 5e-4;
/// Standard deviation of what is to be 0, strokes.
const PINNED: f64 = 1e-7;
/// Standard deviation of a level, strokes: no opinion, but a cell never seen leaves the system solvable.
const LEVEL_SPREAD: f64 = 30.0;
/// Reweightings.
const PASSES: usize = 4;
/// Corners that a step typically has, for the degrees of freedom.
const CORNERS_PER_STEP: f64 = 4.0;

/// The fit and the memory it needs.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    cells: usize,
    stroke_m: f64,
    step_of_cell: Vec<usize>, // of the present direction
    cell_of_step: Vec<usize>,
    cycles: usize,
    origin_m: f64,
    data: BorderedBandMatrix,   // normal equations of the samples, unweighted
    system: BorderedBandMatrix, // weighted and penalised; after `run` its factor
    moments: Vec<f64>,
    solution: Vec<f64>,
    scratch: Vec<f64>,
    position_m: Vec<f64>, // [knot][cell]
    sigma_m: f64,
}

/// An unknown and its coefficients: constant and growing with t across a piece.
type Term = (usize, f64, f64);

impl Fit {
    pub(super) fn new(cells: usize, stroke_m: f64) -> Self {
        let band = 2 * (CYCLES * cells * INTERVALS + 1);
        let border = cells * (CYCLES + 1);
        let vector = vec![0.0; band + border];
        Self {
            cells,
            stroke_m,
            step_of_cell: (0..cells).collect(),
            cell_of_step: (0..cells).collect(),
            position_m: vec![0.0; (CYCLES * cells * INTERVALS + 1) * cells],
            cycles: 1,
            origin_m: 0.0,
            data: BorderedBandMatrix::with_capacity(band, border),
            system: BorderedBandMatrix::with_capacity(band, border),
            moments: vector.clone(),
            solution: vector.clone(),
            scratch: vector,
            sigma_m: f64::NAN,
        }
    }

    /// Most unknowns that a fit can have.
    pub(super) fn unknowns(&self) -> usize {
        self.solution.len()
    }

    /// Fits the window, whose steps are those of `gait`; `noise_m` is the first guess at the noise of one position.
    /// False when the samples do not determine a fit.
    pub(super) fn run(&mut self, window: &Window, gait: &StepSequence, noise_m: f64) -> bool {
        for (cell, step) in self.step_of_cell.iter_mut().enumerate() {
            *step = gait.step_of_cell(cell);
            self.cell_of_step[*step] = cell;
        }
        self.cycles = window.cycles();
        self.origin_m = window.origin_m();
        let (count, squares) = self.accumulate(window);
        let size = self.data.size();
        self.solution[..size].fill(0.0);
        self.sigma_m = noise_m;
        for pass in 0..PASSES {
            self.system.copy_from(&self.data, 1.0 / (self.sigma_m * self.sigma_m));
            self.penalise((pass > 0).then_some(BODY_CORNER_FLOOR));
            for (to, from) in self.solution[..size].iter_mut().zip(&self.moments) {
                *to = from / (self.sigma_m * self.sigma_m);
            }
            if !self.system.factor() {
                return false;
            }
            self.system.solve_lower(&mut self.solution[..size]);
            self.system.solve_upper(&mut self.solution[..size]);
            self.follow_noise(count, squares, noise_m);
        }
        self.system.copy_from(&self.data, 1.0 / (self.sigma_m * self.sigma_m));
        self.penalise(Some(BODY_CORNER_DOUBT));
        self.tabulate();
        self.system.factor() && self.solution[..size].iter().all(|value| value.is_finite())
    }

    /// Normal equations of the samples. Returns how many positions there were and the sum of their squares.
    fn accumulate(&mut self, window: &Window) -> (f64, f64) {
        let knots = self.knots();
        self.data.reset(2 * knots, self.cells * (self.cycles + 1));
        let size = self.data.size();
        self.moments[..size].fill(0.0);
        let (mut count, mut squares) = (0.0, 0.0);
        for piece in 0..knots - 1 {
            for (cell, sums) in window
                .piece(piece)
                .iter()
                .enumerate()
                .filter(|(_, sums)| sums.count > 0.0)
            {
                count += sums.count;
                squares += sums.xx;
                let (terms, used) = self.terms(cell, piece);
                for (a, &(i, i_constant, i_slope)) in terms[..used].iter().enumerate() {
                    self.moments[i] += i_constant * sums.x + i_slope * sums.tx;
                    for &(j, j_constant, j_slope) in &terms[..=a] {
                        let cross = i_constant * j_slope + i_slope * j_constant;
                        let value = i_constant * j_constant * sums.count + cross * sums.t + i_slope * j_slope * sums.tt;
                        self.data.add(i, j, value);
                    }
                }
            }
        }
        (count, squares)
    }

    /// Adds the penalty: that of the first pass, or one that follows the corners found, with this floor for those of b.
    fn penalise(&mut self, floor: Option<f64>) {
        let knots = self.knots();
        let pinned = self.weight(PINNED);
        self.system.add(0, 0, pinned);
        for knot in 0..knots {
            let boundary = knot % INTERVALS == 0;
            if boundary {
                self.system.add(2 * knot + 1, 2 * knot + 1, pinned);
            }
            if knot == 0 || knot + 1 == knots {
                continue;
            }
            let body = match floor {
                _ if boundary => self.weight(BOUNDARY_CORNER),
                None => self.weight(BODY_CORNER),
                Some(floor) => self.followed_weight(2 * knot, floor),
            };
            self.add_corner(2 * knot, body);
            if !boundary {
                let cell = match floor {
                    None => self.weight(CELL_CORNER_FLOOR),
                    Some(_) => self.followed_weight(2 * knot + 1, CELL_CORNER_FLOOR),
                };
                self.add_corner(2 * knot + 1, cell);
            }
        }
        let level = self.weight(LEVEL_SPREAD);
        for unknown in self.system.first_of_border()..self.system.size() {
            self.system.add(unknown, unknown, level);
        }
    }

    fn weight(&self, strokes: f64) -> f64 {
        1.0 / (strokes * self.stroke_m).powi(2)
    }

    /// Weight of a corner after its size in the last pass.
    fn followed_weight(&self, unknown: usize, floor_strokes: f64) -> f64 {
        let x = &self.solution;
        let corner_m = x[unknown - 2] - 2.0 * x[unknown] + x[unknown + 2];
        1.0 / ((floor_strokes * self.stroke_m).powi(2) + corner_m * corner_m)
    }

    fn add_corner(&mut self, unknown: usize, weight: f64) {
        let corner = [(unknown - 2, 1.0), (unknown, -2.0), (unknown + 2, 1.0)];
        for (a, &(i, from)) in corner.iter().enumerate() {
            for &(j, to) in &corner[..=a] {
                self.system.add(i, j, weight * from * to);
            }
        }
    }

    /// The noise of one position after the residuals, kept within a factor of ten of the first guess.
    fn follow_noise(&mut self, count: f64, squares: f64, noise_m: f64) {
        let size = self.data.size();
        let x = &self.solution[..size];
        self.data.times(x, &mut self.scratch[..size]);
        let residual: f64 = x
            .iter()
            .zip(&self.scratch)
            .zip(&self.moments)
            .map(|((x, product), moment)| x * (product - 2.0 * moment))
            .sum::<f64>()
            + squares;
        let levels = self.cells as f64 * (self.cycles as f64 + 1.0);
        let free = count - levels - CORNERS_PER_STEP * (self.cells * self.cycles) as f64;
        if free > 0.25 * count {
            self.sigma_m = (residual.max(0.0) / free).sqrt().clamp(0.1 * noise_m, 10.0 * noise_m);
        }
    }

    /// The unknowns that a cell's position depends on within a piece.
    fn terms(&self, cell: usize, piece: usize) -> ([Term; 6], usize) {
        let (body, fraction, first_level) = (2 * piece, self.fraction(cell, piece), self.level(cell, piece));
        let mut terms = [(0, 0.0, 0.0); 6];
        terms[0] = (body, 1.0, -1.0);
        terms[1] = (body + 2, 0.0, 1.0);
        let next_fraction = self.next_fraction(cell, piece);
        let mut used = 2;
        if next_fraction > fraction {
            terms[2] = (body + 1, 1.0, -1.0);
            terms[3] = (body + 3, 0.0, 1.0);
            terms[4] = (first_level, 1.0 - fraction, fraction - next_fraction);
            terms[5] = (first_level + 1, fraction, next_fraction - fraction);
            used = 6;
        } else {
            terms[used] = (first_level + usize::from(fraction == 1.0), 1.0, 0.0);
            used += 1;
        }
        (terms, used)
    }

    /// The unknowns that a cell's position at a knot depends on.
    fn terms_at(&self, cell: usize, knot: usize) -> [(usize, f64); 4] {
        let (fraction, level) = (self.fraction(cell, knot), self.level(cell, knot));
        let own = f64::from(u8::from(fraction > 0.0 && fraction < 1.0));
        [
            (2 * knot, 1.0),
            (2 * knot + 1, own),
            (level, 1.0 - fraction),
            (level + 1, fraction),
        ]
    }

    /// How much of its step in this knot's cycle the cell has done, 0 to 1.
    fn fraction(&self, cell: usize, knot: usize) -> f64 {
        let within = knot - self.cycle_of(knot) * self.pieces();
        let done = within
            .saturating_sub(self.step_of_cell[cell] * INTERVALS)
            .min(INTERVALS);
        done as f64 / INTERVALS as f64
    }

    /// The share at the knot after, still seen from this knot's cycle.
    fn next_fraction(&self, cell: usize, knot: usize) -> f64 {
        let within = knot + 1 - self.cycle_of(knot) * self.pieces();
        let done = within
            .saturating_sub(self.step_of_cell[cell] * INTERVALS)
            .min(INTERVALS);
        done as f64 / INTERVALS as f64
    }

    fn level(&self, cell: usize, knot: usize) -> usize {
        self.data.first_of_border() + cell * (self.cycles + 1) + self.cycle_of(knot)
    }

    fn cycle_of(&self, knot: usize) -> usize {
        (knot / self.pieces()).min(self.cycles - 1)
    }

    /// The configured stroke, m.
    pub(super) fn stroke_m(&self) -> f64 {
        self.stroke_m
    }

    /// Pieces of one cycle.
    pub(super) fn pieces(&self) -> usize {
        self.cells * INTERVALS
    }

    /// Knots of the whole window.
    pub(super) fn knots(&self) -> usize {
        self.cycles * self.pieces() + 1
    }

    /// The knot at which the last cycle begins.
    pub(super) fn last_cycle_from(&self) -> usize {
        (self.cycles - 1) * self.pieces()
    }

    /// The cell in whose step a piece lies.
    pub(super) fn stepping_cell(&self, piece: usize) -> usize {
        self.cell_of_step[piece / INTERVALS % self.cells]
    }

    /// Position of a cell at a knot, m, in the direction of the crawl.
    pub(super) fn position_m(&self, cell: usize, knot: usize) -> f64 {
        self.position_m[knot * self.cells + cell]
    }

    fn tabulate(&mut self) {
        for knot in 0..self.knots() {
            for cell in 0..self.cells {
                let terms = self.terms_at(cell, knot);
                let relative_m: f64 = terms
                    .iter()
                    .map(|&(unknown, fraction)| fraction * self.solution[unknown])
                    .sum();
                self.position_m[knot * self.cells + cell] = self.origin_m + relative_m;
            }
        }
    }

    /// Noise of one position after the residuals, m.
    pub(super) fn sigma_m(&self) -> f64 {
        self.sigma_m
    }

    /// A gradient of zeros.
    pub(super) fn clear_gradient(&self, gradient: &mut Vec<f64>) {
        gradient.clear();
        gradient.resize(self.data.size(), 0.0);
    }

    /// Adds to a gradient what a derivative by a cell's position at a knot comes to.
    pub(super) fn add_to_gradient(&self, gradient: &mut [f64], cell: usize, knot: usize, derivative: f64) {
        for (unknown, fraction) in self.terms_at(cell, knot) {
            gradient[unknown] += fraction * derivative;
        }
    }

    /// Adds to a gradient what a derivative by the extension in a piece comes to, the motion of the stepping cell against
    /// the others (10).
    pub(super) fn add_extension_to_gradient(&self, gradient: &mut [f64], piece: usize, derivative: f64) {
        let cell = self.stepping_cell(piece);
        let rise = 1.0 / INTERVALS as f64;
        let level = self.level(cell, piece);
        gradient[level] -= rise * derivative;
        gradient[level + 1] += rise * derivative;
        gradient[2 * piece + 1] -= derivative;
        gradient[2 * piece + 3] += derivative;
    }

    /// Extension of the stepping cell in a piece, its motion against the others (10), m.
    pub(super) fn extension_m(&self, piece: usize) -> f64 {
        let cell = self.stepping_cell(piece);
        let body_m = self.solution[2 * piece + 2] - self.solution[2 * piece];
        self.position_m(cell, piece + 1) - self.position_m(cell, piece) - body_m
    }

    /// Standard error of a quantity with this gradient; the gradient is used up.
    pub(super) fn standard_error(&self, gradient: &mut [f64]) -> f64 {
        self.system.solve_lower(gradient);
        gradient.iter().map(|value| value * value).sum::<f64>().sqrt()
    }
}
