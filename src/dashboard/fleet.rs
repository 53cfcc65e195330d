//! All worms of this computer, and those that a fleet process offers here: how they stand, and one hold for all.
//!
//! A thread watches them, while somebody looks: it finds each worm's folder below the root of the dashboard's own worm, and connects to
//! its relay. A worm without a relay is asked at its stop socket: no relay is started for it here, because that would need its
//! configuration. Without anybody who looks there is no connection.

use super::caller::Caller;
use super::fleet_view::{Held, WormView};
use super::unreached::{self, Unreached};
use crate::attendance::{Request as StopRequest, ask};
use crate::failure::Failure;
use crate::relay::connection::Connection;
use crate::relay::direct_hold;
use crate::relay::wire::{Answer, Frame, Line, Request, VERSION};
use crate::topics::{Controller, Instance, Relay, RoleLock};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::oneshot;
use worm_estimator::config::Config;
use worm_estimator::message::{Fault, Mode};

/// How often the thread reads.
const TURN: Duration = Duration::from_millis(50);
/// How often it looks for other worms.
const SCAN: Duration = Duration::from_secs(1);
/// How long after somebody has looked it goes on.
const LINGER: Duration = Duration::from_secs(5);
/// How long the relays have to answer a hold.
const HOLD_TIMEOUT: Duration = Duration::from_secs(3);
/// Most worms.
const MAX_WORMS: usize = 256;

enum Order {
    Look(oneshot::Sender<Vec<WormView>>),
    Hold(Caller, oneshot::Sender<Vec<Held>>),
    End,
}

/// The way to the thread.
pub(super) struct FleetThread {
    orders: Sender<Order>,
    thread: Option<JoinHandle<()>>,
}

impl FleetThread {
    /// Starts the thread, for the worms beside `instance`.
    ///
    /// # Errors
    /// [`Failure::Failed`] when there is no thread to be had.
    pub(super) fn start(instance: &Instance, topics_root: &str) -> Result<Self, Failure> {
        let (orders, queue) = channel();
        let mut fleet = Fleet {
            root: instance.root().to_path_buf(),
            topics_root: topics_root.to_owned(),
            worms: BTreeMap::new(),
            unreached: Vec::new(),
            looked: None,
            scanned: None,
            holds: Vec::new(),
            last_id: 0,
        };
        let thread = std::thread::Builder::new()
            .name("fleet".to_owned())
            .spawn(move || while fleet.turn(&queue) {})
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        Ok(Self {
            orders,
            thread: Some(thread),
        })
    }

    /// How all worms stand.
    pub(super) async fn look(&self) -> Vec<WormView> {
        let (reply, answer) = oneshot::channel();
        // Where the thread has ended, so has what waits for the reply.
        let _ = self.orders.send(Order::Look(reply));
        answer.await.unwrap_or_default()
    }

    /// Makes all worms hold.
    pub(super) async fn hold(&self, caller: Caller) -> Vec<Held> {
        let (reply, answer) = oneshot::channel();
        let _ = self.orders.send(Order::Hold(caller, reply));
        answer.await.unwrap_or_default()
    }
}

impl Drop for FleetThread {
    fn drop(&mut self) {
        let _ = self.orders.send(Order::End);
        if let Some(thread) = self.thread.take() {
            // It has nothing to say about how it ended.
            let _ = thread.join();
        }
    }
}

/// What the thread has.
struct Fleet {
    root: PathBuf,
    /// The same as it is configured, by which controllers are found.
    topics_root: String,
    worms: BTreeMap<String, Watched>,
    /// Worms of robots elsewhere that are not among them.
    unreached: Vec<Unreached>,
    looked: Option<Instant>,
    scanned: Option<Instant>,
    holds: Vec<PendingHold>,
    last_id: u64,
}

/// A worm that was found.
struct Watched {
    instance: Instance,
    connection: Option<Connection>,
    frame: Option<(Box<Frame>, Instant)>,
    /// What its controller said, where there is no relay.
    asked: Option<(Mode, Fault, Instant)>,
    /// The answer that is waited for: one that hangs must not hold up the others.
    asking: Option<Receiver<Option<(Mode, Fault)>>>,
    problem: Option<String>,
}

struct PendingHold {
    since: Instant,
    /// The number of the request to each worm.
    waiting: BTreeMap<String, u64>,
    held: Vec<Held>,
    /// Who asks, by name.
    sender: String,
    /// Worms that were told past their relay, or that have none.
    past_relay: BTreeSet<String>,
    tell: Sender<Held>,
    /// What became of those.
    direct: Receiver<Held>,
    reply: oneshot::Sender<Vec<Held>>,
}

impl Fleet {
    /// One turn. False at the end.
    fn turn(&mut self, orders: &Receiver<Order>) -> bool {
        let is_busy = self.looked.is_some() || !self.holds.is_empty();
        // Without anybody who looks there is nothing to do before the next order.
        let order = match is_busy {
            true => orders.recv_timeout(TURN),
            false => orders.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        match order {
            Ok(Order::Look(reply)) => {
                self.looked = Some(Instant::now());
                self.scan();
                self.read();
                // Who asked may have gone.
                let _ = reply.send(self.view());
            }
            Ok(Order::Hold(caller, reply)) => {
                self.scanned = None;
                self.scan();
                self.hold(&caller, reply);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Ok(Order::End) | Err(RecvTimeoutError::Disconnected) => return false,
        }
        self.read();
        self.end_holds();
        if self.holds.is_empty() && self.looked.is_some_and(|looked| looked.elapsed() >= LINGER) {
            self.looked = None;
        }
        if self.looked.is_none() && self.holds.is_empty() {
            self.worms.clear();
            self.unreached.clear();
            self.scanned = None;
        }
        true
    }

    /// Finds the worms, and connects where there is no connection.
    fn scan(&mut self) {
        if self.scanned.is_some_and(|scanned| scanned.elapsed() < SCAN) {
            return;
        }
        self.scanned = Some(Instant::now());
        let folders = std::fs::read_dir(&self.root).into_iter().flatten().flatten();
        let names = folders.filter_map(|folder| folder.file_name().into_string().ok());
        let mut found = BTreeMap::new();
        for name in names.take(MAX_WORMS) {
            let known = self.worms.remove(&name);
            let Some(watched) = known.or_else(|| Watched::new(&self.root, &name)) else {
                continue;
            };
            found.insert(name, watched);
        }
        for (name, watched) in &mut found {
            if watched.connection.is_none() {
                watched.connect(name, &self.topics_root);
            }
        }
        // A folder of which nothing was ever heard, and that no controller uses, is no worm.
        found.retain(|_, watched| {
            watched.connection.is_some()
                || watched.frame.is_some()
                || RoleLock::<Controller>::holder(&watched.instance).is_some()
        });
        self.worms = found;
        let is_reached = |worm: &str, pid| {
            let watched = self.worms.get(worm).filter(|watched| watched.connection.is_some());
            watched.is_some_and(|watched| RoleLock::<Relay>::holder(&watched.instance) == Some(pid))
        };
        self.unreached = unreached::find(&self.root, is_reached);
        // Of what a killed fleet process has left, there is not to be a second entry with older values.
        let unreached = &self.unreached;
        self.worms.retain(|name, watched| {
            let robot = watched.robot();
            let is_listed = |it: &Unreached| it.name == *name && Some(it.robot.as_str()) == robot;
            watched.connection.is_some() || !unreached.iter().any(is_listed)
        });
    }

    fn read(&mut self) {
        for (name, watched) in &mut self.worms {
            let Some(connection) = &mut watched.connection else {
                continue;
            };
            let (lines, problem) = match connection.exchange() {
                Ok(lines) => (lines, None),
                Err((lines, problem)) => (lines, Some(problem)),
            };
            for line in lines {
                match line {
                    Line::Frame(frame) => watched.frame = Some((frame, Instant::now())),
                    Line::Answer(answer) => {
                        for hold in &mut self.holds {
                            hold.take(name, &answer);
                        }
                    }
                    Line::Hello(_) | Line::Lost { .. } | Line::Refused { .. } => {}
                }
            }
            if problem.is_some() {
                watched.problem = problem;
                watched.connection = None;
            }
        }
    }

    fn hold(&mut self, caller: &Caller, reply: oneshot::Sender<Vec<Held>>) {
        let (tell, direct) = channel();
        let mut hold = PendingHold {
            sender: caller.name.clone(),
            past_relay: BTreeSet::new(),
            tell,
            since: Instant::now(),
            waiting: BTreeMap::new(),
            held: self.unreached.iter().map(Held::not_reached).collect(),
            direct,
            reply,
        };
        for (name, watched) in &mut self.worms {
            self.last_id += 1;
            let hello = Request::Hello {
                version: VERSION,
                name: caller.name.clone(),
            };
            let is_sent = watched.connection.as_mut().is_some_and(|connection| {
                let asked_ns = caller.asked.at_ns();
                connection.send(None, hello) && connection.send_asked(Some(self.last_id), Request::Hold, asked_ns)
            });
            hold.waiting.insert(name.clone(), self.last_id);
            if !is_sent {
                hold.past_relay.insert(name.clone());
                order_directly(name, &watched.instance, &caller.name, &hold.tell);
            }
        }
        self.holds.push(hold);
    }

    /// Replies to those whose holds are all answered, or for too long are not.
    fn end_holds(&mut self) {
        for mut hold in std::mem::take(&mut self.holds) {
            for held in hold.direct.try_iter() {
                // A relay may have answered after all.
                if hold.waiting.remove(&held.name).is_some() {
                    hold.held.push(held);
                }
            }
            if hold.since.elapsed() >= direct_hold::PATIENCE {
                let silent = hold.waiting.keys().filter_map(|name| self.worms.get_key_value(name));
                for (name, watched) in silent.filter(|(_, watched)| direct_hold::is_possible(&watched.instance)) {
                    if hold.past_relay.insert(name.clone()) {
                        order_directly(name, &watched.instance, &hold.sender, &hold.tell);
                    }
                }
            }
            if !hold.waiting.is_empty() && hold.since.elapsed() < HOLD_TIMEOUT && !hold.reply.is_closed() {
                self.holds.push(hold);
                continue;
            }
            for name in hold.waiting.into_keys() {
                let refusal = format!("{name} did not answer within {HOLD_TIMEOUT:?}");
                hold.held.push(Held::new(&name, "no-answer", Some(refusal)));
            }
            hold.held
                .sort_by(|one, other| (&one.name, &one.robot).cmp(&(&other.name, &other.robot)));
            // Who asked may have gone.
            let _ = hold.reply.send(hold.held);
        }
    }

    fn view(&self) -> Vec<WormView> {
        let reached = self.worms.iter().map(|(name, watched)| watched.view(name));
        reached
            .chain(self.unreached.iter().map(WormView::not_reached))
            .collect()
    }
}

impl PendingHold {
    fn take(&mut self, name: &str, answer: &Answer) {
        if answer.id.is_some() && self.waiting.get(name).copied() == answer.id {
            self.waiting.remove(name);
            self.held.push(Held::new(name, &answer.verdict, answer.refusal.clone()));
        }
    }
}

impl Watched {
    /// The worm of a folder; none where that cannot be one of this user's.
    fn new(root: &Path, name: &str) -> Option<Self> {
        let mut config = Config::default();
        config.worm.name = name.to_owned();
        // Names of other files are none of worms.
        if !config.problems().is_empty() || !root.join(name).join("").is_dir() {
            return None;
        }
        let instance = Instance::new(root, name).ok()?;
        instance.remove_folder_if_empty();
        Some(Self {
            instance,
            connection: None,
            frame: None,
            asked: None,
            asking: None,
            problem: None,
        })
    }

    /// Connects to the relay; asks the controller where there is none.
    fn connect(&mut self, name: &str, topics_root: &str) {
        if let Ok(connection) = Connection::open(&self.instance, "fleet page") {
            self.connection = Some(connection);
            self.asking = None;
            self.problem = None;
            return;
        }
        self.problem = Some("nobody serves its watchers: `wormd watch` shows more".to_owned());
        match self.asking.as_ref().map(Receiver::try_recv) {
            Some(Err(TryRecvError::Empty)) => return,
            Some(Ok(Some((mode, fault)))) => {
                self.asked = Some((mode, fault, Instant::now()));
                self.frame = None;
            }
            Some(Ok(None) | Err(TryRecvError::Disconnected)) | None => {}
        }
        let mut config = Config::default();
        name.clone_into(&mut config.worm.name);
        topics_root.clone_into(&mut config.topics.root);
        let (sender, asking) = channel();
        self.asking = Some(asking);
        let question = move || {
            let answer = ask(&config, &StopRequest::Status.into()).ok();
            let said = answer.and_then(|it| Mode::try_from(it.mode).ok().zip(Fault::try_from(it.fault).ok()));
            // Who asked may have gone.
            let _ = sender.send(said);
        };
        if let Err(error) = std::thread::Builder::new().name("fleet-ask".to_owned()).spawn(question) {
            tracing::debug!("{name} cannot be asked: {error}");
        }
    }

    /// The robot, where it is a worm of another computer.
    fn robot(&self) -> Option<&str> {
        let (frame, _) = self.frame.as_ref()?;
        frame.network.as_ref().map(|network| network.robot.as_str())
    }

    fn view(&self, name: &str) -> WormView {
        let mut view = WormView::unknown(name, self.robot(), self.problem.as_deref());
        if let Some((frame, came)) = &self.frame {
            view.take_frame(frame, *came);
        } else if let Some((mode, fault, asked)) = self.asked {
            view.take_answer(mode, fault, asked);
        }
        view
    }
}

/// Makes a worm hold that no relay serves.
fn hold_directly(name: &str, instance: &Instance, sender: &str) -> Held {
    let answer = direct_hold::hold(instance, sender);
    let verdict = match answer.verdict.as_str() {
        verdict @ ("accepted" | "no-answer") => verdict,
        _ => "refused",
    };
    Held::new(name, verdict, answer.refusal)
}

/// The same from a thread: one that hangs must not hold up the others.
fn order_directly(name: &str, instance: &Instance, sender: &str, held: &Sender<Held>) {
    let (name, instance, sender, held) = (name.to_owned(), instance.clone(), sender.to_owned(), held.clone());
    let order = move || drop(held.send(hold_directly(&name, &instance, &sender)));
    if let Err(error) = std::thread::Builder::new().name("fleet-hold".to_owned()).spawn(order) {
        tracing::error!("a worm cannot be told to hold: {error}");
    }
}
