//! The run that would best decide between rivals: one of the trajectories at another gain, or with another mass.

use super::answer::{NextRun, RunPrediction};
use super::observed::Observed;
use super::predict::predict;
use super::recorded_servo::RecordedServo;
use crate::explain::search::judge::candidate::Candidate;
use rayon::prelude::*;

/// Gains that are tried, and factors on the mass at the end of the arm.
const GAINS: [f64; 6] = [50.0, 100.0, 200.0, 400.0, 800.0, 1600.0];
const MASSES: [f64; 3] = [0.5, 1.5, 2.0];
/// Independent values in a second.
const PER_S: f64 = 5.0;

/// A run that could be made.
struct Trial<'s, 'a> {
    observed: &'s Observed<'a>,
    gain: f64,
    mass: f64,
}

/// The run that best separates the rivals; none where there are fewer than two.
pub(super) fn propose(servo: &RecordedServo<'_>, rivals: &[Candidate], discrepancy_rad: f64) -> Option<NextRun> {
    if rivals.len() < 2 {
        return None;
    }
    let mut trajectories: Vec<&Observed<'_>> = Vec::new();
    for observed in &servo.observed {
        if !trajectories.iter().any(|other| other.trajectory == observed.trajectory) {
            trajectories.push(observed);
        }
    }
    let recorded = |observed: &Observed<'_>, gain: f64| {
        let mut same = servo
            .observed
            .iter()
            .filter(|other| other.trajectory == observed.trajectory);
        same.any(|other| other.gain == gain)
    };
    let trials: Vec<Trial<'_, '_>> = trajectories
        .iter()
        .flat_map(|observed| {
            let gains = GAINS.into_iter().filter(|gain| !recorded(observed, *gain));
            let by_gain = gains.map(|gain| Trial {
                observed,
                gain,
                mass: 1.0,
            });
            let by_mass = MASSES.into_iter().map(|mass| Trial {
                observed,
                gain: observed.gain,
                mass,
            });
            by_gain.chain(by_mass).collect::<Vec<_>>()
        })
        .collect();
    let floor_rad = servo.noise_rad.hypot(discrepancy_rad);
    let angles = |trial: &Trial<'_, '_>| -> Vec<Vec<f64>> {
        let observed = Observed {
            gain: trial.gain,
            ..trial.observed.clone()
        };
        let of_rival = |rival: &Candidate| {
            let mut physics = servo.physics(&rival.fit);
            physics.pendulum.mass_kg *= trial.mass;
            predict(&observed, &physics).angle_rad
        };
        rivals.iter().map(of_rival).collect()
    };
    let separation = |trial: &Trial<'_, '_>| {
        let angles = angles(trial);
        let independent = PER_S * trial.observed.recording.duration_s();
        let apart = |a: &[f64], b: &[f64]| {
            let square = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64;
            (square * independent).sqrt() / floor_rad
        };
        let pairs = (0..angles.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
        pairs
            .map(|(one, other)| apart(&angles[one], &angles[other]))
            .fold(f64::INFINITY, f64::min)
    };
    let separations: Vec<f64> = trials.par_iter().map(separation).collect();
    let best = (0..trials.len()).max_by(|&a, &b| separations[a].total_cmp(&separations[b]))?;
    let trial = &trials[best];
    let trajectory = trial.observed.trajectory_name.clone();
    let (change, value, unit, description) = if trial.mass == 1.0 {
        let text = format!("run {trajectory} with a position P gain of {}", trial.gain);
        ("position_p_gain", trial.gain, "", text)
    } else {
        let mass_kg = servo.nominal.pendulum.mass_kg * trial.mass;
        let text = format!("run {trajectory} with {mass_kg:.3} kg at the arm, gain {}", trial.gain);
        ("mass_kg", mass_kg, "kg", text)
    };
    let predictions = rivals.iter().zip(angles(trial)).map(|(rival, angles)| {
        let names: Vec<&str> = rival.named().map(|(_, one)| one.effect.name).collect();
        let largest = angles.iter().fold(0.0, |most: f64, angle| most.max(angle.abs()));
        RunPrediction {
            effect: names.join(" with "),
            largest_angle_rad: largest,
            description: format!("the arm reaches {:.1}°", largest.to_degrees()),
        }
    });
    Some(NextRun {
        change,
        value,
        unit,
        trajectory,
        description,
        predictions: predictions.collect(),
        separation_sigma: separations[best],
    })
}
