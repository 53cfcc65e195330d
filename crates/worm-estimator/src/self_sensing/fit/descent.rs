//! Gauss-Newton steps with damping, one evaluation of the model at a time.

use super::super::leading;
use super::super::parameters::{Parameters, Vector};
use super::Fit;
use super::linearise::Linearised;
use std::task::Poll;

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
    tried: Parameters, // where the present step would lead
    stage: Stage,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The profile where it begins, and what is minimised there.
    Begin,
    BeginCost,
    Linearise,
    /// A step with the damping of this try, the profile where it leads, and what is minimised there.
    Step(usize),
    Try(usize),
    TryCost(usize),
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
            tried: at,
            stage: Stage::Begin,
        }
    }

    /// The next piece; true at the end.
    pub(super) fn step(&mut self, fit: &mut Fit) -> bool {
        match self.stage {
            Stage::Begin => match fit.evaluate(&self.at) {
                Poll::Pending => false,
                Poll::Ready(None) => true,
                Poll::Ready(Some(())) => {
                    self.stage = Stage::BeginCost;
                    false
                }
            },
            Stage::BeginCost => {
                self.cost = Some(fit.cost(&self.at));
                self.begin_round(fit)
            }
            Stage::Linearise => match fit.linearise(&self.at) {
                Linearised::Further => false,
                Linearised::Impossible => true,
                Linearised::Done => {
                    self.stage = Stage::Step(0);
                    false
                }
            },
            Stage::Step(of_tries) => self.solve_step(fit, of_tries),
            Stage::Try(of_tries) => match fit.evaluate(&self.tried) {
                Poll::Pending => false,
                Poll::Ready(None) => self.try_shorter(of_tries),
                Poll::Ready(Some(())) => {
                    self.stage = Stage::TryCost(of_tries);
                    false
                }
            },
            Stage::TryCost(of_tries) => {
                let tried = fit.cost(&self.tried);
                if self.cost.is_some_and(|cost| tried < cost) {
                    (self.at, self.cost) = (self.tried, Some(tried));
                    self.damping *= 0.2;
                    self.begin_round(fit)
                } else {
                    self.try_shorter(of_tries)
                }
            }
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

    fn solve_step(&mut self, fit: &mut Fit, of_tries: usize) -> bool {
        if of_tries == 0 {
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
        self.tried = self.at;
        self.tried.values += step;
        self.stage = Stage::Try(of_tries);
        false
    }

    /// Ends the descent after the last try.
    fn try_shorter(&mut self, of_tries: usize) -> bool {
        self.damping = (self.damping * 8.0).max(1e-2);
        self.stage = Stage::Step(of_tries + 1);
        of_tries + 1 == TRIES
    }
}

impl Fit {
    /// The direction in which what is minimised falls, halved.
    fn gradient(&self, at: &Parameters) -> Vector {
        self.score(&self.mean_n_m[..], &self.predicted_n_m[..]) * self.weight() - self.prior_pull(at)
    }
}
