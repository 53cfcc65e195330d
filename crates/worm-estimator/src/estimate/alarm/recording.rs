//! Recording stopped: the recorder could not go on, or was killed.
//!
//! The recorder reports once a second, and says when it ends and why. One that says that it stopped because of a problem raises the alarm
//! at once; value is then the code of the problem and threshold 0. One that falls silent without a word was killed or hangs; value and
//! threshold are the silence in s, not counting pauses of the computer. One that ended in order, or none at all, is nothing to watch.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::message::{RecordingState, RecordingStatus, Severity};

#[derive(Debug, Clone)]
pub(super) struct RecordingStopped {
    threshold_s: f64,
    newest: Option<RecordingStatus>,
    silent_s: f64, // since `newest` came
}

impl RecordingStopped {
    pub(super) const fn new(config: &Config) -> Self {
        Self {
            threshold_s: config.alarms.recording_stopped.threshold,
            newest: None,
            silent_s: 0.0,
        }
    }

    pub(super) const fn note(&mut self, status: &RecordingStatus) {
        self.newest = Some(*status);
        self.silent_s = 0.0;
    }

    pub(super) fn update(&mut self, tick: &Tick) -> DetectorOutput {
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
