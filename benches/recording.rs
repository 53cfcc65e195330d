//! Time to open an hour of recording: 432,000 samples of 4 cells with their phase, as text and as motion capture.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::fmt::Write;
use std::hint::black_box;
use worm_analysis::experiment::{Simulation, simulate};
use worm_analysis::recording::{OpenOptions, Recording, open, write_csv};
use worm_estimator::config::Config;

/// The same as Vicon Nexus exports it, mm along X.
fn as_vicon(recording: &Recording) -> String {
    let mut text = "Trajectories\n120\n,,c1,,,c2,,,c3,,,c4,,\nFrame,Sub Frame".to_owned();
    text.push_str(&",X,Y,Z".repeat(4));
    text.push_str("\n,");
    text.push_str(&",mm,mm,mm".repeat(4));
    text.push('\n');
    for sample in 0..recording.samples() {
        write!(text, "{},0", sample + 1).expect("a string");
        for series in &recording.position_m {
            let along_mm = series[sample] * 1e3;
            if along_mm.is_nan() {
                text.push_str(",,,");
            } else {
                write!(text, ",{along_mm:.4},12.3456,-1.2345").expect("a string");
            }
        }
        text.push('\n');
    }
    text
}

fn recording(criterion: &mut Criterion) {
    let hour = Simulation {
        cycles: 3600.0 / 2.5,
        dropout_share: 0.01,
        ..Simulation::default()
    };
    let hour = simulate(&Config::default(), &hour).expect("the paper's worm crawls");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut csv = Vec::new();
    write_csv(&hour, &mut csv).expect("memory can be written");
    let mut group = criterion.benchmark_group("an hour at 120 Hz");
    group.sample_size(10);
    for (name, bytes) in [("CSV", csv), ("Vicon CSV", as_vicon(&hour).into_bytes())] {
        let path = folder.path().join("hour.csv");
        std::fs::write(&path, &bytes).expect("a temporary file can be written");
        group.throughput(Throughput::Bytes(bytes.len() as u64));
        group.bench_function(format!("open {name}"), |bencher| {
            bencher.iter(|| open(black_box(&path), &OpenOptions::default()).expect("it can be opened"));
        });
    }
    group.bench_function("write CSV", |bencher| {
        let mut text = Vec::new();
        bencher.iter(|| {
            text.clear();
            write_csv(black_box(&hour), &mut text)
        });
    });
    group.finish();
}

criterion_group!(benches, recording);
criterion_main!(benches);
