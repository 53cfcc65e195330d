//! Recordings that no reader lets through are refused all the same, and the shortest that can be analysed has all its figures.

use super::{AnalysisError, RecordedRun, analyze};
use crate::experiment::{Simulation, simulate};
use crate::recording::Recording;
use worm_estimator::config::Config;

fn run(recording: &Recording) -> RecordedRun<'_> {
    RecordedRun::at_slope(recording, 0.0)
}

#[test]
fn recordings_of_a_few_samples_are_errors() {
    let whole = simulate(&Config::default(), &Simulation::default()).expect("it crawls");
    for samples in 0..=3 {
        for with_phase in [false, true] {
            let mut short = whole.clone();
            short.time_s.truncate(samples);
            short.position_m.iter_mut().for_each(|series| series.truncate(samples));
            short.gait_phase = short.gait_phase.filter(|_| with_phase);
            short.gait_phase.iter_mut().for_each(|phase| phase.truncate(samples));
            let error = analyze(&[run(&short)], &Config::default(), &mut |_| {}).expect_err("too short");
            assert!(
                matches!(error, AnalysisError::IdentifiedGait { .. }),
                "{samples} samples: {error}"
            );
        }
    }
    assert!(matches!(
        analyze(&[], &Config::default(), &mut |_| {}),
        Err(AnalysisError::NoRun)
    ));
}

/// Two cycles from the middle of one: a single whole cycle, which is not settled.
#[test]
fn without_a_settled_cycle_all_cycles_are_counted() {
    let mut recording = simulate(
        &Config::default(),
        &Simulation {
            slope_deg: 20.0,
            cycles: 3.6,
            ..Simulation::default()
        },
    )
    .expect("it crawls");
    let phase = recording.gait_phase.clone().expect("recorded");
    let begin = phase.partition_point(|&phase| phase < 1.5);
    recording.time_s.drain(..begin);
    recording
        .position_m
        .iter_mut()
        .for_each(|series| drop(series.drain(..begin)));
    recording.gait_phase = Some(phase[begin..].to_vec());
    let uphill = RecordedRun {
        slope_deg: 20.0,
        ..run(&recording)
    };
    let analysis = analyze(&[uphill], &Config::default(), &mut |_| {})
        .expect("two cycles")
        .remove(0);
    assert_eq!(analysis.cycles.len(), 1);
    assert!(!analysis.cycles[0].settled);
    // (8) and (9): what carries the worm's weight.
    assert!(
        (analysis.mass_estimate_kg.expect("on a slope") / 0.333 - 1.0).abs() < 0.2,
        "{analysis:?}"
    );
    assert!(
        analysis
            .warnings
            .iter()
            .any(|warning| warning.contains("over all cycles"))
    );
}
