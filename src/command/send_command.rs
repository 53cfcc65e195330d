//! `wormd command`: a command to a running controller.

use super::{Failure, WormArgs, end_on_signal, positive_seconds, print};
use crate::supervisor::attend;
use crate::supervisor::controller::{self, Answer};
use crate::topics::{Hub, Instance};
use clap::{Args, ValueEnum};
use std::time::Duration;
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, Command, CommandKind};

/// Its name in the record of commands.
const SENDER: &str = "wormd command";

/// Arguments of `wormd command`.
#[derive(Debug, Args)]
pub struct SendCommandArgs {
    /// What the controller shall do
    #[arg(ignore_case = true)]
    order: Order,
    /// The alarms that `acknowledge` is about; without any, all that there are
    #[arg(value_name = "ALARM", value_parser = alarm)]
    alarms: Vec<AlarmKind>,
    /// Speed of a crawl in gait cycles per second, negative for backward; without it, the configured gait
    #[arg(long, value_name = "CYCLES_PER_S", allow_negative_numbers = true)]
    speed: Option<f64>,
    /// Crawl for so long, then hold; without it, as long as `wormd up` runs or `control.crawl_limit_s` allows
    #[arg(long = "for", value_name = "SECONDS", value_parser = positive_seconds, allow_negative_numbers = true, conflicts_with = "attend")]
    limit: Option<Duration>,
    /// Crawl as long as this command runs in the foreground: Ctrl-C, or its end however it comes, makes the worm hold
    #[arg(long)]
    attend: bool,
    /// For `mark`: where the mean of the cells is along the canal, in metres
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    position: Option<f64>,
    /// For `mark`: standard error of the position, in metres; without it 0.005
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, requires = "position")]
    sigma: Option<f64>,
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
    /// Ramp down, then torque off; works in every mode, and without the topics
    Stop,
    /// Leave the fault state; the worm is re-armed from the measured position
    Reset,
    /// Note that you have seen these alarms; permits nothing
    Acknowledge,
    /// Say where the worm is: corrects its dead reckoning, and moves nothing
    Mark,
}

impl Order {
    fn kind(self) -> CommandKind {
        match self {
            Self::Arm => CommandKind::Arm,
            Self::Crawl => CommandKind::Crawl,
            Self::Hold => CommandKind::Hold,
            Self::Stop => CommandKind::Stop,
            Self::Reset => CommandKind::Reset,
            Self::Acknowledge => CommandKind::Acknowledge,
            Self::Mark => CommandKind::Mark,
        }
    }
}

fn alarm(name: &str) -> Result<AlarmKind, String> {
    let named = AlarmKind::ALL.iter().find(|kind| kind.name() == name).copied();
    named.ok_or_else(|| {
        let names: Vec<_> = AlarmKind::ALL.iter().map(|kind| kind.name()).collect();
        format!("there is no alarm of this name: give some of {}", names.join(", "))
    })
}

/// Runs `wormd command`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments that cannot be used, [`Failure::Failed`] when there is no controller or it refuses.
pub fn run(args: &SendCommandArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    args.check()?;
    let answer = match args.order {
        Order::Stop => match controller::stop_by_socket(&config, &controller::command(CommandKind::Stop, SENDER)) {
            Ok(answer) => answer,
            Err(Some(failure)) => return Err(failure),
            Err(None) => send(args, &config)?,
        },
        Order::Crawl if args.attend => return attend(args, &config),
        _ => send(args, &config)?,
    };
    args.print(&config, &answer)
}

fn send(args: &SendCommandArgs, config: &Config) -> Result<Answer, Failure> {
    let hub = open(config)?;
    let client = hub.command_client().map_err(Failure::failed)?;
    controller::send(&client, args.command())
}

/// Crawls as long as this process runs.
fn attend(args: &SendCommandArgs, config: &Config) -> Result<(), Failure> {
    print::log_in_background()?;
    let end = end_on_signal()?;
    let hub = open(config)?;
    let worm = &config.worm.name;
    attend::crawl(&hub, "wormd command --attend", args.speed.unwrap_or(0.0), &end, || {
        print::log_line(format_args!("{worm}: crawls until Ctrl-C, or until this command ends"));
        print::ready();
    })?;
    print::log_line(format_args!("{worm}: holds"));
    Ok(())
}

fn open(config: &Config) -> Result<Hub, Failure> {
    controller::refuse_foreign(config)?;
    let instance = Instance::of(config).map_err(Failure::unusable)?;
    Hub::open(&instance).map_err(Failure::failed)
}

impl SendCommandArgs {
    fn check(&self) -> Result<(), Failure> {
        let is_crawl = matches!(self.order, Order::Crawl);
        for (flag, is_given) in [
            ("--speed", self.speed.is_some()),
            ("--for", self.limit.is_some()),
            ("--attend", self.attend),
        ] {
            if is_given && !is_crawl {
                return Err(Failure::unusable(format!("{flag} goes with `wormd command crawl`")));
            }
        }
        let is_place = |position_m: f64| position_m.abs() <= Command::MAX_POSITION_M;
        match (self.order, self.position) {
            (Order::Mark, None) => {
                return Err(Failure::unusable(
                    "`wormd command mark` needs --position, in metres along the canal",
                ));
            }
            (Order::Mark, Some(position_m)) if !is_place(position_m) => {
                return Err(Failure::unusable(format!(
                    "--position must be a number of metres, at most {} either way",
                    Command::MAX_POSITION_M
                )));
            }
            (Order::Mark, Some(_)) | (_, None) => {}
            (_, Some(_)) => return Err(Failure::unusable("--position goes with `wormd command mark`")),
        }
        if self
            .sigma
            .is_some_and(|sigma_m| !(sigma_m > 0.0 && sigma_m <= Command::MAX_POSITION_M))
        {
            return Err(Failure::unusable("--sigma must be a number of metres above 0"));
        }
        if !self.alarms.is_empty() && !matches!(self.order, Order::Acknowledge) {
            return Err(Failure::unusable("names of alarms go with `wormd command acknowledge`"));
        }
        if self.speed.is_some_and(|speed| !speed.is_normal()) {
            return Err(Failure::unusable(
                "--speed must be a number other than 0: to stand still, `wormd command hold` or `stop`",
            ));
        }
        Ok(())
    }

    fn command(&self) -> Command {
        let all = AlarmKind::ALL;
        let alarms = if self.alarms.is_empty() { all } else { &self.alarms };
        let is_about_alarms = matches!(self.order, Order::Acknowledge);
        Command {
            cycles_per_s: self.speed.unwrap_or(0.0),
            limit_s: self.limit.map_or(0.0, |limit| limit.as_secs_f64()),
            position_m: self.position.unwrap_or(0.0),
            position_sigma_m: self.sigma.unwrap_or(0.0),
            alarm_mask: match is_about_alarms {
                true => alarms.iter().fold(0, |mask, alarm| mask | 1 << alarm.code()),
                false => 0,
            },
            ..controller::command(self.order.kind(), SENDER)
        }
    }

    fn print(&self, config: &Config, answer: &Answer) -> Result<(), Failure> {
        let refusal = answer.refusal();
        let limit_s = match (self.order, &refusal) {
            (Order::Crawl, None) => self
                .limit
                .map(|limit| limit.as_secs_f64())
                .or_else(|| controller::crawl_limit_s(config)),
            _ => None,
        };
        if self.json {
            let mut json = answer.to_json();
            if matches!(self.order, Order::Crawl) {
                json["limit_s"] = limit_s.into();
            }
            print::line(json)?;
        }
        if let Some(refusal) = refusal {
            return Err(Failure::failed(refusal));
        }
        if self.json {
            return Ok(());
        }
        let (worm, kind) = (&config.worm.name, self.order.kind());
        match (limit_s, self.limit) {
            (Some(limit_s), None) => print::line(format_args!(
                "{worm}: {kind} accepted, for {limit_s} s at most (control.crawl_limit_s; --for and --attend say it otherwise)"
            )),
            (Some(limit_s), Some(_)) => print::line(format_args!("{worm}: {kind} accepted, for {limit_s} s")),
            (None, _) => print::line(format_args!("{worm}: {kind} accepted")),
        }
    }
}
