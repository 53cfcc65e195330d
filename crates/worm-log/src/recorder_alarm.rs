//! The alarm `recording-stopped` depends on the recorder and not on the states, so a replay of the states does not have it, and a comparison
//! leaves it out.

use worm_estimator::message::{Alarm, AlarmKind, Estimate};

const KIND: u32 = AlarmKind::RecordingStopped.code();

/// The estimate without that alarm.
pub(super) const fn without(estimate: &Estimate) -> Estimate {
    Estimate {
        armed_mask: estimate.armed_mask & !(1 << KIND),
        raised_mask: estimate.raised_mask & !(1 << KIND),
        ..*estimate
    }
}

/// The changes of the other alarms, numbered as if that alarm did not exist.
pub(super) fn others(changes: &[Alarm]) -> impl Iterator<Item = Alarm> {
    let (mut left_out, mut last) = (0, 0);
    changes.iter().filter_map(move |alarm| {
        if alarm.sequence < last {
            // Another estimator, which counts anew.
            left_out = 0;
        }
        last = alarm.sequence;
        left_out += u64::from(alarm.kind == KIND);
        (alarm.kind != KIND).then(|| Alarm {
            sequence: alarm.sequence.saturating_sub(left_out),
            ..*alarm
        })
    })
}
