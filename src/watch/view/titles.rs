//! What stands in the edges of the canal: as much as has room beside what is there already.

use crate::watch::RangeSummary;
use crate::watch::range;
use ratatui::text::Line;

/// The first of these that fits beside `other` into so many columns, or nothing.
pub(super) fn beside(other: &str, columns: usize, choices: impl IntoIterator<Item = String>) -> Line<'static> {
    let room = columns.saturating_sub(Line::raw(other).width());
    let fits = |choice: &String| Line::raw(choice.as_str()).width() <= room;
    let chosen = choices.into_iter().find(fits).unwrap_or_default();
    Line::from(chosen).right_aligned()
}

/// How far and how long the battery lasts: the best first.
pub(super) fn of_range(range: &RangeSummary) -> [String; 3] {
    let (reach, charge) = (range::brief(range), range::charge(range));
    [
        format!(" range {reach}, {charge} "),
        format!(" {reach}, {charge} "),
        format!(" {reach} "),
    ]
}
