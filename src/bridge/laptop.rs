//! The process on the laptop, `wormd fleet`: for each robot a link and a thread, and for each of its worms an [`Offer`](super::offer::Offer).

use super::credentials::Credentials;
use super::network::{End, Network, Party, Way};
use super::offer::Asked;
use super::offers::Offers;
use super::pieces::{Assembled, Assembler};
use super::settings::{FleetSettings, Robot};
use super::wire::{Beat, ClockStep, Down, Echo, RemoteRequest, RemoteWatcher, UP_INTERVAL_NS, Up, VERSION};
use super::{link_log, reasons};
use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::relay::lateness::LastHold;
use crate::relay::wire::{self, Answer, Event, Request};
use crate::topics::PublishedList;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::collections::BTreeMap;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Topics;

/// How long a thread waits at most, ms.
const POLL_MS: u16 = 50;
/// How long a turn waits for more after the first thing has come.
const GATHER: Duration = Duration::from_millis(4);
/// How long the robot has to answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);
/// How long a hold is sent again and again.
const HOLD_TIMEOUT: Duration = Duration::from_secs(10);
/// How often.
const HOLD_RETRY: Duration = Duration::from_millis(300);
/// How often it is looked whether others have removed what is offered.
const OFFER_CHECK: Duration = Duration::from_secs(1);
/// After so many unconfirmed bytes they are confirmed at once.
const CONFIRM_BYTES: usize = 24 << 10;
/// After so long without a word of the robot that is worth a line in the log.
const SILENCE: Duration = Duration::from_secs(2);
/// After so long without a word of the robot it is said why.
const PATIENCE: Duration = Duration::from_secs(5);
/// After so long an attempt to connect that is in vain has failed.
const ATTEMPT: Duration = Duration::from_secs(15);
/// Most requests in one message.
const MAX_REQUESTS: usize = 16;

/// Serves until `end` is set. Calls `ready` once the robots are being tried.
///
/// # Errors
/// [`Failure::Unusable`] when Zenoh does not take the configuration, or nothing can be left in the folder of the worms;
/// [`Failure::Failed`] when there are no threads.
pub(crate) fn run(settings: &FleetSettings, end: &Arc<AtomicBool>, ready: impl FnOnce()) -> Result<(), Failure> {
    let mut threads = Vec::new();
    let robots = settings.robots.iter().map(|robot| robot.name.clone());
    let root = settings.root.as_deref().unwrap_or(Topics::AUTO);
    let list = PublishedList::publish(root, &settings.file, robots).map_err(|error| {
        Failure::unusable(format!(
            "root {root}: the list of robots cannot be written ({error}): give a folder on a tmpfs that this user may write"
        ))
    })?;
    let list = Arc::new(list);
    for robot in &settings.robots {
        let mut link = RobotLink::open(&settings.credentials, robot, settings.root.clone(), Arc::clone(&list))?;
        let end = Arc::clone(end);
        let thread = std::thread::Builder::new()
            .name(format!("robot-{}", robot.name))
            .spawn(move || {
                while !end.load(Ordering::Relaxed) {
                    link.turn()?;
                }
                Ok(())
            })
            .map_err(Failure::failed)?;
        threads.push(thread);
    }
    ready();
    let mut outcome = Ok(());
    for thread in threads {
        let ended = match thread.join() {
            Ok(ended) => ended,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        if outcome.is_ok() {
            outcome = ended;
        }
    }
    outcome
}

/// The link to one robot.
struct RobotLink {
    robot: String,
    /// Where its bridge listens.
    address: String,
    /// Since when nothing was heard of it.
    silent_since: Instant,
    /// Why, as that was said last.
    problem: Option<String>,
    party: Party,
    network: Network,
    assembler: Assembler,
    /// When the newest piece came.
    received: Option<Instant>,
    unconfirmed: usize,
    beat: Option<Beat>,
    /// Whether the last thing that was said is that the robot is silent.
    is_silent: bool,
    offers: Offers,
    /// When it was last looked whether they are all there.
    checked: Instant,
    /// The step of the robot's clock that was told last.
    told_step: Option<ClockStep>,
    asked: Vec<Pending>,
    /// The last hold of each worm.
    last_holds: BTreeMap<String, LastHold>,
    said: Option<Instant>,
}

/// A request that is not answered yet.
struct Pending {
    request: RemoteRequest,
    since: Instant,
    sent: Option<Instant>,
}

impl RobotLink {
    fn open(
        credentials: &Credentials,
        robot: &Robot,
        root: Option<String>,
        list: Arc<PublishedList>,
    ) -> Result<Self, Failure> {
        let session = format!("{:x}-{:x}", std::process::id(), monotonic_ns());
        let party = Party {
            certificate: credentials.name.clone(),
            session,
        };
        let own = [credentials.name.clone()];
        let end = End {
            credentials,
            others: std::slice::from_ref(&robot.name),
            laptops: &own,
            listen: &[],
            connect: std::slice::from_ref(&robot.connect),
            way: Way::Up,
            session: Some(&party.session),
        };
        let network = Network::open(&end).map_err(|why| Failure::unusable(format!("{}: {why}", robot.name)))?;
        Ok(Self {
            robot: robot.name.clone(),
            address: robot.connect.clone(),
            silent_since: Instant::now(),
            problem: None,
            network,
            party,
            assembler: Assembler::default(),
            received: None,
            unconfirmed: 0,
            beat: None,
            is_silent: true,
            offers: Offers::new(&robot.name, root, list),
            checked: Instant::now(),
            told_step: None,
            asked: Vec::new(),
            last_holds: BTreeMap::new(),
            said: None,
        })
    }

    fn turn(&mut self) -> Result<(), Failure> {
        self.wait()?;
        // What comes within this time is one turn.
        std::thread::sleep(GATHER);
        let messages: Vec<_> = self.network.messages().collect();
        for (_, piece) in messages {
            self.take_piece(&piece)?;
        }
        let silence = self.received.map_or(Duration::MAX, |received| received.elapsed());
        if !self.is_silent && silence >= SILENCE {
            self.is_silent = true;
            tracing::warn!("nothing was heard of {} for {:.0} s", self.robot, silence.as_secs_f64());
        }
        let mut is_urgent = false;
        for (worm, offer) in self.offers.iter_mut() {
            for Asked { watcher, name, line } in offer.read() {
                let worm = worm.to_owned();
                // Here the watchers' clock is known, and whose hold came after whose crawl.
                let now_ns = monotonic_ns();
                let last_hold = self.last_holds.entry(worm.clone()).or_default();
                if let Some(refusal) = last_hold.refusal(&line.request, line.sent_ns.unwrap_or(now_ns), now_ns) {
                    let stale = Answer::own(0, line.id, line.request.name(), "stale", Some(refusal));
                    offer.take_answer(watcher, stale);
                    continue;
                }
                let request = RemoteRequest {
                    from: RemoteWatcher { worm, watcher },
                    name,
                    line,
                };
                is_urgent = true;
                self.asked.push(Pending {
                    request,
                    since: Instant::now(),
                    sent: None,
                });
            }
        }
        self.give_up();
        if self.checked.elapsed() >= OFFER_CHECK {
            self.checked = Instant::now();
            if self.offers.offer_again() {
                self.begin_anew();
            }
            self.look_for_reasons();
            self.offers.list(self.received.is_some(), self.problem.clone());
        }
        let is_due = self
            .said
            .is_none_or(|said| said.elapsed() >= Duration::from_nanos(UP_INTERVAL_NS));
        if is_urgent || is_due || self.unconfirmed >= CONFIRM_BYTES {
            self.say();
        }
        self.offers.iter_mut().for_each(|(_, offer)| offer.write());
        Ok(())
    }

    /// Says why nothing is heard, once for each reason.
    fn look_for_reasons(&mut self) {
        let silence = self.silent_since.elapsed();
        if silence < PATIENCE {
            self.problem = None;
            return;
        }
        let (robot, address, own) = (&self.robot, &self.address, &self.party.certificate);
        let why = match link_log::of_attempt(address) {
            Some(said) => reasons::of_silence(robot, address, own, &said),
            None if silence >= ATTEMPT => reasons::of_silent_link(robot, address, own, self.received.is_some()),
            // The newest attempt has not failed yet.
            None => return,
        };
        if self.problem.as_ref() != Some(&why) {
            tracing::warn!("{} is not reached: {why}", self.robot);
            self.problem = Some(why);
        }
    }

    fn wait(&self) -> Result<(), Failure> {
        let mut waiting = vec![PollFd::new(self.network.woken().as_fd(), PollFlags::POLLIN)];
        for (_, offer) in self.offers.iter() {
            waiting.push(PollFd::new(offer.listener().as_fd(), PollFlags::POLLIN));
            waiting.extend(offer.streams().map(|(stream, wants_to_write)| {
                let wants = match wants_to_write {
                    true => PollFlags::POLLIN | PollFlags::POLLOUT,
                    false => PollFlags::POLLIN,
                };
                PollFd::new(stream.as_fd(), wants)
            }));
        }
        match poll(&mut waiting, PollTimeout::from(POLL_MS)) {
            Ok(_) | Err(nix::errno::Errno::EINTR) => Ok(()),
            Err(errno) => Err(Failure::failed(format!("{} cannot be waited for: {errno}", self.robot))),
        }
    }

    fn take_piece(&mut self, piece: &[u8]) -> Result<(), Failure> {
        self.unconfirmed += piece.len();
        let assembled = match self.assembler.take(piece) {
            Ok(assembled) => assembled,
            Err(why) => {
                tracing::warn!("{}: {why}", self.robot);
                return Ok(());
            }
        };
        if assembled == Assembled::Useless {
            return Ok(());
        }
        let now = Instant::now();
        self.received = Some(now);
        self.silent_since = now;
        let Assembled::Message(message) = assembled else {
            return Ok(());
        };
        match serde_json::from_slice(&message) {
            Ok(down) => self.take(down),
            Err(error) => {
                tracing::warn!(
                    "{} sent what cannot be read ({error}): use the same wormd on both ends",
                    self.robot
                );
                Ok(())
            }
        }
    }

    fn take(&mut self, down: Down) -> Result<(), Failure> {
        match down {
            Down::Beat(beat) => {
                self.take_beat(beat);
                Ok(())
            }
            Down::Line { worm, line } => {
                let Some(network) = self.network_status() else {
                    return Ok(());
                };
                self.offers.take_line(&worm, line, &network)
            }
            Down::Answer { to, answer } => {
                let is_it = |pending: &Pending| pending.request.from == to && pending.request.line.id == answer.id;
                if answer.id.is_some() || answer.command != "hello" {
                    self.asked.retain(|pending| !is_it(pending));
                }
                if let Some(offer) = self.offers.get_mut(&to.worm) {
                    offer.take_answer(to.watcher, answer);
                }
                Ok(())
            }
        }
    }

    fn take_beat(&mut self, beat: Beat) {
        if beat.version > VERSION {
            tracing::warn!(
                "{} speaks version {}: use the same wormd on both ends",
                self.robot,
                beat.version
            );
        }
        if self.is_silent {
            self.is_silent = false;
            let may = if beat.may_drive { "drive" } else { "watch and hold" };
            tracing::warn!(
                "{} is there; this computer may {may}: {}",
                self.robot,
                beat.worms.join(", ")
            );
        }
        let step = beat.clock.last_step.filter(|step| self.told_step != Some(*step));
        if let Some(step) = step {
            self.told_step = Some(step);
            let text = format!(
                "wall time of {} was set by {:+.3} s",
                self.robot,
                step.step_ns as f64 * 1e-9
            );
            self.offers.note(&Event {
                time_ns: step.time_ns,
                text,
            });
        }
        if self.offers.take_worms(&beat.worms, beat.bridge.as_deref()) {
            self.begin_anew();
        }
        self.beat = Some(beat);
    }

    /// A worm is offered whose history may have passed before it could be taken.
    fn begin_anew(&mut self) {
        if self.beat.is_some() {
            self.assembler = Assembler::default();
        }
    }

    fn network_status(&self) -> Option<wire::Network> {
        let beat = self.beat.as_ref()?;
        Some(wire::Network {
            robot: self.robot.clone(),
            may_drive: beat.may_drive,
            frames_lost: 0,
            round_trip_ms: beat.round_trip_ms,
            boot_id: beat.clock.boot_id.clone(),
            synchronised: beat.clock.synchronised,
            wall_offset_ns: beat.clock.wall_offset_ns,
        })
    }

    /// Sends what is received, who is there, and what is asked.
    fn say(&mut self) {
        self.said = Some(Instant::now());
        self.unconfirmed = 0;
        let echo = self
            .assembler
            .newest()
            .zip(self.received)
            .map(|((stream, sequence), received)| Echo {
                stream,
                sequence,
                held_ms: received.elapsed().as_millis().try_into().unwrap_or(u64::MAX),
            });
        let mut watchers = Vec::new();
        for (worm, offer) in self.offers.iter() {
            watchers.extend(offer.present().map(|watcher| RemoteWatcher {
                worm: worm.to_owned(),
                watcher,
            }));
        }
        let mut requests = Vec::new();
        for pending in &mut self.asked {
            let is_hold = pending.request.line.request == Request::Hold;
            let is_due = pending.sent.is_none_or(|sent| is_hold && sent.elapsed() >= HOLD_RETRY);
            if is_due && requests.len() < MAX_REQUESTS {
                pending.sent = Some(Instant::now());
                requests.push(pending.request.clone());
            }
        }
        let up = Up {
            version: VERSION,
            echo,
            is_lost: self.assembler.is_lost(),
            watchers,
            requests,
        };
        match serde_json::to_vec(&up) {
            Ok(bytes) => self.network.send(&self.party, bytes),
            Err(error) => tracing::error!("a message cannot be written: {error}"),
        }
    }

    /// Answers for a robot that does not.
    fn give_up(&mut self) {
        let is_over = |pending: &Pending| {
            let is_hold = pending.request.line.request == Request::Hold;
            pending.since.elapsed() >= if is_hold { HOLD_TIMEOUT } else { ANSWER_TIMEOUT }
        };
        for pending in self.asked.extract_if(.., |pending| is_over(pending)) {
            let RemoteRequest { from, line, .. } = pending.request;
            let refusal = format!(
                "{} did not answer within {:.0} s: the link is down or slow, and whether it was done is not known",
                self.robot,
                pending.since.elapsed().as_secs_f64()
            );
            if let Some(offer) = self.offers.get_mut(&from.worm) {
                let answer = Answer::own(0, line.id, line.request.name(), "no-answer", Some(refusal));
                offer.take_answer(from.watcher, answer);
            }
        }
    }
}
