//! Self-sensing on the virtual worm: through the servo's registers and the controller, with tips and a slope that it is not told.

use super::harness::{config, crawling, wired};
use worm_estimator::config::Config;
use worm_estimator::self_sensing::{MotorSample, SelfSensed, SelfSensing};
use worm_physics::Worm;
use wormd::link::virtual_worm::{Options, PlantLedger};
use wormd::soak::Machine;

const DEFORMATIONS_M: [f64; 4] = [0.0020, 0.0011, 0.00175, 0.00215];
const CYCLES: usize = 12;

/// What is inferred after some cycles, with the position, and what was true.
fn infer(slope_deg: f64, seed: u64) -> (SelfSensed, f64, Vec<PlantLedger>) {
    let hidden = config(&format!(
        "worm.max_deformation_m = {DEFORMATIONS_M:?}\ncanal.slope_deg = {slope_deg}\nvirtual_worm.seed = {seed}\n"
    ));
    let told = Config::default();
    let worm = Worm::try_from(&told).expect("the worm of the paper");
    let mut sensing = SelfSensing::new(&worm, &told.self_sensing());
    let mut session = crawling(&hidden, wired(&hidden, &Options::default()), 1000.0);
    session.run_s(hidden.gait.cycle_s * (CYCLES as f64 + 0.5), |tick| {
        if tick.state.motor_is_new == 1 {
            sensing.update(&MotorSample::from(&tick.state));
        }
    });
    let sensed = *sensing.sensed().expect("cycles were seen");
    let truth = session.machine.plant().ledger().cycles().iter().cloned().collect();
    (sensed, sensing.reckoned().position_m, truth)
}

#[test]
fn the_virtual_worm_is_known_by_its_current() {
    for slope_deg in [0.0, 20.0] {
        for seed in 1..=2 {
            let (sensed, position_m, truth) = infer(slope_deg, seed);
            let off = |inferred: f64, of: fn(&PlantLedger) -> f64| {
                let mean = truth[1..].iter().map(of).sum::<f64>() / truth[1..].len() as f64;
                100.0 * (inferred / mean - 1.0)
            };
            let advance = off(sensed.figures.advance_m, |cycle| cycle.advance_m);
            let loss = off(sensed.figures.energy_loss_j, |cycle| cycle.loss_j);
            let electrical = off(sensed.electrical_j, |cycle| cycle.electrical_j);
            let slope = sensed.slope_rad.to_degrees() - slope_deg;
            let cells: Vec<f64> = (0..4)
                .map(|cell| 100.0 * (sensed.friction_n[cell] / (980.0 * DEFORMATIONS_M[cell]) - 1.0))
                .collect();
            println!(
                "{slope_deg}°, seed {seed}: friction {cells:.1?} %, slope {slope:+.1}°, advance {advance:+.1} %, losses {loss:+.1} %, electrical {electrical:+.1} %"
            );
            assert!(cells.iter().all(|error| error.abs() < 10.0));
            assert!(slope.abs() < 5.0 && advance.abs() < 10.0 && loss.abs() < 10.0 && electrical.abs() < 2.0);
            let travelled_m: f64 = truth.iter().map(|cycle| cycle.advance_m).sum();
            assert!(
                (position_m / travelled_m - 1.0).abs() < 0.15,
                "{position_m} m of {travelled_m}"
            );
        }
    }
}
