//! Which equal values are a fault, and which are the file's steps.

use super::leave_out;
use crate::experiment::{Simulation, simulate};
use crate::recording::Recording;
use worm_estimator::config::Config;

fn crawl(noise_m: f64) -> Recording {
    let simulation = Simulation {
        cycles: 6.0,
        noise_m,
        ..Simulation::default()
    };
    simulate(&Config::default(), &simulation).expect("it crawls")
}

/// Samples left out after a change of a recording with 0.1 mm of noise.
fn left_out(change: impl Fn(usize, f64) -> f64, freeze: usize) -> usize {
    let mut recording = crawl(1e-4);
    for series in &mut recording.position_m {
        for (sample, at_m) in series.iter_mut().enumerate() {
            *at_m = change(sample, *at_m);
        }
    }
    let frozen_m = recording.position_m[2][700];
    recording.position_m[2][700..700 + freeze].fill(frozen_m);
    leave_out(&mut recording).iter().map(|repair| repair.samples).sum()
}

#[test]
fn equal_values_are_left_out_where_chance_does_not_make_them() {
    let as_measured = |_, at_m| at_m;
    assert_eq!(left_out(as_measured, 1), 0);
    assert_eq!(left_out(as_measured, 4), 0, "four may be");
    assert_eq!(left_out(as_measured, 5), 5);
    // A neighbour may lie as near by chance.
    let found = left_out(as_measured, 40);
    assert!((40..44).contains(&found), "{found}");
    // In steps of a third of the noise, five in a row do come by chance and forty do not.
    let in_steps = |_, at_m: f64| (at_m / 3e-5).round() * 3e-5;
    assert_eq!(left_out(in_steps, 5), 0);
    let found = left_out(in_steps, 40);
    assert!((40..44).contains(&found), "{found}");
}

#[test]
fn files_that_cannot_tell_are_left_alone() {
    let coarse = |_, at_m: f64| (at_m / 2e-4).round() * 2e-4;
    assert_eq!(left_out(coarse, 60), 0, "steps of twice the noise");
    let mut held = crawl(1e-4);
    for series in &mut held.position_m {
        for sample in 0..series.len() {
            series[sample] = series[sample - sample % 8];
        }
    }
    assert_eq!(leave_out(&mut held), [], "each value held for eight samples");
    let mut exact = crawl(0.0);
    assert_eq!(leave_out(&mut exact), [], "without noise");
}

#[test]
fn values_that_hardly_vary_are_left_out() {
    let mut recording = crawl(1e-4);
    let frozen_m = recording.position_m[1][500];
    for (sample, at_m) in recording.position_m[1][500..530].iter_mut().enumerate() {
        *at_m = frozen_m + 2e-6 * (sample % 3) as f64;
    }
    let repairs = leave_out(&mut recording);
    assert_eq!(repairs.len(), 1);
    assert!((30..34).contains(&repairs[0].samples), "{repairs:?}");
}
