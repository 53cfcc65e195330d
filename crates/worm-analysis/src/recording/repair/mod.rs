//! Repairs a capture, and reports every repair.
//!
//! Trackers confuse markers, lose and freeze them, and are knocked. What the rest of the recording decides beyond doubt is put right
//! here, in this order, because each step relies on those before it:
//! 1. `labels`: cells cannot pass one another in a canal, so their order shows which marker is whose.
//! 2. `frozen`: a marker without noise is no measurement.
//! 3. `jumps`: a marker that jumps away alone is left out until it comes back; one that stays away has moved on its cell.
//!
//! Positions are given to another cell or left out, never changed. A recording without such faults stays as it is, to the last bit.
//! Where too much would have to be repaired, or a label has two explanations, the recording is refused.
//! Knocks of the camera look like slips of the body until the gait is known: [`identify`](crate::identify) finds those.

mod frozen;
mod jumps;
mod labels;
pub(super) mod stamps;

use super::gaps::is_longer;
use super::options::OpenOptions;
use super::repair_note::{Repair, RepairKind};
use super::series::Recording;
use super::statistics::noise;
use worm_log::ReadError;

/// Most samples in which labels may be swapped for a while, as a fraction of the recording, and the time that is always accepted, s. A swap
/// that lasts to an end of the recording is one event, however long, and does not count.
const MAX_RELABELLED: (f64, f64) = (0.02, 0.5);
/// Largest fraction of a cell's positions that may be left out.
const MAX_LEFT_OUT: f64 = 0.1;
/// Most markers that may move on their cells in a run.
const MAX_MOVED: usize = 3;
/// A repair can bring another fault to light; one that needs more rounds than this is none.
const MAX_ROUNDS: usize = 4;

/// Repairs a recording whose times and positions are usable, and notes each repair.
///
/// # Errors
/// [`ReadError`] names what was seen and where, when it is too much to repair or cannot be decided.
pub(super) fn repair(recording: &mut Recording, options: &OpenOptions) -> Result<(), ReadError> {
    recording.repairs.extend(stamps::missing(&recording.time_s));
    let before = recording.position_m.clone();
    for _ in 0..MAX_ROUNDS {
        let mut found = labels::undo_swaps(recording)?;
        found.extend(frozen::leave_out(recording));
        let jumps = jumps::find(recording);
        jumps::leave_out(recording, &jumps);
        let (changes, moved): (Vec<Repair>, Vec<Repair>) = jumps
            .into_iter()
            .map(|jump| jump.repair)
            .partition(|repair| repair.what == RepairKind::MarkerJump);
        found.extend(changes);
        let is_stable = found.is_empty();
        recording.repairs.extend(found);
        if is_stable {
            recording.repairs.extend(moved);
            return check_extent(recording, &before, options);
        }
    }
    Err(ReadError::whole(
        &recording.source,
        "the labels of its markers contradict one another in more ways than one",
        "label the markers again in the tracker's software, or cut the recording to where they are right (--from, --to)",
    ))
}

/// Refuses a recording of which too much had to be repaired.
fn check_extent(recording: &Recording, before: &[Vec<f64>], options: &OpenOptions) -> Result<(), ReadError> {
    let problem = too_many_relabelled(recording)
        .or_else(|| too_many_left_out(recording, before))
        .or_else(|| too_many_moved(recording));
    match problem {
        None => check_lengths_left_out(recording, options),
        Some(problem) => Err(ReadError::whole(
            &recording.source,
            problem,
            "label the markers again in the tracker's software, or leave that part out with --from or --to",
        )),
    }
}

fn rate_hz(recording: &Recording) -> f64 {
    let last = recording.samples() - 1;
    last as f64 / (recording.time_s[last] - recording.time_s[0])
}

/// Refuses markers that are frozen or away for longer than may be bridged.
fn check_lengths_left_out(recording: &Recording, options: &OpenOptions) -> Result<(), ReadError> {
    // To bridge is from the sample before to the sample after.
    let bridged_s = |repair: &Repair| repair.to_s - repair.from_s + 2.0 / rate_hz(recording);
    let is_too_long = |repair: &&Repair| {
        matches!(repair.what, RepairKind::FrozenMarker | RepairKind::MarkerJump)
            && is_longer(bridged_s(repair), options.max_gap_s)
    };
    match recording.repairs.iter().find(is_too_long) {
        None => Ok(()),
        Some(repair) => Err(ReadError::whole(
            &recording.source,
            format!("{repair}, and {} s may be bridged", options.max_gap_s),
            recording.remedy_of_gap(repair.from_s, repair.from_s + bridged_s(repair), false),
        )),
    }
}

/// Labels swapped for a while in too many samples.
fn too_many_relabelled(recording: &Recording) -> Option<String> {
    let samples = recording.samples();
    let (first_s, last_s) = (recording.time_s[0], recording.time_s[samples - 1]);
    let for_a_while: Vec<&Repair> = recording
        .repairs
        .iter()
        .filter(|repair| repair.what == RepairKind::SwappedLabel && repair.from_s > first_s && repair.to_s < last_s)
        .collect();
    let of_cell = |cell: usize| -> usize {
        let own = for_a_while.iter().filter(|repair| repair.cell == Some(cell));
        own.map(|repair| repair.samples).sum()
    };
    let relabelled = (1..=recording.cells()).map(of_cell).max().unwrap_or(0);
    let allowed = (MAX_RELABELLED.0 * samples as f64).max(MAX_RELABELLED.1 * rate_hz(recording));
    if relabelled as f64 <= allowed {
        return None;
    }
    let from_s = for_a_while
        .iter()
        .map(|repair| repair.from_s)
        .fold(f64::INFINITY, f64::min);
    let to_s = for_a_while
        .iter()
        .map(|repair| repair.to_s)
        .fold(f64::NEG_INFINITY, f64::max);
    Some(format!(
        "markers carry the labels of others in {relabelled} of {samples} samples, between {from_s:.3} s and {to_s:.3} s, and {:.0} % may \
         be undone",
        MAX_RELABELLED.0 * 100.0
    ))
}

/// A cell of which too many positions were left out, as against those `before`.
fn too_many_left_out(recording: &Recording, before: &[Vec<f64>]) -> Option<String> {
    let samples = recording.samples();
    let unseen = |series: &[f64]| series.iter().filter(|at_m| at_m.is_nan()).count();
    for (cell, (series, before)) in recording.position_m.iter().zip(before).enumerate() {
        let left_out = unseen(series).saturating_sub(unseen(before));
        if left_out as f64 <= MAX_LEFT_OUT * samples as f64 {
            continue;
        }
        let own = recording
            .repairs
            .iter()
            .filter(|repair| repair.cell == Some(cell + 1) && repair.what != RepairKind::MarkerMoved);
        let what = own
            .max_by_key(|repair| repair.samples)
            .map_or(String::new(), |repair| format!(", such as: {repair}"));
        let name = recording.name_of(cell);
        return Some(format!(
            "{left_out} of {samples} positions of {name} cannot be used{what}"
        ));
    }
    None
}

/// Too many markers that moved on their cells.
fn too_many_moved(recording: &Recording) -> Option<String> {
    let moved = recording
        .repairs
        .iter()
        .filter(|repair| repair.what == RepairKind::MarkerMoved);
    let count = moved.clone().count();
    let places: Vec<String> = moved
        .take(MAX_MOVED + 1)
        .map(|repair| format!("cell {} at {:.3} s", repair.cell.unwrap_or(0), repair.from_s))
        .collect();
    (count > MAX_MOVED).then(|| {
        format!(
            "markers change their places on their cells {count} times ({})",
            places.join(", ")
        )
    })
}

/// The usual noise of a position, m: the median over the cells, so that one faulty marker does not count.
fn usual_noise(position_m: &[Vec<f64>]) -> f64 {
    let mut noises: Vec<f64> = position_m.iter().map(|series| noise(series)).collect();
    let middle = noises.len() / 2;
    *noises.select_nth_unstable_by(middle, f64::total_cmp).1
}
