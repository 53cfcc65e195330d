//! When an effect of an answer acts.

use serde::Serialize;

/// When an effect begins or ends, or does both, that does not act throughout a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundOnset {
    /// Gait cycles since the first sample of the run: where it begins or, with `ends`, where it ends.
    pub cycle: f64,
    /// Time since the first sample of the run, s; of the first run where it happens in each.
    pub time_s: f64,
    /// The recording in which it happens, once: it lasts in those after it, or acts in those before it. None where it happens in each.
    pub run: Option<String>,
    /// It acts up to then, instead of from then on.
    pub ends: bool,
    /// Where it ends again in the same run, gait cycles since the first sample; none where it stays.
    pub until_cycle: Option<f64>,
    /// The same in time, s.
    pub until_s: Option<f64>,
}

impl FoundOnset {
    /// Whether it acts no more at the end.
    pub const fn is_over(&self) -> bool {
        self.ends || self.until_cycle.is_some()
    }

    /// When it acts, as a clause: `from 5.0 cycles (12.5 s) after the start of run2.csv on`, `until 5.0 cycles …`, or `from 3.0 to 8.0
    /// cycles (7.5 to 20.0 s) …`.
    pub fn in_words(&self) -> String {
        let run = self
            .run
            .as_ref()
            .map_or_else(|| " of every run".to_owned(), |run| format!(" of {run}"));
        if let (Some(until_cycle), Some(until_s)) = (self.until_cycle, self.until_s) {
            return format!(
                "from {:.1} to {until_cycle:.1} cycles ({:.1} to {until_s:.1} s) after the start{run}",
                self.cycle, self.time_s
            );
        }
        let when = format!("{:.1} cycles ({:.1} s) after the start{run}", self.cycle, self.time_s);
        if self.ends {
            format!("until {when}")
        } else {
            format!("from {when} on")
        }
    }
}
