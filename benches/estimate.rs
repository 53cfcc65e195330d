//! Time of the estimator: a tick without a sample, a tick with one, a tick in which a cycle ends; and of self-sensing:
//! every tick of some cycles, the one in which it searches everywhere among them.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;
use testkit::crawl::{Crawl, Scene, config_of, paper_worm};
use worm_estimator::config::Config;
use worm_estimator::estimate::Estimator;
use worm_estimator::message::State;
use worm_estimator::self_sensing::{GearModel, MotorSample, SelfSensing};
use worm_physics::{Contact, Motion, Worm};

/// States of a crawl of some cycles, and an estimator that has seen the first of them.
fn prepared(worm: Worm, cycles: usize) -> (Estimator, Vec<State>) {
    let scene = Scene::default();
    let mut estimator = Estimator::new(&config_of(&worm, &scene)).expect("a valid configuration");
    let mut crawl = Crawl::new(worm, scene);
    for _ in 0..6_000 {
        estimator.update(&crawl.tick());
    }
    let states = (0..2_500 * cycles).map(|_| crawl.tick()).collect();
    (estimator, states)
}

fn benches(criterion: &mut Criterion) {
    let sixteen = Worm::uniform(16, Contact::symmetric(980.0, 1e-4), 1.0, 11.5e-3).expect("a worm");
    for (cells, worm) in [(4, paper_worm(30.0, true)), (16, sixteen)] {
        let (estimator, states) = prepared(worm, 4);
        // Within one step, so that no cycle ends: 1.4 s after 6 s, the third cycle is in its third step.
        let within = &states[200..400];
        let (sampled, plain): (Vec<State>, Vec<State>) = within.iter().partition(|state| state.sample_is_new == 1);
        for (name, chosen) in [("with a sample", &sampled), ("without a sample", &plain)] {
            criterion.bench_function(&format!("{cells} cells, {} ticks {name}", chosen.len()), |bencher| {
                bencher.iter_batched_ref(
                    || estimator.clone(),
                    |estimator| {
                        for state in chosen {
                            black_box(estimator.update(state));
                        }
                    },
                    BatchSize::LargeInput,
                );
            });
        }
        // Only the tick in which a cycle ends.
        let mut before_end = estimator.clone();
        let mut end = None;
        for state in &states {
            let mut trial = before_end.clone();
            if trial.update(state).cycle.is_some() {
                end = Some(*state);
                break;
            }
            before_end = trial;
        }
        let end = end.expect("a cycle ends");
        criterion.bench_function(&format!("{cells} cells, the end of a cycle"), |bencher| {
            bencher.iter_batched_ref(
                || before_end.clone(),
                |estimator| black_box(estimator.update(&end).cycle.is_some()),
                BatchSize::LargeInput,
            );
        });
    }
}

/// Readings of a motor that crawls through some cycles of 2.5 s.
fn motor_samples(worm: &Worm, gear: &GearModel, cycles: usize) -> Vec<MotorSample> {
    let velocity_rad_per_s = TAU / 2.5;
    let mut motion = Motion::at_rest(worm, &vec![0.0; worm.cells()]);
    let per_force = worm.cells() as f64 * worm.stroke_m() / TAU;
    let ticks = 0..2_500 * cycles;
    ticks
        .map(|tick| {
            let phase = tick as f64 / 2_500.0;
            motion.advance_to(worm, phase).expect("the worm holds");
            let cam_n_m = motion.actuator_force_n(worm) * per_force;
            let current_a = gear.motor_torque_n_m(cam_n_m, velocity_rad_per_s) / gear.torque_constant_n_m_per_a;
            MotorSample {
                time_s: tick as f64 * 1e-3,
                phase,
                angle_rad: TAU * phase,
                velocity_rad_per_s,
                current_a: (1e3 * current_a).round() * 1e-3,
                bus_voltage_v: 5.0,
                duty: 0.3,
                temperature_c: 25.0,
                pitch_rad: f64::NAN,
                stamp_ns: 0,
            }
        })
        .collect()
}

/// Cycles whose ticks are timed: the first search is over before the first of them, the second one is in it.
const TIMED_CYCLES: std::ops::Range<usize> = 2..6;
/// Runs of which the shortest time of each tick counts: the others were disturbed.
const RUNS: usize = 15;

fn self_sensing(criterion: &mut Criterion) {
    let config = Config::default().self_sensing();
    let sixteen = Worm::uniform(16, Contact::symmetric(980.0, 1e-4), 1.0, 11.5e-3).expect("a worm");
    for (cells, worm) in [(4, paper_worm(30.0, true)), (16, sixteen)] {
        let samples = motor_samples(&worm, &config.gear, 8);
        let mut shortest_ns = vec![f64::INFINITY; samples.len()];
        for _ in 0..RUNS {
            let mut sensing = SelfSensing::new(&worm, &config);
            for (shortest_ns, sample) in shortest_ns.iter_mut().zip(&samples) {
                let begun = Instant::now();
                black_box(sensing.update(sample));
                *shortest_ns = shortest_ns.min(begun.elapsed().as_nanos() as f64);
            }
        }
        for cycle in TIMED_CYCLES {
            let mut us: Vec<f64> = shortest_ns[2_500 * cycle..2_500 * (cycle + 1)]
                .iter()
                .map(|ns| ns * 1e-3)
                .collect();
            us.sort_by(f64::total_cmp);
            let busy = us.iter().filter(|us| **us > 0.5).count();
            println!(
                "{cells} cells, self-sensing, cycle {cycle}: mean {:.2} us a tick, longest {:.1}, 99 % below {:.1}; {busy} ticks with work",
                us.iter().sum::<f64>() / us.len() as f64,
                us[us.len() - 1],
                us[us.len() * 99 / 100],
            );
        }
        let mut sensing = SelfSensing::new(&worm, &config);
        for sample in &samples[..2_500 * 6] {
            black_box(sensing.update(sample));
        }
        criterion.bench_function(
            &format!("{cells} cells, self-sensing, an ordinary cycle of 2,500 ticks"),
            |bencher| {
                bencher.iter_batched_ref(
                    || sensing.clone(),
                    |sensing| {
                        for sample in &samples[2_500 * 6..2_500 * 7] {
                            black_box(sensing.update(sample));
                        }
                    },
                    BatchSize::LargeInput,
                );
            },
        );
    }
}

criterion_group!(estimate, benches, self_sensing);
criterion_main!(estimate);
