//! A run without the live display: a line for each cycle and alarm, or only the log.

use crate::command::live::Painter;
use crate::command::{Failure, print};
use crate::supervisor::child_process::LogLines;
use crate::supervisor::crawl::SharedTelemetry;
use crate::watch::{RangeSummary, mismatch, range, recording, remarks};
use worm_estimator::message::{Alarm, AlarmKind, Cycle};

/// Shows a run on standard output, or only alarms in the log.
pub(super) struct LinePainter {
    telemetry: SharedTelemetry,
    log: LogLines,
    step_order: Vec<usize>,
    /// Cycles, ranges and alarms that were shown.
    cycles: u64,
    ranges: u64,
    alarms: u64,
    /// Standard output is reserved for the JSON.
    is_silent: bool,
}

impl LinePainter {
    pub(super) fn new(is_silent: bool, step_order: Vec<usize>, telemetry: SharedTelemetry, log: LogLines) -> Self {
        Self {
            telemetry,
            log,
            step_order,
            cycles: 0,
            ranges: 0,
            alarms: 0,
            is_silent,
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

    fn forward(&mut self) {
        self.log.take_new().for_each(print::log_line);
    }
}

impl Painter for LinePainter {
    fn key(&mut self, _: char) {}

    fn show(&mut self) -> Result<(), Failure> {
        self.forward();
        if self.is_silent {
            self.new_alarms().into_iter().for_each(print::log_line);
            return Ok(());
        }
        self.new_lines().into_iter().try_for_each(print::line)
    }

    fn leave(&mut self) {}

    fn enter(&mut self) -> Result<(), Failure> {
        Ok(())
    }

    fn close(&mut self) {
        self.forward();
    }
}

fn cycle_line(cycle: &Cycle) -> String {
    let advance = if cycle.advance_m.is_finite() {
        format!("advance {:6.2} mm, ", cycle.advance_m * 1e3)
    } else {
        String::new()
    };
    let head = format!("cycle {:>4}: {advance}", cycle.index);
    let electrical = format!("{:.1} mJ electrical", cycle.energy_electrical_j * 1e3);
    let remarks = remarks(cycle.advance_m, cycle.settled != 0, cycle.host_paused_s);
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
