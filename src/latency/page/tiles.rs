//! The head of the page: the most important values, large, against their aims.

use super::words::{NOT_MEASURED, duration, times, with_unit};
use crate::latency::{Durations, Outcome, Percentiles, ratio};
use worm_analysis::report::page::{Tile, TileRow};
use worm_analysis::report::plot::{ACCENT, Colour, GOOD};
use worm_estimator::number::{NONE, count, percent, shortest};

/// Aims for the loop's wake lateness over the bare sleeper's, at the median and the 99th percentile.
const WAKE_AIMS: [f64; 2] = [1.1, 1.25];
/// Aim for computation and publishing at the 99th percentile, µs.
const OWN_WORK_AIM_US: f64 = 20.0;
/// Aim for delivery over that of a bare pair, at the median.
const DELIVERY_AIM: f64 = 1.2;
/// Aim for the controller's share of one CPU.
const CPU_AIM: f64 = 0.05;

type Percentile = fn(&Percentiles) -> f64;

/// What was run, in a sentence.
pub(super) fn lead(outcome: &Outcome) -> String {
    let load = if outcome.load {
        "under the built-in load"
    } else {
        "without load"
    };
    let memory = if outcome.memory_locked { "locked" } else { "not locked" };
    format!(
        "{} on {}: {} in {} s at {} Hz {load}; scheduler {}, memory {memory}.",
        outcome.worm,
        outcome.port,
        count(as_count(outcome.ticks), "tick"),
        shortest(outcome.duration_s),
        shortest(outcome.rate_hz),
        outcome.scheduler
    )
}

/// The rows of tiles.
pub(super) fn rows(outcome: &Outcome) -> Vec<TileRow> {
    let row = |name: &str, note: &str, tiles| TileRow {
        name: name.to_owned(),
        note: note.to_owned(),
        tiles,
        ..TileRow::default()
    };
    let late = "how long after its deadline the loop runs; the floor is a bare sleeper";
    vec![
        row("Wake lateness", late, wake_tiles(outcome)),
        row("The tick", "what it takes, and what it misses", tick_tiles(outcome)),
        row("Listeners", "how soon they know", delivery_tiles(outcome)),
    ]
}

fn wake_tiles(outcome: &Outcome) -> Vec<Tile> {
    let (wake, floor) = (&outcome.wake_us, &outcome.floor_wake_us);
    let [at_p50, at_p99] = WAKE_AIMS;
    vec![
        over_floor("median", wake, floor, |us| us.p50, Some(at_p50)),
        over_floor("99th percentile", wake, floor, |us| us.p99, Some(at_p99)),
        over_floor("largest", wake, floor, |us| us.max, None),
    ]
}

fn tick_tiles(outcome: &Outcome) -> Vec<Tile> {
    let own_work_name = "own work, 99th percentile";
    let own_work = match outcome.own_work_us.measured().map(|us| us.p99) {
        Some(us) => {
            let (value, unit) = duration(us);
            let (dot, verdict) = against_aim(us, OWN_WORK_AIM_US, &format!("{} µs", shortest(OWN_WORK_AIM_US)));
            let how = format!("computation and publishing; {verdict}");
            with_dot(Some(dot), Tile::new(own_work_name, value, unit, how))
        }
        None => not_measured(own_work_name),
    };
    let overruns = if outcome.ticks == 0 {
        not_measured("overruns")
    } else {
        let due = outcome.ticks + outcome.overruns;
        let how = format!(
            "{} of {due} deadlines; {} caused by wormd",
            percent(outcome.overruns as f64 / due as f64),
            outcome.overruns_of_product
        );
        Tile::new("overruns", outcome.overruns.to_string(), "", how)
    };
    vec![own_work, overruns, controller_cpu(outcome), highest_rate(outcome)]
}

fn controller_cpu(outcome: &Outcome) -> Tile {
    let name = "controller's CPU";
    let fraction = outcome.controller_cpu_share;
    let text = percent(fraction);
    if text == NONE {
        return not_measured(name);
    }
    let (dot, verdict) = against_aim(fraction, CPU_AIM, &percent(CPU_AIM));
    let floor = match percent(outcome.floor_cpu_share) {
        none if none == NONE => String::new(),
        floor => format!("; the bare sleeper takes {floor}"),
    };
    let how = format!("of one CPU{floor}; {verdict}");
    with_dot(Some(dot), Tile::new(name, text.trim_end_matches(" %"), "%", how))
}

fn highest_rate(outcome: &Outcome) -> Tile {
    let name = "highest sustained rate";
    match outcome.highest_rate_hz {
        Some(rate_hz) => {
            let how = format!("of {} tried", count(outcome.rate_trials.len(), "rate"));
            Tile::new(name, shortest(rate_hz), "Hz", how)
        }
        None if outcome.rate_trials.is_empty() => not_measured(name),
        None => {
            let how = format!("none of {} tried", count(outcome.rate_trials.len(), "rate"));
            Tile::new(name, NONE, "", how)
        }
    }
}

fn delivery_tiles(outcome: &Outcome) -> Vec<Tile> {
    let alarm = match outcome.alarm_us.measured() {
        Some(us) => {
            let (value, unit) = duration(us.p50);
            let how = format!(
                "from the blocked cam to the woken listener; longest of {} {}",
                count(as_count(outcome.alarm_us.count()), "stall"),
                with_unit(us.max)
            );
            Tile::new("stall to alarm, median", value, unit, how)
        }
        None => not_measured("stall to alarm, median"),
    };
    vec![
        over_floor(
            "delivery to a sleeper, median",
            &outcome.delivery_us,
            &outcome.floor_delivery_us,
            |us| us.p50,
            Some(DELIVERY_AIM),
        ),
        over_floor(
            "delivery to one awake, median",
            &outcome.polled_delivery_us,
            &outcome.floor_polled_delivery_us,
            |us| us.p50,
            Some(DELIVERY_AIM),
        ),
        alarm,
    ]
}

/// A percentile with its ratio to the floor's, against the aim where there is one.
fn over_floor(name: &str, loop_us: &Durations, floor_us: &Durations, of: Percentile, aim: Option<f64>) -> Tile {
    let Some(us) = loop_us.measured() else {
        return not_measured(name);
    };
    let (value, unit) = duration(of(&us));
    let Some(floor) = floor_us.measured() else {
        return Tile::new(name, value, unit, "floor not measured");
    };
    let ratio = ratio(loop_us, floor_us, of);
    let judged = ratio
        .zip(aim)
        .map(|(ratio, aim)| against_aim(ratio, aim, &times(Some(aim))));
    let (dot, verdict) = judged.map_or((None, String::new()), |(dot, verdict)| {
        (Some(dot), format!("; {verdict}"))
    });
    let how = format!("{} × the floor's {}{verdict}", times(ratio), with_unit(of(&floor)));
    with_dot(dot, Tile::new(name, value, unit, how))
}

/// A colour and the words for whether a value reaches its aim.
fn against_aim(value: f64, aim: f64, aim_in_words: &str) -> (Colour, String) {
    let (colour, word) = if value <= aim {
        (GOOD, "met")
    } else {
        (ACCENT, "missed")
    };
    (colour, format!("aim {aim_in_words}: {word}"))
}

fn with_dot(dot: Option<Colour>, tile: Tile) -> Tile {
    Tile { dot, ..tile }
}

fn not_measured(name: &str) -> Tile {
    Tile::new(name, NONE, "", NOT_MEASURED)
}

fn as_count(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}
