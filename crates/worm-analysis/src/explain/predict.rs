//! The positions that a hypothesis predicts for every sample.

use super::hypothesis::Hypothesis;
use super::observed::Observed;
use super::parameter::{Nuisance, What};
use super::phase_correction::PhaseCorrection;
use worm_physics::{Crawl, Mechanics, Physics, Worm};

/// Cycles that are run before a recording that begins in the middle of a crawl.
const LEAD_CYCLES: f64 = 5.0;
/// Cycles after which a worm that was laid down crawls periodically, well below what can be seen.
const SETTLING_CYCLES: f64 = 5.0;
/// What is seen of it before it is repeated, cycles, and in how many parts of a sample.
const SEEN_CYCLES: f64 = 1.1;
const PARTS_SEEN: usize = 4;

/// The runs and what is believed of the worm in each.
pub(super) struct Scene<'a> {
    pub observed: Vec<Observed<'a>>,
    /// The believed physics of each run.
    pub nominal: Vec<Physics>,
}

/// What a hypothesis says of one run.
#[derive(Debug, Clone)]
pub(super) struct Predicted {
    /// `[sample][cell]`, flat, m.
    pub position_m: Vec<f64>,
}

impl Scene<'_> {
    /// The physics of a run under a hypothesis, and the damping ratio.
    pub fn physics(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> (Physics, f64) {
        let mut physics = self.nominal[run].clone();
        let mut damping = 0.4;
        for (free, &value) in hypothesis.free.iter().zip(at) {
            if let What::Nuisance(nuisance) = free.what {
                nuisance.apply(value, run, &mut physics.worm);
                match nuisance {
                    Nuisance::Clock => physics.view.latency_s += value,
                    Nuisance::Damping => damping = value.exp(),
                    Nuisance::Presliding => physics.laws.presliding = value,
                    Nuisance::Rounding => physics.laws.rounding = value,
                    Nuisance::Viscosity => physics.laws.drag_n_s_per_m += value,
                    _ => {}
                }
            }
        }
        (physics.with(&hypothesis.settings(at)), damping)
    }

    /// Positions of a run under a hypothesis; none where the worm could not have made it.
    pub fn predict(&self, run: usize, hypothesis: &Hypothesis, at: &[f64]) -> Option<Predicted> {
        let (physics, damping) = self.physics(run, hypothesis, at);
        let repeats = physics.is_periodic() && !hypothesis.throughout;
        predict(&self.observed[run], &physics, damping, repeats)
    }
}

/// A worm under way at the first sample of a recording.
pub(super) fn start(observed: &Observed<'_>, mechanics: &Mechanics, phase: f64, damping: f64) -> Option<Crawl> {
    let first_m = &observed.first_m;
    if observed.laid_down {
        return Crawl::at_rest(mechanics, phase, first_m, Some(damping)).ok();
    }
    let lead = LEAD_CYCLES;
    let samples = 200.0;
    let mut crawl = Crawl::at_rest(mechanics, phase - lead, first_m, Some(damping)).ok()?;
    let step_s = lead * observed.cycle_s / samples;
    for sample in 1..=samples as usize {
        let here = phase - lead * (1.0 - sample as f64 / samples);
        crawl.advance_to(mechanics, here, step_s).ok()?;
    }
    crawl.begin_at(first_m);
    Some(crawl)
}

/// Positions at every sample of a recording, by some physics; where it `repeats`, a crawl is run until it is periodic, and then
/// repeated.
pub(super) fn predict(observed: &Observed<'_>, physics: &Physics, damping: f64, repeats: bool) -> Option<Predicted> {
    let mechanics = Mechanics::new(physics);
    let cells = observed.cells();
    let time_s = &observed.run.recording.time_s;
    // What is seen now happened the latency ago.
    let mut clock = Clock::new(time_s, &observed.phase, physics.view.latency_s);
    if !observed.phase_recorded && physics.laws.overlap > 0.0 {
        clock.phase_correction = Some(PhaseCorrection::new(physics.laws.overlap, cells));
    }
    let first_phase = clock.phase_at(0);
    let mut crawl = start(observed, &mechanics, first_phase, damping)?;
    let crawled = if observed.laid_down { SETTLING_CYCLES } else { 0.0 };
    let repeats_from = if repeats {
        first_phase + crawled + SEEN_CYCLES
    } else {
        f64::INFINITY
    };
    let mut position_m = Vec::with_capacity(cells * observed.samples());
    let mut cycle = CycleSeen::default();
    for sample in 0..observed.samples() {
        let phase = clock.phase_at(sample);
        if phase > repeats_from {
            cycle.repeat(phase, cells, &mut position_m);
        } else {
            let step_s = time_s[sample] - time_s[sample.saturating_sub(1)];
            let from = crawl.phase();
            // From a little more than a cycle before it is repeated.
            if phase > repeats_from - SEEN_CYCLES && repeats_from.is_finite() {
                for part in 1..=PARTS_SEEN {
                    let here = from + (phase - from) * part as f64 / PARTS_SEEN as f64;
                    crawl.advance_to(&mechanics, here, step_s / PARTS_SEEN as f64).ok()?;
                    cycle.see(here, crawl.positions_m());
                }
            } else {
                crawl.advance_to(&mechanics, phase, step_s).ok()?;
            }
            position_m.extend_from_slice(crawl.positions_m());
        }
    }
    position_m.iter_mut().for_each(|at_m| *at_m *= physics.view.scale);
    Some(Predicted { position_m })
}

/// A cycle of a periodic crawl, seen closely and then repeated.
#[derive(Default)]
struct CycleSeen {
    phase: Vec<f64>,
    position_m: Vec<f64>, // `[seen][cell]`, flat
    advance_m: Vec<f64>,  // of each cell in a cycle; empty until something is repeated
}

impl CycleSeen {
    fn see(&mut self, phase: f64, positions_m: &[f64]) {
        self.phase.push(phase);
        self.position_m.extend_from_slice(positions_m);
    }

    /// Position of a cell at a phase that was seen, m, between what was seen in straight lines.
    fn at_m(&self, phase: f64, cell: usize, cells: usize) -> f64 {
        let high = self
            .phase
            .partition_point(|&seen| seen < phase)
            .clamp(1, self.phase.len() - 1);
        let low = high - 1;
        let width = self.phase[high] - self.phase[low];
        let fraction = if width > 0.0 {
            (phase - self.phase[low]) / width
        } else {
            0.0
        };
        let at_m = |seen: usize| self.position_m[seen * cells + cell];
        at_m(low) + fraction * (at_m(high) - at_m(low))
    }

    /// Appends the positions at a later phase, as in the cycle that was seen.
    fn repeat(&mut self, phase: f64, cells: usize, out: &mut Vec<f64>) {
        let end = self.phase[self.phase.len() - 1];
        if self.advance_m.is_empty() {
            let last_m = &self.position_m[self.position_m.len() - cells..];
            self.advance_m = (0..cells)
                .map(|cell| last_m[cell] - self.at_m(end - 1.0, cell, cells))
                .collect();
        }
        let cycles = (phase - end).ceil();
        for cell in 0..cells {
            out.push(self.at_m(phase - cycles, cell, cells) + cycles * self.advance_m[cell]);
        }
    }
}

/// The gait phase a while before each sample.
struct Clock<'a> {
    time_s: &'a [f64],
    phase: &'a [f64],
    latency_s: f64,
    phase_correction: Option<PhaseCorrection>,
    after: usize,
}

impl<'a> Clock<'a> {
    fn new(time_s: &'a [f64], phase: &'a [f64], latency_s: f64) -> Self {
        Self {
            time_s,
            phase,
            latency_s,
            phase_correction: None,
            after: 1,
        }
    }

    /// For samples asked in order.
    fn phase_at(&mut self, sample: usize) -> f64 {
        let phase = self.recorded_at(sample);
        self.phase_correction
            .as_ref()
            .map_or(phase, |phase_correction| phase_correction.mended(phase))
    }

    fn recorded_at(&mut self, sample: usize) -> f64 {
        if self.latency_s == 0.0 {
            return self.phase[sample];
        }
        let at_s = self.time_s[sample] - self.latency_s;
        let last = self.time_s.len() - 1;
        while self.after < last && self.time_s[self.after] < at_s {
            self.after += 1;
        }
        while self.after > 1 && self.time_s[self.after - 1] > at_s {
            self.after -= 1;
        }
        let (low, high) = (self.after - 1, self.after);
        let fraction = (at_s - self.time_s[low]) / (self.time_s[high] - self.time_s[low]);
        // Before the first sample and after the last, the phase is taken to have gone on as it was.
        self.phase[low] + fraction.clamp(-10.0, 11.0) * (self.phase[high] - self.phase[low])
    }
}

/// The worm of a run, believed.
pub(super) fn nominal(observed: &Observed<'_>, worm: Worm, payload_kg: f64) -> Worm {
    let mut worm = worm
        .with_step_order(&observed.step_order)
        .unwrap_or_else(|_| unreachable!("the gait names every cell once"));
    worm.add_mass_kg(payload_kg);
    worm
}
