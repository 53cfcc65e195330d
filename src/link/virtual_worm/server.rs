//! The simulated devices in real time, behind a pseudo-terminal.
//!
//! The loop sleeps until bytes come, an answer is due or a little time has passed; then the plant catches up with the
//! clock. It never spins. Plant and devices know of none of this.
//!
//! A real worm does not stop when a computer does. But this one runs on the computer that drives it, and when that computer pauses,
//! because it or its host is busy, controller and virtual worm pause at different times. So the clock of the simulated world
//! follows real time only while this process runs in time; a gap in which it did not run does not exist for the physics or the
//! servo's bus watchdog.

use super::devices::{Devices, DevicesError};
use super::fault_switch::FaultSwitch;
use super::options::Options;
use super::pty::{Pty, PtyError};
use crate::logging::Summed;
use crate::realtime::{monotonic_ns, visit_every_cpu};
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_physics::WormError;

/// Longest sleep while a controller sends.
const SLEEP_BUSY: Duration = Duration::from_millis(1);
/// Longest sleep while no controller sends, and so the delay with which a stop is noticed.
const SLEEP_IDLE: Duration = Duration::from_millis(10);
/// Silence after which the line counts as idle.
const IDLE_AFTER: Duration = Duration::from_millis(100);
/// Silence after which the peer counts as gone.
const GONE_AFTER: Duration = Duration::from_secs(1);
/// Silence of an active controller after which the server checks whether all CPUs of the computer run.
const CHECK_CPUS_AFTER: Duration = Duration::from_millis(20);
/// Without requests for this long it counts as unused.
const UNUSED_AFTER: Duration = Duration::from_secs(2);
/// Up to this delay a wake-up was merely late, and the world catches up; beyond it this process did not run, and the world stood
/// still. Half of the shortest bus watchdog.
const MAX_DELAY: Duration = Duration::from_millis(10);

/// Why the virtual worm cannot run, or had to end.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// Nothing to simulate.
    #[error(transparent)]
    Devices(#[from] DevicesError),
    /// No pseudo-terminal.
    #[error(transparent)]
    Pty(#[from] PtyError),
    /// The pseudo-terminal failed.
    #[error("the pseudo-terminal failed to {doing}: {source}")]
    Line {
        /// What was tried.
        doing: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// The plant refused.
    #[error(transparent)]
    Worm(#[from] WormError),
    /// Faults cannot be switched at run time.
    #[error("faults cannot be switched while the virtual worm runs: {0}; is another one running behind the same link?")]
    FaultSwitch(io::Error),
    /// No thread.
    #[error("cannot start a thread: {0}")]
    Thread(io::Error),
    /// The thread of the devices panicked.
    #[error("the virtual worm's thread panicked; its message is on standard error")]
    Panicked,
}

/// Says whether the server may end.
struct MayEnd(Box<dyn Fn() -> bool + Send>);

impl std::fmt::Debug for MayEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("MayEnd")
    }
}

/// Watches the devices.
struct Observer(Box<Watch>);
/// What an observer does with the devices and the world's time in s.
type Watch = dyn FnMut(&Devices, f64) + Send;

impl std::fmt::Debug for Observer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Observer")
    }
}

/// Devices on a pseudo-terminal, not yet running.
#[derive(Debug)]
pub struct Server {
    pty: Pty,
    devices: Devices,
    strict_baud: bool,
    /// Whether it may end by itself once nobody uses it.
    may_end: Option<MayEnd>,
    /// Takes faults while it runs.
    fault_switch: Option<FaultSwitch>,
    /// Who watches the devices, with the world's time in s.
    observer: Option<Observer>,
}

impl Server {
    /// Opens the pseudo-terminal.
    ///
    /// # Errors
    /// [`ServerError`] when there is nothing to simulate or no pseudo-terminal to be had.
    pub fn open(config: &Config, options: &Options) -> Result<Self, ServerError> {
        Ok(Self {
            devices: Devices::new(config, options)?,
            pty: Pty::open()?,
            strict_baud: options.baud.is_some(),
            may_end: None,
            fault_switch: None,
            observer: None,
        })
    }

    /// Path of the port that a controller opens.
    pub fn path(&self) -> &Path {
        self.pty.path()
    }

    /// Lets it also end when it was not asked anything for two seconds while `may_end` is true.
    pub fn end_when_unused(&mut self, may_end: impl Fn() -> bool + Send + 'static) {
        self.may_end = Some(MayEnd(Box::new(may_end)));
    }

    /// Lets [`ask_fault_switch`](super::ask_fault_switch) switch faults while it runs; `link` is the path under which it is known.
    ///
    /// # Errors
    /// [`ServerError::FaultSwitch`] when another virtual worm is known under this path, or the path is too long.
    pub fn allow_faults(&mut self, link: &Path) -> Result<(), ServerError> {
        self.fault_switch = Some(FaultSwitch::bind(link).map_err(ServerError::FaultSwitch)?);
        Ok(())
    }

    /// Runs until `stop` is true; returns the devices as they are then. Signals interrupt the sleep, so a handler that sets
    /// `stop` ends it at once.
    ///
    /// # Errors
    /// [`ServerError::Line`] when the pseudo-terminal fails.
    pub fn run(mut self, stop: &AtomicBool) -> Result<Devices, ServerError> {
        let failed = |doing| move |source| ServerError::Line { doing, source };
        let mut clock = WorldClock::started();
        let mut standstills = Summed::default();
        let mut last_byte = Duration::ZERO;
        let mut peer_gone = true;
        let mut incoming = [0; 4096];
        let mut outgoing = Vec::with_capacity(4096);
        while !stop.load(Ordering::Relaxed) {
            let busy = clock.world.saturating_sub(last_byte) < IDLE_AFTER;
            let mut sleep = if busy { SLEEP_BUSY } else { SLEEP_IDLE };
            if let Some(due_s) = self.devices.next_due_s() {
                let due = Duration::from_secs_f64(due_s.max(0.0));
                sleep = sleep.min(due.saturating_sub(clock.world));
            }
            let mut fds = [PollFd::new(self.pty.master(), PollFlags::POLLIN)];
            match ppoll(&mut fds, Some(TimeSpec::from_duration(sleep)), None) {
                Ok(_) | Err(Errno::EINTR) => {}
                Err(errno) => return Err(failed("wait")(errno.into())),
            }
            let silent = clock.world.saturating_sub(last_byte);
            if silent > UNUSED_AFTER && self.may_end.as_ref().is_some_and(|may_end| (may_end.0)()) {
                break;
            }
            if !peer_gone && silent > CHECK_CPUS_AFTER {
                // The controller may have its CPU taken away while this process runs on another. Then this comes back late, and
                // the world stands still for the gap.
                visit_every_cpu();
            }
            let count = self.pty.read(&mut incoming).map_err(failed("receive"))?;
            if let Some(stood_still) = clock.advance(Instant::now(), sleep) {
                standstills.add(|standstills: &mut Standstills| standstills.take(stood_still));
            }
            if let Some(standstills) = standstills.take_due(monotonic_ns(), false) {
                standstills.log();
            }
            let now = clock.world;
            let now_s = now.as_secs_f64();
            if count > 0 {
                last_byte = now;
                peer_gone = false;
            }
            if count > 0 && self.peer_speaks_our_baud().map_err(failed("read its settings"))? {
                self.devices.receive(&incoming[..count], now_s)?;
            } else {
                self.devices.advance_to(now_s)?;
            }
            if let Some(observer) = &mut self.observer {
                (observer.0)(&self.devices, now_s);
            }
            if self.devices.crawl_began_ns.is_none()
                && let Some(crawl_s) = self.devices.crawl_began_s()
            {
                let since_then = now.saturating_sub(Duration::from_secs_f64(crawl_s));
                self.devices.crawl_began_ns = Some(monotonic_ns() - since_then.as_nanos() as u64);
            }
            if let Some(fault_switch) = &mut self.fault_switch {
                fault_switch.serve(&mut self.devices);
            }
            outgoing.clear();
            self.devices.take_due(now_s, &mut outgoing);
            self.pty.write(&outgoing).map_err(failed("send"))?;
            if !peer_gone && now - last_byte > GONE_AFTER {
                peer_gone = true;
                self.pty.forget_exclusive();
            }
        }
        if let Some(standstills) = standstills.take_due(monotonic_ns(), true) {
            standstills.log();
        }
        Ok(self.devices)
    }

    /// Bytes at another baud rate are noise, which no device understands.
    fn peer_speaks_our_baud(&self) -> io::Result<bool> {
        Ok(!self.strict_baud || self.pty.peer_baud()? == self.devices.baud())
    }
}

/// The world's clock: real time, without the gaps in which this process did not run.
struct WorldClock {
    looked: Instant,
    world: Duration,
}

impl WorldClock {
    fn started() -> Self {
        Self {
            looked: Instant::now(),
            world: Duration::ZERO,
        }
    }

    /// Looks at the clock again, `planned` after the last time. How long the world has stood still in between, if it has.
    fn advance(&mut self, now: Instant, planned: Duration) -> Option<Duration> {
        let gap = now - std::mem::replace(&mut self.looked, now);
        let late = gap.saturating_sub(planned);
        if late <= MAX_DELAY {
            self.world += gap;
            return None;
        }
        self.world += planned;
        Some(late)
    }
}

/// Gaps that were left out, summed.
#[derive(Debug, Default)]
struct Standstills {
    count: u64,
    total: Duration,
    longest: Duration,
}

impl Standstills {
    fn take(&mut self, stood_still: Duration) {
        self.count += 1;
        self.total += stood_still;
        self.longest = self.longest.max(stood_still);
    }

    fn log(&self) {
        tracing::warn!(
            pauses = self.count,
            total_ms = self.total.as_millis() as u64,
            longest_ms = self.longest.as_millis() as u64,
            "host-paused: the computer did not run the virtual worm for a while, and its world stood still"
        );
    }
}

/// Simulated devices that run in a thread of this process, for tests and benchmarks.
///
/// ```no_run
/// use worm_estimator::config::Config;
/// use wormd::link::virtual_worm::{Options, VirtualWorm};
///
/// # fn run() -> Result<(), Box<dyn std::error::Error>> {
/// let worm = VirtualWorm::spawn(&Config::default(), &Options::default())?;
/// println!("a controller may open {}", worm.path().display());
/// let devices = worm.stop()?;
/// println!("the motor took {} J", devices.plant().total().electrical_j);
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct VirtualWorm {
    path: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<Devices, ServerError>>>,
}

impl VirtualWorm {
    /// Opens a pseudo-terminal and runs the devices behind it.
    ///
    /// # Errors
    /// As [`Server::open`], and when no thread can be started.
    pub fn spawn(config: &Config, options: &Options) -> Result<Self, ServerError> {
        Self::run(Server::open(config, options)?)
    }

    /// As [`spawn`](Self::spawn); `observer` sees the devices at least every few milliseconds, with the world's time in s.
    ///
    /// # Errors
    /// As [`spawn`](Self::spawn).
    pub fn spawn_observed(
        config: &Config,
        options: &Options,
        observer: impl FnMut(&Devices, f64) + Send + 'static,
    ) -> Result<Self, ServerError> {
        let mut server = Server::open(config, options)?;
        server.observer = Some(Observer(Box::new(observer)));
        Self::run(server)
    }

    fn run(server: Server) -> Result<Self, ServerError> {
        let path = server.path().to_path_buf();
        let stop = Arc::new(AtomicBool::new(false));
        let stop_there = Arc::clone(&stop);
        let thread = std::thread::Builder::new()
            .name("virtual-worm".to_owned())
            .spawn(move || server.run(&stop_there))
            .map_err(ServerError::Thread)?;
        Ok(Self {
            path,
            stop,
            thread: Some(thread),
        })
    }

    /// Path of the port that a controller opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Ends the thread, and gives the devices with the truth about everything that happened.
    ///
    /// # Errors
    /// What ended the thread before, if something did.
    pub fn stop(mut self) -> Result<Devices, ServerError> {
        self.stop.store(true, Ordering::Relaxed);
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            _ => Err(ServerError::Panicked),
        }
    }
}

impl Drop for VirtualWorm {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // Whoever drops it does not ask how it ended.
            let _ended = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_in_which_it_did_not_run_is_no_time() {
        let ms = Duration::from_millis;
        let mut clock = WorldClock::started();
        let began = clock.looked;
        // (when it looks, what was planned, the world's time then, how long it stood still; ms)
        for (at, planned, world, stood_still) in [
            (1, 1, 1, None),
            (9, 1, 9, None),
            (20, 1, 20, None),
            (320, 1, 21, Some(299)),
            (330, 10, 31, None),
            (420, 10, 41, Some(80)),
        ] {
            assert_eq!(
                clock.advance(began + ms(at), ms(planned)),
                stood_still.map(ms),
                "at {at} ms"
            );
            assert_eq!(clock.world, ms(world), "at {at} ms");
        }
    }
}
