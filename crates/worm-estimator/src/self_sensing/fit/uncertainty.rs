//! How sure the fit is, and what follows from it.
//!
//! With M = Hᵀ diag(w) H/R and A = W M + Λ the covariance is A⁻¹ (B + Λ) A⁻¹. B is the covariance of the score W·Hᵀ(ȳ − h)/R:
//!
//! - the scatter of whole cycles about their mean, whatever its cause (noise, gait-to-gait scatter, drift), measured; while there are
//!   few cycles, mixed with what noise and [`SCATTER_SHARE`] of friction would give;
//! - what the fit leaves in the mean profile beyond that scatter does not average out. Taken to hang together over
//!   [`MISFIT_BINS`] bins, it counts fully, and it limits the weight W = N/(1 + N·misfit) that any number of cycles can have.
//!
//! Another answer with another pull that the search found and the profile does not exclude adds how far it is, by its probability.
//! What the prior leaves uncertain (torque constant, friction of the gears) is in A⁻¹ Λ A⁻¹.

use super::super::model::{CycleFigures, FIGURES};
use super::super::parameters::Matrix;
use super::{FLOOR_N_M, Fit, STEPS};
use worm_physics::MAX_CELLS;

/// Gait-to-gait scatter of a cell's friction that is assumed before it is measured, as a share.
const SCATTER_SHARE: f64 = 0.02;
/// How many cycles of measured scatter that assumption is worth.
const SCATTER_CYCLES: f64 = 3.0;
/// Bins over which what the fit leaves hangs together.
pub(super) const MISFIT_BINS: f64 = 8.0;

impl Fit {
    /// Scatter, misfit and covariance, at the present parameters.
    pub(super) fn assess(&mut self, torque_n_m: &[f64]) {
        if self.linearise().is_none() {
            return;
        }
        let squared = self.forgetting * self.forgetting;
        self.scatter *= squared;
        self.scatter_count *= squared;
        if self.cycles > 1.0 {
            // Welford's: about the mean that already contains this cycle.
            let score = self.score(torque_n_m, &self.mean_n_m[..]);
            self.scatter += score * score.transpose() * (self.cycles / (self.cycles - 1.0));
            self.scatter_count += 1.0;
        }
        let mut by_friction = Matrix::zeros();
        for cell in 0..self.at.cells {
            by_friction[(cell, cell)] = SCATTER_SHARE * SCATTER_SHARE;
        }
        let assumed = self.single + self.single * by_friction * self.single;
        let scatter = (self.scatter + assumed * SCATTER_CYCLES) / (self.scatter_count + SCATTER_CYCLES);
        let (mut squares, mut weights) = (0.0, 0.0);
        for bin in 0..self.bins {
            let weight = Self::bin_weight(bin);
            squares += weight * (self.mean_n_m[bin] - self.predicted_n_m[bin]).powi(2);
            weights += weight;
        }
        let left = (squares / weights - self.variance / self.cycles).max(FLOOR_N_M * FLOOR_N_M);
        self.misfit = MISFIT_BINS * left / self.variance;
        let reduced = self.weight() / self.cycles;
        let meat = scatter * (self.squared_cycles * reduced * reduced)
            + self.single * (self.weight() * self.weight() * self.misfit)
            + Matrix::from_diagonal(&self.prior_information);
        if let Some(inverse) = self.information().cholesky().map(|cholesky| cholesky.inverse()) {
            self.covariance = inverse * meat * inverse;
        }
        if let Some(other) = &self.other {
            // Of two answers, at the better one: its covariance, and how far the other is, as probably as it is true.
            let apart = other.values - self.at.values;
            self.covariance += apart * apart.transpose() * (self.other_odds / (1.0 + self.other_odds));
        }
    }

    /// Work that the damping of the pads adds to a cycle, J: the lead times what the force rises in each step.
    fn damping_j(&self) -> f64 {
        let rise_n_m: f64 = (0..self.at.cells)
            .map(|cell| 2.0 * self.at.friction_n(cell) / self.force_per_torque)
            .sum();
        self.at.values[self.at.gears_at() + 3] * self.velocity_rad_per_s * rise_n_m
    }

    /// Figures of the steady cycle with their standard errors, of the crawl forward or backward. The work of the actuator includes that of
    /// the pads' damping, the losses (11) do not.
    pub(in super::super) fn figures(&self, backward: bool) -> Option<(CycleFigures, CycleFigures)> {
        let mut centre = self.model.figures(&self.at, backward)?;
        let mut slopes = [[0.0; FIGURES]; 2 * MAX_CELLS + 1];
        for (unknown, slope) in slopes[..self.at.of_worm()].iter_mut().enumerate() {
            let step = STEPS[(unknown / self.at.cells).min(2)];
            let moved = |by: f64| {
                let mut moved = self.at;
                moved.values[unknown] += by;
                self.model
                    .figures(&moved, backward)
                    .map_or(centre, |figures| figures)
                    .flat()
            };
            let (up, down) = (moved(step), moved(-step));
            for figure in 0..FIGURES {
                slope[figure] = (up[figure] - down[figure]) / (2.0 * step);
            }
        }
        let mut sigma = [0.0; FIGURES];
        for (figure, sigma) in sigma.iter_mut().enumerate() {
            let mut variance = 0.0;
            for a in 0..self.at.of_worm() {
                for b in 0..self.at.of_worm() {
                    variance += slopes[a][figure] * self.covariance[(a, b)] * slopes[b][figure];
                }
            }
            *sigma = variance.max(0.0).sqrt();
        }
        let damping_j = self.damping_j();
        centre.energy_net_j += damping_j;
        centre.energy_positive_j += damping_j;
        let mut sigma = CycleFigures::from_flat(&sigma);
        // Near a leap of the steady cycle the derivative says nothing, but a worm cannot be further off than this.
        sigma.advance_m = sigma.advance_m.min(self.stroke_m);
        let lead = self.at.gears_at() + 3;
        let damping_sigma_j = (damping_j / self.at.values[lead]).abs() * self.covariance[(lead, lead)].max(0.0).sqrt();
        sigma.energy_net_j = sigma.energy_net_j.hypot(damping_sigma_j);
        sigma.energy_positive_j = sigma.energy_positive_j.hypot(damping_sigma_j);
        Some((centre, sigma))
    }
}
