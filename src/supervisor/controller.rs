//! Commands to a running controller, and why it refuses one.

use crate::attendance::{Question, Request, StopError, ask, foreign};
use crate::failure::Failure;
use crate::topics::CommandClient;
use std::time::Duration;
use worm_estimator::config::Config;
use worm_estimator::message::{
    AlarmKind, Command, CommandKind, CommandOutcome, CommandRecord, Fault, Mode, Reply, ShortText,
};

/// How long the controller may take to answer: a reset prepares the servo again, which takes a while on a slow bus.
const REPLY_TIMEOUT: Duration = Duration::from_secs(2);

/// The name of `wormd up`, and of what else starts a worm and watches over it, in the record of commands.
const SENDER: &str = "supervisor";

/// What the controller answered.
pub(crate) struct Answer {
    kind: CommandKind,
    outcome: CommandOutcome,
    reply: Reply,
}

/// A command of the calling user; `sender` is who sends it, for the record.
pub(crate) fn command(kind: CommandKind, sender: &str) -> Command {
    Command {
        sender: ShortText::new(sender),
        user: nix::unistd::getuid().as_raw(),
        ..Command::new(kind)
    }
}

/// Sends a command.
///
/// # Errors
/// [`Failure::Failed`] when no controller answers, or its answer is unknown.
pub(crate) fn send(client: &CommandClient, command: Command) -> Result<Answer, Failure> {
    let reply = client.call(command, REPLY_TIMEOUT).map_err(Failure::failed)?;
    let kind = CommandKind::try_from(command.kind).map_err(Failure::failed)?;
    Answer::new(kind, reply)
}

/// Stops the worm, as `command` says, through the controller's stop socket, which needs neither the topics' folder nor room in `/dev/shm`.
///
/// # Errors
/// None when nobody answers there, so that the topics have to do; [`Failure::Failed`] when the answer is a refusal.
pub(crate) fn stop_by_socket(config: &Config, command: &Command) -> Result<Answer, Option<Failure>> {
    let question = Question {
        request: Request::Stop,
        sender: command.sender.to_string(),
        user: Some(command.user),
    };
    let answer = ask(config, &question).map_err(|error| match error {
        StopError::SeveralUsers { .. } | StopError::Foreign { .. } => Some(Failure::failed(error)),
        StopError::NoSocket { .. } | StopError::NoAnswer { .. } => {
            tracing::debug!("{error}");
            None
        }
    })?;
    let Some(reply) = answer.reply else {
        return Err(answer.refusal.map(Failure::failed));
    };
    let reply = Reply {
        sequence: reply.sequence,
        verdict: reply.verdict,
        mode: answer.mode,
        fault: answer.fault,
        alarm_mask: reply.alarm_mask,
    };
    Answer::new(CommandKind::Stop, reply).map_err(Some)
}

/// Refuses a worm of another user, by name.
///
/// # Errors
/// [`Failure::Failed`] when only others have a worm of this name.
pub(crate) fn refuse_foreign(config: &Config) -> Result<(), Failure> {
    // A controller that does not answer here may do so at the topics.
    foreign(config).map_or(Ok(()), |error| Err(Failure::failed(error)))
}

/// How long the worm may crawl by a command that names no time, s: as long as the one who watches over it is there, if somebody
/// does. `None` then, and also when the controller does not say.
pub(crate) fn crawl_limit_s(config: &Config) -> Option<f64> {
    let answer = ask(config, &Request::Status.into()).ok()?;
    (!answer.is_supervised()).then_some(answer.crawl_limit_s)
}

/// Sends a command that has to be accepted, with the configured gait.
///
/// # Errors
/// [`Failure::Failed`] when the controller does not answer, or refuses.
pub(super) fn order(client: &CommandClient, kind: CommandKind) -> Result<(), Failure> {
    match send(client, command(kind, SENDER))?.refusal() {
        None => Ok(()),
        Some(refusal) => Err(Failure::failed(format!("the controller: {refusal}"))),
    }
}

impl Answer {
    fn new(kind: CommandKind, reply: Reply) -> Result<Self, Failure> {
        let outcome = CommandOutcome::try_from(reply.verdict).map_err(Failure::failed)?;
        Ok(Self { kind, outcome, reply })
    }

    /// The answer of a recorded command; none where a newer controller has given one that is not known here.
    pub(crate) fn recorded(record: &CommandRecord) -> Option<Self> {
        let reply = Reply {
            sequence: record.state_sequence,
            verdict: record.outcome,
            mode: record.mode,
            fault: record.fault,
            alarm_mask: record.answer_alarm_mask,
        };
        Self::new(CommandKind::try_from(record.kind).ok()?, reply).ok()
    }

    /// The answer as the JSON that `wormd command --json` prints.
    pub(crate) fn to_json(&self) -> serde_json::Value {
        serde_json::json!({
            "command": self.kind.name(),
            "verdict": self.verdict(),
            "mode": self.mode(),
            "fault": self.fault(),
            "tick": self.reply.sequence,
        })
    }

    /// Why the controller refused, and what it would accept; none when it accepted.
    pub(crate) fn refusal(&self) -> Option<String> {
        let mode = self.mode();
        let why = match self.outcome {
            CommandOutcome::Accepted => return None,
            CommandOutcome::WrongMode if self.kind == CommandKind::Reset => {
                format!("there is no fault to leave, the worm is {mode}")
            }
            CommandOutcome::WrongMode if mode == "disarmed" => {
                "the worm is disarmed: `wormd command arm` first".to_owned()
            }
            CommandOutcome::WrongMode if mode == "fault" => {
                format!(
                    "the worm was stopped ({}): remove the cause, then `wormd command reset`",
                    self.fault()
                )
            }
            CommandOutcome::WrongMode if self.kind == CommandKind::Renew => {
                format!("the worm does not crawl any more, it is {mode}")
            }
            CommandOutcome::WrongMode => format!("not while {mode}"),
            CommandOutcome::FaultPersists => format!("the cause is still present ({}): remove it first", self.fault()),
            CommandOutcome::BadSpeed => {
                "the speed or the time is not a number, or the speed is beyond servo.velocity_limit_rev_per_min"
                    .to_owned()
            }
            CommandOutcome::BadPosition => {
                "the position or its standard error is not a number of metres that a canal has".to_owned()
            }
            CommandOutcome::NoEstimator => {
                "no estimator is running, or it does not keep up: start `wormd estimate`, or set \
                 control.require_estimator = false"
                    .to_owned()
            }
            CommandOutcome::NoLease => {
                "`wormd up` does not watch over the worm at present: say for how long it may crawl \
                                        (--for SECONDS), or watch over it yourself (--attend)"
                    .to_owned()
            }
            CommandOutcome::AlarmStands => format!(
                "an alarm stands ({}): remove its cause; alarms of motion clear after two seconds at rest, the others let \
                 the worm move after `wormd command reset`",
                alarm_names(self.reply.alarm_mask)
            ),
            CommandOutcome::Unknown => {
                "this controller does not know the command: is it of another version?".to_owned()
            }
        };
        Some(format!("{} refused: {why}", self.kind))
    }

    /// The command.
    pub(crate) fn kind(&self) -> CommandKind {
        self.kind
    }

    /// The controller's tick that took the command.
    pub(crate) fn tick(&self) -> u64 {
        self.reply.sequence
    }

    /// The outcome.
    pub(crate) fn outcome(&self) -> CommandOutcome {
        self.outcome
    }

    /// The outcome, by name.
    pub(crate) fn verdict(&self) -> &'static str {
        self.outcome.name()
    }

    /// The controller's mode after the command.
    pub(crate) fn mode(&self) -> &'static str {
        Mode::try_from(self.reply.mode).map_or("unknown", Mode::name)
    }

    /// The controller's fault.
    pub(crate) fn fault(&self) -> &'static str {
        Fault::try_from(self.reply.fault).map_or("unknown", Fault::name)
    }
}

/// The alarms of a mask, by name.
fn alarm_names(mask: u32) -> String {
    let names = AlarmKind::ALL
        .iter()
        .filter(|kind| mask >> kind.code() & 1 == 1)
        .map(|kind| kind.name());
    names.collect::<Vec<_>>().join(", ")
}
