//! `wormd simulate`: the paper's figures in, the same recording for the same seed, and clear refusals.

use std::process::{Command, Output};
use testkit::recording_files::{Folder, assert_says, crawl, difference, simulated};
use worm_analysis::experiment::Simulation;
use worm_analysis::recording::{OpenOptions, open};

fn wormd(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wormd"));
    command
        .arg("simulate")
        .args(arguments)
        .output()
        .expect("the binary runs")
}

#[test]
fn the_papers_worm_advances_as_in_table_1() {
    for (slope_deg, advance_m) in [(0.0, 6.833e-3), (30.0, 4.611e-3), (45.0, 2.072e-3)] {
        let recording = simulated(&Simulation {
            slope_deg,
            cycles: 6.0,
            noise_m: 0.0,
            ..Simulation::default()
        });
        let per_cycle = 300;
        let positions_m = &recording.position_m[2];
        let last = positions_m.len() - 1;
        assert_eq!(last, 6 * per_cycle);
        let advanced_m = (positions_m[last] - positions_m[last - 2 * per_cycle]) / 2.0;
        assert!((advanced_m - advance_m).abs() < 1e-6, "{slope_deg}°: {advanced_m}");
        assert!(
            recording.position_m.windows(2).all(|pair| pair[0][0] > pair[1][0]),
            "cell 1 leads"
        );
    }
}

#[test]
fn noise_dropouts_rest_and_seed_are_as_asked() {
    let clean = simulated(&Simulation {
        noise_m: 0.0,
        ..crawl()
    });
    let simulation = Simulation {
        noise_m: 2e-4,
        dropout_share: 0.1,
        seed: 5,
        ..crawl()
    };
    let noisy = simulated(&simulation);
    for (noisy_m, again_m) in noisy.position_m.iter().zip(&simulated(&simulation).position_m) {
        assert_eq!(
            difference(noisy_m, again_m),
            0.0,
            "the same seed gives the same recording"
        );
    }
    let errors = clean
        .position_m
        .iter()
        .flatten()
        .zip(noisy.position_m.iter().flatten())
        .map(|(clean, noisy)| noisy - clean);
    let (seen, lost): (Vec<f64>, Vec<f64>) = errors.partition(|error| !error.is_nan());
    let sigma_m = (seen.iter().map(|error| error * error).sum::<f64>() / seen.len() as f64).sqrt();
    assert!((sigma_m / 2e-4 - 1.0).abs() < 0.1, "{sigma_m}");
    let lost_share = lost.len() as f64 / (seen.len() + lost.len()) as f64;
    assert!((lost_share - 0.1).abs() < 0.03, "{lost_share}");
    let rested = simulated(&Simulation {
        noise_m: 0.0,
        rest_s: 2.0,
        ..crawl()
    });
    let rest = 120;
    assert_eq!(rested.samples(), clean.samples() + 2 * rest);
    assert!(
        difference(
            &rested.position_m[1][rest..rest + clean.samples()],
            &clean.position_m[1]
        ) < 1e-12
    );
    let phase = rested.gait_phase.expect("a phase");
    assert_eq!((phase[0], phase[rest], phase[phase.len() - 1]), (0.0, 0.0, 3.0));
}

#[test]
fn the_command_writes_a_recording_that_can_be_opened() {
    let folder = Folder::new();
    let out = folder.write("out.csv", "");
    let out_text = out.to_string_lossy();
    let output = wormd(&[
        "--slope",
        "-10",
        "--cycles",
        "4",
        "--out",
        &out_text,
        "--dropout",
        "0.01",
        "--positions-only",
        "--seed",
        "3",
    ]);
    assert!(output.status.success(), "{output:?}");
    assert_says(
        &String::from_utf8_lossy(&output.stderr),
        &["out.csv", "1201 samples", "4 cells"],
        "stderr",
    );
    let recording = open(&out, &OpenOptions::default()).expect("it can be opened");
    assert_eq!(
        (recording.samples(), recording.cells(), recording.gait_phase),
        (1201, 4, None)
    );
}

#[test]
fn arguments_that_cannot_be_are_named_and_end_with_status_2() {
    let folder = Folder::new();
    let out = folder.write("out.csv", "as it was").to_string_lossy().into_owned();
    let table: &[(&[&str], &[&str])] = &[
        (&["--max-deformation-mm", "0.1,0.1,0.1,0.1"], &["slide", "slope"]),
        (&["--slope", "nan"], &["--slope = NaN", "-90 to 90"]),
        (&["--cycles", "0"], &["--cycles = 0"]),
        (&["--cycles", "1e6"], &["--cycles = 1000000", "samples"]),
        (&["--rate", "-1"], &["--rate = -1", "Hz"]),
        (&["--noise", "inf"], &["--noise = inf"]),
        (&["--dropout", "1"], &["--dropout = 1", "0.9"]),
        (&["--cycle-s", "0"], &["--cycle-s = 0"]),
        (&["--rest", "-1"], &["--rest = -1"]),
        (
            &["--max-deformation-mm", "1,2"],
            &["--max-deformation-mm = a list of 2", "4 cells"],
        ),
        (
            &["--max-deformation-mm", "1,2,-3,4"],
            &["--max-deformation-mm = -3", "mm"],
        ),
        (&["--config", "no/such.toml"], &["no/such.toml"]),
        (&["--out", "no/such/folder.csv"], &["no/such/folder.csv", "folder"]),
        (&["--out", "worm.xlsx"], &["--out worm.xlsx", "*.csv"]),
    ];
    let usual = ["--slope", "10", "--cycles", "2", "--out", &out];
    for (changed, words) in table {
        let kept = usual.chunks(2).filter(|pair| pair[0] != changed[0]).flatten();
        let arguments: Vec<&str> = kept.chain(changed.iter()).copied().collect();
        let output = wormd(&arguments);
        assert_eq!(output.status.code(), Some(2), "{changed:?}: {output:?}");
        assert_says(&String::from_utf8_lossy(&output.stderr), words, &format!("{changed:?}"));
    }
    assert_eq!(
        std::fs::read_to_string(&out).expect("the file"),
        "as it was",
        "nothing was written"
    );
}
