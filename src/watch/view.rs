//! The live picture in a terminal: the worm in its canal, each tip, cycles, alarms and loop health.

mod canal;
mod health;
mod panels;
mod titles;

use super::picture::Picture;
use super::{InferredSummary, alarm_text, inferred};
use crate::relay::wire::Subject;
use crate::trip::words;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Cell as TableCell, Paragraph, Row, Table};
use std::collections::VecDeque;
use worm_estimator::message::{Alarm, AlarmKind, Cycle, Estimate, Fault, Mode, Severity};
use worm_plan::ghost::Prediction;

/// What is painted.
pub(crate) struct View<'a> {
    /// The worm, as it was last seen.
    pub(crate) picture: &'a Picture,
    /// The line below the head: what was asked, answered, or who drives.
    pub(crate) status: Line<'a>,
    /// What is silent, and for how long; then the values are grey.
    pub(crate) stale: Option<String>,
    /// Where the worm is expected, while something is silent.
    pub(crate) ghost: Option<Prediction>,
    /// What stands below the canal.
    pub(crate) panel: Panel,
    /// What leaving does, for the lower edge of the canal.
    pub(crate) leaving: &'a str,
    /// The last lines of the log.
    pub(crate) log: &'a VecDeque<String>,
}

/// What stands below the canal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Panel {
    /// Tips, alarms, cycles, loop and log.
    Overview,
    /// The last minute of a cell, from 0.
    Cell(usize),
    /// Where the energy of the last cycles went.
    Energy,
    /// The alarms, with what to do.
    Alarms,
    /// The keys.
    Help,
}

/// Paints the whole screen.
pub(crate) fn draw(frame: &mut Frame<'_>, view: &View<'_>) {
    let picture = view.picture;
    let cells = picture.subject.cells.min(worm_physics::MAX_CELLS) as u16;
    let trip_lines = u16::from(picture.trip.is_some());
    let heights = Heights::of(frame.area().height.saturating_sub(trip_lines), cells);
    let rows_below = frame.area().height.saturating_sub(2 + trip_lines + heights.canal);
    // The keys are worth more than the worm to whoever asks for them.
    let canal_lines = match view.panel {
        Panel::Help if rows_below < panels::HELP_LINES => 0,
        _ => heights.canal,
    };
    let [head, status, trip, canal, below] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(trip_lines),
        Constraint::Length(canal_lines),
        Constraint::Min(0),
    ])
    .areas(frame.area());
    let trip_line = picture.trip.as_ref().map(|trip| {
        let silent_s = picture.ages.trip.unwrap_or(0) / 1000;
        if silent_s >= 2 && !words::is_over(trip) {
            let text =
                format!(" the trip has been silent for {silent_s} s: its process was ended, and nothing resumes it");
            return Line::raw(text).fg(Color::Red);
        }
        let energy = words::energy(trip).map_or(String::new(), |energy| format!("  {energy}"));
        let key = if trip.needs_operator == 1 {
            "; p twice: go on"
        } else {
            ""
        };
        Line::raw(format!(" {}{key}{energy}", words::line(trip))).fg(Color::Blue)
    });
    frame.render_widget(trip_line.unwrap_or_default(), trip);
    match view.panel {
        Panel::Overview => draw_overview(frame, below, view, &heights),
        Panel::Cell(cell) => panels::draw_cell(frame, below, picture, cell),
        Panel::Energy => panels::draw_energy(frame, below, picture),
        Panel::Alarms => panels::draw_alarms(frame, below, picture),
        Panel::Help => panels::draw_help(frame, below, view.leaving),
    }
    if view.stale.is_some() {
        for area in [trip, below] {
            frame.buffer_mut().set_style(area, Style::new().fg(Color::DarkGray));
        }
    }
    canal::draw(frame, canal, view);
    frame.render_widget(headline(picture, view.stale.as_deref()), head);
    frame.render_widget(&view.status, status);
}

fn draw_overview(frame: &mut Frame<'_>, area: Rect, view: &View<'_>, heights: &Heights) {
    let [middle, bottom, messages] = Layout::vertical([
        Constraint::Length(heights.tips),
        Constraint::Min(0),
        Constraint::Length(heights.log),
    ])
    .areas(area);
    let side = match area.width {
        0..78 => 24,
        78..100 => 30,
        _ => 34,
    };
    let columns = [Constraint::Min(0), Constraint::Length(side)];
    let [tips, alarms] = Layout::horizontal(columns).areas(middle);
    let [cycles, health] = Layout::horizontal(columns).areas(bottom);
    draw_tips(frame, tips, view.picture);
    draw_alarms(frame, alarms, view.picture);
    draw_cycles(frame, cycles, view.picture);
    health::draw(frame, health, view.picture);
    let lines: Vec<Line<'_>> = view
        .log
        .iter()
        .rev()
        .take(usize::from(heights.log.saturating_sub(2)))
        .rev()
        .map(|line| Line::raw(line.as_str()))
        .collect();
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" log ")), messages);
}

/// Heights of the parts of the picture, in lines. The worm comes first, then its tips; the log is the first to go.
struct Heights {
    canal: u16,
    tips: u16,
    log: u16,
}

impl Heights {
    /// Fewest lines for the cycles and the loop's health below the tips.
    const BOTTOM: u16 = 6;

    fn of(height: u16, cells: u16) -> Self {
        let canal = height.saturating_sub(2).min(7);
        let rest = height.saturating_sub(2 + canal);
        let wanted = cells + 3;
        let spare = rest.saturating_sub(wanted + Self::BOTTOM);
        let log = match spare {
            0..3 => 0,
            3..8 => 3,
            _ => 5,
        };
        let room = rest - log;
        let tips = if room < Self::BOTTOM + 4 {
            room.min(wanted)
        } else {
            wanted.min(room - Self::BOTTOM)
        };
        Self { canal, tips, log }
    }
}

/// The first columns of a table that fit into `width`, as (head, width).
fn fitting<'a>(columns: &[(&'a str, u16)], width: u16) -> Vec<(&'a str, u16)> {
    let mut used = 0;
    let fits = |column: &&(&str, u16)| {
        used += column.1 + 1;
        used <= width + 1
    };
    columns.iter().take_while(fits).copied().collect()
}

fn table<'a>(rows: Vec<Row<'a>>, columns: &[(&'a str, u16)]) -> Table<'a> {
    let widths: Vec<Constraint> = columns.iter().map(|column| Constraint::Length(column.1)).collect();
    let heads: Vec<&str> = columns.iter().map(|column| column.0).collect();
    Table::new(rows, widths).header(Row::new(heads).bold())
}

fn headline(picture: &Picture, stale: Option<&str>) -> Line<'static> {
    let subject = &picture.subject;
    let mut spans = vec![Span::from(format!(" {} ", subject.name)).bold()];
    if let Some(stale) = stale {
        spans.push(Span::from(format!(" {stale} ")).style(Style::new().fg(Color::White).bg(Color::Red).bold()));
    }
    let Some(state) = picture.state else {
        spans.push(Span::from(" no state yet"));
        return Line::from(spans);
    };
    let mode = Mode::try_from(state.mode).map_or("?", Mode::name);
    let fault = Fault::try_from(state.fault).unwrap_or(Fault::None);
    let mode_style = match Mode::try_from(state.mode) {
        _ if stale.is_some() => Style::new().fg(Color::DarkGray),
        Ok(Mode::Crawling) => Style::new().fg(Color::Green),
        Ok(Mode::Fault) => Style::new().fg(Color::White).bg(Color::Red),
        _ => Style::new().fg(Color::Yellow),
    };
    spans.push(Span::from(format!(" {mode} ")).style(mode_style.add_modifier(Modifier::BOLD)));
    if fault != Fault::None {
        let alarm = AlarmKind::try_from(state.fault_alarm).map_or(String::new(), |alarm| format!(" {alarm}"));
        spans.push(Span::from(format!(" {fault}{alarm}")).fg(Color::Red).bold());
    }
    let port = subject
        .port
        .as_ref()
        .map_or(String::new(), |port| format!("  on {port}"));
    let values = Span::from(format!(
        "  cycle {:.2}  {:.1} rev/min  {:.0} mA  {:.1} V  {:.0} °C{port}",
        state.phase,
        state.motor_velocity_rad_s * 60.0 / std::f64::consts::TAU,
        state.motor_current_a * 1e3,
        state.bus_voltage_v,
        state.motor_temperature_c,
    ));
    spans.push(if stale.is_some() {
        values.fg(Color::DarkGray)
    } else {
        values
    });
    Line::from(spans)
}

fn cell_label(cell: usize) -> String {
    // One column for every cell up to 16: 1 to 9, then a to g.
    char::from_digit(cell as u32 + 1, 17).unwrap_or('?').to_string()
}

/// Number of a cell as everywhere else, with its label in the canal where that differs.
fn cell_number(cell: usize) -> String {
    if cell < 9 {
        cell_label(cell)
    } else {
        format!("{} {}", cell + 1, cell_label(cell))
    }
}

fn known_positions(estimate: &Estimate) -> Vec<(usize, f64)> {
    let cells = (estimate.cell_count as usize).min(worm_physics::MAX_CELLS);
    (0..cells)
        .map(|cell| (cell, estimate.position_m[cell]))
        .filter(|(_, x_m)| x_m.is_finite())
        .collect()
}

fn tip_style(estimate: &Estimate, cell: usize) -> Style {
    let slides = estimate.sliding_mask >> cell & 1 == 1;
    Style::new().fg(match (slides, estimate.deformation_m[cell] > 0.0) {
        (false, _) => Color::Cyan,
        (true, true) => Color::Green,
        (true, false) => Color::Red,
    })
}

fn draw_tips(frame: &mut Frame<'_>, area: Rect, picture: &Picture) {
    let inferred = picture.inferred;
    let summary = inferred.map(|inferred| InferredSummary::of(&inferred, picture.phase()));
    let block = Block::bordered()
        .title(" tips ")
        .title_bottom(Line::from(summary.and_then(|it| it.text()).unwrap_or_default()).fg(Color::Blue));
    let Some(estimate) = picture
        .estimate
        .filter(|_| picture.has_positions() || inferred.is_none())
    else {
        draw_inferred_tips(frame, area, block, picture);
        return;
    };
    let columns = fitting(
        &[
            ("cell", 4),
            ("   at mm", 8),
            ("  deformation", 17),
            ("  mm", 6),
            ("   N", 6),
            ("slid fwd/back mm", 16),
            (" ~max N", 11),
        ],
        block.inner(area).width,
    );
    let row = |(cell, x_m): (usize, f64)| {
        let deformation_m = estimate.deformation_m[cell];
        let fields = [
            TableCell::from(cell_number(cell)),
            TableCell::from(format!("{:8.2}", x_m * 1e3)),
            TableCell::from(bar(deformation_m / picture.subject.full_scale_m)).style(tip_style(&estimate, cell)),
            TableCell::from(number(deformation_m * 1e3, 2)),
            TableCell::from(number(estimate.force_n[cell], 2)),
            TableCell::from(format!(
                "{:.1}/{:.1}",
                estimate.forward_slide_m[cell] * 1e3,
                estimate.backward_slide_m[cell] * 1e3
            )),
            TableCell::from(
                inferred
                    .and_then(|inferred| inferred::friction_text(&inferred, cell))
                    .unwrap_or_default(),
            )
            .style(Style::new().fg(Color::Blue)),
        ];
        Row::new(fields.into_iter().take(columns.len()))
    };
    let rows = known_positions(&estimate).into_iter().map(row).collect();
    frame.render_widget(table(rows, &columns).block(block), area);
}

/// What the current says of each cell, where no positions are measured.
fn draw_inferred_tips(frame: &mut Frame<'_>, area: Rect, block: Block<'_>, picture: &Picture) {
    let Some(inferred) = picture.inferred else {
        frame.render_widget(block, area);
        return;
    };
    let columns = fitting(
        &[
            ("cell", 4),
            ("friction N", 12),
            ("stiffness N/m", 13),
            ("slides fwd/back mm", 18),
        ],
        block.inner(area).width,
    );
    let row = |cell: usize| {
        let [stiffness, sigma] = [inferred.stiffness_n_per_m[cell], inferred.stiffness_sigma_n_per_m[cell]];
        let is_known = stiffness.is_finite();
        let fields = [
            cell_number(cell),
            inferred::friction_text(&inferred, cell).unwrap_or_else(|| "–".to_owned()),
            if is_known {
                format!("~{stiffness:.0}±{sigma:.0}")
            } else {
                "–".to_owned()
            },
            match [inferred.forward_slide_m[cell], inferred.backward_slide_m[cell]].map(|m| m * 1e3) {
                [forward, backward] if forward.is_finite() && backward.is_finite() => {
                    format!("~{forward:.1}/{backward:.1}±{:.1}", inferred.slide_sigma_m * 1e3)
                }
                _ => "–".to_owned(),
            },
        ];
        Row::new(
            fields
                .into_iter()
                .take(if is_known { columns.len() } else { 3.min(columns.len()) }),
        )
        .style(Style::new().fg(Color::Blue))
    };
    let cells = (inferred.cell_count as usize).min(worm_physics::MAX_CELLS);
    let rows = (0..cells).map(row).collect();
    frame.render_widget(table(rows, &columns).block(block), area);
}

/// A number with `digits` decimals, or a dash where it is not known yet.
fn number(value: f64, digits: usize) -> String {
    if value.is_finite() {
        format!("{value:6.digits$}")
    } else {
        "     –".to_owned()
    }
}

/// A bar from −1 to 1 around a middle mark.
fn bar(fraction: f64) -> String {
    const HALF: i32 = 8;
    let end = if fraction.is_finite() {
        (fraction * f64::from(HALF)).round() as i32
    } else {
        0
    };
    (-HALF..=HALF)
        .map(|at| match at {
            0 => '┃',
            at if at > 0 && at <= end || at < 0 && at >= end => '━',
            _ => '·',
        })
        .collect()
}

fn draw_alarms(frame: &mut Frame<'_>, area: Rect, picture: &Picture) {
    let raised = &picture.raised;
    let (armed_mask, raised_mask) = picture
        .estimate
        .map_or((0, 0), |estimate| (estimate.armed_mask, estimate.raised_mask));
    let armed = armed_mask.count_ones();
    let mut lines: Vec<Line<'_>> = raised.iter().map(|alarm| alarm_line(alarm, &picture.subject)).collect();
    if lines.is_empty() && raised_mask == 0 {
        lines.push(Line::raw("none raised").fg(Color::Green));
        if let Some(last) = picture.alarms.last() {
            let name = AlarmKind::try_from(last.kind).map_or("?", AlarmKind::name);
            lines.push(Line::raw(format!("the last: {name}, cleared")).fg(Color::Yellow));
        }
    }
    let waiting: Vec<&str> = AlarmKind::ALL
        .iter()
        .filter(|kind| armed_mask >> kind.code() & 1 == 0)
        .map(|kind| kind.name())
        .collect();
    if !waiting.is_empty() {
        lines.push(Line::raw(format!("not armed: {}", waiting.join(", "))).fg(Color::DarkGray));
    }
    let title = format!(" alarms, {armed} of {} armed ", AlarmKind::ALL.len());
    let paragraph = Paragraph::new(lines).wrap(ratatui::widgets::Wrap { trim: true });
    frame.render_widget(paragraph.block(Block::bordered().title(title)), area);
}

fn alarm_line(alarm: &Alarm, subject: &Subject) -> Line<'static> {
    let colour = if alarm.severity == Severity::Critical.code() {
        Color::Red
    } else {
        Color::Yellow
    };
    Line::from(alarm_text::of(alarm, subject)).fg(colour).bold()
}

fn draw_cycles(frame: &mut Frame<'_>, area: Rect, picture: &Picture) {
    let room = usize::from(area.height.saturating_sub(3));
    let newest = picture.cycles.iter().rev().take(room).rev();
    let block = Block::bordered().title(" gait cycles, advance in mm ");
    let columns = fitting(
        &[
            ("cycle", 5),
            ("advance", 7),
            (" model", 6),
            ("energy mJ", 10),
            (" model", 6),
            ("   COT", 6),
            ("el. mJ", 6),
        ],
        block.inner(area).width,
    );
    let row = |cycle: &Cycle| {
        let style = if cycle.settled == 0 {
            Style::new().fg(Color::DarkGray)
        } else {
            Style::new()
        };
        // Without an error the energy is not known: the tips' deformations were not known yet.
        let is_known = cycle.energy_loss_sigma_j.is_finite();
        let energy = if is_known {
            format!(
                "{:5.1}±{:.1}",
                cycle.energy_loss_j * 1e3,
                cycle.energy_loss_sigma_j * 1e3
            )
        } else {
            "    –".to_owned()
        };
        let fields = [
            format!("{:5}", cycle.index),
            format!(" {}", number(cycle.advance_m * 1e3, 2)),
            number(cycle.predicted_advance_m * 1e3, 2),
            energy,
            number(cycle.predicted_energy_loss_j * 1e3, 1),
            number(if is_known { cycle.cot } else { f64::NAN }, 2),
            format!("{:6.0}", cycle.energy_electrical_j * 1e3),
        ];
        Row::new(fields.into_iter().take(columns.len())).style(style)
    };
    let rows = newest.map(row).collect();
    frame.render_widget(table(rows, &columns).block(block), area);
}
