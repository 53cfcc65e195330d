//! How many drawn worms come home, with how much left, and what their reserve is good for.

use crate::world::World;
use worm_estimator::config::Trip;
use worm_estimator::message::{TripPhase, TripReason};

const WORMS: usize = 400;
/// A worm that came home from a turn for energy, with so much more than its reserve, turned back too early.
const EARLY_SHARE: f64 = 0.2;

#[derive(Debug, Default)]
struct Outcome {
    worms: usize,
    home: usize,
    by_energy: usize,
    early: usize,
    off_m: Vec<f64>,
    left_shares: Vec<f64>,
}

fn make_trips(reserve_share: f64) -> Outcome {
    let mut outcome = Outcome::default();
    let mut seed = 0;
    while outcome.worms < WORMS {
        seed += 1;
        let trip = Trip {
            reserve_share,
            ..Trip::default()
        };
        let Some(mut world) = World::draw(seed, trip) else {
            continue;
        };
        outcome.worms += 1;
        let mut turned_for_energy = false;
        while !world.is_over() && world.now_ns < 1_000_000_000_000_000 {
            world.step();
            if world.now_ns % 10_000_000_000 == 0 {
                let status = world.status();
                turned_for_energy |= status.reason == TripReason::Energy.code();
            }
        }
        let status = world.status();
        let is_home = !world.is_dead && status.phase == TripPhase::Done.code() && world.place_m.abs() < 0.1;
        if !is_home {
            println!(
                "seed {seed}: not home: dead {}, phase {}, reason {}, at {:.3} m, share {:.3}",
                world.is_dead, status.phase, status.reason, world.place_m, world.share
            );
            continue;
        }
        outcome.home += 1;
        outcome.off_m.push(world.place_m.abs());
        if turned_for_energy {
            outcome.by_energy += 1;
            outcome.left_shares.push(world.share);
            outcome.early += usize::from(world.share > reserve_share + EARLY_SHARE);
        }
    }
    outcome.left_shares.sort_by(f64::total_cmp);
    outcome.off_m.sort_by(f64::total_cmp);
    outcome
}

fn report(reserve_share: f64, outcome: &Outcome) {
    let left = |quantile: f64| {
        let last = outcome.left_shares.len().saturating_sub(1);
        100.0
            * outcome
                .left_shares
                .get((quantile * last as f64) as usize)
                .copied()
                .unwrap_or(f64::NAN)
    };
    println!(
        "reserve {:.0} %: {} of {} home; {} turned for energy, with {:.1} / {:.1} / {:.1} % left (5, 50, 95 % of them), {} too early; off home by at most {:.1} mm",
        100.0 * reserve_share,
        outcome.home,
        outcome.worms,
        outcome.by_energy,
        left(0.05),
        left(0.5),
        left(0.95),
        outcome.early,
        1e3 * outcome.off_m.last().copied().unwrap_or_default(),
    );
}

/// With the default reserve 99 % come home, and few turn back too early.
#[test]
fn worms_come_home() {
    let reserve_share = Trip::default().reserve_share;
    let outcome = make_trips(reserve_share);
    report(reserve_share, &outcome);
    assert!(outcome.home * 100 >= outcome.worms * 99, "{outcome:?}");
    assert!(outcome.by_energy * 4 >= outcome.worms, "the battery decides often");
    assert!(outcome.early * 10 <= outcome.by_energy, "{outcome:?}");
}

/// Worms that nobody sees come home alive as often, and are where they say, as far as they say.
#[test]
fn worms_without_a_tracker_come_home_within_their_error() {
    let (mut worms, mut home, mut inside, mut turned) = (0_usize, 0, 0, 0);
    let mut off_shares = Vec::new();
    let mut seed = 0;
    while worms < WORMS {
        seed += 1;
        let Some(mut world) = World::draw_without_tracker(seed, Trip::default()) else {
            continue;
        };
        worms += 1;
        let mut is_for_energy = false;
        while !world.is_over() && world.now_ns < 1_000_000_000_000_000 {
            world.step();
            if world.now_ns % 10_000_000_000 == 0 {
                is_for_energy |= world.status().reason == TripReason::Energy.code();
            }
        }
        let status = world.status();
        turned += usize::from(is_for_energy);
        if world.is_dead || status.phase != TripPhase::Done.code() {
            println!(
                "seed {seed}: dead {}, phase {}, reason {}",
                world.is_dead, status.phase, status.reason
            );
            continue;
        }
        home += 1;
        let off_m = world.place_m - status.position_m;
        inside += usize::from(off_m.abs() <= 1.645 * status.position_sigma_m);
        off_shares.push(off_m.abs() / world.furthest_m);
    }
    off_shares.sort_by(f64::total_cmp);
    println!(
        "{home} of {worms} home, {turned} turned for energy; {inside} within 90 % intervals; off by {:.1} / {:.1} % of the way out (50, 95 % of them)",
        100.0 * off_shares[off_shares.len() / 2],
        100.0 * off_shares[off_shares.len() * 95 / 100],
    );
    assert!(home * 100 >= worms * 99);
    assert!(turned * 4 >= worms, "the battery decides often");
    assert!(inside * 100 >= home * 85, "stated errors are not too small");
}

/// What each reserve would do. Not a test: `cargo test --release -p worm-plan --test trips reserves -- --ignored --nocapture`.
#[test]
#[ignore = "prints a table for the choice of the reserve"]
fn reserves() {
    for reserve_share in [0.0, 0.02, 0.05, 0.1, 0.15] {
        report(reserve_share, &make_trips(reserve_share));
    }
}
