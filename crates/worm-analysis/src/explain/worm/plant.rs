//! The worm as a plant: what it predicts, its nuisances and its effects.

use super::binning::bins;
use super::gap::closed;
use super::gears;
use super::irregularity;
use super::laws::laws;
use super::matters::impact;
use super::misstated_conditions;
use super::noise::RunNoise;
use super::nuisance::Nuisance;
use super::observed::Observed;
use super::period;
use super::prepare::judge_start;
use super::recorded_worm::RecordedWorm;
use super::residual::Residual;
use super::sway;
use super::torque_noise::TorqueNoise;
use super::torque_residual;
use super::whole_effects::with_whole_effects;
use crate::explain::error::ExplainError;
use crate::explain::search::fit::{Fit, FitWithout};
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::impact::Impact;
use crate::explain::search::law::offer::Offer;
use crate::explain::search::misstatement::Misstatement;
use crate::explain::search::parameter::{Free, Hypothesised};
use crate::explain::search::plant::{BodyMotion, Plant, PredictedRun, Recorded};
use worm_physics::Physics;
use worm_physics::effect::{Effect, LIBRARY, Scope};

/// Residual of a run that the worm could not have made.
const IMPOSSIBLE: f64 = 1e3;
/// Logarithm of the damping ratio of a heavily damped body.
const HEAVILY_DAMPED: f64 = std::f64::consts::LN_2;
/// How far behind the last cell's first place a tip may be, m.
const BEHIND_M: f64 = 0.02;

/// Every hypothesis about a single effect that positions can show.
pub(in crate::explain) fn hypotheses(cells: usize, phase_recorded: bool) -> Vec<Hypothesised> {
    hypotheses_of(cells, |effect| effect.is_visible_in_positions(phase_recorded))
}

/// Every hypothesis about a single effect of some.
fn hypotheses_of(cells: usize, is_visible: impl Fn(&Effect) -> bool) -> Vec<Hypothesised> {
    let mut all = Vec::new();
    for &effect in &LIBRARY {
        if !is_visible(effect) {
            continue;
        }
        if effect.scope != Scope::OneCell {
            all.push(Hypothesised::throughout(effect, None));
        }
        if effect.scope != Scope::Worm {
            all.extend((0..cells).map(|cell| Hypothesised::throughout(effect, Some(cell))));
        }
    }
    all
}

impl Plant for RecordedWorm<'_> {
    fn nuisances(&self) -> Vec<Free> {
        let (cells, runs, phase_recorded) = (self.channels(), self.runs(), self.phase_recorded());
        match self.gear() {
            Some(gear) => {
                let mut all = Nuisance::all_by_forces(cells, runs, phase_recorded, self.sees_positions());
                all.extend(gears::nuisances(gear));
                all
            }
            None => Nuisance::all(cells, runs, phase_recorded),
        }
    }

    fn concerns(&self, nuisance: usize, run: usize) -> bool {
        Nuisance::of_number(nuisance).concerns(run)
    }

    fn hypotheses(&self) -> Vec<Hypothesised> {
        let mut all = match self.sees_positions() {
            true => hypotheses(self.channels(), self.phase_recorded()),
            false => hypotheses_of(self.channels(), Effect::is_visible_in_forces),
        };
        let without_twins = self.counts_current();
        all.iter_mut().for_each(|one| one.without_twins = without_twins);
        all
    }

    fn misstatements(&self, base: &Hypothesis) -> Vec<Misstatement> {
        misstated_conditions::misstatements(self, base)
    }

    /// The stretch of canal where tips have been, or may have been where nobody saw them.
    fn stretch_m(&self) -> (f64, f64) {
        let places_m = |(observed, physics): (&Observed<'_>, &Physics)| -> Vec<f64> {
            if observed.sees_positions {
                return observed.position_m.concat();
            }
            let cycles = observed.phase[observed.samples() - 1] - observed.phase[0];
            let reach_m = cycles * physics.worm.stroke_m();
            observed
                .first_m
                .iter()
                .flat_map(|at_m| [*at_m, at_m + reach_m])
                .collect()
        };
        let runs = self.scene.observed.iter().zip(&self.scene.nominal);
        let (min_m, max_m) = runs
            .flat_map(places_m)
            .filter(|at_m| at_m.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(min_m, max_m), at_m| {
                (f64::min(min_m, at_m), f64::max(max_m, at_m))
            });
        (min_m - BEHIND_M, max_m)
    }

    fn predict(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> PredictedRun {
        let observed = &self.scene.observed[run];
        match self.scene.predict(run, hypothesis, at) {
            Some(predicted) => PredictedRun {
                residuals: self.whitened(
                    run,
                    &Residual::binned(observed, &self.bins[run], &predicted),
                    &torque_residual::residual_n_m(observed, &self.bins[run], &predicted),
                ),
                outcome: predicted.advance_m(observed),
            },
            None => PredictedRun {
                residuals: vec![IMPOSSIBLE; self.rows(run)],
                outcome: f64::NAN,
            },
        }
    }

    fn repeats(&self, hypothesis: &Hypothesis, at: &[f64]) -> bool {
        self.scene.repeats(0, hypothesis, at)
    }

    fn least_outcome(&self, run: usize) -> f64 {
        self.least_advance_m(run)
    }

    fn impact(&self, fit: &Fit, place: usize, limit: f64) -> Impact {
        impact(self, fit, place, limit)
    }

    fn body_motion(&self, fit: &Fit, usual_scatter: f64) -> BodyMotion {
        let predicted = self.predictions(fit);
        BodyMotion {
            from_cycle_to_cycle: period::ln_bayes(self, &predicted),
            within_cycles: sway::ln_bayes(self, &predicted),
            irregular: irregularity::ln_bayes(self, &predicted, usual_scatter),
        }
    }

    fn closed(
        &self,
        open: (&Fit, &[&FitWithout]),
        left: (&Fit, &[&FitWithout]),
        discrepancy_m: f64,
    ) -> Option<[f64; 2]> {
        closed(self, open, left, discrepancy_m)
    }

    fn asks_seconds_to_close(&self) -> bool {
        !self.sees_positions()
    }

    fn with_whole_effects(&self, fit: Fit) -> Fit {
        with_whole_effects(fit)
    }

    fn measure_noise(&mut self, hypothesis: &Hypothesis, at: &[f64]) -> Result<(), ExplainError> {
        self.bins = self.scene.observed.iter().map(bins).collect();
        self.noise.clear();
        self.torque_noise.clear();
        for (run, observed) in self.scene.observed.iter().enumerate() {
            let predicted = self
                .scene
                .predict(run, hypothesis, at)
                .ok_or_else(|| ExplainError::SlidesDown {
                    recording: observed.run.recording.source.display().to_string(),
                    slope_deg: observed.run.slope_deg,
                })?;
            let residual = Residual::binned(observed, &self.bins[run], &predicted);
            self.noise.push(RunNoise::measure(observed, &self.bins[run], &residual));
            let torque_n_m = torque_residual::residual_n_m(observed, &self.bins[run], &predicted);
            self.torque_noise
                .push(TorqueNoise::measure(observed, &self.bins[run], &torque_n_m));
        }
        self.advance_by_friction_m =
            irregularity::advance_by_friction_m(&self.scene, self.discrepancy_unit(), (hypothesis, at));
        Ok(())
    }

    /// Whether the worms were laid down at the start: the nominal model is too far from some.
    fn judge_assumptions(&mut self, hypothesis: &Hypothesis, at: &[f64]) -> bool {
        let mut is_new = false;
        for run in 0..self.runs() {
            let (physics, damping_ratio) = self.scene.physics(run, hypothesis, at);
            let observed = &mut self.scene.observed[run];
            if observed.may_be_laid_down {
                is_new |= judge_start(observed, &physics, damping_ratio);
            }
        }
        is_new
    }

    fn settle(&mut self, hypothesis: &Hypothesis, at: &[f64]) {
        self.scene.settle(hypothesis, at);
    }

    /// A heavily damped body: with damping the data of a fast worm may have two minima.
    fn another_start(&self, hypothesis: &Hypothesis, at: &[f64]) -> Vec<f64> {
        let free = hypothesis.free.iter().zip(at);
        free.map(|(free, &value)| match Nuisance::of(free.what) {
            Some(Nuisance::Damping) => HEAVILY_DAMPED,
            Some(Nuisance::Presliding) => free.quantity.min,
            _ => value,
        })
        .collect()
    }

    fn laws(&self, recalibrated: &Fit) -> Vec<Offer> {
        laws(self, recalibrated)
    }

    /// The mean largest deformation of the tips, m: friction over stiffness.
    fn discrepancy_unit(&self) -> f64 {
        let worms = self.scene.nominal.iter().map(|physics| &physics.worm);
        let all_m: Vec<f64> = worms
            .flat_map(|worm| worm.contacts())
            .map(|contact| 0.5 * (contact.forward_bound_m + contact.backward_bound_m))
            .collect();
        all_m.iter().sum::<f64>() / all_m.len() as f64
    }
}
