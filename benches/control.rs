//! The controller's tick alone: state machine, safety rules and message, without bus and topics.

#[expect(dead_code, reason = "of the hot paths this bench runs one")]
mod hot_paths;

use criterion::{Criterion, criterion_group, criterion_main};
use hot_paths::Crawling;

fn tick(criterion: &mut Criterion) {
    let mut crawling = Crawling::new();
    criterion.bench_function("controller tick while crawling", |bencher| {
        bencher.iter(|| crawling.tick());
    });
}

criterion_group!(benches, tick);
criterion_main!(benches);
