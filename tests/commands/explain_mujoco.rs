//! The search on worms in MuJoCo, another simulator altogether, which shares nothing with the model: a small fixed sample.
//!
//! `WORMD_PYTHON` names an interpreter with mujoco and numpy (default `python3`); without one the tests say so and pass. The
//! whole splits are made by `crates/testkit/mujoco/make_campaigns.py` and scored by `score_campaigns` of the testkit.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::Command;
use testkit::hidden_effects::camera::Camera;
use testkit::hidden_effects::detectability::{ComparedRun, Detector};
use testkit::hidden_effects::folders::campaigns;
use testkit::hidden_effects::parameters::WormParameters;
use testkit::hidden_effects::scene::MotionCapture;
use testkit::hidden_effects::table::ScoreTable;

/// Prints the advance of the paper's worm in its third cycle, mm, on the level and on 30 degrees.
const ADVANCES: &str = "
import numpy as np
from worm import Scene, Worm, simulate
for slope in (0.0, 30.0):
    run = simulate(Worm.nominal(), Scene(slope, 2.5, 2))
    print(1e3 * np.diff(run.at(np.array([1.9, 2.9])).mean(axis=1))[0])
";

/// Prints how clearly each of a few differences shows in two runs of the paper's worm; the test has the same differences.
const SIGMAS: &str = "
import numpy as np
from campaign import Capture
from detectability import BINS, Detector
from worm import Worm
worm = Worm.nominal()
worm.rounding, worm.scatter = 0.0, 0.01
detector = Detector(worm, [(0.0, 1.0, 6, 2.5), (30.0, 1.0, 6, 2.5)], Capture(120.0, 1e-4, 2e-5, 0.1, 0.0, True))
bin, cell = np.arange(6 * 4 * BINS)[:, None], np.arange(4)[None]
for difference in (
    lambda run: 1e-4 * np.sin(0.37 * bin + cell),
    lambda run: 2e-5 * (bin // (4 * BINS)) * (cell + 1.0),
    lambda run: 1e-4 * (bin >= 96 + 48 * run) * (cell == 1),
    lambda run: 3e-5 * (1 + run) * np.sin(2 * np.pi * bin / (4 * BINS)) + 0 * cell,
    lambda run: 1e-3 * bin / 288 + 0 * cell,
):
    print(detector.sigma([difference(0), difference(1)]))
";

fn python() -> Option<Command> {
    let mut command = testkit::python::python("import mujoco, numpy")?;
    command.env("PYTHONDONTWRITEBYTECODE", "1").current_dir(bed());
    Some(command)
}

fn bed() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/testkit/mujoco")
}

#[test]
fn a_clean_worm_in_mujoco_advances_as_the_model_says() {
    let Some(mut python) = python() else {
        return;
    };
    let output = python.args(["-c", ADVANCES]).output().expect("Python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout);
    let advances_mm: Vec<f64> = text.lines().map(|line| line.parse().expect("a number")).collect();
    for (found_mm, model_mm) in advances_mm.iter().zip([6.833, 4.611]) {
        println!("{found_mm:.3} mm of {model_mm} mm");
        assert!(
            (found_mm / model_mm - 1.0).abs() < 0.02,
            "{found_mm} mm should be {model_mm} mm"
        );
    }
    assert_eq!(advances_mm.len(), 2);
}

/// The beds are scored by one table, so strong must mean the same in both.
#[test]
fn both_beds_measure_significance_alike() {
    let Some(mut python) = python() else {
        return;
    };
    let output = python.args(["-c", SIGMAS]).output().expect("Python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout);
    let by_mujoco: Vec<f64> = text.lines().map(|line| line.parse().expect("a number")).collect();

    let parameters = WormParameters {
        scatter: 0.01,
        ..WormParameters::nominal()
    };
    let capture = MotionCapture {
        camera: Camera {
            rate_hz: 120.0,
            noise_m: 1e-4,
            ..Camera::default()
        },
        drift_m: 2e-5,
        drift_s: 0.1,
    };
    let runs = [0.0, 30.0].map(|slope_deg| ComparedRun {
        slope_deg,
        cycles: 6,
        cycle_s: 2.5,
    });
    let detector = Detector::new(&parameters, &capture, &runs);
    // Of bin, cell and run, m; a cycle has 48 bins.
    let differences_m: [fn(f64, f64, f64) -> f64; 5] = [
        |bin, cell, _| 1e-4 * (0.37 * bin + cell).sin(),
        |bin, cell, _| 2e-5 * (bin / 48.0).floor() * (cell + 1.0),
        |bin, cell, run| {
            if bin >= 96.0 + 48.0 * run && cell == 1.0 {
                1e-4
            } else {
                0.0
            }
        },
        |bin, _, run| 3e-5 * (1.0 + run) * (TAU * bin / 48.0).sin(),
        |bin, _, _| 1e-3 * bin / 288.0,
    ];
    let counted = |count: usize| (0..count).map(|number| number as f64);
    assert_eq!(by_mujoco.len(), differences_m.len());
    for (difference_m, by_mujoco) in differences_m.into_iter().zip(by_mujoco) {
        let of_run = |run: f64| {
            let of_bin = |bin: f64| counted(4).map(|cell| difference_m(bin, cell, run)).collect();
            counted(6 * 48).map(of_bin).collect()
        };
        let own = detector.sigma(&[of_run(0.0), of_run(1.0)]);
        println!("{own:.3} and {by_mujoco:.3} sigma");
        assert!(
            (own / by_mujoco - 1.0).abs() < 0.03,
            "{own} sigma should be {by_mujoco} sigma"
        );
    }
}

#[test]
fn the_sample_is_explained_and_scored() {
    let Some(mut python) = python() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = python
        .args(["make_campaigns.py", "--split", "sample", "--out"])
        .arg(folder.path())
        .output()
        .expect("Python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let campaigns = campaigns(folder.path()).unwrap_or_else(|problem| panic!("{problem}"));
    assert_eq!(campaigns.len(), 3);
    let wormd = Path::new(env!("CARGO_BIN_EXE_wormd"));
    let assessments: Vec<_> = campaigns.iter().map(|campaign| campaign.assess(wormd, None)).collect();
    for one in &assessments {
        println!("{}", one.line());
    }
    let table = ScoreTable(&assessments);
    println!("{table}");
    // What is counted, and of how many.
    let expected = [
        ("no answer at all", (0, 3)),
        ("clean: an effect named", (0, 1)),
        ("single: false second effect", (0, 1)),
        ("strong: strictly right", (1, 1)),
        ("strong: cell right", (1, 1)),
        ("stranger: under another name", (0, 1)),
    ];
    for (what, expected) in expected {
        assert_eq!(table.count(what), Some(expected), "{what}");
    }
}
