//! A latched fault in words: what stopped the worm, what that means, and what to do about it.

use super::alarm_text;
use super::picture::Picture;
use crate::remedy;
use worm_estimator::message::{AlarmKind, Fault};

/// The fault that the newest state holds. It stays when the alarm behind it has long cleared.
pub(crate) struct LatchedFault {
    /// What stopped the worm, in a few words, as `jammed-cell cell 2` or `link-lost`.
    pub(crate) cause: String,
    /// The same with by how much, or with what it means.
    pub(crate) details: String,
    /// What to do about it.
    pub(crate) remedy: String,
}

impl LatchedFault {
    /// That of a worm; none where it has none.
    pub(crate) fn of(picture: &Picture) -> Option<Self> {
        let state = picture.state?;
        let fault = Fault::try_from(state.fault).unwrap_or(Fault::None);
        if fault == Fault::None {
            return None;
        }
        let (meaning, remedy) = remedy::of_fault(fault).unwrap_or_default();
        let alarm = AlarmKind::try_from(state.fault_alarm).ok();
        let Some(kind) = alarm.filter(|_| fault == Fault::Alarm) else {
            return Some(Self {
                cause: fault.to_string(),
                details: format!("{fault}: {meaning}"),
                remedy,
            });
        };
        let raised = picture.raised.iter().chain(picture.alarms.iter());
        // The one that is raised, or else the last that was.
        let raised = raised
            .filter(|it| it.kind == kind.code() && it.raised == 1)
            .max_by_key(|it| it.time_ns);
        let cell = raised.map_or(u32::MAX, |it| it.cell);
        let cause = match cell {
            u32::MAX => kind.to_string(),
            cell => format!("{kind} cell {}", cell.saturating_add(1)),
        };
        Some(Self {
            details: raised.map_or_else(|| cause.clone(), |it| alarm_text::of(it, &picture.subject)),
            cause,
            remedy: remedy::of(kind),
        })
    }
}
