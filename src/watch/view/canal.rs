//! The worm in its canal: cells, the points where their tips touch, and a ruler.

use super::{View, cell_label, known_positions, tip_style};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

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
    let block = Block::bordered()
        .title(title)
        .title_bottom(format!(" {}, ? shows the keys ", view.leaving));
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let Some(estimate) = picture.estimate else { return };
    let positions = known_positions(&estimate);
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
    // The window moves in whole steps of the ruler, so that the worm visibly crawls and the canal does not flicker.
    let label_mm = label_distance_mm(front_m - rear_m + 2.0 * MARGIN_M, columns);
    let step_m = label_mm as f64 * 1e-3 / 5.0;
    let start_m = ((rear_m - MARGIN_M) / step_m).floor() * step_m;
    let width_m = front_m - rear_m + 2.0 * MARGIN_M + step_m;
    let column = |x_m: f64| (((x_m - start_m) / width_m * columns as f64) as usize).min(columns - 1);

    let mut body = vec![Span::raw(" "); columns];
    let mut feet = vec![Span::raw(" "); columns];
    let (tail, nose) = (column(rear_m), column(front_m));
    for slot in &mut body[tail..=nose] {
        *slot = Span::raw("═").fg(Color::DarkGray);
    }
    for &(cell, x_m) in &positions {
        let at = column(x_m);
        let style = tip_style(&estimate, cell);
        for (offset, text) in [(0, "▐"), (1, ""), (2, "▌")] {
            let Some(slot) = (at + offset).checked_sub(1).and_then(|index| body.get_mut(index)) else {
                continue;
            };
            *slot = if offset == 1 {
                Span::from(cell_label(cell)).style(style.add_modifier(Modifier::BOLD | Modifier::REVERSED))
            } else {
                Span::raw(text).style(style)
            };
        }
        let contact_m = estimate.contact_m[cell];
        let foot = if contact_m.is_finite() { column(contact_m) } else { at };
        feet[foot] = Span::raw(match foot.cmp(&at) {
            std::cmp::Ordering::Less => "╱",
            std::cmp::Ordering::Equal => "│",
            std::cmp::Ordering::Greater => "╲",
        })
        .style(style);
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
            legend(),
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
