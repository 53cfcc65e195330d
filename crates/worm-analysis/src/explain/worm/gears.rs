//! What the gears between motor and cam, and the dampers in the pads, make of the torque.
//!
//! The torque at the cam is what the motor's current leaves after a model of the gears ([`GearModel`]). That model's errors are free with
//! the priors of the configuration, as in self-sensing: a torque that is always there (dry and viscous friction are one at one speed), a
//! share of the torque itself (the torque constant), and a share of its magnitude (friction by the load).
//!
//! The crawl damps the body as a whole, which is all that positions show. The damper of a pad also bears on the drive: while the pad is
//! loaded, its force is ahead by the damper over the spring, 2 ζ √(M / Σ k) where all damping is in the pads. How much of it is, is free,
//! and may be less than nothing: of a body with next to no mass, the crawl's own torque is ahead by about as much.

use super::nuisance::Nuisance;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::parameter::Free;
use worm_estimator::self_sensing::GearModel;
use worm_physics::Worm;

/// How far each may be from what is known, in standard deviations.
const REACH: f64 = 4.0;
/// Step of derivatives, in standard deviations: the torque is linear in each.
const STEP: f64 = 0.1;

/// Of the share of the damping that bears on the drive: centre, standard deviation, least, most, step.
const IN_PADS: (f64, f64, f64, f64, f64) = (0.5, 0.7, -2.0, 3.0, 0.05);

/// Errors of the model of the gears.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::explain) struct GearErrors {
    /// Torque beyond the gears' friction, N m.
    pub offset_n_m: f64,
    /// Share by which the torque is wrong.
    pub gain: f64,
    /// Friction for each torque on the gears, beyond the known one.
    pub load: f64,
    /// By how much the torque of a pad that is being loaded is ahead, s.
    pub lead_s: f64,
}

impl GearErrors {
    /// Those of a hypothesis at some values, of a worm whose body has a damping ratio.
    pub fn of(hypothesis: &Hypothesis, at: &[f64], (worm, damping_ratio): (&Worm, f64)) -> Self {
        let mut errors = Self::default();
        let mut in_pads = IN_PADS.0;
        for (free, &value) in hypothesis.free.iter().zip(at) {
            match Nuisance::of(free.what) {
                Some(Nuisance::GearOffset) => errors.offset_n_m = value,
                Some(Nuisance::TorqueGain) => errors.gain = value,
                Some(Nuisance::GearLoad) => errors.load = value,
                Some(Nuisance::PadDamping) => in_pads = value,
                _ => {}
            }
        }
        let stiffness_n_per_m: f64 = worm.contacts().iter().map(|contact| contact.stiffness_n_per_m).sum();
        errors.lead_s = in_pads * 2.0 * damping_ratio * (worm.mass_kg() / stiffness_n_per_m).sqrt();
        errors
    }

    /// What the current shows of a torque on a cam that turns forward, N m.
    pub fn shown_n_m(&self, cam_n_m: f64) -> f64 {
        cam_n_m * (1.0 + self.gain) + self.offset_n_m + self.load * cam_n_m.abs()
    }

    /// The torque on the cam where the current shows this one, N m.
    pub fn cam_n_m(&self, shown_n_m: f64) -> f64 {
        let free_n_m = shown_n_m - self.offset_n_m;
        free_n_m / (1.0 + self.gain + self.load * free_n_m.signum())
    }
}

/// What is not known exactly of gears, with priors.
pub(in crate::explain) fn nuisances(gear: &GearModel) -> Vec<Free> {
    let of_gears = [
        (Nuisance::GearOffset, gear.friction_sigma_n_m),
        (Nuisance::TorqueGain, gear.torque_constant_sigma),
        (Nuisance::GearLoad, gear.load_friction_sigma),
    ]
    .map(|(nuisance, sigma)| nuisance.free_by_sigma(sigma, REACH, STEP));
    let mut all = of_gears.to_vec();
    all.push(Nuisance::PadDamping.free_within(IN_PADS));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_current_shows_leads_back_to_the_torque() {
        let errors = GearErrors {
            offset_n_m: -0.004,
            gain: 0.05,
            load: 0.03,
            lead_s: 0.0,
        };
        for (cam_n_m, shown_n_m) in [(0.02, 0.0176), (0.0, -0.004), (-0.01, -0.0142)] {
            assert!((errors.shown_n_m(cam_n_m) - shown_n_m).abs() < 1e-12, "{cam_n_m}");
            assert!((errors.cam_n_m(shown_n_m) - cam_n_m).abs() < 1e-12, "{shown_n_m}");
        }
    }

    #[test]
    fn dampers_in_the_pads_are_ahead_by_damper_over_spring() {
        let worm = Worm::paper();
        let hypothesis = Hypothesis::new(&[Nuisance::PadDamping.free_within(IN_PADS)], &[]);
        // Of a body of m on pads of k in all, a ratio of ζ is a damper of c = 2 ζ √(k m), and ahead by c / k.
        let pads_n_per_m: f64 = worm.contacts().iter().map(|contact| contact.stiffness_n_per_m).sum();
        let damper_n_s_per_m = 2.0 * 0.4 * (pads_n_per_m * worm.mass_kg()).sqrt();
        let errors = GearErrors::of(&hypothesis, &[1.0], (&worm, 0.4));
        assert!(
            (errors.lead_s - damper_n_s_per_m / pads_n_per_m).abs() < 1e-12,
            "{errors:?}"
        );
    }
}
