//! Where the fits of a servo start. Where an arm comes to rest changes by leaps, so there are many minima, most of them along the dry friction.
//!
//! Frictions of the starts are fractions of the torque that holds the arm level, and not of the nominal frictions, for how far those are off
//! nobody knows.

use super::nuisance::Nuisance;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::parameter::{Free, What};
use worm_physics::servo::Pendulum;

/// Starts of every fit: dry friction over the torque that holds the arm level, factor on the severities, fractions, and whether the other
/// nuisances are nominal.
const OF_EVERY_FIT: [(f64, f64, f64, bool); 4] = [
    (0.021, 1.0, 0.9, true),
    (0.0125, 0.5, 0.95, false),
    (0.05, 1.3, 0.4, true),
    (0.025, 1.0, 0.55, false),
];
/// Starts of a recalibration: dry friction over that torque, and viscous friction over it, s.
const DRY: [f64; 9] = [0.005, 0.01, 0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.25];
const VISCOUS_S: [f64; 2] = [0.01, 0.03];

/// With half of the dry friction and more of the viscous one, an arm that swings does much the same.
pub(super) fn another(hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
    let free = hypothesis.free.iter().zip(at);
    free.map(|(free, &value)| match Nuisance::of(free.what) {
        Some(Nuisance::Dry) => 0.5 * value,
        Some(Nuisance::Viscous) => (2.0 * value).clamp(free.quantity.centre, free.quantity.max),
        _ => value,
    })
    .collect()
}

/// Frictions of every size, with everything else nominal.
pub(super) fn of_recalibration(hypothesis: &Hypothesis, pendulum: &Pendulum) -> Vec<Vec<f64>> {
    let level_n_m = pendulum.level_torque_n_m();
    let start = |dry: f64, viscous_s: f64| -> Vec<f64> {
        let of = |free: &Free| {
            let start = match Nuisance::of(free.what) {
                Some(Nuisance::Dry) => dry * level_n_m,
                Some(Nuisance::Viscous) => viscous_s * level_n_m,
                _ => free.quantity.centre,
            };
            start.clamp(free.quantity.min, free.quantity.max)
        };
        hypothesis.free.iter().map(of).collect()
    };
    DRY.iter()
        .flat_map(|&dry| VISCOUS_S.map(|viscous_s| start(dry, viscous_s)))
        .collect()
}

/// With little and with much dry friction, effects weaker and stronger, and pressed gears at either end.
pub(super) fn others(hypothesis: &Hypothesis, at: &[f64], pendulum: &Pendulum) -> Vec<Vec<f64>> {
    let level_n_m = pendulum.level_torque_n_m();
    let start = |&(dry, severity, fraction, is_nominal): &(f64, f64, f64, bool)| -> Vec<f64> {
        let free = hypothesis.free.iter().zip(at);
        free.map(|(free, &value)| {
            let quantity = &free.quantity;
            let start = match (free.what, Nuisance::of(free.what)) {
                (_, Some(Nuisance::Table(_))) => value,
                (_, Some(Nuisance::Dry)) => dry * level_n_m,
                (_, Some(_)) if is_nominal => quantity.centre,
                (What::Effect { parameter: 0, .. }, _) => quantity.centre + severity * (value - quantity.centre),
                (What::Effect { place, parameter }, _)
                    if hypothesis.hypothesised[place].effect.parameters[parameter].is_fraction() =>
                {
                    fraction
                }
                _ => value,
            };
            start.clamp(quantity.min, quantity.max)
        })
        .collect()
    };
    OF_EVERY_FIT.iter().map(start).collect()
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{campaign, recalibrated, record};
    use super::super::gap::{mean_absolute, residual_rad};

    /// A dry friction that grows sevenfold in a run leaves minima on both sides of its mean.
    #[test]
    fn recalibration_comes_as_near_from_a_small_nominal_friction_as_from_a_large_one() {
        let mut campaign = campaign();
        let mut servo = campaign
            .model
            .on(campaign.pendulum, campaign.supply_v, campaign.duty_limit);
        servo.motor.dry_n_m = 0.02;
        let recordings = record(&campaign, &servo, 6.0);
        let mut left_rad = [1.0, 2.0, 3.0].map(|factor| {
            campaign.model.motor.dry_n_m = factor * servo.motor.dry_n_m;
            recalibrated(&campaign, &recordings, |recorded, fit| {
                let of_run = |run: usize| mean_absolute(&residual_rad(recorded, run, fit));
                (0..recordings.len()).map(of_run).sum::<f64>() / recordings.len() as f64
            })
        });
        left_rad.sort_by(f64::total_cmp);
        assert!(left_rad[2] < 1.15 * left_rad[0], "{left_rad:?} rad");
    }
}
