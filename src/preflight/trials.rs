//! The trials of `wormd check`, which turn the cam: what was measured, and what it means.

use super::{CheckReport, Level};
use crate::control::Drive;
use crate::link::servo::scale;
use crate::link::{EmergencyStopError, EmergencyStopInput, MotionTrial, Prepared, StopInputs, WatchdogTrial};
use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use worm_estimator::config::Config;

/// Least displacement of a cell that says anything about the direction, m.
const LEAST_DISPLACEMENT_M: f64 = 3e-4;

/// Which trials to run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trials {
    /// Does the servo's watchdog stop the motor?
    pub watchdog: bool,
    /// Does the cam turn as it is told?
    pub motion: bool,
    /// Any of these flags ends a trial at once.
    pub signals: Vec<Arc<AtomicBool>>,
}

/// The worm that is tried.
pub(super) struct TrialWorm<'a> {
    pub config: &'a Config,
    pub drive: &'a mut Drive,
    pub prepared: &'a Prepared,
    /// Whether the worm would be armed, too. A servo whose watchdog is not trusted is turned only to try that watchdog.
    pub is_accepted: bool,
}

impl Trials {
    /// Whether there is anything to try.
    pub(crate) const fn is_any(&self) -> bool {
        self.watchdog || self.motion
    }

    /// Runs the trials, motion first: a watchdog can be tried only on a cam that turns. Without the configured emergency stop nothing
    /// turns.
    pub(super) fn run(
        &self,
        worm: &mut TrialWorm<'_>,
        emergency_stop: Result<Option<EmergencyStopInput>, EmergencyStopError>,
        report: &mut CheckReport,
    ) {
        let emergency_stop = match emergency_stop {
            Ok(input) => input,
            Err(_) => {
                for (_, subject) in [(self.motion, "motion"), (self.watchdog, "watchdog")]
                    .into_iter()
                    .filter(|(is_asked, _)| *is_asked)
                {
                    let remedy = "make the emergency stop readable first: nothing else ends a trial at the worm";
                    report.note(Level::Error, subject, "was not tried", remedy);
                }
                return;
            }
        };
        let mut stops = StopInputs::new(&self.signals, emergency_stop);
        if self.motion {
            if worm.is_accepted {
                match worm.drive.try_motion(worm.config.servo.positive_is_forward, &mut stops) {
                    Ok(trial) => report_motion(worm.config, &trial, report),
                    Err(error) => report.note(Level::Error, "motion", "could not be tried", error.to_string()),
                }
            } else {
                let remedy = "try the watchdog alone (--try-watchdog), with a hand on the supply's switch";
                report.note(
                    Level::Error,
                    "motion",
                    "was not tried: the worm would not be armed",
                    remedy,
                );
            }
            report_home(worm.config, worm.prepared, report);
        }
        if self.watchdog {
            match worm.drive.try_watchdog(&mut stops) {
                Ok(trial) => report_watchdog(&trial, report),
                Err(error) => report.note(Level::Error, "watchdog", "could not be tried", error.to_string()),
            }
        }
    }
}

fn report_watchdog(trial: &WatchdogTrial, report: &mut CheckReport) {
    let WatchdogTrial {
        latched,
        stopped,
        turned_for_s,
        watchdog_s,
    } = *trial;
    let (turned_for_ms, watchdog_ms) = (1e3 * turned_for_s, 1e3 * watchdog_s);
    if trial.is_passed() {
        report.good(
            "watchdog",
            format!("the motor stopped {turned_for_ms:.0} ms after the last packet, set to {watchdog_ms:.0} ms"),
        );
    } else if stopped {
        report.note(
            Level::Error,
            "watchdog",
            format!("the motor stopped {turned_for_ms:.0} ms after the last packet, set to {watchdog_ms:.0} ms, latched: {latched}"),
            "something else stopped it, or too late: look for another controller on the bus, and try again",
        );
    } else {
        report.note(
            Level::Error,
            "watchdog",
            format!(
                "the motor still turned {turned_for_ms:.0} ms after the last packet, set to {watchdog_ms:.0} ms, latched: {latched}"
            ),
            "nothing stops this motor when the computer fails: update the servo's firmware with DYNAMIXEL Wizard 2.0",
        );
    }
}

fn report_motion(config: &Config, trial: &MotionTrial, report: &mut CheckReport) {
    let (there_deg, back_deg) = (trial.there_rad.to_degrees(), trial.back_rad.to_degrees());
    report.good(
        "motion",
        format!(
            "turned {there_deg:.1} degrees there and {back_deg:.1} back at up to {:.2} A: the position follows the goal",
            trial.greatest_a
        ),
    );
    let forward = config.servo.positive_is_forward;
    match trial
        .cell_moved_m
        .filter(|moved_m| moved_m.abs() >= LEAST_DISPLACEMENT_M)
    {
        Some(moved_m) if moved_m > 0.0 => report.good(
            "direction",
            format!(
                "a cell moved forward by {:.1} mm, as servo.positive_is_forward = {forward} says",
                1e3 * moved_m
            ),
        ),
        Some(moved_m) => report.note(
            Level::Error,
            "direction",
            format!(
                "a cell moved backward by {:.1} mm where it should have moved forward",
                -1e3 * moved_m
            ),
            format!(
                "set servo.positive_is_forward = {}, or check the direction of the tracker",
                !forward
            ),
        ),
        None => report.note(
            Level::Warning,
            "direction",
            "no cell was seen to move",
            "watch the cam: does it turn as in a forward crawl? If not, invert servo.positive_is_forward",
        ),
    }
}

/// Where the cam stands in the gait cycle.
fn report_home(config: &Config, prepared: &Prepared, report: &mut CheckReport) {
    let position = (prepared.servo_reading.position_rad / scale::POSITION_RAD).round();
    let counts = position - f64::from(config.servo.home_position);
    let sign = if config.servo.positive_is_forward { 1.0 } else { -1.0 };
    let phase = (sign * counts * scale::POSITION_RAD / TAU).rem_euclid(1.0);
    report.good(
        "home",
        format!(
            "the cam stands at {phase:.3} of a gait cycle: position {position}, servo.home_position {}",
            config.servo.home_position
        ),
    );
}
