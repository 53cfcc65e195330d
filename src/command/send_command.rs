//! `wormd command`: a command to a running controller.

use super::{Failure, WormArgs, print};
use crate::topics::{CommandClient, Hub, Instance};
use clap::{Args, ValueEnum};
use std::time::Duration;
use worm_estimator::message::{Command, CommandKind, CommandOutcome, Fault, Mode, Reply};

/// How long the controller may take to answer: a reset prepares the servo anew, which takes a while on a slow bus.
const PATIENCE: Duration = Duration::from_secs(2);

/// Arguments of `wormd command`.
#[derive(Debug, Args)]
pub struct SendCommandArgs {
    /// What the controller shall do
    #[arg(ignore_case = true)]
    order: Order,
    /// Speed of a crawl in gait cycles per second, negative for backward; without it, the configured gait
    #[arg(long, value_name = "CYCLES_PER_S", allow_negative_numbers = true)]
    speed: Option<f64>,
    #[command(flatten)]
    worm: WormArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Order {
    /// Torque on
    Arm,
    /// Turn the cam
    Crawl,
    /// Keep the cam where it is, actively
    Hold,
    /// Ramp down, then torque off
    Stop,
    /// Leave the fault state; the worm is re-armed from the measured position
    Reset,
}

impl Order {
    fn kind(self) -> CommandKind {
        match self {
            Self::Arm => CommandKind::Arm,
            Self::Crawl => CommandKind::Crawl,
            Self::Hold => CommandKind::Hold,
            Self::Stop => CommandKind::Stop,
            Self::Reset => CommandKind::Reset,
        }
    }
}

/// Runs `wormd command`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments that cannot be used, [`Failure::Failed`] when there is no controller or it refuses.
pub fn run(args: &SendCommandArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let kind = args.order.kind();
    if args.speed.is_some() && kind != CommandKind::Crawl {
        return Err(Failure::unusable("--speed goes with `wormd command crawl`"));
    }
    if args.speed.is_some_and(|speed| !speed.is_normal()) {
        return Err(Failure::unusable(
            "--speed must be a number other than 0: to stand still, `wormd command hold` or `stop`",
        ));
    }
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let client = Hub::open(&instance)
        .map_err(Failure::failed)?
        .command_client()
        .map_err(Failure::failed)?;
    let command = Command {
        cycles_per_s: args.speed.unwrap_or(0.0),
        kind: kind.code(),
        reserved: 0,
    };
    let reply = client.call(command, PATIENCE).map_err(Failure::failed)?;
    let verdict = CommandOutcome::try_from(reply.verdict).map_err(Failure::failed)?;
    if args.json {
        print::line(as_json(kind, verdict, &reply))?;
    }
    if verdict != CommandOutcome::Accepted {
        return Err(Failure::failed(refusal(kind, verdict, &reply)));
    }
    if !args.json {
        print::line(format_args!("{}: {kind} accepted", config.worm.name))?;
    }
    Ok(())
}

/// Gives a controller a plain command.
///
/// # Errors
/// [`Failure::Failed`] when it does not answer, or refuses.
pub(super) fn give(client: &CommandClient, kind: CommandKind) -> Result<(), Failure> {
    let command = Command {
        cycles_per_s: 0.0,
        kind: kind.code(),
        reserved: 0,
    };
    let reply = client.call(command, PATIENCE).map_err(Failure::failed)?;
    match CommandOutcome::try_from(reply.verdict) {
        Ok(CommandOutcome::Accepted) => Ok(()),
        Ok(verdict) => Err(Failure::failed(format!(
            "the controller: {}",
            refusal(kind, verdict, &reply)
        ))),
        Err(error) => Err(Failure::failed(error)),
    }
}

fn mode_name(reply: &Reply) -> &'static str {
    Mode::try_from(reply.mode).map_or("unknown", Mode::name)
}

fn fault_name(reply: &Reply) -> &'static str {
    Fault::try_from(reply.fault).map_or("unknown", Fault::name)
}

fn as_json(kind: CommandKind, verdict: CommandOutcome, reply: &Reply) -> serde_json::Value {
    serde_json::json!({
        "command": kind.name(),
        "verdict": verdict.name(),
        "mode": mode_name(reply),
        "fault": fault_name(reply),
        "tick": reply.sequence,
    })
}

/// Why the controller refused, and what would be accepted.
fn refusal(kind: CommandKind, verdict: CommandOutcome, reply: &Reply) -> String {
    let mode = mode_name(reply);
    let why = match verdict {
        CommandOutcome::WrongMode if kind == CommandKind::Reset => {
            format!("there is no fault to leave, the worm is {mode}")
        }
        CommandOutcome::WrongMode if mode == "disarmed" => "the worm is disarmed: `wormd command arm` first".to_owned(),
        CommandOutcome::WrongMode if mode == "fault" => {
            format!(
                "the worm was stopped ({}): mend the cause, then `wormd command reset`",
                fault_name(reply)
            )
        }
        CommandOutcome::WrongMode => format!("not while {mode}"),
        CommandOutcome::FaultPersists => format!("the cause is still there ({}): mend it first", fault_name(reply)),
        CommandOutcome::BadSpeed => "the speed is not a number, or beyond servo.velocity_limit_rev_per_min".to_owned(),
        CommandOutcome::NoEstimator => {
            "no estimator is running: start `wormd estimate`, or set control.require_estimator = false".to_owned()
        }
        CommandOutcome::Unknown | CommandOutcome::Accepted => {
            "this controller does not know the command: is it of another version?".to_owned()
        }
    };
    format!("{kind} refused: {why}")
}
