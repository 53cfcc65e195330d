//! An outcome as the terminal shows it: at most 120 columns, numbers under each other, units in the heads.

use super::attribution::meaning;
use super::{Durations, Measure, Outcome, Tick};
use crate::realtime::machine::Setting;
use std::fmt;
use worm_estimator::number::{NONE, count, fixed, percent, shortest};

/// Columns of the terminal that are used.
const WIDTH: usize = 120;
/// What stands where nothing was measured.
const NOT_MEASURED: &str = "not measured";

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            wrapped(&self.headline, 0),
            wrapped(&run(self), 0),
            measures(self),
            culprits(self),
            worst_ticks(self),
            settings(&self.settings),
            rates(self),
            machine(self),
            warnings(&self.warnings),
        ];
        let told: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        f.write_str(&told.join("\n\n"))
    }
}

/// What was run, and what it took.
fn run(outcome: &Outcome) -> String {
    let load = if outcome.load { "under load" } else { "without load" };
    let memory = if outcome.memory_locked { "locked" } else { "not locked" };
    let fraction = |fraction: f64| match percent(fraction) {
        none if none == NONE => NOT_MEASURED.to_owned(),
        told => told,
    };
    let overruns = match outcome.ticks {
        0 => format!("overruns {NOT_MEASURED}"),
        _ => format!(
            "{} overruns, {} of wormd's own doing",
            outcome.overruns, outcome.overruns_of_product
        ),
    };
    format!(
        "{} on {}: {} ticks at {} Hz in {} s {load}, {overruns}. Scheduler {}, memory {memory}. Share of one CPU: controller \
         {}, bare sleeper {}, estimator {}.",
        outcome.worm,
        outcome.port,
        outcome.ticks,
        shortest(outcome.rate_hz),
        shortest(outcome.duration_s),
        outcome.scheduler,
        fraction(outcome.controller_cpu_share),
        fraction(outcome.floor_cpu_share),
        fraction(outcome.estimator_cpu_share),
    )
}

fn measures(outcome: &Outcome) -> String {
    let head = ["µs", "p50", "p90", "p99", "p99.9", "max", "count", "× p50", "× p99"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for measure in outcome.measures() {
        rows.push(measure_row(measure.name.to_owned(), measure.durations));
        if let Some((name, floor)) = measure.floor {
            let mut row = measure_row(format!("  {name}"), floor);
            row.extend(ratios(&measure));
            rows.push(row);
        }
    }
    format!(
        "{}\n{}",
        aligned(&rows, 1, 0),
        wrapped(
            "×: wormd's as a multiple of the floor's below it, which was measured in the same run with the same priority.",
            0
        )
    )
}

fn measure_row(name: String, durations: &Durations) -> Vec<String> {
    let mut row = vec![name];
    match durations.measured() {
        Some(us) => {
            row.extend([us.p50, us.p90, us.p99, us.p99_9, us.max].map(|us| fixed(us, 1)));
            row.push(durations.count().to_string());
        }
        None => {
            row.extend([NONE; 5].map(str::to_owned));
            row.push(NOT_MEASURED.to_owned());
        }
    }
    row
}

/// At the median and at the 99th percentile.
fn ratios(measure: &Measure<'_>) -> [String; 2] {
    [measure.ratio(|us| us.p50), measure.ratio(|us| us.p99)].map(|ratio| fixed(ratio.unwrap_or(f64::NAN), 2))
}

fn culprits(outcome: &Outcome) -> String {
    let blamed = outcome.blamed();
    let late: u64 = blamed.iter().map(|(_, ticks)| ticks).sum();
    if late == 0 {
        return match outcome.ticks {
            0 => format!("late ticks: {NOT_MEASURED}"),
            _ => "no tick ended after the next deadline".to_owned(),
        };
    }
    let mut rows = vec![["late by culprit", "ticks", "share", ""].map(str::to_owned).to_vec()];
    rows.extend(blamed.into_iter().map(|(culprit, ticks)| {
        vec![
            format!("  {culprit}"),
            ticks.to_string(),
            percent(ticks as f64 / late as f64),
            meaning(culprit).to_owned(),
        ]
    }));
    aligned(&rows, 1, 1) + &host_pauses(outcome)
}

fn host_pauses(outcome: &Outcome) -> String {
    match outcome.host_pauses {
        pauses if pauses.count > 0 => format!("\n{pauses}"),
        _ => String::new(),
    }
}

fn worst_ticks(outcome: &Outcome) -> String {
    let ticks = outcome.worst_ticks.ticks();
    if ticks.is_empty() {
        return format!("worst ticks: {NOT_MEASURED}");
    }
    let head = [
        "worst ticks, µs",
        "total",
        "wake",
        "bus",
        "compute",
        "publish",
        "notify",
        "culprit",
        "evidence",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(ticks.iter().map(|tick| {
        let parts = [
            tick.total_us(),
            tick.wake_us,
            tick.bus_us,
            tick.compute_us,
            tick.publish_us,
            tick.notify_us,
        ];
        let mut row = vec![format!("  {}", tick.sequence)];
        row.extend(parts.map(|us| fixed(us, 1)));
        row.extend([tick.culprit.to_string(), evidence(tick)]);
        row
    }));
    aligned(&rows, 1, 2)
}

/// What was found besides the clock in a late tick.
fn evidence(tick: &Tick) -> String {
    if !tick.late {
        return "in time".to_owned();
    }
    let mut found = Vec::new();
    if tick.waited_us > 0.0 {
        found.push(format!("no CPU {}", fixed(tick.waited_us, 0)));
    }
    if tick.stolen_us > 0.0 {
        found.push(format!("stolen {}", fixed(tick.stolen_us, 0)));
    }
    if tick.page_faults > 0 {
        found.push(count(tick.page_faults as usize, "fault"));
    }
    found.join(", ")
}

/// What was in force: first what is not as it should be, with what to do about it.
fn settings(settings: &[Setting]) -> String {
    if settings.is_empty() {
        return String::new();
    }
    let named = settings.iter().map(|setting| setting.subject.chars().count());
    let width = named.max().unwrap_or(0);
    let (good, bad): (Vec<&Setting>, Vec<&Setting>) = settings.iter().partition(|setting| setting.good);
    let mut lines = vec!["settings in force".to_owned()];
    for setting in bad.into_iter().chain(good) {
        let mark = if setting.good { "good" } else { "BAD " };
        let begin = format!("  {mark}  {:<width$}  ", setting.subject);
        let indent = begin.chars().count();
        lines.push(begin + wrapped(&setting.found, indent).trim_start());
        if let Some(remedy) = setting.remedy.as_deref().filter(|_| !setting.good) {
            lines.push(wrapped(&format!("→ {remedy}"), indent));
        }
    }
    lines.join("\n")
}

fn rates(outcome: &Outcome) -> String {
    if outcome.rate_trials.is_empty() {
        return format!("highest sustained rate: {NOT_MEASURED}");
    }
    let highest = outcome.highest_rate_hz.map_or_else(
        || "none of those tried".to_owned(),
        |rate_hz| format!("{} Hz", shortest(rate_hz)),
    );
    let mut rows = vec![
        ["rates tried, Hz", "ticks", "overruns", "failed exchanges", ""]
            .map(str::to_owned)
            .to_vec(),
    ];
    rows.extend(outcome.rate_trials.iter().map(|trial| {
        vec![
            format!("  {}", shortest(trial.rate_hz)),
            trial.ticks.to_string(),
            trial.overruns.to_string(),
            trial.failed_exchanges.to_string(),
            if trial.sustained { "sustained" } else { "not sustained" }.to_owned(),
        ]
    }));
    format!("highest sustained rate: {highest}\n{}", aligned(&rows, 1, 1))
}

/// What cyclictest says, where it ran.
fn machine(outcome: &Outcome) -> String {
    let Some(found) = &outcome.cyclictest else {
        return String::new();
    };
    wrapped(
        &format!(
            "cyclictest, µs: min {}, mean {}, max {} ({})",
            fixed(found.min_us, 0),
            fixed(found.mean_us, 0),
            fixed(found.max_us, 0),
            found.command
        ),
        0,
    )
}

fn warnings(warnings: &[String]) -> String {
    let lines: Vec<String> = warnings
        .iter()
        .map(|warning| format!("- {}", wrapped(warning, 2).trim_start()))
        .collect();
    if lines.is_empty() {
        return String::new();
    }
    format!("to know when reading this\n{}", lines.join("\n"))
}

/// Text in lines that fit, all of them indented by so many columns; a word that is longer than a line gets one of its own.
fn wrapped(text: &str, indent: usize) -> String {
    let room = WIDTH.saturating_sub(indent);
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    let indent = " ".repeat(indent);
    let lines: Vec<String> = lines.into_iter().map(|line| indent.clone() + &line).collect();
    lines.join("\n")
}

/// Rows with their columns under each other: so many at the beginning and at the end hold words and stand to the left, the
/// numbers between them to the right.
fn aligned(rows: &[Vec<String>], words_first: usize, words_last: usize) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let fields = rows.iter().filter_map(|row| row.get(column));
        fields.map(|field| field.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let holds_words = |column: usize| column < words_first || column + words_last >= columns;
    let line = |row: &Vec<String>| {
        let fields = row.iter().zip(&widths).enumerate().map(|(column, (field, &width))| {
            if holds_words(column) {
                format!("{field:<width$}")
            } else {
                format!("{field:>width$}")
            }
        });
        fields.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}
