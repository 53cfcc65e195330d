//! A worm of a robot as the laptop offers it: a socket where its relay would be, for `wormd watch`, `wormd dashboard` and programs.
//!
//! It speaks the relay's language, and passes on what the robot's relay says. Requests go to the robot; here nothing is decided. Who comes
//! late gets the history from what has passed.

use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::relay::lateness;
use crate::relay::message_json::Json;
use crate::relay::outbox::SharedLine;
use crate::relay::socket::Listener;
use crate::relay::source::Seen;
use crate::relay::watcher::{Gone, Watcher, shared};
use crate::relay::wire::{Answer, Event, Frame, Hello, Line, Network, Request, RequestLine, VERSION};
use crate::topics::fleet_list;
use crate::topics::{AlreadyRunning, Controller, Instance, Relay, RoleError, RoleLock};
use crate::watch::picture::Picture;
use std::collections::BTreeMap;
use std::io;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a watcher may take nothing; as at the relay.
const STALL_LIMIT: Duration = Duration::from_secs(30);
/// A watcher that was not heard for so long is not counted as there. They say so every 0.2 s; the relay's own patience comes on top, so that
/// there is to be little of it here.
const SILENCE: Duration = Duration::from_millis(300);

/// A worm that is offered here.
pub(crate) struct Offer {
    instance: Instance,
    listener: Listener,
    watchers: BTreeMap<u64, LocalWatcher>,
    next_id: u64,
    /// What is known of the worm; none before its relay has been heard.
    known: Option<Known>,
    // Last, so that the socket has gone before the role is free.
    role: RoleLock<Relay>,
}

struct Known {
    robot: String,
    picture: Picture,
    config: Option<String>,
    version: u32,
    wormd: String,
    pid: u32,
    boot_id: String,
    /// Number of the newest frame, for the gaps.
    number: Option<u64>,
    frames_lost: u64,
}

struct LocalWatcher {
    inner: Watcher,
    name: Option<String>,
    /// When it last said that it is there.
    heard: Option<Instant>,
    /// Whether it has the history.
    is_greeted: bool,
}

/// What a watcher asks of the robot.
pub(crate) struct Asked {
    pub(crate) watcher: u64,
    pub(crate) name: Option<String>,
    pub(crate) line: RequestLine,
}

impl Offer {
    /// Offers the worm of `robot`.
    ///
    /// # Errors
    /// When a worm of this name runs here, is offered already, or the socket cannot be made.
    pub(crate) fn open(instance: Instance, robot: &str) -> Result<Self, Failure> {
        if let Some(why) = clash(&instance) {
            return Err(Failure::unusable(why));
        }
        let role = RoleLock::<Relay>::take(&instance).map_err(|error| match error {
            RoleError::AlreadyRunning(other) => Failure::unusable(who_has_it(&instance, robot, &other)),
            error => Failure::unusable(error),
        })?;
        let listener = Listener::bind(&instance)
            .map_err(|error| Failure::unusable(format!("{}: {error}", instance.relay_socket().display())))?;
        Ok(Self {
            instance,
            listener,
            watchers: BTreeMap::new(),
            next_id: 1,
            known: None,
            role,
        })
    }

    /// The worm of this computer that is in the way, if there is one.
    pub(crate) fn clash(&self) -> Option<String> {
        clash(&self.instance)
    }

    /// Whether watchers still find it: another process may have removed the socket, or the whole folder.
    pub(crate) fn is_in_place(&self) -> bool {
        self.listener.is_in_place() && self.role.place().is_ok_and(|place| place.is_kept())
    }

    /// Takes a line of the robot's relay, and passes it on.
    pub(crate) fn take_line(&mut self, line: Line, network: &Network, event: Option<Event>) -> Result<(), Failure> {
        match line {
            Line::Hello(hello) => {
                self.take_hello(*hello, &network.robot);
                for watcher in self.watchers.values_mut() {
                    watcher.is_greeted = false;
                }
                self.greet()
            }
            Line::Frame(frame) => self.take_frame(*frame, network, event),
            // The gap in the numbers says it, too.
            Line::Lost { .. } | Line::Answer(_) | Line::Refused { .. } => Ok(()),
        }
    }

    fn take_hello(&mut self, hello: Hello, robot: &str) {
        let subject = hello.worm.clone();
        let same_boot = self.known.take().filter(|known| known.boot_id == hello.boot_id);
        let (number, frames_lost) = match &same_boot {
            Some(known) => (known.number.filter(|_| known.pid == hello.pid), known.frames_lost),
            None => (None, 0),
        };
        let mut known = Known {
            robot: robot.to_owned(),
            config: hello.config.clone(),
            // Times of another run of the computer do not compare.
            picture: same_boot.map_or_else(|| Picture::new(subject), |known| known.picture),
            version: hello.version,
            wormd: hello.wormd.clone(),
            pid: hello.pid,
            boot_id: hello.boot_id.clone(),
            number,
            frames_lost,
        };
        known.picture.take_hello(hello);
        self.known = Some(known);
    }

    fn take_frame(&mut self, mut frame: Frame, network: &Network, event: Option<Event>) -> Result<(), Failure> {
        let Some(known) = &mut self.known else { return Ok(()) };
        frame.events.extend(event);
        let missing = known.number.map_or(0, |number| frame.number.saturating_sub(number + 1));
        known.number = Some(frame.number);
        known.frames_lost += missing;
        frame.network = Some(Network {
            frames_lost: known.frames_lost,
            ..network.clone()
        });
        let before = known.seen();
        known.picture.take_frame(frame.clone());
        let now = known.seen();
        let whole = shared(&Line::Frame(Box::new(frame.clone())))?;
        for watcher in self.watchers.values_mut().filter(|watcher| watcher.is_greeted) {
            let outbox = &mut watcher.inner.outbox;
            let lost = outbox.take_lost().unwrap_or(0) + missing;
            if lost > 0 && !outbox.is_losing() {
                // Where there is no room, the frame finds none either.
                let _ = outbox.add(shared(&Line::Lost { frames: lost })?);
            }
            if watcher.inner.seen == before || outbox.is_losing() {
                outbox.add_frame(&whole);
            } else {
                let since = known.frame_since(&frame, watcher.inner.seen);
                outbox.add_frame(&shared(&Line::Frame(Box::new(since)))?);
            }
            if !outbox.is_losing() {
                watcher.inner.seen = now;
            }
        }
        Ok(())
    }

    /// Takes an answer of the robot's relay.
    pub(crate) fn take_answer(&mut self, watcher: u64, answer: Answer) {
        if let Some(found) = self.watchers.get_mut(&watcher)
            && found.inner.answer(answer).is_err()
        {
            self.watchers.remove(&watcher);
        }
    }

    /// Takes who comes, and reads what watchers ask.
    pub(crate) fn read(&mut self) -> Vec<Asked> {
        self.accept();
        let mut asked = Vec::new();
        let mut gone = Vec::new();
        for (&id, watcher) in &mut self.watchers {
            match watcher.inner.read() {
                Ok(lines) => {
                    for line in lines {
                        if watcher.take(id, &line, &mut asked).is_err() {
                            gone.push(id);
                        }
                    }
                }
                Err(Gone(why)) => {
                    if let Some(why) = why {
                        tracing::info!("watcher {id} of {} was disconnected: {why}", self.instance.worm());
                    }
                    gone.push(id);
                }
            }
        }
        for id in gone {
            self.watchers.remove(&id);
        }
        asked
    }

    fn accept(&mut self) {
        loop {
            match self.listener.socket.accept() {
                Ok((stream, _)) => {
                    if let Err(error) = self.welcome(stream) {
                        tracing::debug!("a watcher that did not stay: {error}");
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => {
                    if error.kind() != io::ErrorKind::WouldBlock {
                        tracing::debug!("no watcher can connect: {error}");
                    }
                    return;
                }
            }
        }
    }

    fn welcome(&mut self, stream: UnixStream) -> io::Result<()> {
        let (inner, _) = Watcher::admit(stream, "fleet", self.watchers.len())?;
        let watcher = LocalWatcher {
            inner,
            name: None,
            heard: None,
            is_greeted: false,
        };
        self.watchers.insert(self.next_id, watcher);
        self.next_id += 1;
        self.greet().map_err(io::Error::other)
    }

    /// Gives the history to all who do not have it.
    fn greet(&mut self) -> Result<(), Failure> {
        let Some(known) = &self.known else { return Ok(()) };
        let mut line: Option<SharedLine> = None;
        let waiting = self.watchers.values_mut();
        for watcher in waiting.filter(|watcher| !watcher.is_greeted && !watcher.inner.is_refused) {
            let line = match &line {
                Some(line) => line,
                None => line.insert(shared(&Line::Hello(Box::new(known.hello())))?),
            };
            watcher.is_greeted = watcher.inner.outbox.add(Arc::clone(line)).is_ok();
            watcher.inner.seen = known.seen();
        }
        Ok(())
    }

    /// Writes what can be without waiting.
    pub(crate) fn write(&mut self) {
        self.watchers.retain(|_, watcher| {
            let inner = &mut watcher.inner;
            match inner.outbox.write(&mut inner.stream) {
                Ok(progress) => {
                    if progress || inner.outbox.is_empty() {
                        inner.took = Instant::now();
                    }
                    !(inner.is_refused && inner.outbox.is_empty()) && inner.took.elapsed() < STALL_LIMIT
                }
                Err(_) => false,
            }
        });
    }

    /// The watchers that are there.
    pub(crate) fn present(&self) -> impl Iterator<Item = u64> + '_ {
        let is_there = |watcher: &LocalWatcher| watcher.heard.is_some_and(|heard| heard.elapsed() < SILENCE);
        self.watchers
            .iter()
            .filter(move |(_, watcher)| is_there(watcher))
            .map(|(&id, _)| id)
    }

    /// What can be read or written to, and whether something waits to be written.
    pub(crate) fn streams(&self) -> impl Iterator<Item = (&UnixStream, bool)> {
        self.watchers
            .values()
            .map(|watcher| (&watcher.inner.stream, !watcher.inner.outbox.is_empty()))
    }

    /// Where watchers come.
    pub(crate) fn listener(&self) -> &std::os::unix::net::UnixListener {
        &self.listener.socket
    }
}

fn clash(instance: &Instance) -> Option<String> {
    let pid = RoleLock::<Controller>::holder(instance)?;
    let worm = instance.worm();
    Some(format!(
        "a worm {worm} runs on this computer (process {pid}): set another root in fleet.toml, or give one of the two another worm.name"
    ))
}

/// Why a worm of `robot` cannot be offered while `other` has the place of its relay.
fn who_has_it(instance: &Instance, robot: &str, other: &AlreadyRunning) -> String {
    let (worm, pid) = (instance.worm(), other.pid);
    let another = match fleet_list::offered_by(pid, instance) {
        Some(offered) if offered.robot == robot => {
            return format!(
                "another `wormd fleet` (process {pid}) offers {worm} of {robot} already: end one of the two. Where they are two computers, give \
                 each keys of its own"
            );
        }
        Some(offered) => offered.robot,
        // It is not in the list yet.
        None if pid == std::process::id() => "another robot".to_owned(),
        None => {
            return format!(
                "a relay of a worm {worm} of this computer (process {pid}) is still there: it ends some seconds after its last watcher"
            );
        }
    };
    format!(
        "{another} has a worm {worm}, too, and that one is offered here under this name (by process {pid}): give the worm of {robot} or \
         that of {another} another worm.name, or offer {robot} by a `wormd fleet` of its own with another root in its fleet.toml"
    )
}

impl LocalWatcher {
    /// Takes a line.
    fn take(&mut self, id: u64, line: &[u8], asked: &mut Vec<Asked>) -> Result<(), Gone> {
        if self.inner.is_refused {
            return Ok(());
        }
        let mut line: RequestLine = match serde_json::from_slice(line) {
            Ok(line) => line,
            Err(error) => {
                let refusal = format!("this is no request: {error}");
                return self.inner.answer(Answer::own(id, None, "", "unusable", Some(refusal)));
            }
        };
        // It is of this computer's clock; over the network the link says how late it is.
        let now_ns = monotonic_ns();
        let sent_ns = line.sent_ns.take().unwrap_or(now_ns);
        if let Some(refusal) = lateness::refusal(&line.request, sent_ns, now_ns) {
            let answer = Answer::own(id, line.id, line.request.name(), "stale", Some(refusal));
            return self.inner.answer(answer);
        }
        // What lay unread says who was there then.
        let late = Duration::from_nanos(now_ns.saturating_sub(sent_ns));
        let heard = Instant::now().checked_sub(late);
        match &line.request {
            Request::Hello { version, .. } if *version > VERSION => {
                let own = env!("CARGO_PKG_VERSION");
                self.inner.refuse(format!(
                    "this fleet process (wormd {own}) speaks version {VERSION} and the watcher version {version}: use the same wormd"
                ));
            }
            // It goes to the robot with the first request.
            Request::Hello { name, .. } => self.name = Some(name.clone()),
            Request::Alive => self.heard = heard.max(self.heard),
            _ => {
                self.heard = heard.max(self.heard);
                let name = self.name.clone();
                asked.push(Asked {
                    watcher: id,
                    name,
                    line,
                });
            }
        }
        Ok(())
    }
}

impl Known {
    fn seen(&self) -> Seen {
        Seen {
            cycles: self.picture.cycles.total(),
            alarms: self.picture.alarms.total(),
            commands: self.picture.commands.total(),
            events: self.picture.events.total(),
        }
    }

    fn hello(&self) -> Hello {
        let picture = &self.picture;
        Hello {
            version: self.version,
            wormd: self.wormd.clone(),
            pid: self.pid,
            boot_id: self.boot_id.clone(),
            time_ns: picture.time_ns,
            robot: Some(self.robot.clone()),
            worm: picture.subject.clone(),
            config: self.config.clone(),
            samples: picture.history.samples(),
            cycles: picture.cycles.iter().copied().map(Json).collect(),
            alarms: picture.alarms.iter().copied().map(Json).collect(),
            commands: picture.commands.iter().copied().map(Json).collect(),
            events: picture.events.iter().cloned().collect(),
        }
    }

    /// The newest frame for who has seen less than the others.
    fn frame_since(&self, frame: &Frame, seen: Seen) -> Frame {
        let picture = &self.picture;
        Frame {
            cycles: picture.cycles.since(seen.cycles).copied().map(Json).collect(),
            alarms: picture.alarms.since(seen.alarms).copied().map(Json).collect(),
            commands: picture.commands.since(seen.commands).copied().map(Json).collect(),
            events: picture.events.since(seen.events).cloned().collect(),
            ..frame.clone()
        }
    }
}
