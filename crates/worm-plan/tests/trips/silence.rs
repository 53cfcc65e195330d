//! Silences of drawn lengths on the trips of drawn worms: where the ghost has the worm, against where it is.

use crate::world::{Rng, World};
use worm_estimator::config::{OnLinkBack, OnLinkLoss, Trip};
use worm_plan::Ghost;

const WORMS: usize = 300;
const POLICIES: [OnLinkLoss; 3] = [OnLinkLoss::Hold, OnLinkLoss::Return, OnLinkLoss::Continue];

/// 90 % intervals hold 85 to 95 % of the places, whatever the trip does when its link is lost.
#[test]
fn ghosts_are_where_they_say() {
    let mut rng = Rng::new(7);
    for policy in POLICIES {
        let (mut inside, mut silences, mut errors_mm, mut seed) = (0, 0, Vec::new(), 0);
        let (mut arrivals, mut arrived_inside) = (0, 0);
        while silences < WORMS {
            seed += 1;
            let trip = Trip {
                link_loss: policy,
                link_timeout_s: 20.0,
                on_link_back: OnLinkBack::GoOn,
                ..Trip::default()
            };
            let Some(mut world) = World::draw(seed, trip) else {
                continue;
            };
            let mut ghost = Ghost::default();
            let from_s = rng.between(30.0, 600.0);
            let silent_s = rng.between(5.0, 600.0);
            let mut cycles = 0;
            let mut expected_s = None;
            while !world.is_over() && world.now_ns < ((from_s + silent_s) * 1e9) as u64 {
                world.step();
                world.link = world.now_ns < (from_s * 1e9) as u64;
                if world.link {
                    world.cycles[cycles..].iter().for_each(|cycle| ghost.note_cycle(cycle));
                    cycles = world.cycles.len();
                    let (status, state, estimate) = (world.status(), *world.state(), world.estimate());
                    ghost.hear(&state, &estimate, Some(&status), false, world.now_ns);
                    expected_s = status
                        .left_s
                        .is_finite()
                        .then_some([status.left_low_s, status.left_high_s]);
                }
            }
            if world.is_dead || world.now_ns < ((from_s + 5.0) * 1e9) as u64 {
                continue;
            }
            let (status, state, estimate) = (world.status(), *world.state(), world.estimate());
            let Some(score) = ghost.hear(&state, &estimate, Some(&status), false, world.now_ns) else {
                continue;
            };
            silences += 1;
            inside += usize::from(score.is_inside);
            errors_mm.push(1e3 * score.error_m.abs());
            // What goes on as planned is over when it was expected to be.
            if policy == OnLinkLoss::Continue
                && let Some([low_s, high_s]) = expected_s
            {
                while !world.is_over() {
                    world.step();
                }
                if !world.is_dead {
                    let took_s = world.now_ns as f64 * 1e-9 - from_s;
                    arrivals += 1;
                    arrived_inside += usize::from((low_s..=high_s).contains(&took_s));
                }
            }
        }
        errors_mm.sort_by(f64::total_cmp);
        let share = inside as f64 / silences as f64;
        println!(
            "{policy:?}: {:.1} % of {silences} places inside; error {:.1} mm in the median, {:.1} mm at 95 %",
            100.0 * share,
            errors_mm[silences / 2],
            errors_mm[silences * 95 / 100]
        );
        assert!((0.85..=0.95).contains(&share), "{policy:?}: {share}");
        if arrivals > 0 {
            println!(
                "{policy:?}: {:.1} % of {arrivals} arrivals inside",
                100.0 * arrived_inside as f64 / arrivals as f64
            );
        }
    }
}
