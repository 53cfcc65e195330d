//! An explanation for the terminal.

use super::answer::Explanation;
use crate::black_box::utc;
use std::fmt::Write as _;
use std::time::{Duration, UNIX_EPOCH};

/// Most events before and after the stop that the terminal shows.
const MOST_BEFORE: usize = 24;
const MOST_AFTER: usize = 8;

/// The headline: what happened, and when.
pub(super) fn headline(explanation: &Explanation) -> String {
    let Explanation { worm, reason, .. } = explanation;
    match (explanation.stopped, reason.kind) {
        (true, kind) if kind == reason.name => format!("{worm} stopped: {kind}"),
        (true, kind) => format!("{worm} stopped: {kind} {}", reason.name),
        (false, "alarm") => format!("{worm} did not stop; alarm {}", reason.name),
        (false, _) => format!("{worm} did not stop"),
    }
}

/// When it was, and what the modes were.
pub(super) fn lead(explanation: &Explanation) -> String {
    let when = explanation.unix_ns.map_or_else(
        || "At an unknown time".to_owned(),
        |unix_ns| utc::readable(UNIX_EPOCH + Duration::from_nanos(unix_ns)),
    );
    let modes = match (explanation.from, explanation.to) {
        (Some(from), Some(to)) => format!(", from {from} to {to}"),
        (Some(from), None) => format!(", from {from}"),
        _ => String::new(),
    };
    let which = match explanation.stops {
        0 | 1 => String::new(),
        stops => format!(", stop {} of {stops} in this log", explanation.stop),
    };
    format!("{when}{modes}{which}. Times are seconds from then.")
}

/// The early signs in a sentence; none where there were none.
pub(super) fn signs(explanation: &Explanation) -> Option<String> {
    let signs = explanation.signs.iter();
    let signs: Vec<String> = signs
        .map(|sign| format!("{} ({}) since {:.1} s", sign.alarm, sign.severity, sign.time_s))
        .collect();
    (!signs.is_empty()).then(|| format!("Alarms that stood already: {}.", signs.join(", ")))
}

/// What `explain` says of the cycles before, in a sentence.
pub(super) fn last_cycles(explanation: &Explanation) -> String {
    let last = &explanation.last_cycles;
    match (&last.verdict, &last.why_not) {
        (Some(verdict), _) => format!("The {:.0} gait cycles before it, explained: {verdict}", last.cycles),
        (None, Some(why_not)) => format!("The gait cycles before it were not explained: {why_not}."),
        (None, None) => "The gait cycles before it were not explained.".to_owned(),
    }
}

/// All of it.
pub(crate) fn text(explanation: &Explanation) -> String {
    let mut text = format!(
        "{}\n{}\n\n{}\n",
        headline(explanation),
        lead(explanation),
        explanation.reason.sentence
    );
    if let Some(signs) = signs(explanation) {
        text += &format!("{signs}\n");
    }
    text += &format!("Do: {}\n\n", explanation.remedy);
    let (before, after): (Vec<_>, Vec<_>) = explanation.events.iter().partition(|event| event.time_s <= 0.0);
    let left_out = before.len().saturating_sub(MOST_BEFORE);
    if left_out > 0 {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "           … {left_out} events before");
    }
    for event in before[left_out..].iter().chain(after.iter().take(MOST_AFTER)) {
        let _ = writeln!(text, "{:>10.3}  {}", event.time_s, event.text);
    }
    let left_out = after.len().saturating_sub(MOST_AFTER);
    if left_out > 0 {
        let _ = writeln!(text, "           … {left_out} events after");
    }
    text + "\n" + &last_cycles(explanation)
}
