//! Effects with an onset, tried as they are: what first order promises of a strong effect, or of when it begins, is little to go by.

use super::super::fit::Fit;
use super::super::hypothesis::Hypothesis;
use super::super::judgement::Judge;
use super::super::parameter::{Hypothesised, Onset};
use super::super::plant::Plant;
use super::super::score_test::{Screening, strong};
use super::{Promising, STRENGTH};
use rayon::prelude::*;

/// Effects of which every probable onset is tried.
const TRIED: usize = 12;
/// How often a strength is halved, and by how much an effect is tried earlier and later, cycles.
const HALVINGS: usize = 3;
const ASIDE: f64 = 0.5;

/// An effect as it was tried.
struct TriedOut {
    chi_squared: f64,
    onset: Onset,
    values: Vec<f64>,
}

/// The best effects, each with the onset and the strength that fit best as they are: first order promises strong effects too much, and may have
/// them begin elsewhere, so each is tried where the data seem to `change`, too.
pub(super) fn try_out(
    judge: &Judge<'_, impl Plant>,
    fit: &Fit,
    mut promising: Vec<Promising>,
    change: Option<Onset>,
    count: usize,
) -> Vec<Screening> {
    promising.truncate(TRIED);
    let tried = promising.into_par_iter().filter_map(|one| {
        let effect = one.screening.hypothesised.effect;
        let neutral = effect.severity().neutral;
        let evaluate = |onset: Onset, values: Vec<f64>| {
            let hypothesised = Hypothesised {
                onset: Some(onset),
                ..one.screening.hypothesised
            };
            let hypothesis = Hypothesis::new(&fit.hypothesis.free, &[hypothesised]);
            let at = [&fit.at[..], &values].concat();
            let chi_squared = judge.problem.evaluate(&hypothesis, at).chi_squared;
            TriedOut {
                chi_squared,
                onset,
                values,
            }
        };
        // Half as strong as long as that fits better.
        let weakened = |(onset, values): (Onset, Vec<f64>)| {
            let mut best = evaluate(onset, values);
            for _ in 0..HALVINGS {
                let mut half = best.values.clone();
                half[0] = neutral + 0.5 * (half[0] - neutral);
                let weaker = evaluate(onset, half);
                if weaker.chi_squared >= best.chi_squared {
                    break;
                }
                best = weaker;
            }
            best
        };
        let at_change = change.into_iter().flat_map(|onset| {
            let starts = strong(effect, &[STRENGTH]).into_iter();
            starts.map(move |values| (onset, values))
        });
        let starts = one.each.iter().map(|(_, onset, values)| (*onset, values.clone()));
        let better = |a: &TriedOut, b: &TriedOut| a.chi_squared.total_cmp(&b.chi_squared);
        let nearest = starts.chain(at_change).map(weakened).min_by(better)?;
        let aside = [-ASIDE, ASIDE].map(|by| evaluate(nearest.onset.moved(by), nearest.values.clone()));
        let best = aside.into_iter().chain([nearest]).min_by(better)?;
        let hypothesised = Hypothesised {
            onset: Some(best.onset),
            ..one.screening.hypothesised
        };
        let screening = Screening {
            hypothesised,
            starts: vec![best.values],
            ..one.screening.clone()
        };
        Some((best.chi_squared, screening))
    });
    let mut tried: Vec<(f64, Screening)> = tried.collect();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    tried.into_iter().map(|(_, screening)| screening).take(count).collect()
}
