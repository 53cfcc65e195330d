//! The thread that gives the controller commands and waits for its answers, so that no watcher has to.

use super::drive::{LIMIT_S, WatcherId};
use super::lateness;
use super::wire::{Answer, Request};
use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::supervisor::controller::{self, command};
use crate::topics::{CommandClient, Hub};
use crate::trip::{self, wire::Question};
use crossbeam::channel::{Receiver, Sender, TrySendError, bounded};
use std::collections::VecDeque;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::thread::JoinHandle;
use std::time::Duration;
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, Command, CommandKind, ShortText};

/// Commands that may wait. The controller answers within a tick unless it arms or resets.
const QUEUE: usize = 32;

/// Remarks that may wait until fewer commands do.
const REMARKS: usize = 16;

/// How long the controller may take for a remark: whoever commands waits behind it.
const REMARK_TIMEOUT: Duration = Duration::from_millis(100);

/// The relay's name in the record of commands, where it acts by itself.
const SENDER: &str = "relay";

/// What the controller is to be told.
#[derive(Debug)]
pub(super) enum Job {
    /// The request of a watcher.
    Request {
        watcher: WatcherId,
        /// Its user, for the controller's record.
        user: u32,
        /// Its name, for the same.
        name: String,
        id: Option<u64>,
        /// When it was asked for, ns of `CLOCK_MONOTONIC`.
        sent_ns: u64,
        request: Request,
    },
    /// Hold, because nobody attends any more. The sender says who did.
    Hold(ShortText),
    /// Go on crawling for a moment.
    Renew,
    /// Note this in the record.
    Remark(Command),
}

/// What came of it.
#[derive(Debug)]
pub(super) enum Outcome {
    /// For the watcher that asked.
    Answer(Answer),
    /// The hold was refused, or got no answer.
    NotHeld(String),
    /// The worm does not crawl any more, for this reason.
    NotRenewed(String),
}

/// The way to the thread, and back.
pub(super) struct Commander {
    /// None once the thread is to end.
    jobs: Option<Sender<Job>>,
    thread: Option<JoinHandle<()>>,
    outcomes: Receiver<Outcome>,
    /// Has a byte to read for each outcome, as far as they fit.
    answered: UnixStream,
    /// Remarks that wait: commands come first.
    remarks: VecDeque<Command>,
}

impl Commander {
    /// Starts the thread. Its port is of this hub.
    pub(super) fn start(config: &Config, hub: Hub) -> Result<Self, Failure> {
        let (jobs, queue) = bounded::<Job>(QUEUE);
        let (results, outcomes) = bounded(4 * QUEUE);
        let (answered, mut wake) = UnixStream::pair().map_err(Failure::failed)?;
        for end in [&answered, &wake] {
            end.set_nonblocking(true).map_err(Failure::failed)?;
        }
        let config = config.clone();
        let work = move || {
            // Ports belong to the thread that makes them. They are gone before their hub.
            let client = match hub.command_client() {
                Ok(client) => client,
                Err(error) => {
                    tracing::error!("no commands can be given: {error}");
                    return;
                }
            };
            for job in queue {
                let Some(outcome) = carry_out(&client, &config, job) else {
                    continue;
                };
                // There is room for all that can be queued, but at the end nobody takes them any more.
                let _ = results.try_send(outcome);
                // One that is full wakes as well.
                let _ = wake.write(&[0]);
            }
        };
        let thread = std::thread::Builder::new()
            .name("commander".to_owned())
            .spawn(work)
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        Ok(Self {
            jobs: Some(jobs),
            thread: Some(thread),
            outcomes,
            answered,
            remarks: VecDeque::new(),
        })
    }

    /// Hands over a job; gives it back when too many wait, or nobody carries them out.
    pub(super) fn order(&self, job: Job) -> Result<(), Job> {
        match &self.jobs {
            Some(jobs) => jobs.try_send(job).map_err(TrySendError::into_inner),
            None => Err(job),
        }
    }

    /// Takes a remark, which is handed over as soon as little waits. What is too much is left out: the log has it anyway.
    pub(super) fn remark(&mut self, remark: Command) {
        if self.remarks.len() < REMARKS {
            self.remarks.push_back(remark);
        }
        self.hand_over_remarks();
    }

    /// Hands over what was remarked, unless much waits: commands come first.
    pub(super) fn hand_over_remarks(&mut self) {
        let Some(jobs) = &self.jobs else { return };
        while jobs.len() < QUEUE / 8
            && let Some(remark) = self.remarks.pop_front()
        {
            if jobs.try_send(Job::Remark(remark)).is_err() {
                return tracing::debug!("nobody records what was refused or taken over");
            }
        }
    }

    /// What came of jobs since the last call.
    pub(super) fn outcomes(&self) -> impl Iterator<Item = Outcome> + '_ {
        // Nothing to read is no error.
        let _ = (&self.answered).read(&mut [0; 2 * QUEUE]);
        self.outcomes.try_iter()
    }

    /// Becomes readable when there are outcomes.
    pub(super) fn answered(&self) -> &UnixStream {
        &self.answered
    }
}

impl Drop for Commander {
    /// Waits for the thread: what is queued is still carried out, and its port is closed in order.
    fn drop(&mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // It has nothing to say about how it ended.
            let _ = thread.join();
        }
    }
}

fn carry_out(client: &CommandClient, config: &Config, job: Job) -> Option<Outcome> {
    match job {
        Job::Request {
            watcher,
            user,
            name,
            id,
            sent_ns,
            request,
        } => {
            // It may have waited here for the answers to others.
            if let Some(refusal) = lateness::refusal(&request, sent_ns, monotonic_ns()) {
                let answer = Answer::own(watcher, id, request.name(), "stale", Some(refusal));
                return Some(Outcome::Answer(answer));
            }
            let command = controllers_command(&request, user, &name);
            Some(Outcome::Answer(answer(
                client, config, watcher, id, &request, &name, command,
            )))
        }
        Job::Hold(sender) => {
            let hold = Command {
                sender,
                ..command(CommandKind::Hold, SENDER)
            };
            let refusal = match controller::send(client, hold) {
                Ok(answer) => answer.refusal()?,
                Err(failure) => failure.to_string(),
            };
            Some(Outcome::NotHeld(refusal))
        }
        Job::Renew => {
            let renewal = Command {
                limit_s: LIMIT_S,
                ..command(CommandKind::Renew, SENDER)
            };
            let refusal = match controller::send(client, renewal) {
                Ok(answer) => answer.refusal()?,
                Err(failure) => failure.to_string(),
            };
            Some(Outcome::NotRenewed(refusal))
        }
        Job::Remark(remark) => {
            // An older controller does not know it, and records that.
            if let Err(error) = client.call(remark, REMARK_TIMEOUT) {
                tracing::debug!("not recorded: {error}");
            }
            None
        }
    }
}

/// Gives a watcher's command, and words the answer as `wormd command` does.
fn answer(
    client: &CommandClient,
    config: &Config,
    watcher: WatcherId,
    id: Option<u64>,
    request: &Request,
    by: &str,
    command: Result<Command, String>,
) -> Answer {
    let refused = |verdict, refusal| Answer::own(watcher, id, request.name(), verdict, Some(refusal));
    if let Request::Trip { action } = request {
        let question = Question {
            ask: *action,
            by: by.to_owned(),
        };
        return match trip::wire::ask(client.instance(), &question) {
            Ok(trip::wire::Answer { refusal: None, .. }) => {
                let name = format!("trip {}", action.name());
                Answer::own(watcher, id, &name, "accepted", None)
            }
            Ok(trip::wire::Answer { refusal, .. }) => refused("refused", refusal.unwrap_or_default()),
            Err(failure) => refused("no-answer", failure.to_string()),
        };
    }
    let command = match command {
        Ok(command) => command,
        Err(refusal) => return refused("unusable", refusal),
    };
    let sent = match request {
        // The way that needs neither the topics nor room in shared memory comes first.
        Request::Stop => match controller::stop_by_socket(config, &command) {
            Ok(answer) => Ok(answer),
            Err(Some(failure)) => Err(failure),
            Err(None) => controller::send(client, command),
        },
        _ => controller::send(client, command),
    };
    match sent {
        Ok(answer) => Answer::of_controller(watcher, id, request.name(), &answer),
        Err(failure) => refused("no-answer", failure.to_string()),
    }
}

/// The command that a request is for the controller.
fn controllers_command(request: &Request, user: u32, sender: &str) -> Result<Command, String> {
    let kind = request.kind().ok_or("it is not for the controller")?;
    let mut command = Command {
        user,
        sender: ShortText::new(sender),
        ..Command::new(kind)
    };
    match request {
        Request::Crawl { cycles_per_s } => {
            command.cycles_per_s = cycles_per_s.unwrap_or(0.0);
            command.limit_s = LIMIT_S;
        }
        Request::Acknowledge { alarms } if alarms.is_empty() => {
            command.alarm_mask = AlarmKind::ALL.iter().fold(0, |mask, kind| mask | 1 << kind.code());
        }
        Request::Acknowledge { alarms } => {
            for name in alarms {
                let kind = AlarmKind::from_name(name).ok_or_else(|| format!("there is no alarm {name:?}"))?;
                command.alarm_mask |= 1 << kind.code();
            }
        }
        Request::Mark { position_m, sigma_m } => {
            command.position_m = *position_m;
            command.position_sigma_m = sigma_m.unwrap_or(0.0);
        }
        _ => {}
    }
    Ok(command)
}
