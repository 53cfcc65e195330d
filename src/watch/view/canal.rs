//! The worm in its canal: cells, the points where their tips touch, and a ruler.

use super::{View, cell_label, known_positions, tip_style, titles};
use crate::watch::{RangeSummary, ghost, inferred};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

/// Colour of what is predicted.
const GHOST: Color = Color::Magenta;
/// Colour of what is inferred.
const INFERRED: Color = Color::Blue;
/// Standard errors to either side between which nine of ten lie.
const NINE_OF_TEN_SIGMAS: f64 = 1.645;

/// Metres of canal that the picture shows beyond the worm, before and behind it.
const MARGIN_M: f64 = 0.03;

/// Farthest position that is shown, m.
const MAX_POSITION_M: f64 = 1e5;

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, view: &View<'_>) {
    let (subject, picture) = (&view.picture.subject, view.picture);
    let direction = if subject.backward { "left" } else { "right" };
    let title = format!(
        " canal, {}° — mm, the worm crawls to the {direction} ",
        subject.slope_deg
    );
    let title = match &view.ghost {
        Some(ghost) => format!(" {} ", ghost::text(ghost)),
        None => title,
    };
    let range = picture
        .range
        .as_ref()
        .map(|range| titles::of_range(&RangeSummary::of(range)));
    let leaving = format!(" {} ", view.leaving);
    let columns = usize::from(area.width.saturating_sub(2));
    let keys = [" ? shows the keys ", " ? keys "].map(str::to_owned);
    let block = Block::bordered()
        .title(titles::beside(&title, columns, keys))
        .title(title)
        .title_bottom(titles::beside(&leaving, columns, range.into_iter().flatten()))
        .title_bottom(leaving);
    let block = match (&view.stale, &view.ghost) {
        (_, Some(_)) => block.fg(GHOST),
        (Some(_), None) => block.fg(Color::DarkGray),
        (None, None) => block,
    };
    let inner = block.inner(area);
    frame.render_widget(block, area);
    // Of a worm of which nothing is heard, the ghost is shown where it is expected.
    let moved_m = view.ghost.map_or(0.0, |ghost| ghost.moved_m.mean);
    // Of one that is not seen, what the motor's current says, or said last.
    let by_current = picture
        .inferred
        .filter(|_| !picture.has_positions())
        .and_then(|inferred| inferred::place(&inferred, subject, picture.phase()));
    let mut positions = match (&by_current, &picture.estimate) {
        (Some((positions, _)), _) => positions.clone(),
        (None, Some(estimate)) => known_positions(estimate),
        (None, None) => return,
    };
    positions.iter_mut().for_each(|cell| cell.1 += moved_m);
    let (Some(rear_m), Some(front_m)) = (
        positions.iter().map(|cell| cell.1).reduce(f64::min),
        positions.iter().map(|cell| cell.1).reduce(f64::max),
    ) else {
        return;
    };
    let columns = usize::from(inner.width);
    // Positions that no canal has are no picture, and their ruler would have no end.
    let is_plausible = rear_m.abs().max(front_m.abs()) < MAX_POSITION_M;
    if columns < 20 || inner.height < 5 || !is_plausible {
        return;
    }
    let error_m = by_current
        .as_ref()
        .map_or(0.0, |(_, sigma_m)| NINE_OF_TEN_SIGMAS * sigma_m);
    let (low_m, high_m) = view.ghost.map_or((0.0, 0.0), |ghost| {
        (ghost.moved_m.low - moved_m, ghost.moved_m.high - moved_m)
    });
    let is_sure = by_current.is_none() && view.ghost.is_none();
    let places = (!is_sure).then_some((rear_m + low_m - error_m, front_m + high_m + error_m));
    let (rear_m, front_m, body_m) = match places {
        Some((low_m, high_m)) => (rear_m.min(low_m), front_m.max(high_m), (rear_m, front_m)),
        None => (rear_m, front_m, (rear_m, front_m)),
    };
    // The window moves in whole steps of the ruler, so that the worm visibly crawls and the canal does not flicker.
    let label_mm = label_distance_mm(front_m - rear_m + 2.0 * MARGIN_M, columns);
    let step_m = label_mm as f64 * 1e-3 / 5.0;
    let start_m = ((rear_m - MARGIN_M) / step_m).floor() * step_m;
    let width_m = front_m - rear_m + 2.0 * MARGIN_M + step_m;
    let column = |x_m: f64| (((x_m - start_m) / width_m * columns as f64) as usize).min(columns - 1);

    let mut body = vec![Span::raw(" "); columns];
    let mut feet = vec![Span::raw(" "); columns];
    let (tail, nose) = (column(body_m.0), column(body_m.1));
    for slot in &mut body[tail..=nose] {
        *slot = match view.ghost {
            Some(_) => Span::raw("░").fg(GHOST),
            None if by_current.is_some() => Span::raw("╌").fg(Color::DarkGray),
            None => Span::raw("═").fg(Color::DarkGray),
        };
    }
    for &(cell, x_m) in &positions {
        let at = column(x_m);
        let style = match (&view.ghost, &view.stale) {
            (Some(_), _) => Style::new().fg(GHOST).dim(),
            (None, Some(_)) => Style::new().fg(Color::DarkGray),
            (None, None) => match (&by_current, &picture.estimate) {
                (None, Some(estimate)) => tip_style(estimate, cell),
                _ => Style::new().fg(INFERRED).dim(),
            },
        };
        // What is inferred is hollow.
        let sides = if by_current.is_some() {
            ["[", "]"]
        } else {
            ["▐", "▌"]
        };
        for (offset, text) in [(0, sides[0]), (1, ""), (2, sides[1])] {
            let Some(slot) = (at + offset).checked_sub(1).and_then(|index| body.get_mut(index)) else {
                continue;
            };
            *slot = if offset == 1 && by_current.is_some() {
                Span::from(cell_label(cell)).style(style)
            } else if offset == 1 {
                Span::from(cell_label(cell)).style(style.add_modifier(Modifier::BOLD | Modifier::REVERSED))
            } else {
                Span::raw(text).style(style)
            };
        }
        let (Some(estimate), None, None) = (&picture.estimate, &view.ghost, &by_current) else {
            continue;
        };
        let contact_m = estimate.contact_m[cell];
        let foot = if contact_m.is_finite() { column(contact_m) } else { at };
        feet[foot] = Span::raw(match foot.cmp(&at) {
            std::cmp::Ordering::Less => "╱",
            std::cmp::Ordering::Equal => "│",
            std::cmp::Ordering::Greater => "╲",
        })
        .style(style);
    }
    if let Some((low_m, high_m)) = places {
        let colour = if by_current.is_some() { INFERRED } else { GHOST };
        // From where its last cell may be to where its first may be.
        let (low, high) = (column(low_m), column(high_m));
        for slot in &mut feet[low..=high] {
            *slot = Span::raw("┄").fg(colour);
        }
        feet[low] = Span::raw("├").fg(colour);
        feet[high] = Span::raw("┤").fg(colour);
    }
    let ruler: String = (0..columns)
        .map(|index| {
            let here = (start_m + index as f64 / columns as f64 * width_m) / step_m;
            let next = (start_m + (index + 1) as f64 / columns as f64 * width_m) / step_m;
            if here.floor() != next.floor() || index == 0 {
                '┴'
            } else {
                '─'
            }
        })
        .collect();
    let labels = ruler_labels(columns, start_m, width_m, label_mm);
    frame.render_widget(
        Paragraph::new(vec![
            Line::from(body),
            Line::from(feet),
            Line::raw(ruler),
            Line::raw(labels),
            match view.ghost {
                Some(_) => Line::raw(
                    " predicted, not seen: the worm by model and trip; the dashes: where it may be, 9 times of 10",
                )
                .fg(GHOST),
                None if by_current.is_some() => Line::raw(
                    " inferred from the motor's current, not seen; the dashes: where it may be, 9 times of 10",
                )
                .fg(INFERRED),
                None => legend(),
            },
        ]),
        inner,
    );
}

fn legend() -> Line<'static> {
    Line::from(vec![
        Span::raw(" tip: "),
        Span::raw("sticks").fg(Color::Cyan),
        Span::raw("  "),
        Span::raw("slides forward").fg(Color::Green),
        Span::raw("  "),
        Span::raw("slides backward").fg(Color::Red),
    ])
}

/// Millimetres between the labels of a ruler: the smallest distance that leaves them room in these columns.
fn label_distance_mm(width_m: f64, columns: usize) -> i64 {
    const ROOM: f64 = 10.0;
    let min_mm = width_m * 1e3 * ROOM / columns as f64;
    let mut distance_mm = 50;
    while (distance_mm as f64) < min_mm {
        distance_mm *= 2;
    }
    distance_mm
}

fn ruler_labels(columns: usize, start_m: f64, width_m: f64, label_mm: i64) -> String {
    let mut labels = vec![' '; columns];
    let first = (start_m * 1e3 / label_mm as f64).ceil() as i64;
    for multiple in first.. {
        let mm = multiple * label_mm;
        let at = ((mm as f64 * 1e-3 - start_m) / width_m * columns as f64) as usize;
        let text = mm.to_string();
        if at + text.len() > columns {
            break;
        }
        for (slot, character) in labels[at..].iter_mut().zip(text.chars()) {
            *slot = character;
        }
    }
    labels.into_iter().collect()
}
