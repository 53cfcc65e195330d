//! The process on the robot, `wormd bridge`: between the relays of its worms and the laptops.
//!
//! One thread, which waits for neither. It is a watcher of each relay for each laptop, and one more for every watcher behind a laptop that
//! commands, so that driving is decided where it always is.

use super::clock::ClockWatch;
use super::network::{End, Network, Party, Way};
use super::refusals::Refusals;
use super::remote::{Remote, Served};
use super::settings::BridgeSettings;
use super::wire::{Beat, MAX_UP, Up, VERSION};
use super::{link_log, reasons};
use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::syslog;
use crate::topics::{Bridge as BridgeRole, Instance, RoleError, RoleLock};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long the thread waits at most, ms.
const POLL_MS: u16 = 50;
/// How long a turn waits for more after the first thing has come.
const GATHER: Duration = Duration::from_millis(4);
/// How often a laptop hears that the bridge is there.
const BEAT: Duration = Duration::from_millis(200);
/// How often the clocks, and what was refused, are looked at.
const LOOK: Duration = Duration::from_secs(1);
/// How often an address is tried that this computer does not have.
const LISTEN_RETRY: Duration = Duration::from_secs(1);
/// How long after it was said why connections are refused that is said again, where the reason is the same.
const REFUSALS: Duration = Duration::from_secs(60);
/// A laptop that was not heard for so long has gone.
const GONE: Duration = Duration::from_secs(5);
/// Most processes on laptops, and most of one certificate.
const MAX_REMOTES: usize = 32;
const MAX_OF_ONE: usize = 8;

/// Serves until `end` is set. Calls `ready` once laptops can connect, and `round` at each turn, also while it waits for its address.
///
/// # Errors
/// [`Failure::Unusable`] when a worm's folder or an address cannot be used, or another bridge serves one of the worms.
pub(crate) fn run(
    settings: BridgeSettings,
    end: &AtomicBool,
    ready: impl FnOnce(),
    round: impl Fn(),
) -> Result<(), Failure> {
    let mut worms = Vec::new();
    for (config, arguments) in settings.worms {
        let instance = Instance::of(&config).map_err(Failure::unusable)?;
        let name = config.worm.name;
        worms.push(Served {
            name,
            instance,
            arguments,
        });
    }
    let open = || {
        Network::open(&End {
            credentials: &settings.credentials,
            others: &settings.all,
            laptops: &settings.all,
            listen: &settings.listen,
            connect: &[],
            way: Way::Down,
            session: None,
        })
    };
    let listen = settings.listen.join(", ");
    let Some(network) = open_when_possible(&listen, open, end, &round)? else {
        return Ok(());
    };
    // Last, so that what else is wrong is said first; and before anything is sent.
    let roles = take_roles(&worms, &listen)?;
    let mut bridge = Bridge {
        robot: settings.credentials.name,
        drive: settings.drive,
        worms,
        network,
        remotes: BTreeMap::new(),
        refusals: Refusals::default(),
        clock: ClockWatch::new(),
        looked: Instant::now(),
        refused: None,
        beaten: Instant::now(),
        next_stream: monotonic_ns(),
    };
    ready();
    while !end.load(Ordering::Relaxed) {
        bridge.turn()?;
        round();
    }
    // Laptops are let go before another bridge may have the worms. With each role goes a folder that is empty.
    drop(bridge);
    drop(roles);
    Ok(())
}

/// What other bridges serve of these worms now, in words: while they do, this one would not start.
///
/// # Errors
/// [`Failure::Unusable`] for a worm that cannot be one of this computer.
pub(crate) fn served_already(settings: &BridgeSettings) -> Result<Vec<String>, Failure> {
    let mut remarks = Vec::new();
    for (config, _) in &settings.worms {
        let instance = Instance::of(config).map_err(Failure::unusable)?;
        if let Some(pid) = RoleLock::<BridgeRole>::holder(&instance) {
            let note = RoleLock::<BridgeRole>::note(&instance);
            remarks.push(reasons::of_second_bridge(instance.worm(), pid, note.as_deref()));
        }
    }
    Ok(remarks)
}

/// Takes the role of each worm's bridge: a second one would double what its relay serves, and two rules would say who may drive it.
fn take_roles(worms: &[Served], listen: &str) -> Result<Vec<RoleLock<BridgeRole>>, Failure> {
    let mut instances: Vec<&Instance> = worms.iter().map(|worm| &worm.instance).collect();
    // In the same order in every bridge: of two that begin at once, one gets all of its worms.
    instances.sort_by_key(|instance| instance.folder());
    let role = |instance: &Instance| {
        RoleLock::take_with_note(instance, listen).map_err(|error| match error {
            RoleError::AlreadyRunning(other) => Failure::unusable(reasons::of_second_bridge(
                instance.worm(),
                other.pid,
                RoleLock::<BridgeRole>::note(instance).as_deref(),
            )),
            error => Failure::unusable(error),
        })
    };
    instances.into_iter().map(role).collect()
}

/// Opens the network, once this computer has the addresses: at power-up its network may take longer than its programs. None at the end.
fn open_when_possible<T>(
    listen: &str,
    open: impl Fn() -> Result<T, String>,
    end: &AtomicBool,
    round: &impl Fn(),
) -> Result<Option<T>, Failure> {
    let mut is_told = false;
    while !end.load(Ordering::Relaxed) {
        let why = match open() {
            Ok(network) => {
                if is_told {
                    tracing::warn!("{listen}: the address is there, and laptops can connect");
                }
                return Ok(Some(network));
            }
            Err(why) => link_log::essence(&why),
        };
        if !reasons::is_address_missing(&why) {
            return Err(Failure::unusable(reasons::of_listening(listen, &why)));
        }
        if !is_told {
            is_told = true;
            tracing::warn!(
                "listening at {listen}: {why}: this computer does not have the address yet, and it is tried again until it has; 0.0.0.0 \
                 means all of its addresses"
            );
        }
        let begun = Instant::now();
        while begun.elapsed() < LISTEN_RETRY && !end.load(Ordering::Relaxed) {
            round();
            std::thread::sleep(Duration::from_millis(POLL_MS.into()));
        }
    }
    Ok(None)
}

struct Bridge {
    /// Common name of its certificate.
    robot: String,
    /// Certificates that may drive.
    drive: BTreeSet<String>,
    worms: Vec<Served>,
    network: Network,
    remotes: BTreeMap<Party, Remote>,
    /// The refused requests that the worms' records get.
    refusals: Refusals,
    clock: ClockWatch,
    looked: Instant,
    /// Why a connection was refused, as that was said last.
    refused: Option<(Instant, String)>,
    beaten: Instant,
    /// Begins elsewhere at each start, so that no stream has the number of another.
    next_stream: u64,
}

impl Bridge {
    fn turn(&mut self) -> Result<(), Failure> {
        self.wait()?;
        // What comes within this time is one turn: twenty relays do not tick together.
        std::thread::sleep(GATHER);
        let now_ns = monotonic_ns();
        let messages: Vec<_> = self.network.messages().collect();
        for (party, bytes) in messages {
            self.take(party, &bytes, now_ns);
        }
        self.look_around();
        let is_beat = self.beaten.elapsed() >= BEAT;
        if is_beat {
            self.beaten = Instant::now();
        }
        let beat = self.standing();
        let network = &self.network;
        let robot = &self.robot;
        self.remotes.retain(|party, remote| {
            if remote.silence() >= GONE {
                note(robot, &format!("{} has gone", party.certificate));
                return false;
            }
            remote.exchange();
            if is_beat {
                remote.beat(beat.clone());
            }
            loop {
                match remote.backlog.next(monotonic_ns()) {
                    Ok(Some(piece)) => network.send(party, piece),
                    Ok(None) => return true,
                    Err(error) => tracing::error!("a message cannot be written: {error}"),
                }
            }
        });
        Ok(())
    }

    fn wait(&self) -> Result<(), Failure> {
        let streams = self.remotes.values().flat_map(Remote::streams);
        let mut waiting: Vec<_> = std::iter::once(self.network.woken())
            .chain(streams)
            .map(|stream| PollFd::new(stream.as_fd(), PollFlags::POLLIN))
            .collect();
        match poll(&mut waiting, PollTimeout::from(POLL_MS)) {
            Ok(_) | Err(nix::errno::Errno::EINTR) => Ok(()),
            Err(errno) => Err(Failure::failed(format!(
                "the bridge cannot wait for its relays: {errno}"
            ))),
        }
    }

    fn take(&mut self, party: Party, bytes: &[u8], now_ns: u64) {
        if bytes.len() > MAX_UP {
            return tracing::warn!("{} sends too much at once", party.certificate);
        }
        let up: Up = match serde_json::from_slice(bytes) {
            Ok(up) => up,
            Err(error) => return tracing::warn!("{} sends what cannot be read: {error}", party.certificate),
        };
        if up.version > VERSION {
            return tracing::warn!(
                "{} speaks version {} and this bridge {VERSION}: use the same wormd on both ends",
                party.certificate,
                up.version
            );
        }
        if !self.remotes.contains_key(&party) {
            let of_one = self
                .remotes
                .keys()
                .filter(|other| other.certificate == party.certificate)
                .count();
            if self.remotes.len() >= MAX_REMOTES || of_one >= MAX_OF_ONE {
                return tracing::warn!("{}: too many are connected", party.certificate);
            }
            let may_drive = self.drive.contains(&party.certificate);
            let what = if may_drive { "may drive" } else { "may watch and hold" };
            note(&self.robot, &format!("{} has come, and {what}", party.certificate));
            let stream = self.stream();
            let mut remote = Remote::new(party.clone(), may_drive, stream, &self.worms);
            // Before anything else: the laptop is to know which worms there are.
            remote.beat(self.standing());
            self.remotes.insert(party.clone(), remote);
        }
        let stream = self.stream();
        if let Some(remote) = self.remotes.get_mut(&party)
            && remote.take(up, &self.worms, &mut self.refusals, now_ns)
        {
            remote.restart(stream, &self.worms);
        }
    }

    /// How the bridge stands.
    fn standing(&self) -> Beat {
        Beat {
            version: VERSION,
            wormd: env!("CARGO_PKG_VERSION").to_owned(),
            bridge: Some(format!("{}-{}", self.clock.status().boot_id, std::process::id())),
            worms: self.worms.iter().map(|worm| worm.name.clone()).collect(),
            may_drive: false,
            round_trip_ms: None,
            clock: self.clock.status().clone(),
        }
    }

    fn stream(&mut self) -> u64 {
        self.next_stream += 1;
        self.next_stream
    }

    fn look_around(&mut self) {
        if self.looked.elapsed() < LOOK {
            return;
        }
        self.looked = Instant::now();
        if let Some(step) = self.clock.look() {
            let text = format!("wall time was set by {:+.3} s", step.step_ns as f64 * 1e-9);
            note(&self.robot, &text);
        }
        if let Some(said) = link_log::take_refused() {
            let text = reasons::of_refusal(&said);
            let is_known = |(since, known): &(Instant, String)| *known == text && since.elapsed() < REFUSALS;
            if !self.refused.as_ref().is_some_and(is_known) {
                tracing::warn!("{text}");
                syslog::write("wormd-bridge", &self.robot, &text);
                self.refused = Some((Instant::now(), text));
            }
        }
    }
}

/// Puts a line into the computer's log and on standard error.
fn note(robot: &str, text: &str) {
    tracing::info!("{text}");
    syslog::write("wormd-bridge", robot, text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn an_address_that_is_not_there_yet_is_waited_for_and_nothing_else() {
        let (attempts, rounds, end) = (Cell::new(0), Cell::new(0), AtomicBool::new(false));
        let round = || rounds.set(rounds.get() + 1);
        let at_second = || {
            attempts.set(attempts.get() + 1);
            let missing = "10.9.9.9:7447: Cannot assign requested address (os error 99) at /x.rs:1.";
            (attempts.get() > 1).then_some(()).ok_or_else(|| missing.to_owned())
        };
        let opened = open_when_possible("tls/10.9.9.9:7447", at_second, &end, &round);
        assert!(matches!(opened, Ok(Some(()))));
        assert!(rounds.get() > 1, "the watchdog hears of it meanwhile");

        let taken = || Err::<(), _>("a: Address already in use (os error 98)".to_owned());
        let failure = open_when_possible("tls/a:1", taken, &end, &round).expect_err("is taken");
        assert!(matches!(failure, Failure::Unusable(_)), "{failure}");
        end.store(true, Ordering::Relaxed);
        assert!(matches!(open_when_possible("tls/a:1", taken, &end, &round), Ok(None)));
    }
}
