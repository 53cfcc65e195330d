//! The recordings as the search sees them: the phase of each sample, which samples count, and their noise.

use super::super::error::ExplainError;
use super::pace::{Pace, time_at_s};
use super::torque::MeasuredTorque;
use crate::experiment::RecordedRun;
use crate::identify::clean::leave_out_outliers;
use crate::identify::{self, GaitError, IdentifiedGait, Prior, Steadied, gait};
use crate::recording::{Recording, Repair};
use worm_estimator::config::Config;
use worm_estimator::self_sensing::GearModel;
use worm_physics::Crawl;

/// Cycles at the start that do not count unless the worm was just laid down: the state of the tips is unknown there.
const FORGOTTEN_CYCLES: f64 = 2.0;
/// Whole cycles that must count in a run.
pub(in crate::explain) const MIN_CYCLES: usize = 3;
/// How close to a whole step a recording must begin to show a worm just laid down, cycles.
const AT_BEGIN: f64 = 0.02;
/// Displacement by which a cell falls behind the others over a recording, as a fraction of the stroke, from which the gait is
/// identified again without it.
const FALLS_BEHIND: f64 = 0.05;
/// How far the stroke seen may be from the configured one, as a factor.
const STROKE_FACTOR: f64 = 2.0;
/// Time at rest before the first step that counts, or that is a pause, s, and the time for which a worm just laid down settles on its tips, s.
const REST_S: f64 = 0.1;
const SINKING_S: f64 = 0.05;
/// Phase after which the worm counts as moving, cycles.
const MOVES: f64 = 0.005;

/// One recording, prepared.
#[derive(Debug, Clone)]
pub(in crate::explain) struct Observed<'a> {
    pub run: RecordedRun<'a>,
    /// Gait phase at each sample, cycles.
    pub phase: Vec<f64>,
    pub phase_recorded: bool,
    /// Cells in the order in which they step.
    pub step_order: Vec<usize>,
    /// Whether positions count; where they do not, there is a [`torque`](Self::torque).
    pub sees_positions: bool,
    /// Positions without outliers, m: `[cell][sample]`; `NaN` where not seen.
    pub position_m: Vec<Vec<f64>>,
    /// Where the cells were at the first sample, m; without positions where the first is at 0.
    pub first_m: Vec<f64>,
    /// Standard deviation of the white part of one position, m; `NaN` without positions.
    pub noise_m: f64,
    /// The recording may start with the worm just laid down.
    pub may_be_laid_down: bool,
    /// The worm is assumed to have been laid down where the recording starts.
    pub laid_down: bool,
    /// First sample that counts.
    pub counts_from: usize,
    pub cycle_s: f64,
    /// Whether the drive stands still for a while on the way: what happens then does not repeat with the phase.
    pub pauses: bool,
    /// The pace of the settled crawl.
    pub pace: Pace,
    /// How a worm much like it crawled here, once settled, at a knot: other crawls that were under way settle sooner from there.
    pub settled: Option<Crawl>,
    /// Every repair of the recording.
    pub repairs: Vec<Repair>,
    /// What the motor's current shows, where it counts as evidence and the phase was recorded.
    pub torque: Option<MeasuredTorque>,
}

impl<'a> Observed<'a> {
    pub fn new(run: RecordedRun<'a>, config: &Config) -> Result<Self, ExplainError> {
        let recording = run.recording;
        let name = || recording.source.display().to_string();
        check_conditions(run, config)?;
        let Steadied {
            recording: steadied,
            gait,
            repairs,
            ..
        } = identify::steady(recording, |position_m, filled_m| {
            find_gait(recording, position_m, filled_m, config)
        })
        .map_err(|source| ExplainError::IdentifiedGait {
            recording: name(),
            source,
        })?;
        let factor = gait.stroke_m / config.worm.stroke_m;
        if !(1.0 / STROKE_FACTOR..=STROKE_FACTOR).contains(&factor) {
            return Err(ExplainError::Stroke {
                recording: name(),
                seen_m: gait.stroke_m,
                configured_m: config.worm.stroke_m,
            });
        }
        let filled_m = steadied.filled();
        let mut position_m = steadied.into_owned().position_m;
        let noise_m = identify::clean::noise_by_differences(&position_m).max(1e-7);
        for (series, filled) in position_m.iter_mut().zip(&filled_m) {
            leave_out_outliers(series, filled, noise_m);
        }
        let first_m = filled_m
            .iter()
            .map(|series| series.iter().copied().find(|at_m| at_m.is_finite()).unwrap_or(0.0))
            .collect();
        let steps = gait.phase[0] * recording.cells() as f64;
        let may_be_laid_down = (steps - steps.round()).abs() < AT_BEGIN * recording.cells() as f64;
        Self {
            cycle_s: mean_cycle_s(&recording.time_s, &gait.phase),
            pauses: pauses(&recording.time_s, &gait.phase),
            run,
            phase_recorded: recording.gait_phase.is_some(),
            step_order: gait.step_order,
            phase: gait.phase,
            sees_positions: true,
            position_m,
            first_m,
            noise_m,
            may_be_laid_down,
            laid_down: false,
            counts_from: 0,
            pace: Pace::default(),
            settled: None,
            repairs,
            torque: None,
        }
        .long_enough()
    }

    /// By the motor's current alone, whatever positions there are.
    pub fn by_current(run: RecordedRun<'a>, config: &Config, gear: &GearModel) -> Result<Self, ExplainError> {
        let recording = run.recording;
        check_conditions(run, config)?;
        let no_current = || ExplainError::NoCurrentOfRun {
            recording: recording.source.display().to_string(),
        };
        let phase = recording.gait_phase.clone().ok_or_else(no_current)?;
        let turned = phase
            .last()
            .zip(phase.first())
            .map_or(0.0, |(last, first)| last - first);
        let cells = recording.cells();
        let torque = MeasuredTorque::new(recording, &phase, gear).ok_or_else(no_current)?;
        if turned < MIN_CYCLES as f64 {
            return Err(too_short(recording, turned.max(0.0) as usize));
        }
        Self {
            cycle_s: mean_cycle_s(&recording.time_s, &phase),
            pauses: pauses(&recording.time_s, &phase),
            run,
            phase_recorded: true,
            step_order: config.worm.step_order_from_zero(),
            phase,
            sees_positions: false,
            position_m: vec![vec![f64::NAN; recording.samples()]; cells],
            first_m: (0..cells)
                .map(|cell| -config.worm.cell_spacing_m * cell as f64)
                .collect(),
            noise_m: f64::NAN,
            // How the tips were loaded then shows in the positions alone.
            may_be_laid_down: false,
            laid_down: false,
            counts_from: 0,
            pace: Pace::default(),
            settled: None,
            repairs: Vec::new(),
            torque: Some(torque),
        }
        .long_enough()
    }

    fn long_enough(mut self) -> Result<Self, ExplainError> {
        self.assume_laid_down(false);
        match self.whole_cycles() {
            cycles if cycles < MIN_CYCLES => Err(too_short(self.run.recording, cycles)),
            _ => Ok(self),
        }
    }

    /// Counts the motor's current as evidence, too; not where the phase was found from the positions, or a current was hardly ever read.
    pub fn count_current(&mut self, gear: &GearModel) {
        if self.phase_recorded {
            self.torque = MeasuredTorque::new(self.run.recording, &self.phase, gear);
        }
    }

    pub fn cells(&self) -> usize {
        self.position_m.len()
    }

    pub fn samples(&self) -> usize {
        self.phase.len()
    }

    /// Assumes that the worm was laid down at the start, or that it was crawling already.
    pub fn assume_laid_down(&mut self, laid_down: bool) {
        self.laid_down = laid_down;
        let first = self.phase[0];
        self.counts_from = if laid_down {
            let moves = self.phase.partition_point(|&phase| phase < first + MOVES);
            let time_s = &self.run.recording.time_s;
            let from_s = (time_s[moves.min(time_s.len() - 1)] - REST_S).max(time_s[0] + SINKING_S);
            time_s.partition_point(|&at_s| at_s < from_s)
        } else {
            self.phase.partition_point(|&phase| phase < first + FORGOTTEN_CYCLES)
        };
        let from = self.settled_from();
        let time_s = &self.run.recording.time_s;
        self.pace = Pace::mean(&time_s[from..], &self.phase[from..], self.cells(), self.cycle_s);
    }

    /// First sample of the settled crawl.
    pub fn settled_from(&self) -> usize {
        let first = self.phase[0];
        let forgotten = if self.laid_down { 1.0 } else { FORGOTTEN_CYCLES };
        self.phase
            .partition_point(|&phase| phase < first + forgotten)
            .max(self.counts_from)
    }

    /// Whole cycles that count.
    pub fn whole_cycles(&self) -> usize {
        let from = self.phase.get(self.settled_from()).copied().unwrap_or(f64::INFINITY);
        (self.phase[self.samples() - 1] - from).max(0.0).floor() as usize
    }

    /// Time at which the drive leaves a phase, s: after any rest there.
    pub fn time_left_s(&self, phase: f64) -> f64 {
        let left = self.phase.partition_point(|&here| here <= phase);
        let rested_s = left
            .checked_sub(1)
            .map_or(f64::NEG_INFINITY, |last| self.run.recording.time_s[last]);
        self.time_at_s(phase).max(rested_s)
    }

    /// Time of a phase, s; beyond the recording it is extrapolated at the mean pace.
    pub fn time_at_s(&self, phase: f64) -> f64 {
        time_at_s(&self.run.recording.time_s, &self.phase, phase, self.cycle_s)
    }

    /// The cell whose step a sample is in.
    pub fn stepping(&self, sample: usize) -> usize {
        let cells = self.cells() as f64;
        let step = (self.phase[sample] * cells).floor().rem_euclid(cells);
        self.step_order[step as usize]
    }
}

/// Refuses a slope that is none, and a worm with another number of cells.
fn check_conditions(run: RecordedRun<'_>, config: &Config) -> Result<(), ExplainError> {
    let (recording, slope_deg) = (run.recording.source.display().to_string(), run.slope_deg);
    let (found, configured) = (run.recording.cells(), config.worm.cells);
    if !(-90.0..=90.0).contains(&slope_deg) {
        return Err(ExplainError::Slope { recording, slope_deg });
    }
    if found != configured {
        return Err(ExplainError::Cells {
            recording,
            found,
            configured,
        });
    }
    Ok(())
}

fn too_short(recording: &Recording, cycles: usize) -> ExplainError {
    ExplainError::TooShort {
        recording: recording.source.display().to_string(),
        cycles,
        needed: MIN_CYCLES,
    }
}

/// Mean time of a gait cycle, rests included, s.
fn mean_cycle_s(time_s: &[f64], phase: &[f64]) -> f64 {
    let last = phase.len() - 1;
    (time_s[last] - time_s[0]) / (phase[last] - phase[0])
}

/// Whether the drive stands still for a while on the way.
fn pauses(time_s: &[f64], phase: &[f64]) -> bool {
    let last = phase.len() - 1;
    let on_the_way = phase[0] + MOVES..phase[last] - MOVES;
    let mut since = 0;
    (0..phase.len()).any(|sample| {
        if phase[sample] != phase[since] {
            since = sample;
        }
        on_the_way.contains(&phase[sample]) && time_s[sample] - time_s[since] > REST_S
    })
}

/// The gait, also of a worm with a cell that falls behind the others cycle by cycle.
fn find_gait(
    recording: &Recording,
    position_m: &[Vec<f64>],
    filled_m: &[Vec<f64>],
    config: &Config,
) -> Result<IdentifiedGait, GaitError> {
    let step_order = config.worm.step_order_from_zero();
    let find = |position_m: &[Vec<f64>], filled_m: &[Vec<f64>]| {
        let prior = Prior {
            step_order: &step_order,
            phase: recording.gait_phase.as_deref(),
        };
        gait::find(&recording.time_s, position_m, filled_m, prior)
    };
    let found = find(position_m, filled_m);
    // The clock by which cells fall behind: the phase where there is one, else time.
    let clock: Vec<f64> = match (&found, &recording.gait_phase) {
        (Ok(gait), _) => gait.phase.clone(),
        (Err(_), Some(phase)) => phase.clone(),
        (Err(_), None) => recording
            .time_s
            .iter()
            .map(|time_s| time_s / config.gait.cycle_s)
            .collect(),
    };
    let behind_m = falling_behind_m(filled_m, &clock);
    let cycles = clock[clock.len() - 1] - clock[0];
    let farthest_m = behind_m.iter().fold(0.0, |max: f64, rate| max.max(rate.abs())) * cycles;
    if farthest_m < FALLS_BEHIND * config.worm.stroke_m {
        return found;
    }
    let straighten = |series: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let with_rate = series.iter().zip(&behind_m);
        with_rate
            .map(|(series, rate)| {
                series
                    .iter()
                    .zip(&clock)
                    .map(|(at_m, cycle)| at_m - rate * cycle)
                    .collect()
            })
            .collect()
    };
    find(&straighten(position_m), &straighten(filled_m)).or(found)
}

/// How far each cell moves ahead of the mean of all in a cycle, m: the median over all pairs of samples a cycle apart.
fn falling_behind_m(filled_m: &[Vec<f64>], clock: &[f64]) -> Vec<f64> {
    let mut gains_m: Vec<Vec<f64>> = vec![Vec::new(); filled_m.len()];
    let mut after = 0;
    for sample in 0..clock.len() {
        while after < clock.len() && clock[after] < clock[sample] + 1.0 {
            after += 1;
        }
        if after == clock.len() {
            break;
        }
        let gain_m: Vec<f64> = filled_m.iter().map(|series| series[after] - series[sample]).collect();
        let mean_m = gain_m.iter().sum::<f64>() / gain_m.len() as f64;
        if mean_m.is_finite() {
            for (gains_m, gain_m) in gains_m.iter_mut().zip(gain_m) {
                gains_m.push(gain_m - mean_m);
            }
        }
    }
    gains_m
        .into_iter()
        .map(|mut gains_m| {
            if gains_m.is_empty() {
                return 0.0;
            }
            let middle = gains_m.len() / 2;
            *gains_m.select_nth_unstable_by(middle, f64::total_cmp).1
        })
        .collect()
}
