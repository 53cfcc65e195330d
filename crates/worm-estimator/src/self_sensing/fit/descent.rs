//! Gauss-Newton steps with damping, one evaluation of the model at a time.

use super::super::leading;
use super::super::parameters::{Parameters, Vector};
use super::Fit;
use super::linearise::Linearised;

/// Longest step: of a logarithm, and of the pull, N.
const LONGEST: [f64; 2] = [0.4, 0.8];
/// Expected gain of a step, in units of its variance, below which a descent ends.
const CLOSE_ENOUGH: f64 = 1e-3;
/// Dampings that are tried in a step.
const TRIES: usize = 4;

/// A descent under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Descent {
    /// Where it is.
    pub(super) at: Parameters,
    /// What is minimised there; `None` before it is known, and where no such worm holds.
    pub(super) cost: Option<f64>,
    rounds: usize, // left
    damping: f64,
    gradient: Vector,
    stage: Stage,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Begin,
    Linearise,
    Try(usize),
}

impl Descent {
    /// Begins at these parameters, for at most so many steps.
    pub(super) fn new(at: Parameters, rounds: usize) -> Self {
        Self {
            at,
            cost: None,
            rounds,
            damping: 1e-3,
            gradient: Vector::zeros(),
            stage: Stage::Begin,
        }
    }

    /// The next piece; true at the end.
    pub(super) fn step(&mut self, fit: &mut Fit) -> bool {
        match self.stage {
            Stage::Begin => {
                self.cost = fit.cost(&self.at);
                self.cost.is_none() || self.begin_round(fit)
            }
            Stage::Linearise => match fit.linearise(&self.at) {
                Linearised::Further => false,
                Linearised::Impossible => true,
                Linearised::Done => {
                    self.stage = Stage::Try(0);
                    false
                }
            },
            Stage::Try(tried) => self.try_step(fit, tried),
        }
    }

    fn begin_round(&mut self, fit: &mut Fit) -> bool {
        if self.rounds == 0 {
            return true;
        }
        self.rounds -= 1;
        fit.linearisation.begin();
        self.stage = Stage::Linearise;
        false
    }

    fn try_step(&mut self, fit: &mut Fit, tried: usize) -> bool {
        let Some(cost) = self.cost else { return true };
        if tried == 0 {
            self.gradient = fit.gradient(&self.at);
        }
        fit.fill_information();
        let factor = &mut fit.scratch[0];
        for unknown in 0..fit.unknowns {
            factor[(unknown, unknown)] *= 1.0 + self.damping;
        }
        if !leading::cholesky(factor, fit.unknowns) {
            return true;
        }
        let mut step = self.gradient;
        leading::solve(factor, fit.unknowns, &mut step);
        if self.gradient.dot(&step) < CLOSE_ENOUGH {
            return true;
        }
        let pull_at = self.at.pull_at();
        let too_long = (0..self.at.of_worm())
            .map(|unknown| step[unknown].abs() / LONGEST[usize::from(unknown == pull_at)])
            .fold(1.0, f64::max);
        step /= too_long;
        let mut moved = self.at;
        moved.values += step;
        match fit.cost(&moved) {
            Some(lower) if lower < cost => {
                (self.at, self.cost) = (moved, Some(lower));
                self.damping *= 0.2;
                self.begin_round(fit)
            }
            _ => {
                self.damping = (self.damping * 8.0).max(1e-2);
                self.stage = Stage::Try(tried + 1);
                tried + 1 == TRIES
            }
        }
    }
}

impl Fit {
    /// The direction in which what is minimised falls, halved.
    fn gradient(&self, at: &Parameters) -> Vector {
        self.score(&self.mean_n_m[..], &self.predicted_n_m[..]) * self.weight()
            - (at.values - self.prior).component_mul(&self.prior_information)
    }
}
