//! The process that makes a trip: the topics and the time into a [`Guide`], its commands to the controller, and how it stands to everybody.
//!
//! - [`wire`]: what others may tell it.
//! - [`words`]: how a trip stands, in words.

pub(crate) mod wire;
pub(crate) mod words;

use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::supervisor::controller::{self, command};
use crate::topics::{CommandClient, Hub, Instance, Publisher, RoleLock, Subscriber, Trip};
use crate::{print, syslog};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use wire::{Answer, Asked, Listener};
use worm_estimator::message::{
    Command, CommandKind, CommandRecord, Cycle, Estimate, Inferred, JsonMessage, Range, ShortText, State, TripStatus,
};
use worm_plan::guide::{LIMIT_S, SENDER};
use worm_plan::{Action, Guide};

/// How often topics are read and the guide is asked.
const ROUND: Duration = Duration::from_millis(50);
/// How often a trip says how it stands where nothing changes.
const REPORT: Duration = Duration::from_millis(500);
/// How long a trip stays after its end, so that its last word is read.
const FAREWELL: Duration = Duration::from_millis(300);
/// The name in the computer's log.
const LOG_NAME: &str = "wormd-trip";

/// Makes the trip; returns how it stood at its end. Calls `begun` once the worm crawls.
///
/// # Errors
/// [`Failure::Failed`] when the topics or the socket fail.
pub(crate) fn run(
    guide: Guide,
    instance: &Instance,
    role: &RoleLock<Trip>,
    end: &AtomicBool,
    begun: impl FnOnce(),
) -> Result<TripStatus, Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let mut traveller = Traveller {
        worm: instance.worm().to_owned(),
        guide,
        listener: Listener::bind(instance)?,
        client: hub.command_client().map_err(Failure::failed)?,
        topics: Topics::open(&hub)?,
        publisher: hub.publisher(role).map_err(Failure::failed)?,
        told: None,
        told_at: Instant::now(),
        refusal: None,
    };
    let mut begun = Some(begun);
    let mut is_ending = false;
    while !traveller.guide.is_over() {
        // A second signal does not make it more of an end.
        if end.load(Ordering::Relaxed) && !std::mem::replace(&mut is_ending, true) {
            traveller.guide.end_here(monotonic_ns());
        }
        let round = Instant::now();
        traveller.round()?;
        if traveller.guide.has_crawled()
            && let Some(begun) = begun.take()
        {
            begun();
        }
        std::thread::sleep(ROUND.saturating_sub(round.elapsed()));
    }
    let last = traveller.report(true)?;
    let over = Instant::now();
    while over.elapsed() < FAREWELL {
        traveller.answer_all();
        traveller.publisher.idle().map_err(Failure::failed)?;
        std::thread::sleep(ROUND);
    }
    Ok(last)
}

/// A trip with all that it needs.
struct Traveller {
    worm: String,
    guide: Guide,
    listener: Listener,
    client: CommandClient,
    topics: Topics,
    publisher: Publisher<TripStatus>,
    /// What was published last, and when.
    told: Option<TripStatus>,
    told_at: Instant,
    /// The controller's last refusal, in words.
    refusal: Option<String>,
}

/// The topics that a trip reads.
struct Topics {
    state: Subscriber<State>,
    estimate: Subscriber<Estimate>,
    cycle: Subscriber<Cycle>,
    range: Subscriber<Range>,
    inferred: Subscriber<Inferred>,
    command: Subscriber<CommandRecord>,
}

impl Topics {
    fn open(hub: &Hub) -> Result<Self, Failure> {
        Ok(Self {
            state: hub.subscriber().map_err(Failure::failed)?,
            estimate: hub.subscriber().map_err(Failure::failed)?,
            cycle: hub.subscriber().map_err(Failure::failed)?,
            range: hub.subscriber().map_err(Failure::failed)?,
            inferred: hub.subscriber().map_err(Failure::failed)?,
            command: hub.subscriber().map_err(Failure::failed)?,
        })
    }

    /// Hands everything new to the guide. Commands come first: they say who made the worm hold.
    fn read(&mut self, guide: &mut Guide) -> Result<(), Failure> {
        let now_ns = monotonic_ns();
        while let Some(record) = self.command.next().map_err(Failure::failed)? {
            guide.note_command(&record, now_ns);
        }
        if let Some(estimate) = self.estimate.latest().map_err(Failure::failed)? {
            guide.note_estimate(&estimate);
        }
        if let Some(inferred) = self.inferred.latest().map_err(Failure::failed)? {
            guide.note_inferred(&inferred);
        }
        while let Some(cycle) = self.cycle.next().map_err(Failure::failed)? {
            guide.note_cycle(&cycle, now_ns);
        }
        while let Some(range) = self.range.next().map_err(Failure::failed)? {
            guide.note_range(&range);
        }
        if let Some(state) = self.state.latest().map_err(Failure::failed)? {
            guide.note_state(&state, now_ns);
        }
        Ok(())
    }
}

impl Traveller {
    fn round(&mut self) -> Result<(), Failure> {
        self.answer_all();
        self.topics.read(&mut self.guide)?;
        if let Some(action) = self.guide.next(monotonic_ns()) {
            self.carry_out(action);
        }
        self.report(false).map(drop)
    }

    fn carry_out(&mut self, action: Action) {
        let order = command_of(action);
        let answer = match controller::send(&self.client, order) {
            Ok(answer) => {
                if let Some(refusal) = answer.refusal()
                    && action != Action::Hold
                {
                    self.note_refusal(refusal);
                }
                Some((answer.outcome(), answer.tick()))
            }
            Err(failure) => {
                self.note_refusal(failure.to_string());
                None
            }
        };
        self.guide.answered(action, answer, monotonic_ns());
    }

    /// The same refusal is logged once.
    fn note_refusal(&mut self, refusal: String) {
        if self.refusal.as_ref() != Some(&refusal) {
            self.log(&refusal);
        }
        self.refusal = Some(refusal);
    }

    fn answer_all(&mut self) {
        while let Some(Asked { question, from }) = self.listener.next() {
            let now_ns = monotonic_ns();
            let refusal = match question.ask.order() {
                Some(order) => self.guide.order(order, ShortText::new(&question.by), now_ns).err(),
                None => {
                    if question.ask == wire::Ask::Alive {
                        self.guide.note_link(now_ns);
                    }
                    None
                }
            };
            if let Some(refusal) = &refusal {
                self.log(&format!("{}: {} refused: {refusal}", question.by, question.ask.name()));
            }
            if let Some(from) = from {
                let trip = json_of(&self.guide.status(now_ns)).unwrap_or_default();
                self.listener.answer(&from, &Answer { refusal, trip });
            }
        }
    }

    /// Publishes how the trip stands, at every change and now and then; logs changes.
    fn report(&mut self, now: bool) -> Result<TripStatus, Failure> {
        let status = self.guide.status(monotonic_ns());
        let is_change = self.told.as_ref().is_none_or(|told| words::differs(told, &status));
        if is_change {
            self.log(&words::change(&status));
        }
        if now || is_change || self.told_at.elapsed() >= REPORT {
            self.publisher.publish(&status).map_err(Failure::failed)?;
            self.guide.note_published();
            (self.told, self.told_at) = (Some(status), Instant::now());
        }
        Ok(status)
    }

    fn log(&self, text: &str) {
        print::log_line(format_args!("{}: {text}", self.worm));
        syslog::write(LOG_NAME, &self.worm, text);
    }
}

fn command_of(action: Action) -> Command {
    let of = |kind, cycles_per_s, limit_s| Command {
        cycles_per_s,
        limit_s,
        ..command(kind, SENDER)
    };
    match action {
        Action::Arm => of(CommandKind::Arm, 0.0, 0.0),
        Action::Crawl(cycles_per_s) => of(CommandKind::Crawl, cycles_per_s, LIMIT_S),
        Action::Renew => of(CommandKind::Renew, 0.0, LIMIT_S),
        Action::Hold => of(CommandKind::Hold, 0.0, 0.0),
    }
}

/// A message as JSON, as on the wire of the relay and in logs.
pub(crate) fn json_of(status: &TripStatus) -> serde_json::Result<serde_json::Value> {
    let mut bytes = Vec::new();
    status.write_json(&mut bytes)?;
    serde_json::from_slice(&bytes)
}
