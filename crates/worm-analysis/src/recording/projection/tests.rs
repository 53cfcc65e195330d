//! The canal's axis and the cells, found from the markers of simulated crawls.

use super::{Axis, project};
use crate::experiment::{Simulation, simulate};
use crate::recording::Recording;
use crate::recording::markers::{Markers, UNSEEN};
use nalgebra::Vector3;
use std::path::Path;
use worm_estimator::config::Config;
use worm_log::ReadError;

/// Three cycles uphill at 60 Hz; cell 1 leads.
fn crawl() -> Recording {
    let simulation = Simulation {
        slope_deg: 20.0,
        cycles: 3.0,
        rate_hz: 60.0,
        dropout_share: 0.02,
        ..Simulation::default()
    };
    simulate(&Config::default(), &simulation).expect("the paper's worm crawls")
}

/// Cells in the order in which their markers are listed.
const LISTED: [usize; 4] = [2, 0, 3, 1];

/// The crawl as markers `c1` to `c4` in space, along a unit vector, each marker a little aside of the canal's line.
fn markers_along(recording: &Recording, axis: [f64; 3]) -> Markers {
    let axis = Vector3::from(axis);
    let position_m = |cell: usize| {
        let aside_m = Vector3::new(0.3, -0.12, 0.04) + 0.004 * cell as f64 * Vector3::new(1.0, 2.0, -1.0);
        recording.position_m[cell]
            .iter()
            .map(|along_m| {
                if along_m.is_nan() {
                    UNSEEN
                } else {
                    (aside_m + *along_m * axis).into()
                }
            })
            .collect()
    };
    Markers {
        names: LISTED.map(|cell| format!("c{}", cell + 1)).to_vec(),
        time_s: recording.time_s.clone(),
        position_m: LISTED.map(position_m).to_vec(),
        warnings: Vec::new(),
    }
}

fn add(markers: &mut Markers, name: &str, position_m: impl Fn(usize) -> [f64; 3]) {
    markers.names.push(name.to_owned());
    let samples = markers.time_s.len();
    markers.position_m.push((0..samples).map(position_m).collect());
}

fn projected(markers: Markers, axis: Option<Axis>) -> Result<Recording, ReadError> {
    project(markers, axis, Path::new("markers.c3d"))
}

fn refusal(markers: Markers) -> String {
    projected(markers, None).expect_err("refused").to_string()
}

/// Largest error of the displacements of each cell from its first seen position, m.
fn largest_error_m(found: &Recording, truth: &Recording) -> f64 {
    let mut largest_m: f64 = 0.0;
    for (found_m, true_m) in found.position_m.iter().zip(&truth.position_m) {
        let first = true_m.iter().position(|m| !m.is_nan()).expect("the cell is seen");
        for (found, truly) in found_m.iter().zip(true_m) {
            assert_eq!(found.is_nan(), truly.is_nan(), "unseen in the same samples");
            if !truly.is_nan() {
                largest_m = largest_m.max(((found - found_m[first]) - (truly - true_m[first])).abs());
            }
        }
    }
    largest_m
}

const NAMES: [&str; 4] = ["c1", "c2", "c3", "c4"];

#[test]
fn the_axis_is_found_in_every_direction() {
    let truth = crawl();
    let skew = Vector3::new(0.6, -0.48, 0.64);
    let directions = [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        skew.into(),
        (-skew).into(),
    ];
    for direction in directions {
        let found = projected(markers_along(&truth, direction), None).expect("a crawl along a line");
        assert_eq!(found.cell_names, NAMES, "{direction:?}: cell 1 leads");
        let error_m = largest_error_m(&found, &truth);
        assert!(error_m < 1e-9, "{direction:?}: {error_m} m");
        assert_eq!(found.time_s, truth.time_s);
        assert_eq!(found.warnings.len(), 1, "{:?}", found.warnings);
    }
    let found = projected(markers_along(&truth, skew.into()), None).expect("a crawl along a line");
    let expected = "cells by marker: 1 c1, 2 c2, 3 c3, 4 c4; up the canal is 0.6,-0.48,0.64";
    assert_eq!(found.warnings, [expected]);
}

/// All cells share one origin, so the distances between them are right too, where the markers sit on one line.
#[test]
fn distances_between_cells_are_kept() {
    let truth = crawl();
    let mut markers = markers_along(&truth, [0.0, 0.0, 1.0]);
    for (series, cell) in markers.position_m.iter_mut().zip(LISTED) {
        // Takes the marker back onto the line.
        series
            .iter_mut()
            .for_each(|position_m| position_m[2] += 0.004 * cell as f64);
    }
    let found = projected(markers, None).expect("a crawl along a line");
    for sample in 0..truth.samples() {
        for cell in 1..4 {
            let true_m = truth.position_m[0][sample] - truth.position_m[cell][sample];
            let found_m = found.position_m[0][sample] - found.position_m[cell][sample];
            assert!(
                true_m.is_nan() || (found_m - true_m).abs() < 1e-9,
                "{found_m} m, not {true_m} m"
            );
        }
    }
}

#[test]
fn an_axis_that_is_given_overrides_the_motion() {
    let truth = crawl();
    let markers = markers_along(&truth, [1.0, 0.0, 0.0]);
    let down = projected(markers.clone(), Axis::new([-2.0, 0.0, 0.0])).expect("an axis");
    assert_eq!(
        down.cell_names,
        ["c4", "c3", "c2", "c1"],
        "cell 1 is highest along the axis"
    );
    let turned: Vec<f64> = down.position_m[3].iter().map(|m| -m).collect();
    let up = projected(markers, Axis::new([1.0, 0.0, 0.0])).expect("an axis");
    let same = turned.iter().zip(&up.position_m[0]).all(|(a, b)| a.is_nan() || a == b);
    assert!(same, "the positions change sign with the axis");
    // 30° off the canal: the error shows in the warning.
    let oblique = projected(
        markers_along(&truth, [1.0, 0.0, 0.0]),
        Axis::new([3f64.sqrt(), 1.0, 0.0]),
    );
    let warnings = oblique.expect("an axis").warnings.join("\n");
    assert!(
        warnings.contains("is the canal straight, and the axis right?"),
        "{warnings}"
    );
}

#[test]
fn a_still_and_a_stray_and_an_unseen_marker_are_left_out() {
    let truth = crawl();
    let mut markers = markers_along(&truth, [0.0, 1.0, 0.0]);
    // Still but for noise of 0.1 mm rms or so, higher up the canal than any cell.
    let noise_m = |sample: usize| 1e-4 * (((sample * 7919) % 101) as f64 / 50.0 - 1.0);
    add(&mut markers, "wall", |sample| {
        [0.5, 2.0 + noise_m(sample), noise_m(sample + 13)]
    });
    add(&mut markers, "hand", |sample| [0.4, 0.01 * sample as f64, 0.0]);
    add(&mut markers, "lost", |_| UNSEEN);
    let found = projected(markers, None).expect("a crawl along a line");
    assert_eq!(found.cell_names, NAMES);
    assert!(largest_error_m(&found, &truth) < 1e-9);
    let [lost, wall, hand, _] = found.warnings.as_slice() else {
        panic!("a warning for each marker and one for the cells: {:?}", found.warnings)
    };
    assert_eq!(lost, "marker lost is never seen and was left out");
    for (warning, name) in [(wall, "wall"), (hand, "hand")] {
        assert!(
            warning.contains(&format!("marker {name} does not crawl with the others")),
            "{warning}"
        );
    }
}

#[test]
fn noise_across_the_canal_does_not_turn_the_axis() {
    let truth = crawl();
    let mut markers = markers_along(&truth, [1.0, 0.0, 0.0]);
    for (marker, series) in markers.position_m.iter_mut().enumerate() {
        for (sample, position_m) in series.iter_mut().enumerate() {
            // Alternates, so that it is uncorrelated with the crawl.
            position_m[2] += if (sample + marker).is_multiple_of(2) {
                2e-4
            } else {
                -2e-4
            };
        }
    }
    let found = projected(markers, None).expect("a crawl along a line");
    let error_m = largest_error_m(&found, &truth);
    assert!(error_m < 2e-5, "{error_m} m");
}

#[test]
fn what_the_motion_does_not_determine_is_refused() {
    let truth = crawl();
    // Out and back: which way is up?
    let mut there_and_back = markers_along(&truth, [1.0, 0.0, 0.0]);
    for series in &mut there_and_back.position_m {
        let back: Vec<[f64; 3]> = series.iter().rev().copied().collect();
        series.extend(back);
    }
    let error = refusal(there_and_back);
    assert!(
        error.contains("too little to determine its direction") && error.contains("--axis"),
        "{error}"
    );

    let mut circle = Markers {
        time_s: (0..200).map(f64::from).collect(),
        ..Markers::default()
    };
    for name in ["a", "b"] {
        add(&mut circle, name, |sample| {
            let (sine, cosine) = (sample as f64 / 10.0).sin_cos();
            [0.05 * sine, 0.05 * cosine, 0.0]
        });
    }
    let error = refusal(circle);
    assert!(
        error.contains("do not move along one line") && error.contains("--axis"),
        "{error}"
    );

    let mut one = markers_along(&truth, [1.0, 0.0, 0.0]);
    one.names.truncate(1);
    one.position_m.truncate(1);
    let error = refusal(one);
    assert!(error.contains("1 of the markers crawl (c3)"), "{error}");

    let mut many = markers_along(&truth, [1.0, 0.0, 0.0]);
    let copied = many.position_m[0].clone();
    for number in 5..=17 {
        add(&mut many, &format!("c{number}"), |sample| copied[sample]);
    }
    assert!(refusal(many).contains("17 of the markers crawl"));

    let mut unseen = markers_along(&truth, [1.0, 0.0, 0.0]);
    unseen.position_m.iter_mut().for_each(|series| series.fill(UNSEEN));
    assert!(refusal(unseen).contains("no marker is ever seen"));
}

#[test]
fn a_direction_is_a_name_or_three_numbers() {
    let table = [
        ("x", [1.0, 0.0, 0.0]),
        (" -z ", [0.0, 0.0, -1.0]),
        ("0,-2,0", [0.0, -1.0, 0.0]),
        ("3, 0 ,4", [0.6, 0.0, 0.8]),
        ("1e-300,0,0", [1.0, 0.0, 0.0]),
        ("-1e300,0,0", [-1.0, 0.0, 0.0]),
    ];
    for (text, expected) in table {
        let Axis(direction) = text.parse().unwrap_or_else(|error| panic!("{text}: {error}"));
        assert!(
            (direction - Vector3::from(expected)).norm() < 1e-15,
            "{text}: {direction}"
        );
    }
    for text in [
        "", "X", "--x", "1,2", "1,2,3,4", "0,0,-0", "1,nan,0", "inf,0,0", "1;0;0",
    ] {
        let error = text.parse::<Axis>().expect_err(text).to_string();
        assert!(error.contains(&format!("{text:?}")), "{error}");
    }
}

#[test]
fn a_marker_far_beyond_the_laboratory_is_refused() {
    let mut markers = markers_along(&crawl(), [1.0, 0.0, 0.0]);
    markers.position_m[1][50] = [0.0, 1e200, 0.0];
    let error = project(markers, None, Path::new("trial.csv")).expect_err("no position");
    let text = error.to_string();
    assert!(text.contains("marker c1 is more than 1000000 m away"), "{text}");
}

#[test]
fn many_markers_left_out_are_summed_up() {
    let mut markers = markers_along(&crawl(), [1.0, 0.0, 0.0]);
    for number in 0..1000 {
        markers.names.push(format!("stray{number}"));
        markers.position_m.push(vec![UNSEEN; markers.time_s.len()]);
    }
    let recording = project(markers, None, Path::new("trial.csv")).expect("a crawl");
    let warnings = recording.warnings.join("\n");
    assert!(warnings.contains("marker stray19 is never seen"), "{warnings}");
    assert!(warnings.contains("980 more markers were left out"), "{warnings}");
    assert!(!warnings.contains("stray20"), "{warnings}");
}
