//! A relay that is there and does nothing, as one that is suspended: anyone can still halt the worm, and nothing is done late.

use super::watching::{Client, Terminal, crawling_with_relay};
use super::{PATIENCE, Process};
use nix::sys::signal::Signal;
use std::time::{Duration, Instant};
use worm_estimator::message::{CommandKind, Mode};

/// Longer than a request may wait.
const FROZEN: Duration = Duration::from_millis(2_500);

/// A relay that stands still until this is dropped.
struct Frozen<'a>(&'a Process);

impl<'a> Frozen<'a> {
    fn new(relay: &'a Process) -> Self {
        relay.signal(Signal::SIGSTOP);
        Self(relay)
    }
}

impl Drop for Frozen<'_> {
    fn drop(&mut self) {
        self.0.signal(Signal::SIGCONT);
    }
}

#[test]
fn what_was_asked_of_a_frozen_relay_is_not_done_when_it_goes_on() {
    let (relay, crawling) = crawling_with_relay("w-frozen");
    crawling.worm.order(CommandKind::Hold);
    crawling.wait_for_mode(Mode::Holding);
    let mut terminal = Terminal::watch(&crawling.worm);
    let mut other = Client::connect(&crawling.worm);
    let frozen = Frozen::new(&relay);
    terminal.press("cc");
    std::thread::sleep(FROZEN);
    drop(frozen);
    terminal.wait_for("ago, when nobody answered: ask again");
    crawling.worm.assert_does_not_crawl();
    other.wait_for_record("stale", ": crawl");
}

#[test]
fn a_hold_goes_past_a_frozen_relay() {
    let (relay, crawling) = crawling_with_relay("w-past");
    let mut terminal = Terminal::watch(&crawling.worm);
    super::any_order::make_crawl_again(&crawling.worm);
    let frozen = Frozen::new(&relay);
    let pressed = Instant::now();
    terminal.press("h");
    crawling.wait_for_mode(Mode::Holding);
    println!(
        "with a frozen relay the worm held {:?} after the key",
        pressed.elapsed()
    );
    terminal.wait_for("went past it, straight to the controller");
    drop(frozen);
    assert!(pressed.elapsed() < PATIENCE);
}
