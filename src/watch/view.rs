//! The live picture in a terminal: the worm in its canal, each tip, cycles, alarms and loop health.

use super::telemetry::Telemetry;
use super::{mismatch, recording};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Cell as TableCell, Paragraph, Row, Table};
use std::collections::VecDeque;
use worm_estimator::message::{Alarm, AlarmKind, Cycle, Estimate, Fault, Mode, Severity};

/// What the picture shows of the worm besides its telemetry.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Name of the worm.
    pub name: String,
    /// The port that drives it, or "virtual worm".
    pub port: String,
    /// Slope of the canal, degrees.
    pub slope_deg: f64,
    /// Whether the gait is driven backward.
    pub backward: bool,
    /// Tick rate, Hz.
    pub rate_hz: f64,
    /// The order in which the cells step, from 1.
    pub step_order: Vec<usize>,
    /// Largest deformation that the bars show, m.
    pub full_scale_m: f64,
}

/// Paints the whole screen.
pub fn draw(frame: &mut Frame<'_>, subject: &Subject, telemetry: &Telemetry, log: &VecDeque<String>) {
    let cells = telemetry
        .estimate
        .map_or(4, |estimate| estimate.cell_count.min(worm_physics::MAX_CELLS as u32)) as u16;
    let heights = Heights::of(frame.area().height, cells);
    let [head, canal, middle, bottom, messages] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(heights.canal),
        Constraint::Length(heights.tips),
        Constraint::Min(0),
        Constraint::Length(heights.log),
    ])
    .areas(frame.area());
    let side = match frame.area().width {
        0..78 => 24,
        78..100 => 30,
        _ => 34,
    };
    let columns = [Constraint::Min(0), Constraint::Length(side)];
    let [tips, alarms] = Layout::horizontal(columns).areas(middle);
    let [cycles, health] = Layout::horizontal(columns).areas(bottom);

    frame.render_widget(headline(subject, telemetry), head);
    draw_canal(frame, canal, subject, telemetry);
    draw_tips(frame, tips, subject, telemetry);
    draw_alarms(frame, alarms, subject, telemetry);
    draw_cycles(frame, cycles, telemetry);
    draw_health(frame, health, subject, telemetry);
    let lines: Vec<Line<'_>> = log
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
        let canal = height.saturating_sub(1).min(7);
        let rest = height.saturating_sub(1 + canal);
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

fn headline(subject: &Subject, telemetry: &Telemetry) -> Line<'static> {
    let Some(state) = telemetry.state else {
        return Line::from(format!(" {}  starting …", subject.name)).bold();
    };
    let mode = Mode::try_from(state.mode).map_or("?", Mode::name);
    let fault = Fault::try_from(state.fault).unwrap_or(Fault::None);
    let mode_style = match Mode::try_from(state.mode) {
        Ok(Mode::Crawling) => Style::new().fg(Color::Green),
        Ok(Mode::Fault) => Style::new().fg(Color::White).bg(Color::Red),
        _ => Style::new().fg(Color::Yellow),
    };
    let mut spans = vec![
        Span::from(format!(" {} ", subject.name)).bold(),
        Span::from(format!(" {mode} ")).style(mode_style.add_modifier(Modifier::BOLD)),
    ];
    if fault != Fault::None {
        let alarm = AlarmKind::try_from(state.fault_alarm).map_or(String::new(), |alarm| format!(" {alarm}"));
        spans.push(Span::from(format!(" {fault}{alarm}")).fg(Color::Red).bold());
    }
    spans.push(Span::from(format!(
        "  cycle {:.2}  {:.1} rev/min  {:.0} mA  {:.1} V  {:.0} °C  on {}",
        state.phase,
        state.motor_velocity_rad_s * 60.0 / std::f64::consts::TAU,
        state.motor_current_a * 1e3,
        state.bus_voltage_v,
        state.motor_temperature_c,
        subject.port,
    )));
    Line::from(spans)
}

/// Metres of canal that the picture shows beyond the worm, before and behind it.
const MARGIN_M: f64 = 0.03;

fn draw_canal(frame: &mut Frame<'_>, area: Rect, subject: &Subject, telemetry: &Telemetry) {
    let direction = if subject.backward { "left" } else { "right" };
    let title = format!(
        " canal, {}° — mm, the worm crawls to the {direction} ",
        subject.slope_deg
    );
    let block = Block::bordered()
        .title(title)
        .title_bottom(" Ctrl-C or q stops the worm ");
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let Some(estimate) = telemetry.estimate else { return };
    let positions = known_positions(&estimate);
    let (Some(rear_m), Some(front_m)) = (
        positions.iter().map(|cell| cell.1).reduce(f64::min),
        positions.iter().map(|cell| cell.1).reduce(f64::max),
    ) else {
        return;
    };
    let columns = usize::from(inner.width);
    if columns < 20 || inner.height < 5 {
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

fn draw_tips(frame: &mut Frame<'_>, area: Rect, subject: &Subject, telemetry: &Telemetry) {
    let block = Block::bordered().title(" tips ");
    let Some(estimate) = telemetry.estimate else {
        frame.render_widget(block, area);
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
        ],
        block.inner(area).width,
    );
    let row = |(cell, x_m): (usize, f64)| {
        let deformation_m = estimate.deformation_m[cell];
        let fields = [
            TableCell::from(cell_number(cell)),
            TableCell::from(format!("{:8.2}", x_m * 1e3)),
            TableCell::from(bar(deformation_m / subject.full_scale_m)).style(tip_style(&estimate, cell)),
            TableCell::from(number(deformation_m * 1e3, 2)),
            TableCell::from(number(estimate.force_n[cell], 2)),
            TableCell::from(format!(
                "{:.1}/{:.1}",
                estimate.forward_slide_m[cell] * 1e3,
                estimate.backward_slide_m[cell] * 1e3
            )),
        ];
        Row::new(fields.into_iter().take(columns.len()))
    };
    let rows = known_positions(&estimate).into_iter().map(row).collect();
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

fn draw_alarms(frame: &mut Frame<'_>, area: Rect, subject: &Subject, telemetry: &Telemetry) {
    let raised = telemetry.raised();
    let (armed_mask, raised_mask) = telemetry
        .estimate
        .map_or((0, 0), |estimate| (estimate.armed_mask, estimate.raised_mask));
    let armed = armed_mask.count_ones();
    let mut lines: Vec<Line<'_>> = raised.iter().map(|alarm| alarm_line(alarm, subject)).collect();
    if lines.is_empty() && raised_mask == 0 {
        lines.push(Line::raw("none raised").fg(Color::Green));
        if let Some(last) = telemetry.alarms.last() {
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
    let name = AlarmKind::try_from(alarm.kind).map_or("?", AlarmKind::name);
    let cell = if alarm.cell == u32::MAX {
        String::new()
    } else {
        format!(" cell {}", alarm.cell + 1)
    };
    let colour = if alarm.severity == Severity::Critical.code() {
        Color::Red
    } else {
        Color::Yellow
    };
    let words = mismatch::text_of(alarm, &subject.step_order).or_else(|| recording::alarm_text(alarm));
    let text = words.map_or_else(
        || format!("{name}{cell}: {:.4} against {:.4}", alarm.value, alarm.threshold),
        |what| format!("{name}: {what}"),
    );
    Line::from(text).fg(colour).bold()
}

fn draw_cycles(frame: &mut Frame<'_>, area: Rect, telemetry: &Telemetry) {
    let room = usize::from(area.height.saturating_sub(3));
    let newest = telemetry.cycles.iter().rev().take(room).rev();
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
            format!("{:7.2}", cycle.advance_m * 1e3),
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

fn draw_health(frame: &mut Frame<'_>, area: Rect, subject: &Subject, telemetry: &Telemetry) {
    let tick_stats = &telemetry.tick_stats;
    let held_hz = telemetry.timing.map(|timing| (1e9 / timing.period_ns as f64).round());
    let rate_hz = held_hz.filter(|hz| hz.is_finite()).unwrap_or(subject.rate_hz);
    let mut lines = vec![
        Line::raw(format!("{} ticks at {rate_hz} Hz", telemetry.ticks())),
        Line::raw(format!(
            "{} overruns, {} link faults",
            telemetry.timing.map_or(0, |timing| timing.overruns),
            telemetry.state.map_or(0, |state| state.link_failures),
        )),
        Line::raw("µs         p50     p99      max").bold(),
    ];
    for (name, durations) in [
        ("wake", &tick_stats.wake),
        ("bus", &tick_stats.bus),
        ("compute", &tick_stats.compute),
    ] {
        let us = durations.percentiles();
        lines.push(Line::raw(format!(
            "{name:<8}{:>6.0}{:>8.0}{:>9.0}",
            us.p50, us.p99, us.max
        )));
    }
    let pauses = tick_stats.host_pauses;
    if pauses.count > 0 {
        lines.push(Line::raw(format!(
            "{} host pauses, {:.2} s",
            pauses.count, pauses.total_s
        )));
    }
    lines.extend(telemetry.recording.as_ref().map(|status| {
        let line = Line::raw(recording::progress_text(status));
        if recording::has_stopped(status) {
            line.fg(Color::Red)
        } else {
            line
        }
    }));
    if let Some(fraction) = telemetry
        .estimate
        .map(|estimate| estimate.battery_fraction)
        .filter(|fraction| fraction.is_finite())
    {
        lines.push(Line::raw(format!("battery {:.0} %", fraction * 100.0)));
    }
    if let Some(range) = telemetry.ranges.last() {
        lines.push(Line::raw(format!(
            "range {:.1} to {:.1} m",
            range.range_low_m, range.range_high_m
        )));
    }
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" loop ")), area);
}
