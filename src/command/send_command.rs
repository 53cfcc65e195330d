//! `wormd command`: a command to a running controller.

use super::{Failure, WormArgs, print};
use crate::supervisor::controller;
use crate::topics::{Hub, Instance};
use clap::{Args, ValueEnum};
use worm_estimator::message::CommandKind;

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
    let hub = Hub::open(&instance).map_err(Failure::failed)?;
    let client = hub.command_client().map_err(Failure::failed)?;
    let answer = controller::send(&client, kind, args.speed.unwrap_or(0.0))?;
    if args.json {
        print::line(answer.to_json())?;
    }
    if let Some(refusal) = answer.refusal() {
        return Err(Failure::failed(refusal));
    }
    if !args.json {
        print::line(format_args!("{}: {kind} accepted", config.worm.name))?;
    }
    Ok(())
}
