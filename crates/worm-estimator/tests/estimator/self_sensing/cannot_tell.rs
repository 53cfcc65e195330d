//! Changes that the current does not understand: what is said of the advance and the place must allow for the truth.

use super::plant::Plant;
use super::{any_cell, crawl, seeds, worm_of};
use worm_estimator::self_sensing::{Changes, SelfSensing};

/// Cycles before the change, and from it on to the end.
const USUAL: usize = 12;
const CHANGED: usize = 10;
/// Most standard errors by which a figure may be off.
const MOST_SIGMAS: f64 = 2.5;

/// By how many standard errors advance and place are off at the end, where the change is seen.
fn off(plant: &mut Plant, sensing: &mut SelfSensing, is_seen: impl Fn(&Changes) -> bool) -> Option<[f64; 2]> {
    crawl(plant, sensing, CHANGED, |_, _| {});
    let sensed = *sensing.sensed().expect("cycles were seen");
    let [.., before, _, _, _, after] = &plant.milestones[..] else {
        return None;
    };
    let advance_m = (after.position_m - before.position_m) / 4.0;
    let reckoned = sensing.reckoned();
    is_seen(&sensed.changes).then(|| {
        [
            (sensed.figures.advance_m - advance_m) / sensed.figures_sigma.advance_m,
            (reckoned.position_m - after.position_m) / reckoned.sigma_m,
        ]
    })
}

#[test]
fn stiffer_gears_and_jams_leave_advance_and_place_open() {
    let seeds = seeds(6);
    let mut seen = [0; 3];
    for seed in seeds.clone() {
        let (drawn, mut usual, mut sensing) = worm_of(seed);
        crawl(&mut usual, &mut sensing, USUAL, |_, _| {});
        let cell = any_cell(&drawn);
        let stuck = drawn.worm.clone().with_stroke_scale(cell, 0.0);
        let stuck = stuck.expect("a stroke in range");
        for (case, seen) in ["gears × 1.4", "gears × 1.8", "a jam"].into_iter().zip(&mut seen) {
            let (mut plant, mut sensing) = (usual.clone(), sensing.clone());
            let off = match case {
                "a jam" => {
                    plant.change(stuck.clone());
                    off(&mut plant, &mut sensing, |changes| changes.jammed != 0)
                }
                gears => {
                    plant.stiffen_gears(if gears == "gears × 1.4" { 1.4 } else { 1.8 });
                    off(&mut plant, &mut sensing, |changes| changes.more_load)
                }
            };
            println!("seed {seed}, {case}: advance and place off by {off:.1?} standard errors");
            let Some(off) = off else { continue };
            *seen += 1;
            assert!(
                off.iter().all(|sigmas| sigmas.abs() < MOST_SIGMAS),
                "seed {seed}, {case}: {off:?}"
            );
        }
    }
    println!("seen of {}: {seen:?}", seeds.end - seeds.start);
    assert!(seen.iter().all(|&seen| seen > 0), "{seen:?}");
}
