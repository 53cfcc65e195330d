//! What the exact motion costs: a whole gait cycle, and the increment of one tick of a 1 kHz loop.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use wormd::MAX_CELLS;
use wormd::model::{Contact, Motion, Worm, steady_cycle};

/// Phase that passes in 1 ms of a 2.5 s gait cycle.
const TICK: f64 = 1e-3 / 2.5;

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

criterion_group!(benches, model);
criterion_main!(benches);
