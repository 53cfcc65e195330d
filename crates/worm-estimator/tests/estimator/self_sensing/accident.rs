//! A loss of friction right behind a cycle that was odd for another reason.

use super::{any_cell, seeds, worm_of};

/// The current of a tenth of the cycle before the loss, as a share of what it is, and where in that cycle; the first is no accident.
const ACCIDENTS: [(f64, f64); 3] = [(1.0, 0.4), (0.6, 0.15), (1.5, 0.4)];
/// Where in its cycle the worm loses friction.
const FROM: [f64; 4] = [0.2, 0.4, 0.65, 0.9];
/// Cycles before the accident.
const USUAL: usize = 12;

/// The first cycle with less friction is odd as well, but where the loss began in the middle of it, it may show too little to have a name.
#[test]
fn a_loss_right_behind_an_accident_is_reported() {
    let seeds = seeds(5);
    for (share, at) in ACCIDENTS {
        let mut after = [0; 8];
        for seed in seeds.clone() {
            let (drawn, mut usual, mut sensing) = worm_of(seed);
            let cell = any_cell(&drawn);
            let mut wet = drawn.worm.clone();
            wet.scale_friction(Some(cell), 0.6);
            if wet.check_hold().is_err() {
                continue;
            }
            while usual.cycles() < USUAL {
                sensing.update(&usual.tick());
            }
            let accident = USUAL as f64 + at;
            for from in FROM {
                let (mut plant, mut sensing) = (usual.clone(), sensing.clone());
                let lost_at = USUAL as f64 + 1.0 + from;
                let mut is_wet = false;
                let mut reported = None;
                while plant.cycles() < USUAL + 9 && reported.is_none() {
                    let mut sample = plant.tick();
                    if (accident..accident + 0.1).contains(&sample.phase) {
                        sample.current_a *= share;
                    }
                    if sample.phase >= lost_at && !is_wet {
                        plant.change(wet.clone());
                        is_wet = true;
                    }
                    let sensed = sensing.update(&sample);
                    if sensed.is_some_and(|sensed| sensed.changes.friction_lost == 1 << cell) {
                        reported = Some((sample.phase - lost_at).max(0.0) as usize);
                    }
                }
                after[reported.unwrap_or(7).min(7)] += 1;
            }
        }
        println!(
            "worms from seed {}, current × {share}: whole cycles until a loss of 40 % is reported, from 0; seven or more: {after:?}",
            seeds.start
        );
        let (all, late): (u32, u32) = (after.iter().sum(), after[4..].iter().sum());
        assert!(all > 0 && after[7] == 0 && 20 * late <= all, "{after:?}");
    }
}
