//! A model mismatch in words: which cell, in whose step, where in the gait, and how much.

use worm_estimator::message::{Alarm, AlarmKind};

/// Where in the gait a model mismatch shows: phase, 0 to 1, and the cell that steps there, from 1. None for other alarms.
pub(super) fn place_of(alarm: &Alarm, step_order: &[usize]) -> Option<(f64, usize)> {
    let is_mismatch = alarm.kind == AlarmKind::ModelMismatch.code() && alarm.phase.is_finite();
    let phase = is_mismatch.then(|| alarm.phase.rem_euclid(1.0))?;
    let step = (phase * step_order.len() as f64) as usize;
    Some((phase, *step_order.get(step)?))
}

/// A model mismatch in words; none for other alarms.
pub(crate) fn text_of(alarm: &Alarm, step_order: &[usize]) -> Option<String> {
    let (phase, stepping_cell) = place_of(alarm, step_order)?;
    (alarm.cell != u32::MAX).then(|| text(alarm.cell + 1, stepping_cell, phase, alarm.value))
}

/// The words; cells from 1.
pub(super) fn text(cell: u32, stepping_cell: usize, phase: f64, unexplained_m: f64) -> String {
    let step = if cell as usize == stepping_cell {
        "in its own step".to_owned()
    } else {
        format!("while cell {stepping_cell} steps")
    };
    format!(
        "cell {cell} {step}, phase {phase:.2}: {:+.2} mm a cycle unexplained",
        unexplained_m * 1e3
    )
}
