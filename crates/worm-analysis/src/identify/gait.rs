//! What the cells do relative to one another, and what is left: the way of the body.
//!
//! The cam fixes the relative positions of the cells by the gait phase alone, whatever the contacts do. So the position of
//! cell i is cᵢ + Ls gᵢ(p) + b, with cᵢ its place in the body, Ls the stroke, gᵢ(p) how many steps it has made at phase p,
//! parts included, and b the way of the body, common to all. n cells give n equations a sample for two unknowns, p and b. Where
//! no phase was recorded, it is found here; b is what the contacts are responsible for, and all that
//! [`fit`](super::fit) looks at.

mod follow;
mod kinematics;
mod recorded;

use super::clean::{leave_out_outliers, noise_by_differences, usable_range};
use super::gait_error::GaitError;
use super::steps::{self, Step};

/// Times that kinematics and phase are found from one another.
const ROUNDS: usize = 4;
/// What two cells may stand off an even motor, likewise.
const EVEN: (f64, f64) = (5.0, 0.03);
/// Least number of whole cycles.
const MIN_CYCLES: f64 = 2.0;
/// Least number of samples that could show two cycles of two cells.
const MIN_SAMPLES: usize = 10;

/// The gait of a worm in a recording.
#[derive(Debug, Clone)]
pub struct IdentifiedGait {
    /// The cells in the order in which they step, from 0.
    pub step_order: Vec<usize>,
    /// Gait phase at each sample, cycles, never decreasing; `step_order[0]` begins its step at whole numbers.
    pub phase: Vec<f64>,
    /// Standard error of one sample's phase, cycles; 0 where it was recorded.
    pub phase_sigma: f64,
    /// The stroke Ls, m.
    pub stroke_m: f64,
    /// Place cᵢ of each cell in the body, m; they sum to 0.
    pub place_m: Vec<f64>,
    /// Standard deviation of one measured position, m.
    pub noise_m: f64,
    /// Way of the body b at each sample, m; `NaN` where no cell was seen.
    pub body_m: Vec<f64>,
    /// How many cells it rests on in each sample: those seen, no outliers, and standing still in the body.
    pub seen: Vec<usize>,
    /// Positions left out as outliers.
    pub outliers: usize,
}

/// How many steps the cell in place `place` of the order has made at a phase, parts included.
pub(crate) fn steps_made(cells: usize, place: usize, phase: f64) -> f64 {
    let cycle = phase.floor();
    cycle + ((phase - cycle) * cells as f64 - place as f64).clamp(0.0, 1.0)
}

/// What is known of the gait before the positions are looked at.
#[derive(Debug, Clone, Copy)]
pub struct Prior<'a> {
    /// The configured step order, from 0: where the cells follow one another in the same cyclic order, it says which is first.
    pub step_order: &'a [usize],
    /// The recorded phase.
    pub phase: Option<&'a [f64]>,
}

/// Finds the gait. `measured_m` has `NaN` where a cell was not seen, `filled_m` only before the first and after the last time
/// that it was seen.
///
/// # Errors
/// [`GaitError`] when there is none.
pub fn find(
    time_s: &[f64],
    measured_m: &[Vec<f64>],
    filled_m: &[Vec<f64>],
    prior: Prior<'_>,
) -> Result<IdentifiedGait, GaitError> {
    if time_s.len() < MIN_SAMPLES {
        return Err(GaitError::TooFewSteps { cycles: 0.0 });
    }
    if let Some(cell) = filled_m
        .iter()
        .position(|series| series.iter().all(|at_m| at_m.is_nan()))
    {
        return Err(GaitError::NoStep { cell, swing_m: 0.0 });
    }
    let noise_m = noise_by_differences(measured_m);
    let usable = usable_range(filled_m);
    let inner: Vec<Vec<f64>> = filled_m.iter().map(|series| series[usable.clone()].to_vec()).collect();
    let mut finder = Finder::new(time_s, measured_m, filled_m, noise_m);
    match prior.phase {
        Some(phase) => finder.take_phase(phase)?,
        None => {
            let (steps, order) = steps::find(&inner, &time_s[usable.clone()], noise_m)?;
            finder.begin(&steps, order, usable.start, prior.step_order);
        }
    }
    for _ in 0..ROUNDS {
        finder.fit_kinematics();
        // The one distance of two cells fits any phase as well as the next.
        if prior.phase.is_none() && finder.cells() > 2 {
            finder.follow_phase();
        }
    }
    finder.fit_kinematics();
    let off_m = finder.rest_m();
    if prior.phase.is_some() {
        finder.check_phase(off_m, noise_m)?;
    } else if finder.cells() == 2 && off_m > EVEN.0 * noise_m + EVEN.1 * finder.stroke_m {
        return Err(GaitError::Uneven { off_m });
    }
    let cycles = finder.phase[time_s.len() - 1] - finder.phase[0];
    if cycles.is_nan() || cycles < MIN_CYCLES {
        return Err(GaitError::TooFewSteps { cycles });
    }
    Ok(finder.finish())
}

struct Finder<'a> {
    time_s: &'a [f64],
    seen_m: Vec<Vec<f64>>, // [cell][sample], NaN where not seen or an outlier
    outliers: usize,
    order: Vec<usize>,
    place_of: Vec<usize>, // each cell's place in the order
    phase: Vec<f64>,
    phase_sigma: f64,
    place_m: Vec<f64>,
    stroke_m: f64,
    noise_m: f64,
}

impl<'a> Finder<'a> {
    fn new(time_s: &'a [f64], measured_m: &[Vec<f64>], filled_m: &[Vec<f64>], noise_m: f64) -> Self {
        let mut seen_m = measured_m.to_vec();
        let mut outliers = 0;
        for (series, filled) in seen_m.iter_mut().zip(filled_m) {
            outliers += leave_out_outliers(series, filled, noise_m);
        }
        Self {
            time_s,
            outliers,
            order: (0..seen_m.len()).collect(),
            place_of: Vec::new(),
            phase: Vec::new(),
            phase_sigma: 0.0,
            place_m: vec![0.0; seen_m.len()],
            stroke_m: f64::NAN,
            noise_m,
            seen_m,
        }
    }

    fn cells(&self) -> usize {
        self.seen_m.len()
    }

    fn set_order(&mut self, order: Vec<usize>) {
        self.place_of = (0..order.len())
            .map(|cell| order.iter().position(|&other| other == cell).unwrap_or(0))
            .collect();
        self.order = order;
    }

    /// A first phase by the steps that were found; straight lines between their ends.
    fn begin(&mut self, steps: &[Step], cyclic: Vec<usize>, offset: usize, configured: &[usize]) {
        let cells = self.cells();
        let first = first_of_order(&cyclic, configured, steps);
        // The slot of the first step of `first`, so that its steps begin at whole cycles.
        let lead = cyclic.iter().position(|&cell| cell == first).unwrap_or(0);
        let shift = (cells - lead) % cells;
        let mut order = cyclic;
        order.rotate_left(lead);
        self.set_order(order);
        let mut knots: Vec<(f64, f64)> = Vec::with_capacity(2 * steps.len());
        for step in steps {
            let (from, to) = (step.samples.start + offset, step.samples.end + offset);
            let slot = (step.slot + shift) as f64;
            let at_start = from == offset && step.fraction < 1.0;
            let (low, high) = if at_start {
                (1.0 - step.fraction, 1.0)
            } else {
                (0.0, step.fraction)
            };
            knots.push((self.time_s[from], (slot + low) / cells as f64));
            knots.push((self.time_s[to], (slot + high) / cells as f64));
        }
        // Where a step ends after the next begins, they meet half-way.
        for at in (1..knots.len().saturating_sub(1)).step_by(2) {
            if knots[at].0 > knots[at + 1].0 {
                let middle = 0.5 * (knots[at].0 + knots[at + 1].0);
                (knots[at].0, knots[at + 1].0) = (middle, middle);
            }
        }
        self.phase = self.time_s.iter().map(|&time_s| interpolate(&knots, time_s)).collect();
    }

    fn steps_made(&self, cell: usize, phase: f64) -> f64 {
        steps_made(self.cells(), self.place_of[cell], phase)
    }

    fn finish(self) -> IdentifiedGait {
        let cells = self.cells();
        let samples = self.phase.len();
        let (mut body_m, mut seen) = (vec![f64::NAN; samples], vec![0; samples]);
        let mut rows = Vec::with_capacity(cells);
        for sample in 0..samples {
            self.resting(sample, &mut rows);
            if !rows.is_empty() {
                let ways = rows
                    .iter()
                    .map(|&(cell, at_m, made)| at_m - self.place_m[cell] - self.stroke_m * made);
                (body_m[sample], seen[sample]) = (ways.sum::<f64>() / rows.len() as f64, rows.len());
            }
        }
        IdentifiedGait {
            step_order: self.order,
            phase: self.phase,
            phase_sigma: self.phase_sigma,
            stroke_m: self.stroke_m,
            place_m: self.place_m,
            noise_m: self.noise_m,
            body_m,
            seen,
            outliers: self.outliers,
        }
    }
}

/// Which cell of a cyclic order is first: the configured one where the cells follow one another as configured, else the one
/// whose whole step the recording shows first.
fn first_of_order(cyclic: &[usize], configured: &[usize], steps: &[Step]) -> usize {
    let Some(&leader) = configured.first() else {
        return cyclic[0];
    };
    let mut rotated = cyclic.to_vec();
    rotated.rotate_left(cyclic.iter().position(|&cell| cell == leader).unwrap_or(0));
    if rotated == configured {
        return leader;
    }
    steps
        .iter()
        .find(|step| step.fraction >= 1.0)
        .map_or(cyclic[0], |step| step.cell)
}

/// The straight line through the knots on either side; beyond the ends the value there.
fn interpolate(knots: &[(f64, f64)], at: f64) -> f64 {
    let after = knots.partition_point(|knot| knot.0 <= at);
    match (after.checked_sub(1).map(|before| knots[before]), knots.get(after)) {
        (Some(low), Some(high)) => low.1 + (at - low.0) / (high.0 - low.0) * (high.1 - low.1),
        (Some(low), None) => low.1,
        (None, Some(high)) => high.1,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests;
