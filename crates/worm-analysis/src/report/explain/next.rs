//! The next experiment: what to change, and what each candidate says will happen.

use super::words::{clause, readable};
use crate::explain::answer::{ExperimentChange, NextExperiment, RunChange};
use crate::explain::{Answer, Verdict};
use crate::report::number::{fixed, significant};
use crate::report::page::Page;
use crate::report::table::Table;

/// Standard deviations between predictions from which one experiment will usually settle it.
const SETTLES: f64 = 3.0;

pub(super) fn add(page: &mut Page, answer: &Answer) {
    let Some(next) = &answer.next_experiment else {
        let why = match answer.verdict {
            Verdict::Agrees => "No experiment is proposed: nothing is open.",
            Verdict::Explained => "No experiment is proposed: one answer explains the data, up to its exact twins.",
            Verdict::Ambiguous | Verdict::OutsideLibrary => {
                "More is open than these recordings settle, but the search gave no proposal."
            }
        };
        page.paragraph(why);
        return;
    };
    page.paragraph(&format!("{}.", clause(&next.description)));
    page.paragraph(&format!("{}{}", setting(next), separation(next)));
    if next.predictions.is_empty() {
        page.paragraph("What each candidate predicts of it cannot be said beforehand.");
    } else {
        page.table(&predictions(next));
    }
}

fn setting(next: &NextExperiment) -> String {
    match next.value {
        Some(value) => {
            let (what, value, unit) = match next.change {
                ExperimentChange::Run(RunChange::Slope) => ("slope", value, "°"),
                ExperimentChange::Run(RunChange::Cycle) => ("time of a gait cycle", value, " s"),
                ExperimentChange::Run(RunChange::Payload) => ("known extra mass", value * 1e3, " g"),
                ExperimentChange::Run(RunChange::Start) => ("start shifted along the canal by", value * 1e3, " mm"),
                ExperimentChange::Run(RunChange::Cycles) => ("gait cycles", value, ""),
                ExperimentChange::Run(RunChange::Dwell) => ("rest between the cycles", value, " s"),
                ExperimentChange::Measurement(what) => return in_unit(what, value, &next.unit),
            };
            let value = if value.fract() == 0.0 {
                fixed(value, 0)
            } else {
                significant(value, 3)
            };
            format!("What to change: {what} {value}{unit}.")
        }
        None => {
            let what = match next.change {
                ExperimentChange::Measurement(what) => what,
                ExperimentChange::Run(_) => "",
            };
            format!("What to measure: {}.", clause(what))
        }
    }
}

fn in_unit(change: &str, value: f64, unit: &str) -> String {
    let (factor, unit) = readable(unit);
    let text = format!("What to change: {change} {} {unit}", significant(value * factor, 3));
    format!("{}.", text.trim_end())
}

fn separation(next: &NextExperiment) -> String {
    let Some(sigma) = next.separation_sigma.filter(|sigma| sigma.is_finite()) else {
        return String::new();
    };
    let will = if sigma >= SETTLES {
        "that should settle it"
    } else {
        "that alone may not settle it, and repeating it helps"
    };
    format!(
        " The two nearest predictions lie {} standard deviations apart: {will}.",
        fixed(sigma, 1)
    )
}

fn predictions(next: &NextExperiment) -> Table {
    let mut table = Table::new(
        "What each candidate predicts",
        ["candidate", "in words", "advance, mm a cycle"],
    );
    table.word_columns = 2;
    for prediction in &next.predictions {
        let advance_m = prediction.advance_m.unwrap_or(f64::NAN);
        table.rows.push(vec![
            prediction.effect.clone(),
            prediction.description.clone(),
            fixed(advance_m * 1e3, 3),
        ]);
    }
    table
}
