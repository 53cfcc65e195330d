//! What the model predicts for a cycle.

use super::energy_balance::Tip;
use crate::config::{Config, PhysicsError};
use worm_physics::MAX_CELLS;
use worm_physics::effect::Setting;
use worm_physics::worm::GRAVITY_M_PER_S2;
use worm_physics::{Motion, Physics, View, Worm, WormError, steady_cycle_of};

/// The model's steady cycle, along the canal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prediction {
    pub(super) advance_m: f64,
    pub(super) energy_loss_j: f64,
    pub(super) energy_positive_j: f64,
    pub(super) forward_slide_m: [f64; MAX_CELLS],
    pub(super) backward_slide_m: [f64; MAX_CELLS],
}

/// The configured worm, and its predictions forward and backward with every `[[effect]]`. The tips and resting deformations that
/// the estimator itself uses follow the paper's theory alone.
#[derive(Debug, Clone)]
pub(super) struct Predictor {
    worm: Worm,
    effects: Vec<Setting>,
    is_found: bool, // whether the worm's bounds were identified
    cycle_s: f64,
    forward: Option<Prediction>,
    backward: Option<Prediction>,
}

impl Predictor {
    pub(super) fn new(config: &Config) -> Result<Self, PhysicsError> {
        Ok(Self {
            worm: Worm::try_from(config)?,
            effects: config.effect_settings()?,
            is_found: false,
            cycle_s: config.gait.cycle_s,
            forward: None,
            backward: None,
        })
    }

    /// The configured tips, seen in forward direction.
    pub(super) fn tips(&self) -> Vec<Tip> {
        let sine = self.worm.slope_rad().sin();
        let cells = self.worm.contacts().iter().zip(self.worm.masses_kg());
        cells
            .map(|(contact, mass_kg)| Tip {
                stiffness_n_per_m: contact.stiffness_n_per_m,
                bound_m: contact.forward_bound_m,
                weight_n: mass_kg * GRAVITY_M_PER_S2 * sine,
            })
            .collect()
    }

    /// Deformation of each tip of a worm that was laid down and is at rest, along the canal, m.
    pub(super) fn resting_deformation_m(&self) -> [f64; MAX_CELLS] {
        let cells = self.worm.cells();
        let mut deformation_m = [f64::NAN; MAX_CELLS];
        let resting = Motion::at_rest(&self.worm, &[0.0; MAX_CELLS][..cells]);
        deformation_m[..cells].copy_from_slice(resting.deformations_m());
        deformation_m
    }

    /// The worm of the predictions.
    pub(super) fn worm(&self) -> &Worm {
        &self.worm
    }

    /// The worm that moves as the model does with all its effects, by the exact motion; none where that does not know one of them.
    pub(super) fn exact_worm(&self) -> Option<Worm> {
        let physics = physics(&self.worm, &self.effects, self.is_found);
        let is_exact = physics.is_piecewise_linear() && physics.view == View::default();
        is_exact.then(|| physics.clamped_worm())
    }

    /// Weight of the worm, N.
    pub(super) fn weight_n(&self) -> f64 {
        self.worm.weight_n()
    }

    /// Changes the bounds; the next prediction is calculated anew.
    ///
    /// # Errors
    /// [`WormError`] when a bound is out of range.
    pub(super) fn set_bounds(&mut self, bound_m: &[f64]) -> Result<(), WormError> {
        self.worm = self.worm.clone().with_max_deformations_m(bound_m)?;
        self.is_found = true;
        (self.forward, self.backward) = (None, None);
        Ok(())
    }

    /// The steady cycle in a direction, calculated on first use.
    pub(super) fn cycle(&mut self, direction: i32) -> Prediction {
        let (kept, sign) = if direction < 0 {
            (&mut self.backward, -1.0)
        } else {
            (&mut self.forward, 1.0)
        };
        *kept.get_or_insert_with(|| {
            let physics = physics(&self.worm, &self.effects, self.is_found);
            let physics = if direction < 0 { physics.mirrored() } else { physics };
            predict(&physics, sign, self.cycle_s)
        })
    }
}

/// A worm with its effects, its bounds as configured or as found.
fn physics(worm: &Worm, effects: &[Setting], is_found: bool) -> Physics {
    let physics = Physics::of(worm.clone());
    if is_found {
        physics.found_with(effects)
    } else {
        physics.with(effects)
    }
}

fn predict(physics: &Physics, sign: f64, cycle_s: f64) -> Prediction {
    let outcome = steady_cycle_of(physics, cycle_s);
    let Some(cycle) = outcome.cycle() else {
        return Prediction {
            advance_m: f64::NAN,
            energy_loss_j: f64::NAN,
            energy_positive_j: f64::NAN,
            forward_slide_m: [f64::NAN; MAX_CELLS],
            backward_slide_m: [f64::NAN; MAX_CELLS],
        };
    };
    let (mut forward_slide_m, mut backward_slide_m) = (cycle.forward_slide_m, cycle.backward_slide_m);
    if sign < 0.0 {
        std::mem::swap(&mut forward_slide_m, &mut backward_slide_m);
    }
    Prediction {
        advance_m: sign * cycle.advance_m,
        energy_loss_j: cycle.energy_loss_j,
        energy_positive_j: cycle.energy_actuator_positive_j,
        forward_slide_m,
        backward_slide_m,
    }
}
