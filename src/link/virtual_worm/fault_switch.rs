//! Faults switched while the virtual worm runs, by `wormd fault`: only where `--allow-faults` was given.
//!
//! The switch is an abstract Unix socket, which leaves no file behind. Its name is `wormd/<user>/faults/<link>`, where the link is the
//! absolute path of the link to the pseudo-terminal. Who connects must be the same user, or root. One line of JSON asks, one line
//! answers. The server looks at it between its other work and never waits for a client.

use super::devices::Devices;
use super::fault::Fault;
use super::fault_kinds::KINDS;
use nix::sys::socket::{getsockopt, sockopt::PeerCredentials};
use serde::{Deserialize, Serialize};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest question or answer, bytes.
const MAX_LINE: usize = 16 * 1024;
/// How long a client may take to ask.
const ASK_TIMEOUT: Duration = Duration::from_secs(1);
/// How long the virtual worm may take to answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// What may be asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultRequest {
    /// Switch a fault on: its specification.
    SwitchOn(String),
    /// End the faults of a kind, or all.
    Clear(Option<String>),
    /// Only list them.
    List,
}

/// A fault that there is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ListedFault {
    /// As one would write it; with its window, if it has one.
    pub fault: String,
    /// Whether it holds at the moment.
    pub holds: bool,
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaultAnswer {
    /// Why the request was refused.
    pub refusal: Option<String>,
    /// How many faults were ended.
    pub cleared: usize,
    /// The faults that there are now.
    pub faults: Vec<ListedFault>,
}

fn address(link: &Path) -> io::Result<SocketAddr> {
    let link = std::path::absolute(link)?;
    let mut name = format!("wormd/{}/faults", nix::unistd::geteuid()).into_bytes();
    name.extend_from_slice(std::os::unix::ffi::OsStrExt::as_bytes(link.as_os_str()));
    SocketAddr::from_abstract_name(name)
}

/// Whether the process at the other end belongs to this user, or to root.
fn is_trusted(stream: &UnixStream) -> bool {
    getsockopt(stream, PeerCredentials)
        .is_ok_and(|peer| peer.uid() == 0 || peer.uid() == nix::unistd::geteuid().as_raw())
}

/// The bound socket, and the client that is asking.
#[derive(Debug)]
pub(super) struct FaultSwitch {
    listener: UnixListener,
    client: Option<(UnixStream, Vec<u8>, Instant)>,
}

impl FaultSwitch {
    pub(super) fn bind(link: &Path) -> io::Result<Self> {
        let listener = UnixListener::bind_addr(&address(link)?)?;
        listener.set_nonblocking(true)?;
        Ok(Self { listener, client: None })
    }

    /// Serves at most one client, as far as it goes without waiting.
    pub(super) fn serve(&mut self, devices: &mut Devices) {
        let (mut stream, mut line, since) = match self.client.take() {
            Some(client) => client,
            None => match self.listener.accept() {
                Ok((stream, _)) if is_trusted(&stream) && stream.set_nonblocking(true).is_ok() => {
                    (stream, Vec::new(), Instant::now())
                }
                _ => return,
            },
        };
        let mut chunk = [0; 1024];
        let is_open = match stream.read(&mut chunk) {
            Ok(count) => {
                line.extend_from_slice(&chunk[..count]);
                count > 0
            }
            Err(error) => error.kind() == io::ErrorKind::WouldBlock,
        };
        if let Some(end) = line.iter().position(|&byte| byte == b'\n') {
            let answer = match serde_json::from_slice(&line[..end]) {
                Ok(request) => obey(&request, devices),
                Err(error) => answer(devices, Some(format!("the request is not understood: {error}")), 0),
            };
            if let Ok(mut text) = serde_json::to_vec(&answer) {
                text.push(b'\n');
                // The answer fits into the socket's buffer; a client that has left wants none.
                let _gone = stream.write_all(&text);
            }
        } else if is_open && line.len() < MAX_LINE && since.elapsed() < ASK_TIMEOUT {
            self.client = Some((stream, line, since));
        }
    }
}

fn answer(devices: &Devices, refusal: Option<String>, cleared: usize) -> FaultAnswer {
    let faults = devices.faults().map(|(fault, holds)| ListedFault {
        fault: fault.to_string(),
        holds,
    });
    FaultAnswer {
        refusal,
        cleared,
        faults: faults.collect(),
    }
}

fn obey(request: &FaultRequest, devices: &mut Devices) -> FaultAnswer {
    match request {
        FaultRequest::List => answer(devices, None, 0),
        FaultRequest::SwitchOn(spec) => {
            let done = spec
                .parse::<Fault>()
                .map_err(|error| error.to_string())
                .and_then(|fault| devices.switch_on(fault).map_err(|error| error.to_string()));
            if done.is_ok() {
                tracing::warn!("fault switched on: {spec}");
            }
            answer(devices, done.err(), 0)
        }
        FaultRequest::Clear(Some(kind)) if !KINDS.iter().any(|known| known.name == kind) => {
            let known = KINDS.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", ");
            answer(
                devices,
                Some(format!("there is no fault \"{kind}\": use one of {known}")),
                0,
            )
        }
        FaultRequest::Clear(kind) => {
            let cleared = devices.clear_faults(kind.as_deref());
            tracing::warn!(cleared, "faults cleared");
            answer(devices, None, cleared)
        }
    }
}

/// Asks the virtual worm behind `link`.
///
/// # Errors
/// [`io::ErrorKind::ConnectionRefused`] when it takes no requests, or is not there; otherwise when it does not answer.
pub fn ask(link: &Path, request: &FaultRequest) -> io::Result<FaultAnswer> {
    let mut stream = UnixStream::connect_addr(&address(link)?)?;
    if !is_trusted(&stream) {
        return Err(io::Error::from(io::ErrorKind::PermissionDenied));
    }
    stream.set_read_timeout(Some(ANSWER_TIMEOUT))?;
    stream.set_write_timeout(Some(ANSWER_TIMEOUT))?;
    let mut line = serde_json::to_vec(request)?;
    line.push(b'\n');
    stream.write_all(&line)?;
    let mut text = String::new();
    BufReader::new(stream.take(64 * MAX_LINE as u64)).read_line(&mut text)?;
    Ok(serde_json::from_str(&text)?)
}
