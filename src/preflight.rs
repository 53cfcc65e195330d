//! The checks of `wormd check`: what keeps this worm from running on this computer with this configuration, and the remedies.

mod logout;
mod trials;

use crate::control::{Drive, DriveError, link_settings};
use crate::link::{EmergencyStopError, EmergencyStopInput, LinkSettings, Prepared, StartupError};
use crate::realtime::machine::{self, Setting};
use crate::realtime::{self, EffectiveSettings};
use crate::topics::{Hub, Instance};
use serde::Serialize;
use std::f64::consts::TAU;
use std::path::Path;
use worm_estimator::config::{Config, Realtime};
use worm_estimator::estimate::alarm::Coverage;
use worm_estimator::message::AlarmKind;

use trials::TrialWorm;

pub(crate) use trials::Trials;

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Level {
    /// As it should be.
    Good,
    /// The worm runs, but not as well as it could.
    Warning,
    /// The worm does not run.
    Error,
}

/// The result of one check.
#[derive(Debug, Serialize)]
pub(crate) struct CheckItem {
    /// How much it matters.
    pub level: Level,
    /// What was checked.
    pub subject: &'static str,
    /// What was found.
    pub found: String,
    /// What to do about it; null where nothing needs doing.
    pub remedy: Option<String>,
}

impl From<Setting> for CheckItem {
    fn from(setting: Setting) -> Self {
        Self {
            level: if setting.good { Level::Good } else { Level::Warning },
            subject: setting.subject,
            found: setting.found,
            remedy: setting.remedy,
        }
    }
}

/// All results, as `wormd check --json` prints them.
#[derive(Debug, Serialize)]
pub(crate) struct CheckReport {
    worm: String,
    /// In the order of the checks.
    pub findings: Vec<CheckItem>,
}

impl CheckReport {
    /// Runs all checks, and the trials that are asked for. `source` says where the configuration comes from.
    pub(crate) fn new(config: &Config, source: &str, trials: &Trials) -> Self {
        let mut report = Self {
            worm: config.worm.name.clone(),
            findings: Vec::new(),
        };
        check_config(source, config, &mut report);
        check_realtime(&config.realtime, &mut report);
        for setting in machine::settings(config.realtime.cpu) {
            report.findings.push(setting.into());
        }
        check_topics(config, &mut report);
        let emergency_stop = check_emergency_stop(config, &mut report);
        check_port(config, trials, emergency_stop, &mut report);
        report
    }

    /// How many findings keep the worm from running.
    pub(crate) fn errors(&self) -> usize {
        let errors = self.findings.iter().filter(|finding| finding.level == Level::Error);
        errors.count()
    }

    fn good(&mut self, subject: &'static str, found: impl Into<String>) {
        self.findings.push(CheckItem {
            level: Level::Good,
            subject,
            found: found.into(),
            remedy: None,
        });
    }

    fn note(&mut self, level: Level, subject: &'static str, found: impl Into<String>, remedy: impl Into<String>) {
        self.findings.push(CheckItem {
            level,
            subject,
            found: found.into(),
            remedy: Some(remedy.into()),
        });
    }
}

fn check_config(source: &str, config: &Config, report: &mut CheckReport) {
    report.good(
        "configuration",
        format!("{source}: {} cells, {} Hz", config.worm.cells, config.control.rate_hz),
    );
    for advice in config.advice() {
        report.note(Level::Warning, "configuration", advice.key, advice.text);
    }
    check_alarms(config, report);
}

/// Which alarms can speak on this worm. What it lacks on purpose is no warning.
fn check_alarms(config: &Config, report: &mut CheckReport) {
    let names = |wanted: &str| {
        let all = AlarmKind::ALL.iter().map(|kind| (kind, Coverage::of(*kind, config)));
        let wanted = all.filter(|(_, coverage)| coverage.name() == wanted);
        wanted
            .map(|(kind, coverage)| match coverage.reason() {
                None => kind.name().to_owned(),
                Some(reason) => format!("{} ({reason})", kind.name()),
            })
            .collect::<Vec<_>>()
    };
    for (coverage, words) in [
        ("full", "watched"),
        ("partial", "watched in part"),
        ("off", "not watched"),
    ] {
        let names = names(coverage);
        if !names.is_empty() {
            report.good("alarms", format!("{words}: {}", names.join(", ")));
        }
    }
}

/// Requests what the loop would request, in a thread that ends at once, and reads back what that thread got.
fn check_realtime(wanted: &Realtime, report: &mut CheckReport) {
    let trial = {
        let wanted = wanted.clone();
        move || (realtime::request(&wanted, 0), EffectiveSettings::of_this_thread())
    };
    let Ok((grants, effective)) = std::thread::spawn(trial).join() else {
        report.note(
            Level::Error,
            "scheduler",
            "the trial thread failed",
            "report this as a defect of wormd",
        );
        return;
    };
    for grant in grants {
        match grant.refusal {
            None => report.good("operating system", grant.request),
            Some(refusal) => report.note(
                Level::Warning,
                "operating system",
                format!("{} refused: {}", grant.request, refusal.reason),
                refusal.remedy,
            ),
        }
    }
    match effective {
        Ok(effective) => {
            let shortfalls = effective.shortfalls(wanted, 0);
            if shortfalls.is_empty() {
                report.good("in force", effective.to_string());
            } else {
                report.note(
                    Level::Warning,
                    "in force",
                    effective.to_string(),
                    format!("less than configured: {}", shortfalls.join("; ")),
                );
            }
        }
        Err(error) => report.note(
            Level::Warning,
            "in force",
            format!("cannot be read back: {error}"),
            "mount /proc, so that wormd can read what the kernel really grants",
        ),
    }
}

fn check_topics(config: &Config, report: &mut CheckReport) {
    report.findings.extend(logout::findings());
    // What every process of the worm does first. It does not disturb a running worm.
    let instance = match Instance::of(config) {
        Ok(instance) => instance,
        // The error's text includes the remedy.
        Err(error) => return report.note(Level::Error, "topics", "cannot be used", error.to_string()),
    };
    match Hub::open(&instance) {
        Ok(_) => report.good(
            "topics",
            format!("those of {} open in {}", config.worm.name, instance.root().display()),
        ),
        Err(error) => report.note(Level::Error, "topics", "cannot be used", error.to_string()),
    }
    match nix::sys::statfs::statfs(instance.root()) {
        Ok(stat) if stat.filesystem_type() == nix::sys::statfs::TMPFS_MAGIC => report.good("topics", "on a tmpfs"),
        Ok(_) => report.note(
            Level::Warning,
            "topics",
            "not on a tmpfs",
            "start-up waits for the disk; /dev/shm/… is faster",
        ),
        Err(_) => {}
    }
}

/// Requests a GPIO line, as the loop would. That of a tracker is checked with the port.
fn check_emergency_stop(
    config: &Config,
    report: &mut CheckReport,
) -> Result<Option<EmergencyStopInput>, EmergencyStopError> {
    let input = EmergencyStopInput::open(config);
    match &input {
        Ok(None) => {}
        Ok(Some(_)) => report.good("emergency stop", "its input can be read"),
        // The error's text includes the remedy.
        Err(error) => report.note(Level::Error, "emergency stop", "cannot be read", error.to_string()),
    }
    input
}

fn check_port(
    config: &Config,
    trials: &Trials,
    emergency_stop: Result<Option<EmergencyStopInput>, EmergencyStopError>,
    report: &mut CheckReport,
) {
    let Some(port) = &config.port else {
        report.good("port", "none configured: the virtual worm is used");
        return;
    };
    let path = Path::new(&port.path);
    let settings = match link_settings(config, port.baud) {
        Ok(settings) => settings,
        Err(error) => return report.note(Level::Error, "port", "cannot be used", error.to_string()),
    };
    let mut opened = Drive::open(path, settings.clone());
    let mut is_accepted = true;
    if let Err(
        error @ DriveError::Startup {
            source: StartupError::UnsafeWatchdog { .. },
            ..
        },
    ) = &opened
    {
        report.note(Level::Error, "port", "the worm would not be armed", error.to_string());
        is_accepted = false;
        // The rest can be checked all the same.
        let accepting = LinkSettings {
            accept_unsafe_watchdog: true,
            ..settings
        };
        opened = Drive::open(path, accepting);
    }
    match opened {
        Ok((mut drive, prepared, findings)) => {
            report.good(
                "port",
                format!(
                    "{} at {} baud: servo model {} (firmware {}), {}",
                    port.path,
                    port.baud,
                    prepared.servo.model,
                    prepared.servo.firmware,
                    tracker_in_words(config, &prepared)
                ),
            );
            for finding in findings {
                let level = if finding.corrected { Level::Good } else { Level::Warning };
                report.note(level, "port", finding.what, finding.remedy);
            }
            report_current(config, &prepared, report);
            report_calibration(config, &prepared, report);
            let mut worm = TrialWorm {
                config,
                drive: &mut drive,
                prepared: &prepared,
                is_accepted,
            };
            trials.run(&mut worm, emergency_stop, report);
        }
        // The error's text includes the remedy.
        Err(error) => report.note(Level::Error, "port", "cannot be used", error.to_string()),
    }
}

/// What there is of a tracker, and how it is read.
fn tracker_in_words(config: &Config, prepared: &Prepared) -> String {
    match prepared.tracker {
        Some(_) if !config.tracker.present => {
            format!(
                "an inertial sensor and no tracker (configured so), read by {:?}",
                prepared.plan.read
            )
        }
        Some(tracker) if config.inertial_sensor.is_some() => {
            let cells = tracker.cells;
            format!(
                "tracker with {cells} cells and an inertial sensor, read by {:?}",
                prepared.plan.read
            )
        }
        Some(tracker) => format!("tracker with {} cells, read by {:?}", tracker.cells, prepared.plan.read),
        None if config.tracker.present => "its tracker is silent".to_owned(),
        None if config.inertial_sensor.is_some() => {
            "no tracker (configured so), and its inertial sensor is silent".to_owned()
        }
        None => "no tracker (configured so)".to_owned(),
    }
}

/// Whether the friction that `wormd calibrate` found is that of this servo as it is.
fn report_calibration(config: &Config, prepared: &Prepared, report: &mut CheckReport) {
    let Some(calibrated) = &config.self_sensing.calibrated else {
        return;
    };
    match calibrated.misfit(config, prepared.servo_reading.temperature_c) {
        None => report.good("gears", format!("calibrated on {}", calibrated.date)),
        Some(misfit) => report.note(Level::Warning, "gears", misfit, "calibrate anew: `wormd calibrate`"),
    }
}

/// What limits the motor's current, and what is left of it at the speed of the gait.
fn report_current(config: &Config, prepared: &Prepared, report: &mut CheckReport) {
    const LEAST_SHARE: f64 = 0.3;
    let servo = &config.servo;
    let available_v = prepared.duty_limit * prepared.servo_reading.voltage_v;
    let blocked_a = available_v / servo.winding_resistance_ohm;
    let back_emf_v = servo.torque_constant_n_m_per_a * (config.gait_cycles_per_s() * TAU).abs();
    let crawling_a = ((available_v - back_emf_v) / servo.winding_resistance_ohm).max(0.0);
    let found = format!(
        "limited by a duty of {:.0} %: {blocked_a:.2} A of a blocked motor, {crawling_a:.2} A at the speed of the gait",
        100.0 * prepared.duty_limit
    );
    if crawling_a < LEAST_SHARE * blocked_a {
        let remedy = "raise servo.current_limit_a or gait.cycle_s: little torque is left at this speed";
        report.note(Level::Warning, "motor current", found, remedy);
    } else {
        report.good("motor current", found);
    }
}
