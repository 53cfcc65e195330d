//! The gait phase from the positions, sample by sample.

use super::Finder;
use crate::identify::track;

/// Residual of a sample at the best phase, in standard deviations of the noise for each cell, from which it is rejected.
const MAX_RESIDUAL: f64 = 6.0;

impl Finder<'_> {
    /// The phase of each sample: where it lies closest to the path of the relative positions, smoothed in time, for a motor
    /// does not jump.
    pub(super) fn follow_phase(&mut self) {
        let readings: Vec<Option<(f64, f64)>> = (0..self.phase.len()).map(|sample| self.read_phase(sample)).collect();
        let smoothed = track::smooth(self.time_s, &readings);
        self.phase_sigma = smoothed.sigma;
        self.phase = track::never_falling(&smoothed.value);
    }

    /// The phase by one sample near the present one, and its variance; none where the cell whose step it is was not seen, or
    /// where the positions fit no phase.
    pub(super) fn read_phase(&self, sample: usize) -> Option<(f64, f64)> {
        let cells = self.cells();
        let here = (self.phase[sample] * cells as f64).floor();
        let stepping_in = |slot: f64| self.order[slot.rem_euclid(cells as f64) as usize];
        if self.seen_m[stepping_in(here)][sample].is_nan() {
            return None;
        }
        let mut best = (f64::INFINITY, 0.0, 0.0); // chi-squared, phase, variance
        // The present step first: two cells alone fit the steps beside it just as well.
        for slot in [here, here - 1.0, here + 1.0] {
            let stepping = stepping_in(slot);
            let begun = slot / cells as f64 + 1e-12;
            let displacement_m = |cell: usize| {
                self.seen_m[cell][sample] - self.place_m[cell] - self.stroke_m * self.steps_made(cell, begun).round()
            };
            let (mut sum_m, mut squares, mut count) = (0.0, 0.0, 0.0);
            for displacement_m in (0..cells)
                .filter(|&cell| cell != stepping)
                .map(displacement_m)
                .filter(|displacement_m| displacement_m.is_finite())
            {
                sum_m += displacement_m;
                squares += displacement_m * displacement_m;
                count += 1.0;
            }
            let extension = (displacement_m(stepping) - sum_m / count) / self.stroke_m;
            if count == 0.0 || extension.is_nan() {
                continue;
            }
            let fraction = extension.clamp(0.0, 1.0);
            let beyond_m = (extension - fraction) * self.stroke_m;
            let chi_squared = squares - sum_m * sum_m / count + beyond_m * beyond_m * count / (count + 1.0);
            if chi_squared < best.0 {
                let sigma = self.noise_m * (1.0 + 1.0 / count).sqrt() / (self.stroke_m * cells as f64);
                best = (chi_squared, (slot + fraction) / cells as f64, sigma * sigma);
            }
        }
        let believable = best.0 < (MAX_RESIDUAL * self.noise_m).powi(2) * cells as f64;
        believable.then_some((best.1, best.2))
    }
}
