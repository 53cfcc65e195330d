//! What `wormd explain` makes of the gait cycles before a stop: the search for an effect that the model misses, on that part of the log.

use super::answer::LastCycles;
use std::path::Path;
use worm_analysis::experiment::{Progress, RecordedRun};
use worm_analysis::explain::{Evidence, Options, explain};
use worm_analysis::recording::{OpenOptions, Wanted, open};
use worm_analysis::report::explain::view::View;
use worm_estimator::config::Config;
use worm_estimator::estimate::MotorTime;
use worm_estimator::message::{Mode, State};
use worm_log::Log;

/// Fewer whole cycles than this say nothing: the search folds them.
const MIN_CYCLES: f64 = 6.0;
/// More than this say little about the last ones.
const MAX_CYCLES: f64 = 16.0;
/// The first cycle from rest is not like the others.
const FROM_REST_CYCLES: f64 = 1.0;
/// A tracker that gave its last sample so many cycles before the end has died on the way.
const SEEN_UNTIL_CYCLES: f64 = 0.5;
/// Longest time for which a cell may be out of sight, s.
const MAX_GAP_S: f64 = 0.2;

/// Searches in the cycles before `until_ns`, the moment at which the trouble began.
pub(crate) fn search(log: &Log, config: &Config, until_ns: u64, report: &mut dyn FnMut(f64)) -> LastCycles {
    let span = match Span::before(&log.states, until_ns) {
        Ok(span) => span,
        Err(why_not) => return not(0.0, why_not),
    };
    let (wanted, evidence) = match span.clock {
        Clock::Tracker => (Wanted::Positions, Evidence::Positions),
        Clock::Motor => (
            Wanted::Motor {
                window_s: Wanted::USUAL_WINDOW_S,
            },
            Evidence::CurrentAlone,
        ),
    };
    let options = OpenOptions {
        from_s: Some(span.from_s),
        to_s: Some(span.to_s),
        max_gap_s: MAX_GAP_S,
        axis: None,
        wanted,
        cells: None,
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
    let search = Options {
        evidence,
        ..Options::default()
    };
    let mut step = |step: Progress| report(step.fraction);
    match explain(&[run], config, &search, &mut step) {
        Ok(answer) => {
            let view = View::of(&answer);
            let by_what = match span.clock {
                Clock::Tracker => "",
                Clock::Motor => " It goes by the motor's current alone, for nobody saw the cells.",
            };
            LastCycles {
                cycles: span.cycles,
                verdict: Some(format!("{}. {}{by_what}", view.badge, view.headline)),
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

/// What the time of a recording is by: the tracker's captures or, where it gave none at the end, the readings of the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Clock {
    Tracker,
    Motor,
}

/// A part of a crawl.
struct Span {
    clock: Clock,
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
        let from = first.map_or(0, |place| place + 1);
        let by_motor = phases_by_motor(&before[..last + 2], from);
        let by_tracker = phases_by_tracker(&before[from..last + 2]);
        let ended = |phases: &[(f64, f64)]| phases.last().map_or(f64::NEG_INFINITY, |(_, phase)| *phase);
        let is_seen = (ended(&by_tracker) - ended(&by_motor)).abs() < SEEN_UNTIL_CYCLES || by_motor.is_empty();
        let (clock, phases) = if is_seen {
            (Clock::Tracker, by_tracker)
        } else {
            (Clock::Motor, by_motor)
        };
        let (Some(&(_, begun)), Some(&(to_s, ended))) = (phases.first(), phases.last()) else {
            return Err("neither tracker nor motor was read in the crawl before it".to_owned());
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
        Ok(Self {
            clock,
            from_s,
            to_s,
            cycles,
        })
    }
}

/// Times of the captures in a crawl, s, with the phase of the tick that brought each.
fn phases_by_tracker(crawl: &[State]) -> Vec<(f64, f64)> {
    crawl
        .iter()
        .filter(|state| state.sample_is_new == 1 && state.phase.is_finite() && state.sample_time_s.is_finite())
        .map(|state| (state.sample_time_s, state.phase))
        .collect()
}

/// Times of the readings of the motor in a crawl that begins at some state, s, as a recording of them has it, with their phases.
fn phases_by_motor(states: &[State], crawl_from: usize) -> Vec<(f64, f64)> {
    let mut lived = MotorTime::default();
    let mut last_tick = 0;
    let mut phases = Vec::new();
    for (number, state) in states.iter().enumerate() {
        // The clocks of a controller that was started again begin again.
        if state.sequence < last_tick {
            lived = MotorTime::default();
        }
        last_tick = state.sequence;
        let time_s = lived.update(state) as f64 * 1e-9;
        if number >= crawl_from && state.motor_is_new == 1 && state.phase.is_finite() {
            phases.push((time_s, state.phase));
        }
    }
    phases
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::crawl::{Crawl, Scene, paper_worm};

    const CYCLES_PER_S: f64 = 0.5;
    const TICK_HZ: f64 = 200.0;

    /// A crawl of 20 s which the tracker, whose clock begins elsewhere, sees up to some time, s.
    fn crawl(seen_until_s: f64) -> Vec<State> {
        let scene = Scene {
            tick_hz: TICK_HZ,
            ripple: 0.0,
            noise_m: 0.0,
            cycles_per_s: CYCLES_PER_S,
            ..Scene::default()
        };
        let mut crawl = Crawl::new(paper_worm(0.0, false), scene);
        let state = |tick: usize| {
            let mut state = crawl.tick();
            (state.mode, state.goal_velocity_rad_s) = (Mode::Crawling.code(), 1.0);
            if tick as f64 > seen_until_s * TICK_HZ {
                state.sample_is_new = 0;
            }
            state
        };
        (0..(20.0 * TICK_HZ) as usize).map(state).collect()
    }

    #[test]
    fn the_last_cycles_are_on_the_clock_of_what_saw_them() {
        for (seen_until_s, expected) in [(20.0, Clock::Tracker), (-1.0, Clock::Motor), (12.0, Clock::Motor)] {
            let states = crawl(seen_until_s);
            let trouble_ns = states[3600].time_ns; // after 18 s
            let span = Span::before(&states, trouble_ns).expect("it crawled");
            assert_eq!(span.clock, expected, "seen until {seen_until_s} s");
            let cycles = (span.to_s - span.from_s) * CYCLES_PER_S;
            assert!(
                (cycles - 9.0).abs() < 0.05 && (span.cycles - cycles).abs() < 0.05,
                "{cycles}"
            );
            let trouble_s = match expected {
                Clock::Tracker => states[3599].sample_time_s,
                Clock::Motor => trouble_ns as f64 * 1e-9,
            };
            assert!((span.to_s - trouble_s).abs() < 0.02, "{} and {trouble_s} s", span.to_s);
        }
    }

    #[test]
    fn a_crawl_too_short_is_none() {
        let states = crawl(-1.0);
        let error = Span::before(&states, states[1000].time_ns).err().expect("it is short");
        assert!(error.contains("2.5 steady gait cycles"), "{error}");
    }
}
