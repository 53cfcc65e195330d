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

use super::super::leading;
use super::super::model::{CycleFigures, FIGURES, Heading};
use super::{FLOOR_N_M, Fit, moved};
use std::task::Poll;
use worm_physics::MAX_CELLS;

/// Gait-to-gait scatter of a cell's friction that is assumed before it is measured, as a share.
const SCATTER_SHARE: f64 = 0.02;
/// How many cycles of measured scatter that assumption is worth.
const SCATTER_CYCLES: f64 = 3.0;
/// Bins over which what the fit leaves hangs together.
pub(super) const MISFIT_BINS: f64 = 8.0;

/// Scatter, misfit and covariance, at the answer and with its derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Assessment {
    next: u32,
}

impl Assessment {
    pub(super) fn new() -> Self {
        Self { next: 0 }
    }

    /// The next piece; true at the end.
    pub(super) fn step(&mut self, fit: &mut Fit) -> bool {
        self.next += 1;
        match self.next {
            1 => {
                fit.gather_scatter();
                false
            }
            2 => !fit.factor_information(),
            // The inverse of A in the second scratch matrix.
            3 => {
                let [factor, inverse] = &mut *fit.scratch;
                leading::inverse(factor, fit.unknowns, inverse);
                false
            }
            4 => {
                fit.fill_meat();
                false
            }
            5 => {
                let [meat, inverse] = &*fit.scratch;
                leading::multiply(inverse, meat, fit.unknowns, &mut fit.covariance);
                false
            }
            _ => {
                let [product, inverse] = &mut *fit.scratch;
                leading::multiply(&fit.covariance, inverse, fit.unknowns, product);
                for column in 0..fit.unknowns {
                    for row in 0..fit.unknowns {
                        fit.covariance[(row, column)] = product[(row, column)];
                    }
                }
                fit.add_other();
                true
            }
        }
    }
}

impl Fit {
    fn gather_scatter(&mut self) {
        *self.fitted_n_m = *self.predicted_n_m;
        let squared = self.forgetting * self.forgetting;
        self.scatter_count *= squared;
        let size = self.unknowns;
        let mut share = 0.0;
        let mut score = super::Vector::zeros();
        if self.cycles > 1.0 {
            // Welford's: about the mean that already contains this cycle.
            score = self.score(&self.cycle_n_m[..], &self.mean_n_m[..]);
            share = self.cycles / (self.cycles - 1.0);
            self.scatter_count += 1.0;
        }
        for column in 0..size {
            for row in 0..size {
                let scatter = &mut self.scatter[(row, column)];
                *scatter = *scatter * squared + share * score[row] * score[column];
            }
        }
        let (mut squares, mut weights) = (0.0, 0.0);
        for bin in 0..self.bins {
            let weight = Self::bin_weight(bin);
            squares += weight * (self.mean_n_m[bin] - self.predicted_n_m[bin]).powi(2);
            weights += weight;
        }
        let left = (squares / weights - self.variance / self.cycles).max(FLOOR_N_M * FLOOR_N_M);
        self.misfit = MISFIT_BINS * left / self.variance;
    }

    /// Whether A is definite; its factor is in the first scratch matrix then.
    fn factor_information(&mut self) -> bool {
        self.fill_information();
        leading::cholesky(&mut self.scratch[0], self.unknowns)
    }

    /// B + Λ, into the first scratch matrix.
    fn fill_meat(&mut self) {
        let weight = self.weight();
        let reduced = weight / self.cycles;
        let of_scatter = self.squared_cycles * reduced * reduced / (self.scatter_count + SCATTER_CYCLES);
        let of_single = weight * weight * self.misfit;
        let meat = &mut self.scratch[0];
        for column in 0..self.unknowns {
            for row in 0..self.unknowns {
                let by_friction: f64 = (0..self.at.cells)
                    .map(|cell| self.single[(row, cell)] * self.single[(column, cell)])
                    .sum();
                let single = self.single[(row, column)];
                let assumed = single + SCATTER_SHARE * SCATTER_SHARE * by_friction;
                meat[(row, column)] =
                    of_scatter * (self.scatter[(row, column)] + assumed * SCATTER_CYCLES) + of_single * single;
            }
            meat[(column, column)] += self.prior_information[column];
        }
        for column in 0..self.at.cells {
            for row in 0..self.at.cells {
                meat[(row, column)] -= self.common_freedom;
            }
        }
    }

    /// Of two answers, at the better one: its covariance, and how far the other is, as probably as it is true.
    fn add_other(&mut self) {
        let Some(other) = &self.other else { return };
        let apart = other.values - self.at.values;
        let probability = self.other_odds / (1.0 + self.other_odds);
        for column in 0..self.unknowns {
            for row in 0..self.unknowns {
                self.covariance[(row, column)] += apart[row] * apart[column] * probability;
            }
        }
    }

    /// Work that the damping of the pads adds to a cycle, J: the lead times what the force rises in each step.
    fn damping_j(&self) -> f64 {
        let rise_n_m: f64 = (0..self.at.cells)
            .map(|cell| 2.0 * self.at.friction_n(cell) / self.force_per_torque)
            .sum();
        self.at.values[self.at.gears_at() + 3] * self.velocity_rad_per_s * rise_n_m
    }
}

/// Figures of the steady cycle with their standard errors, by finite differences. The work of the actuator includes that of the pads'
/// damping, the losses (11) do not.
#[derive(Debug, Clone, Copy)]
pub(super) struct FigureDerivatives {
    next: usize,
    centre: CycleFigures,
    up: [f64; FIGURES],
}

/// Derivatives of the figures by the worm's unknowns.
pub(super) type Slopes = [[f64; FIGURES]; 2 * MAX_CELLS + 1];

impl FigureDerivatives {
    pub(super) fn new() -> Self {
        Self {
            next: 0,
            centre: CycleFigures::default(),
            up: [0.0; FIGURES],
        }
    }

    /// The next piece; true at the end.
    pub(super) fn step(&mut self, fit: &mut Fit) -> bool {
        let of_worm = fit.at.of_worm();
        // `Ready(None)` ends it: no such worm holds, or everything is done.
        let piece = match self.next {
            0 => fit.model.figures(&fit.at, Heading::Forward).map(|centre| {
                if centre.is_none() {
                    fit.figures = None;
                }
                self.centre = centre?;
                Some(())
            }),
            next if next <= 2 * of_worm => self.differentiate(fit, (next - 1) / 2, next % 2 == 0).map(Some),
            next if next == 2 * of_worm + 1 => fit.model.figures(&fit.at, Heading::Backward).map(|backward| {
                fit.backward_advance_m = backward.map(|backward| backward.advance_m);
                Some(())
            }),
            _ => {
                fit.figures = Some(self.with_errors(fit));
                Poll::Ready(None)
            }
        };
        self.next += usize::from(piece.is_ready());
        piece == Poll::Ready(None)
    }

    fn differentiate(&mut self, fit: &mut Fit, unknown: usize, is_second: bool) -> Poll<()> {
        let (moved, step) = moved(&fit.at, unknown, is_second);
        fit.model.figures(&moved, Heading::Forward).map(|figures| {
            let figures = figures.unwrap_or(self.centre).flat();
            if !is_second {
                self.up = figures;
                return;
            }
            for (slope, (up, down)) in fit.slopes[unknown].iter_mut().zip(self.up.iter().zip(figures)) {
                *slope = (up - down) / (2.0 * step);
            }
        })
    }

    fn with_errors(&self, fit: &Fit) -> (CycleFigures, CycleFigures) {
        let mut variance = [0.0; FIGURES];
        for (a, of_a) in fit.slopes[..fit.at.of_worm()].iter().enumerate() {
            for (b, of_b) in fit.slopes[..fit.at.of_worm()].iter().enumerate() {
                let covariance = fit.covariance[(a, b)];
                for ((variance, of_a), of_b) in variance.iter_mut().zip(of_a).zip(of_b) {
                    *variance += of_a * covariance * of_b;
                }
            }
        }
        let sigma = variance.map(|variance| variance.max(0.0).sqrt());
        let mut centre = self.centre;
        let damping_j = fit.damping_j();
        centre.energy_net_j += damping_j;
        centre.energy_positive_j += damping_j;
        let mut sigma = CycleFigures::from_flat(&sigma);
        // Near a leap of the steady cycle the derivative says nothing, but a worm cannot be further off than this.
        sigma.advance_m = sigma.advance_m.min(fit.stroke_m);
        let lead = fit.at.gears_at() + 3;
        let damping_sigma_j = (damping_j / fit.at.values[lead]).abs() * fit.covariance[(lead, lead)].max(0.0).sqrt();
        sigma.energy_net_j = sigma.energy_net_j.hypot(damping_sigma_j);
        sigma.energy_positive_j = sigma.energy_positive_j.hypot(damping_sigma_j);
        (centre, sigma)
    }
}
