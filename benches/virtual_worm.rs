//! What a step of the virtual worm costs.

use criterion::{Criterion, criterion_group, criterion_main};
use std::f64::consts::TAU;
use worm_estimator::config::Config;
use wormd::link::virtual_worm::Plant;
use wormd::link::virtual_worm::motor::{Drive, Gains};

/// Time of a gait cycle, s.
const CYCLE_S: f64 = 2.5;

/// The virtual worm's motor, body and camera together: a hundred simulated hours need it to be fast.
fn plant(criterion: &mut Criterion) {
    let gains = Gains {
        velocity_p: 0.0663,
        velocity_i: 11.5,
        position_p: 1.15,
        duty_limit: 1.0,
    };
    let mut plant = Plant::new(&Config::default(), Some(1)).expect("the paper's worm");
    plant.set_drive(Drive::Velocity(TAU / CYCLE_S), gains);
    criterion.bench_function("a step of the virtual worm's plant", |bencher| {
        bencher.iter(|| plant.step().expect("it holds"));
    });
}

criterion_group!(benches, plant);
criterion_main!(benches);
