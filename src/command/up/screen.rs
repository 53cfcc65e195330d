//! What `wormd up` shows while the worm crawls: the live display, plain lines, or only the log.

use crate::command::{Failure, print};
use crate::supervisor::child_process::Log;
use crate::supervisor::crawl::Display;
use crate::watch::view::{self, Subject};
use crate::watch::{Telemetry, mismatch, recording, remarks};
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use ratatui::DefaultTerminal;
use std::collections::VecDeque;
use std::io::IsTerminal;
use std::os::fd::AsFd;
use std::time::Duration;
use worm_estimator::config::{Config, Direction};
use worm_estimator::message::{Alarm, AlarmKind, Cycle};

/// How many lines of the log the live display keeps.
const LOG_LINES: usize = 100;

/// How a run is shown.
pub(super) enum Screen {
    /// The live display.
    Live {
        terminal: Box<DefaultTerminal>,
        subject: Subject,
        log: VecDeque<String>,
    },
    /// A line for each cycle and alarm.
    Lines {
        cycles: u64,
        alarms: u64,
        step_order: Vec<usize>,
    },
    /// Standard output is reserved for the JSON; alarms go to the log.
    Silent { alarms: u64, step_order: Vec<usize> },
}

impl Screen {
    pub(super) fn open(json: bool, plain: bool, config: &Config) -> Result<Self, Failure> {
        let step_order = config.worm.step_order.clone();
        if json {
            return Ok(Self::Silent { alarms: 0, step_order });
        }
        if plain || !std::io::stdout().is_terminal() || !std::io::stdin().is_terminal() {
            return Ok(Self::Lines {
                cycles: 0,
                alarms: 0,
                step_order,
            });
        }
        let terminal = ratatui::try_init()
            .map_err(|error| Failure::failed(format!("the terminal cannot be used ({error}): try --plain")))?;
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
            step_order,
            full_scale_m: bounds_m.into_iter().fold(0.0, f64::max),
        };
        Ok(Self::Live {
            terminal: Box::new(terminal),
            subject,
            log: VecDeque::with_capacity(LOG_LINES),
        })
    }

    /// Restores the terminal and prints what the processes logged.
    pub(super) fn close(self, log: &Log) {
        if let Self::Live {
            mut terminal,
            log: shown,
            ..
        } = self
        {
            let cursor = terminal.show_cursor();
            if let Err(error) = ratatui::try_restore().and(cursor) {
                tracing::debug!("the terminal could not be restored: {error}");
                // Its drop would print to a standard error that is gone, and panic.
                Box::leak(terminal);
            }
            for line in shown {
                print::log_line(line);
            }
        }
        forward(log);
    }
}

impl Display for Screen {
    fn wait_for_stop(&mut self, time: Duration) -> bool {
        let Self::Live { .. } = self else {
            std::thread::sleep(time);
            return false;
        };
        is_stop_pressed(time)
    }

    fn show(&mut self, telemetry: &Telemetry, log: &Log) -> Result<(), Failure> {
        match self {
            Self::Live {
                terminal,
                subject,
                log: shown,
            } => {
                for line in log.lines.try_iter() {
                    if shown.len() == LOG_LINES {
                        shown.pop_front();
                    }
                    shown.push_back(line.to_string());
                }
                terminal
                    .draw(|frame| view::draw(frame, subject, telemetry, shown))
                    .map_err(|error| Failure::failed(format!("the terminal is gone: {error}")))?;
            }
            Self::Lines {
                cycles,
                alarms,
                step_order,
            } => {
                forward(log);
                for cycle in telemetry.cycles.since(*cycles) {
                    print::line(cycle_line(cycle))?;
                }
                *cycles = telemetry.cycles.total();
                for alarm in telemetry.alarms.since(*alarms) {
                    print::line(alarm_line(alarm, step_order))?;
                }
                *alarms = telemetry.alarms.total();
            }
            Self::Silent { alarms, step_order } => {
                forward(log);
                for alarm in telemetry.alarms.since(*alarms) {
                    print::log_line(alarm_line(alarm, step_order));
                }
                *alarms = telemetry.alarms.total();
            }
        }
        Ok(())
    }
}

/// Waits for `time` or a key; true for a key that stops the worm, and when the terminal is gone, since nobody could press one.
///
/// crossterm's own events do not serve here: once the terminal is gone they loop forever and ignore signals.
fn is_stop_pressed(time: Duration) -> bool {
    let stdin = std::io::stdin();
    let mut keyboard = [PollFd::new(stdin.as_fd(), PollFlags::POLLIN)];
    let timeout = PollTimeout::try_from(time).unwrap_or(PollTimeout::ZERO);
    match poll(&mut keyboard, timeout) {
        Ok(0) | Err(Errno::EINTR) => return false,
        Ok(_) => {}
        Err(_) => return true,
    }
    let mut keys = [0; 64];
    match nix::unistd::read(stdin.as_fd(), &mut keys) {
        Ok(0) => true,
        Ok(count) => means_stop(&keys[..count]),
        Err(Errno::EINTR | Errno::EAGAIN) => false,
        Err(_) => true,
    }
}

/// Whether this input of a terminal in raw mode contains Ctrl-C or q. Keys that send several characters begin with escape.
fn means_stop(keys: &[u8]) -> bool {
    const CTRL_C: u8 = 3;
    const ESCAPE: u8 = 27;
    keys.contains(&CTRL_C) || (keys.first() != Some(&ESCAPE) && keys.contains(&b'q'))
}

fn forward(log: &Log) {
    for line in log.lines.try_iter() {
        print::log_line(line);
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_ctrl_c_and_q_stop_the_worm() {
        for (keys, stops) in [
            (b"q".as_slice(), true),
            (b"\x03", true),
            (b"xq", true),
            (b"\x1b[A", false),
            (b"\x1bq", false),
            (b"\x1a", false),
        ] {
            assert_eq!(means_stop(keys), stops, "{keys:?}");
        }
    }
}
