//! A change of the worm that is over: how soon that is known, and what is known of the worm then.

use super::{any_cell, crawl, seeds, worm_of};
use worm_estimator::self_sensing::Standing;

/// Cycles that a changed worm lasts: short and long enough for its own fit to be searched everywhere twice.
const LASTS: [usize; 3] = [3, 8, 20];

#[test]
fn what_is_over_is_soon_known_to_be() {
    let seeds = seeds(6);
    let mut changes = 0;
    let mut after = [0; 12];
    let mut moved: f64 = 0.0;
    for seed in seeds.clone() {
        let (drawn, mut usual, mut sensing) = worm_of(seed);
        let cell = any_cell(&drawn);
        crawl(&mut usual, &mut sensing, 12, |_, _| {});
        let mut wet = drawn.worm.clone();
        wet.scale_friction(Some(cell), 0.5);
        let dragged = drawn.worm.clone().with_resisting_force_n(1.0);
        for changed in [wet, dragged.expect("a force in range")] {
            if changed.check_hold().is_err() {
                continue;
            }
            for lasts in LASTS {
                let (mut plant, mut sensing) = (usual.clone(), sensing.clone());
                let friction_n = sensing.sensed().expect("twelve cycles").friction_n;
                plant.change(changed.clone());
                let mut is_reported = false;
                crawl(&mut plant, &mut sensing, lasts, |_, sensed| {
                    is_reported |= sensed.changes.any()
                });
                if !is_reported {
                    continue;
                }
                changes += 1;
                plant.change(drawn.worm.clone());
                let from = plant.cycles();
                let mut fitted = None;
                crawl(&mut plant, &mut sensing, 15, |plant, sensed| {
                    if sensed.standing == Standing::Fitted {
                        fitted.get_or_insert(plant.cycles() - from);
                    }
                });
                after[fitted.unwrap_or(11).min(11)] += 1;
                let now = sensing.sensed().expect("many cycles");
                for (before, now) in friction_n.iter().zip(now.friction_n).take(now.cells) {
                    moved = moved.max((now / before - 1.0).abs());
                }
            }
        }
    }
    println!(
        "{changes} changes of worms from seed {}: cycles after their end until the fit goes on, from 0: {after:?}; friction \
         differs from before by {:.1} % at most",
        seeds.start,
        100.0 * moved
    );
    let late: u32 = after[5..].iter().sum();
    assert!(changes > 0 && 20 * late <= changes, "{late} of {changes} late");
}
