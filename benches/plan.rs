//! Time of a design study on a route: the search of `wormd plan` over its grid, on all processors.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::path::Path;
use worm_estimator::config::Config;
use worm_plan::{Bounds, Route, Workbench, search};

/// Eight slopes, from a descent to a steep climb.
const ROUTE: &str = "length_m,slope_deg\n2,0\n1,10\n1,20\n0.5,30\n0.5,35\n1,-10\n1,-20\n1,5\n";

fn plan(criterion: &mut Criterion) {
    let route = Route::from_csv(ROUTE, Path::new("route.csv")).expect("a route");
    let unequal = "worm.max_deformation_m = [0.0020, 0.0011, 0.00175, 0.00215]\n";
    let bounds = Bounds {
        cells: vec![3, 4, 5, 6, 7, 8],
        cycle_s: [1.0, 10.0],
        stiffness_factor: [0.5, 4.0],
        steps: 32,
    };
    // Every design a mechanism of its own: nothing is shared between times of a gait cycle.
    let single_time = Bounds {
        cycle_s: [2.5, 2.5],
        steps: 200,
        ..bounds.clone()
    };
    let mut group = criterion.benchmark_group("plan");
    group.sample_size(10);
    for (name, toml, bounds) in [
        ("grid of 32 speeds, equal cells", "", &bounds),
        ("grid of 32 speeds, six orders of unequal cells", unequal, &bounds),
        (
            "one speed, each design a steady cycle on 8 slopes",
            unequal,
            &single_time,
        ),
    ] {
        let config = Config::from_toml(toml, Path::new("worm.toml")).expect("a valid configuration");
        let bench = Workbench::new(&config).expect("a worm");
        let designs = search(&bench, &route, bounds).expect("valid bounds").designs;
        group.throughput(Throughput::Elements(designs as u64));
        group.bench_function(format!("{name}, {designs} designs"), |bencher| {
            bencher.iter(|| search(black_box(&bench), &route, bounds));
        });
    }
    group.finish();
}

criterion_group!(benches, plan);
criterion_main!(benches);
