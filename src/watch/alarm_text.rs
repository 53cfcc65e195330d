//! A raised alarm in words.

use super::{mismatch, recording};
use crate::relay::wire::Subject;
use worm_estimator::message::{Alarm, AlarmKind};

/// What is wrong, and by how much.
pub(crate) fn of(alarm: &Alarm, subject: &Subject) -> String {
    let name = AlarmKind::try_from(alarm.kind).map_or("?", AlarmKind::name);
    let words = mismatch::text_of(alarm, &subject.step_order).or_else(|| recording::alarm_text(alarm));
    if let Some(what) = words {
        return format!("{name}: {what}");
    }
    let cell = if alarm.cell == u32::MAX {
        String::new()
    } else {
        format!(" cell {}", alarm.cell + 1)
    };
    format!("{name}{cell}: {:.4} against {:.4}", alarm.value, alarm.threshold)
}
