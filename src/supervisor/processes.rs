//! The processes of `wormd up`, started and ended in an order that keeps the worm safe.

use super::child_process::{Child, Log, START_TIMEOUT};
use crate::failure::Failure;
use crate::topics::Instance;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitStatus;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use worm_estimator::config::Config;

/// Which processes to start, and with which arguments.
#[derive(Debug)]
pub(crate) struct Launch {
    /// The arguments that select the worm, the same for every process but the virtual worm.
    pub worm: Vec<OsString>,
    /// The configuration file, if there is one.
    pub config: Option<PathBuf>,
    /// Faults of the virtual worm, as on its command line.
    pub faults: Vec<String>,
    /// Whether the virtual worm takes faults while it runs.
    pub allow_faults: bool,
    /// The log to record to, if any.
    pub record: Option<PathBuf>,
    /// The arguments that bound the recording.
    pub record_limits: Vec<OsString>,
    /// The folder of the black box, if there is one.
    pub black_box: Option<PathBuf>,
    /// How many `-v` the processes get.
    pub verbose: u8,
}

impl Launch {
    /// The command line of a process.
    fn arguments(&self, subcommand: &str, more: &[OsString]) -> Vec<OsString> {
        let mut arguments = vec![subcommand.into()];
        arguments.extend_from_slice(more);
        arguments.extend((0..self.verbose).map(|_| OsString::from("-v")));
        arguments
    }
}

/// The running processes. [`end`](Self::end) ends them in order of importance: first the controller, which stops the motor,
/// last the recorder and the black box, which record that.
pub(crate) struct Processes {
    controller: Child,
    estimator: Child,
    virtual_worm: Option<Child>,
    recorder: Option<Child>,
    black_box: Option<Child>,
}

impl Processes {
    /// Starts the processes and waits until all are ready; the controller comes last.
    ///
    /// # Errors
    /// [`Failure`] of the process that did not get ready, or when `end` was set meanwhile.
    pub(crate) fn start(
        launch: &Launch,
        config: &Config,
        instance: &Instance,
        log: &Log,
        end: &AtomicBool,
    ) -> Result<Self, Failure> {
        let mut worm = launch.worm.clone();
        let mut virtual_worm = None;
        if config.port.is_none() {
            let link = instance.folder().join("tty").into_os_string();
            let mut arguments = vec!["--link".into(), link.clone()];
            if let Some(file) = &launch.config {
                arguments.extend(["--config".into(), file.clone().into()]);
            }
            for fault in &launch.faults {
                arguments.extend(["--fault".into(), fault.into()]);
            }
            if launch.allow_faults {
                arguments.push("--allow-faults".into());
            }
            let mut child = Child::start("virtual-worm", &launch.arguments("virtual-worm", &arguments), log)?;
            child.wait_until_ready(START_TIMEOUT, log, end)?;
            virtual_worm = Some(child);
            worm.extend(["--port".into(), link]);
        }
        let mut estimator = Child::start("estimate", &launch.arguments("estimate", &worm), log)?;
        let mut recorder = None;
        if let Some(file) = &launch.record {
            let mut arguments = launch.worm.clone();
            arguments.extend(["--out".into(), file.clone().into()]);
            arguments.extend_from_slice(&launch.record_limits);
            let mut child = Child::start("record", &launch.arguments("record", &arguments), log)?;
            // Both must listen before the controller publishes: the log then has everything that the estimator receives.
            child.wait_until_ready(START_TIMEOUT, log, end)?;
            estimator.wait_until_ready(START_TIMEOUT, log, end)?;
            recorder = Some(child);
        }
        let mut black_box = None;
        if let Some(folder) = &launch.black_box {
            let mut arguments = launch.worm.clone();
            arguments.extend(["--black-box".into(), folder.clone().into()]);
            let mut child = Child::start("record", &launch.arguments("record", &arguments), log)?;
            // Before the controller, so that nothing happens before it listens.
            child.wait_until_ready(START_TIMEOUT, log, end)?;
            black_box = Some(child);
        }
        let mut controller = Child::start("control", &launch.arguments("control", &worm), log)?;
        controller.extend_end_timeout(Duration::from_secs_f64(config.gait.ramp_s));
        controller.wait_until_ready(START_TIMEOUT, log, end)?;
        if recorder.is_none() {
            estimator.wait_until_ready(START_TIMEOUT, log, end)?;
        }
        Ok(Self {
            controller,
            estimator,
            virtual_worm,
            recorder,
            black_box,
        })
    }

    /// Tells the controller that this process attends to the worm. Never waits.
    pub(super) fn renew_lease(&mut self) {
        self.controller.renew_lease();
    }

    /// How the controller ended, if it has.
    pub(super) fn controller_exit_status(&mut self) -> Option<ExitStatus> {
        self.controller.exit_status()
    }

    /// The first process that has ended by itself, and how. The recorder does not count: the worm runs without it.
    pub(super) fn find_ended(&mut self) -> Option<String> {
        let children = [
            Some(&mut self.controller),
            Some(&mut self.estimator),
            self.virtual_worm.as_mut(),
        ];
        children.into_iter().flatten().find_map(|child| {
            let status = child.exit_status()?;
            Some(format!(
                "the {} process ended by itself, {status}; the worm was stopped",
                child.role
            ))
        })
    }

    /// Ends all processes; returns what is wrong with the recording, if there is one and it is incomplete.
    pub(crate) fn end(&mut self) -> Option<String> {
        self.controller.end();
        self.estimator.end();
        if let Some(virtual_worm) = &mut self.virtual_worm {
            virtual_worm.end();
        }
        let recordings = [(&mut self.recorder, "recording"), (&mut self.black_box, "black box")];
        let problems = recordings
            .into_iter()
            .filter_map(|(child, what)| match child.as_mut()?.end() {
                Some(status) if status.success() => None,
                Some(status) => Some(format!("the {what} is incomplete: the record process ended, {status}")),
                None => Some(format!(
                    "the {what} may be incomplete: the record process ended in an unknown way"
                )),
            });
        // All of them end, also where the first had a problem.
        problems.collect::<Vec<_>>().into_iter().next()
    }
}
