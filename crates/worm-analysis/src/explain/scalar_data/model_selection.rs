//! Chance, the set of effects that bring the model within it, and the sentence about them.
//!
//! A right model with normal errors leaves a chi-squared, priors included, with as many degrees of freedom as there are scalars for the
//! recalibrated model, and one less for every parameter of an effect. There is a gap where the recalibrated model leaves more than a
//! right one would one time in twenty. An effect is ruled out only by more than a right one would leave one time in a hundred: it is
//! worse to miss a cause than to keep a doubtful one.

use super::super::answer::{Remainder, Verdict};
use super::table::Table;
use crate::explain::search::fit::Fit;
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::search::parameter::{Hypothesised, What};

/// A quantile of chi-square: its first values from 1 degree of freedom on, and the same quantile of the normal distribution.
type Quantile = ([f64; 8], f64);
const ONE_IN_TWENTY: Quantile = ([3.841, 5.991, 7.815, 9.488, 11.070, 12.592, 14.067, 15.507], 1.6449);
const ONE_IN_A_HUNDRED: Quantile = ([6.635, 9.210, 11.345, 13.277, 15.086, 16.812, 18.475, 20.090], 2.3263);
/// Quantities that every recalibration has to determine: friction, stiffness and stroke. The values of single cells and the slopes are
/// known much better, and their priors are part of chi-squared.
const COMMON: usize = 3;

fn quantile((first, normal): Quantile, degrees: usize) -> f64 {
    let degrees = degrees.max(1);
    first.get(degrees - 1).copied().unwrap_or_else(|| {
        // Wilson and Hilferty: the cube root is nearly normal. Good to three in a thousand here.
        let ninth = 2.0 / (9.0 * degrees as f64);
        degrees as f64 * (1.0 - ninth + normal * ninth.sqrt()).powi(3)
    })
}

/// The chi-squared that a right model exceeds one time in twenty.
pub(super) fn chance(scalars: usize) -> f64 {
    quantile(ONE_IN_TWENTY, scalars)
}

/// An effect with the cells that it may act on; one of several twins.
pub(super) struct AdvanceKind {
    /// At the cell where it fits best.
    pub candidate: Candidate,
    /// Every cell, from 1, at which it brings the model within chance.
    cells: Vec<usize>,
}

impl AdvanceKind {
    /// Whether the advances cannot distinguish between several cells.
    pub fn is_any_cell(&self) -> bool {
        self.cells.len() > 1
    }

    /// Its name, with its cell where that is determined.
    pub fn name(&self) -> String {
        let hypothesised = &self.candidate.hypothesised[0];
        match hypothesised.cell {
            Some(_) if self.is_any_cell() => format!("{} of one cell", hypothesised.effect.name),
            Some(cell) => format!("{} of cell {}", hypothesised.effect.name, cell + 1),
            None => hypothesised.effect.name.to_owned(),
        }
    }
}

/// The outcome.
pub(super) struct Selected {
    pub verdict: Verdict,
    scalars: usize,
    /// What brings the model within chance, likeliest first.
    pub set: Vec<AdvanceKind>,
    /// Probability of each.
    pub probability: Vec<f64>,
    /// What does not, likeliest first.
    pub others: Vec<AdvanceKind>,
    /// The set is one effect, and there are scalars enough to say so.
    pub is_proven: bool,
}

/// Judges every effect that was fitted.
pub(super) fn select_model(table: &Table<'_>, recalibrated: &Fit, mut candidates: Vec<Candidate>) -> Selected {
    let scalars = table.advances.len();
    // Each additional parameter has a cost (Akaike).
    let cost = |candidate: &Candidate| candidate.fit.chi_squared + 2.0 * parameters(candidate) as f64;
    let is_within = |candidate: &Candidate| candidate.fit.chi_squared <= ruled_out(scalars, candidate);
    candidates.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    let mut kinds: Vec<AdvanceKind> = Vec::new();
    for candidate in candidates {
        let cell = candidate.hypothesised[0]
            .cell
            .map(|cell| cell + 1)
            .filter(|_| is_within(&candidate));
        match kinds
            .iter_mut()
            .find(|kind| are_alike(&kind.candidate.hypothesised[0], &candidate.hypothesised[0]))
        {
            Some(kind) => kind.cells.extend(cell),
            None => kinds.push(AdvanceKind {
                candidate,
                cells: cell.into_iter().collect(),
            }),
        }
    }
    let agrees = recalibrated.chi_squared <= chance(scalars);
    let min = kinds.first().map_or(0.0, |kind| cost(&kind.candidate));
    let weight = |kind: &AdvanceKind| (-0.5 * (cost(&kind.candidate) - min)).exp();
    let whole: f64 = kinds.iter().map(weight).sum();
    kinds.iter_mut().for_each(|kind| kind.cells.sort_unstable());
    let (set, others): (Vec<AdvanceKind>, Vec<AdvanceKind>) = kinds
        .into_iter()
        .partition(|kind| !agrees && is_within(&kind.candidate));
    let is_proven = matches!(&set[..], [only] if scalars > asked(only) && !only.is_any_cell());
    Selected {
        verdict: match &set[..] {
            _ if agrees => Verdict::Agrees,
            [] => Verdict::OutsideLibrary,
            _ if is_proven => Verdict::Explained,
            _ => Verdict::Ambiguous,
        },
        scalars,
        probability: set.iter().map(|kind| weight(kind) / whole).collect(),
        set,
        others,
        is_proven,
    }
}

/// The chi-squared that rules an effect out.
fn ruled_out(scalars: usize, candidate: &Candidate) -> f64 {
    quantile(ONE_IN_A_HUNDRED, scalars.saturating_sub(parameters(candidate)))
}

fn parameters(candidate: &Candidate) -> usize {
    candidate.hypothesised[0].effect.parameters.len()
}

/// Quantities that the scalars have to determine; more scalars than these prove an effect.
fn asked(kind: &AdvanceKind) -> usize {
    COMMON + parameters(&kind.candidate)
}

fn are_alike(one: &Hypothesised, other: &Hypothesised) -> bool {
    one.effect.name == other.effect.name || one.is_twin_of(other)
}

impl Selected {
    /// The outcome in a sentence or two.
    pub fn sentence(&self, recalibrated: &Fit) -> String {
        let scalars = self.scalars;
        match (self.verdict, &self.set[..]) {
            (Verdict::Agrees, _) => format!(
                "Model and advances agree once the model is recalibrated within its priors: its chi-squared is {:.1}, and chance \
                 stays below {:.1} nineteen times in twenty.",
                recalibrated.chi_squared,
                chance(scalars)
            ),
            (Verdict::Explained, [only, ..]) => format!(
                "{} brings the model within chance of all {scalars} advances, and no other effect of the library does.",
                only.name()
            ),
            (_, [only]) => format!(
                "Of the library only {} brings the model within chance of the {scalars} advances, but so few cannot prove it: more \
                 than {} are needed for what a worm and this effect leave open{}.",
                only.name(),
                asked(only),
                if only.is_any_cell() { ", and they do not determine the cell" } else { "" }
            ),
            (_, [_, ..]) => format!(
                "The recalibrated model misses the {scalars} advances by more than chance, and each of {} effects alone would close \
                 the gap: {}. {scalars} scalars cannot decide between them.",
                self.set.len(),
                self.set.iter().map(AdvanceKind::name).collect::<Vec<_>>().join(", ")
            ),
            (_, []) => format!(
                "Model and advances disagree, and no single effect of the library brings the model within chance{}.",
                self.others.first().map_or_else(String::new, |kind| format!(
                    ": {} comes nearest, with a chi-squared of {:.1} where a right model's stays below {:.1} ninety-nine times in a \
                     hundred",
                    kind.name(),
                    kind.candidate.fit.chi_squared,
                    ruled_out(scalars, &kind.candidate)
                ))
            ),
        }
    }

    /// What no effect explains.
    pub fn remainder(&self, table: &Table<'_>, recalibrated: &Fit) -> Option<Remainder> {
        if self.verdict != Verdict::OutsideLibrary {
            return None;
        }
        let best = self.others.first().map_or(recalibrated, |kind| &kind.candidate.fit);
        let off = table.advances.iter().zip(&best.residual).map(|(advance, sigmas)| {
            let off_mm = -sigmas * advance.sigma_m * 1e3;
            format!("{off_mm:+.2} mm at {}°", advance.slope_deg).replace('-', "−")
        });
        Some(Remainder {
            description: format!(
                "the worm's advance beyond that of the nearest model is {}",
                off.collect::<Vec<_>>().join(", ")
            ),
            open_share: best.chi_squared / recalibrated.chi_squared,
            onset: None,
            period_cycles: None,
            period_m: None,
            places: Vec::new(),
        })
    }

    /// Limitations of the answer; `fit` is what goes into the model.
    pub fn warnings(&self, fit: &Fit) -> Vec<String> {
        let mut warnings = vec![
            "advances alone: nothing is known of what happens within a cycle, nothing could be held out, and what shows there only, \
             or leaves no steady crawl, was not trial_values; all rests on the standard errors as given"
                .to_owned(),
        ];
        warnings.extend(self.set.iter().filter(|kind| kind.is_any_cell()).map(|kind| {
            format!(
                "{}: the advances do not determine which; the values are those of the best of cells {:?}",
                kind.name(),
                kind.cells
            )
        }));
        let at_limit = (0..fit.hypothesis.free.len())
            .filter(|&at| matches!(fit.hypothesis.free[at].what, What::Nuisance(_)) && fit.would_go_beyond(at))
            .count();
        if at_limit > 0 {
            warnings.push(format!(
                "{at_limit} of the recalibrated values lie at the end of what their priors allow: see the calibration"
            ));
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_beyond_the_table_go_on_as_in_it() {
        for (at, degrees, expected) in [
            (ONE_IN_TWENTY, 0, 3.841),
            (ONE_IN_TWENTY, 8, 15.507),
            (ONE_IN_TWENTY, 9, 16.919),
            (ONE_IN_TWENTY, 30, 43.773),
            (ONE_IN_A_HUNDRED, 9, 21.666),
            (ONE_IN_A_HUNDRED, 30, 50.892),
        ] {
            let found = quantile(at, degrees);
            assert!(
                (found / expected - 1.0).abs() < 3e-3,
                "{degrees}: {found}, not {expected}"
            );
        }
    }
}
