//! What no worm could have recorded, refused for its own reason.

use super::check;
use crate::experiment::{Simulation, simulate};
use crate::recording::{OpenOptions, Recording};
use worm_estimator::config::Config;

const NAN: f64 = f64::NAN;

/// A cycle at 40 Hz: 101 samples.
fn crawl() -> Recording {
    let simulation = Simulation {
        cycles: 1.0,
        rate_hz: 40.0,
        ..Simulation::default()
    };
    simulate(&Config::default(), &simulation).expect("the paper's worm crawls")
}

/// Checks the crawl after a change; the recording, or the error's text.
fn checked(change: impl Fn(&mut Recording)) -> Result<Recording, String> {
    let mut recording = crawl();
    change(&mut recording);
    check(&mut recording, &OpenOptions::default(), None)
        .map(|()| recording)
        .map_err(|error| error.to_string())
}

#[track_caller]
fn assert_refused(change: impl Fn(&mut Recording), expected: &str) {
    let error = checked(change).expect_err(expected);
    assert!(error.contains(expected), "{error}\nshould say: {expected}");
}

#[test]
fn a_crawl_passes_unchanged() {
    let recording = checked(|_| {}).expect("a crawl");
    assert_eq!(recording, crawl());
}

#[test]
fn what_no_worm_could_have_recorded_is_refused() {
    assert_refused(
        |recording| recording.cut(None, Some(0.2)),
        "there are 9 samples, and at least 10 are needed",
    );
    assert_refused(
        |recording| recording.position_m[1].fill(NAN),
        "cell 2 (x2_m) is never seen",
    );
    assert_refused(
        |recording| recording.position_m.iter_mut().for_each(|series| series.fill(NAN)),
        "no cell is ever seen",
    );
    assert_refused(
        |recording| recording.position_m[2][8] = -1e200,
        "cell 3 (x3_m) is at -1.0e200 m at 0.200 s: leave the field empty",
    );
    assert_refused(
        |recording| recording.time_s.iter_mut().for_each(|time_s| *time_s *= 1e20),
        "it lasts from 0.0e0 s to 2.5e20 s: give times in seconds",
    );
    assert_refused(
        |recording| recording.time_s[50..].iter_mut().for_each(|time_s| *time_s += 1.0),
        "there is no sample from 1.225 s to 2.250 s, while one comes every 0.0250 s otherwise: give --max-gap 1.1",
    );
    assert_refused(
        |recording| recording.position_m[3][40..50].fill(NAN),
        "cell 4 (x4_m) is not seen from 0.975 s",
    );
    let scale = |recording: &mut Recording| recording.position_m.iter_mut().flatten().for_each(|m| *m *= 1e3);
    assert_refused(
        scale,
        " m apart, which no worm does: the positions seem to be in millimetres",
    );
    let own_origin = |recording: &mut Recording| {
        scale(recording);
        for series in &mut recording.position_m {
            let first = series[0];
            series.iter_mut().for_each(|m| *m -= first);
        }
    };
    assert_refused(own_origin, "m against each other, which no worm does");
    assert_refused(
        |recording| {
            for series in &mut recording.position_m {
                let first = series[0];
                series.fill(first);
            }
        },
        "no cell moves beyond its noise",
    );
}

#[test]
fn too_short_a_cut_names_the_times_of_the_file() {
    let mut recording = crawl();
    recording.cut(Some(1.0), Some(1.1));
    let options = OpenOptions {
        from_s: Some(1.0),
        to_s: Some(1.1),
        ..OpenOptions::default()
    };
    let error = check(&mut recording, &options, Some((0.0, 2.5)))
        .expect_err("five samples")
        .to_string();
    assert!(error.contains("there are 5 samples between --from and --to"), "{error}");
    assert!(error.contains("here from 0.000 to 2.500 s"), "{error}");
}

#[test]
fn a_short_gap_in_the_phase_is_bridged_and_a_long_one_refused() {
    let lose = |range: std::ops::Range<usize>| {
        move |recording: &mut Recording| recording.gait_phase.as_mut().expect("recorded")[range.clone()].fill(NAN)
    };
    let bridged = checked(lose(20..24)).expect("0.125 s are bridged");
    let pairs = bridged
        .gait_phase
        .iter()
        .flatten()
        .zip(crawl().gait_phase.into_iter().flatten());
    for (bridged, truly) in pairs {
        assert!(
            (bridged - truly).abs() < 1e-12,
            "the cam turns evenly: {bridged} {truly}"
        );
    }
    assert_eq!(
        bridged.warnings,
        ["gait_phase is missing in 4 samples and was interpolated there"]
    );
    assert_refused(lose(20..30), "gait_phase: there is no phase from 0.500 s to 0.725 s");
    assert_refused(lose(0..1), "gait_phase: there is no phase from 0.000 s to 0.000 s");
    assert_refused(lose(100..101), "gait_phase: there is no phase from 2.500 s to 2.500 s");
}

#[test]
fn cells_in_reverse_order_are_warned_of() {
    let recording = checked(|recording| recording.position_m.reverse()).expect("only a warning");
    let [warning] = recording.warnings.as_slice() else {
        panic!("one warning: {:?}", recording.warnings)
    };
    assert!(
        warning.starts_with("cell 1 (x1_m) lies lowest in the canal"),
        "{warning}"
    );
}
