//! What changes in the model: the recalibrated values, and its text before and after.

use super::words::readable;
use crate::explain::Answer;
use crate::explain::answer::Calibrated;
use crate::report::number::{NONE, count, fixed, in_words, significant, to_error};
use crate::report::page::{Page, escaped};
use crate::report::table::Table;
use std::fmt::Write;

pub(super) fn add_calibration(page: &mut Page, answer: &Answer) {
    if answer.calibration.is_empty() {
        page.paragraph("The answer lists no quantity that was recalibrated.");
        return;
    }
    page.paragraph(
        "Before anything is called missing, the quantities that are known only so well may move within what is believable of them. \
         Only what is then left is a gap.",
    );
    page.table(&calibration(&answer.calibration));
}

fn calibration(calibrated: &[Calibrated]) -> Table {
    let head = ["", "unit", "believed", "found", "change", "within what was allowed"];
    let mut table = Table::new("The recalibrated model", head);
    table.word_columns = 2;
    for value in calibrated {
        let (factor, unit) = match value.unit {
            "" => (1.0, "×"),
            unit => readable(unit),
        };
        table.rows.push(vec![
            value.name.clone(),
            unit.to_owned(),
            significant(value.nominal * factor, 4),
            to_error(value.found * factor, value.sigma * factor),
            change(value),
            if value.at_limit { "at the limit" } else { "yes" }.to_owned(),
        ]);
    }
    let at_limit: Vec<String> = calibrated
        .iter()
        .filter(|value| value.at_limit)
        .map(|value| value.name.clone())
        .collect();
    let limit = match &at_limit[..] {
        [] => String::new(),
        names => format!(
            " {} at the limit: {} would have gone further than is believable, a sign that something else is missing.",
            count(names.len(), "value"),
            in_words(names)
        ),
    };
    table.note = Some(format!("± is one standard error.{limit}"));
    table
}

/// The change as a share of what was believed; nothing can be said of what was believed to be 0.
fn change(value: &Calibrated) -> String {
    let percent = 100.0 * (value.found / value.nominal - 1.0);
    let sign = if percent > 0.0 { "+" } else { "" };
    match fixed(percent, 1) {
        none if none == NONE => none,
        text => format!("{sign}{text} %"),
    }
}

pub(super) fn add_diff(page: &mut Page, answer: &Answer) {
    let lines = &answer.figures.model_diff;
    let is_changed = lines.iter().any(|line| line.starts_with(['+', '-']));
    if !is_changed {
        page.paragraph("The answer holds no change to the model's file.");
        return;
    }
    let mut html = "<pre class=\"diff\">".to_owned();
    for (number, line) in lines.iter().enumerate() {
        // A unified difference may begin with the names of both files.
        let is_heading = line.starts_with("@@") || number < 2 && (line.starts_with("---") || line.starts_with("+++"));
        let tag = match line.chars().next() {
            _ if is_heading => "s",
            Some('+') => "ins",
            Some('-') => "del",
            _ => "span",
        };
        let text = if line.is_empty() { " " } else { line };
        let _ = write!(html, "<{tag}>{}</{tag}>", escaped(text)); // A String takes all.
    }
    html.push_str("</pre>");
    page.paragraph("Lines with − leave the model's file, lines with + enter it. The whole new file is model.toml.");
    page.html(&html);
}
