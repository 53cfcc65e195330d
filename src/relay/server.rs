//! The relay process: one thread that reads the topics 20 times a second, and serves every watcher without waiting for any.

use super::commander::{Commander, Job, Outcome};
use super::drive::{Decision, Drive, Effect, Identity, WatcherId};
use super::event_log::EventLog;
use super::outbox::{Outbox, SharedLine};
use super::remark::{self, Refusals};
use super::socket::Listener;
use super::source::{Seen, Source};
use super::watcher::{Gone, Watcher, shared};
use super::wire::{Answer, Line, Request, RequestLine, VERSION};
use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::topics::{Controller, Hub, Instance, Relay, RoleLock};
use crate::trip::wire::Attendance;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::collections::BTreeMap;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::CommandKind;

/// Time between frames.
pub(crate) const FRAME: Duration = Duration::from_millis(50);
/// How long the relay waits for a watcher when it has none.
const LINGER: Duration = Duration::from_secs(5);
/// How long a watcher may take nothing before it is cut off.
const STALL_LIMIT: Duration = Duration::from_secs(30);
/// How often a trip is told that somebody watches, ns.
const ATTENDANCE_NS: u64 = 250_000_000;

/// Serves the configured worm, whose configuration has this text, until `end` is set, or nobody has watched for a while. Calls `ready` once
/// watchers can connect.
///
/// # Errors
/// [`Failure::Failed`] when the topics or the socket fail.
pub(crate) fn run(
    (config, text): (&Config, Option<String>),
    instance: &Instance,
    _role: &RoleLock<Relay>,
    end: &AtomicBool,
    ready: impl FnOnce(),
) -> Result<(), Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let source = Source::open(&hub, config, text)?;
    let commander = Commander::start(config, Hub::open(instance).map_err(Failure::failed)?)?;
    let listener = Listener::bind(instance).map_err(|error| {
        let path = instance.relay_socket();
        Failure::failed(format!(
            "{}: {error}: the worm's folder must be on a file system with sockets: set another topics.root",
            path.display()
        ))
    })?;
    let mut server = Server {
        instance: instance.clone(),
        listener,
        commander,
        source,
        drive: Drive::default(),
        event_log: EventLog::new(instance.worm()),
        refusals: Refusals::default(),
        watchers: BTreeMap::new(),
        next_id: 1,
        frames: 0,
        sent: Seen::default(),
        hello: None,
        deserted: Some(Instant::now()),
        had_watchers: false,
        attendance: Attendance::open(instance, "relay").map_err(Failure::failed)?,
        attendance_due_ns: 0,
    };
    ready();
    server.serve(end)
}

struct Server {
    instance: Instance,
    listener: Listener,
    commander: Commander,
    source: Source,
    drive: Drive,
    event_log: EventLog,
    /// The refusals that are recorded.
    refusals: Refusals,
    watchers: BTreeMap<WatcherId, Watcher>,
    next_id: WatcherId,
    frames: u64,
    /// What the newest frame was about.
    sent: Seen,
    /// The first line for who comes before the next frame, and what it is about.
    hello: Option<(SharedLine, Seen)>,
    /// Since when there has been no watcher.
    deserted: Option<Instant>,
    had_watchers: bool,
    /// Tells a trip that somebody watches.
    attendance: Attendance,
    attendance_due_ns: u64,
}

impl Server {
    fn serve(&mut self, end: &AtomicBool) -> Result<(), Failure> {
        let mut due = Instant::now();
        while !end.load(Ordering::Relaxed) && !self.is_deserted() {
            let readable = self.wait(due.saturating_duration_since(Instant::now()))?;
            self.accept();
            self.read(&readable);
            self.take_outcomes();
            if Instant::now() >= due {
                // After a pause of the computer the frames that are missed are missed.
                due = (due + FRAME).max(Instant::now());
                self.make_frame()?;
            }
            self.write();
        }
        Ok(())
    }

    /// Whether nobody watches any more: at once where the worm is gone, too.
    fn is_deserted(&mut self) -> bool {
        if !self.watchers.is_empty() {
            self.deserted = None;
            return false;
        }
        let since = self.deserted.get_or_insert_with(Instant::now);
        since.elapsed() >= LINGER || (self.had_watchers && RoleLock::<Controller>::holder(&self.instance).is_none())
    }

    /// Waits until there is something to do; returns the watchers that can be read.
    fn wait(&self, timeout: Duration) -> Result<Vec<WatcherId>, Failure> {
        let mut waiting = vec![
            PollFd::new(self.listener.socket.as_fd(), PollFlags::POLLIN),
            PollFd::new(self.commander.answered().as_fd(), PollFlags::POLLIN),
        ];
        let first = waiting.len();
        waiting.extend(self.watchers.values().map(|watcher| {
            let wants = match watcher.outbox.is_empty() {
                true => PollFlags::POLLIN,
                false => PollFlags::POLLIN | PollFlags::POLLOUT,
            };
            PollFd::new(watcher.stream.as_fd(), wants)
        }));
        // Rounded up: a wait that ends too early would be repeated at once.
        let timeout = PollTimeout::try_from(timeout + Duration::from_millis(1)).unwrap_or(PollTimeout::MAX);
        match poll(&mut waiting, timeout) {
            Ok(_) | Err(nix::errno::Errno::EINTR) => {}
            Err(errno) => {
                return Err(Failure::failed(format!(
                    "the relay cannot wait for its watchers: {errno}"
                )));
            }
        }
        let can_be_read = |found: &PollFd<'_>| {
            found
                .revents()
                .is_some_and(|it| it != PollFlags::POLLOUT && !it.is_empty())
        };
        let watchers = self.watchers.keys().zip(&waiting[first..]);
        Ok(watchers
            .filter(|(_, found)| can_be_read(found))
            .map(|(id, _)| *id)
            .collect())
    }

    fn accept(&mut self) {
        loop {
            match self.listener.socket.accept() {
                Ok((stream, _)) => {
                    if let Err(error) = self.welcome(stream) {
                        tracing::debug!("a watcher that did not stay: {error}");
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => {
                    // No more files, perhaps. Those who are connected are still served, and this is not tried at once again.
                    tracing::debug!("no watcher can connect: {error}");
                    std::thread::sleep(FRAME);
                    return;
                }
            }
        }
    }

    fn welcome(&mut self, stream: UnixStream) -> io::Result<()> {
        let (mut watcher, pid) = Watcher::admit(stream, "worm", self.watchers.len())?;
        let id = self.next_id;
        self.next_id += 1;
        if !watcher.is_refused {
            // Nothing comes before it.
            watcher.seen = self.greet(&mut watcher.outbox)?;
            let (name, user) = (format!("process {pid}"), watcher.user);
            self.drive.join(id, Identity { name, user, pid });
            self.had_watchers = true;
        }
        self.watchers.insert(id, watcher);
        Ok(())
    }

    /// Queues the first line; returns what it was about. Made once for all who come between two frames.
    fn greet(&mut self, outbox: &mut Outbox) -> io::Result<Seen> {
        let worm = &self.source.worm;
        let seen = worm.seen();
        let line = match self.hello.take() {
            Some((line, of)) if of == seen => line,
            _ => shared(&Line::Hello(Box::new(worm.hello(monotonic_ns())))).map_err(io::Error::other)?,
        };
        // It is the first: there is room.
        let _ = outbox.add(Arc::clone(&line));
        self.hello = Some((line, seen));
        Ok(seen)
    }

    fn read(&mut self, readable: &[WatcherId]) {
        for &id in readable {
            let Some(watcher) = self.watchers.get_mut(&id) else {
                continue;
            };
            let lines = match watcher.read() {
                Ok(lines) => lines,
                Err(gone) => {
                    self.remove(id, gone);
                    continue;
                }
            };
            for line in lines {
                if let Err(gone) = self.take_line(id, &line) {
                    self.remove(id, gone);
                    break;
                }
            }
        }
    }

    /// Takes a line of a watcher.
    fn take_line(&mut self, id: WatcherId, line: &[u8]) -> Result<(), Gone> {
        let Some(watcher) = self.watchers.get_mut(&id) else {
            return Ok(());
        };
        if watcher.is_refused {
            return Ok(());
        }
        let now_ns = monotonic_ns();
        let line: RequestLine = match serde_json::from_slice(line) {
            Ok(line) => line,
            Err(error) => {
                let refusal = format!("this is no request: {error}");
                return watcher.answer(Answer::own(id, None, "", "unusable", Some(refusal)));
            }
        };
        let (number, request, sent_ns) = (line.id, line.request, line.sent_ns.unwrap_or(now_ns));
        if let Request::Hello { version, .. } = request
            && version > VERSION
        {
            watcher.refuse(format!(
                "this relay (process {}, wormd {}) speaks version {VERSION} and the watcher version {version}: end the relay, so \
                 that the watcher starts its own, or use the older wormd",
                std::process::id(),
                env!("CARGO_PKG_VERSION")
            ));
            return Ok(());
        }
        let (name, user) = (request.name(), watcher.user);
        if let Request::NoteRefusal { name, refused, verdict } = &request {
            // Not even a sign of life: who asked is elsewhere, and perhaps long gone.
            let (record, text) = remark::by_bridge(*verdict, name, user, refused);
            self.note(text);
            self.commander.remark(record);
            return Ok(());
        }
        let refused = |verdict, refusal| Answer::own(id, number, name, verdict, Some(refusal));
        let answer = match self.drive.request(id, &request, sent_ns, now_ns) {
            Decision::Done(_) if request == Request::Alive => return Ok(()),
            Decision::Done(event) => {
                if let Some(event) = event {
                    self.note(event);
                    self.commander.remark(remark::take_over(&self.drive.name(id), user));
                }
                Answer::own(id, number, name, "accepted", None)
            }
            Decision::Refused(refusal) => {
                self.record_refusal(CommandKind::NotDriver, id, user, name);
                refused("not-driver", refusal)
            }
            Decision::Stale(refusal) => {
                self.record_refusal(CommandKind::Stale, id, user, name);
                refused("stale", refusal)
            }
            Decision::Send => {
                let job = Job::Request {
                    watcher: id,
                    user,
                    name: self.drive.name(id),
                    id: number,
                    sent_ns,
                    request,
                };
                match self.commander.order(job) {
                    Ok(()) => return Ok(()),
                    Err(_) => {
                        if name == "crawl" {
                            self.drive.crawl_ended();
                        }
                        self.record_refusal(CommandKind::Busy, id, user, name);
                        refused(
                            "busy",
                            "too many commands wait for the controller: try again".to_owned(),
                        )
                    }
                }
            }
        };
        if answer.refusal.is_some() {
            self.event_log
                .note_answer(&mut self.source.worm, &self.drive.who(answer.watcher), &answer);
        }
        match self.watchers.get_mut(&id) {
            Some(watcher) => watcher.answer(answer),
            None => Ok(()),
        }
    }

    /// Records that a command of a watcher came no further than this, unless that was recorded just now.
    fn record_refusal(&mut self, kind: CommandKind, id: WatcherId, user: u32, command: &str) {
        let name = self.drive.name(id);
        let record = self.refusals.record(kind, id, (&name, user), command, Instant::now());
        if let Some(record) = record {
            self.commander.remark(record);
        }
    }

    fn take_outcomes(&mut self) {
        self.commander.hand_over_remarks();
        let outcomes: Vec<_> = self.commander.outcomes().collect();
        for outcome in outcomes {
            match outcome {
                Outcome::Answer(answer) => {
                    if answer.refusal.is_some() && answer.command == "crawl" {
                        self.drive.crawl_ended();
                    }
                    // What the controller took or refused comes by the topic `command`, whoever sent it.
                    if answer.tick.is_none() {
                        self.event_log
                            .note_answer(&mut self.source.worm, &self.drive.who(answer.watcher), &answer);
                    }
                    let id = answer.watcher;
                    if answer.verdict == "stale"
                        && let Some(user) = self.watchers.get(&id).map(|watcher| watcher.user)
                    {
                        self.record_refusal(CommandKind::Stale, id, user, &answer.command);
                    }
                    if let Some(watcher) = self.watchers.get_mut(&id)
                        && let Err(gone) = watcher.answer(answer)
                    {
                        self.remove(id, gone);
                    }
                }
                Outcome::NotHeld(refusal) => self.note(refusal),
                Outcome::NotRenewed(refusal) => {
                    self.drive.crawl_ended();
                    self.note(refusal);
                }
            }
        }
    }

    /// Reads the topics, and queues a frame for everybody.
    fn make_frame(&mut self) -> Result<(), Failure> {
        let now_ns = monotonic_ns();
        let effect = self.drive.due(now_ns);
        self.carry_out(effect);
        if now_ns >= self.attendance_due_ns && self.drive.is_attended(now_ns) {
            self.attendance_due_ns = now_ns + ATTENDANCE_NS;
            // Where there is no trip, nobody hears it.
            self.attendance.say();
        }
        let watchers = self.watchers.iter();
        let stalled = watchers.filter(|(_, watcher)| watcher.took.elapsed() > STALL_LIMIT);
        let stalled: Vec<_> = stalled.map(|(id, _)| *id).collect();
        for id in stalled {
            self.remove(id, Gone(Some(format!("it took nothing for {STALL_LIMIT:?}"))));
        }

        self.source.poll(now_ns);
        self.event_log.note_commands(&mut self.source.worm);
        let worm = &self.source.worm;
        let (seen, driver) = (worm.seen(), self.drive.driver(now_ns));
        self.frames += 1;
        let number = self.frames;
        let watchers = self.drive.watchers();
        let frame_since = |since: Seen| -> Result<SharedLine, Failure> {
            let frame = worm.frame(number, now_ns, since, watchers, driver.clone());
            shared(&Line::Frame(Box::new(frame)))
        };
        // The same for all who got the last one.
        let sent = self.sent;
        let frame = frame_since(sent)?;
        for watcher in self.watchers.values_mut().filter(|watcher| !watcher.is_refused) {
            if let Some(frames) = watcher.outbox.take_lost() {
                // There is room: nothing waits.
                let _ = watcher.outbox.add(shared(&Line::Lost { frames })?);
            }
            // Who has just come, or has lost frames, gets what is missing.
            if watcher.seen == sent || watcher.outbox.is_losing() {
                watcher.outbox.add_frame(&frame);
            } else {
                watcher.outbox.add_frame(&frame_since(watcher.seen)?);
            }
            if !watcher.outbox.is_losing() {
                watcher.seen = seen;
            }
        }
        self.hello = None;
        self.sent = seen;
        Ok(())
    }

    fn carry_out(&mut self, effect: Option<Effect>) {
        let job = match effect {
            None => return,
            Some(Effect::Renew) => Job::Renew,
            Some(Effect::Hold(reason)) => {
                self.note(format!("the worm is to hold: {reason}"));
                Job::Hold(reason.sender())
            }
        };
        // Without a place in the queue the permission lapses, and the worm holds.
        if let Err(job) = self.commander.order(job) {
            tracing::warn!("the controller does not take {job:?}");
        }
    }

    fn write(&mut self) {
        let mut gone = Vec::new();
        for (id, watcher) in &mut self.watchers {
            match watcher.outbox.write(&mut watcher.stream) {
                Ok(progress) => {
                    if progress || watcher.outbox.is_empty() {
                        watcher.took = Instant::now();
                    }
                    if watcher.is_refused && watcher.outbox.is_empty() {
                        gone.push((*id, Gone(None)));
                    }
                }
                Err(error) => {
                    tracing::debug!("watcher {id}: {error}");
                    gone.push((*id, Gone(None)));
                }
            }
        }
        for (id, why) in gone {
            self.remove(id, why);
        }
    }

    fn remove(&mut self, id: WatcherId, Gone(why): Gone) {
        if let Some(why) = why {
            self.note(format!("{} was disconnected: {why}", self.drive.who(id)));
        }
        self.watchers.remove(&id);
        let effect = self.drive.leave(id);
        self.carry_out(effect);
    }

    fn note(&mut self, text: String) {
        self.event_log.note(&mut self.source.worm, text);
    }
}
