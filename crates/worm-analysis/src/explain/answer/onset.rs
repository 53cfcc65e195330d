//! When an effect of an answer acts.

use serde::Serialize;

/// When an effect begins or ends that does not act throughout a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundOnset {
    /// Gait cycles since the first sample of the run.
    pub cycle: f64,
    /// Time since the first sample of the run, s; of the first run where it happens in each.
    pub time_s: f64,
    /// The recording in which it happens, once: it lasts in those after it, or acts in those before it. None where it happens in each.
    pub run: Option<String>,
    /// It acts up to then, instead of from then on.
    pub ends: bool,
}

impl FoundOnset {
    /// When it acts, as a clause: `from 5.0 cycles (12.5 s) after the start of run2.csv on`, or `until 5.0 cycles …`.
    pub fn in_words(&self) -> String {
        let run = self
            .run
            .as_ref()
            .map_or_else(|| " of every run".to_owned(), |run| format!(" of {run}"));
        let when = format!("{:.1} cycles ({:.1} s) after the start{run}", self.cycle, self.time_s);
        if self.ends {
            format!("until {when}")
        } else {
            format!("from {when} on")
        }
    }
}
