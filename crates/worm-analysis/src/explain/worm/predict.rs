//! The positions that a hypothesis predicts for every sample.

use super::clock::Clock;
use super::gears::GearErrors;
use super::nuisance::Nuisance;
use super::observed::Observed;
use super::phase_correction::PhaseCorrection;
use super::predicted::Predicted;
use super::walk::Walk;
use crate::explain::search::hypothesis::Hypothesis;
use worm_physics::{Mechanics, Physics, Worm};

/// The runs, and the nominal worm in each.
pub(in crate::explain) struct Scene<'a> {
    pub observed: Vec<Observed<'a>>,
    /// Nominal physics of each run.
    pub nominal: Vec<Physics>,
}

/// A run without any effect.
struct Recalibrated {
    physics: Physics,
    damping_ratio: f64,
    /// Growth of the delay of the positions, s/s.
    clock_drift: f64,
}

impl Scene<'_> {
    /// The physics of a run under a hypothesis, at its end where an effect begins or ends in between, and the damping ratio.
    pub fn physics(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> (Physics, f64) {
        let recalibrated = self.recalibrated(run, hypothesis, at);
        (
            recalibrated
                .physics
                .with(&hypothesis.settings_at(run, f64::INFINITY, at)),
            recalibrated.damping_ratio,
        )
    }

    /// A run without any effect.
    fn recalibrated(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Recalibrated {
        let mut physics = self.nominal[run].clone();
        let (mut damping_ratio, mut clock_drift) = (0.4, 0.0);
        for (free, &value) in hypothesis.free.iter().zip(at) {
            if let Some(nuisance) = Nuisance::of(free.what) {
                nuisance.apply(value, run, &mut physics.worm);
                match nuisance {
                    Nuisance::Clock => physics.view.latency_s += value,
                    Nuisance::ClockDrift => clock_drift = value,
                    Nuisance::Damping => damping_ratio = value.exp(),
                    Nuisance::Presliding => physics.laws.presliding = value,
                    Nuisance::Rounding => physics.laws.rounding = value,
                    Nuisance::Viscosity => physics.laws.drag_n_s_per_m += value,
                    Nuisance::Breakaway => physics.laws.static_over_kinetic *= 1.0 + value,
                    _ => {}
                }
            }
        }
        Recalibrated {
            physics,
            damping_ratio,
            clock_drift,
        }
    }

    /// Whether the crawl of a run is simulated for some cycles and then repeated.
    pub fn repeats(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> bool {
        let is_steady = !hypothesis.throughout && hypothesis.changes_at(run).is_empty();
        is_steady && !self.observed[run].pauses && self.physics(run, hypothesis, at).0.is_periodic()
    }

    /// Settles the crawls that were under way when their recordings began, under a hypothesis near all that will be predicted.
    pub fn settle(&mut self, hypothesis: &Hypothesis, at: &[f64]) {
        for run in 0..self.observed.len() {
            let (physics, damping) = self.physics(run, hypothesis, at);
            let observed = &self.observed[run];
            let clock = Clock::new(observed, physics.view.latency_s, 0.0);
            let walk = Walk::begin(
                observed,
                clock,
                &Mechanics::new(&physics),
                damping,
                physics.is_periodic(),
            );
            self.observed[run].settled = walk.and_then(Walk::into_settled);
        }
    }

    /// Positions of a run under a hypothesis; none where the worm could not have made it.
    pub fn predict(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Option<Predicted> {
        let observed = &self.observed[run];
        let recalibrated = self.recalibrated(run, hypothesis, at);
        let from = |cycle: f64| {
            recalibrated
                .physics
                .clone()
                .with(&hypothesis.settings_at(run, cycle, at))
        };
        let at_start = from(f64::NEG_INFINITY);
        let damping_ratio = recalibrated.damping_ratio;
        let clock = Clock::new(observed, at_start.view.latency_s, recalibrated.clock_drift);
        let changes = hypothesis.changes_at(run);
        let mut predicted = if changes.is_empty() {
            let repeats = self.repeats(run, hypothesis, at);
            predict_with(observed, clock, &at_start, damping_ratio, repeats)
        } else {
            let changes = changes.into_iter().map(|cycle| (cycle, from(cycle)));
            predict_changes(observed, clock, &at_start, changes, damping_ratio)
        }?;
        let at_end = from(f64::INFINITY);
        predicted.gears = GearErrors::of(hypothesis, at, (&at_end.worm, damping_ratio));
        Some(predicted)
    }
}

/// Positions at every sample of a recording, by some physics; where it `repeats`, a crawl is run until it is periodic, and then
/// repeated.
pub(in crate::explain) fn predict(
    observed: &Observed<'_>,
    physics: &Physics,
    damping: f64,
    repeats: bool,
) -> Option<Predicted> {
    let clock = Clock::new(observed, physics.view.latency_s, 0.0);
    predict_with(observed, clock, physics, damping, repeats)
}

fn predict_with(
    observed: &Observed<'_>,
    mut clock: Clock<'_>,
    physics: &Physics,
    damping: f64,
    repeats: bool,
) -> Option<Predicted> {
    let mechanics = Mechanics::new(physics);
    if !observed.phase_recorded && physics.laws.overlap > 0.0 {
        clock.phase_correction = Some(PhaseCorrection::new(physics.laws.overlap, observed.cells()));
    }
    let mut walk = Walk::begin(observed, clock, &mechanics, damping, repeats)?;
    walk.go_to(&mechanics, f64::INFINITY, repeats)?;
    Some(walk.seen_at(physics.view.scale))
}

/// Positions at every sample of a recording, by some physics and, each from so many cycles after its start on, by others that differ in
/// how the worm moves and not in how it is seen.
fn predict_changes(
    observed: &Observed<'_>,
    clock: Clock<'_>,
    at_start: &Physics,
    changes: impl Iterator<Item = (f64, Physics)>,
    damping: f64,
) -> Option<Predicted> {
    let (mut mechanics, mut repeats) = (Mechanics::new(at_start), at_start.is_periodic());
    let mut walk = Walk::begin(observed, clock, &mechanics, damping, repeats)?;
    for (cycle, physics) in changes {
        walk.go_to(&mechanics, observed.phase[0] + cycle, repeats)?;
        (mechanics, repeats) = (Mechanics::new(&physics), physics.is_periodic());
        walk.take_up(&mechanics);
    }
    walk.go_to(&mechanics, f64::INFINITY, repeats)?;
    Some(walk.seen_at(at_start.view.scale))
}

/// The nominal worm of a run.
pub(in crate::explain) fn nominal(observed: &Observed<'_>, worm: Worm, payload_kg: f64) -> Worm {
    let mut worm = worm
        .with_step_order(&observed.step_order)
        .unwrap_or_else(|_| unreachable!("the gait names every cell once"));
    worm.add_mass_kg(payload_kg);
    worm
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::fixture::{Campaign, begun, hypothesis, record, scene};
    use crate::explain::search::parameter::Onset;

    /// A cell with less friction from the middle of the second run on: as without it before, and as with it throughout after.
    #[test]
    fn an_effect_that_begins_in_mid_run_changes_what_comes_after() {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let scene = scene(&recordings, &campaign);
        let truth = Some(("unequal-clamping", Some(1), &[0.5][..]));
        let onset = Onset::from(2.0, Some(1));
        let predict = |run: usize, (hypothesis, at): &(Hypothesis, Vec<f64>)| {
            scene.predict(run, hypothesis, at).expect("it holds").position_m
        };
        let begun = begun(truth, onset);
        assert!(scene.repeats(0, &begun.0, &begun.1) && !scene.repeats(1, &begun.0, &begun.1));
        let without: Vec<Vec<f64>> = (0..2).map(|run| predict(run, &hypothesis(None))).collect();
        assert_eq!(predict(0, &begun), without[0], "the other run");
        let (with, throughout) = (predict(1, &begun), predict(1, &hypothesis(truth)));
        let observed = &scene.observed[1];
        let cells = observed.cells();
        let at = |phase: f64| cells * observed.phase.partition_point(|&here| here < observed.phase[0] + phase);
        let apart = |one: &[f64], other: &[f64], from: usize, to: usize| {
            let differences = one[from..to].iter().zip(&other[from..to]).map(|(a, b)| (a - b).abs());
            differences.fold(0.0, f64::max)
        };
        let before = apart(&with, &without[1], 0, at(1.9));
        assert!(before < 2e-6, "{before} m before it begins");
        let advance_m = |positions: &[f64]| positions[at(3.9)] - positions[at(2.9)];
        let (begun_m, throughout_m) = (advance_m(&with), advance_m(&throughout));
        let change_m = throughout_m - advance_m(&without[1]);
        assert!(change_m.abs() > 1e-4, "{change_m} m");
        assert!(
            (begun_m - throughout_m).abs() < 0.05 * change_m.abs(),
            "{begun_m} and {throughout_m} m a cycle"
        );
    }
}
