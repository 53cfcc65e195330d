//! Holds past a relay that does not answer: straight to the controller, as `wormd command hold`.

use super::wire::Answer;
use crate::failure::Failure;
use crate::supervisor::controller;
use crate::topics::{Controller, Hub, Instance, RoleLock};
use crossbeam::channel::{Receiver, TryRecvError, bounded};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use worm_estimator::message::CommandKind;

/// For how long a relay may leave a hold without an answer.
pub(crate) const PATIENCE: Duration = Duration::from_millis(500);

/// The holds that one watcher has asked the relay for, and that are not answered yet.
pub(crate) struct HoldWatch {
    instance: Instance,
    waiting: BTreeMap<u64, Waiting>,
    /// The hold that is under way past the relay: one at a time, and it answers all that waited when it began.
    direct: Option<Direct>,
}

struct Waiting {
    since: Instant,
    sender: String,
}

struct Direct {
    ids: Vec<u64>,
    outcome: Receiver<Answer>,
}

impl HoldWatch {
    /// No hold has been asked for.
    pub(crate) fn new(instance: &Instance) -> Self {
        Self {
            instance: instance.clone(),
            waiting: BTreeMap::new(),
            direct: None,
        }
    }

    /// The relay was asked for a hold, by this name.
    pub(crate) fn asked(&mut self, id: u64, sender: &str) {
        let (since, sender) = (Instant::now(), sender.to_owned());
        self.waiting.insert(id, Waiting { since, sender });
    }

    /// The relay has answered this request.
    pub(crate) fn answered(&mut self, id: u64) {
        self.waiting.remove(&id);
    }

    /// Sends what has waited for too long past the relay, from a thread; returns the answers that came that way. Never waits.
    pub(crate) fn poll(&mut self) -> Vec<Answer> {
        let mut answers = Vec::new();
        if let Some(direct) = &self.direct {
            let outcome = match direct.outcome.try_recv() {
                Ok(outcome) => outcome,
                Err(TryRecvError::Empty) => return answers,
                Err(TryRecvError::Disconnected) => no_answer("the thread for it has failed"),
            };
            for id in &direct.ids {
                if self.waiting.remove(id).is_some() {
                    let id = Some(*id);
                    answers.push(Answer { id, ..outcome.clone() });
                }
            }
            self.direct = None;
        }
        let overdue = self
            .waiting
            .values()
            .find(|waiting| waiting.since.elapsed() >= PATIENCE);
        if let Some(Waiting { sender, .. }) = overdue {
            if is_possible(&self.instance) {
                self.direct = Some(Direct {
                    outcome: start(&self.instance, sender),
                    ids: self.waiting.keys().copied().collect(),
                });
            } else {
                self.waiting.clear();
            }
        }
        answers
    }
}

/// Whether the worm's controller is on this computer: another one is reached by its relay alone.
pub(crate) fn is_possible(instance: &Instance) -> bool {
    RoleLock::<Controller>::holder(instance).is_some()
}

/// Tells the controller to hold, and waits for its answer, which says that it came past the relay.
pub(crate) fn hold(instance: &Instance, sender: &str) -> Answer {
    let sent = Hub::open(instance).map_err(Failure::failed).and_then(|hub| {
        let client = hub.command_client().map_err(Failure::failed)?;
        controller::send(&client, controller::command(CommandKind::Hold, sender))
    });
    match sent {
        Ok(answer) => Answer {
            note: Some("the relay does not answer, so the hold went past it, straight to the controller".to_owned()),
            ..Answer::of_controller(0, None, "hold", &answer)
        },
        Err(failure) => no_answer(&failure.to_string()),
    }
}

fn start(instance: &Instance, sender: &str) -> Receiver<Answer> {
    let (tell, outcome) = bounded(1);
    let (instance, sender, failed) = (instance.clone(), sender.to_owned(), tell.clone());
    // Who asked may have gone.
    let work = move || drop(tell.send(hold(&instance, &sender)));
    if let Err(error) = std::thread::Builder::new().name("direct-hold".to_owned()).spawn(work) {
        let _ = failed.send(no_answer(&format!("no thread can be started: {error}")));
    }
    outcome
}

fn no_answer(why: &str) -> Answer {
    let refusal = format!("the relay does not answer, and past it the hold did not get through: {why}");
    Answer::own(0, None, "hold", "no-answer", Some(refusal))
}
