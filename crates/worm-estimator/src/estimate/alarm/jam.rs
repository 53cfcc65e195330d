//! Jammed cell: a cell does not extend in its step.
//!
//! The extension of the stepping cell is its motion minus the mean motion of the others since its step began, equation
//! (10): pure kinematics of the cam, free of how the tips hold. Nominally it is stroke × the share of the step that is
//! done. What each cell really does in each part of its step and in each direction is calibrated on its first good steps
//! at the present speed, so a late tracker or a cam that is not quite linear does not count. The cell is jammed while its
//! extension falls short of the usual by more than `threshold` of it, and by more than noise (as learned) can make it; until its
//! calibration is done the share that may be missing is half-way between `threshold` and all.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use super::sample::Positions;
use crate::config::Config;
use crate::message::Severity;
use worm_physics::MAX_CELLS;

/// Parts of a step in which the usual extension is known.
const PARTS: usize = 8;
/// Share of the step that must be done before it is judged: before, latency and noise are as large as the motion.
const EVALUATED_FROM: f64 = 0.3;
/// A step is whole when it was seen from before this share …
const WHOLE_FROM: f64 = 0.15;
/// … to beyond this one.
const WHOLE_TO: f64 = 0.85;
/// Samples in a row with a shortfall.
const CONFIRMATIONS: u32 = 3;
/// A shortfall within this many standard deviations of an extension's error is noise …
const NOISE_SIGMAS: f64 = 5.0;
/// … but never one beyond this share of the stroke.
const LARGEST_NOISE_FRACTION: f64 = 0.7;
/// Samples over which the error is learned, some 25 steps; it begins at twice what the configuration says.
const NOISE_MEMORY: f64 = 500.0;
/// Whole good steps of the cell after which it is free again.
const GOOD_STEPS: u32 = 2;

/// Extension over nominal extension in each part of a step.
#[derive(Debug, Clone, Copy, Default)]
struct Profile {
    sum: [f64; PARTS],
    count: [u32; PARTS],
}

impl Profile {
    fn add(&mut self, done: f64, ratio: f64) {
        let part = part_of(done);
        self.sum[part] += ratio;
        self.count[part] += 1;
    }

    fn merge(&mut self, other: &Self) {
        for part in 0..PARTS {
            self.sum[part] += other.sum[part];
            self.count[part] += other.count[part];
        }
    }

    fn ratio(&self, done: f64) -> Option<f64> {
        let part = part_of(done);
        (self.count[part] > 0).then(|| self.sum[part] / f64::from(self.count[part]))
    }
}

fn part_of(done: f64) -> usize {
    ((done * PARTS as f64) as usize).min(PARTS - 1)
}

/// A step under way.
#[derive(Debug, Clone, Copy)]
struct Step {
    number: i64, // steps counted from phase 0
    cell: usize,
    start: Positions,
    start_done: f64, // share of the step that was done at `start`
    began_ns: u64,
    seen_from: f64,
    seen_to: f64,
    short: u32,          // samples in a row that fell short
    worst_fraction: f64, // largest share missing in the last part of the step
    profile: Profile,
}

#[derive(Debug, Clone)]
pub(super) struct JammedCell {
    fraction: f64,
    stroke_m: f64,
    noise_m: f64,     // standard deviation of an extension by the configuration
    variance_m2: f64, // of the extensions about their usual, as learned
    cells: usize,
    order: [usize; MAX_CELLS],
    calibration_steps: u32,
    baseline: [[(u32, Profile); MAX_CELLS]; 2], // backward, forward; good steps and their profile
    regime: u32,
    reversals: u32,
    previous: Option<(f64, Positions)>, // phase and positions of the last sample
    step: Option<Step>,
    jammed: Option<(usize, u32)>, // the cell and its good steps since
    reading: Option<Reading>,
}

impl JammedCell {
    pub(super) fn new(config: &Config) -> Self {
        let cells = config.worm.cells.min(MAX_CELLS);
        let mut order = [0; MAX_CELLS];
        for (slot, cell) in order.iter_mut().zip(&config.worm.step_order) {
            *slot = cell.saturating_sub(1).min(MAX_CELLS - 1);
        }
        // Two positions of the cell and two means over the others.
        let noise_m = config.tracker.noise_m * (2.0 + 2.0 / (cells.max(2) - 1) as f64).sqrt();
        Self {
            fraction: config.alarms.jammed_cell.threshold,
            stroke_m: config.worm.stroke_m,
            noise_m,
            variance_m2: 4.0 * noise_m * noise_m,
            cells,
            order,
            calibration_steps: config.estimator.calibration_cycles,
            baseline: [[(0, Profile::default()); MAX_CELLS]; 2],
            regime: 0,
            reversals: 0,
            previous: None,
            step: None,
            jammed: None,
            reading: None,
        }
    }

    pub(super) fn update(&mut self, tick: &Tick, positions: &Positions) -> DetectorOutput {
        if tick.regime != self.regime {
            self.regime = tick.regime;
            let side = side_of(tick);
            self.baseline[side] = [(0, Profile::default()); MAX_CELLS];
        }
        let Some(phase) = tick.phase.filter(|_| tick.torque) else {
            self.pause();
            return DetectorOutput::Idle;
        };
        if tick.reversals != self.reversals {
            self.reversals = tick.reversals;
            self.step = None;
        }
        let steps = phase * self.cells as f64;
        let number = steps.floor();
        let within = steps - number;
        let done = if tick.direction > 0.0 { within } else { 1.0 - within };
        let number = number as i64;
        if self.step.as_ref().is_some_and(|step| step.number != number) {
            self.finish(tick);
        }
        if self.step.is_none() {
            self.begin(tick, number, done, phase, positions);
        }
        self.previous = Some((phase, *positions));
        self.evaluate(tick, done, positions);
        if tick.still {
            self.jammed = None;
            self.reading = None;
            return DetectorOutput::Idle;
        }
        self.reading.map_or(DetectorOutput::Unknown, DetectorOutput::Measured)
    }

    /// A new step: its start lies between the last sample and this one, where the cam passed from cell to cell.
    fn begin(&mut self, tick: &Tick, number: i64, done: f64, phase: f64, positions: &Positions) {
        let cell = self.order[number.rem_euclid(self.cells as i64) as usize];
        let mut start = *positions;
        let mut start_done = done;
        if let Some((before, earlier)) = &self.previous {
            let travelled = (phase - before).abs() * self.cells as f64;
            if travelled > done && travelled < 0.5 {
                let back = done / travelled;
                for index in 0..self.cells {
                    start.metres[index] += back * (earlier.metres[index] - positions.metres[index]);
                }
                start.mask &= earlier.mask;
                start_done = 0.0;
            }
        }
        self.step = Some(Step {
            number,
            cell,
            start,
            start_done,
            began_ns: tick.now_ns,
            seen_from: done,
            seen_to: done,
            short: 0,
            worst_fraction: 0.0,
            profile: Profile::default(),
        });
    }

    fn evaluate(&mut self, tick: &Tick, done: f64, positions: &Positions) {
        let Some(step) = &mut self.step else { return };
        let covered = done - step.start_done;
        if covered < EVALUATED_FROM || !positions.has(step.cell) || !step.start.has(step.cell) || done < step.seen_to {
            return;
        }
        let stepping = 1 << step.cell;
        let Some(others_m) = positions.moved_without(&step.start, stepping) else {
            return;
        };
        let own_m = positions.metres[step.cell] - step.start.metres[step.cell];
        let extension_m = (own_m - others_m) * tick.direction;
        step.seen_to = done;
        let ratio = extension_m / (covered * self.stroke_m);
        step.profile.add(done, ratio);
        let (good_steps, profile) = &self.baseline[side_of(tick)][step.cell];
        let calibrated = *good_steps >= self.calibration_steps;
        let (baseline_ratio, fraction) = match profile.ratio(done).filter(|_| calibrated) {
            Some(ratio) => (ratio, self.fraction),
            None => (1.0, 0.5 * (1.0 + self.fraction)),
        };
        let missing_fraction = 1.0 - ratio / baseline_ratio.max(0.1);
        let missing_m = (baseline_ratio - ratio) * covered * self.stroke_m;
        let noise_m = NOISE_SIGMAS * self.noise_m.max(self.variance_m2.sqrt());
        let short = missing_fraction > fraction
            && missing_m > noise_m.min(LARGEST_NOISE_FRACTION * baseline_ratio * self.stroke_m);
        if calibrated && !short {
            let error_m = missing_m.clamp(-noise_m, noise_m);
            self.variance_m2 += (error_m * error_m - self.variance_m2) / NOISE_MEMORY;
        }
        step.short = if short { step.short + 1 } else { 0 };
        step.worst_fraction = missing_fraction;
        if step.short >= CONFIRMATIONS {
            self.jammed = match self.jammed {
                Some((cell, _)) if cell != step.cell => self.jammed, // the first one stays named
                _ => Some((step.cell, 0)),
            };
        }
        let verdict = match self.jammed {
            Some((_, good)) if good < GOOD_STEPS => ReadingState::Bad,
            _ if missing_fraction < 0.5 * fraction => ReadingState::Good,
            _ => ReadingState::Between,
        };
        let about = self.jammed.map_or(step.cell, |(cell, _)| cell);
        let keeps = |reading: &Reading| about != step.cell && reading.cell == Some(about);
        if self.reading.as_ref().is_none_or(|reading| !keeps(reading)) {
            self.reading = Some(Reading {
                value: missing_fraction,
                threshold: fraction,
                verdict,
                since_ns: step.began_ns,
                cell: Some(about),
                severity: Severity::Critical,
            });
        }
    }

    /// A step ended: it may serve for calibration, and it tells whether a jammed cell is free again.
    fn finish(&mut self, tick: &Tick) {
        let Some(step) = self.step.take() else { return };
        let whole = step.seen_from <= WHOLE_FROM && step.seen_to >= WHOLE_TO;
        if !whole || step.short > 0 {
            return;
        }
        let (good_steps, profile) = &mut self.baseline[side_of(tick)][step.cell];
        if *good_steps < self.calibration_steps && step.worst_fraction < 0.5 * (1.0 + self.fraction) {
            *good_steps += 1;
            profile.merge(&step.profile);
        }
        if let Some((cell, good)) = &mut self.jammed
            && *cell == step.cell
            && step.worst_fraction < 0.5 * self.fraction
        {
            *good += 1;
            if *good >= GOOD_STEPS {
                self.jammed = None;
                if let Some(reading) = &mut self.reading {
                    reading.verdict = ReadingState::Good;
                    reading.value = step.worst_fraction;
                }
            }
        }
    }

    fn pause(&mut self) {
        self.step = None;
        self.previous = None;
        self.jammed = None;
        self.reading = None;
    }
}

const fn side_of(tick: &Tick) -> usize {
    if tick.direction > 0.0 { 1 } else { 0 }
}
