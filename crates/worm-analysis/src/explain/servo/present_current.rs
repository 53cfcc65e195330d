//! What a servo reports as its current: the winding's, the supply's, or none at all.
//!
//! Each is predicted from what was recorded (goal, position, velocity) and the motor of the answer, and compared with what was reported.
//! The winding's resistance is known to some per cent, so each prediction may be scaled by that. What is left is not independent from
//! reading to reading, so a second counts as two independent values: the odds of two hypotheses are then the ratio of what they leave,
//! to the power of that count.

use super::answer::{CurrentHypothesis, Measures, PresentCurrent};
use super::observed::Observed;
use worm_estimator::number::significant;
use worm_physics::servo::ServoPhysics;
use worm_physics::servo::physics::PWM_STEPS;

/// Independent values in a second.
const PER_S: f64 = 2.0;
/// How far a prediction may be scaled.
const SCALE: std::ops::RangeInclusive<f64> = 0.75..=1.33;
/// Steps by which the reported current may be older than the position, readings.
const LAGS: [f64; 3] = [0.0, 0.5, 1.0];
/// Log odds beyond which nobody should be surer: some other reading of a register is always possible.
const SUREST: f64 = 7.0;
/// What is left by the step in which a current is reported, A.
const QUANTUM_A: f64 = 3e-4;

/// The current that a reading would report, A.
pub(super) fn reported_a(measures: Measures, duty: f64, winding_a: f64) -> f64 {
    match measures {
        Measures::Winding => winding_a,
        Measures::Supply => duty.abs() * winding_a,
        Measures::Duty => duty * 1e-3 * PWM_STEPS,
    }
}

/// Weighs the hypotheses.
pub(super) fn decide(observed: &[Observed<'_>], physics: &ServoPhysics) -> PresentCurrent {
    let mut seconds = 0.0;
    let mut values: Vec<(f64, [[f64; LAGS.len()]; 3])> = Vec::new();
    for run in observed {
        let recording = run.recording;
        let mut last = [[0.0; 3]; 2];
        for reading in 1..recording.readings() {
            let command = run.command(reading);
            if !command.torque_enabled {
                break;
            }
            let duty = physics.duty(command.gain, command.goal_rad, recording.position_rad[reading]);
            let winding_a = physics.current_a(duty, run.velocity_rad_s[reading], 25.0);
            let now = Measures::ALL.map(|measures| reported_a(measures, duty, winding_a));
            last = [now, if reading == 1 { now } else { last[0] }];
            let lagged = [0, 1, 2].map(|of| LAGS.map(|lag| (1.0 - lag) * last[0][of] + lag * last[1][of]));
            values.push((recording.current_a[reading], lagged));
            seconds += recording.time_s[reading] - recording.time_s[reading - 1];
        }
    }
    let spread = values.iter().map(|(reported, _)| reported * reported).sum::<f64>();
    let count = (values.len() as f64).max(1.0);
    let rms_a = |of: usize, lag: usize| {
        let (mut product, mut square) = (0.0, 0.0);
        for (reported, predicted) in &values {
            product += reported * predicted[of][lag];
            square += predicted[of][lag].powi(2);
        }
        let is_known = Measures::ALL[of] == Measures::Duty;
        let scale = match is_known {
            true => 1.0,
            false => (product / square.max(1e-30)).clamp(*SCALE.start(), *SCALE.end()),
        };
        let left = values
            .iter()
            .map(|(reported, predicted)| (reported - scale * predicted[of][lag]).powi(2));
        (left.sum::<f64>() / count).sqrt().max(QUANTUM_A)
    };
    let mut hypotheses: Vec<CurrentHypothesis> = Measures::ALL
        .into_iter()
        .enumerate()
        .map(|(of, measures)| CurrentHypothesis {
            measures,
            rms_a: (0..LAGS.len()).map(|lag| rms_a(of, lag)).fold(f64::INFINITY, f64::min),
            ln_odds: 0.0,
        })
        .collect();
    let independent = PER_S * seconds;
    let ln_odds = |one: f64, other: f64| (independent * (other / one).ln()).clamp(-SUREST, SUREST);
    let ln_odds_winding_over_supply = ln_odds(hypotheses[0].rms_a, hypotheses[1].rms_a);
    hypotheses.sort_by(|a, b| a.rms_a.total_cmp(&b.rms_a));
    let best = hypotheses[0].rms_a;
    hypotheses
        .iter_mut()
        .for_each(|one| one.ln_odds = ln_odds(one.rms_a, best));
    let whole: f64 = hypotheses.iter().map(|one| one.ln_odds.exp()).sum();
    let reported_rms_a = (spread / count).sqrt();
    // What leaves most of the current unexplained measures something else.
    let is_told = independent > 0.0 && reported_rms_a > 3.0 * QUANTUM_A && best < 0.5 * reported_rms_a;
    let ma = |a: f64| significant(1e3 * a, 2);
    let left: Vec<String> = hypotheses[1..]
        .iter()
        .map(|one| format!("{} leaves {} mA", one.measures.in_words(), ma(one.rms_a)))
        .collect();
    let sentence = if is_told {
        format!(
            "What the servo reports as its current is {} (it leaves {} mA of {}; {}).",
            hypotheses[0].measures.in_words(),
            ma(best),
            ma(reported_rms_a),
            left.join(", ")
        )
    } else {
        "What the servo reports as its current cannot be told from these recordings.".to_owned()
    };
    PresentCurrent {
        measures: is_told.then_some(hypotheses[0].measures),
        probability: if is_told { 1.0 / whole } else { f64::NAN },
        hypotheses,
        ln_odds_winding_over_supply,
        sentence,
    }
}
