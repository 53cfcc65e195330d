//! The head of the page: the answer, large, against what it aims at.

use super::words::{NOT_MEASURED, duration, times, told};
use crate::latency::{Durations, Outcome, Percentiles, ratio};
use worm_analysis::report::page::escaped;
use worm_analysis::report::tile::{Tile, push_row};
use worm_estimator::number::{NONE, count, percent, shortest};

/// Dots before what reaches its aim and what does not: green and red as dark as each other are told apart by the words.
const MET: &str = "#00734f";
const MISSED: &str = "#c8102e";

/// Most that the loop's wake lateness is to be, as a multiple of the bare sleeper's, at the median and the 99th percentile.
const WAKE_AIMS: [f64; 2] = [1.1, 1.25];
/// Most that computation and publishing are to take at the 99th percentile, µs.
const OWN_WORK_AIM_US: f64 = 20.0;
/// Most that delivery is to take, as a multiple of what a bare pair takes, at the median.
const DELIVERY_AIM: f64 = 1.2;
/// Most of one CPU that the controller is to take, as a share.
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
pub(super) fn html(outcome: &Outcome) -> String {
    let mut html = "<section class=\"answer\">".to_owned();
    let wake =
        "<b>Wake lateness</b><small>how long after its deadline the loop runs; the floor is a bare sleeper</small>";
    push_row(&mut html, wake, &wake_tiles(outcome), "");
    let tick = "<b>The tick</b><small>what it takes, and what it misses</small>";
    push_row(&mut html, tick, &tick_tiles(outcome), "");
    let others = "<b>Who listens</b><small>how soon the others know</small>";
    push_row(&mut html, others, &delivery_tiles(outcome), "");
    html.push_str("</section>");
    html
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
    let own = outcome.own_work_us.measured().map(|us| us.p99);
    let own_work = match own {
        Some(us) => {
            let (value, unit) = duration(us);
            let (dot, verdict) = judged(us, OWN_WORK_AIM_US, &format!("{} µs", shortest(OWN_WORK_AIM_US)));
            let how = format!("computation and publishing; {verdict}");
            tile(&format!("{dot}own work, 99th percentile"), value, unit, how)
        }
        None => not_measured("own work, 99th percentile"),
    };
    let overruns = if outcome.ticks == 0 {
        not_measured("overruns")
    } else {
        let due = outcome.ticks + outcome.overruns;
        let how = format!(
            "{} of {due} deadlines; {} of wormd's own doing",
            percent(outcome.overruns as f64 / due as f64),
            outcome.overruns_of_product
        );
        tile("overruns", outcome.overruns.to_string(), "", how)
    };
    vec![own_work, overruns, controller_cpu(outcome), highest_rate(outcome)]
}

fn controller_cpu(outcome: &Outcome) -> Tile {
    let fraction = outcome.controller_cpu_share;
    let text = percent(fraction);
    if text == NONE {
        return not_measured("controller's CPU");
    }
    let (dot, verdict) = judged(fraction, CPU_AIM, &percent(CPU_AIM));
    let floor = match percent(outcome.floor_cpu_share) {
        none if none == NONE => String::new(),
        floor => format!("; the bare sleeper takes {floor}"),
    };
    let value = text.trim_end_matches(" %").to_owned();
    let how = format!("of one CPU{floor}; {verdict}");
    tile(&format!("{dot}controller's CPU"), value, "%", how)
}

fn highest_rate(outcome: &Outcome) -> Tile {
    let name = "highest sustained rate";
    match outcome.highest_rate_hz {
        Some(rate_hz) => {
            let how = format!("of {} tried", count(outcome.rate_trials.len(), "rate"));
            tile(name, shortest(rate_hz), "Hz", how)
        }
        None if outcome.rate_trials.is_empty() => not_measured(name),
        None => tile(
            name,
            NONE.to_owned(),
            "",
            format!("none of {} tried", count(outcome.rate_trials.len(), "rate")),
        ),
    }
}

fn delivery_tiles(outcome: &Outcome) -> Vec<Tile> {
    let alarm = match outcome.alarm_us.measured() {
        Some(us) => {
            let (value, unit) = duration(us.p50);
            let how = format!(
                "from the blocked cam to the woken listener; longest of {} {}",
                count(as_count(outcome.alarm_us.count()), "stall"),
                told(us.max)
            );
            tile("stall to alarm, median", value, unit, how)
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
        return tile(name, value, unit, "floor not measured".to_owned());
    };
    let ratio = ratio(loop_us, floor_us, of);
    let (dot, verdict) = match (ratio, aim) {
        (Some(ratio), Some(aim)) => {
            let (dot, verdict) = judged(ratio, aim, &times(Some(aim)));
            (dot, format!("; {verdict}"))
        }
        _ => (String::new(), String::new()),
    };
    let how = format!("{} × the floor's {}{verdict}", times(ratio), told(of(&floor)));
    tile(&format!("{dot}{}", escaped(name)), value, unit, how)
}

/// A dot, which is HTML, and the words for whether a value is within its aim.
fn judged(value: f64, aim: f64, aim_in_words: &str) -> (String, String) {
    let (colour, word) = if value <= aim { (MET, "met") } else { (MISSED, "missed") };
    (
        format!("<i style=\"--c:{colour}\"></i>"),
        format!("aim {aim_in_words}: {word}"),
    )
}

fn not_measured(name: &str) -> Tile {
    tile(name, NONE.to_owned(), "", NOT_MEASURED.to_owned())
}

/// A tile; `name` is HTML already.
fn tile(name: &str, value: String, unit: &str, how: String) -> Tile {
    Tile {
        name: name.to_owned(),
        value,
        unit: unit.to_owned(),
        how,
    }
}

fn as_count(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}
