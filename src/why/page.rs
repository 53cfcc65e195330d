//! An explanation as one self-contained page: the reason, the remedy, the last seconds in pictures, and every event.

use super::answer::Explanation;
use super::text::{headline, last_cycles, lead, signs};
use super::timeline::{MomentKind, figure as number};
use std::path::{Path, PathBuf};
use worm_analysis::report::page::{Figure, Key, Mark, Page, Panel, Table};
use worm_analysis::report::plot::{
    ACCENT, Axis, Colour, DrawError, INK, MUTED, Plot, Row, Sheet, Stroke, VERMILION, cell_colours, draw,
};
use worm_analysis::report::{ReportError, file};
use worm_estimator::config::Config;
use worm_estimator::message::{State, Timing};
use worm_estimator::winding::Reported;
use worm_log::Log;

/// What the pictures show before the stop and after it, s.
const BEFORE_S: f64 = 20.0;
const AFTER_S: f64 = 5.0;

/// Writes `why.html` and `why.json` into a directory, which is made if necessary. Files of an earlier run are replaced, each at once.
/// Returns where the page is.
///
/// # Errors
/// [`ReportError::Drawing`] before anything is written; [`ReportError::File`].
pub(crate) fn write(dir: &Path, explanation: &Explanation, log: &Log, config: &Config) -> Result<PathBuf, ReportError> {
    let page = page(explanation, log, config)?;
    let json = serde_json::to_string_pretty(explanation)? + "\n";
    file::make_directory(dir)?;
    file::replace(dir.join("why.json"), json.as_bytes())?;
    file::replace(dir.join("why.html"), page.as_bytes())
}

fn page(explanation: &Explanation, log: &Log, config: &Config) -> Result<String, DrawError> {
    let mut page = Page::new(&headline(explanation), &lead(explanation)).with_style(include_str!("style.css"));
    let class = match (explanation.stopped, explanation.reason.kind) {
        (true, "command" | "time-limit") => "stop wanted",
        (true, _) => "stop",
        (false, _) => "stop went-on",
    };
    page.paragraph_of(class, &explanation.reason.sentence);
    page.paragraph_of("todo", &format!("What to do: {}", explanation.remedy));
    if let Some(signs) = signs(explanation) {
        page.paragraph(&signs);
    }
    page.warnings(&explanation.warnings);
    page.heading("The last seconds");
    let window = Window::around(explanation.time_ns, log);
    page.figure(&worm_figure(&window, config)?);
    page.figure(&motor_figure(&window, explanation, config)?);
    page.figure(&timing_figure(&window, config)?);
    page.heading("What happened");
    page.add(events(explanation));
    page.heading("The gait cycles before it");
    page.paragraph(&last_cycles(explanation));
    if let Some(details) = &explanation.last_cycles.details {
        page.paragraph(details);
    }
    page.paragraph_of("note", &format!("From {}.", explanation.log));
    Ok(page.finish())
}

/// The part of the log that is drawn.
struct Window<'l> {
    zero_ns: u64,
    states: Vec<&'l State>,
    timings: Vec<&'l Timing>,
    x: Axis,
}

impl<'l> Window<'l> {
    fn around(zero_ns: u64, log: &'l Log) -> Self {
        let is_shown = |time_ns: u64| (-BEFORE_S..=AFTER_S).contains(&relative_s(time_ns, zero_ns));
        let states: Vec<&State> = log.states.iter().filter(|state| is_shown(state.time_ns)).collect();
        let of_states = states.iter().map(|state| relative_s(state.time_ns, zero_ns));
        // A log that ends earlier leaves no empty room.
        let last_s = of_states.fold(0.5, f64::max).min(AFTER_S);
        let first_s = states
            .first()
            .map_or(-BEFORE_S, |state| relative_s(state.time_ns, zero_ns))
            .min(-0.5);
        Self {
            zero_ns,
            timings: log
                .timings
                .iter()
                .filter(|timing| is_shown(timing.deadline_ns))
                .collect(),
            x: Axis::between(first_s, last_s, 8),
            states,
        }
    }

    fn of_states(&self, value: impl Fn(&State) -> f64) -> Vec<(f64, f64)> {
        let points = self.states.iter();
        points
            .map(|state| (relative_s(state.time_ns, self.zero_ns), value(state)))
            .collect()
    }

    fn of_timings(&self, value: impl Fn(&Timing) -> f64) -> Vec<(f64, f64)> {
        let points = self.timings.iter();
        points
            .map(|timing| (relative_s(timing.deadline_ns, self.zero_ns), value(timing)))
            .collect()
    }

    fn sheet(&self, description: &str, rows: Vec<Row>) -> Sheet {
        Sheet {
            description: description.to_owned(),
            x_label: Some("time from the stop, s".to_owned()),
            x: self.x.clone(),
            rows,
        }
    }
}

fn relative_s(time_ns: u64, zero_ns: u64) -> f64 {
    (time_ns as f64 - zero_ns as f64) * 1e-9
}

fn heights(lines: &[Vec<(f64, f64)>]) -> impl Iterator<Item = f64> + '_ {
    lines
        .iter()
        .flatten()
        .map(|(_, value)| *value)
        .filter(|value| value.is_finite())
}

/// A vertical line where the worm stopped.
fn mark(plot: &mut Plot<'_, '_, '_>, y: &Axis, name: &str) -> Result<(), DrawError> {
    plot.threshold(0.0, [y.low(), y.high()], INK, name)
}

fn worm_figure(window: &Window<'_>, config: &Config) -> Result<Figure, DrawError> {
    let cells = config.worm.cells;
    let first_m = |cell: usize| window.states.iter().find_map(|state| state.position_of(cell));
    let origin_m = (0..cells).filter_map(first_m).fold(f64::INFINITY, f64::min);
    let origin_m = if origin_m.is_finite() { origin_m } else { 0.0 };
    let lines: Vec<_> = (0..cells)
        .map(|cell| window.of_states(|state| state.position_of(cell).map_or(f64::NAN, |m| (m - origin_m) * 1e3)))
        .collect();
    let phase = window.of_states(|state| state.phase);
    let rows = vec![
        Row::new(Axis::around(heights(&lines), 5), 240.0),
        Row::new(Axis::around(heights(std::slice::from_ref(&phase)), 4), 90.0),
    ];
    let axes: Vec<Axis> = rows.iter().map(|row| row.y.clone()).collect();
    let colours = cell_colours(cells);
    let svg = draw(
        &window.sheet("Positions of the cells and gait phase before the stop", rows),
        |row, plot| {
            mark(plot, &axes[row], if row == 0 { "stop" } else { "" })?;
            if row == 1 {
                return plot.line(phase.iter().copied(), Stroke::new(INK, 1.3));
            }
            for (colour, line) in colours.iter().zip(&lines) {
                plot.line(line.iter().copied(), Stroke::new(*colour, 1.3))?;
            }
            Ok(())
        },
    )?;
    let of_cells = colours.iter().enumerate();
    Ok(Figure {
        id: "worm",
        title: "What the worm did",
        keys: of_cells
            .map(|(cell, colour)| Key::new(Mark::Line, *colour, format!("cell {}", cell + 1)))
            .collect(),
        panels: vec![Panel::new("positions, mm, and below them the gait phase, cycles", "", svg)],
        caption: "Positions count from the first one of the hindmost cell that is shown. Where a line breaks, the tracker did not see the cell."
            .to_owned(),
    })
}

fn motor_figure(window: &Window<'_>, explanation: &Explanation, config: &Config) -> Result<Figure, DrawError> {
    let limit_a = config.limits.current_a;
    let winding = config.winding();
    let current = window.of_states(|state| winding.current_a(&Reported::from(state)));
    let measured = window.of_states(|state| state.motor_velocity_rad_s);
    let commanded = window.of_states(|state| state.goal_velocity_rad_s);
    let voltage = window.of_states(|state| state.bus_voltage_v);
    let limit_v = config.limits.voltage_v;
    let with = |line: &Vec<(f64, f64)>, more: &[f64]| {
        let values = heights(std::slice::from_ref(line)).chain(more.iter().copied());
        Axis::around(values.collect::<Vec<_>>(), 4)
    };
    let rows = vec![
        Row::new(with(&current, &[0.0, limit_a]), 120.0),
        Row::new(
            Axis::around(heights(&[measured.clone(), commanded.clone()]).collect::<Vec<_>>(), 4),
            110.0,
        ),
        Row::new(with(&voltage, &[limit_v]), 80.0),
    ];
    let axes: Vec<Axis> = rows.iter().map(|row| row.y.clone()).collect();
    let limit = |plot: &mut Plot<'_, '_, '_>, at: f64| plot.horizontal_line(at, Stroke::new(VERMILION, 1.3).dashed());
    let thick = |colour: Colour| Stroke::new(colour, 1.4);
    let name = if explanation.stopped { "stop" } else { "alarm" };
    let svg = draw(&window.sheet("Motor before the stop", rows), |row, plot| {
        mark(plot, &axes[row], if row == 0 { name } else { "" })?;
        match row {
            0 => {
                limit(plot, limit_a)?;
                plot.line(current.iter().copied(), thick(ACCENT))
            }
            1 => {
                plot.line(measured.iter().copied(), thick(ACCENT))?;
                plot.line(commanded.iter().copied(), Stroke::new(MUTED, 1.4).dashed())
            }
            _ => {
                limit(plot, limit_v)?;
                plot.line(voltage.iter().copied(), thick(ACCENT))
            }
        }
    })?;
    Ok(Figure {
        id: "motor",
        title: "What the motor did",
        keys: vec![
            Key::new(Mark::Line, ACCENT, "measured"),
            Key::new(Mark::Dashed, MUTED, "commanded speed"),
            Key::new(Mark::Dashed, VERMILION, "limit"),
        ],
        panels: vec![Panel::new(
            "current, A; speed of the cam, rad/s; bus voltage, V",
            "",
            svg,
        )],
        caption: format!(
            "The controller stops at {} A for {} s and below {} V.",
            number(limit_a),
            number(config.limits.current_time_s),
            number(limit_v)
        ),
    })
}

fn timing_figure(window: &Window<'_>, config: &Config) -> Result<Figure, DrawError> {
    let wake = window.of_timings(|timing| timing.wake_lateness_ns as f64 * 1e-3);
    let whole = window.of_timings(|timing| {
        let parts = [
            timing.wake_lateness_ns,
            timing.bus_ns,
            timing.compute_ns,
            timing.notify_ns,
        ];
        parts.iter().sum::<u64>() as f64 * 1e-3
    });
    let period_us = 1e6 / config.control.rate_hz;
    let largest = heights(&[wake.clone(), whole.clone()]).collect::<Vec<_>>();
    let axis = Axis::around(largest.into_iter().chain([0.0, period_us]), 4);
    let svg = draw(
        &window.sheet(
            "Timing of the loop before the stop",
            vec![Row::new(axis.clone(), 120.0)],
        ),
        |_, plot| {
            mark(plot, &axis, "")?;
            plot.horizontal_line(period_us, Stroke::new(VERMILION, 1.3).dashed())?;
            plot.line(whole.iter().copied(), Stroke::new(MUTED, 1.0))?;
            plot.line(wake.iter().copied(), Stroke::new(ACCENT, 1.2))
        },
    )?;
    Ok(Figure {
        id: "timing",
        title: "What the loop did",
        keys: vec![
            Key::new(Mark::Line, ACCENT, "wake lateness"),
            Key::new(
                Mark::Line,
                MUTED,
                "wake, bus, computation and waking listeners together",
            ),
            Key::new(Mark::Dashed, VERMILION, "period"),
        ],
        panels: vec![Panel::new("µs of a tick", "", svg)],
        caption: "A tick that takes longer than the period makes the next one late.".to_owned(),
    })
}

fn events(explanation: &Explanation) -> Table {
    let mut table = Table::new("Events, s from the stop", ["time", "kind", "what"]).with_word_columns(3);
    let kind = |kind: MomentKind| match kind {
        MomentKind::AlarmRaised | MomentKind::AlarmCleared => "alarm",
        MomentKind::Mode => "mode",
        MomentKind::Fault => "fault",
        MomentKind::Command => "command",
        MomentKind::Limit => "limit",
        MomentKind::Silence => "silence",
        MomentKind::Computer => "computer",
        MomentKind::Start => "start",
        MomentKind::EmergencyStop => "emergency stop",
    };
    table.rows = explanation
        .events
        .iter()
        .map(|event| {
            vec![
                format!("{:.3}", event.time_s),
                kind(event.kind).to_owned(),
                event.text.clone(),
            ]
        })
        .collect();
    table
}
