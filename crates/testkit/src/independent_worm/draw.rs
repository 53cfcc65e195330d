//! Worms drawn at random, and only such as crawl.

use super::body::Body;
use super::cam::{Cam, Drive};
use super::camera::Camera;
use super::scene::{STEP_S, Scene};
use crate::nominal::STROKE_M;
use crate::random::shuffle;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Least advance of a drawn worm, m for each cycle.
const MIN_ADVANCE_M: f64 = 1e-3;
/// Draws after which the ranges are to blame.
const MAX_DRAWS: usize = 1000;

/// A worm and a motor drawn at random that crawl on every one of the slopes, as one scene for each slope; the dice of the
/// motor and of the camera are thrown anew on each. Starts from rest, twelve cycles, the promised camera.
pub fn crawling(cells: usize, slopes_deg: &[f64], seed: u64) -> Vec<Scene> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    for _ in 0..MAX_DRAWS {
        let bound_m: Vec<f64> = (0..cells).map(|_| rng.random_range(0.8e-3..2.5e-3)).collect();
        let mut worm = Body::with_bounds(&bound_m, 0.0);
        worm.mass_kg *= rng.random_range(0.95..1.05);
        worm.damping_ratio = 10f64.powf(rng.random_range(-1.0..0.0));
        let mut step_order: Vec<usize> = (0..cells).collect();
        shuffle(&mut step_order, &mut rng);
        let cam = Cam::new(STROKE_M, step_order);
        let cycle_s = rng.random_range(1.5..4.0);
        let scenes: Vec<Scene> = slopes_deg
            .iter()
            .enumerate()
            .map(|(run, &slope_deg)| Scene {
                body: Body {
                    slope_deg,
                    ..worm.clone()
                },
                cam: cam.clone(),
                drive: uneven_motor(cycle_s, &mut rng),
                camera: Camera::default(),
                warm_up_cycles: 0.0,
                cycles: 12.0,
                rest_after_s: 0.0,
                seed: 1000 * seed + run as u64,
                step_s: STEP_S,
            })
            .collect();
        if scenes.iter().all(crawls) {
            return scenes;
        }
    }
    panic!("no worm of {cells} cells crawls at {slopes_deg:?} degrees");
}

/// A motor as uneven as real ones.
fn uneven_motor(cycle_s: f64, rng: &mut Xoshiro256PlusPlus) -> Drive {
    Drive {
        swing_per_step: rng.random_range(0.0..0.15),
        swing_per_turn: rng.random_range(0.0..0.1),
        wander: 0.01,
        angles_rad: std::array::from_fn(|_| rng.random_range(0.0..TAU)),
        ..Drive::even(cycle_s)
    }
}

/// Whether a worm holds on and advances in every cycle, its first settling apart.
fn crawls(scene: &Scene) -> bool {
    if !scene.body.holds() {
        return false;
    }
    let trial = Scene {
        camera: Camera::perfect(),
        cycles: 4.0,
        ..scene.clone()
    };
    trial.record().is_ok_and(|(_, truth)| {
        let mut settled = truth.cycles.iter().skip(1);
        settled.all(|cycle| cycle.balance.advance_m() >= MIN_ADVANCE_M)
    })
}
