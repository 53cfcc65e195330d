//! What a hypothesis says of every sample, and what it leaves of the data.
//!
//! # The residual
//! The position of cell i is cᵢ + b + (what its drive does): its place in the body, the body's way, and its steps. What a
//! hypothesis leaves of the positions falls into the body's part, common to all cells, and each cell's part relative to that; the
//! places cᵢ are taken out as means. The body's part wanders like a random walk whatever the model, for no worm repeats its
//! cycles exactly; it is whitened by the drift that the data themselves show from cycle to cycle (see [`super::noise`]). Where the
//! phase had to be found from the positions, what the stepping cell does relative to the others went into it and tells nothing
//! more: that direction is taken out.

use super::noise::RunNoise;
use super::observed::Observed;
use super::parameter::{Free, Hypothesised, Nuisance, What};
use super::phase_correction::PhaseCorrection;
use worm_physics::effect::Setting;
use worm_physics::{Crawl, Mechanics, Physics, Worm};

/// Cycles that are run before a recording that begins in the middle of a crawl.
const LEAD_CYCLES: f64 = 5.0;
/// Cycles after which a worm that was laid down crawls periodically, well below what can be seen.
const SETTLING_CYCLES: f64 = 5.0;
/// What is seen of it before it is repeated, cycles, and in how many parts of a sample.
const SEEN_CYCLES: f64 = 1.1;
const PARTS_SEEN: usize = 4;

/// A hypothesis: nuisances and effects, and which quantities are free.
#[derive(Debug, Clone, Default)]
pub(super) struct Hypothesis {
    pub hypothesised: Vec<Hypothesised>,
    pub free: Vec<Free>,
    /// Every cycle is run, even where the crawl is periodic.
    pub throughout: bool,
}

impl Hypothesis {
    /// Nuisances and effects.
    pub fn new(nuisances: &[Free], hypothesised: &[Hypothesised]) -> Self {
        let mut free = nuisances.to_vec();
        for (place, hypothesised) in hypothesised.iter().enumerate() {
            let parameters = hypothesised.effect.parameters.iter().enumerate();
            free.extend(parameters.map(|(number, parameter)| Free::of_effect(place, number, parameter)));
        }
        Self {
            hypothesised: hypothesised.to_vec(),
            free,
            throughout: false,
        }
    }

    /// The believed values: every nuisance at its centre, every effect neutral.
    pub fn neutral(&self) -> Vec<f64> {
        self.free.iter().map(|free| free.centre).collect()
    }

    /// The effects with these values.
    pub fn settings(&self, at: &[f64]) -> Vec<Setting> {
        let mut values: Vec<Vec<f64>> = self
            .hypothesised
            .iter()
            .map(|hypothesised| vec![0.0; hypothesised.effect.parameters.len()])
            .collect();
        for (free, &value) in self.free.iter().zip(at) {
            if let What::Effect { place, parameter } = free.what {
                values[place][parameter] = value;
            }
        }
        self.hypothesised
            .iter()
            .zip(values)
            .map(|(hypothesised, values)| Setting::within(hypothesised.effect, hypothesised.cell, &values))
            .collect()
    }
}

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

/// What is left of one run.
#[derive(Debug, Clone, Default)]
pub(super) struct Residual {
    /// The body's part at each sample, m; `NaN` where no cell was seen.
    pub body_m: Vec<f64>,
    /// Each cell's part relative to it, m: `[sample][cell]`, flat; `NaN` where not seen.
    pub relative_m: Vec<f64>,
}

/// What a prediction leaves of a run.
pub(super) fn rest(observed: &Observed<'_>, predicted: &Predicted) -> Residual {
    let cells = observed.cells();
    let samples = observed.samples();
    let own_m =
        |sample: usize, cell: usize| observed.position_m[cell][sample] - predicted.position_m[sample * cells + cell];
    // The places of the cells in the body, from samples in which all were seen.
    let mut place_m = vec![0.0; cells];
    let mut whole = 0.0;
    for sample in observed.counts_from..samples {
        let sum_m: f64 = (0..cells).map(|cell| own_m(sample, cell)).sum();
        if sum_m.is_finite() {
            whole += 1.0;
            for (cell, place_m) in place_m.iter_mut().enumerate() {
                *place_m += own_m(sample, cell) - sum_m / cells as f64;
            }
        }
    }
    place_m.iter_mut().for_each(|place_m| *place_m /= f64::max(whole, 1.0));
    let mut rest = Residual {
        body_m: Vec::with_capacity(samples),
        relative_m: Vec::with_capacity(samples * cells),
    };
    for sample in 0..samples {
        let stepping = observed.stepping(sample);
        let (mut sum_m, mut seen) = (0.0, 0.0);
        for (cell, place_m) in place_m.iter().enumerate() {
            let own_m = own_m(sample, cell) - place_m;
            if own_m.is_finite() && (observed.phase_recorded || cell != stepping) {
                sum_m += own_m;
                seen += 1.0;
            }
        }
        let body_m = sum_m / seen; // NaN where none was seen
        rest.body_m.push(body_m);
        for (cell, place_m) in place_m.iter().enumerate() {
            let relative_m = own_m(sample, cell) - place_m - body_m;
            let tells = observed.phase_recorded || cell != stepping;
            rest.relative_m.push(if tells { relative_m } else { f64::NAN });
        }
    }
    rest
}

/// Appends a run's residuals, each with variance 1 where the hypothesis holds; `counts` says which samples do.
pub(super) fn residuals(observed: &Observed<'_>, noise: &RunNoise, rest: &Residual, out: &mut Vec<f64>) {
    let from = observed.counts_from;
    let mut at = 0;
    noise.drift.whiten(rest.body_m.iter().copied(), |whitened_residual| {
        if at >= from {
            out.push(whitened_residual * noise.body_scale);
        }
        at += 1;
    });
    let cells = observed.cells();
    out.extend(rest.relative_m[from * cells..].iter().map(|relative_m| {
        if relative_m.is_nan() {
            0.0
        } else {
            relative_m * noise.relative_scale
        }
    }));
}

/// Residuals that a run would leave if the worm could not have made it.
pub(super) fn impossible(observed: &Observed<'_>, out: &mut Vec<f64>) {
    let rows = (observed.samples() - observed.counts_from) * (1 + observed.cells());
    out.extend(std::iter::repeat_n(1e3, rows));
}

/// The worm of a run, believed.
pub(super) fn nominal(observed: &Observed<'_>, worm: Worm, payload_kg: f64) -> Worm {
    let mut worm = worm
        .with_step_order(&observed.step_order)
        .unwrap_or_else(|_| unreachable!("the gait names every cell once"));
    worm.add_mass_kg(payload_kg);
    worm
}
