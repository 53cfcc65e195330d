//! What can stand below the canal in the place of the overview: a cell, the energy, the alarms, the keys.

use super::{TableCell, alarm_line, cell_number, fitting, number, table};
use crate::remedy;
use crate::watch::breakdown::Breakdown;
use crate::watch::fault::LatchedFault;
use crate::watch::picture::Picture;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph, Row, Wrap};
use worm_estimator::message::{AlarmKind, Cycle, Severity};

/// How much of the past a cell's charts show, s.
const SPAN_S: f64 = 60.0;
/// Least range of the position, mm: a worm at rest is a flat line, not enlarged noise.
const MIN_RANGE_MM: f64 = 2.0;

/// Position and deformation of a cell over the last minute.
pub(super) fn draw_cell(frame: &mut Frame<'_>, area: Rect, picture: &Picture, cell: usize) {
    let history = picture.history.of_cell(cell, picture.time_ns, SPAN_S);
    let [above, below] = Layout::vertical([Constraint::Fill(1), Constraint::Fill(1)]).areas(area);
    let in_mm =
        |values: Vec<(f64, f64)>| -> Vec<(f64, f64)> { values.into_iter().map(|(s, m)| (s, m * 1e3)).collect() };
    let number = cell_number(cell);
    let (position, deformation) = (in_mm(history.position_m), in_mm(history.deformation_m));

    let known = position.iter().map(|point| point.1);
    let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mm| {
        (low.min(mm), high.max(mm))
    });
    let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
    let widen = ((MIN_RANGE_MM - (high - low)) / 2.0).max(0.0);
    let title = format!(" cell {number}: position along the canal, mm ");
    draw_chart(frame, above, title, &position, [low - widen, high + widen], Color::Cyan);

    let bound_mm = picture.subject.full_scale_m * 1e3;
    let largest = deformation
        .iter()
        .fold(bound_mm, |largest, point| largest.max(point.1.abs()));
    let title = format!(" cell {number}: deformation of its tip, mm; it slides at {bound_mm:.2} ");
    draw_chart(frame, below, title, &deformation, [-largest, largest], Color::Green);
}

fn draw_chart(frame: &mut Frame<'_>, area: Rect, title: String, points: &[(f64, f64)], range: [f64; 2], colour: Color) {
    let block = Block::bordered().title(title);
    if points.is_empty() {
        let text = "nothing was seen of it in the last minute";
        frame.render_widget(Paragraph::new(text).block(block), area);
        return;
    }
    let line = Dataset::default()
        .marker(Marker::Braille)
        .graph_type(GraphType::Line)
        .style(Style::new().fg(colour))
        .data(points);
    let middle = f64::midpoint(range[0], range[1]);
    let labels = [range[0], middle, range[1]].map(|mm| format!("{mm:7.2}"));
    let chart = Chart::new(vec![line])
        .block(block)
        .x_axis(
            Axis::default()
                .bounds([-SPAN_S, 0.0])
                .labels(["60 s ago", "30 s", "now"]),
        )
        .y_axis(Axis::default().bounds(range).labels(labels));
    frame.render_widget(chart, area);
}

/// The parts of a breakdown with their colours, and what tells them apart without.
fn parts(energy: &Breakdown) -> [(f64, Color, &'static str); 4] {
    [
        (energy.copper_j, Color::Red, "█"),
        (energy.gears_j, Color::Yellow, "▓"),
        (energy.sliding_j, Color::Green, "▒"),
        (energy.weight_j, Color::Blue, "░"),
    ]
}

/// A bar of so many columns, the parts side by side.
fn bar(energy: &Breakdown, columns: usize) -> Line<'static> {
    let spans = parts(energy).map(|(part_j, colour, fill)| {
        let fraction = (part_j / energy.electrical_j).clamp(0.0, 1.0);
        let width = if fraction.is_finite() {
            (fraction * columns as f64).round() as usize
        } else {
            0
        };
        Span::from(fill.repeat(width)).fg(colour)
    });
    Line::from(spans.to_vec())
}

/// Where the energy of the last cycles went.
pub(super) fn draw_energy(frame: &mut Frame<'_>, area: Rect, picture: &Picture) {
    let block = Block::bordered().title(" where the energy of each cycle went, mJ ");
    let inner = block.inner(area);
    let [list, note] = Layout::vertical([Constraint::Min(0), Constraint::Length(2)]).areas(inner);
    frame.render_widget(block, area);
    let columns = fitting(
        &[
            ("cycle", 5),
            ("electric", 8),
            ("copper", 7),
            ("gears", 7),
            ("sliding", 7),
            ("weight", 7),
            ("", list.width.saturating_sub(48).min(60)),
        ],
        list.width,
    );
    let bar_width = usize::from(columns.last().map_or(0, |column| column.1));
    let room = usize::from(list.height.saturating_sub(1));
    let newest = picture.cycles.iter().rev().take(room).rev();
    let row = |cycle: &Cycle| {
        let energy = Breakdown::of(cycle, &picture.subject);
        let mut fields = vec![
            TableCell::from(format!("{:5}", cycle.index)),
            TableCell::from(number(energy.electrical_j * 1e3, 1)),
        ];
        fields.extend(
            parts(&energy)
                .map(|(part_j, colour, _)| TableCell::from(number(part_j * 1e3, 1)).style(Style::new().fg(colour))),
        );
        fields.push(TableCell::from(bar(&energy, bar_width)));
        fields.truncate(columns.len());
        Row::new(fields)
    };
    frame.render_widget(table(newest.map(row).collect(), &columns), list);
    let legend = "█ copper: heat of the winding. ▓ gears: friction inside. ▒ sliding: the tips. ░ weight: lifted. What a bar lacks is \
                  work not spent yet, or error.";
    frame.render_widget(
        Paragraph::new(legend).fg(Color::DarkGray).wrap(Wrap { trim: true }),
        note,
    );
}

/// What is raised with what to do, and the changes before.
pub(super) fn draw_alarms(frame: &mut Frame<'_>, area: Rect, picture: &Picture) {
    let mut lines = Vec::new();
    if let Some(fault) = LatchedFault::of(picture) {
        let off = Line::raw(format!("fault, and the motor is off: {}", fault.details));
        lines.push(off.fg(Color::Red).bold());
        lines.push(Line::from(vec!["  Do: ".bold(), Span::raw(fault.remedy)]));
        lines.push(Line::from(vec![
            "  Then: ".bold(),
            Span::raw("r twice resets; nothing moves before"),
        ]));
    }
    if picture.raised.is_empty() && !lines.is_empty() {
        lines.push(Line::raw("no alarm is raised now").fg(Color::DarkGray));
    } else if picture.raised.is_empty() {
        lines.push(Line::raw("no alarm is raised").fg(Color::Green));
    }
    let acknowledged = picture.state.map_or(0, |state| state.acknowledged_mask);
    for alarm in &picture.raised {
        lines.push(alarm_line(alarm, &picture.subject));
        let since_s = picture.time_ns.saturating_sub(alarm.since_ns) as f64 * 1e-9;
        let severity = Severity::try_from(alarm.severity).map_or("", Severity::name);
        let seen = if acknowledged >> (alarm.kind & 31) & 1 == 1 {
            ", acknowledged"
        } else {
            ""
        };
        lines.push(Line::raw(format!("  {severity}, for {since_s:.0} s{seen}")).fg(Color::DarkGray));
        if let Ok(kind) = AlarmKind::try_from(alarm.kind) {
            lines.push(Line::from(vec!["  Do: ".bold(), Span::raw(remedy::of(kind))]));
        }
    }
    lines.push(Line::raw(""));
    for alarm in picture.alarms.iter().rev() {
        let ago_s = picture.time_ns.saturating_sub(alarm.time_ns) as f64 * 1e-9;
        let name = AlarmKind::try_from(alarm.kind).map_or("unknown", AlarmKind::name);
        let change = if alarm.raised == 0 { "cleared" } else { "raised" };
        lines.push(Line::raw(format!("{ago_s:6.0} s ago  {name} {change}")).fg(Color::DarkGray));
    }
    let block = Block::bordered()
        .title(" alarms, and what to do ")
        .title_bottom(" k acknowledges them ");
    frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: false }).block(block), area);
}

/// Lines of the page of the keys in the usual width: the keys, and who may do what.
pub(super) const HELP_LINES: u16 = KEYS.len() as u16 + 3 + 2;

/// The keys.
const KEYS: [(&str, &str); 12] = [
    ("c", "crawl, as long as this screen is here; asks once more"),
    ("h, space", "hold; anyone may"),
    ("s", "stop: torque goes off"),
    (
        "r",
        "reset: leave a fault, permit motion despite alarms; asks once more",
    ),
    ("t", "take over from whoever drives"),
    ("p", "the trip waits; or, twice, goes on"),
    ("b", "the trip goes home; asks once more"),
    ("1 … 9, n", "the last minute of a cell; the next cell"),
    ("e", "where the energy of each cycle went"),
    ("a", "alarms, and what to do; k acknowledges them"),
    ("?", "these keys; the key of a page leaves it"),
    ("q, Ctrl-C", ""),
];

/// The keys, and who may do what.
pub(super) fn draw_help(frame: &mut Frame<'_>, area: Rect, leaving: &str) {
    let mut lines: Vec<_> = KEYS
        .iter()
        .map(|(key, does)| {
            let does = if does.is_empty() { leaving } else { does };
            Line::from(vec![
                Span::from(format!(" {key:<10} ")).add_modifier(Modifier::BOLD),
                Span::raw(does.to_owned()),
            ])
        })
        .collect();
    lines.push(Line::raw(""));
    lines.push(Line::raw(
        " One drives: the first who gives a command, until that screen leaves or another takes over. A crawl from here is renewed for \
         as long as this screen lives; without it the worm holds within a second.",
    ));
    let block = Block::bordered().title(" keys ");
    frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: false }).block(block), area);
}
