//! A recording without the shifts of markers and camera, and its gait.
//!
//! A marker that moved on its cell is found when the recording is read; a knock of the camera only once the gait is known. Both are
//! estimated shifts of positions from one time on. They are taken out here, in a copy, and each is reported with its standard error.

use super::gait::{IdentifiedGait, steps_made};
use super::gait_error::GaitError;
use super::{clock, knock, rest};
use crate::recording::{Recording, Repair, RepairKind};
use std::borrow::Cow;

/// Most knocks that are taken out of a recording.
const MAX_KNOCKS: usize = 3;

/// Fraction of the first estimate of a marker's move that the cycles around it must confirm.
const CONFIRMED: f64 = 0.5;
/// Longest time of a gait cycle, s: `gait.cycle_s` at most, of a motor that droops by a fifth.
const LONGEST_CYCLE_S: f64 = 150.0;

/// A shift of some cells from one sample on.
///
/// The estimate is taken out of the positions; what is left of it is uncertain by `sigma_m`. A search that wants to marginalise it adds
/// a column to its nuisances that is 1 for these cells from `sample` on and 0 elsewhere, with a wide prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// The cell, from 0; none for all.
    pub cell: Option<usize>,
    /// The first sample after it.
    pub sample: usize,
    /// How far, m.
    pub shift_m: f64,
    /// Standard error of that, m.
    pub sigma_m: f64,
}

/// A recording whose gait is known, without shifts.
#[derive(Debug, Clone)]
pub struct Steadied<'a> {
    /// The recording itself where it has no shift, else a copy without them.
    pub recording: Cow<'a, Recording>,
    /// Its gait.
    pub gait: IdentifiedGait,
    /// What was taken out, in order of time.
    pub shifts: Vec<Shift>,
    /// Every repair of the recording, and what was only noticed; those of its reader first.
    pub repairs: Vec<Repair>,
}

/// Finds the gait of a recording by `find_gait` from measured and filled positions, and takes out the shifts of markers and camera.
///
/// # Errors
/// [`GaitError`] of `find_gait`, that no worm crawls so slowly, or that there are too many knocks.
pub fn steady<'a>(
    recording: &'a Recording,
    find_gait: impl Fn(&[Vec<f64>], &[Vec<f64>]) -> Result<IdentifiedGait, GaitError>,
) -> Result<Steadied<'a>, GaitError> {
    let gait_of = |recording: &Recording| find_gait(&recording.position_m, &recording.filled());
    let time_s = &recording.time_s;
    let mut shifts: Vec<Shift> = recording
        .repairs
        .iter()
        .filter_map(|repair| moved(repair, time_s))
        .collect();
    let mut repairs: Vec<Repair> = recording
        .repairs
        .iter()
        .filter(|repair| repair.what != RepairKind::MarkerMoved)
        .cloned()
        .collect();
    let mut steadied = without(Cow::Borrowed(recording), &shifts);
    let mut gait = gait_of(&steadied)?;
    check_clock(time_s, &gait.phase)?;
    if !shifts.is_empty() {
        let first_m: Vec<f64> = shifts.iter().map(|shift| shift.shift_m).collect();
        for shift in &mut shifts {
            let left = refine(&steadied.position_m, &gait, shift);
            (shift.shift_m, shift.sigma_m) = (shift.shift_m + left.shift_m, left.sigma_m);
        }
        // What a cycle before and one after do not confirm was no move.
        let mut first_m = first_m.into_iter();
        shifts.retain(|shift| {
            first_m
                .next()
                .is_some_and(|first_m| shift.shift_m / first_m >= CONFIRMED)
        });
        steadied = without(Cow::Borrowed(recording), &shifts);
        gait = gait_of(&steadied)?;
    }
    let knocks = knock::find(time_s, &steadied.position_m, &gait);
    if knocks.len() > MAX_KNOCKS {
        return Err(GaitError::Knocks {
            at_s: knocks.iter().map(|knock| time_s[knock.sample]).collect(),
        });
    }
    if !knocks.is_empty() {
        let knocks: Vec<Shift> = knocks
            .iter()
            .map(|knock| Shift {
                cell: None,
                sample: knock.sample,
                shift_m: knock.shift_m,
                sigma_m: knock.sigma_m,
            })
            .collect();
        steadied = without(steadied, &knocks);
        gait = gait_of(&steadied)?;
        shifts.extend(knocks);
    }
    shifts.sort_by_key(|shift| shift.sample);
    repairs.extend(shifts.iter().map(|shift| report(shift, time_s)));
    repairs.extend(rest::drift(time_s, &gait));
    if recording.gait_phase.is_some() {
        repairs.extend(clock::drift(time_s, &steadied.position_m, &gait));
    }
    Ok(Steadied {
        recording: steadied,
        gait,
        shifts,
        repairs,
    })
}

/// Refuses times of which even the fastest cycle takes too many. Others may hold rests.
fn check_clock(time_s: &[f64], phase: &[f64]) -> Result<(), GaitError> {
    let mut fastest_s = f64::INFINITY;
    let mut from = 0;
    for sample in 0..phase.len() {
        if phase[sample] - phase[from] >= 1.0 {
            fastest_s = fastest_s.min(time_s[sample] - time_s[from]);
            from = sample;
        }
    }
    if fastest_s.is_finite() && fastest_s > LONGEST_CYCLE_S {
        return Err(GaitError::Clock { cycle_s: fastest_s });
    }
    Ok(())
}

/// The shift of a marker that moved on its cell.
fn moved(repair: &Repair, time_s: &[f64]) -> Option<Shift> {
    (repair.what == RepairKind::MarkerMoved).then_some(Shift {
        cell: Some(repair.cell?.checked_sub(1)?),
        sample: time_s.partition_point(|&at_s| at_s < repair.from_s),
        shift_m: repair.shift_m?,
        sigma_m: repair.shift_sigma_m?,
    })
}

fn report(shift: &Shift, time_s: &[f64]) -> Repair {
    let what = match shift.cell {
        Some(_) => RepairKind::MarkerMoved,
        None => RepairKind::CameraKnock,
    };
    let when_s = (time_s[shift.sample], time_s[time_s.len() - 1]);
    Repair::new(what, shift.cell, when_s, time_s.len() - shift.sample).with_shift(shift.shift_m, shift.sigma_m)
}

/// The recording without some shifts; the same where there are none.
fn without<'a>(recording: Cow<'a, Recording>, shifts: &[Shift]) -> Cow<'a, Recording> {
    if shifts.is_empty() {
        return recording;
    }
    let mut recording = recording.into_owned();
    for shift in shifts {
        for (cell, series) in recording.position_m.iter_mut().enumerate() {
            if shift.cell.is_none_or(|shifted| shifted == cell) {
                series[shift.sample..]
                    .iter_mut()
                    .for_each(|at_m| *at_m -= shift.shift_m);
            }
        }
    }
    Cow::Owned(recording)
}

/// What is left of the shift of a marker: its place against the others, within a cycle after less within a cycle before.
fn refine(position_m: &[Vec<f64>], gait: &IdentifiedGait, shift: &Shift) -> Shift {
    let cells = gait.step_order.len();
    let Some(cell) = shift.cell else {
        return *shift;
    };
    let in_body_m = |cell: usize, sample: usize| {
        let place = gait.step_order.iter().position(|&other| other == cell).unwrap_or(0);
        position_m[cell][sample] - gait.stroke_m * steps_made(cells, place, gait.phase[sample])
    };
    let against_others_m = |sample: usize| {
        let others = (0..cells).filter(|&other| other != cell);
        in_body_m(cell, sample) - others.map(|other| in_body_m(other, sample)).sum::<f64>() / (cells - 1) as f64
    };
    let mean_and_count = |samples: std::ops::Range<usize>| {
        let seen = samples.map(against_others_m).filter(|at_m| at_m.is_finite());
        let (sum, count) = seen.fold((0.0, 0.0), |(sum, count), at_m| (sum + at_m, count + 1.0));
        (sum / count, count)
    };
    let phase = gait.phase[shift.sample];
    // Whole cycles on both sides, so that what the cam does between whole steps cancels.
    let cycles = (gait.phase[gait.phase.len() - 1] - phase)
        .min(phase - gait.phase[0])
        .floor()
        .clamp(0.0, 1.0);
    let from = gait.phase.partition_point(|&before| before < phase - cycles);
    let to = gait.phase.partition_point(|&after| after < phase + cycles);
    let (before_m, before) = mean_and_count(from..shift.sample);
    let (after_m, after) = mean_and_count(shift.sample..to);
    let left_m = after_m - before_m;
    if !left_m.is_finite() {
        return Shift { shift_m: 0.0, ..*shift };
    }
    let variance = (1.0 / before + 1.0 / after) * cells as f64 / (cells - 1) as f64;
    Shift {
        shift_m: left_m,
        sigma_m: gait.noise_m * variance.sqrt(),
        ..*shift
    }
}

#[cfg(test)]
mod tests;
