//! Time of the motions: a whole gait cycle and the increment of one tick of a 1 kHz loop, exact and incremental.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use worm_physics::MAX_CELLS;
use worm_physics::{Contact, Crawl, Mechanics, Motion, Physics, Worm, steady_cycle};

/// Time of a gait cycle, s.
const CYCLE_S: f64 = 2.5;
/// Phase that passes in 1 ms of it.
const TICK: f64 = 1e-3 / CYCLE_S;
/// Damping ratio of a body with mass, as identified from recordings.
const DAMPING_RATIO: f64 = 0.1;

fn model(criterion: &mut Criterion) {
    let paper = Worm::paper();
    let largest = Worm::uniform(MAX_CELLS, Contact::symmetric(980.0, 1.75e-3), 1.332, 11.5e-3).expect("a valid worm");
    for worm in [&paper, &largest] {
        let cells = worm.cells();
        for (name, increment) in [("gait cycle", 1.0), ("1 ms increment", TICK)] {
            let mut motion = Motion::at_rest(worm, &[0.0; MAX_CELLS][..cells]);
            criterion.bench_function(&format!("{name}, {cells} cells"), |bencher| {
                bencher.iter(|| {
                    let phase = motion.phase() + increment;
                    motion.advance_to(black_box(worm), phase).expect("it holds");
                });
            });
            black_box(&motion);
        }
    }
    let climbing = paper.with_slope_rad(45f64.to_radians()).expect("a valid slope");
    criterion.bench_function("steady cycle at 45°, 4 cells", |bencher| {
        bencher.iter(|| steady_cycle(black_box(&climbing)))
    });
}

/// The incremental motion; a cycle is 400 increments, with mass 596.
fn incremental(criterion: &mut Criterion) {
    let linear = Physics::of(Worm::paper());
    let mut curved = linear.clone();
    curved.laws.hardening = 0.5;
    curved.laws.creep_share = 0.3;
    let motions = [
        ("quasi-static", &linear, None),
        ("with inertia", &linear, Some(DAMPING_RATIO)),
        ("with inertia, pads that harden and creep", &curved, Some(DAMPING_RATIO)),
    ];
    for (name, physics, damping_ratio) in motions {
        let mechanics = Mechanics::new(physics);
        for (span, increment) in [("gait cycle", 1.0), ("1 ms increment", TICK)] {
            let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.0; 4], damping_ratio).expect("it holds");
            criterion.bench_function(&format!("incremental {span}, 4 cells, {name}"), |bencher| {
                bencher.iter(|| {
                    let phase = crawl.phase() + increment;
                    let duration_s = increment * CYCLE_S;
                    crawl
                        .advance_to(black_box(&mechanics), phase, duration_s)
                        .expect("it holds");
                });
            });
            black_box(&crawl);
        }
    }
}

criterion_group!(benches, model, incremental);
criterion_main!(benches);
