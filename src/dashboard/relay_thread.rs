//! The thread between the relay and the pages: takes the relay's lines into the [`Feed`], and passes the pages' commands on.
//!
//! What anyone may do goes over the connection by which the worm is watched, under the name of who asks. What only the driver may do goes
//! over a connection of that page alone ([`Seat`]).

use super::caller::{Asked, Caller};
use super::feed::Feed;
use super::seat::{Reply, Seat};
use super::unreached;
use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::relay::client::{Received, RelayLink};
use crate::relay::direct_hold::HoldWatch;
use crate::relay::lateness;
use crate::relay::wire::{Answer, Line, Request, VERSION};
use crate::topics::Instance;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::{oneshot, watch};

/// How long the thread waits at most: the connection is tried again that often.
const POLL_MS: u16 = 100;
/// Most pages that may want to drive at a time.
const MAX_SEATS: usize = 16;
/// A thread that comes to nothing for so long stood still, ns; and how long after that what says nothing of its age counts as old.
const STOOD_STILL_NS: u64 = 1_000_000_000;
/// How long a hold waits for a relay that is just starting.
const HOLD_PATIENCE: Duration = Duration::from_secs(3);

/// What pages want.
enum Order {
    /// What only the driver may do.
    Drive(Caller, Request, Reply),
    /// What anyone may do.
    Anyone(Caller, Request, Reply),
    /// This page is there. True when it has a seat.
    Alive(Caller, oneshot::Sender<bool>),
    End,
}

/// What the worm is known by, shared with the pages.
#[derive(Clone)]
pub(super) struct Shared {
    feed: Arc<Mutex<Feed>>,
    /// Changes when there is something new.
    changed: watch::Sender<()>,
}

impl Shared {
    /// Around a feed.
    pub(super) fn new(feed: Feed) -> Self {
        Self {
            feed: Arc::new(Mutex::new(feed)),
            changed: watch::Sender::new(()),
        }
    }

    /// The feed, for a moment.
    pub(super) fn feed(&self) -> MutexGuard<'_, Feed> {
        // Whoever panicked left it as consistent as a frame is.
        self.feed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Is told when there is something new.
    pub(super) fn subscribe(&self) -> watch::Receiver<()> {
        self.changed.subscribe()
    }
}

/// The way to the thread. Dropping it ends the thread, and with it the crawls of its pages.
pub(super) struct RelayThread {
    orders: Sender<Order>,
    wake: UnixStream,
    thread: Option<JoinHandle<()>>,
}

impl RelayThread {
    /// Starts the thread.
    ///
    /// # Errors
    /// [`Failure::Failed`] when there is no thread to be had.
    pub(super) fn start(instance: &Instance, link: RelayLink, shared: Shared) -> Result<Self, Failure> {
        let (orders, queue) = channel();
        let (woken, wake) = UnixStream::pair().map_err(Failure::failed)?;
        for end in [&woken, &wake] {
            end.set_nonblocking(true).map_err(Failure::failed)?;
        }
        let mut exchange = Exchange {
            instance: instance.clone(),
            link,
            shared,
            orders: queue,
            woken,
            seats: BTreeMap::new(),
            pending: BTreeMap::new(),
            holds: HoldWatch::new(instance),
            waiting: Vec::new(),
            last_id: 0,
            turned_ns: monotonic_ns(),
            stood_still_ns: None,
        };
        let thread = std::thread::Builder::new()
            .name("relay".to_owned())
            .spawn(move || while exchange.turn() {})
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        Ok(Self {
            orders,
            wake,
            thread: Some(thread),
        })
    }

    /// Asks for what only the driver may do.
    pub(super) async fn drive(&self, caller: Caller, request: Request) -> Result<Answer, String> {
        self.ask(|reply| Order::Drive(caller, request, reply)).await
    }

    /// Asks for what anyone may do.
    pub(super) async fn anyone(&self, caller: Caller, request: Request) -> Result<Answer, String> {
        self.ask(|reply| Order::Anyone(caller, request, reply)).await
    }

    /// Says that a page is there; false where it does not drive.
    pub(super) async fn alive(&self, caller: Caller) -> bool {
        let (reply, answer) = oneshot::channel();
        self.order(Order::Alive(caller, reply));
        answer.await.unwrap_or(false)
    }

    async fn ask(&self, order: impl FnOnce(Reply) -> Order) -> Result<Answer, String> {
        let (reply, answer) = oneshot::channel();
        self.order(order(reply));
        let ended = |_| Err("the dashboard is ending".to_owned());
        answer.await.unwrap_or_else(ended)
    }

    fn order(&self, order: Order) {
        // Where the thread has ended, so has what waits for the reply.
        let _ = self.orders.send(order);
        // One that is full wakes as well.
        let _ = (&self.wake).write(&[0]);
    }
}

impl Drop for RelayThread {
    fn drop(&mut self) {
        self.order(Order::End);
        if let Some(thread) = self.thread.take() {
            // It has nothing to say about how it ended.
            let _ = thread.join();
        }
    }
}

/// What the thread has.
struct Exchange {
    instance: Instance,
    link: RelayLink,
    shared: Shared,
    orders: Receiver<Order>,
    woken: UnixStream,
    seats: BTreeMap<String, Seat>,
    /// Requests over the link that are not answered yet.
    pending: BTreeMap<u64, Reply>,
    /// Those of them that are holds.
    holds: HoldWatch,
    /// Holds that wait for a connection, since when.
    waiting: Vec<(Instant, Caller, Reply)>,
    last_id: u64,
    /// When the last turn was over, and until when the thread stood still, ns.
    turned_ns: u64,
    stood_still_ns: Option<u64>,
}

impl Exchange {
    /// One turn: waits, reads, passes on. False at the end.
    fn turn(&mut self) -> bool {
        self.wait();
        let now_ns = monotonic_ns();
        if now_ns.saturating_sub(self.turned_ns) >= STOOD_STILL_NS {
            self.stood_still_ns = Some(now_ns);
        }
        self.take_lines();
        let orders: Vec<_> = self.orders.try_iter().collect();
        for order in orders {
            match order {
                Order::Drive(caller, request, reply) => {
                    if let Some(reply) = self.still_wanted(caller.asked, &request, reply) {
                        self.drive(&caller, request, reply);
                    }
                }
                Order::Anyone(caller, Request::Hold, reply) => self.anyone(caller, Request::Hold, reply),
                Order::Anyone(caller, request, reply) => {
                    if let Some(reply) = self.still_wanted(caller.asked, &request, reply) {
                        self.anyone(caller, request, reply);
                    }
                }
                Order::Alive(caller, reply) => {
                    let seat = self.seats.get_mut(&caller.key);
                    let _ = reply.send(seat.map(|seat| seat.alive(caller.asked.at_ns())).is_some());
                }
                Order::End => return false,
            }
        }
        self.send_waiting();
        for answer in self.holds.poll() {
            self.reply(answer);
        }
        self.seats.retain(|_, seat| seat.exchange());
        self.pending.retain(|_, reply| !reply.is_closed());
        self.turned_ns = monotonic_ns();
        true
    }

    /// Gives the reply back to what is still to be done: somebody waits for it, and did not ask long ago.
    fn still_wanted(&self, asked: Asked, request: &Request, reply: Reply) -> Option<Reply> {
        if reply.is_closed() {
            tracing::info!("a request is dropped: whoever asked has gone");
            return None;
        }
        let now_ns = monotonic_ns();
        let refusal = lateness::refusal(request, asked.at_ns(), now_ns).or_else(|| {
            let stood_still_ns = self.stood_still_ns?;
            // Read just after the whole process stood still, it may have lain in the kernel all the time.
            let is_doubtful = !lateness::is_always_taken(request)
                && matches!(asked, Asked::Before(ns) if ns.saturating_sub(stood_still_ns) < STOOD_STILL_NS);
            is_doubtful
                .then(|| "the dashboard stood still, and when this was asked for is not known: ask again".to_owned())
        });
        let Some(refusal) = refusal else { return Some(reply) };
        // Who asked may have gone.
        let _ = reply.send(Ok(Answer::own(0, None, request.name(), "stale", Some(refusal))));
        None
    }

    fn reply(&mut self, answer: Answer) {
        if let Some(reply) = answer.id.and_then(|id| self.pending.remove(&id)) {
            // Who asked may have gone.
            let _ = reply.send(Ok(answer));
        }
    }

    fn wait(&mut self) {
        let streams = std::iter::once(&self.woken)
            .chain(self.link.stream())
            .chain(self.seats.values().map(Seat::stream));
        let mut waiting: Vec<_> = streams
            .map(|stream| PollFd::new(stream.as_fd(), PollFlags::POLLIN))
            .collect();
        if let Err(errno) = poll(&mut waiting, PollTimeout::from(POLL_MS)) {
            tracing::debug!("the relay cannot be waited for: {errno}");
        }
        // Nothing to read is no error.
        let _ = self.woken.read(&mut [0; 256]);
    }

    fn take_lines(&mut self) {
        let received = self.link.poll();
        let problem = self.link.problem().map(|problem| self.explained(problem));
        let now_ns = monotonic_ns();
        let mut feed = self.shared.feed();
        let mut is_new = false;
        let mut answers = Vec::new();
        for received in received {
            match received {
                Received::Line(Line::Hello(hello)) => {
                    feed.take_hello(*hello);
                    is_new = true;
                }
                Received::Line(Line::Frame(frame)) => {
                    feed.take_frame(*frame, now_ns);
                    is_new = true;
                }
                Received::Line(Line::Answer(answer)) => {
                    if let Some(id) = answer.id {
                        self.holds.answered(id);
                    }
                    answers.push(answer);
                }
                Received::Line(Line::Lost { frames }) => tracing::debug!("{frames} frames of the relay were lost"),
                Received::Line(Line::Refused { reason }) | Received::Lost(reason) => {
                    tracing::info!("{reason}");
                    for reply in std::mem::take(&mut self.pending).into_values() {
                        let _ = reply.send(Err(reason.clone()));
                    }
                    is_new |= feed.lose(&reason, now_ns);
                }
                Received::Log(line) => tracing::info!("{line}"),
            }
        }
        if let Some(problem) = problem {
            is_new |= feed.lose(&problem, now_ns);
        }
        is_new |= feed.is_silent(now_ns);
        drop(feed);
        answers.into_iter().for_each(|answer| self.reply(answer));
        if is_new {
            self.shared.changed.send_replace(());
        }
    }

    fn drive(&mut self, caller: &Caller, request: Request, reply: Reply) {
        let refuse = |reply: Reply, why: String| drop(reply.send(Err(why)));
        if !self.seats.contains_key(&caller.key) {
            if self.link.stream().is_none() {
                return refuse(reply, self.problem());
            }
            if self.seats.len() >= MAX_SEATS {
                return refuse(reply, format!("{MAX_SEATS} pages want to drive already: close some"));
            }
            match Seat::open(&self.instance, &caller.name) {
                Ok(seat) => drop(self.seats.insert(caller.key.clone(), seat)),
                Err(error) => return refuse(reply, format!("the relay takes no connection ({error})")),
            }
        }
        self.last_id += 1;
        if let Some(seat) = self.seats.get_mut(&caller.key) {
            seat.ask(self.last_id, caller, request, reply);
        }
    }

    fn anyone(&mut self, caller: Caller, request: Request, reply: Reply) {
        if self.link.stream().is_none() {
            match request {
                Request::Hold => self.waiting.push((Instant::now(), caller, reply)),
                _ => drop(reply.send(Err(self.problem()))),
            }
            return;
        }
        self.last_id += 1;
        let hello = Request::Hello {
            version: VERSION,
            name: caller.name.clone(),
        };
        let is_hold = request == Request::Hold;
        if is_hold {
            self.holds.asked(self.last_id, &caller.name);
        }
        // The name first: the relay records the request under it.
        let is_sent = self.link.send(0, hello) && self.link.send_asked(self.last_id, request, caller.asked.at_ns());
        // A hold that the relay does not take goes past it.
        match is_sent || is_hold {
            true => drop(self.pending.insert(self.last_id, reply)),
            false => drop(reply.send(Err("the relay does not read: try again".to_owned()))),
        }
        // At once, and not at the next turn.
        self.take_lines();
    }

    /// Sends the holds that waited for a connection, and gives up those that have waited for too long.
    fn send_waiting(&mut self) {
        let is_connected = self.link.stream().is_some();
        for (since, caller, reply) in std::mem::take(&mut self.waiting) {
            if is_connected {
                self.anyone(caller, Request::Hold, reply);
            } else if since.elapsed() > HOLD_PATIENCE {
                let _ = reply.send(Err(self.problem()));
            } else {
                self.waiting.push((since, caller, reply));
            }
        }
    }

    fn problem(&self) -> String {
        self.explained(self.link.problem().unwrap_or("there is no connection to the relay"))
    }

    /// Of a worm that was offered here from elsewhere only the lists of the fleet processes say why it is not reached: it may be crawling.
    fn explained(&self, problem: &str) -> String {
        let unreached = unreached::find(self.instance.root(), |_, _| false);
        let own = unreached.into_iter().find(|it| it.name == self.instance.worm());
        own.map_or_else(|| problem.to_owned(), |own| own.problem)
    }
}
