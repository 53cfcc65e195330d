//! The tables: all numbers, the culprits, the rates that were tried, and the settings.

use super::words::{NOT_MEASURED, times, us};
use crate::latency::attribution::meaning;
use crate::latency::{Durations, Outcome};
use worm_analysis::report::page::{Page, Table};
use worm_estimator::number::{NONE, percent, shortest};

/// Every duration at every percentile, each over its floor.
pub(super) fn measures(outcome: &Outcome) -> Table {
    let head = [
        "",
        "p50",
        "p90",
        "p99",
        "p99.9",
        "max",
        "count",
        "× floor at p50",
        "× floor at p99",
    ];
    let mut table = Table::new("All durations, µs", head);
    for measure in outcome.measures() {
        let ratios = match measure.floor {
            Some(_) => [measure.ratio(|us| us.p50), measure.ratio(|us| us.p99)].map(times),
            None => [String::new(), String::new()],
        };
        table.rows.push(row(measure.name, measure.durations, ratios));
        if let Some((name, floor)) = measure.floor {
            let name = format!("floor: {name}");
            table.rows.push(row(&name, floor, [String::new(), String::new()]));
        }
    }
    table.note = Some(format!("{NONE}: nothing was measured."));
    table
}

fn row(name: &str, durations: &Durations, ratios: [String; 2]) -> Vec<String> {
    let mut row = vec![name.to_owned()];
    match durations.measured() {
        Some(us_at) => {
            row.extend([us_at.p50, us_at.p90, us_at.p99, us_at.p99_9, us_at.max].map(us));
            row.push(durations.count().to_string());
        }
        None => {
            row.extend([NONE; 5].map(str::to_owned));
            row.push(NOT_MEASURED.to_owned());
        }
    }
    row.extend(ratios);
    row
}

/// Late ticks by culprit.
pub(super) fn add_culprits(page: &mut Page, outcome: &Outcome) {
    let blamed = outcome.blamed();
    let late: u64 = blamed.iter().map(|(_, ticks)| ticks).sum();
    if late == 0 {
        page.paragraph(&match outcome.ticks {
            0 => format!("The ticks were {NOT_MEASURED}."),
            _ => "No tick ended after the next deadline.".to_owned(),
        });
        return;
    }
    let head = ["culprit", "what it means", "late ticks", "fraction"];
    let mut table = Table::new("Late ticks by culprit", head);
    table.word_columns = 2;
    let rows = blamed.into_iter().map(|(culprit, ticks)| {
        vec![
            culprit.to_string(),
            meaning(culprit).to_owned(),
            ticks.to_string(),
            percent(ticks as f64 / late as f64),
        ]
    });
    table.rows = rows.collect();
    let pauses = outcome.host_pauses;
    if pauses.count > 0 {
        table.note = Some(format!("{pauses}."));
    }
    page.add(&table);
}

/// The rates that were tried.
pub(super) fn add_rates(page: &mut Page, outcome: &Outcome) {
    if outcome.rate_trials.is_empty() {
        page.paragraph(&format!("The highest sustained rate was {NOT_MEASURED}."));
        return;
    }
    let head = [
        "rate, Hz",
        "sustained",
        "ticks",
        "overruns",
        "fraction missed",
        "failed exchanges",
    ];
    let mut table = Table::new("Rates that were tried", head);
    table.word_columns = 2;
    table.rows = outcome
        .rate_trials
        .iter()
        .map(|trial| {
            let due = trial.ticks + trial.overruns;
            vec![
                shortest(trial.rate_hz),
                if trial.sustained { "yes" } else { "no" }.to_owned(),
                trial.ticks.to_string(),
                trial.overruns.to_string(),
                percent(trial.overruns as f64 / due as f64),
                trial.failed_exchanges.to_string(),
            ]
        })
        .collect();
    page.add(&table);
}

/// The settings that matter, judged, and what cyclictest measured.
pub(super) fn add_settings(page: &mut Page, outcome: &Outcome) {
    if outcome.settings.is_empty() {
        page.paragraph("The settings were not checked.");
    } else {
        let head = ["", "found", "what to do"];
        let mut table = Table::new("What decides how late the loop can be", head);
        table.word_columns = 3;
        let rows = outcome.settings.iter().map(|setting| {
            vec![
                format!("{} {}", if setting.good { "✓" } else { "✗" }, setting.subject),
                setting.found.clone(),
                setting.remedy.clone().unwrap_or_default(),
            ]
        });
        table.rows = rows.collect();
        table.note = Some("✓ as it should be, ✗ not.".to_owned());
        page.add(&table);
    }
    if let Some(found) = &outcome.cyclictest {
        let mut table = Table::new("Wake lateness by cyclictest, µs", ["called as", "min", "mean", "max"]);
        table.rows.push(vec![
            found.command.clone(),
            us(found.min_us),
            us(found.mean_us),
            us(found.max_us),
        ]);
        page.add(&table);
    }
}
