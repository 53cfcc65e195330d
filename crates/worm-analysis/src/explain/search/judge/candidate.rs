//! A fitted effect, or a pair, that may be the answer.

use super::super::fit::Fit;
use super::super::held_out::HeldOut;
use super::super::parameter::{Hypothesised, What};
use super::super::plant::Plant;
use super::super::problem::FitProblem;
use super::evidence::Evidence;
use super::prior::is_possible;

/// Standard errors by which a severity is off its limit: what may as well be at its limit fits something else.
const OFF_LIMIT: f64 = 2.0;

/// A fitted effect, or a pair.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Candidate {
    pub hypothesised: Vec<Hypothesised>,
    pub fit: Fit,
    /// Fall of chi-squared from the recalibrated model.
    pub improvement: f64,
    /// Logarithm of the cycles in which it may begin by the data, 0 where it acts throughout.
    pub ln_onset: f64,
    /// Probability of the data; none before it is computed.
    pub evidence: Option<Evidence>,
    pub held_out: Option<HeldOut>,
    /// Place of an effect that was fitted beside the others and changes nothing that matters: it gets no name.
    pub trace: Option<usize>,
}

impl Candidate {
    /// A fit, with its improvement over another.
    pub fn of(problem: &FitProblem<'_, impl Plant>, base: &Fit, fit: Fit) -> Self {
        Self {
            improvement: base.chi_squared - fit.chi_squared - problem.excess_of_repeating(base, &fit),
            hypothesised: fit.hypothesis.hypothesised.clone(),
            ln_onset: 0.0,
            evidence: None,
            held_out: None,
            trace: None,
            fit,
        }
    }

    /// Whether an effect in it begins and ends again.
    pub fn comes_and_goes(&self) -> bool {
        let mut onsets = self.hypothesised.iter().filter_map(|one| one.onset);
        onsets.any(|onset| onset.comes_and_goes())
    }

    /// The effects that it names, each with its place in the hypothesis: all but a trace.
    pub fn named(&self) -> impl Iterator<Item = (usize, &Hypothesised)> + Clone {
        let all = self.hypothesised.iter().enumerate();
        all.filter(|(place, _)| self.trace != Some(*place))
    }

    /// Whether it names two effects.
    pub fn is_pair(&self) -> bool {
        self.named().count() > 1
    }

    /// Whether every effect in it is strong enough to matter, of a sense that it can have, with its severity, its shape and the time for
    /// which it acts off their limits: scatter from cycle to cycle looks like a little of many effects, and what is driven to its limit fits
    /// something else.
    pub fn is_notable(&self) -> bool {
        let settings = self.fit.hypothesis.settings(&self.fit.at);
        let (sigmas, quantities) = (self.sigmas(), &self.fit.hypothesis.free);
        let sigma_of = |wanted: usize| {
            let mut severities = quantities.iter().zip(&sigmas).filter(|(free, _)| match free.what {
                What::Effect { place, parameter } => (place, parameter) == (wanted, 0),
                What::Nuisance(_) | What::Law(_) => false,
            });
            severities.next().map_or(0.0, |(_, sigma)| *sigma)
        };
        let is_strong = self.named().all(|(place, _)| {
            let setting = &settings[place];
            let severity = &setting.effect().parameters[0];
            let value = setting.values()[0];
            let limit = if value > severity.neutral {
                severity.max
            } else {
                severity.min
            };
            let is_inside = (value - limit).abs() > OFF_LIMIT * sigma_of(place);
            (value - severity.neutral).abs() >= severity.notable && is_inside && is_possible(setting.effect(), value)
        });
        let free = self.fit.hypothesis.free.iter().enumerate();
        let mut shapes = free.filter(|(_, free)| match free.what {
            What::Effect { place, parameter } => {
                let may_be_at_end = || {
                    let shape = &self.hypothesised[place].effect.parameters[parameter];
                    shape.may_be_at_end(settings[place].values()[parameter])
                };
                parameter > 0 && self.trace != Some(place) && !may_be_at_end()
            }
            What::Nuisance(_) | What::Law(_) => false,
        });
        let mut onsets = self.named().filter_map(|(_, one)| one.onset);
        is_strong
            && !onsets.any(|onset| onset.is_shortest())
            && shapes.all(|(quantity, _)| !self.fit.at_limit(quantity))
    }

    /// Standard errors of all quantities: noise and discrepancy counted.
    pub fn sigmas(&self) -> Vec<f64> {
        self.fit.sigmas()
    }
}

/// Whether two answers are the same up to twins and cells.
pub(in crate::explain) fn are_alike(one: &Candidate, other: &Candidate) -> bool {
    let alike = |a: &Hypothesised, b: &Hypothesised| a.effect.name == b.effect.name || a.is_twin_of(b);
    one.named().count() == other.named().count() && one.named().all(|(_, a)| other.named().any(|(_, b)| alike(a, b)))
}

/// The best of each kind, best first: twins and other cells of the same effect left out.
pub(in crate::explain) fn kinds(candidates: &[Candidate]) -> Vec<&Candidate> {
    let mut kinds: Vec<&Candidate> = Vec::new();
    for candidate in candidates {
        if !kinds.iter().any(|kind| are_alike(kind, candidate)) {
            kinds.push(candidate);
        }
    }
    kinds
}
