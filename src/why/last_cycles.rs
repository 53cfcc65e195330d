//! What `wormd explain` makes of the gait cycles before a stop: the search for an effect that the model misses, on that part of the log.

use super::explanation::LastCycles;
use std::path::Path;
use worm_analysis::experiment::{Progress, RecordedRun};
use worm_analysis::explain::{Options, explain};
use worm_analysis::recording::{OpenOptions, Wanted, open};
use worm_analysis::report::explain::view::View;
use worm_estimator::config::Config;
use worm_estimator::message::{Mode, State};
use worm_log::Log;

/// Fewer whole cycles than this say nothing: the search folds them.
const MIN_CYCLES: f64 = 6.0;
/// More than this say little about the last ones.
const MAX_CYCLES: f64 = 16.0;
/// The first cycle from rest is not like the others.
const FROM_REST_CYCLES: f64 = 1.0;
/// Longest time for which a cell may be out of sight, s.
const MAX_GAP_S: f64 = 0.2;

/// Searches in the cycles before `until_ns`, the moment at which the trouble began.
pub(crate) fn search(log: &Log, config: &Config, until_ns: u64, report: &mut dyn FnMut(f64)) -> LastCycles {
    let span = match Span::before(&log.states, until_ns) {
        Ok(span) => span,
        Err(why_not) => return not(0.0, why_not),
    };
    let options = OpenOptions {
        from_s: Some(span.from_s),
        to_s: Some(span.to_s),
        max_gap_s: MAX_GAP_S,
        axis: None,
        wanted: Wanted::Positions,
    };
    let recording = match open(Path::new(&log.file), &options) {
        Ok(recording) => recording,
        Err(error) => return not(span.cycles, error.to_string()),
    };
    let run = RecordedRun {
        recording: &recording,
        slope_deg: config.canal.slope_deg,
        payload_kg: 0.0,
        cycle_s: None,
    };
    let mut step = |step: Progress| report(step.fraction);
    match explain(&[run], config, &Options::default(), &mut step) {
        Ok(answer) => {
            let view = View::of(&answer);
            LastCycles {
                cycles: span.cycles,
                verdict: Some(format!("{}. {}", view.badge, view.headline)),
                details: Some(view.sentence),
                why_not: None,
            }
        }
        Err(error) => not(span.cycles, error.to_string()),
    }
}

fn not(cycles: f64, why_not: String) -> LastCycles {
    LastCycles {
        cycles,
        why_not: Some(why_not),
        ..LastCycles::default()
    }
}

/// A part of a crawl, on the tracker's clock.
struct Span {
    from_s: f64,
    to_s: f64,
    cycles: f64,
}

impl Span {
    /// The steady crawl that went on until this moment.
    fn before(states: &[State], until_ns: u64) -> Result<Self, String> {
        let end = states.partition_point(|state| state.time_ns < until_ns);
        let is_same_crawl = |pair: &[State]| {
            let [last, state] = pair else { return false };
            state.sequence > last.sequence
                && state.mode == Mode::Crawling.code()
                && last.mode == Mode::Crawling.code()
                && last.goal_velocity_rad_s * state.goal_velocity_rad_s > 0.0
        };
        let before = states.get(..end).unwrap_or_default();
        // The newest crawl, even where the worm has held since.
        let last = before.windows(2).rposition(is_same_crawl);
        let Some(last) = last else {
            return Err("the worm did not crawl before it, as far as the log goes back".to_owned());
        };
        let first = before[..last + 2].windows(2).rposition(|pair| !is_same_crawl(pair));
        let begins_from_rest = first.is_some();
        let crawl = &before[first.map_or(0, |place| place + 1)..last + 2];
        let phases: Vec<(f64, f64)> = crawl
            .iter()
            .filter(|state| state.sample_is_new == 1 && state.phase.is_finite() && state.sample_time_s.is_finite())
            .map(|state| (state.sample_time_s, state.phase))
            .collect();
        let (Some(&(_, begun)), Some(&(to_s, ended))) = (phases.first(), phases.last()) else {
            return Err("the tracker gave no sample in the crawl before it".to_owned());
        };
        let rest = if begins_from_rest { FROM_REST_CYCLES } else { 0.0 };
        let cycles = ((ended - begun).abs() - rest).min(MAX_CYCLES);
        if cycles < MIN_CYCLES {
            return Err(format!(
                "the log holds {:.1} steady gait cycles before it, and the search needs {MIN_CYCLES:.0}",
                cycles.max(0.0)
            ));
        }
        let from = phases.iter().find(|(_, phase)| (ended - phase).abs() <= cycles);
        let from_s = from.map_or(to_s, |(time_s, _)| *time_s);
        Ok(Self { from_s, to_s, cycles })
    }
}
