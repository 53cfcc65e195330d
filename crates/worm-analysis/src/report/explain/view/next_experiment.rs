//! The next experiment: what to change, and what each candidate predicts.

use super::Block;
use super::quantity::clause;
use crate::explain::answer::{ExperimentChange, NextExperiment, Prediction, RunChange};
use crate::explain::{Answer, Verdict};
use crate::report::page::Table;
use worm_estimator::number::{fixed, significant};

/// Standard deviations between predictions from which one experiment will usually settle it.
const SETTLES: f64 = 3.0;

pub(super) fn blocks(answer: &Answer) -> Vec<Block> {
    let Some(next) = &answer.next_experiment else {
        return vec![Block::paragraph(match answer.verdict {
            Verdict::Agrees => "No experiment is proposed: nothing is open.",
            Verdict::Explained => "No experiment is proposed: one answer explains the data, up to its exact twins.",
            Verdict::Ambiguous | Verdict::OutsideLibrary => {
                "More is open than these recordings settle, but the search gave no proposal."
            }
        })];
    };
    vec![
        Block::Paragraph(format!("{}.", clause(&next.description))),
        Block::Paragraph(format!("{}{}", setting(next), separation(next))),
        match next.predictions.is_empty() {
            true => Block::paragraph("What each candidate predicts of it cannot be said beforehand."),
            false => Block::Table(predictions(&next.predictions)),
        },
    ]
}

fn setting(next: &NextExperiment) -> String {
    let (change, value) = match (next.change, next.value) {
        (ExperimentChange::Run(change), Some(value)) => (change, value),
        (ExperimentChange::Measurement(what), _) => return format!("What to measure: {}.", clause(what)),
        (ExperimentChange::Run(_), None) => return format!("What to change: {}.", clause(&next.description)),
    };
    let (what, factor, unit) = match change {
        RunChange::Slope => ("slope", 1.0, "°"),
        RunChange::Cycle => ("time of a gait cycle", 1.0, " s"),
        RunChange::Payload => ("known extra mass", 1e3, " g"),
        RunChange::Start => ("start shifted along the canal by", 1e3, " mm"),
        RunChange::Cycles => ("gait cycles", 1.0, ""),
        RunChange::Dwell => ("rest between the cycles", 1.0, " s"),
    };
    let value = value * factor;
    let value = match value.fract() {
        0.0 => fixed(value, 0),
        _ => significant(value, 3),
    };
    format!("What to change: {what} {value}{unit}.")
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

fn predictions(predictions: &[Prediction]) -> Table {
    let head = ["candidate", "in words", "advance, mm a cycle"];
    let row = |prediction: &Prediction| {
        vec![
            prediction.effect.clone(),
            prediction.description.clone(),
            fixed(prediction.advance_m.unwrap_or(f64::NAN) * 1e3, 3),
        ]
    };
    Table {
        rows: predictions.iter().map(row).collect(),
        ..Table::new("What each candidate predicts", head).with_word_columns(2)
    }
}
