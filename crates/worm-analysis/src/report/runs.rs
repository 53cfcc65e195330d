//! The runs of a report: what they are called, and sentences over all of them.

use super::number;
use crate::experiment::Analysis;

/// The runs in the order given, each with a short name.
#[derive(Debug, Clone, Copy)]
pub(super) struct Runs<'a>(pub &'a [Analysis]);

impl<'a> Runs<'a> {
    /// Each run with its name: its slope, with its number before it where slopes occur twice.
    pub fn named(self) -> impl Iterator<Item = (String, &'a Analysis)> {
        self.names().into_iter().zip(self.0)
    }

    /// The names alone.
    pub fn names(self) -> Vec<String> {
        names_by_slope(self.0.iter().map(|run| run.slope_deg))
    }

    /// Number of cells of the worm.
    pub fn cells(self) -> usize {
        self.0.first().map_or(0, |run| run.cells)
    }

    /// What `tell` says of each run, in words: `6.8 mm at 0° and 4.6 mm at 30°`. Runs of which it says nothing are left
    /// out; what is the same for all is said once.
    pub fn tell(self, mut tell: impl FnMut(&Analysis) -> Option<String>) -> String {
        told(&self.names(), self.0.iter().map(&mut tell))
    }

    /// Where theory cannot say anything of the identified worm, as a clause to end a sentence with; empty where it can
    /// everywhere.
    pub fn without_theory(self) -> String {
        let slides_down = self.tell(|run| {
            let is_none = run.theory.identified.is_none();
            is_none.then(|| "the identified worm slides down in theory".to_owned())
        });
        if slides_down.is_empty() {
            slides_down
        } else {
            format!("; {slides_down}")
        }
    }
}

/// What is said of each of the runs with these names, in words; see [`Runs::tell`].
pub(super) fn told(names: &[String], said: impl IntoIterator<Item = Option<String>>) -> String {
    let said: Vec<Option<String>> = said.into_iter().collect();
    if let [first, rest @ ..] = &said[..]
        && rest.iter().all(|other| other == first)
    {
        return first.clone().unwrap_or_default();
    }
    let named = said.into_iter().zip(names);
    let parts: Vec<String> = named
        .filter_map(|(said, name)| said.map(|said| format!("{said} at {name}")))
        .collect();
    number::in_words(&parts)
}

/// A short name for each of several runs: its slope, with its number before it where slopes occur twice.
pub(super) fn names_by_slope(slopes_deg: impl IntoIterator<Item = f64>) -> Vec<String> {
    let slopes: Vec<String> = slopes_deg.into_iter().map(slope).collect();
    let is_alone = |slope: &String| slopes.iter().filter(|other| *other == slope).count() == 1;
    let numbered = slopes.iter().enumerate().map(|(number, slope)| {
        if is_alone(slope) {
            slope.clone()
        } else {
            format!("run {} ({slope})", number + 1)
        }
    });
    numbered.collect()
}

/// A slope with as few decimals as it needs.
pub(super) fn slope(slope_deg: f64) -> String {
    let decimals = (0..=2)
        .find(|decimals| (slope_deg * 10f64.powi(*decimals)).fract().abs() < 1e-6)
        .unwrap_or(2);
    format!("{}°", number::fixed(slope_deg, decimals as usize))
}
