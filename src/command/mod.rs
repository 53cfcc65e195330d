//! One file per subcommand: arguments in, one library call, exit code out.

#[cfg(feature = "analysis")]
pub mod analyze;
pub mod black_box;
#[cfg(feature = "bridge")]
pub mod bridge;
pub mod bundle;
pub mod calibrate;
pub mod check;
pub mod control;
#[cfg(feature = "dashboard")]
pub mod dashboard;
#[cfg(feature = "analysis")]
mod dataset;
pub mod estimate;
#[cfg(feature = "analysis")]
pub mod explain;
pub mod export;
pub mod fault;
#[cfg(feature = "bridge")]
pub mod fleet;
#[cfg(feature = "foxglove")]
pub mod foxglove;
pub mod infer;
pub mod latency;
pub mod latency_floor;
mod live;
pub mod manual;
pub mod plan;
#[cfg(feature = "analysis")]
pub mod predict;
mod progress;
pub mod record;
mod recording_limits;
pub mod relay;
pub mod replay;
pub mod send_command;
pub mod servo_bench;
#[cfg(feature = "analysis")]
pub mod simulate;
pub mod soak;
pub mod status;
pub mod study;
pub mod topics;
pub mod trip;
pub mod up;
pub mod virtual_worm;
pub mod watch;
pub mod why;

pub use crate::failure::Failure;
pub use crate::print::{LogOutput, finish_log, log_line};

use crate::print;
use crate::topics::{Controller, Instance, RoleLock};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use worm_estimator::config::{Config, ConfigError};
use worm_estimator::message::State;
use worm_log::Log;

/// Which worm to use: the arguments that most subcommands share.
#[derive(Debug, Clone, Args)]
pub struct WormArgs {
    /// Configuration file; without it, the worm of the paper
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Name of the worm, instead of the one in the configuration: several can run on one computer
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// Serial port, instead of the one in the configuration
    #[arg(long, value_name = "PATH")]
    pub port: Option<PathBuf>,
}

impl WormArgs {
    /// The configuration that the arguments select, checked.
    ///
    /// # Errors
    /// What [`Config::load`] says, and a name or port that cannot be used.
    pub fn load(&self) -> Result<Config, Failure> {
        Ok(self.load_with_text()?.0)
    }

    /// The configuration, and the text of its file, if there is one.
    fn load_with_text(&self) -> Result<(Config, Option<String>), Failure> {
        let (mut config, text) = match &self.config {
            Some(file) => {
                let (config, text) = Config::load_with_text(file)?;
                (config, Some(text))
            }
            None => (Config::default(), None),
        };
        if let Some(name) = &self.name {
            config.worm.name.clone_from(name);
        }
        if let Some(path) = &self.port {
            let path = path.to_string_lossy().into_owned();
            match &mut config.port {
                Some(port) => port.path = path,
                None => config.port = Some(worm_estimator::config::Port::at(path)),
            }
        }
        Ok((checked(config)?, text))
    }

    /// The same worm as arguments for another process of it.
    fn forward(&self) -> Vec<std::ffi::OsString> {
        let mut arguments = Vec::new();
        let mut push = |flag: &str, value: &Path| {
            arguments.push(flag.into());
            arguments.push(value.as_os_str().to_owned());
        };
        if let Some(config) = &self.config {
            push("--config", config);
        }
        if let Some(name) = &self.name {
            push("--name", Path::new(name));
        }
        if let Some(port) = &self.port {
            push("--port", port);
        }
        arguments
    }
}

/// Refuses where the worm does not run.
///
/// # Errors
/// [`Failure::Unusable`].
pub(crate) fn require_worm(instance: &Instance) -> Result<(), Failure> {
    if RoleLock::<Controller>::holder(instance).is_some() {
        return Ok(());
    }
    let worm = instance.worm();
    instance.remove_folder_if_empty();
    Err(Failure::unusable(format!(
        "no worm {worm} is running: start it with `wormd up --name {worm}`, or give the name of another with --name"
    )))
}

/// A configuration of which the command line has changed something.
fn checked(config: Config) -> Result<Config, Failure> {
    let problems = config.problems();
    if problems.is_empty() {
        return Ok(config);
    }
    let file = PathBuf::from("command line");
    Err(ConfigError::Values { file, problems }.into())
}

/// Parses a duration in seconds.
fn positive_seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text
        .parse()
        .map_err(|_| format!("'{text}' is not a number of seconds"))?;
    if seconds > 0.0 && seconds <= 1e7 {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err(format!(
            "{text} s is not a usable duration: give more than 0 s and at most 1e7 s"
        ))
    }
}

/// A flag that SIGINT, SIGTERM and SIGHUP set, instead of killing the process. SIGHUP stays ignored if it was, as under `nohup`.
///
/// # Errors
/// When the operating system refuses the handlers.
pub fn end_on_signal() -> Result<Arc<AtomicBool>, Failure> {
    let end = Arc::new(AtomicBool::new(false));
    for signal in ending_signals() {
        signal_hook::flag::register(signal, Arc::clone(&end)).map_err(|error| cannot_handle(signal, &error))?;
    }
    Ok(end)
}

/// A flag that SIGTSTP (Ctrl-Z) sets, instead of suspending the process. SIGTSTP stays ignored if it was.
///
/// # Errors
/// When the operating system refuses the handler.
fn suspend_on_signal() -> Result<Arc<AtomicBool>, Failure> {
    let suspend = Arc::new(AtomicBool::new(false));
    if !is_ignored(libc::SIGTSTP) {
        signal_hook::flag::register(libc::SIGTSTP, Arc::clone(&suspend))
            .map_err(|error| cannot_handle(libc::SIGTSTP, &error))?;
    }
    Ok(suspend)
}

/// As [`end_on_signal`], until the second flag is set: from then on a signal kills the process again.
///
/// # Errors
/// When the operating system refuses the handlers.
#[cfg(feature = "analysis")]
fn end_on_signal_until() -> Result<(Arc<AtomicBool>, Arc<AtomicBool>), Failure> {
    let over = Arc::new(AtomicBool::new(false));
    for signal in ending_signals() {
        signal_hook::flag::register_conditional_default(signal, Arc::clone(&over))
            .map_err(|error| cannot_handle(signal, &error))?;
    }
    Ok((end_on_signal()?, over))
}

fn ending_signals() -> impl Iterator<Item = libc::c_int> {
    let signals = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP];
    signals
        .into_iter()
        .filter(|&signal| signal != libc::SIGHUP || !is_ignored(signal))
}

fn cannot_handle(signal: libc::c_int, error: &std::io::Error) -> Failure {
    Failure::failed(format!("signal {signal} cannot be handled: {error}"))
}

fn is_ignored(signal: libc::c_int) -> bool {
    let mut action = std::mem::MaybeUninit::<libc::sigaction>::uninit();
    // SAFETY: with a null action the call only reads the current one into memory that is ours.
    let read = unsafe { libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr()) };
    // SAFETY: the call has filled it in where it returned zero.
    read == 0 && unsafe { action.assume_init() }.sa_sigaction == libc::SIG_IGN
}

/// Refuses the log of another worm than the configured one. `worm.cells` of the log cannot be corrected, but another configuration given.
///
/// # Errors
/// [`Failure::Unusable`] with both numbers of cells; `given` is the file of a configuration that is not the log's own.
fn refuse_another_worm(log: &Log, file: &Path, config: &Config, given: Option<&Path>) -> Result<(), Failure> {
    let configured = config.worm.cells;
    let is_other = |state: &&State| state.cell_count as usize != configured;
    let Some(state) = log.states.iter().find(is_other) else {
        return Ok(());
    };
    let (file, which) = match given {
        Some(given) => (given, "this configuration"),
        None if log.config.is_some() => (file, "its configuration"),
        None => (
            file,
            "the worm of the paper, assumed because the log has no configuration,",
        ),
    };
    Err(Failure::unusable(format!(
        "{}: the recorded worm has {} cells, and {which} has {configured}: give the configuration that it ran with by --config",
        file.display(),
        state.cell_count
    )))
}

/// Logs what is valid but inadvisable in the configuration.
fn report_advice(config: &Config) {
    for advice in config.advice() {
        tracing::warn!("{}: {}", advice.key, advice.text);
    }
}

/// Logs what the operating system granted, and warns of refusals.
fn report_grants(grants: &[crate::realtime::Grant]) {
    for grant in grants {
        if grant.refusal.is_some() {
            tracing::warn!("{grant}");
        } else {
            tracing::info!("{grant}");
        }
    }
}
