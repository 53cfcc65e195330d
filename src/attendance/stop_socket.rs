//! The controller's stop socket: how to stop a worm whose topics have gone.
//!
//! It is an abstract Unix socket, which lies in no folder and needs no room in `/dev/shm`. Its name is
//! `wormd/<user>/<worm>/<root>/<process>`, where the root is the CRC-16/XMODEM of `topics.root` as configured. Who connects must be
//! the same user, or root. One line of JSON asks, one line answers.

use super::parent_pipe::{Parent, ParentPipe};
use super::standing::Standing;
use crossbeam::queue::ArrayQueue;
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::socket::{UnixCredentials, getsockopt, sockopt::PeerCredentials};
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{Command, CommandKind, Reply, ShortText};

/// Commands that may wait for the next tick.
const QUEUE: usize = 8;
/// How long a client may take to ask, however many pieces it asks in.
const ASK_TIMEOUT: Duration = Duration::from_millis(250);
/// How long the loop may take to answer: longer than its longest service, a restart of the servo.
pub(super) const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);
/// How often the socket looks whether it is to close, and for the loop's answer.
const POLL_MS: u8 = 50;
const ANSWER_POLL: Duration = Duration::from_millis(1);
/// Longest question, bytes.
const MAX_LINE: usize = 256;

/// What may be asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Request {
    /// Stop the worm, as [`CommandKind::Stop`].
    Stop,
    /// Say how the worm stands.
    Status,
    /// End in order, if nobody watches over this controller any more.
    End,
}

/// The question on the wire.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Question {
    pub(crate) request: Request,
    /// Who wants the worm to stop, for the record; older programs do not say.
    #[serde(default)]
    pub(crate) sender: String,
    /// The user on whose behalf that is; without it, the one who asks.
    #[serde(default)]
    pub(crate) user: Option<u32>,
}

impl From<Request> for Question {
    fn from(request: Request) -> Self {
        Self {
            request,
            sender: String::new(),
            user: None,
        }
    }
}

/// The answer on the wire.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Answer {
    /// Process of the controller.
    pub(crate) pid: u32,
    /// [`Mode`] as a code.
    pub(crate) mode: u32,
    /// [`Fault`] as a code.
    pub(crate) fault: u32,
    /// [`Parent`] as a word.
    pub(crate) parent: String,
    /// The canal's slope by the controller's configuration, degrees.
    pub(crate) slope_deg: f64,
    /// `control.crawl_limit_s` of the controller's configuration, s.
    pub(crate) crawl_limit_s: f64,
    /// The reply to a command: its tick and its verdict.
    pub(crate) reply: Option<CommandReply>,
    /// Why the request was not carried out.
    pub(crate) refusal: Option<String>,
}

impl Answer {
    /// Whether somebody watches over the controller now.
    pub(crate) fn is_supervised(&self) -> bool {
        self.parent == Parent::Here.name()
    }

    /// Whether the parent of the controller is gone.
    pub(crate) fn is_orphaned(&self) -> bool {
        self.parent == Parent::Gone.name()
    }
}

/// What a tick replied to a command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct CommandReply {
    pub(crate) sequence: u64,
    pub(crate) verdict: u32,
    pub(crate) alarm_mask: u32,
}

/// The beginning of the names of a worm's stop sockets; `user` is none for those of all users.
pub(super) fn name_parts(worm: &str, root: &str) -> (String, String) {
    let hash = crc::Crc::<u16>::new(&crc::CRC_16_XMODEM).checksum(root.as_bytes());
    ("wormd/".to_owned(), format!("/{worm}/{hash:04x}/"))
}

/// User, worm and process of a stop socket's name.
pub(super) fn parse_name(name: &str) -> Option<(u32, &str, u32)> {
    let mut parts = name.strip_prefix("wormd/")?.split('/');
    let (user, worm, _root, process) = (parts.next()?, parts.next()?, parts.next()?, parts.next()?);
    parts.next().is_none().then_some(())?;
    Some((user.parse().ok()?, worm, process.parse().ok()?))
}

/// The bound socket, and its thread. Dropping it closes it.
#[derive(Debug)]
pub struct StopSocket {
    shared: Arc<Shared>,
    thread: Option<std::thread::JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    /// Commands on their way to the loop, numbered.
    commands: ArrayQueue<(u64, Command)>,
    /// Replies on their way back.
    replies: ArrayQueue<(u64, Reply)>,
    closing: AtomicBool,
}

impl StopSocket {
    /// Binds the socket and serves it in a thread, which answers with where the controller has noted that it stands. `end` is set on
    /// `Request::End`.
    ///
    /// # Errors
    /// When the socket cannot be bound, or there is no thread to be had.
    pub fn bind(
        config: &Config,
        parent: Option<ParentPipe>,
        standing: &Standing,
        end: &Arc<AtomicBool>,
    ) -> io::Result<Self> {
        let (head, tail) = name_parts(&config.worm.name, &config.topics.root);
        let user = nix::unistd::geteuid();
        let name = format!("{head}{user}{tail}{}", std::process::id());
        let listener = UnixListener::bind_addr(&SocketAddr::from_abstract_name(name)?)?;
        listener.set_nonblocking(true)?;
        let shared = Arc::new(Shared {
            commands: ArrayQueue::new(QUEUE),
            replies: ArrayQueue::new(QUEUE),
            closing: AtomicBool::new(false),
        });
        let server = Server {
            shared: Arc::clone(&shared),
            parent,
            standing: standing.clone(),
            end: Arc::clone(end),
            slope_deg: config.canal.slope_deg,
            crawl_limit_s: config.control.crawl_limit_s,
            numbers: 0,
        };
        let thread = std::thread::Builder::new()
            .name("stop-socket".to_owned())
            .spawn(move || server.serve(&listener))?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    pub(super) fn take_command(&self) -> Option<(u64, Command)> {
        self.shared.commands.pop()
    }

    pub(super) fn answer(&self, number: u64, reply: &Reply) {
        // As many fit as there can be commands; one that nobody waits for any more makes room.
        let _ = self.shared.replies.force_push((number, *reply));
    }
}

impl Drop for StopSocket {
    fn drop(&mut self) {
        self.shared.closing.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has nothing to say about how it ended.
            let _ = thread.join();
        }
    }
}

struct Server {
    shared: Arc<Shared>,
    parent: Option<ParentPipe>,
    standing: Standing,
    end: Arc<AtomicBool>,
    slope_deg: f64,
    crawl_limit_s: f64,
    numbers: u64,
}

impl Server {
    fn serve(mut self, listener: &UnixListener) {
        while !self.shared.closing.load(Ordering::Relaxed) {
            let mut waiting = [PollFd::new(listener.as_fd(), PollFlags::POLLIN)];
            match poll(&mut waiting, PollTimeout::from(POLL_MS)) {
                Ok(0) | Err(Errno::EINTR) => continue,
                Ok(_) => {}
                // No signal would wake it any more; a socket that cannot be served is no reason to spin.
                Err(_) => std::thread::sleep(Duration::from_millis(POLL_MS.into())),
            }
            let Ok((stream, _)) = listener.accept() else { continue };
            // A client that leaves early, or asks nonsense, is its own problem.
            if let Err(error) = self.attend(stream) {
                tracing::debug!("stop socket: {error}");
            }
        }
    }

    fn attend(&mut self, mut stream: UnixStream) -> io::Result<()> {
        let peer = peer_of(&stream)?;
        let user = nix::unistd::geteuid().as_raw();
        if peer.uid() != user && peer.uid() != 0 {
            return self.send(
                &mut stream,
                None,
                Some(format!(
                    "this worm belongs to user {user}: only that user and root may stop it"
                )),
            );
        }
        stream.set_nonblocking(false)?;
        stream.set_write_timeout(Some(ASK_TIMEOUT))?;
        let question: Question = serde_json::from_slice(&read_line(&stream)?)?;
        match question.request {
            Request::Status => self.send(&mut stream, None, None),
            Request::Stop => {
                let reply = self.command(Command {
                    // Who gets here is root or the worm's own user, such as its relay, and may speak for others.
                    user: question.user.unwrap_or(peer.uid()),
                    sender: ShortText::new(&question.sender),
                    ..Command::new(CommandKind::Stop)
                });
                let refusal = reply
                    .is_none()
                    .then(|| format!("the loop did not answer within {ANSWER_TIMEOUT:?}"));
                self.send(&mut stream, reply, refusal)
            }
            Request::End => {
                let is_orphan = self.parent() == Parent::Gone;
                let refusal = (!is_orphan).then(|| "whoever started this controller is still there".to_owned());
                if is_orphan {
                    self.end.store(true, Ordering::Relaxed);
                }
                self.send(&mut stream, None, refusal)
            }
        }
    }

    fn parent(&self) -> Parent {
        self.parent.as_ref().map_or(Parent::None, ParentPipe::state)
    }

    /// Hands a command to the loop and waits for its reply.
    fn command(&mut self, command: Command) -> Option<Reply> {
        self.numbers += 1;
        let number = self.numbers;
        self.shared.commands.push((number, command)).ok()?;
        let begun = Instant::now();
        while begun.elapsed() < ANSWER_TIMEOUT && !self.shared.closing.load(Ordering::Relaxed) {
            while let Some((of, reply)) = self.shared.replies.pop() {
                if of == number {
                    return Some(reply);
                }
            }
            std::thread::sleep(ANSWER_POLL);
        }
        None
    }

    fn send(&self, stream: &mut UnixStream, reply: Option<Reply>, refusal: Option<String>) -> io::Result<()> {
        let (mode, fault) = self.standing.codes();
        let answer = Answer {
            pid: std::process::id(),
            mode: reply.map_or(mode, |reply| reply.mode),
            fault: reply.map_or(fault, |reply| reply.fault),
            parent: self.parent().name().to_owned(),
            slope_deg: self.slope_deg,
            crawl_limit_s: self.crawl_limit_s,
            reply: reply.map(|reply| CommandReply {
                sequence: reply.sequence,
                verdict: reply.verdict,
                alarm_mask: reply.alarm_mask,
            }),
            refusal,
        };
        let mut text = serde_json::to_string(&answer)?;
        text.push('\n');
        stream.write_all(text.as_bytes())
    }
}

/// A line, or what came of it before the client closed.
fn read_line(mut stream: &UnixStream) -> io::Result<Vec<u8>> {
    let begun = Instant::now();
    let (mut line, mut filled) = ([0; MAX_LINE], 0);
    while filled < MAX_LINE {
        let left = ASK_TIMEOUT.saturating_sub(begun.elapsed());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        let read = stream.read(&mut line[filled..])?;
        filled += read;
        if read == 0 || line[..filled].contains(&b'\n') {
            break;
        }
    }
    Ok(line[..filled].to_vec())
}

/// Who is at the other end of a socket.
pub(super) fn peer_of(stream: &UnixStream) -> io::Result<UnixCredentials> {
    getsockopt(stream, PeerCredentials).map_err(io::Error::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_says_user_worm_and_process_and_others_names_are_none() {
        let (head, tail) = name_parts("worm-1", "auto");
        let name = format!("{head}1000{tail}42");
        assert_eq!(parse_name(&name), Some((1000, "worm-1", 42)));
        for foreign in [
            "wormd/1000/w/abcd",
            "wormd/x/w/abcd/1",
            "wormd/1/w/abcd/1/2",
            "dbus/1/w/abcd/1",
            "",
        ] {
            assert_eq!(parse_name(foreign), None, "{foreign}");
        }
    }
}
