//! One laptop, from the bridge's side: what waits for it, its connections to the relays, and the rules for what it may ask.

use super::backlog::Backlog;
use super::network::Party;
use super::refusals::Refusals;
use super::wire::{Beat, Echo, RemoteRequest, RemoteWatcher, Up};
use crate::relay::client::{Received, RelayLink};
use crate::relay::connection::Connection;
use crate::relay::wire::{Answer, Line, NetworkRefusal, Request, VERSION as RELAY_VERSION};
use crate::topics::Instance;
use crate::trip::wire::Ask;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

/// A message that may be older than this is no sign of life, and no command but a hold is taken from it, ns. A second after the network has
/// gone, nothing of what it holds back does anything any more.
pub(crate) const FRESH_NS: u64 = 1_000_000_000;
/// A watcher that was not heard of for so long behind its laptop has gone.
const SEAT_IDLE: Duration = Duration::from_secs(10);
/// Most watchers of a laptop that may command at a time.
const MAX_SEATS: usize = 32;
/// Longest name of a watcher that is passed on, characters.
const MAX_NAME: usize = 40;

/// A worm that the bridge serves.
#[derive(Debug)]
pub(crate) struct Served {
    pub(crate) name: String,
    pub(crate) instance: Instance,
    /// The arguments that select it for a relay.
    pub(crate) arguments: Vec<OsString>,
}

/// One process on a laptop.
pub(crate) struct Remote {
    pub(crate) party: Party,
    pub(crate) may_drive: bool,
    pub(crate) backlog: Backlog,
    /// A connection to the relay of each worm, in their order.
    feeds: Vec<RelayLink>,
    /// When somebody behind the laptop last watched each worm.
    watched: Vec<Option<Instant>>,
    seats: BTreeMap<RemoteWatcher, Seat>,
    heard: Instant,
    round_trip_ms: Option<u64>,
}

/// The connection of a watcher that commands: one of its own, which is heard when the watcher is.
struct Seat {
    connection: Connection,
    heard: Instant,
}

impl Remote {
    /// A laptop that has just been heard.
    pub(crate) fn new(party: Party, may_drive: bool, stream: u64, worms: &[Served]) -> Self {
        let name = |worm: &Served| worm.name.clone();
        let feed = |worm: &Served| {
            let mut link = RelayLink::new(
                &worm.instance,
                worm.arguments.clone(),
                format!("bridge for {}", party.certificate),
            );
            link.set_attending(false);
            link
        };
        Self {
            may_drive,
            backlog: Backlog::new(stream, worms.iter().map(name)),
            feeds: worms.iter().map(feed).collect(),
            watched: vec![None; worms.len()],
            seats: BTreeMap::new(),
            heard: Instant::now(),
            round_trip_ms: None,
            party,
        }
    }

    /// Begins anew: all that waits or was under way is forgotten, and the relays tell their histories again.
    pub(crate) fn restart(&mut self, stream: u64, worms: &[Served]) {
        tracing::info!("{}: pieces were lost: it gets everything anew", self.party.certificate);
        let answers = std::mem::replace(
            &mut self.backlog,
            Backlog::new(stream, worms.iter().map(|worm| worm.name.clone())),
        );
        self.backlog.adopt_answers(answers);
        self.feeds.iter_mut().for_each(RelayLink::close);
    }

    /// Since when nothing was heard of it.
    pub(crate) fn silence(&self) -> Duration {
        self.heard.elapsed()
    }

    /// Adds how the bridge stands to what waits.
    pub(crate) fn beat(&mut self, mut beat: Beat) {
        beat.may_drive = self.may_drive;
        beat.round_trip_ms = self.round_trip_ms;
        self.backlog.beat(beat);
    }

    /// Takes a message. True when a new stream is needed.
    pub(crate) fn take(&mut self, up: Up, worms: &[Served], refusals: &mut Refusals, now_ns: u64) -> bool {
        self.heard = Instant::now();
        if let Some(echo) = up.echo {
            self.backlog.confirm(echo, now_ns);
        }
        let age_ns = up.echo.and_then(|echo: Echo| self.backlog.age_ns(echo, now_ns));
        self.round_trip_ms = age_ns.map(|age_ns| age_ns / 1_000_000);
        let is_fresh = age_ns.is_some_and(|age_ns| age_ns < FRESH_NS);
        if is_fresh {
            for watcher in &up.watchers {
                if let Some(index) = worms.iter().position(|worm| worm.name == watcher.worm) {
                    self.watched[index] = Some(Instant::now());
                }
                if let Some(seat) = self.seats.get_mut(watcher) {
                    seat.heard = Instant::now();
                    seat.connection.send(None, Request::Alive);
                }
            }
            // Whom the laptop does not name any more has gone there.
            let is_there = |watcher: &RemoteWatcher| up.watchers.contains(watcher);
            self.seats
                .retain(|watcher, seat| is_there(watcher) || seat.heard.elapsed() < Duration::from_millis(500));
        }
        for request in up.requests {
            self.request(request, is_fresh, worms, refusals);
        }
        (up.is_lost && self.backlog.is_read_by(up.echo)) || self.backlog.is_stuck(now_ns)
    }

    fn request(&mut self, request: RemoteRequest, is_fresh: bool, worms: &[Served], refusals: &mut Refusals) {
        let RemoteRequest { from, name, line } = request;
        let refuse =
            |verdict: &str, refusal: String| Answer::own(0, line.id, line.request.name(), verdict, Some(refusal));
        let Some((index, worm)) = worms.iter().enumerate().find(|(_, worm)| worm.name == from.worm) else {
            let refusal = format!("this bridge has no worm {}", from.worm);
            return self.backlog.add_answer(from, refuse("unusable", refusal));
        };
        if matches!(line.request, Request::NoteRefusal { .. }) {
            let refusal = "a bridge alone notes what it refuses".to_owned();
            return self.backlog.add_answer(from, refuse("unusable", refusal));
        }
        let given: String = name.unwrap_or_default().chars().take(MAX_NAME).collect();
        let name = match given.as_str() {
            "" => self.party.certificate.clone(),
            given => format!("{} {given}", self.party.certificate),
        };
        let mut note = |why: NetworkRefusal| {
            // Of the worm as it is now: where it does not run, nothing is recorded.
            if refusals.is_due(&self.party.certificate, &worm.name, why, Instant::now()) {
                let noted = Request::NoteRefusal {
                    name: name.clone(),
                    refused: line.request.name().to_owned(),
                    verdict: why,
                };
                self.feeds[index].send(0, noted);
            }
        };
        // To halt, anybody who may connect at all, however late.
        let is_halt = matches!(line.request, Request::Hold | Request::Trip { action: Ask::Pause });
        if !is_halt && !self.may_drive {
            note(NetworkRefusal::NotPermitted);
            let refusal = format!(
                "the certificate {} may watch and hold, and nothing else: [access] in the robot's bridge.toml says who may drive",
                self.party.certificate
            );
            return self.backlog.add_answer(from, refuse("not-permitted", refusal));
        }
        if !is_halt && !is_fresh {
            note(NetworkRefusal::Stale);
            let refusal = format!(
                "it came too late: more than {:.1} s were between question and answer; on such a link only hold is taken",
                FRESH_NS as f64 * 1e-9
            );
            return self.backlog.add_answer(from, refuse("stale", refusal));
        }
        if !self.seats.contains_key(&from) {
            // There is always room for somebody who wants to halt.
            let limit = if is_halt { 2 * MAX_SEATS } else { MAX_SEATS };
            if self.seats.len() >= limit {
                note(NetworkRefusal::Busy);
                let refusal = format!("{limit} watchers of this laptop may command already: close some");
                return self.backlog.add_answer(from, refuse("busy", refusal));
            }
            match Connection::open(&worm.instance, &name) {
                Ok(connection) => {
                    let heard = Instant::now();
                    self.seats.insert(from.clone(), Seat { connection, heard });
                }
                Err(error) => {
                    let refusal = format!("{} does not run, or its relay takes no connection ({error})", worm.name);
                    return self.backlog.add_answer(from, refuse("no-answer", refusal));
                }
            }
        }
        if let Some(seat) = self.seats.get_mut(&from)
            && !seat.connection.send(line.id, line.request.clone())
        {
            let refusal = "the relay does not read: try again".to_owned();
            self.backlog.add_answer(from, refuse("busy", refusal));
        }
    }

    /// Reads the relays, and writes to them.
    pub(crate) fn exchange(&mut self) {
        for (index, feed) in self.feeds.iter_mut().enumerate() {
            let is_watched = self.watched[index].is_some_and(|watched| watched.elapsed() < Duration::from_millis(500));
            feed.set_attending(is_watched);
            for received in feed.poll() {
                match received {
                    Received::Line(line) => self.backlog.add_line(index, line),
                    Received::Lost(reason) => tracing::debug!("{}: {reason}", self.party.certificate),
                    Received::Log(line) => tracing::info!("{line}"),
                }
            }
        }
        let backlog = &mut self.backlog;
        self.seats.retain(|watcher, seat| {
            let (lines, is_over) = match seat.connection.exchange() {
                Ok(lines) => (lines, false),
                Err((lines, reason)) => {
                    tracing::debug!("{}: {reason}", watcher.worm);
                    (lines, true)
                }
            };
            for line in lines {
                if let Line::Answer(answer) = line {
                    backlog.add_answer(watcher.clone(), answer);
                }
            }
            !is_over && seat.heard.elapsed() < SEAT_IDLE
        });
    }

    /// What can be read when there is something to exchange.
    pub(crate) fn streams(&self) -> impl Iterator<Item = &UnixStream> {
        let feeds = self.feeds.iter().filter_map(RelayLink::stream);
        feeds.chain(self.seats.values().map(|seat| seat.connection.stream()))
    }
}

/// Both languages change together.
const _: () = assert!(RELAY_VERSION == 1 && super::wire::VERSION == 1);
