//! The thread that writes to the terminal.

use super::Style;
use crate::command::{Failure, print};
use crate::supervisor::child_process::LogLines;
use crate::supervisor::crawl::SharedTelemetry;
use crate::watch::view::{self, Subject};
use crate::watch::{RangeSummary, mismatch, range, recording, remarks};
use ratatui::DefaultTerminal;
use std::collections::VecDeque;
use worm_estimator::config::{Config, Direction};
use worm_estimator::message::{Alarm, AlarmKind, Cycle};

/// How many lines of the log the live display keeps.
const LOG_LINES: usize = 100;

/// Shows a run. It alone writes to the terminal, and may wait for it.
pub(super) struct Painter {
    telemetry: SharedTelemetry,
    log: LogLines,
    step_order: Vec<usize>,
    /// Cycles, ranges and alarms that were shown.
    cycles: u64,
    ranges: u64,
    alarms: u64,
    style: Style,
    live: Option<Live>,
}

/// The live display.
struct Live {
    terminal: Box<DefaultTerminal>,
    subject: Subject,
    /// The last lines of the log.
    shown: VecDeque<String>,
}

impl Painter {
    pub(super) fn open(
        style: Style,
        config: &Config,
        telemetry: SharedTelemetry,
        log: LogLines,
    ) -> Result<Self, Failure> {
        let live = match style {
            Style::Live => Some(Live::open(config)?),
            Style::Lines | Style::Silent => None,
        };
        Ok(Self {
            telemetry,
            log,
            step_order: config.worm.step_order.clone(),
            cycles: 0,
            ranges: 0,
            alarms: 0,
            style,
            live,
        })
    }

    /// Shows what is new.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the terminal or standard output is gone.
    pub(super) fn show(&mut self) -> Result<(), Failure> {
        if let Some(live) = &mut self.live {
            for line in self.log.take_new() {
                if live.shown.len() == LOG_LINES {
                    live.shown.pop_front();
                }
                live.shown.push_back(line.to_string());
            }
            return live.draw(&self.telemetry);
        }
        self.forward();
        match self.style {
            Style::Lines => self.new_lines().into_iter().try_for_each(print::line),
            Style::Live | Style::Silent => {
                self.new_alarms().into_iter().for_each(print::log_line);
                Ok(())
            }
        }
    }

    /// Lines about what is new. The telemetry is free again before they are printed.
    fn new_lines(&mut self) -> Vec<String> {
        let mut lines: Vec<String> = {
            let telemetry = self.telemetry.lock();
            let seen = std::mem::replace(&mut self.cycles, telemetry.cycles.total());
            let mut lines: Vec<String> = telemetry.cycles.since(seen).map(cycle_line).collect();
            let seen = std::mem::replace(&mut self.ranges, telemetry.ranges.total());
            let ranges = telemetry.ranges.since(seen);
            lines.extend(ranges.map(|range| range::text(&RangeSummary::of(range))));
            lines
        };
        lines.extend(self.new_alarms());
        lines
    }

    fn new_alarms(&mut self) -> Vec<String> {
        let telemetry = self.telemetry.lock();
        let seen = std::mem::replace(&mut self.alarms, telemetry.alarms.total());
        let new = telemetry.alarms.since(seen);
        new.map(|alarm| alarm_line(alarm, &self.step_order)).collect()
    }

    /// Leaves the terminal to others.
    pub(super) fn leave(&mut self) {
        if let Some(live) = &mut self.live {
            live.leave();
        }
    }

    /// Takes the terminal again.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the terminal is gone.
    pub(super) fn enter(&mut self) -> Result<(), Failure> {
        match &mut self.live {
            Some(live) => live.enter(),
            None => Ok(()),
        }
    }

    /// Restores the terminal and prints what the processes logged.
    pub(super) fn close(&mut self) {
        if let Some(mut live) = self.live.take() {
            let is_left = live.leave();
            live.shown.drain(..).for_each(print::log_line);
            if !is_left {
                // Its drop would print to a standard error that is gone, and panic.
                Box::leak(live.terminal);
            }
        }
        self.forward();
    }

    fn forward(&mut self) {
        self.log.take_new().for_each(print::log_line);
    }
}

impl Live {
    fn open(config: &Config) -> Result<Self, Failure> {
        let bounds_m = config.worm.max_deformation_m.to_vec(config.worm.cells);
        let subject = Subject {
            name: config.worm.name.clone(),
            port: config
                .port
                .as_ref()
                .map_or("the virtual worm".to_owned(), |port| port.path.clone()),
            slope_deg: config.canal.slope_deg,
            backward: config.gait.direction == Direction::Backward,
            rate_hz: config.control.rate_hz,
            step_order: config.worm.step_order.clone(),
            full_scale_m: bounds_m.into_iter().fold(0.0, f64::max),
        };
        Ok(Self {
            terminal: Box::new(init()?),
            subject,
            shown: VecDeque::with_capacity(LOG_LINES),
        })
    }

    /// Draws the newest telemetry. It is free again before the picture goes to the terminal.
    fn draw(&mut self, telemetry: &SharedTelemetry) -> Result<(), Failure> {
        let (subject, shown) = (&self.subject, &self.shown);
        self.terminal
            .draw(|frame| view::draw(frame, subject, &telemetry.lock(), shown))
            .map(drop)
            .map_err(|error| Failure::failed(format!("the terminal is gone: {error}")))
    }

    /// Restores the terminal; false when that failed.
    fn leave(&mut self) -> bool {
        let cursor = self.terminal.show_cursor();
        match ratatui::try_restore().and(cursor) {
            Ok(()) => true,
            Err(error) => {
                tracing::debug!("the terminal could not be restored: {error}");
                false
            }
        }
    }

    fn enter(&mut self) -> Result<(), Failure> {
        // The old one has nothing left to restore.
        *self.terminal = init()?;
        Ok(())
    }
}

fn init() -> Result<DefaultTerminal, Failure> {
    ratatui::try_init().map_err(|error| Failure::failed(format!("the terminal cannot be used ({error}): try --plain")))
}

fn cycle_line(cycle: &Cycle) -> String {
    let head = format!("cycle {:>4}: advance {:6.2} mm, ", cycle.index, cycle.advance_m * 1e3);
    let electrical = format!("{:.1} mJ electrical", cycle.energy_electrical_j * 1e3);
    let remarks = remarks(cycle.settled != 0, cycle.host_paused_s);
    if !cycle.energy_loss_sigma_j.is_finite() {
        return format!("{head}{electrical}{remarks}");
    }
    format!(
        "{head}energy {:6.2} ± {:.2} mJ by losses, {:6.2} mJ by the actuator, {electrical}{remarks}",
        cycle.energy_loss_j * 1e3,
        cycle.energy_loss_sigma_j * 1e3,
        cycle.energy_actuator_net_j * 1e3,
    )
}

fn alarm_line(alarm: &Alarm, step_order: &[usize]) -> String {
    let kind = AlarmKind::try_from(alarm.kind).map_or("unknown", AlarmKind::name);
    let cell = if alarm.cell == u32::MAX {
        String::new()
    } else {
        format!(", cell {}", alarm.cell + 1)
    };
    let change = if alarm.raised == 0 { "cleared" } else { "RAISED" };
    if let Some(what) = mismatch::text_of(alarm, step_order) {
        return format!("alarm {kind}: {change}, {what}");
    }
    if let Some(what) = recording::alarm_text(alarm) {
        return format!("alarm {kind}: {change}, {what}");
    }
    format!(
        "alarm {kind}{cell}: {change}, {:.4} against {:.4}",
        alarm.value, alarm.threshold
    )
}
