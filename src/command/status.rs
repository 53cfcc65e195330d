//! `wormd status`: the worms that run on this computer, whoever started them.

use super::{Failure, print};
use crate::attendance::{RunningController, running_controllers};
use clap::Args;
use serde::Serialize;
use std::ffi::OsStr;
use std::fmt;
use std::os::unix::ffi::OsStrExt;
use worm_estimator::message::{Fault, Mode};

/// Arguments of `wormd status`.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// Exit status 1 while one of them has torque, or does not answer
    #[arg(long)]
    fail_if_armed: bool,
    /// Print a JSON array instead of text
    #[arg(long)]
    json: bool,
}

/// One worm.
#[derive(Debug, Serialize)]
struct WormStatus {
    worm: String,
    /// The user's name; its number where it has none.
    user: String,
    /// The controller.
    pid: u32,
    /// `null` when the controller does not answer.
    mode: Option<&'static str>,
    fault: Option<&'static str>,
    /// Whether the controller's program was replaced or removed since it was started; `null` where that is not shown to the calling user.
    program_replaced: Option<bool>,
}

/// Runs `wormd status`.
///
/// # Errors
/// [`Failure::Failed`] when the worms cannot be listed, or one is armed and must not be.
pub fn run(args: &StatusArgs) -> Result<(), Failure> {
    let controllers =
        running_controllers().map_err(|error| Failure::failed(format!("the worms cannot be listed: {error}")))?;
    let worms: Vec<_> = controllers.into_iter().map(WormStatus::of).collect();
    if args.json {
        print::line(serde_json::to_string(&worms).map_err(Failure::failed)?)?;
    } else if worms.is_empty() {
        print::line("no worm runs on this computer")?;
    } else {
        for worm in &worms {
            print::line(worm)?;
        }
    }
    let armed: Vec<_> = worms.iter().filter(|worm| worm.may_have_torque()).collect();
    if args.fail_if_armed && !armed.is_empty() {
        let names: Vec<_> = armed.iter().map(|worm| worm.worm.as_str()).collect();
        return Err(Failure::failed(format!(
            "not disarmed: {}: `wormd command stop --name NAME` disarms a worm",
            names.join(", ")
        )));
    }
    Ok(())
}

/// The same as JSON, or why there is none.
pub(super) fn as_json() -> Result<Vec<u8>, String> {
    let controllers = running_controllers().map_err(|error| error.to_string())?;
    let worms: Vec<_> = controllers.into_iter().map(WormStatus::of).collect();
    serde_json::to_vec_pretty(&worms).map_err(|error| error.to_string())
}

impl WormStatus {
    fn of(found: RunningController) -> Self {
        let answer = found.answer.as_ref();
        let user = nix::unistd::User::from_uid(found.user.into()).ok().flatten();
        Self {
            mode: answer
                .and_then(|answer| Mode::try_from(answer.mode).ok())
                .map(Mode::name),
            fault: answer
                .and_then(|answer| Fault::try_from(answer.fault).ok())
                .map(Fault::name),
            program_replaced: is_program_replaced(found.pid),
            worm: found.worm,
            user: user.map_or_else(|| found.user.to_string(), |user| user.name),
            pid: found.pid,
        }
    }

    fn may_have_torque(&self) -> bool {
        let without = [Mode::Disarmed, Mode::Fault];
        !without.iter().any(|mode| self.mode == Some(mode.name()))
    }
}

impl fmt::Display for WormStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { worm, user, pid, .. } = self;
        match (self.mode, self.fault) {
            (Some(mode), Some(fault)) if mode == Mode::Fault.name() => write!(f, "{worm}: {mode} {fault}")?,
            (Some(mode), _) => write!(f, "{worm}: {mode}")?,
            (None, _) => write!(f, "{worm}: does not answer")?,
        }
        write!(f, " (process {pid} of user {user}")?;
        if self.program_replaced == Some(true) {
            f.write_str(", from a program that was replaced since")?;
        }
        f.write_str(")")
    }
}

/// Whether the program of a process is no more the file that it was started from; the kernel shows that to its user and root.
fn is_program_replaced(pid: u32) -> Option<bool> {
    let program = std::fs::read_link(format!("/proc/{pid}/exe")).ok()?;
    Some(is_deleted(program.as_os_str()))
}

/// Whether the kernel has marked a path as deleted (proc(5), `/proc/PID/exe`).
fn is_deleted(path: &OsStr) -> bool {
    path.as_bytes().ends_with(b" (deleted)")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worm(mode: Option<Mode>, fault: Fault, program_replaced: Option<bool>) -> WormStatus {
        WormStatus {
            worm: "worm1".to_owned(),
            user: "wormd".to_owned(),
            pid: 7,
            mode: mode.map(Mode::name),
            fault: mode.map(|_| fault.name()),
            program_replaced,
        }
    }

    #[test]
    fn a_worm_without_an_answer_counts_as_armed() {
        for (mode, armed) in [
            (Some(Mode::Disarmed), false),
            (Some(Mode::Fault), false),
            (Some(Mode::Armed), true),
            (Some(Mode::Crawling), true),
            (Some(Mode::Holding), true),
            (Some(Mode::Stopping), true),
            (None, true),
        ] {
            assert_eq!(worm(mode, Fault::None, None).may_have_torque(), armed, "{mode:?}");
        }
    }

    #[test]
    fn a_line_says_how_the_worm_stands_and_which_program_runs() {
        for (worm, line) in [
            (
                worm(Some(Mode::Crawling), Fault::None, Some(true)),
                "worm1: crawling (process 7 of user wormd, from a program that was replaced since)",
            ),
            (
                worm(Some(Mode::Fault), Fault::LinkLost, Some(false)),
                "worm1: fault link-lost (process 7 of user wormd)",
            ),
            (
                worm(None, Fault::None, None),
                "worm1: does not answer (process 7 of user wormd)",
            ),
        ] {
            assert_eq!(worm.to_string(), line);
        }
    }
}
