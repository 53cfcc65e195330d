//! The decisions of a trip that is under way: where the worm is on its route, whether it goes on, home, or waits, and why.
//!
//! A [`Guide`] takes what the topics say and the time, and answers with the next command for the controller. It has no clock and does no
//! I/O. docs/trips.md has its states and transitions as a table.
//!
//! - A trip has a *heading*, out or home, and may *wait*. Once it goes home it goes home, unless an operator says otherwise.
//! - Nothing but its start and an operator's word arms the worm. Whoever else commands the worm makes the trip wait for an operator.
//! - Its crawl is permitted for [`LIMIT_S`] at a time and renewed while this is called: a trip that is killed leaves a worm that holds.

mod by_current;
mod place;
mod rules;
mod status;
#[cfg(test)]
mod tests;

use super::correction::Correction;
use super::design::{Going, Workbench};
use super::energy_budget::EnergyBudget;
use super::itinerary::{Heading, Impassable, Itinerary};
use super::route::Route;
use by_current::ByCurrent;
use place::Place;
use std::collections::VecDeque;
use worm_estimator::config::{Config, OnLinkLoss, OnStuck, Policy, Trip};
use worm_estimator::message::{
    AlarmKind, CommandKind, CommandOutcome, CommandRecord, Cycle, Estimate, Inferred, Range, ShortText, State,
    TripPhase, TripReason,
};

/// The name of a trip in the record of commands.
pub const SENDER: &str = "wormd trip";
/// For how long a crawl is permitted at a time, s.
pub const LIMIT_S: f64 = 0.8;
/// How often it is permitted anew, ns.
const RENEWAL_NS: u64 = 200_000_000;
/// Silence of the controller after which it is gone, ns.
const CONTROLLER_TIMEOUT_NS: u64 = 2_000_000_000;
/// A guide that was not called for so long, while the controller ran, was suspended: somebody may be at the worm, ns.
const SUSPENDED_NS: u64 = 3_000_000_000;
/// How long a refused crawl is tried again, ns, and how often.
const RETRY_FOR_NS: u64 = 30_000_000_000;
const RETRY_NS: u64 = 1_000_000_000;
/// Crawls that may lapse within a minute, for want of a renewal, before an operator has to look.
const MAX_LAPSES: usize = 3;
const LAPSES_NS: u64 = 60_000_000_000;

/// What the controller is to be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// Torque on.
    Arm,
    /// Crawl with this many gait cycles per second, negative for backward, for [`LIMIT_S`].
    Crawl(f64),
    /// Go on crawling for [`LIMIT_S`].
    Renew,
    /// Hold.
    Hold,
}

/// What an operator may tell a trip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Hold, and wait.
    Pause,
    /// Go on after a wait.
    Resume,
    /// Go home.
    Return,
    /// Go out again.
    Outbound,
    /// End the trip here.
    Abort,
}

/// What a trip waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wait {
    /// An operator's word.
    Operator,
    /// The link.
    Link,
    /// That the controller accepts a crawl.
    Retry { next_ns: u64, until_ns: u64 },
}

/// Whether the worm crawls by this trip's command.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    Rest,
    Crawling {
        cycles_per_s: f64,
        /// The controller's tick that took the newest command: an older state says nothing of it.
        tick: u64,
        permitted_ns: u64,
    },
}

/// Why the trip does what it does.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Why {
    reason: TripReason,
    alarm: Option<AlarmKind>,
    by: ShortText,
    since_ns: u64,
}

/// The newest state.
#[derive(Debug, Clone, Copy)]
struct Seen {
    state: State,
    /// When it was taken.
    at_ns: u64,
}

impl Seen {
    /// Time of the controller without the pauses of its computer, ns.
    fn loop_ns(&self) -> u64 {
        self.state.time_ns.saturating_sub(self.state.host_paused_ns)
    }
}

/// One trip.
#[derive(Debug, Clone)]
pub struct Guide {
    itinerary: Itinerary,
    settings: Trip,
    return_home: bool,
    /// Bit k set: the alarm with code k makes the controller stop or hold.
    acting_alarms: u32,
    budget: Option<EnergyBudget>,
    correction: Correction,
    by_current: ByCurrent,
    place: Place,
    heading: Heading,
    wait: Option<Wait>,
    /// How it ended.
    over: Option<TripPhase>,
    why: Why,
    motion: Motion,
    has_crawled: bool,
    /// Whether a disarmed worm may be armed: after the start and an operator's word.
    may_arm: bool,
    seen: Option<Seen>,
    raised_mask: u32,
    /// When this was called last, and the controller's time then.
    called: Option<(u64, u64)>,
    heard_ns: u64,
    link_is_lost: bool,
    lapses: VecDeque<u64>,
    /// When the worm was last told to hold, while it waits for the link.
    held_ns: u64,
    /// How often it is told so: a hold that is never commanded again ends, and torque goes off.
    hold_again_ns: u64,
    /// Advance of the newest cycles over the planned one.
    progress: VecDeque<f64>,
    started_ns: u64,
    published: u64,
}

impl Guide {
    /// A trip that begins now, at home. Without `return_home` it is over at the end of the route.
    ///
    /// # Errors
    /// [`Impassable`] for the first leg that the worm cannot crawl, out or home. A trip that goes one way and never returns by itself needs no
    /// way home.
    pub fn new(
        bench: &Workbench,
        config: &Config,
        route: &Route,
        return_home: bool,
        now_ns: u64,
    ) -> Result<Self, Impassable> {
        let settings = config.trip.clone();
        let going = if config.gait.direction.sign() < 0.0 {
            Going::Backward
        } else {
            Going::Forward
        };
        let needs_home =
            return_home || settings.link_loss == OnLinkLoss::Return || settings.on_stuck == OnStuck::Return;
        let itinerary = Itinerary::new(bench, route, going, needs_home)?;
        let acting = AlarmKind::ALL
            .iter()
            .filter(|&&kind| config.alarms.of(kind).policy != Policy::Warn);
        Ok(Self {
            budget: EnergyBudget::new(bench, settings.reserve_share),
            acting_alarms: acting.fold(0, |mask, kind| mask | 1 << kind.code()),
            itinerary,
            return_home,
            correction: Correction::new(),
            by_current: ByCurrent::default(),
            place: Place::home(now_ns),
            heading: Heading::Out,
            wait: None,
            over: None,
            why: Why {
                reason: TripReason::Started,
                alarm: None,
                by: ShortText::EMPTY,
                since_ns: now_ns,
            },
            motion: Motion::Rest,
            has_crawled: false,
            may_arm: true,
            seen: None,
            raised_mask: 0,
            called: None,
            heard_ns: now_ns,
            link_is_lost: false,
            lapses: VecDeque::new(),
            held_ns: now_ns,
            hold_again_ns: (0.5e9 * config.control.idle_disarm_s) as u64,
            progress: VecDeque::new(),
            started_ns: now_ns,
            published: 0,
            settings,
        })
    }

    /// The route with what it costs.
    pub const fn itinerary(&self) -> &Itinerary {
        &self.itinerary
    }

    /// Whether the trip is over and the worm was told to hold.
    pub fn is_over(&self) -> bool {
        self.over.is_some() && self.motion == Motion::Rest
    }

    /// Whether the worm has crawled on this trip.
    pub const fn has_crawled(&self) -> bool {
        self.has_crawled
    }

    /// Takes the controller's newest state.
    pub fn note_state(&mut self, state: &State, now_ns: u64) {
        self.seen = Some(Seen {
            state: *state,
            at_ns: now_ns,
        });
        self.by_current.note_phase(state.phase, self.place.m, &self.itinerary);
    }

    /// Takes what the motor's current says of the worm: it counts for the cycles that nobody sees.
    pub const fn note_inferred(&mut self, inferred: &Inferred) {
        self.by_current.note(inferred);
    }

    /// Takes the newest estimate, for the alarms that are raised.
    pub const fn note_estimate(&mut self, estimate: &Estimate) {
        self.raised_mask = estimate.raised_mask;
    }

    /// Takes how far the battery lasts.
    pub fn note_range(&mut self, range: &Range) {
        if let Some(budget) = &mut self.budget {
            budget.note_range(range);
        }
    }

    /// Takes a finished gait cycle, whoever commanded it: the worm is where it is.
    pub fn note_cycle(&mut self, cycle: &Cycle, now_ns: u64) {
        let (itinerary, by_current) = (&self.itinerary, &self.by_current);
        let Some(progress) = self.place.add(itinerary, &mut self.correction, by_current, cycle) else {
            return;
        };
        if progress.heading == self.heading && self.wait.is_none() && self.over.is_none() {
            self.note_progress(progress.fraction, now_ns);
        }
    }

    /// Takes a command that the controller was given.
    pub fn note_command(&mut self, record: &CommandRecord, now_ns: u64) {
        let is_own = record.sender.as_str() == SENDER;
        let is_old = record.time_ns < self.started_ns;
        if is_own || is_old || record.outcome != CommandOutcome::Accepted.code() || self.over.is_some() {
            return;
        }
        let reason = match CommandKind::try_from(record.kind) {
            Ok(CommandKind::Crawl) => TripReason::OtherDriver,
            Ok(CommandKind::Hold) => TripReason::HoldCommanded,
            Ok(CommandKind::Stop) => TripReason::StopCommanded,
            Ok(CommandKind::Mark) => return self.note_mark(record),
            _ => return,
        };
        // Whoever commands has what they want; a hold of this trip would overrule it.
        self.motion = Motion::Rest;
        self.wait_for(Wait::Operator, reason, now_ns);
        self.why.by = record.sender;
    }

    /// Somebody says where the worm is. A tracker knows better.
    fn note_mark(&mut self, record: &CommandRecord) {
        if self.place.is_seen() {
            return;
        }
        if self.place.cycles == 0 {
            return self.by_current.mark_home(record);
        }
        let advance_m = self.advance_m();
        let place = self
            .by_current
            .place_of_mark(record, self.heading, &self.itinerary, advance_m);
        if let Some(place) = place {
            self.place.mark(&place);
        }
    }

    /// Somebody who attends was heard.
    pub const fn note_link(&mut self, now_ns: u64) {
        self.heard_ns = now_ns;
    }

    /// Does what an operator says; `by` is who.
    ///
    /// # Errors
    /// In words, where that cannot be done.
    pub fn order(&mut self, order: Order, by: ShortText, now_ns: u64) -> Result<(), String> {
        if let Some(phase) = self.over {
            return Err(format!("the trip is over ({phase})"));
        }
        self.heard_ns = now_ns;
        match order {
            Order::Pause => self.wait_for(Wait::Operator, TripReason::Operator, now_ns),
            Order::Abort => self.end(TripPhase::Aborted, TripReason::Operator, now_ns),
            Order::Resume if self.wait.is_none() => return Err("the trip does not wait for anything".to_owned()),
            Order::Resume => self.go(self.heading, TripReason::Operator, now_ns),
            Order::Return if !self.itinerary.can_go_home() => {
                return Err("the worm cannot crawl home on this route".to_owned());
            }
            Order::Return => self.go(Heading::Home, TripReason::Operator, now_ns),
            Order::Outbound if self.is_energy_due(now_ns) => {
                return Err("what is left in the battery is needed for the way home".to_owned());
            }
            Order::Outbound => self.go(Heading::Out, TripReason::Operator, now_ns),
        }
        self.why.by = by;
        let is_motion = matches!(order, Order::Resume | Order::Return | Order::Outbound);
        if is_motion {
            self.may_arm = true;
            self.lapses.clear();
        }
        Ok(())
    }

    /// This process is told to end.
    pub fn end_here(&mut self, now_ns: u64) {
        if self.over.is_none() {
            self.end(TripPhase::Aborted, TripReason::Ended, now_ns);
        }
    }

    /// The next command, if one is due. Call it at least five times a second, after the newest messages were taken; give what the controller
    /// says to [`answered`](Self::answered) before the next call.
    pub fn next(&mut self, now_ns: u64) -> Option<Action> {
        if self.over.is_none() {
            self.decide(now_ns);
        }
        self.called = Some((now_ns, self.seen.as_ref().map_or(0, Seen::loop_ns)));
        let may_crawl = self.over.is_none()
            && match self.wait {
                None => true,
                Some(Wait::Retry { next_ns, .. }) => now_ns >= next_ns,
                Some(Wait::Operator | Wait::Link) => false,
            };
        if !may_crawl {
            return match self.motion {
                Motion::Crawling { .. } => Some(Action::Hold),
                Motion::Rest if self.wait == Some(Wait::Link) => {
                    (now_ns.saturating_sub(self.held_ns) >= self.hold_again_ns).then_some(Action::Hold)
                }
                Motion::Rest => None,
            };
        }
        let wanted = self.wanted_cycles_per_s();
        match self.motion {
            Motion::Crawling {
                cycles_per_s,
                permitted_ns,
                ..
            } if cycles_per_s == wanted => (now_ns.saturating_sub(permitted_ns) >= RENEWAL_NS).then_some(Action::Renew),
            _ => self.begin_crawl(wanted),
        }
    }

    /// What the controller made of an action: its tick, or nothing where it gave no answer.
    pub fn answered(&mut self, action: Action, answer: Option<(CommandOutcome, u64)>, now_ns: u64) {
        let accepted = answer.filter(|(outcome, _)| *outcome == CommandOutcome::Accepted);
        match (action, accepted) {
            (Action::Arm, Some(_)) => self.may_arm = false,
            (Action::Crawl(cycles_per_s), Some((_, tick))) => {
                self.motion = Motion::Crawling {
                    cycles_per_s,
                    tick,
                    permitted_ns: now_ns,
                };
                (self.has_crawled, self.may_arm) = (true, false);
                if self.wait.take().is_some() {
                    self.why.since_ns = now_ns;
                }
            }
            (Action::Renew, Some((_, tick))) => {
                if let Motion::Crawling {
                    permitted_ns, tick: at, ..
                } = &mut self.motion
                {
                    (*permitted_ns, *at) = (now_ns, tick);
                }
            }
            // A hold that is refused finds a worm that does not crawl. One without an answer is given again: the crawl lapses anyway.
            (Action::Hold, _) => {
                if answer.is_some() {
                    (self.motion, self.held_ns) = (Motion::Rest, now_ns);
                }
            }
            // The state says why.
            (Action::Renew, None) => {}
            (Action::Arm | Action::Crawl(_), None) => self.refused(now_ns),
        }
    }
}
