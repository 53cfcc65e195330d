//! The tracker samples of a log as a recording, and a recording as a log.

mod motor;
mod write;

pub use motor::read_motor_from;
pub use write::write;

use super::{Motor, Recording};
use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;
use worm_estimator::estimate::{Capture, MotorTime};
use worm_estimator::message::State;
use worm_estimator::number::count;
use worm_log::{Channel, Contents, ReadError, nothing, scan_from};

/// Reads a log's states as a recording: one sample for each new sample of the tracker.
///
/// Time is that of the tracker's own clock. The gait phase is that at the capture, between the motor readings before and after
/// it: a tick whose reading failed repeats an old phase and is ignored. Where the controller was restarted, its
/// clocks and counts restart too, so only the longest run is taken.
///
/// # Errors
/// [`ReadError`] when the file cannot be read, is no log of a worm, is of another version, or has no samples.
pub fn read(path: &Path) -> Result<Recording, ReadError> {
    let file = File::open(path).map_err(|error| cannot_open(path, &error))?;
    read_from(file, path)
}

fn cannot_open(path: &Path, error: &std::io::Error) -> ReadError {
    let problem = format!("cannot be read: {error}");
    ReadError::whole(path, problem, "check that the file is there and may be read")
}

/// As [`read`], from anything that can be read and rewound; errors call it `path`.
///
/// # Errors
/// As [`read`].
pub fn read_from(input: impl Read + Seek, path: &Path) -> Result<Recording, ReadError> {
    match read_seen(input, path)? {
        Some(recording) => Ok(recording),
        None => {
            let remedy = "`wormd infer` says what the motor's current shows, and `wormd explain --current` takes it as evidence; positions \
                          need a tracker that works: see `wormd check`";
            Err(nothing(path, "holds no sample of the tracker", remedy))
        }
    }
}

/// As [`read_from`]; none of a log in which the tracker gave no sample.
///
/// # Errors
/// As [`read`].
pub(super) fn read_seen(input: impl Read + Seek, path: &Path) -> Result<Option<Recording>, ReadError> {
    let (runs, contents) = read_runs(input, path, ControllerRun::begin)?;
    let mut warnings = contents.warnings;
    let count = runs.len();
    let longest = runs.into_iter().max_by_key(|run| run.samples.len());
    let Some(longest) = longest.filter(|run| !run.samples.is_empty()) else {
        return match (count, warnings.first()) {
            (1.., _) => Ok(None),
            // What is compressed may be lost whole where the file is cut.
            (0, Some(damage)) => Err(nothing(
                path,
                &format!("holds no message, {damage}"),
                "record for longer",
            )),
            (0, None) => Err(nothing(path, "holds no message", "record the topic `state`")),
        };
    };
    check_cells(path, longest.cells)?;
    if count > 1 {
        warnings.push(format!(
            "the controller was started {count} times: only the longest stretch is taken, from tick {} on",
            longest.first_tick
        ));
    }
    Ok(Some(longest.into_recording(path, warnings)))
}

/// What is kept of a run of the controller, state by state.
trait OfRun: Sized {
    /// Whether a state belongs to the same run; a repeated tick does.
    fn continues_with(&self, state: &State) -> bool;
    /// Takes a state that does.
    fn push(&mut self, state: &State);
}

/// The runs of the controller in a log, and what else was found in it.
fn read_runs<R: OfRun>(
    input: impl Read + Seek,
    path: &Path,
    begin: impl Fn(&State) -> R,
) -> Result<(Vec<R>, Contents), ReadError> {
    let mut runs: Vec<R> = Vec::new();
    let contents = scan_from(input, path, |channel, payload| {
        if channel != Channel::State {
            return Ok(());
        }
        let state: State = payload.read()?;
        match runs.last_mut() {
            Some(run) if run.continues_with(&state) => run.push(&state),
            _ => runs.push(begin(&state)),
        }
        Ok(())
    })?;
    Ok((runs, contents))
}

/// Refuses what is no worm.
fn check_cells(path: &Path, cells: usize) -> Result<(), ReadError> {
    if cells >= 2 {
        return Ok(());
    }
    let problem = format!("is of {cells} cell, and a worm has at least 2");
    Err(nothing(path, &problem, "record a worm"))
}

/// Longest time between a capture and the nearest motor reading for which its gait phase is known, s.
const MAX_PHASE_GAP_S: f64 = 0.1;
/// How long before the first motor reading a capture is still given its phase, s: the error of the clocks' comparison.
const BEFORE_FIRST_S: f64 = 1e-3;

/// Readings of the motor that are kept: a capture is no older than they are, or their phase is not known either.
const KEPT_READINGS: usize = 256;

/// One new sample, with the motor as it was at the capture.
struct Sample {
    time_s: f64,
    captured_s: f64, // without the time during which the computer was paused
    state: State,
}

/// What a state says of the motor, in the order of [`Motor::COLUMNS`].
fn motor_values(state: &State) -> [f64; 6] {
    [
        state.motor_angle_rad,
        state.motor_velocity_rad_s,
        state.motor_current_a,
        state.bus_voltage_v,
        state.motor_duty,
        state.motor_temperature_c,
    ]
}

/// What a reading says of the motor, and when, without the time during which the computer was paused.
struct Reading {
    time_s: f64,
    values: [f64; 6],
}

impl Reading {
    fn of(state: &State, time_s: f64) -> Self {
        Self {
            time_s,
            values: motor_values(state),
        }
    }

    fn towards(&self, after: &Self, at_s: f64) -> Self {
        let fraction = (at_s - self.time_s) / (after.time_s - self.time_s);
        Self {
            time_s: at_s,
            values: std::array::from_fn(|at| self.values[at] + fraction * (after.values[at] - self.values[at])),
        }
    }

    fn set(&self, state: &mut State) {
        [
            state.motor_angle_rad,
            state.motor_velocity_rad_s,
            state.motor_current_a,
            state.bus_voltage_v,
            state.motor_duty,
            state.motor_temperature_c,
        ] = self.values;
    }
}

/// The states of one run of the controller.
struct ControllerRun {
    cells: usize,
    first_tick: u64,
    last_tick: u64,
    last_sample: u64,
    lived: MotorTime,
    capture: Capture,
    /// Time, without pauses of the computer, and phase of each tick that read the motor.
    phases: Vec<(f64, f64)>,
    /// The last readings of the motor.
    readings: VecDeque<Reading>,
    samples: Vec<Sample>,
    /// New samples without a time, or with one that does not grow.
    without_time: usize,
}

impl ControllerRun {
    /// From its first state on.
    fn begin(state: &State) -> Self {
        let mut run = Self {
            cells: state.cell_count as usize,
            first_tick: state.sequence,
            last_tick: state.sequence,
            last_sample: state.sample,
            lived: MotorTime::default(),
            capture: Capture::default(),
            phases: Vec::new(),
            readings: VecDeque::with_capacity(KEPT_READINGS),
            samples: Vec::new(),
            without_time: 0,
        };
        run.push(state);
        run
    }
}

impl OfRun for ControllerRun {
    fn continues_with(&self, state: &State) -> bool {
        state.sequence >= self.last_tick && state.sample >= self.last_sample && state.cell_count as usize == self.cells
    }

    fn push(&mut self, state: &State) {
        let is_repeated = state.sequence == self.last_tick && state.sequence != self.first_tick;
        // Where ticks are missing, the one with which a sample came may be among them; the next one still has it.
        let came_between = state.sequence > self.last_tick.saturating_add(1) && state.sample > self.last_sample;
        let has_new_sample = state.sample_is_new == 1 || came_between;
        (self.last_tick, self.last_sample) = (state.sequence, state.sample);
        let time_s = self.lived.update(state) as f64 * 1e-9;
        if state.motor_is_new == 1 && !is_repeated {
            if self.readings.len() == KEPT_READINGS {
                self.readings.pop_front();
            }
            self.readings.push_back(Reading::of(state, time_s));
        }
        if has_new_sample && !is_repeated {
            let (captured_s, _) = self.capture.place(state.sample_time_s, time_s, state.phase);
            let before_s = self.samples.last().map_or(f64::NEG_INFINITY, |sample| sample.time_s);
            if state.sample_time_s.is_finite() && state.sample_time_s > before_s {
                let (time_s, mut state) = (state.sample_time_s, *state);
                self.set_motor_at(captured_s, &mut state);
                self.samples.push(Sample {
                    time_s,
                    captured_s,
                    state,
                });
            } else {
                self.without_time += 1;
            }
        }
        // A log made from a recording without motor state still has a phase.
        let is_read = state.motor_is_new == 1 || state.motor_angle_rad.is_nan();
        let is_later = self.phases.last().is_none_or(|(last_s, _)| time_s > *last_s);
        if state.phase.is_finite() && is_read && is_later {
            self.phases.push((time_s, state.phase));
        }
    }
}

impl ControllerRun {
    /// Sets the motor of a state to what it was at a time without pauses, between the readings before and after; it stays where that
    /// is not known.
    fn set_motor_at(&self, at_s: f64, state: &mut State) {
        let next = self.readings.partition_point(|reading| reading.time_s < at_s);
        let before = next.checked_sub(1).and_then(|before| self.readings.get(before));
        if let (Some(before), Some(after)) = (before, self.readings.get(next)) {
            before.towards(after, at_s).set(state);
        }
    }

    /// The gait phase at a time without pauses; `NaN` too far from any motor reading.
    fn phase_at(&self, at_s: f64) -> f64 {
        let next = self.phases.partition_point(|(time_s, _)| *time_s < at_s);
        let Some(&(after_s, after)) = self.phases.get(next) else {
            return f64::NAN;
        };
        match next.checked_sub(1).and_then(|before| self.phases.get(before)) {
            Some((before_s, before)) if (after_s - at_s).min(at_s - before_s) <= MAX_PHASE_GAP_S => {
                after - (after - before) * (after_s - at_s) / (after_s - before_s)
            }
            None if after_s - at_s <= BEFORE_FIRST_S => after,
            _ => f64::NAN,
        }
    }

    /// What is to be known of a worm that crawled on after its tracker had fallen silent.
    fn unseen_note(&self) -> Option<String> {
        let last = self.samples.last()?;
        let turned = |pair: &[(f64, f64)]| (pair[1].1 - pair[0].1).abs();
        let after = self.phases.partition_point(|(time_s, _)| *time_s < last.captured_s);
        let cycles: f64 = self.phases[after..].windows(2).map(turned).sum();
        (cycles >= 1.0).then(|| {
            format!(
                "the tracker gave its last sample at {:.1} s, and nobody saw the {} after it: `wormd infer` and `wormd analyze \
                 --current=alone` have them by the motor's current",
                last.time_s,
                count(cycles.floor() as usize, "gait cycle")
            )
        })
    }

    fn into_recording(mut self, path: &Path, mut warnings: Vec<String>) -> Recording {
        if self.without_time > 0 {
            let count = self.without_time;
            warnings.push(format!(
                "{count} samples are left out: their time is missing or does not grow"
            ));
        }
        let mut phase: Vec<f64> = self
            .samples
            .iter()
            .map(|sample| self.phase_at(sample.captured_s))
            .collect();
        let with_phase = phase.iter().filter(|phase| phase.is_finite()).count();
        if 0 < with_phase && with_phase < self.samples.len() {
            let count = self.samples.len() - with_phase;
            warnings.push(format!("{count} samples are left out: the gait phase was not known"));
            let mut known = phase.iter().map(|phase| phase.is_finite());
            self.samples.retain(|_| known.next().unwrap_or(false));
            phase.retain(|phase| phase.is_finite());
        }
        let missed = self.samples.last().map_or(0, |sample| sample.state.samples_missed);
        if missed > 0 {
            warnings.push(format!("the controller missed {missed} samples of the tracker"));
        }
        warnings.extend(self.unseen_note());
        let has_motor = self.samples.iter().any(|sample| sample.state.motor_is_new == 1);
        let of_each = |value: fn(&State) -> f64| self.samples.iter().map(|sample| value(&sample.state)).collect();
        let seen = |cell: usize| {
            let samples = self.samples.iter();
            samples
                .map(|sample| sample.state.position_of(cell).unwrap_or(f64::NAN))
                .collect()
        };
        Recording {
            source: path.to_owned(),
            cell_names: (1..=self.cells).map(|cell| format!("x{cell}_m")).collect(),
            time_s: self.samples.iter().map(|sample| sample.time_s).collect(),
            position_m: (0..self.cells).map(seen).collect(),
            gait_phase: (with_phase > 0).then_some(phase),
            motor: has_motor.then(|| Motor {
                angle_rad: of_each(|state| state.motor_angle_rad),
                velocity_rad_s: of_each(|state| state.motor_velocity_rad_s),
                current_a: of_each(|state| state.motor_current_a),
                voltage_v: of_each(|state| state.bus_voltage_v),
                duty: of_each(|state| state.motor_duty),
                temperature_c: of_each(|state| state.motor_temperature_c),
            }),
            warnings,
            repairs: Vec::new(),
        }
    }
}
