//! The search on the real recordings of a servo, and on those of a servo that was simulated.

use std::path::Path;
use worm_analysis::bench::{BenchCampaign, ServoRecording};
use worm_analysis::explain::servo::answer::ServoAnswer;
use worm_analysis::explain::servo::{Bench, DISCREPANCY, Measures, explain_servo, prediction_errors};
use worm_analysis::explain::{Options, Verdict};
use worm_physics::servo::{COUNT_RAD, Command, LONGEST_STEP_S, SPEED_COUNT_RAD_S, ServoMotion, ServoPhysics};

fn real() -> (BenchCampaign, Vec<ServoRecording>) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/xl330-bench/bench.toml");
    let campaign = BenchCampaign::load(&file).expect("the campaign that is shipped");
    let recordings = campaign.open_all().expect("the recordings that are shipped");
    (campaign, recordings)
}

fn explain(campaign: &BenchCampaign, recordings: &[ServoRecording]) -> ServoAnswer {
    let options = Options {
        discrepancy: DISCREPANCY,
        ..Options::default()
    };
    explain_servo(&Bench::new(campaign, recordings), &options, &mut |_| ()).expect("an answer")
}

/// The twelve recordings: what no usual model has is friction by the load on the gears.
#[test]
fn friction_by_the_load_is_named_on_the_real_servo() {
    let (campaign, recordings) = real();
    let answer = explain(&campaign, &recordings);
    println!("{}", worm_analysis::report::servo::text(&answer));
    let names: Vec<&str> = answer.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert!(names.iter().any(|name| name.starts_with("load-")), "{}", answer.sentence);
    assert_eq!(answer.current.measures, Some(Measures::Duty), "{}", answer.current.sentence);
    let mean = |of: usize| {
        let all = answer.runs.iter().map(|run| run.mean_absolute_error_rad[of]);
        all.sum::<f64>() / answer.runs.len() as f64
    };
    let (recalibrated, named) = (mean(1), mean(2));
    assert!(named < 0.030 && named < 0.65 * recalibrated, "{named} rad of {recalibrated}");
    // What is written back predicts what was found.
    let errors = prediction_errors(&Bench::new(&campaign, &recordings), &answer.figures.model);
    let predicted = errors.iter().map(|run| run.mean_absolute_error_rad).sum::<f64>() / errors.len() as f64;
    assert!((predicted / named - 1.0).abs() < 0.02, "{predicted} rad for {named}");
    assert!(errors.iter().all(|run| run.mean_absolute_error_a < 0.1), "the duty follows from the position");
}

/// The goals of the real recordings, with the readings of a simulated servo.
fn simulated(campaign: &BenchCampaign, recordings: &[ServoRecording], physics: &ServoPhysics) -> Vec<ServoRecording> {
    let of_run = |(run, recording): (&worm_analysis::bench::BenchRun, &ServoRecording)| {
        let mut simulated = recording.clone();
        simulated.input_v.clear();
        let mut motion = ServoMotion::new(recording.position_rad[0], 0.0, 30.0);
        for reading in 0..recording.readings() {
            let before = reading.saturating_sub(1);
            let command = Command {
                gain: run.gain,
                goal_rad: recording.goal_rad[before],
                torque_enabled: recording.torque_enabled[before],
            };
            if reading > 0 {
                let passed_s = recording.time_s[reading] - recording.time_s[before];
                motion.advance(physics, &command, passed_s, 0.2 * LONGEST_STEP_S);
            }
            simulated.position_rad[reading] = (motion.angle_rad() / COUNT_RAD).round() * COUNT_RAD;
            simulated.velocity_rad_s[reading] = (motion.velocity_rad_s() / SPEED_COUNT_RAD_S).round() * SPEED_COUNT_RAD_S;
            simulated.current_a[reading] = (1e3 * motion.current_a(physics, &command)).round() * 1e-3;
        }
        simulated
    };
    campaign.runs.iter().zip(recordings).map(of_run).collect()
}

/// A servo off nominal without an effect, and the same with one: the first is clean, and the second named; its current is the winding's.
#[test]
fn a_simulated_servo_is_clean_without_an_effect_and_named_with_one() {
    let (mut campaign, mut recordings) = real();
    // A subset is enough, and quicker.
    let kept = ["lift_and_drop-p200", "sin_sin-p400", "sin_time_square-p200", "up_and_down-p400"];
    let is_kept = |path: &Path| kept.iter().any(|name| path.ends_with(format!("{name}.csv")));
    campaign.runs.retain(|run| is_kept(&run.recording));
    recordings.retain(|recording| is_kept(&recording.source));
    assert_eq!((campaign.runs.len(), recordings.len()), (4, 4));
    let mut physics = campaign.model.on(campaign.pendulum, campaign.supply_v);
    physics.motor.winding_ohm *= 1.1;
    physics.motor.dry_n_m *= 1.5;
    let clean = explain(&campaign, &simulated(&campaign, &recordings, &physics));
    assert_eq!(clean.verdict, Verdict::Agrees, "{}", clean.sentence);
    physics.laws.play_rad = 0.06;
    let loose = explain(&campaign, &simulated(&campaign, &recordings, &physics));
    assert!(loose.effects.iter().any(|effect| effect.name == "gear-backlash"), "{}", loose.sentence);
    assert_eq!(loose.current.measures, Some(Measures::Winding), "{}", loose.current.sentence);
}
