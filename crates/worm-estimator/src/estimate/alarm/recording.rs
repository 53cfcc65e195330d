//! Recording stopped: a recorder or the black box could not go on, or was killed.
//!
//! Both report once a second, and say when they end and why. One that says that it stopped because of a problem raises the alarm at once;
//! value is then the code of the problem and threshold 0. One that falls silent without a word was killed or hangs; value and
//! threshold are the silence in s, not counting pauses of the computer. One that ended in order, or none at all, is nothing to watch.
//! Where there are both, the worse of the two counts.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::message::{BlackBoxStatus, RecordingState, RecordingStatus, Severity};

#[derive(Debug, Clone)]
pub(super) struct RecordingStopped {
    recorder: Source,
    black_box: Source,
}

/// Who reports.
#[derive(Debug, Clone)]
struct Source {
    threshold_s: f64,
    newest: Option<Status>,
    silent_s: f64, // since `newest` came
}

#[derive(Debug, Clone, Copy)]
struct Status {
    time_ns: u64,
    state: u32,
    problem: u32,
}

impl RecordingStopped {
    pub(super) const fn new(config: &Config) -> Self {
        let threshold_s = config.alarms.recording_stopped.threshold;
        Self {
            recorder: Source::new(threshold_s),
            black_box: Source::new(threshold_s),
        }
    }

    pub(super) const fn note(&mut self, status: &RecordingStatus) {
        self.recorder.note(Status {
            time_ns: status.time_ns,
            state: status.state,
            problem: status.problem,
        });
    }

    pub(super) const fn note_black_box(&mut self, status: &BlackBoxStatus) {
        self.black_box.note(Status {
            time_ns: status.time_ns,
            state: status.state,
            problem: status.problem,
        });
    }

    pub(super) fn update(&mut self, tick: &Tick) -> DetectorOutput {
        let (recorder, black_box) = (self.recorder.update(tick), self.black_box.update(tick));
        if rank(&black_box) > rank(&recorder) {
            black_box
        } else {
            recorder
        }
    }
}

/// How much an output says.
fn rank(output: &DetectorOutput) -> u8 {
    match output {
        DetectorOutput::Measured(reading) => match reading.verdict {
            ReadingState::Bad => 5,
            ReadingState::Between => 4,
            ReadingState::Good => 3,
        },
        DetectorOutput::Idle => 2,
        DetectorOutput::Unknown => 1,
    }
}

impl Source {
    const fn new(threshold_s: f64) -> Self {
        Self {
            threshold_s,
            newest: None,
            silent_s: 0.0,
        }
    }

    const fn note(&mut self, status: Status) {
        self.newest = Some(status);
        self.silent_s = 0.0;
    }

    fn update(&mut self, tick: &Tick) -> DetectorOutput {
        let Some(newest) = &self.newest else {
            return DetectorOutput::Unknown;
        };
        let (value, threshold, verdict) = match RecordingState::try_from(newest.state) {
            Ok(RecordingState::Recording) => {
                self.silent_s += tick.present_s;
                let verdict = if self.silent_s > self.threshold_s {
                    ReadingState::Bad
                } else if self.silent_s < 0.5 * self.threshold_s {
                    ReadingState::Good
                } else {
                    ReadingState::Between
                };
                (self.silent_s, self.threshold_s, verdict)
            }
            Ok(RecordingState::Stopped) => (f64::from(newest.problem), 0.0, ReadingState::Bad),
            Ok(RecordingState::Ended) => return DetectorOutput::Idle,
            // Of a recorder of another version.
            Err(_) => return DetectorOutput::Unknown,
        };
        DetectorOutput::Measured(Reading {
            value,
            threshold,
            verdict,
            since_ns: newest.time_ns,
            cell: None,
            severity: Severity::Warning,
        })
    }
}
