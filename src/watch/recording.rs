//! A recording in words: how far it is, and why it has stopped.

use worm_estimator::message::{Alarm, AlarmKind, RecordingProblem, RecordingState, RecordingStatus};

/// How far a recording is, or why it has stopped.
pub(crate) fn progress_text(status: &RecordingStatus) -> String {
    let size = format!("{:.1} MB", status.bytes as f64 * 1e-6);
    match RecordingState::try_from(status.state) {
        Ok(RecordingState::Recording) => {
            let mut text = format!("recording {size}");
            if status.files > 1 {
                text += &format!(", file {}", status.files);
            }
            if status.messages_lost > 0 {
                text += &format!(", {} lost", status.messages_lost);
            }
            text
        }
        Ok(RecordingState::Ended) => format!("recorded {size}"),
        Ok(RecordingState::Stopped) => {
            let problem = RecordingProblem::try_from(status.problem).map_or("unknown", RecordingProblem::name);
            format!("recording stopped: {problem}")
        }
        Err(_) => "a recorder of another version".to_owned(),
    }
}

/// Whether it has stopped because of a problem.
pub(super) const fn has_stopped(status: &RecordingStatus) -> bool {
    status.state == RecordingState::Stopped.code()
}

/// What the alarm `recording-stopped` means; none for other alarms.
pub(crate) fn alarm_text(alarm: &Alarm) -> Option<String> {
    (alarm.kind == AlarmKind::RecordingStopped.code()).then(|| text(alarm.value, alarm.threshold))
}

/// The words for value and threshold of that alarm.
pub(super) fn text(value: f64, threshold: f64) -> String {
    if threshold > 0.0 {
        return format!("nothing heard of the recorder for {value:.1} s");
    }
    let problem = RecordingProblem::try_from(value as u32).map_or("unknown", RecordingProblem::name);
    problem.to_owned()
}
