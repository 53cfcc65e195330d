//! The motor's current as evidence: what positions cannot tell apart, as forces over stiffness are all that they show.

use std::io::Cursor;
use std::path::Path;
use testkit::hidden_effects::campaign::{HiddenCampaign, draw_with_phase_sized};
use testkit::hidden_effects::effect::{Effect, SeverityRange};
use testkit::hidden_effects::hidden::{Hidden, Twin};
use testkit::hidden_effects::setting::CampaignSize;
use worm_analysis::experiment::{AnalysisError, RecordedRun, analyze, analyze_by_current};
use worm_analysis::explain::answer::StageKind;
use worm_analysis::explain::{Answer, Evidence, ExplainError, Options, Verdict, explain};
use worm_analysis::recording::{OpenOptions, Recording, Wanted, read_from, write_csv};
use worm_analysis::report::explain::page;

/// In no range of the splits.
const SEED: u64 = 902;
const SIZE: CampaignSize = CampaignSize {
    runs: 2,
    cycles: 8.0,
    rate_hz: 60.0,
};
/// A payload of 100 to 150 g, a third of the worm's own mass.
const HEAVY: SeverityRange = SeverityRange { from: 0.88, to: 1.0 };

fn asked(campaign: &HiddenCampaign, evidence: Evidence) -> Result<Answer, ExplainError> {
    let options = Options {
        evidence,
        ..Options::default()
    };
    let runs = campaign.runs(&campaign.recordings);
    let answer = explain(&runs, &campaign.config, &options, &mut |_| ());
    if let Ok(answer) = &answer {
        println!("{}: {}", campaign.truth.case, answer.sentence);
    }
    answer
}

fn first(answer: &Answer) -> Option<&str> {
    answer.effects.first().map(|effect| effect.name.as_str())
}

#[test]
fn current_tells_a_payload_from_softer_pads() {
    let softer = draw_with_phase_sized(Hidden::Twin(Twin::SofterPads), SEED, SIZE);
    let by_positions = asked(&softer, Evidence::Positions).expect("an answer");
    assert_eq!(
        first(&by_positions),
        Some("payload"),
        "positions show force over stiffness"
    );
    let by_both = asked(&softer, Evidence::PositionsAndCurrent).expect("an answer");
    assert_eq!(by_both.verdict, Verdict::Agrees);
    assert!(by_both.sentence.contains("softer"), "{}", by_both.sentence);
    let true_factor = softer.truth.effects[0].parameters["stiffness_factor"];
    let drawn = softer.worm.parameters.stiffness_n_per_m.iter().take(4).sum::<f64>() / 4.0;
    let nominal = testkit::nominal::STIFFNESS_N_PER_M;
    let stiffness = by_both
        .calibration
        .iter()
        .find(|value| value.name == "stiffness")
        .expect("it is free");
    let expected = true_factor * drawn / nominal;
    assert!(
        (stiffness.found - expected).abs() < 3.0 * stiffness.sigma,
        "{stiffness:?}, {expected}"
    );

    let loaded = draw_with_phase_sized(Hidden::Single(Effect::Payload, HEAVY), SEED, SIZE);
    let by_both = asked(&loaded, Evidence::PositionsAndCurrent).expect("an answer");
    assert_eq!(first(&by_both), Some("payload"));
    let payload = &by_both.effects[0].parameters[0];
    let true_kg = loaded.truth.effects[0].parameters["mass_kg"];
    assert!(
        (payload.value - true_kg).abs() < 3.0 * payload.sigma,
        "{payload:?}, {true_kg} kg"
    );
    assert_eq!(by_both.figures.torque.len(), loaded.recordings.len());
    for series in &by_both.figures.torque {
        let pairs = series.measured_n_m.iter().zip(&series.named_n_m);
        let squares: Vec<f64> = pairs.map(|(measured, named)| (measured - named).powi(2)).collect();
        let rms_n_m = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!(squares.len() == series.phase.len() && rms_n_m < 2e-3, "{rms_n_m} N m");
    }
    for run in &by_both.runs {
        let current = run.current.expect("it counts");
        let [shown_j, recalibrated_j, named_j] = current.work_j;
        assert!(
            (named_j - shown_j).abs() < (recalibrated_j - shown_j).abs(),
            "{current:?}"
        );
    }
}

/// A campaign in which nobody sees the worm: its positions are lost, so any that were looked at would show.
fn unseen(hidden: Hidden) -> HiddenCampaign {
    let mut campaign = draw_with_phase_sized(hidden, SEED, SIZE);
    let positions = campaign
        .recordings
        .iter_mut()
        .flat_map(|recording| &mut recording.position_m);
    positions.for_each(|of_cell| of_cell.fill(f64::NAN));
    campaign
}

/// The same crawl analysed by positions and by current agrees, and the worm is the one that was drawn.
#[test]
fn analysis_by_current_finds_what_positions_show() {
    let seen = draw_with_phase_sized(Hidden::Clean, SEED, SIZE);
    let by_positions = analyze(&seen.runs(&seen.recordings), &seen.config, &mut |_| ()).expect("an analysis");
    let campaign = unseen(Hidden::Clean);
    let by_current = analyze_by_current(&campaign.runs(&campaign.recordings), &campaign.config).expect("an analysis");
    assert_eq!(by_current.len(), by_positions.len());
    for (current, seen) in by_current.iter().zip(&by_positions) {
        let advances = [&current.mean, &current.sigma, &seen.mean].map(|values| values.advance_m);
        let energies = [&current.mean, &current.sigma, &seen.mean].map(|values| values.energy_loss_j);
        println!(
            "{}°: advance {advances:?} m, energy (11) {energies:?} J",
            seen.slope_deg
        );
        assert!((advances[0] / advances[2] - 1.0).abs() < 0.05, "{advances:?}");
        assert!((energies[0] / energies[2] - 1.0).abs() < 0.08, "{energies:?}");
        let found = current.max_deformation_m.iter().zip(&current.max_deformation_sigma_m);
        for ((found_m, sigma_m), seen_m) in found.zip(&seen.max_deformation_m) {
            assert!(
                (found_m - seen_m).abs() < 3.0 * sigma_m,
                "{found_m} ± {sigma_m}, {seen_m}"
            );
        }
        assert!((current.cycle_s / seen.cycle_s - 1.0).abs() < 0.01);
        // The first cycle is left out, because the tips load up in it.
        assert!(
            current.cycles.len() + 2 >= seen.cycles.len(),
            "{}",
            current.cycles.len()
        );
        let theory = current.theory.nominal.as_ref().expect("it crawls");
        assert_eq!(
            theory.values.advance_m,
            seen.theory.nominal.as_ref().expect("it crawls").values.advance_m
        );
    }
    let mut sparse = campaign.recordings.clone();
    for recording in &mut sparse {
        let thinned = |series: &[f64]| series.iter().copied().step_by(3).collect::<Vec<f64>>();
        recording.time_s = thinned(&recording.time_s);
        recording.gait_phase = recording.gait_phase.as_deref().map(thinned);
        if let Some(motor) = &mut recording.motor {
            motor.current_a = thinned(&motor.current_a);
        }
    }
    let refused = analyze_by_current(&campaign.runs(&sparse), &campaign.config).expect_err("too few readings");
    assert!(
        refused.to_string().contains("13 readings of the motor in a step"),
        "{refused}"
    );
    let mut blind = campaign.recordings.clone();
    blind[0].motor = None;
    let refused = analyze_by_current(&campaign.runs(&blind), &campaign.config).expect_err("nothing was recorded");
    assert!(matches!(refused, AnalysisError::NoCurrent { .. }), "{refused}");
}

/// A table of the motor alone, as somebody writes it who has no camera: without columns of positions, or with empty ones.
#[test]
fn a_table_of_the_motor_alone_is_what_the_log_is() {
    let campaign = unseen(Hidden::Clean);
    let run = campaign.runs(&campaign.recordings)[0];
    let mut text = Vec::new();
    write_csv(run.recording, &mut text).expect("memory can be written");
    let text = String::from_utf8(text).expect("text");
    let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let columns: Vec<&str> = rows[0].split(',').collect();
    let without = |is_left_out: &dyn Fn(&str) -> bool| -> String {
        let row = |row: &&str| {
            let kept = row.split(',').zip(&columns).filter(|(_, column)| !is_left_out(column));
            kept.map(|(field, _)| field).collect::<Vec<_>>().join(",") + "\n"
        };
        rows.iter().map(row).collect()
    };
    let opened = |text: &str, cells: Option<usize>| {
        let options = OpenOptions {
            wanted: Wanted::PositionsOrMotor { window_s: 0.0 },
            cells,
            ..OpenOptions::default()
        };
        read_from(
            Cursor::new(text),
            text.len() as u64,
            Path::new("motor.csv"),
            &options,
            &mut |_| (),
        )
    };
    let analysed = |recording: &Recording| {
        let analyses = analyze_by_current(&[RecordedRun { recording, ..run }], &campaign.config);
        analyses.expect("an analysis").remove(0)
    };
    let is_position = |column: &str| column.starts_with('x');
    let cells = Some(run.recording.cells());
    let expected = analysed(run.recording);
    for text in [without(&is_position), without(&|_| false)] {
        let recording = opened(&text, cells).expect("a recording");
        assert_eq!(
            (recording.cells(), recording.has_positions()),
            (run.recording.cells(), false)
        );
        let found = analysed(&recording);
        assert_eq!(found.friction_n, expected.friction_n);
        assert_eq!(found.energy_electrical_j, expected.energy_electrical_j);
    }
    // Electrical energy that nobody measured is unknown, and not 0.
    let unpowered = without(&|column| is_position(column) || column == "bus_voltage_v");
    let found = analysed(&opened(&unpowered, cells).expect("a recording"));
    assert!(found.energy_electrical_j.is_nan() && found.cycles.iter().all(|cycle| cycle.energy_electrical_j.is_nan()));
    // What is missing is named, and what else takes such a table.
    for (text, cells, words) in [
        (
            without(&|column| is_position(column) || column == "motor_velocity_rad_s"),
            cells,
            "motor_velocity_rad_s is missing",
        ),
        (
            without(&|column| is_position(column) || column.contains('_') && column != "time_s"),
            cells,
            "there is no column x1_m",
        ),
        (without(&is_position), None, "wormd explain --current"),
    ] {
        let refused = opened(&text, cells).expect_err(words).to_string();
        assert!(refused.contains(words), "{refused}");
    }
}

#[test]
fn current_alone_shows_which_cell_holds_otherwise() {
    let softer = unseen(Hidden::Twin(Twin::SofterPads));
    let refused = asked(&softer, Evidence::Positions).expect_err("there is nothing to see");
    assert!(matches!(refused, ExplainError::NoPositions { .. }), "{refused}");
    let agreed = asked(&softer, Evidence::PositionsAndCurrent).expect("an answer");
    assert_eq!(agreed.verdict, Verdict::Agrees);
    assert!(agreed.sentence.contains("softer"), "{}", agreed.sentence);

    let unequal = unseen(Hidden::Single(Effect::UnequalClamping, SeverityRange::UPPER_HALF));
    for evidence in [Evidence::PositionsAndCurrent, Evidence::CurrentAlone] {
        let answer = asked(&unequal, evidence).expect("an answer");
        assert_eq!(first(&answer), Some("unequal-clamping"));
        let (named, truth) = (&answer.effects[0], &unequal.truth.effects[0]);
        assert_eq!(named.cell, truth.cell.map(|from_zero| from_zero + 1));
        let factor = &named.parameters[0];
        let true_factor = truth.parameters["friction_factor"];
        assert!(
            (factor.value - true_factor).abs() < 3.0 * factor.sigma,
            "{factor:?}, {true_factor}"
        );
        let left_n_m = |kind: StageKind| {
            let stage = answer.stages.iter().find(|stage| stage.stage == kind).expect("a stage");
            assert!(
                stage.held_out_rms_m.is_nan() && stage.advance_error_m.is_nan(),
                "{stage:?}"
            );
            stage.torque.expect("the current counts").held_out_rms_n_m
        };
        let order = [
            StageKind::Baseline,
            StageKind::Recalibrated,
            StageKind::Named,
            StageKind::Floor,
        ]
        .map(left_n_m);
        assert!(order.is_sorted_by(|more, less| more > less), "{order:?}");
        // The rest is the ripple of gears that nobody described.
        let closure = answer.effects[0].closure;
        assert!((0.3..1.0).contains(&closure), "{closure}");
        for run in &answer.runs {
            assert!(!run.sees_positions && run.advance_m[0].is_nan(), "{run:?}");
        }
        let page = page(&answer, "unseen").expect("a page");
        assert!(page.contains("mN m") && page.contains("Nobody saw the cells"));
    }
}

#[test]
fn current_that_nobody_recorded_is_no_evidence() {
    let mut campaign = draw_with_phase_sized(Hidden::Clean, SEED, CampaignSize::SMALL);
    let mut without_phase = campaign.clone();
    without_phase.recordings[0].gait_phase = None;
    let refused = asked(&without_phase, Evidence::CurrentAlone).expect_err("where it turned is not known");
    assert!(matches!(refused, ExplainError::NoCurrentOfRun { .. }), "{refused}");
    campaign
        .recordings
        .iter_mut()
        .for_each(|recording| recording.motor = None);
    assert!(matches!(
        asked(&campaign, Evidence::PositionsAndCurrent),
        Err(ExplainError::NoCurrent)
    ));
}
