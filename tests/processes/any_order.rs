//! Processes of a worm are killed, suspended and restarted in any order; it always crawls again, and nothing is left behind.

use super::process::{Process, wait_for};
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::time::Duration;
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};

const ROUNDS: usize = 8;

/// Does what the worm's mode asks for until it crawls: a person with `wormd command` would do the same.
pub fn make_crawl_again(worm: &Worm) {
    wait_for("it crawls again", PATIENCE, || {
        let Some(mode) = worm.state().and_then(|state| Mode::try_from(state.mode).ok()) else {
            return false;
        };
        let order = match mode {
            Mode::Crawling => return true,
            Mode::Disarmed => CommandKind::Arm,
            Mode::Fault => CommandKind::Reset,
            Mode::Armed | Mode::Holding => CommandKind::Crawl,
            Mode::Stopping => return false,
        };
        if worm.order(order) != CommandOutcome::Accepted {
            // Its cause is still there, as a device that has just come back.
            std::thread::sleep(Duration::from_millis(100));
        }
        false
    });
}

fn record(worm: &Worm, file: &str) -> Process {
    worm.wormd(&["record", "--out", file, "--force"]).start()
}

#[test]
fn processes_end_and_start_in_any_order() {
    let seed = 4;
    println!("seed {seed}");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("log.mcap").to_string_lossy().into_owned();
    let mut crawling = Crawling::start_again(Worm::on_a_steady_computer("order"));
    let mut recorder = record(&crawling.worm, &file);
    for round in 0..ROUNDS {
        let which = random.random_range(0..4);
        let is_killed = random.random_bool(0.6);
        println!(
            "round {round}: process {which} {}",
            if is_killed { "killed" } else { "suspended" }
        );
        let process = match which {
            0 => &mut crawling.controller,
            1 => &mut crawling.estimator,
            2 => &mut crawling.virtual_worm,
            _ => &mut recorder,
        };
        if is_killed {
            if which == 2 {
                crawling.kill_virtual_worm();
            } else {
                process.kill();
            }
            std::thread::sleep(Duration::from_millis(random.random_range(0..300)));
            let worm = &crawling.worm;
            match which {
                0 => crawling.controller = worm.wormd(&["control", "--port", &worm.port()]).start(),
                1 => crawling.estimator = worm.wormd(&["estimate"]).start(),
                2 => crawling.virtual_worm = worm.virtual_worm(&[]),
                _ => recorder = record(worm, &file),
            }
        } else {
            process.pause(Duration::from_millis(random.random_range(50..900)));
        }
        make_crawl_again(&crawling.worm);
    }
    let Crawling {
        controller,
        estimator,
        virtual_worm,
        worm,
    } = crawling;
    // Not in the order in which they were started.
    for process in [virtual_worm, recorder, controller, estimator] {
        process.end();
    }
    worm.forget_topics();
    worm.wait_until_nothing_is_left();
}
