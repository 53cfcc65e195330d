//! The runs of a report: their names, and sentences about all of them.

use crate::experiment::Analysis;
use worm_estimator::number;

/// The runs in the order given, each with a short name.
#[derive(Debug, Clone, Copy)]
pub(super) struct Runs<'a>(pub &'a [Analysis]);

impl<'a> Runs<'a> {
    /// Each run with its name: its slope, with its number before it where a slope occurs twice.
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

    /// What `describe` says of each run, in words: `6.8 mm at 0° and 4.6 mm at 30°`. Runs that it has no text for are left
    /// out; a text that is the same for all comes once.
    pub fn describe(self, mut describe: impl FnMut(&Analysis) -> Option<String>) -> String {
        describe_each(&self.names(), self.0.iter().map(&mut describe))
    }

    /// Where theory predicts nothing for the identified worm, as a clause to end a sentence with; empty where it does
    /// everywhere.
    pub fn without_theory(self) -> String {
        let slides_down = self.describe(|run| {
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

/// A text for each of the runs with these names, in words; see [`Runs::describe`].
pub(super) fn describe_each(names: &[String], texts: impl IntoIterator<Item = Option<String>>) -> String {
    let texts: Vec<Option<String>> = texts.into_iter().collect();
    if let [first, rest @ ..] = &texts[..]
        && rest.iter().all(|other| other == first)
    {
        return first.clone().unwrap_or_default();
    }
    let named = texts.into_iter().zip(names);
    let parts: Vec<String> = named
        .filter_map(|(text, name)| Some(format!("{} at {name}", text?)))
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
