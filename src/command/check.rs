//! `wormd check`: what stands between this computer, this configuration and a crawling worm.

use super::{Failure, WormArgs, print};
use crate::control::{Drive, link_settings};
use crate::realtime::machine::{self, Setting};
use crate::realtime::{self, InForce};
use crate::topics::{Hub, Instance};
use clap::Args;
use serde::Serialize;
use std::path::Path;
use worm_estimator::config::{Config, Realtime};

/// Arguments of `wormd check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Level {
    /// As it should be.
    Good,
    /// The worm runs, but not as well as it could.
    Warning,
    /// The worm does not run.
    Error,
}

#[derive(Debug, Serialize)]
struct CheckItem {
    level: Level,
    /// What was looked at.
    subject: &'static str,
    /// What was found.
    found: String,
    /// What to do about it; null where nothing needs doing.
    remedy: Option<String>,
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

#[derive(Debug, Serialize)]
struct CheckReport {
    worm: String,
    findings: Vec<CheckItem>,
}

impl CheckReport {
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

    fn print(&self) -> Result<(), Failure> {
        for finding in &self.findings {
            let mark = match finding.level {
                Level::Good => "ok     ",
                Level::Warning => "WARNING",
                Level::Error => "ERROR  ",
            };
            print::line(format_args!("{mark}  {}: {}", finding.subject, finding.found))?;
            if let Some(remedy) = &finding.remedy {
                print::line(format_args!("         -> {remedy}"))?;
            }
        }
        Ok(())
    }
}

/// Runs `wormd check`.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration that cannot be used, [`Failure::Failed`] when something keeps the worm from running.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let mut report = CheckReport {
        worm: config.worm.name.clone(),
        findings: Vec::new(),
    };
    check_config(&args.worm, &config, &mut report);
    check_realtime(&config.realtime, &mut report);
    for setting in machine::settings(config.realtime.cpu) {
        report.findings.push(setting.into());
    }
    check_topics(&config, &mut report);
    check_port(&config, &mut report);

    if args.json {
        let json = serde_json::to_string_pretty(&report).map_err(Failure::failed)?;
        print::line(json)?;
    } else {
        report.print()?;
    }
    let errors = report
        .findings
        .iter()
        .filter(|finding| finding.level == Level::Error)
        .count();
    match errors {
        0 => Ok(()),
        _ => Err(Failure::failed(format!(
            "{errors} finding(s) keep {} from running",
            config.worm.name
        ))),
    }
}

fn check_config(worm: &WormArgs, config: &Config, report: &mut CheckReport) {
    let source = worm
        .config
        .as_ref()
        .map_or("the built-in defaults".to_owned(), |file| file.display().to_string());
    report.good(
        "configuration",
        format!("{source}: {} cells, {} Hz", config.worm.cells, config.control.rate_hz),
    );
    for advice in config.advice() {
        report.note(Level::Warning, "configuration", advice.key, advice.text);
    }
}

/// Asks for what the loop would ask for, in a thread that ends at once, and reads back what that thread then has.
fn check_realtime(wanted: &Realtime, report: &mut CheckReport) {
    let trial = {
        let wanted = wanted.clone();
        move || (realtime::request(&wanted, 0), InForce::of_this_thread())
    };
    let Ok((grants, in_force)) = std::thread::spawn(trial).join() else {
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
    match in_force {
        Ok(in_force) => {
            let shortfalls = in_force.shortfalls(wanted, 0);
            if shortfalls.is_empty() {
                report.good("in force", in_force.to_string());
            } else {
                report.note(
                    Level::Warning,
                    "in force",
                    in_force.to_string(),
                    format!("less than configured: {}", shortfalls.join("; ")),
                );
            }
        }
        Err(error) => report.note(
            Level::Warning,
            "in force",
            format!("cannot be read back: {error}"),
            "mount /proc, so that what the kernel really grants can be told",
        ),
    }
}

fn check_topics(config: &Config, report: &mut CheckReport) {
    let root = Path::new(&config.topics.root);
    // What every process of the worm does first. One that runs is not disturbed by one more reader.
    let opened = Instance::of(config)
        .map_err(|error| error.to_string())
        .and_then(|instance| Hub::open(&instance).map_err(|error| error.to_string()));
    match opened {
        Ok(_) => report.good(
            "topics",
            format!("those of {} open in {}", config.worm.name, root.display()),
        ),
        // The error's text holds the remedy already.
        Err(error) => report.note(Level::Error, "topics", "cannot be used", error),
    }
    match nix::sys::statfs::statfs(root) {
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

fn check_port(config: &Config, report: &mut CheckReport) {
    let Some(port) = &config.port else {
        report.good("port", "none configured: the virtual worm is used");
        return;
    };
    let opened = link_settings(config, port.baud).and_then(|settings| Drive::open(Path::new(&port.path), settings));
    match opened {
        Ok((_drive, prepared, findings)) => {
            report.good(
                "port",
                format!(
                    "{} at {} baud: servo model {} (firmware {}), tracker with {} cells, read by {:?}",
                    port.path,
                    port.baud,
                    prepared.servo.model,
                    prepared.servo.firmware,
                    prepared.tracker_cells,
                    prepared.plan.read
                ),
            );
            for finding in findings {
                let level = if finding.corrected { Level::Good } else { Level::Warning };
                report.note(level, "port", finding.what, finding.remedy);
            }
        }
        // The error's text holds the remedy already.
        Err(error) => report.note(Level::Error, "port", "cannot be used", error.to_string()),
    }
}
