//! The positions that a hypothesis predicts for every sample.

use super::hypothesis::Hypothesis;
use super::observed::Observed;
use super::parameter::{Nuisance, What};
use super::phase_correction::PhaseCorrection;
use super::walk::{Gait, Settling, Walk};
use worm_physics::{Crawl, Mechanics, Physics, Worm};

/// Most cycles that are run before a recording that begins in the middle of a crawl, and the parts of each.
const LEAD_CYCLES: usize = 5;
const LEAD_PARTS: usize = 40;

/// The runs, and the nominal worm in each.
pub(super) struct Scene<'a> {
    pub observed: Vec<Observed<'a>>,
    /// Nominal physics of each run.
    pub nominal: Vec<Physics>,
}

/// The prediction for one run.
#[derive(Debug, Clone)]
pub(super) struct Predicted {
    /// `[sample][cell]`, flat, m.
    pub position_m: Vec<f64>,
}

impl Predicted {
    /// Mean advance in a cycle, m: over as many whole settled cycles as there are.
    pub fn advance_m(&self, observed: &Observed<'_>) -> f64 {
        let cells = observed.cells();
        let mean_m = |sample: usize| {
            let at_m = &self.position_m[sample * cells..(sample + 1) * cells];
            at_m.iter().sum::<f64>() / cells as f64
        };
        let phase = &observed.phase;
        let last = observed.samples() - 1;
        let cycles = observed.whole_cycles().max(1) as f64;
        let from = phase.partition_point(|&here| here < phase[last] - cycles).min(last - 1);
        (mean_m(last) - mean_m(from)) / (phase[last] - phase[from])
    }
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
            recalibrated.physics.with(&hypothesis.settings_at_end(run, at)),
            recalibrated.damping_ratio,
        )
    }

    /// A run without any effect.
    fn recalibrated(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Recalibrated {
        let mut physics = self.nominal[run].clone();
        let (mut damping_ratio, mut clock_drift) = (0.4, 0.0);
        for (free, &value) in hypothesis.free.iter().zip(at) {
            if let What::Nuisance(nuisance) = free.what {
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
        let is_steady = !hypothesis.throughout && hypothesis.changes_at(run).is_none();
        is_steady && !self.observed[run].pauses() && self.physics(run, hypothesis, at).0.is_periodic()
    }

    /// Positions of a run under a hypothesis; none where the worm could not have made it.
    pub fn predict(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Option<Predicted> {
        let observed = &self.observed[run];
        let recalibrated = self.recalibrated(run, hypothesis, at);
        let physics = recalibrated.physics.clone().with(&hypothesis.settings_at_end(run, at));
        let damping_ratio = recalibrated.damping_ratio;
        let clock = |physics: &Physics| Clock::new(observed, physics.view.latency_s, recalibrated.clock_drift);
        match hypothesis.changes_at(run) {
            Some(cycle) => {
                let before = recalibrated
                    .physics
                    .clone()
                    .with(&hypothesis.settings_at_start(run, at));
                predict_change(observed, clock(&before), &before, &physics, cycle, damping_ratio)
            }
            None => {
                let repeats = self.repeats(run, hypothesis, at);
                predict_with(observed, clock(&physics), &physics, damping_ratio, repeats)
            }
        }
    }
}

/// The crawl at the first sample of a recording. A periodic crawl under way has gone on until it repeats, any other for a few cycles.
pub(super) fn start(
    observed: &Observed<'_>,
    mechanics: &Mechanics,
    phase: f64,
    damping: f64,
    repeats: bool,
) -> Option<Crawl> {
    let first_m = &observed.first_m;
    if observed.laid_down {
        return Crawl::at_rest(mechanics, phase, first_m, Some(damping)).ok();
    }
    let begin = phase - LEAD_CYCLES as f64;
    let step_s = observed.cycle_s / LEAD_PARTS as f64;
    let mut crawl = Crawl::at_rest(mechanics, begin, first_m, Some(damping)).ok()?;
    let mut settling = Settling::default();
    for part in 1..=LEAD_CYCLES * LEAD_PARTS {
        let here = begin + part as f64 / LEAD_PARTS as f64;
        crawl.advance_to(mechanics, here, step_s).ok()?;
        if repeats && part % LEAD_PARTS == 0 && settling.has_settled(&crawl) {
            break;
        }
    }
    crawl.begin_at_phase(mechanics, phase, first_m);
    Some(crawl)
}

/// Positions at every sample of a recording, by some physics; where it `repeats`, a crawl is run until it is periodic, and then
/// repeated.
pub(super) fn predict(observed: &Observed<'_>, physics: &Physics, damping: f64, repeats: bool) -> Option<Predicted> {
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
    let crawl = start(observed, &mechanics, clock.phase_at(0), damping, repeats)?;
    let mut walk = Walk::new(observed, clock, crawl);
    walk.go_to(&mechanics, f64::INFINITY, Gait::new(repeats, !observed.laid_down))?;
    Some(walk.seen_at(physics.view.scale))
}

/// Positions at every sample of a recording, by some physics and, from so many cycles after its start on, by another that differs in
/// how the worm moves and not in how it is seen.
fn predict_change(
    observed: &Observed<'_>,
    mut clock: Clock<'_>,
    before: &Physics,
    after: &Physics,
    cycle: f64,
    damping: f64,
) -> Option<Predicted> {
    let [before_it, after_it] = [before, after].map(Mechanics::new);
    let pauses = observed.pauses();
    let repeats = !pauses && before.is_periodic();
    let crawl = start(observed, &before_it, clock.phase_at(0), damping, repeats)?;
    let mut walk = Walk::new(observed, clock, crawl);
    let change = observed.phase[0] + cycle;
    walk.go_to(&before_it, change, Gait::new(repeats, !observed.laid_down))?;
    walk.take_up(&after_it);
    walk.go_to(
        &after_it,
        f64::INFINITY,
        Gait::new(!pauses && after.is_periodic(), false),
    )?;
    Some(walk.seen_at(before.view.scale))
}

/// The gait phase one latency before each sample: a position shows the worm as it was then.
pub(super) struct Clock<'a> {
    time_s: &'a [f64],
    phase: &'a [f64],
    /// At the start of the recording, where clocks are set, and its growth, s/s.
    latency_s: f64,
    drift: f64,
    phase_correction: Option<PhaseCorrection>,
    after: usize,
}

impl<'a> Clock<'a> {
    fn new(observed: &'a Observed<'_>, latency_s: f64, drift: f64) -> Self {
        Self {
            time_s: &observed.run.recording.time_s,
            phase: &observed.phase,
            latency_s,
            drift,
            phase_correction: None,
            after: 1,
        }
    }

    /// For samples asked in order.
    pub fn phase_at(&mut self, sample: usize) -> f64 {
        let phase = self.recorded_at(sample);
        self.phase_correction
            .as_ref()
            .map_or(phase, |phase_correction| phase_correction.corrected(phase))
    }

    fn recorded_at(&mut self, sample: usize) -> f64 {
        if self.latency_s == 0.0 && self.drift == 0.0 {
            return self.phase[sample];
        }
        let last = self.time_s.len() - 1;
        let at_s = self.time_s[sample] - self.latency_s - self.drift * (self.time_s[sample] - self.time_s[0]);
        while self.after < last && self.time_s[self.after] < at_s {
            self.after += 1;
        }
        while self.after > 1 && self.time_s[self.after - 1] > at_s {
            self.after -= 1;
        }
        let (low, high) = (self.after - 1, self.after);
        let fraction = (at_s - self.time_s[low]) / (self.time_s[high] - self.time_s[low]);
        // Before the first sample and after the last, the phase is extrapolated.
        self.phase[low] + fraction.clamp(-10.0, 11.0) * (self.phase[high] - self.phase[low])
    }
}

/// The nominal worm of a run.
pub(super) fn nominal(observed: &Observed<'_>, worm: Worm, payload_kg: f64) -> Worm {
    let mut worm = worm
        .with_step_order(&observed.step_order)
        .unwrap_or_else(|_| unreachable!("the gait names every cell once"));
    worm.add_mass_kg(payload_kg);
    worm
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{Campaign, begun, hypothesis, record, scene};
    use super::super::parameter::Onset;
    use super::*;

    /// A cell with less friction from the middle of the second run on: as without it before, and as with it throughout after.
    #[test]
    fn an_effect_that_begins_in_mid_run_changes_what_comes_after() {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let scene = scene(&recordings, &campaign);
        let truth = Some(("unequal-clamping", Some(1), &[0.5][..]));
        let onset = Onset {
            cycle: 2.0,
            run: Some(1),
            ends: false,
        };
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

    /// A clock that has fallen behind by some time shows what a latency of that time shows.
    #[test]
    fn two_clocks_that_run_apart_are_a_latency_that_grows() {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let scene = scene(&recordings, &campaign);
        let observed = &scene.observed[0];
        let (time_s, drift) = (&recordings[0].time_s, 1e-3);
        let mut drifting = Clock::new(observed, 2e-3, drift);
        for sample in 0..observed.samples() {
            let latency_s = 2e-3 + drift * (time_s[sample] - time_s[0]);
            let late = Clock::new(observed, latency_s, 0.0).phase_at(sample);
            assert!((drifting.phase_at(sample) - late).abs() < 1e-12, "sample {sample}");
        }
        let free = Nuisance::all(4, 2, true);
        let nuisances = Hypothesis::new(&free, &[]);
        let mut at = nuisances.neutral();
        let predict = |at: &[f64]| scene.predict(0, &nuisances, at).expect("it holds").position_m;
        let without = predict(&at);
        let place = free
            .iter()
            .position(|free| free.what == What::Nuisance(Nuisance::ClockDrift));
        at[place.expect("it is free")] = drift;
        let apart = predict(&at)
            .iter()
            .zip(&without)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(apart > 1e-4, "{apart} m");
    }
}
