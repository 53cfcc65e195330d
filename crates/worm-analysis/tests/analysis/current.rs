//! The motor's current as evidence: what positions cannot tell apart, as forces over stiffness are all that they show.

use testkit::hidden_effects::campaign::{HiddenCampaign, draw_with_phase_sized};
use testkit::hidden_effects::effect::{Effect, SeverityRange};
use testkit::hidden_effects::hidden::{Hidden, Twin};
use testkit::hidden_effects::setting::CampaignSize;
use worm_analysis::explain::{Answer, ExplainError, Options, Verdict, explain};

/// In no range of the splits.
const SEED: u64 = 902;
const SIZE: CampaignSize = CampaignSize {
    runs: 2,
    cycles: 8.0,
    rate_hz: 60.0,
};
/// A payload of 100 to 150 g, a third of the worm's own mass.
const HEAVY: SeverityRange = SeverityRange { from: 0.88, to: 1.0 };

fn asked(campaign: &HiddenCampaign, with_current: bool) -> Result<Answer, ExplainError> {
    let options = Options {
        with_current,
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
    let by_positions = asked(&softer, false).expect("an answer");
    assert_eq!(
        first(&by_positions),
        Some("payload"),
        "positions show force over stiffness"
    );
    let by_both = asked(&softer, true).expect("an answer");
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
    let by_both = asked(&loaded, true).expect("an answer");
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

#[test]
fn current_that_nobody_recorded_is_no_evidence() {
    let mut campaign = draw_with_phase_sized(Hidden::Clean, SEED, CampaignSize::SMALL);
    campaign
        .recordings
        .iter_mut()
        .for_each(|recording| recording.motor = None);
    assert!(matches!(asked(&campaign, true), Err(ExplainError::NoCurrent)));
}
