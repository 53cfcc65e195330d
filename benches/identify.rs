//! Time of the identification: the gait of a recording, the paper's exhaustive search, and the whole analysis.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use worm_analysis::experiment::{RecordedRun, Simulation, analyze, simulate};
use worm_analysis::identify::{IdentifiedGait, Prior, gait, search};
use worm_analysis::recording::Recording;
use worm_estimator::config::Config;

/// Largest tip deformations that the paper identified, m, and those it saw by eye, around which it searched.
const IDENTIFIED_M: [f64; 4] = [2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3];
const BY_EYE_M: [f64; 4] = [1.9e-3, 1.4e-3, 2.05e-3, 2.15e-3];
const STIFFNESS_N_PER_M: [f64; 4] = [980.0; 4];

fn recording(simulation: Simulation) -> Recording {
    simulate(&Config::default(), &simulation).expect("the paper's worm crawls")
}

fn gait_of(recording: &Recording, filled_m: &[Vec<f64>]) -> IdentifiedGait {
    let prior = Prior {
        step_order: &[0, 1, 2, 3],
        phase: recording.gait_phase.as_deref(),
    };
    gait::find(&recording.time_s, &recording.position_m, filled_m, prior).expect("the paper's worm has a gait")
}

fn identify(criterion: &mut Criterion) {
    // The search leaves the first cycle out: ten cycles of 300 samples remain.
    let level = recording(Simulation {
        cycles: 11.0,
        max_deformation_m: Some(IDENTIFIED_M.to_vec()),
        ..Simulation::default()
    });
    let level_m = level.filled();
    let level_gait = gait_of(&level, &level_m);
    let uphill = recording(Simulation {
        slope_deg: 30.0,
        cycles: 12.0,
        dropout_share: 0.05,
        positions_only: true,
        ..Simulation::default()
    });
    let uphill_m = uphill.filled();
    let run = RecordedRun::at_slope(&uphill, 30.0);
    let mut group = criterion.benchmark_group("identify");
    group.sample_size(10);
    group.bench_function("search 2401 candidates over 10 cycles", |bencher| {
        bencher.iter(|| search::search(black_box(&level_m), &level_gait, &BY_EYE_M, &STIFFNESS_N_PER_M, 0.0));
    });
    group.bench_function("find the gait of 12 cycles by positions", |bencher| {
        bencher.iter(|| gait_of(black_box(&uphill), &uphill_m));
    });
    group.bench_function("analyze 12 cycles at 30 degrees by positions", |bencher| {
        bencher.iter(|| analyze(&[black_box(run)], &Config::default(), &mut |_| {}).expect("it can be analysed"));
    });
    group.finish();
}

criterion_group!(benches, identify);
criterion_main!(benches);
