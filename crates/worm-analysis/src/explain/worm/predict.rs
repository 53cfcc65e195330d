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
                .with(&hypothesis.settings_at(run, f64::INFINITY, 0.0, at)),
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
        let is_steady = !hypothesis.throughout && hypothesis.changes_at(run, at).is_empty();
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
        let from = |cycle: f64, counted_from: f64| {
            let settings = hypothesis.settings_at(run, cycle, counted_from, at);
            recalibrated.physics.clone().with(&settings)
        };
        let at_start = from(f64::NEG_INFINITY, 0.0);
        let damping_ratio = recalibrated.damping_ratio;
        let clock = clock(observed, &at_start, recalibrated.clock_drift);
        let changes = hypothesis.changes_at(run, at);
        let mut predicted = if changes.is_empty() {
            let repeats = self.repeats(run, hypothesis, at);
            predict_with(observed, clock, &at_start, damping_ratio, repeats)
        } else {
            predict_changes(observed, clock, &at_start, &changes, from, damping_ratio)
        }?;
        let at_end = from(f64::INFINITY, 0.0);
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
    predict_with(observed, clock(observed, physics, 0.0), physics, damping, repeats)
}

/// When the worm did what each sample shows, by some physics.
fn clock<'a>(observed: &'a Observed<'_>, physics: &Physics, drift: f64) -> Clock<'a> {
    let mut clock = Clock::new(observed, physics.view.latency_s, drift);
    if !observed.phase_recorded && physics.laws.overlap > 0.0 {
        clock.phase_correction = Some(PhaseCorrection::new(physics.laws.overlap, observed.cells()));
    }
    clock
}

fn predict_with(
    observed: &Observed<'_>,
    clock: Clock<'_>,
    physics: &Physics,
    damping: f64,
    repeats: bool,
) -> Option<Predicted> {
    let mechanics = Mechanics::new(physics);
    let mut walk = Walk::begin(observed, clock, &mechanics, damping, repeats)?;
    walk.go_to(&mechanics, f64::INFINITY, repeats)?;
    Some(walk.seen_at(physics.view.scale))
}

/// Positions at every sample of a recording, by some physics and, each from so many cycles after its start on, by others that differ in
/// how the worm moves and not in how it is seen. They are told from which cycle the crawl counts.
fn predict_changes(
    observed: &Observed<'_>,
    clock: Clock<'_>,
    at_start: &Physics,
    changes: &[f64],
    physics_from: impl Fn(f64, f64) -> Physics,
    damping: f64,
) -> Option<Predicted> {
    let (mut mechanics, mut repeats) = (Mechanics::new(at_start), at_start.is_periodic());
    let mut walk = Walk::begin(observed, clock, &mechanics, damping, repeats)?;
    for &cycle in changes {
        walk.go_to(&mechanics, observed.phase[0] + cycle, repeats)?;
        let physics = physics_from(cycle, walk.counts_from() - observed.phase[0]);
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
    use crate::experiment::Simulation;
    use crate::explain::fixture::{Campaign, begun, hypothesis, record, scene};
    use crate::explain::search::law::shape::LawShape;
    use crate::explain::search::parameter::Onset;
    use std::sync::Arc;
    use worm_physics::{ActsOn, Axis};

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

    /// A law over time that acts for a while, early or late, simulated in that while alone and to the end: the same positions, but for where
    /// the increments end.
    #[test]
    fn a_law_for_a_while_is_simulated_for_a_while() {
        let campaign = Campaign {
            simulation: Simulation {
                cycles: 14.0,
                ..Campaign::default().simulation
            },
            ..Campaign::default()
        };
        let recordings = record(&campaign, None, 1);
        let scene = scene(&recordings, &campaign);
        let cycles: Vec<f64> = (0..=14).map(f64::from).collect();
        for (acts_on, beyond) in [(ActsOn::FrictionFactor, -0.4), (ActsOn::DriveDisplacement, 2e-4)] {
            for place in [1, 10] {
                let predicted_m = |elsewhere: f64| {
                    let shape = LawShape::of_points(acts_on, vec![(Axis::Time, cycles.clone())], Some(1));
                    let mut values = vec![elsewhere; cycles.len()];
                    values[place] = beyond;
                    let law = Some(Arc::new(shape.about(&values)));
                    let hypothesis = Hypothesis {
                        law,
                        ..Hypothesis::default()
                    };
                    let predicted = scene.predict(1, &hypothesis, &[]).expect("it holds").position_m;
                    (hypothesis.changes_at(1, &[]), predicted)
                };
                let (changes, for_a_while) = predicted_m(0.0);
                assert_eq!(changes, [place as f64 - 1.0, place as f64 + 1.0]);
                let (changes, throughout) = predicted_m(1e-12);
                assert_eq!(changes, Vec::<f64>::new());
                let without = scene
                    .predict(1, &Hypothesis::default(), &[])
                    .expect("it holds")
                    .position_m;
                let largest = |one: &[f64], other: &[f64]| {
                    let apart = one.iter().zip(other).map(|(a, b)| (a - b).abs());
                    apart.fold(0.0, f64::max)
                };
                let (apart_m, change_m) = (largest(&for_a_while, &throughout), largest(&for_a_while, &without));
                assert!(
                    change_m > 1e-4 && apart_m < 0.03 * change_m,
                    "{acts_on:?} about cycle {place}: {apart_m} m apart, a change of {change_m} m"
                );
            }
        }
    }
}
