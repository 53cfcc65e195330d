//! Time of the estimator: a tick without a sample, a tick with one, a tick in which a cycle ends.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use testkit::crawl::{Crawl, Scene, config_of, paper_worm};
use worm_estimator::estimate::Estimator;
use worm_estimator::message::State;
use worm_physics::{Contact, Worm};

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

criterion_group!(estimate, benches);
criterion_main!(estimate);
