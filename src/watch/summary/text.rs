//! The summary of a run as text.

use super::super::inferred::InferredSummary;
use super::super::{mismatch, range, recording};
use super::{CycleSummary, Summary};
use std::fmt;
use worm_estimator::message::AlarmKind;

/// The columns of a cycle's mechanical energy, with dashes where it is not known: the tips' deformations were not known yet.
struct MechanicalEnergy<'a>(&'a CycleSummary);

impl fmt::Display for MechanicalEnergy<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cycle = self.0;
        if !cycle.energy_loss_sigma_j.is_finite() {
            return write!(f, "{:>7}  {:>4}  {:>9}  {:>14}", "-", "", "-", "-");
        }
        write!(
            f,
            "{:>7.2} ±{:>4.2}  {:>9.2}  {:>14.2}",
            cycle.energy_loss_j * 1e3,
            cycle.energy_loss_sigma_j * 1e3,
            cycle.energy_actuator_net_j * 1e3,
            cycle.energy_actuator_positive_j * 1e3,
        )
    }
}

/// A number in a column of `width`, or a dash where it is not known.
fn number(value: f64, width: usize, digits: usize) -> String {
    if value.is_finite() {
        format!("{value:>width$.digits$}")
    } else {
        format!("{:>width$}", "-")
    }
}

/// Remarks on a gait cycle, to follow its numbers.
pub fn remarks(advance_m: f64, settled: bool, host_paused_s: f64) -> String {
    let mut remarks = String::new();
    if advance_m.is_nan() {
        remarks += " (without positions)";
    } else if !settled {
        remarks += " (settling)";
    }
    if host_paused_s > 0.0 {
        remarks += &format!(" (computer paused {host_paused_s:.2} s)");
    }
    remarks
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} ticks in {:.1} s, {} overruns, {} samples lost",
            self.worm, self.ticks, self.duration_s, self.overruns, self.samples_lost
        )?;
        if self.cycles.is_empty() {
            writeln!(f, "no gait cycle was finished")?;
        } else {
            writeln!(
                f,
                "cycle  advance    energy (11)   (13) net   (13) positive  electrical   copper  friction inside     COT"
            )?;
            writeln!(
                f,
                "            mm             mJ         mJ              mJ          mJ       mJ               mJ"
            )?;
        }
        if self.cycles_dropped > 0 {
            writeln!(f, "  …    {} older cycles", self.cycles_dropped)?;
        }
        for cycle in &self.cycles {
            writeln!(
                f,
                "{:>5}  {}  {}  {:>10.1}  {:>7.1}  {}  {:>6}{}",
                cycle.index,
                number(cycle.advance_m * 1e3, 7, 3),
                MechanicalEnergy(cycle),
                cycle.energy_electrical_j * 1e3,
                cycle.energy_copper_j * 1e3,
                number(cycle.energy_friction_inside_j * 1e3, 15, 1),
                cycle.cot.map_or("-".to_owned(), |cot| format!("{cot:.2}")),
                remarks(cycle.advance_m, cycle.settled, cycle.host_paused_s),
            )?;
        }
        if let Some(Some(predicted_m)) = self.cycles.last().map(|cycle| cycle.predicted_advance_m) {
            let energy_j = self
                .cycles
                .last()
                .and_then(|cycle| cycle.predicted_energy_loss_j)
                .unwrap_or(f64::NAN);
            writeln!(f, "model  {:>7.3}  {:>7.2}", predicted_m * 1e3, energy_j * 1e3)?;
        }
        if let Some(range) = &self.range {
            writeln!(f, "{}", range::text(range))?;
        }
        if let Some(text) = self.inferred.as_ref().and_then(InferredSummary::text) {
            writeln!(f, "by current  {text}")?;
        }
        for alarm in &self.alarms {
            let cell = match (alarm.cell, &alarm.place) {
                (Some(cell), Some(place)) => {
                    let what = mismatch::text(cell, place.stepping_cell, place.phase, alarm.value);
                    format!(" ({what}; `wormd explain` names the cause)")
                }
                (Some(cell), None) => format!(" (cell {cell})"),
                (None, _) if alarm.alarm == AlarmKind::RecordingStopped.name() => {
                    format!(" ({})", recording::text(alarm.value, alarm.threshold))
                }
                (None, _) => String::new(),
            };
            let cleared = alarm
                .cleared_s
                .map_or("still raised".to_owned(), |s| format!("cleared at {s:.2} s"));
            writeln!(
                f,
                "alarm  {}{cell}: {}, raised at {:.2} s, {cleared}; {:.4} against {:.4}",
                alarm.alarm, alarm.severity, alarm.raised_s, alarm.value, alarm.threshold
            )?;
        }
        for coverage in &self.alarm_coverage {
            // What the user has not configured he does not miss.
            if let Some(reason) = coverage
                .reason
                .filter(|_| coverage.alarm != AlarmKind::BatteryLow.name())
            {
                writeln!(f, "{:<8} {}: {reason}", coverage.coverage, coverage.alarm)?;
            }
        }
        let timing = &self.timing;
        writeln!(f, "timing µs     p50      p99    p99.9      max")?;
        for (name, p) in [
            ("wake", timing.wake_us),
            ("bus", timing.bus_us),
            ("compute", timing.compute_us),
            ("publish", timing.publish_us),
            ("notify", timing.notify_us),
        ] {
            writeln!(
                f,
                "{name:<8} {:>8.1} {:>8.1} {:>8.1} {:>8.1}",
                p.p50, p.p99, p.p99_9, p.max
            )?;
        }
        for (culprit, ticks) in &timing.culprits {
            writeln!(f, "late     {ticks} tick(s), culprit {culprit}")?;
        }
        let pauses = timing.host_pauses;
        if pauses.count > 0 {
            writeln!(f, "{pauses}")?;
        }
        if let Some(worst) = timing.worst_ticks.ticks().first().filter(|worst| worst.late) {
            writeln!(
                f,
                "worst    tick {}: {:.0} µs after its deadline, of these wake {:.0}, bus {:.0}, compute {:.0}, publish {:.0}, notify {:.0}; \
                 culprit {}",
                worst.sequence,
                worst.total_us(),
                worst.wake_us,
                worst.bus_us,
                worst.compute_us,
                worst.publish_us,
                worst.notify_us,
                worst.culprit
            )?;
        }
        if self.fault != "none" {
            writeln!(
                f,
                "FAULT  {}: see the alarms and the log above, and fix the cause before the next start",
                self.fault
            )?;
        }
        Ok(())
    }
}
