//! Commands to a running controller, and why it refuses one.

use crate::failure::Failure;
use crate::topics::CommandClient;
use std::time::Duration;
use worm_estimator::message::{AlarmKind, Command, CommandKind, CommandOutcome, Fault, Mode, Reply};

/// How long the controller may take to answer: a reset prepares the servo again, which takes a while on a slow bus.
const REPLY_TIMEOUT: Duration = Duration::from_secs(2);

/// What the controller answered.
pub(crate) struct Answer {
    kind: CommandKind,
    outcome: CommandOutcome,
    reply: Reply,
}

/// Sends a command. `cycles_per_s` is the speed of a crawl; 0 stands for the configured gait.
///
/// # Errors
/// [`Failure::Failed`] when no controller answers, or its answer is unknown.
pub(crate) fn send(client: &CommandClient, kind: CommandKind, cycles_per_s: f64) -> Result<Answer, Failure> {
    let command = Command {
        cycles_per_s,
        ..Command::new(kind)
    };
    let reply = client.call(command, REPLY_TIMEOUT).map_err(Failure::failed)?;
    let outcome = CommandOutcome::try_from(reply.verdict).map_err(Failure::failed)?;
    Ok(Answer { kind, outcome, reply })
}

/// Sends a command that has to be accepted, with the configured gait.
///
/// # Errors
/// [`Failure::Failed`] when the controller does not answer, or refuses.
pub(super) fn order(client: &CommandClient, kind: CommandKind) -> Result<(), Failure> {
    match send(client, kind, 0.0)?.refusal() {
        None => Ok(()),
        Some(refusal) => Err(Failure::failed(format!("the controller: {refusal}"))),
    }
}

impl Answer {
    /// The answer as the JSON that `wormd command --json` prints.
    pub(crate) fn to_json(&self) -> serde_json::Value {
        serde_json::json!({
            "command": self.kind.name(),
            "verdict": self.outcome.name(),
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
            CommandOutcome::WrongMode => format!("not while {mode}"),
            CommandOutcome::FaultPersists => format!("the cause is still present ({}): remove it first", self.fault()),
            CommandOutcome::BadSpeed => {
                "the speed is not a number, or beyond servo.velocity_limit_rev_per_min".to_owned()
            }
            CommandOutcome::NoEstimator => {
                "no estimator is running: start `wormd estimate`, or set control.require_estimator = false".to_owned()
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

    fn mode(&self) -> &'static str {
        Mode::try_from(self.reply.mode).map_or("unknown", Mode::name)
    }

    fn fault(&self) -> &'static str {
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
