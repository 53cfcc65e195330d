//! A relay or a dashboard that stands still, as one that is suspended: a hold gets through, and nothing is done late.

use super::watched::{Watched, events};
use super::{ANN, BEARER, PATIENCE};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::io::Write;
use std::net::TcpStream;
use std::time::Duration;
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};

/// Longer than a request may wait.
const FROZEN: Duration = Duration::from_millis(2_500);

/// A process that stands still until this is dropped.
struct Frozen(Pid);

impl Frozen {
    fn new(pid: i32) -> Self {
        kill(Pid::from_raw(pid), Signal::SIGSTOP).expect("is alive");
        Self(Pid::from_raw(pid))
    }

    /// The relay of a worm.
    fn relay(watched: &Watched) -> Self {
        let lock = std::fs::read_to_string(watched.worm.folder().join("relay.lock")).expect("there is a relay");
        Self::new(lock.trim().parse().expect("its process"))
    }
}

impl Drop for Frozen {
    fn drop(&mut self) {
        // A worm that has ended took its relay with it.
        let _ = kill(self.0, Signal::SIGCONT);
    }
}

fn crawl(watched: &Watched) {
    super::wait_for("it crawls", PATIENCE, || {
        let is_taken = watched.worm.order(CommandKind::Crawl) == CommandOutcome::Accepted;
        is_taken
            && watched
                .worm
                .state()
                .is_some_and(|state| state.mode == Mode::Crawling.code())
    });
}

fn wait_until_it_holds(watched: &Watched) {
    super::wait_for("it holds", PATIENCE, || {
        watched
            .worm
            .state()
            .is_some_and(|state| state.mode == Mode::Holding.code())
    });
}

#[test]
fn a_frozen_relay_or_dashboard_does_nothing_late() {
    let watched = Watched::start("d-late");
    watched.arm(ANN);
    crawl(&watched);
    watched.worm.order(CommandKind::Hold);
    wait_until_it_holds(&watched);

    let (frozen, address) = (Frozen::relay(&watched), watched.address);
    let refused = std::thread::scope(|scope| {
        let asked = scope.spawn(|| super::request(address, "POST", "/api/command/crawl", &[BEARER, ANN], ""));
        std::thread::sleep(FROZEN);
        drop(frozen);
        asked.join().expect("an answer")
    });
    assert_eq!((refused.status, &refused.json()["verdict"]), (504, &"stale".into()));
    assert!(refused.body.contains("ask again"), "{refused:?}");
    watched.worm.assert_does_not_crawl();

    // The client has gone before the dashboard goes on.
    let frozen = Frozen::new(watched.dashboard.0.id() as i32);
    let mut client = TcpStream::connect(watched.address).expect("listens");
    let head = format!(
        "POST /api/command/crawl HTTP/1.1\r\nHost: {}\r\n{BEARER}\r\n{ANN}\r\n",
        watched.address
    );
    client
        .write_all(format!("{head}Content-Length: 0\r\n\r\n").as_bytes())
        .expect("there is room");
    drop(client);
    std::thread::sleep(FROZEN);
    drop(frozen);
    watched.worm.assert_does_not_crawl();
    let events = events(&watched);
    let accepted = events.iter().filter(|event| event.contains("crawl accepted"));
    assert!(accepted.clone().all(|event| !event.contains("ann")), "{events:?}");
}

#[test]
fn a_hold_goes_past_a_frozen_relay() {
    let watched = Watched::start("d-past");
    watched.arm(ANN);
    crawl(&watched);
    let frozen = Frozen::relay(&watched);
    let held = watched.post("hold", &[]);
    wait_until_it_holds(&watched);
    assert_eq!(
        (held.status, &held.json()["mode"]),
        (200, &"holding".into()),
        "{held:?}"
    );
    assert!(
        held.body.contains("went past it, straight to the controller"),
        "{held:?}"
    );

    // All worms of this computer at once.
    crawl(&watched);
    let held = super::request(watched.address, "POST", "/api/fleet/hold", &[], "");
    wait_until_it_holds(&watched);
    assert_eq!(held.json()["worms"][0]["verdict"], "accepted", "{held:?}");
    drop(frozen);
}
