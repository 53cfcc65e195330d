//! The motor's readings in the log of a worm that nobody sees, as a recording without positions.
//!
//! The controller reads the motor in every tick; the readings within a window may be averaged, as a camera's exposure does, which takes
//! nothing from what their torque does along the way.

use crate::recording::{Motor, Recording};
use std::io::{Read, Seek};
use std::path::Path;
use worm_estimator::estimate::MotorTime;
use worm_estimator::message::State;
use worm_log::{ReadError, nothing};

/// The values of a reading: the gait phase, then the motor's.
const VALUES: usize = 7;

/// Reads a log's motor readings as a recording in which no cell is ever seen, averaged over windows of `window_s`; 0 for each as it is. Where the
/// controller was restarted only the longest run is taken. Errors call the input `path`.
///
/// # Errors
/// [`ReadError`] when the input cannot be read, is no log of a worm, or has no reading of the motor with its gait phase.
pub fn read_motor_from(input: impl Read + Seek, path: &Path, window_s: f64) -> Result<Recording, ReadError> {
    let (mut runs, contents) = super::read_runs(input, path, |state| Readings::begin(state, window_s))?;
    runs.iter_mut().for_each(Readings::end_window);
    let count = runs.len();
    let longest = runs.into_iter().max_by_key(|run| run.time_s.len());
    let longest = longest.filter(|run| !run.time_s.is_empty()).ok_or_else(|| {
        let remedy = "record a worm that crawls, with the topic `state`";
        nothing(path, "holds no reading of the motor with its gait phase", remedy)
    })?;
    super::check_cells(path, longest.cells)?;
    let mut warnings = contents.warnings;
    if count > 1 {
        warnings.push(format!(
            "the controller was started {count} times: only the longest stretch is taken"
        ));
    }
    Ok(longest.into_recording(path, warnings))
}

/// The readings of one run of the controller, averaged window by window.
struct Readings {
    cells: usize,
    last_tick: u64,
    lived: MotorTime,
    time_s: Vec<f64>,
    values: [Vec<f64>; VALUES],
    window_s: f64,
    window: Window,
}

/// Sums over the readings of a window.
#[derive(Default)]
struct Window {
    number: i64,
    readings: f64,
    time_s: f64,
    /// Of each value: the sum, and how many readings have it.
    sums: [(f64, f64); VALUES],
}

impl super::OfRun for Readings {
    fn continues_with(&self, state: &State) -> bool {
        state.sequence >= self.last_tick && state.cell_count as usize == self.cells
    }

    fn push(&mut self, state: &State) {
        let is_repeated = state.sequence == self.last_tick;
        self.last_tick = state.sequence;
        if !is_repeated {
            self.take(state);
        }
    }
}

impl Readings {
    /// From its first state on.
    fn begin(state: &State, window_s: f64) -> Self {
        let mut run = Self {
            cells: state.cell_count as usize,
            last_tick: state.sequence,
            lived: MotorTime::default(),
            time_s: Vec::new(),
            values: Default::default(),
            window_s,
            window: Window::default(),
        };
        run.take(state);
        run
    }

    fn take(&mut self, state: &State) {
        let time_s = self.lived.update(state) as f64 * 1e-9;
        if state.motor_is_new != 1 || !state.phase.is_finite() {
            return;
        }
        let number = (time_s / self.window_s).floor() as i64;
        if number != self.window.number || self.window_s <= 0.0 {
            self.end_window();
            self.window.number = number;
        }
        self.window.readings += 1.0;
        self.window.time_s += time_s;
        let values = [state.phase].into_iter().chain(super::motor_values(state));
        for ((sum, count), value) in self.window.sums.iter_mut().zip(values) {
            if value.is_finite() {
                (*sum, *count) = (*sum + value, *count + 1.0);
            }
        }
    }

    fn end_window(&mut self) {
        let window = std::mem::take(&mut self.window);
        let time_s = window.time_s / window.readings;
        // Of absurd values there may be no mean, and of nothing there is none.
        let means = window
            .sums
            .map(|(sum, count)| if f64::is_finite(sum) { sum / count } else { f64::NAN });
        // A clock that was set back shows nothing new.
        let is_later = self.time_s.last().is_none_or(|last_s| time_s > *last_s);
        if window.readings > 0.0 && is_later && means[0].is_finite() {
            self.time_s.push(time_s);
            self.values
                .iter_mut()
                .zip(means)
                .for_each(|(series, mean)| series.push(mean));
        }
    }

    fn into_recording(self, path: &Path, warnings: Vec<String>) -> Recording {
        let [phase, of_motor @ ..] = self.values;
        let mut motor = Motor::default();
        motor
            .series_mut()
            .into_iter()
            .zip(of_motor)
            .for_each(|(series, values)| *series = values);
        Recording {
            source: path.to_owned(),
            cell_names: (1..=self.cells).map(|cell| format!("x{cell}_m")).collect(),
            position_m: vec![vec![f64::NAN; self.time_s.len()]; self.cells],
            time_s: self.time_s,
            gait_phase: Some(phase),
            motor: Some(motor),
            warnings,
            repairs: Vec::new(),
        }
    }
}
