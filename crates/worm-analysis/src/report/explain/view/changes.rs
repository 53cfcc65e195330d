//! What changes in the model: the recalibrated values, and its text before and after.

use super::quantity::readable;
use super::{Block, DifferenceLine, LineKind};
use crate::explain::Answer;
use crate::explain::answer::Calibrated;
use crate::report::page::Table;
use worm_estimator::number::{NONE, count, fixed, in_words, significant, to_error};

pub(super) fn calibration_blocks(answer: &Answer) -> Vec<Block> {
    if answer.calibration.is_empty() {
        return vec![Block::paragraph("The answer lists no quantity that was recalibrated.")];
    }
    let why = "Before anything is called missing, the quantities that are only known so well may move within their priors. Only \
               what remains then is a gap.";
    vec![Block::paragraph(why), Block::Table(calibration(&answer.calibration))]
}

fn calibration(calibrated: &[Calibrated]) -> Table {
    let head = ["", "unit", "nominal", "found", "change", "within its prior"];
    let row = |value: &Calibrated| {
        let (factor, unit) = match value.unit {
            "" => (1.0, "×"),
            unit => readable(unit),
        };
        vec![
            value.name.clone(),
            unit.to_owned(),
            significant(value.nominal * factor, 4),
            to_error(value.found * factor, value.sigma * factor),
            change(value),
            if value.at_limit { "at the limit" } else { "yes" }.to_owned(),
        ]
    };
    let at_limit = calibrated.iter().filter(|value| value.at_limit);
    let at_limit: Vec<String> = at_limit.map(|value| value.name.clone()).collect();
    let limit = match &at_limit[..] {
        [] => String::new(),
        names => format!(
            " {} at the limit: {} would have gone beyond the prior, a sign that something else is missing.",
            count(names.len(), "value"),
            in_words(names)
        ),
    };
    Table {
        rows: calibrated.iter().map(row).collect(),
        note: Some(format!("± is one standard error.{limit}")),
        ..Table::new("The recalibrated model", head).with_word_columns(2)
    }
}

/// The change relative to the nominal value; a nominal value of 0 has none.
fn change(value: &Calibrated) -> String {
    let percent = 100.0 * (value.found / value.nominal - 1.0);
    let sign = if percent > 0.0 { "+" } else { "" };
    match fixed(percent, 1) {
        none if none == NONE => none,
        text => format!("{sign}{text} %"),
    }
}

pub(super) fn difference_blocks(answer: &Answer) -> Vec<Block> {
    let lines = &answer.figures.model_diff;
    if !lines.iter().any(|line| line.starts_with(['+', '-'])) {
        return vec![Block::paragraph("The answer holds no change to the model's file.")];
    }
    let difference = lines.iter().enumerate().map(|(number, line)| DifferenceLine {
        kind: kind(number, line),
        text: if line.is_empty() { " " } else { line }.to_owned(),
    });
    let why = "Lines with − leave the model's file, lines with + enter it. The whole new file is model.toml.";
    vec![Block::paragraph(why), Block::Difference(difference.collect())]
}

fn kind(number: usize, line: &str) -> LineKind {
    // A unified difference may begin with the names of both files.
    let names_file = number < 2 && (line.starts_with("---") || line.starts_with("+++"));
    match line.chars().next() {
        _ if names_file || line.starts_with("@@") => LineKind::Heading,
        Some('+') => LineKind::Added,
        Some('-') => LineKind::Removed,
        _ => LineKind::Kept,
    }
}
