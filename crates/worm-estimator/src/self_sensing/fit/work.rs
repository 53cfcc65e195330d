//! What is to be done for a cycle, in pieces of one evaluation of the model each.

use super::super::parameters::Parameters;
use super::Fit;
use super::descent::Descent;
use super::linearise::Linearised;
use super::search::Search;
use super::uncertainty::{Assessment, FigureDerivatives};

/// Gauss-Newton steps in a cycle without a search, and of the other answer.
const ROUNDS: [usize; 2] = [2, 1];

/// What is under way.
#[derive(Debug, Clone, Copy)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is one of it for each worm, and it must not allocate"
)]
pub(super) enum Work {
    /// Nothing.
    Idle,
    /// The search for the place where the fit begins.
    Search(Search),
    /// The descent from where the last cycle left the fit.
    Refine(Descent),
    /// The descent of the other answer, and what is minimised at the best one.
    Other(Descent, Option<f64>),
    /// The periodic crawl from which later evaluations begin.
    Begin,
    /// Derivatives at the answer.
    Linearise,
    /// Covariance.
    Assess(Assessment),
    /// What follows from the answer.
    Figures(FigureDerivatives),
}

impl Work {
    pub(super) fn refine(at: Parameters) -> Self {
        Self::Refine(Descent::new(at, ROUNDS[0]))
    }

    pub(super) fn figures() -> Self {
        Self::Figures(FigureDerivatives::new())
    }
}

impl Fit {
    /// Does the next piece of work; true when there is none left.
    pub(in super::super) fn step(&mut self) -> bool {
        self.work = match std::mem::replace(&mut self.work, Work::Idle) {
            Work::Idle => Work::Idle,
            Work::Search(mut search) => match search.step(self) {
                None => Work::Search(search),
                Some(cost) => self.other_answer(cost),
            },
            Work::Refine(mut descent) => {
                if descent.step(self) {
                    self.at = descent.at;
                    self.other_answer(descent.cost)
                } else {
                    Work::Refine(descent)
                }
            }
            Work::Other(mut descent, cost) => {
                if descent.step(self) {
                    self.weigh_other(cost, &descent);
                    Work::Begin
                } else {
                    Work::Other(descent, cost)
                }
            }
            Work::Begin => {
                let at = self.at;
                if self.model.begin_at(&at).is_pending() {
                    Work::Begin
                } else {
                    self.linearisation.begin();
                    Work::Linearise
                }
            }
            Work::Linearise => {
                let at = self.at;
                match self.linearise(&at) {
                    Linearised::Further => Work::Linearise,
                    Linearised::Done => Work::Assess(Assessment::new()),
                    Linearised::Impossible => Work::figures(),
                }
            }
            Work::Assess(mut assessment) => {
                if assessment.step(self) {
                    Work::figures()
                } else {
                    Work::Assess(assessment)
                }
            }
            Work::Figures(mut derivatives) => {
                if derivatives.step(self) {
                    Work::Idle
                } else {
                    Work::Figures(derivatives)
                }
            }
        };
        self.is_idle()
    }

    /// Whether there is no work left.
    pub(in super::super) fn is_idle(&self) -> bool {
        matches!(self.work, Work::Idle)
    }

    /// Follows the other answer, too, where there is one. `cost` is what is minimised at the best.
    fn other_answer(&mut self, cost: Option<f64>) -> Work {
        self.other_odds = 0.0;
        match self.other {
            Some(other) => Work::Other(Descent::new(other, ROUNDS[1]), cost),
            None => Work::Begin,
        }
    }
}
