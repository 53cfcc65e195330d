//! Captures as laboratories make them: swapped labels, frozen and jumping markers, a knocked camera, wrong stamps.
//!
//! Each test damages clean recordings of the model and compares what is read with the recording before the damage.

use super::clean_captures::drawn;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::Range;
use testkit::recording_files::{Folder, as_csv, assert_says, simulated};
use worm_analysis::experiment::{Analysis, RecordedRun, Simulation, analyze};
use worm_analysis::explain::{Options, explain};
use worm_analysis::identify::{Prior, Steadied, gait, steady};
use worm_analysis::recording::{OpenOptions, Recording, Repair, RepairKind};
use worm_estimator::config::Config;
use worm_log::ReadError;

/// The paper's worm on the level, twelve cycles.
fn twelve_cycles(positions_only: bool) -> Recording {
    simulated(&Simulation {
        cycles: 12.0,
        seed: 3,
        positions_only,
        ..Simulation::default()
    })
}

fn samples_of(recording: &Recording, from_s: f64, to_s: f64) -> Range<usize> {
    let sample = |at_s: f64| recording.time_s.partition_point(|&time_s| time_s < at_s);
    sample(from_s)..sample(to_s)
}

/// The tracker confuses two markers.
fn swap(recording: &mut Recording, cells: [usize; 2], samples: Range<usize>) {
    for sample in samples {
        let [a, b] = cells.map(|cell| recording.position_m[cell][sample]);
        (
            recording.position_m[cells[0]][sample],
            recording.position_m[cells[1]][sample],
        ) = (b, a);
    }
}

/// Somebody pushes the camera.
fn knock(recording: &mut Recording, sample: usize, shift_m: f64) {
    for series in &mut recording.position_m {
        series[sample..].iter_mut().for_each(|at_m| *at_m += shift_m);
    }
}

fn checked(recording: &Recording) -> Result<Recording, ReadError> {
    recording.clone().checked(&OpenOptions::default())
}

fn analysis(recording: &Recording) -> Analysis {
    let checked = checked(recording).expect("it can be repaired");
    let run = RecordedRun::at_slope(&checked, 0.0);
    let mut analyses = analyze(&[run], &Config::default(), &mut |_| ()).expect("a crawl");
    analyses.remove(0)
}

fn steadied<'a>(recording: &'a Recording, config: &Config) -> Steadied<'a> {
    let step_order = config.worm.step_order_from_zero();
    let find_gait = |measured_m: &[Vec<f64>], filled_m: &[Vec<f64>]| {
        let prior = Prior {
            step_order: &step_order,
            phase: recording.gait_phase.as_deref(),
        };
        gait::find(&recording.time_s, measured_m, filled_m, prior)
    };
    steady(recording, find_gait).expect("a gait")
}

fn of_kind(repairs: &[Repair], what: RepairKind) -> Vec<&Repair> {
    repairs.iter().filter(|repair| repair.what == what).collect()
}

/// Positions that are seen in both recordings and differ, and those that are seen in the first only.
fn differences(clean: &Recording, repaired: &Recording) -> (usize, usize) {
    let pairs = || {
        clean
            .position_m
            .iter()
            .flatten()
            .zip(repaired.position_m.iter().flatten())
    };
    let wrong = pairs().filter(|(clean_m, at_m)| at_m.is_finite() && clean_m.to_bits() != at_m.to_bits());
    let lost = pairs().filter(|(clean_m, at_m)| clean_m.is_finite() && at_m.is_nan());
    (wrong.count(), lost.count())
}

#[test]
fn a_swap_of_a_third_of_a_second_is_undone() {
    for positions_only in [true, false] {
        let clean = twelve_cycles(positions_only);
        let mut damaged = clean.clone();
        let samples = samples_of(&clean, 10.0, 10.3);
        swap(&mut damaged, [1, 2], samples.clone());
        let repaired = checked(&damaged).expect("it can be undone");
        assert_eq!(
            differences(&clean, &repaired),
            (0, 4),
            "one sample of two cells at each end is left out"
        );
        for (repair, cell) in repaired.repairs.iter().zip([2, 3]) {
            assert_eq!((repair.what, repair.cell), (RepairKind::SwappedLabel, Some(cell)));
            assert_eq!(repair.samples, samples.len());
            assert_eq!(
                (repair.from_s, repair.to_s),
                (clean.time_s[samples.start], clean.time_s[samples.end - 1])
            );
        }
        let (before, after) = (analysis(&clean), analysis(&damaged));
        assert!((before.mean.advance_m - after.mean.advance_m).abs() < 1e-6);
        assert_eq!(after.repairs.len(), 2);
        assert_says(
            &after.warnings.join("\n"),
            &["cell 2 carried another cell's label", "cell 3"],
            "warnings",
        );
    }
}

#[test]
fn a_swap_that_lasts_to_the_end_is_undone() {
    for positions_only in [true, false] {
        let clean = twelve_cycles(positions_only);
        // Over more and over less than half of the recording, and from its start on.
        for samples in [1200..clean.samples(), 2700..clean.samples(), 0..1000] {
            let mut damaged = clean.clone();
            swap(&mut damaged, [1, 2], samples.clone());
            let repaired = checked(&damaged).expect("it can be undone");
            assert_eq!(
                differences(&clean, &repaired),
                (0, 2),
                "one end of the swap of {samples:?}"
            );
        }
    }
    let clean = twelve_cycles(true);
    let mut damaged = clean.clone();
    swap(&mut damaged, [1, 2], 1200..clean.samples());
    let (before, after) = (analysis(&clean), analysis(&damaged));
    assert!((before.mean.advance_m - after.mean.advance_m).abs() < 1e-6);
}

#[test]
fn a_knock_of_the_camera_is_reported_and_does_not_bias_the_advance() {
    for (positions_only, slope_deg) in [(true, 0.0), (false, 0.0), (false, 30.0)] {
        let clean = simulated(&Simulation {
            slope_deg,
            cycles: 12.0,
            seed: 3,
            positions_only,
            ..Simulation::default()
        });
        let mut damaged = clean.clone();
        let sample = samples_of(&clean, 11.1, 12.0).start;
        knock(&mut damaged, sample, 1e-3);
        let (before, after) = (analysis(&clean), analysis(&damaged));
        let knocks = of_kind(&after.repairs, RepairKind::CameraKnock);
        let [found] = knocks[..] else {
            panic!("one knock, not {:?}", after.repairs);
        };
        assert_eq!(found.from_s, clean.time_s[sample]);
        let (shift_m, sigma_m) = (found.shift_m.expect("a shift"), found.shift_sigma_m.expect("its error"));
        assert!(
            (shift_m - 1e-3).abs() < 3.0 * sigma_m && sigma_m < 1e-4,
            "{shift_m} ± {sigma_m}"
        );
        assert_says(&after.warnings.join("\n"), &["knock of the camera"], "warnings");
        // Before, it was 0.09 mm: a twelfth of the knock.
        let bias_m = after.mean.advance_m - before.mean.advance_m;
        assert!(bias_m.abs() < 1e-5, "{bias_m}");
    }
}

#[test]
fn explain_reads_damaged_captures_and_reports_the_repairs() {
    let run = |slope_deg: f64, damage: &dyn Fn(&mut Recording)| {
        let mut recording = simulated(&Simulation {
            slope_deg,
            cycles: 8.0,
            rate_hz: 60.0,
            seed: 5,
            ..Simulation::default()
        });
        damage(&mut recording);
        checked(&recording).expect("it can be repaired")
    };
    let recordings = [
        run(0.0, &|recording| swap(recording, [1, 2], 600..618)),
        run(30.0, &|recording| knock(recording, 700, 1e-3)),
    ];
    let slopes_deg = [0.0, 30.0];
    let runs: Vec<RecordedRun<'_>> = recordings
        .iter()
        .zip(slopes_deg)
        .map(|(recording, slope_deg)| RecordedRun::at_slope(recording, slope_deg))
        .collect();
    let answer = explain(&runs, &Config::default(), &Options::default(), &mut |_| ()).expect("an answer");
    let found: Vec<_> = answer
        .repairs
        .iter()
        .map(|repair| (repair.run, repair.what, repair.cell))
        .collect();
    assert_eq!(
        found,
        [
            (1, RepairKind::SwappedLabel, Some(2)),
            (1, RepairKind::SwappedLabel, Some(3)),
            (2, RepairKind::CameraKnock, None),
        ]
    );
    let json = serde_json::to_value(&answer.repairs[0]).expect("JSON");
    assert_eq!(json["what"], "swapped-label");
    assert_eq!(json["samples"], 18);
    let measured_m = answer.runs[1].advance_m[0];
    assert!(
        (measured_m - answer.runs[1].advance_m[1]).abs() < 3e-5,
        "{:?}",
        answer.runs[1].advance_m
    );
}

#[test]
fn wrong_stamps_are_left_out_and_a_clock_set_back_is_refused() {
    let clean = twelve_cycles(false);
    let rows = as_csv(&clean);
    let lines: Vec<&str> = rows.lines().collect();
    let begin = lines
        .iter()
        .position(|line| line.starts_with("time_s"))
        .expect("a header")
        + 1;
    let mut damaged: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    let restamp = |line: &str, time_s: f64| format!("{time_s},{}", line.split_once(',').expect("fields").1);
    damaged[begin + 500] = restamp(lines[begin + 500], clean.time_s[499]);
    damaged[begin + 900] = restamp(lines[begin + 900], 0.1);
    damaged[begin + 901] = restamp(lines[begin + 901], 1e6);
    damaged.remove(begin + 2000);
    let recording = Folder::new()
        .open("worm.csv", damaged.join("\n") + "\n")
        .expect("it can be repaired");
    assert_eq!(recording.samples(), clean.samples() - 4);
    let counts: Vec<_> = recording
        .repairs
        .iter()
        .map(|repair| (repair.what, repair.samples))
        .collect();
    assert_eq!(
        counts,
        [(RepairKind::TimeNotIncreasing, 3), (RepairKind::MissingSamples, 4)],
        "those left out are missing, too"
    );
    let mut back: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    for (sample, line) in back.iter_mut().enumerate().skip(begin + 1000) {
        *line = restamp(line, clean.time_s[sample - begin] - 0.5);
    }
    let error = Folder::new()
        .open("worm.csv", back.join("\n") + "\n")
        .expect_err("a clock set back");
    assert_says(&error, &["goes back", "after"], "set back");
}

#[test]
fn too_much_damage_is_refused_with_its_name_and_place() {
    let clean = twelve_cycles(false);
    let refused = |damage: &dyn Fn(&mut Recording), words: &[&str]| {
        let mut damaged = clean.clone();
        damage(&mut damaged);
        assert_says(&checked(&damaged).expect_err(words[0]), words, words[0]);
    };
    refused(
        &|recording| (0..8).for_each(|at| swap(recording, [1, 2], 300 * at + 100..300 * at + 115)),
        &[
            "markers carry the labels of others in 120 of 3601 samples, between 0.833 s and 18.450 s",
            "2 %",
        ],
    );
    refused(
        &|recording| {
            let frozen_m = recording.position_m[2][1000];
            recording.position_m[2][1000..1100].fill(frozen_m);
        },
        &["cell 3 is frozen from 8.333 s to 9.158 s", "0.2 s", "--max-gap 0.9"],
    );
    refused(
        &|recording| {
            recording.position_m[0][1000..1060]
                .iter_mut()
                .for_each(|at_m| *at_m += 8e-3)
        },
        &["cell 1 jumps away and comes back from 8.333 s to 8.825 s", "--max-gap"],
    );
    let mut knocked = clean.clone();
    for sample in [700, 1340, 1950, 2480] {
        knock(&mut knocked, sample, 2e-3);
    }
    let recording = checked(&knocked).expect("knocks are found later");
    let error = analyze(
        &[RecordedRun::at_slope(&recording, 0.0)],
        &Config::default(),
        &mut |_| (),
    )
    .expect_err("four knocks");
    assert_says(
        &error,
        &["all cells shift at once 4 times", "at 5.83 s", "knocked"],
        "knocks",
    );
}

/// One kind of damage: what it does to a recording, and whether what was repaired is right.
struct Damage {
    name: &'static str,
    /// Fraction of the recordings in which it must be repaired.
    least: f64,
    run: fn(&Recording, &Config, &mut Xoshiro256PlusPlus) -> Result<(), String>,
}

/// A time well inside a recording, after the first cycle.
fn inside(recording: &Recording, length: usize, rng: &mut Xoshiro256PlusPlus) -> Range<usize> {
    let samples = recording.samples();
    let from = rng.random_range(samples / 2..samples - samples / 8 - length);
    from..from + length
}

fn rate_hz(recording: &Recording) -> f64 {
    1.0 / (recording.time_s[1] - recording.time_s[0])
}

fn swapped(clean: &Recording, rng: &mut Xoshiro256PlusPlus, hides: bool) -> Result<(), String> {
    let mut clean = clean.clone();
    let length = (rng.random_range(0.05..0.4) * rate_hz(&clean)).ceil() as usize + 2;
    let samples = inside(&clean, length, rng);
    let cell = rng.random_range(0..clean.cells() - 1);
    if hides {
        let hidden = [cell, rng.random_range(0..clean.cells())][rng.random_range(0..2)];
        let middle = samples.start + length / 2;
        let reach = ((0.08 * rate_hz(&clean)) as usize).min(length / 2);
        clean.position_m[hidden][middle - reach..middle + reach].fill(f64::NAN);
    }
    let mut damaged = clean.clone();
    swap(&mut damaged, [cell, cell + 1], samples);
    let repaired = checked(&damaged).map_err(|error| error.to_string())?;
    match differences(&clean, &repaired) {
        (0, 0..=4) => Ok(()),
        (wrong, lost) => Err(format!("{wrong} wrong, {lost} lost: {:?}", repaired.repairs)),
    }
}

const DAMAGES: [Damage; 6] = [
    Damage {
        name: "swap",
        least: 1.0,
        run: |clean, _, rng| swapped(clean, rng, false),
    },
    Damage {
        name: "swap while a marker is hidden",
        least: 0.98,
        run: |clean, _, rng| swapped(clean, rng, true),
    },
    Damage {
        name: "frozen",
        least: 0.95,
        run: |clean, _, rng| {
            let length = (rng.random_range(0.08..0.18) * rate_hz(clean)).ceil() as usize;
            let samples = inside(clean, length.max(5), rng);
            let mut damaged = clean.clone();
            let series = &mut damaged.position_m[rng.random_range(0..clean.cells())];
            let frozen_m = series[samples.start];
            series[samples.clone()].fill(frozen_m);
            if frozen_m.is_nan() {
                return Ok(());
            }
            let repaired = checked(&damaged).map_err(|error| error.to_string())?;
            let found = of_kind(&repaired.repairs, RepairKind::FrozenMarker);
            match found[..] {
                [one]
                    if (samples.len() / 2..samples.len() + 4).contains(&one.samples) && repaired.repairs.len() == 1 =>
                {
                    Ok(())
                }
                _ => Err(format!("{samples:?}: {:?}", repaired.repairs)),
            }
        },
    },
    Damage {
        name: "jump of 6 mm and back",
        least: 0.9,
        run: |clean, _, rng| {
            let length = (rng.random_range(0.03..0.15) * rate_hz(clean)).ceil() as usize;
            let samples = inside(clean, length, rng);
            let mut damaged = clean.clone();
            let cell = rng.random_range(0..clean.cells());
            damaged.position_m[cell][samples.clone()]
                .iter_mut()
                .for_each(|at_m| *at_m += 6e-3);
            let repaired = checked(&damaged).map_err(|error| error.to_string())?;
            let wrong = differences(clean, &repaired).0;
            let others = repaired
                .repairs
                .iter()
                .filter(|repair| repair.cell != Some(cell + 1))
                .count();
            if wrong == 0 && others == 0 {
                Ok(())
            } else {
                Err(format!("{samples:?}, {wrong} wrong: {:?}", repaired.repairs))
            }
        },
    },
    Damage {
        name: "marker moved by 4 mm",
        least: 0.8,
        run: |clean, config, rng| {
            let from = inside(clean, 1, rng).start;
            let mut damaged = clean.clone();
            let cell = rng.random_range(0..clean.cells());
            damaged.position_m[cell][from..]
                .iter_mut()
                .for_each(|at_m| *at_m += 4e-3);
            let repaired = checked(&damaged).map_err(|error| error.to_string())?;
            let steadied = steadied(&repaired, config);
            match &steadied.repairs[..] {
                [one]
                    if one.what == RepairKind::MarkerMoved
                        && one.cell == Some(cell + 1)
                        && one.shift_m.is_some_and(|shift_m| (shift_m - 4e-3).abs() < 3e-4) =>
                {
                    Ok(())
                }
                repairs => Err(format!("sample {from}, cell {}: {repairs:?}", cell + 1)),
            }
        },
    },
    Damage {
        name: "knock of 1.5 mm",
        least: 0.9,
        run: |clean, config, rng| {
            let from = inside(clean, 1, rng).start;
            let mut damaged = clean.clone();
            knock(&mut damaged, from, if rng.random::<bool>() { 1.5e-3 } else { -1.5e-3 });
            let repaired = checked(&damaged).map_err(|error| error.to_string())?;
            let steadied = steadied(&repaired, config);
            match &steadied.repairs[..] {
                [one] if one.what == RepairKind::CameraKnock => Ok(()),
                repairs => Err(format!("sample {from}: {repairs:?}")),
            }
        },
    },
];

#[test]
fn damage_is_found_in_recordings_of_every_size() {
    const SEEDS: Range<u64> = 1000..1060;
    let recordings: Vec<_> = SEEDS.map(|seed| (seed, drawn(seed))).collect();
    let mut missed_most = Vec::new();
    for damage in &DAMAGES {
        let (mut found, mut missed) = (0, Vec::new());
        for (seed, (name, clean, config)) in &recordings {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(*seed);
            match (damage.run)(clean, config, &mut rng) {
                Ok(()) => found += 1,
                Err(what) => missed.push(format!("{name}: {what}")),
            }
        }
        println!(
            "{}: {found} of {}\n  {}",
            damage.name,
            recordings.len(),
            missed.join("\n  ")
        );
        if (found as f64) < damage.least * recordings.len() as f64 {
            missed_most.push(format!(
                "{}: {found} of {}\n{}",
                damage.name,
                recordings.len(),
                missed.join("\n")
            ));
        }
    }
    assert!(missed_most.is_empty(), "{}", missed_most.join("\n"));
}
