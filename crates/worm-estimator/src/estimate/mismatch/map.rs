//! The residual map and the test on it.
//!
//! The test asks whether an entry exceeds a threshold, not whether it differs from 0: no model is exact, and in the long run every
//! deviation is significant. For each entry, and for the advance of the whole worm over a cycle, which adds up what is too small in every
//! bin, the excess over the threshold is divided by the standard error. With Student's distribution and a Bonferroni correction, the
//! probability that any of them exceeds it while none truly does stays below [`FALSE_FRACTION`], whatever their correlations.

use super::BINS;
use super::reference_model::{ALLOWANCES, Part, ReferenceModel};
use super::weighted_mean::{MIN_VALUES, MeanEstimate, WeightedMean};
use std::f64::consts::TAU;
use worm_physics::MAX_CELLS;

/// Probability of a false alarm over the whole family, at one test.
const FALSE_FRACTION: f64 = 0.05;
/// Identified bounds are known to so many of their standard errors: what they leave uncertain in the model's motion is no mismatch.
const MODEL_SIGMAS: f64 = 3.0;
/// The last cycles count alone when all of them together are within the threshold, and the mean is more than this many thresholds off:
/// it remembers something that is over.
const OVER_THRESHOLDS: f64 = 2.0;
/// Standard errors by which another cell than the stepping one must stand out to be named.
const STANDS_OUT_SIGMAS: f64 = 4.0;

/// Mean residual over the last cycles for each cell, step and phase bin: measured less modelled displacement.
#[derive(Debug, Clone)]
pub struct ResidualMap {
    cells: usize,
    direction: i32,
    stepping: [usize; MAX_CELLS],
    means: Vec<WeightedMean>, // [step][bin][cell]
    advance: WeightedMean,
    recent_m: [Vec<f64>; MIN_VALUES as usize], // increments of the last cycles, the oldest first
    spare: Vec<WeightedMean>, // the means of those cycles alone, while it is tried whether they count alone
    model_sigma_m: Vec<f64>,  // standard error of the model's increments, where its bounds were identified
    model_advance_sigma_m: f64,
    by_bound: Vec<[f64; MAX_CELLS]>, // what each metre of a bound adds to each entry, m/m
    threshold_m: f64,
    effects_m: [Vec<f64>; ALLOWANCES.len()], // for allowed deviations of 100 %
    allowed_m: Vec<f64>,                     // their best fit
    allowed_advance_m: f64,
    pooled: f64, // variance of one value, m²
    revision: u64,
}

/// One entry of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// The cell that is displaced, from 0.
    pub cell: usize,
    /// The cell that steps, from 0.
    pub stepping_cell: usize,
    /// Phase bin of the step, 0 to [`BINS`] − 1, counted along the crawl.
    pub bin: usize,
    /// Gait phase of the middle of the bin, 0 to 1, as the cam turns.
    pub phase: f64,
    /// Mean over the cycles of measured less modelled displacement in the bin, along the crawl, m.
    pub mean_m: f64,
    /// The same, less what the allowed deviations of stroke and stiffness explain, m.
    pub unexplained_m: f64,
    /// Standard error of the two, from the scatter over the cycles, m.
    pub sigma_m: f64,
}

impl Residual {
    /// The unexplained part in standard errors, signed.
    pub fn significance(&self) -> f64 {
        self.unexplained_m / self.sigma_m
    }
}

/// The most significant residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unexplained {
    /// The entry that shows it best.
    pub at: Residual,
    /// Unexplained displacement, in that bin or in the advance of a whole cycle, m a cycle.
    pub excess_m: f64,
    /// The same in standard errors.
    pub significance: f64,
    /// Whether it exceeds the threshold with the confidence of the whole family.
    pub is_significant: bool,
    /// The threshold, and what identified bounds leave uncertain there, m a cycle.
    pub allowed_m: f64,
    /// Whether nothing in the map exceeds the threshold, significantly or not.
    pub is_within: bool,
}

impl ResidualMap {
    /// An empty map, to be held against a threshold in m a cycle.
    pub(super) fn new(cells: usize, threshold_m: f64) -> Self {
        let size = cells * BINS * cells;
        Self {
            cells,
            direction: 1,
            stepping: [0; MAX_CELLS],
            means: vec![WeightedMean::default(); size],
            advance: WeightedMean::default(),
            recent_m: std::array::from_fn(|_| vec![f64::NAN; size]),
            spare: vec![WeightedMean::default(); size],
            model_sigma_m: vec![0.0; size],
            model_advance_sigma_m: 0.0,
            by_bound: vec![[0.0; MAX_CELLS]; size],
            threshold_m,
            effects_m: std::array::from_fn(|_| vec![0.0; size]),
            allowed_m: vec![0.0; size],
            allowed_advance_m: 0.0,
            pooled: 0.0,
            revision: 0,
        }
    }

    /// Clears the map, and calculates from the model what the allowed deviations would do.
    pub(super) fn clear(&mut self, direction: i32, model: &ReferenceModel) {
        self.direction = direction;
        for (step, cell) in self.stepping[..self.cells].iter_mut().enumerate() {
            *cell = model.stepping_cell(step);
        }
        self.means.fill(WeightedMean::default());
        self.advance = WeightedMean::default();
        self.recent_m.iter_mut().for_each(|cycle_m| cycle_m.fill(f64::NAN));
        for (effect_m, allowance) in self.effects_m.iter_mut().zip(&ALLOWANCES) {
            model.effect_of(allowance, effect_m);
        }
        self.allowed_m.fill(0.0);
        self.allowed_advance_m = 0.0;
        self.revision += 1;
    }

    /// Takes from the model what its identified bounds leave uncertain: `standard_error` is that of Σ wᵢ δmaxᵢ.
    pub(super) fn set_uncertainty(
        &mut self,
        model: &ReferenceModel,
        standard_error: impl Fn(&[f64; MAX_CELLS]) -> f64,
    ) {
        let effect_m = &mut self.model_sigma_m; // until it is overwritten
        let mut advance = [0.0; MAX_CELLS];
        for (cell, advance) in advance[..self.cells].iter_mut().enumerate() {
            model.effect_of_bound(cell, effect_m);
            *advance = effect_m.iter().sum::<f64>() / self.cells as f64;
            for (by_bound, &effect_m) in self.by_bound.iter_mut().zip(effect_m.iter()) {
                by_bound[cell] = effect_m;
            }
        }
        let known = |sigma_m: f64| if sigma_m.is_finite() { sigma_m } else { 0.0 };
        for (sigma_m, by_bound) in self.model_sigma_m.iter_mut().zip(&self.by_bound) {
            *sigma_m = known(standard_error(by_bound));
        }
        self.model_advance_sigma_m = known(standard_error(&advance));
    }

    /// Adds one cycle: an increment for each entry, `NaN` where it was not seen.
    pub(super) fn add(&mut self, increments_m: &[f64]) {
        self.recent_m.rotate_left(1);
        if let Some(newest_m) = self.recent_m.last_mut() {
            newest_m.copy_from_slice(increments_m);
        }
        add_cycle(self.cells, &mut self.means, &mut self.advance, increments_m);
        self.estimate();
        self.forget_what_is_over();
        self.revision += 1;
    }

    /// A fault that moved the worm by centimetres would stay in the mean for some forty cycles.
    fn forget_what_is_over(&mut self) {
        let far_off = |unexplained: Unexplained| unexplained.excess_m.abs() > OVER_THRESHOLDS * unexplained.allowed_m;
        if !self.unexplained(self.threshold_m).is_some_and(far_off) {
            return;
        }
        let advance = std::mem::take(&mut self.advance);
        std::mem::swap(&mut self.means, &mut self.spare);
        self.means.fill(WeightedMean::default());
        for cycle_m in &self.recent_m {
            add_cycle(self.cells, &mut self.means, &mut self.advance, cycle_m);
        }
        self.estimate();
        if !self
            .unexplained(self.threshold_m)
            .is_some_and(|recent| recent.is_within)
        {
            self.advance = advance;
            std::mem::swap(&mut self.means, &mut self.spare);
            self.estimate();
        }
    }

    /// What follows from the means: their scatter, and the allowed deviations.
    fn estimate(&mut self) {
        let (mut sum, mut count) = (0.0, 0.0);
        for variance in self.means.iter().filter_map(WeightedMean::variance) {
            sum += variance;
            count += 1.0;
        }
        self.pooled = if count > 0.0 { sum / count } else { 0.0 };
        self.allow();
    }

    /// Fits the allowed deviations by least squares, each to the part of the motion in which it shows, and within its limit.
    fn allow(&mut self) {
        self.allowed_m.fill(0.0);
        for (effect_m, allowance) in self.effects_m.iter().zip(&ALLOWANCES) {
            let (mut moment, mut square) = (0.0, 0.0);
            for bin in 0..self.cells * BINS {
                let of = |value: &dyn Fn(usize) -> f64| self.seen_in(allowance.shows_in, bin, value);
                let left_m = of(&|index| {
                    let known = self.means[index].known(self.pooled);
                    known.map_or(f64::NAN, |known| known.mean - self.allowed_m[index])
                });
                let effect_m = of(&|index| effect_m[index]);
                if left_m.is_finite() {
                    moment += effect_m * left_m;
                    square += effect_m * effect_m;
                }
            }
            if square > 0.0 {
                let fraction = (moment / square).clamp(-allowance.max, allowance.max);
                for (allowed_m, effect_m) in self.allowed_m.iter_mut().zip(effect_m) {
                    *allowed_m += fraction * effect_m;
                }
            }
        }
        self.allowed_advance_m = self.allowed_m.iter().sum::<f64>() / self.cells as f64;
    }

    /// A quantity of the entries of a bin: its mean over the body, or for the extension of the stepping cell.
    fn seen_in(&self, part: Part, bin: usize, of: &dyn Fn(usize) -> f64) -> f64 {
        let stepping = self.stepping[bin / BINS];
        let others = (0..self.cells).filter(|&cell| cell != stepping);
        let body = others.map(|cell| of(bin * self.cells + cell)).sum::<f64>() / (self.cells - 1) as f64;
        match part {
            Part::Body => body,
            Part::Extension => of(bin * self.cells + stepping) - body,
        }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// The direction of the crawl that the map is of: +1 forward, −1 backward.
    pub fn direction(&self) -> i32 {
        self.direction
    }

    /// Grows with every change of the map.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    pub(super) fn size(&self) -> usize {
        self.means.len()
    }

    /// Every entry with enough cycles, in the order of steps, bins and cells.
    pub fn entries(&self) -> impl Iterator<Item = Residual> + '_ {
        (0..self.size()).filter_map(|index| self.entry(index).map(|(residual, _)| residual))
    }

    fn entry(&self, index: usize) -> Option<(Residual, MeanEstimate)> {
        let known = self.means[index].known(self.pooled)?;
        let (bin_of_cycle, cell) = (index / self.cells, index % self.cells);
        let along = (bin_of_cycle as f64 + 0.5) / (self.cells * BINS) as f64;
        let residual = Residual {
            cell,
            stepping_cell: self.stepping[bin_of_cycle / BINS],
            bin: bin_of_cycle % BINS,
            phase: if self.direction < 0 { 1.0 - along } else { along },
            mean_m: known.mean,
            unexplained_m: known.mean - self.allowed_m[index],
            sigma_m: known.sigma,
        };
        Some((residual, known))
    }

    /// The most significant residual against a threshold in m a cycle; none before there are enough cycles.
    pub fn unexplained(&self, threshold_m: f64) -> Option<Unexplained> {
        let advance = self.advance.known(self.pooled)?;
        let advance_m = advance.mean - self.allowed_advance_m;
        let limit = normal_quantile_beyond(FALSE_FRACTION / (self.size() + 1) as f64);
        let mut worst: Option<(f64, usize, Residual)> = None;
        let allowed_advance_m = threshold_m + MODEL_SIGMAS * self.model_advance_sigma_m;
        let mut is_within = advance_m.abs() <= allowed_advance_m;
        for index in 0..self.size() {
            let Some((residual, known)) = self.entry(index) else {
                continue;
            };
            let allowed_m = threshold_m + MODEL_SIGMAS * self.model_sigma_m[index];
            is_within &= residual.unexplained_m.abs() <= allowed_m;
            // Those above the threshold first; below it, the most significant.
            let rank = known.beyond(residual.unexplained_m, allowed_m);
            let larger = |(max, _, than): &(f64, usize, Residual)| {
                rank > *max || (rank == *max && residual.significance().abs() > than.significance().abs())
            };
            if worst.as_ref().is_none_or(larger) {
                worst = Some((rank, index, residual));
            }
        }
        let (rank, index, _) = worst?;
        let advance_rank = advance.beyond(advance_m, allowed_advance_m);
        if advance_rank > rank {
            let at = self.carrier_of(advance_m)?;
            return Some(Unexplained {
                at,
                excess_m: advance_m,
                significance: advance_m / advance.sigma,
                is_significant: advance_rank > limit,
                allowed_m: allowed_advance_m,
                is_within,
            });
        }
        let at = self.named(index / self.cells)?;
        Some(Unexplained {
            at,
            excess_m: at.unexplained_m,
            significance: at.significance(),
            is_significant: rank > limit,
            allowed_m: threshold_m + MODEL_SIGMAS * self.model_sigma_m[index],
            is_within,
        })
    }

    /// The entry of the bin that contributes most to an excess of the advance.
    fn carrier_of(&self, advance_m: f64) -> Option<Residual> {
        let displacement_m = |bin: usize| -> f64 {
            let cells = bin * self.cells..(bin + 1) * self.cells;
            let known = cells.filter_map(|index| self.entry(index));
            known
                .map(|(residual, _)| residual.unexplained_m * advance_m.signum())
                .sum()
        };
        let bins = (0..self.cells * BINS).map(|bin| (bin, displacement_m(bin)));
        let (bin, _) = bins.max_by(|(_, one), (_, other)| one.total_cmp(other))?;
        self.named(bin)
    }

    /// The entry of a bin to report: that of the stepping cell, because a body that gives way moves all cells, and does so against the
    /// stepping cell's tip; or another, if it clearly stands out.
    fn named(&self, bin: usize) -> Option<Residual> {
        let stepping = self
            .entry(bin * self.cells + self.stepping[bin / BINS])
            .map(|entry| entry.0);
        let entries = (bin * self.cells..(bin + 1) * self.cells).filter_map(|index| self.entry(index));
        let size = |residual: &Residual| residual.unexplained_m.abs();
        let largest = entries
            .map(|entry| entry.0)
            .max_by(|one, other| size(one).total_cmp(&size(other)))?;
        match stepping {
            Some(own) if size(&largest) - size(&own) <= STANDS_OUT_SIGMAS * largest.sigma_m.hypot(own.sigma_m) => {
                Some(own)
            }
            _ => Some(largest),
        }
    }
}

fn add_cycle(cells: usize, means: &mut [WeightedMean], advance: &mut WeightedMean, increments_m: &[f64]) {
    let mut sum_m = 0.0;
    for (mean, &increment_m) in means.iter_mut().zip(increments_m) {
        mean.add(increment_m);
        sum_m += increment_m;
    }
    advance.add(sum_m / cells as f64);
}

/// The z beyond which at most this probability of the normal distribution lies, for probabilities up to 1 %: from Mills' bound on the
/// tail, exp(−z²/2)/(z √(2π)). One tail is enough: a mean that exceeds the threshold does so on one side.
fn normal_quantile_beyond(probability: f64) -> f64 {
    let log = -2.0 * (probability * TAU.sqrt()).ln();
    (0..5).fold(log.sqrt(), |z, _| (log - 2.0 * z.ln()).sqrt())
}

#[cfg(test)]
mod tests {
    use super::normal_quantile_beyond;

    #[test]
    fn the_limit_is_just_above_the_normal_quantile() {
        // Abramowitz and Stegun, table 26.6.
        for (probability, quantile) in [(1e-2, 2.32635), (1e-3, 3.09023), (1e-4, 3.71902), (1e-5, 4.26489)] {
            let limit = normal_quantile_beyond(probability);
            assert!((quantile..quantile + 0.08).contains(&limit), "{probability}: {limit}");
        }
    }
}
