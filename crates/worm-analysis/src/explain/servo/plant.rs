//! A servo as a plant: what it predicts, its nuisances and its effects.

use super::gap::closed;
use super::laws::laws;
use super::nuisance::Nuisance;
use super::predict::{physics, predict};
use super::recorded_servo::RecordedServo;
use super::{starts, supply};
use crate::explain::error::ExplainError;
use crate::explain::search::fit::{Fit, FitWithout};
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::impact::Impact;
use crate::explain::search::law::fitted_law::FittedLaw;
use crate::explain::search::law::offer::Offer;
use crate::explain::search::parameter::{Free, Hypothesised, What};
use crate::explain::search::plant::{Plant, PredictedRun};
use worm_physics::ActsOn;
use worm_physics::effect::SERVO_LIBRARY;
use worm_physics::servo::COUNT_RAD;

/// Residual of a run that the servo could not have made.
const IMPOSSIBLE: f64 = 1e3;
/// Energy that changes of a run's are relative to at least, J.
const LEAST_J: f64 = 0.5;
/// What any model is wrong by from bin to bin, too fast for the discrepancy, as a fraction of the root mean square of the positions.
const TOO_FAST: f64 = 0.06;
/// Variance of the third point of three less the mean of its neighbours, times two, over that of one.
const OF_SECOND_DIFFERENCE: f64 = 6.0;

impl Plant for RecordedServo<'_> {
    fn nuisances(&self) -> Vec<Free> {
        Nuisance::all(&self.nominal.motor)
    }

    fn concerns(&self, _nuisance: usize, _run: usize) -> bool {
        true
    }

    fn hypotheses(&self) -> Vec<Hypothesised> {
        SERVO_LIBRARY
            .map(|effect| Hypothesised::throughout(effect, None))
            .to_vec()
    }

    /// No effect of a servo has a place but the phase of a wave.
    fn stretch_m(&self) -> (f64, f64) {
        (0.0, 1.0)
    }

    fn predict(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> PredictedRun {
        let observed = &self.observed[run];
        let physics = physics(&self.nominal, hypothesis, at);
        let predicted = predict(observed, &physics);
        if !predicted.angle_rad.iter().all(|angle_rad| angle_rad.is_finite()) {
            return PredictedRun {
                residuals: vec![IMPOSSIBLE; observed.bins.len() + 1],
                outcome: f64::NAN,
            };
        }
        let residual_rad = |reading: usize| predicted.angle_rad[reading] - observed.recording.position_rad[reading];
        let mut residuals = self.binned(run, residual_rad);
        residuals.iter_mut().for_each(|rad| *rad /= self.noise_rad);
        // Each run says its part of what all of them say together.
        residuals.push(self.supply.map_or(0.0, |reading| {
            let off_ohm = physics.laws.supply_ohm - reading.ohm;
            off_ohm / reading.sigma_ohm / (self.observed.len() as f64).sqrt()
        }));
        PredictedRun {
            residuals,
            outcome: predicted.energy.electrical_j,
        }
    }

    fn repeats(&self, _hypothesis: &Hypothesis, _at: &[f64]) -> bool {
        false
    }

    fn least_outcome(&self, _run: usize) -> f64 {
        LEAST_J
    }

    /// By the electrical energy of the runs, and by the positions: over the limit times their root mean square.
    fn impact(&self, fit: &Fit, place: usize, limit: f64) -> Impact {
        let free = fit.hypothesis.free.iter().zip(&fit.at);
        let without: Vec<f64> = free
            .map(|(free, &at)| match free.what {
                What::Effect {
                    place: here,
                    parameter: 0,
                } if here == place => free.quantity.centre,
                _ => at,
            })
            .collect();
        let [on, off] = [&fit.at, &without].map(|at| physics(&self.nominal, &fit.hypothesis, at));
        let limit_rad = (limit * self.rms_position_rad()).max(COUNT_RAD);
        let mut impact = Impact::default();
        for observed in &self.observed {
            let [on, off] = [&on, &off].map(|physics| predict(observed, physics));
            let [on_j, off_j] = [&on, &off].map(|predicted| predicted.energy.electrical_j);
            impact.energy = impact
                .energy
                .max((on_j - off_j).abs() / off_j.abs().max(LEAST_J) / limit);
            let squares = on
                .angle_rad
                .iter()
                .zip(&off.angle_rad)
                .map(|(on, off)| (on - off).powi(2));
            let rms_rad = (squares.sum::<f64>() / on.angle_rad.len() as f64).sqrt();
            impact.position = impact.position.max(rms_rad / limit_rad);
        }
        impact
    }

    fn closed(
        &self,
        open: (&Fit, &[&FitWithout]),
        left: (&Fit, &[&FitWithout]),
        discrepancy_rad: f64,
    ) -> Option<[f64; 2]> {
        let (_, interval) = closed(self, open, left, self.noise_rad.hypot(discrepancy_rad));
        if interval.iter().all(|end| end.is_finite()) {
            return Some(interval);
        }
        // All of the gap may be what any model is wrong by. Then an effect must close some of it at least, beyond its error.
        let (_, of_noise) = closed(self, open, left, self.scatter_rad);
        (of_noise[0] <= 0.0).then_some([0.0, 0.0])
    }

    /// The offset of the zero angle is a nuisance and an effect.
    fn with_whole_effects(&self, mut fit: Fit) -> Fit {
        let free = &fit.hypothesis.free;
        let nuisance = free
            .iter()
            .position(|free| Nuisance::of(free.what) == Some(Nuisance::Zero));
        let effect = free.iter().position(|free| match free.what {
            What::Effect { place, parameter: 0 } => fit.hypothesis.hypothesised[place].effect.name == "zero-offset",
            _ => false,
        });
        if let Some((nuisance, effect)) = nuisance.zip(effect) {
            fit.at[effect] += std::mem::take(&mut fit.at[nuisance]);
        }
        fit
    }

    /// What no smooth discrepancy can follow: how far the residual of a bin is from the mean of its neighbours, and what any model is wrong by
    /// that fast.
    fn measure_noise(&mut self, hypothesis: &Hypothesis, at: &[f64]) -> Result<(), ExplainError> {
        let physics = physics(&self.nominal, hypothesis, at);
        self.supply = supply::read(&self.observed, &physics);
        let (mut square, mut count) = (0.0, 0.0);
        for (run, observed) in self.observed.iter().enumerate() {
            let predicted = predict(observed, &physics);
            let residual_rad = self.binned(run, |reading| {
                predicted.angle_rad[reading] - observed.recording.position_rad[reading]
            });
            for three in residual_rad.windows(3) {
                square += (three[0] - 2.0 * three[1] + three[2]).powi(2) / OF_SECOND_DIFFERENCE;
                count += 1.0;
            }
        }
        let quantum_rad = COUNT_RAD / 12.0_f64.sqrt();
        let of_law_rad = TOO_FAST * self.rms_position_rad();
        self.scatter_rad = (square / f64::max(count, 1.0)).sqrt().max(quantum_rad);
        self.noise_rad = self.scatter_rad.hypot(of_law_rad);
        Ok(())
    }

    fn judge_assumptions(&mut self, _hypothesis: &Hypothesis, _at: &[f64]) -> bool {
        false
    }

    fn settle(&mut self, _hypothesis: &Hypothesis, _at: &[f64]) {}

    fn another_start(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        starts::another(hypothesis, at)
    }

    fn recalibration_starts(&self, hypothesis: &Hypothesis) -> Vec<Vec<f64>> {
        starts::of_recalibration(hypothesis, &self.nominal.pendulum)
    }

    fn other_starts(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<Vec<f64>> {
        starts::others(hypothesis, at, &self.nominal.pendulum)
    }

    fn laws(&self, recalibrated: &Fit) -> Vec<Offer> {
        laws(self, recalibrated)
    }

    /// What any model of a servo is wrong by is a tenth of its motion, in which a wrong friction hides.
    fn weighs_laws(&self) -> bool {
        true
    }

    /// Friction that is the same everywhere is dry friction: a law begins with none, as far as dry friction can take it.
    fn with_whole_law(&self, mut law: FittedLaw) -> FittedLaw {
        let is_dry = |free: &Free| Nuisance::of(free.what) == Some(Nuisance::Dry);
        let dry = law.fit.hypothesis.free.iter().position(is_dry);
        if let (ActsOn::MotorFriction, Some(dry)) = (law.shape.acts_on, dry) {
            let least_n_m = law.fit.hypothesis.free[dry].quantity.min;
            let first_n_m = law
                .value
                .first()
                .copied()
                .unwrap_or(0.0)
                .max(least_n_m - law.fit.at[dry]);
            law.fit.at[dry] += first_n_m;
            law.shift(-first_n_m);
        }
        law
    }

    fn discrepancy_unit(&self) -> f64 {
        self.rms_position_rad()
    }
}
