//! What every recording must satisfy, whatever its format.

use super::gaps::{bridge, is_longer, unseen_runs};
use super::options::{OpenOptions, Wanted};
use super::projection::MAX_POSITION_M;
use super::repair::repair;
use super::series::Recording;
use super::statistics::{moves, quantile, spread};
use worm_log::ReadError;

/// Fewest samples that are analysed.
const MIN_SAMPLES: usize = 10;
/// No worm's neighbouring cells are this far apart, or move this far against each other, m: stroke and spacing are at most
/// 1 m, and a worm of some millimetres that is written down in millimetres has numbers beyond this.
const TOO_LARGE_M: f64 = 5.0;
/// A time step of more than so many median periods is a gap.
const MAX_STEP_PERIODS: f64 = 5.0;
/// No recording takes longer than this, s: 30 years.
const MAX_DURATION_S: f64 = 1e9;

impl Recording {
    /// Checks and repairs a recording that was made in memory, as [`open`](super::open) does one that was read.
    ///
    /// # Errors
    /// [`ReadError`] for a recording that no worm could have made, in which too much is unseen, or with more faults than can be
    /// repaired.
    pub fn checked(mut self, options: &OpenOptions) -> Result<Self, ReadError> {
        check(&mut self, options, None)?;
        Ok(self)
    }
}

/// Checks a recording that has just been read and cut, and bridges short gaps in its phase. `full_range_s` is the time of
/// the first and the last sample before the cut.
///
/// # Errors
/// [`ReadError`] for a recording that no worm could have made, or in which too much is unseen.
pub(super) fn check(
    recording: &mut Recording,
    options: &OpenOptions,
    full_range_s: Option<(f64, f64)>,
) -> Result<(), ReadError> {
    check_samples(recording, options, full_range_s)?;
    let is_of_motor = recording.motor.is_some() && recording.gait_phase.is_some() && !recording.has_positions();
    if is_of_motor && options.wanted != Wanted::Positions {
        check_time(recording, options.max_gap_s)?;
        return complete_phase(recording, options.max_gap_s);
    }
    check_seen(recording)?;
    check_positions(recording)?;
    check_time(recording, options.max_gap_s)?;
    repair(recording, options)?;
    recording.check_gaps(options.max_gap_s)?;
    complete_phase(recording, options.max_gap_s)?;
    check_lengths(recording)?;
    check_motion(recording)?;
    note_order(recording);
    Ok(())
}

fn check_samples(
    recording: &Recording,
    options: &OpenOptions,
    full_range_s: Option<(f64, f64)>,
) -> Result<(), ReadError> {
    let samples = recording.samples();
    if samples >= MIN_SAMPLES {
        return Ok(());
    }
    let (left, remedy) = match (options.from_s.or(options.to_s), full_range_s) {
        (Some(_), Some((first_s, last_s))) => (
            " between --from and --to",
            format!("give a longer time; times count as in the file, here from {first_s:.3} to {last_s:.3} s"),
        ),
        _ => ("", "record several gait cycles".to_owned()),
    };
    Err(ReadError::whole(
        &recording.source,
        format!("there are {samples} samples{left}, and at least {MIN_SAMPLES} are needed"),
        remedy,
    ))
}

fn check_seen(recording: &Recording) -> Result<(), ReadError> {
    let is_never_seen = |cell: &usize| recording.position_m[*cell].iter().all(|position_m| position_m.is_nan());
    let unseen: Vec<usize> = (0..recording.cells()).filter(is_never_seen).collect();
    let problem = match unseen.first() {
        None => return Ok(()),
        Some(_) if unseen.len() == recording.cells() => "no cell is ever seen".to_owned(),
        Some(&cell) => format!("{} is never seen", recording.name_of(cell)),
    };
    let remedy = "record it again with every cell in sight, or choose another time with --from and --to";
    Err(ReadError::whole(&recording.source, problem, remedy))
}

fn check_positions(recording: &Recording) -> Result<(), ReadError> {
    for (cell, series) in recording.position_m.iter().enumerate() {
        let beyond = series.iter().zip(&recording.time_s);
        if let Some((position_m, time_s)) = beyond
            .into_iter()
            .find(|(position_m, _)| position_m.abs() > MAX_POSITION_M)
        {
            return Err(ReadError::whole(
                &recording.source,
                format!("{} is at {position_m:.1e} m at {time_s:.3} s", recording.name_of(cell)),
                "leave the field empty where nothing was seen",
            ));
        }
    }
    Ok(())
}

fn check_time(recording: &Recording, max_gap_s: f64) -> Result<(), ReadError> {
    let (first_s, last_s) = (recording.time_s[0], recording.time_s[recording.samples() - 1]);
    if last_s - first_s > MAX_DURATION_S {
        return Err(ReadError::whole(
            &recording.source,
            format!("it lasts from {first_s:.1e} s to {last_s:.1e} s"),
            "give times in seconds",
        ));
    }
    let steps = || recording.time_s.windows(2).map(|pair| pair[1] - pair[0]);
    let period_s = quantile(steps(), 0.5).unwrap_or(0.0);
    let longest_s = max_gap_s.max(MAX_STEP_PERIODS * period_s);
    match recording
        .time_s
        .windows(2)
        .find(|pair| is_longer(pair[1] - pair[0], longest_s))
    {
        None => Ok(()),
        Some(pair) => Err(ReadError::whole(
            &recording.source,
            format!(
                "there is no sample from {:.3} s to {:.3} s, while one comes every {period_s:.4} s otherwise",
                pair[0], pair[1]
            ),
            recording.remedy_of_gap(pair[0], pair[1], false),
        )),
    }
}

/// Bridges short gaps in the phase and refuses longer ones.
fn complete_phase(recording: &mut Recording, max_gap_s: f64) -> Result<(), ReadError> {
    let Some(phase) = &mut recording.gait_phase else {
        return Ok(());
    };
    let time_s = &recording.time_s;
    let last = time_s.len() - 1;
    let too_long = unseen_runs(phase).find(|run| {
        let is_edge = run.start == 0 || run.end > last;
        is_edge || is_longer(time_s[run.end] - time_s[run.start - 1], max_gap_s)
    });
    if let Some(run) = too_long {
        return Err(ReadError::at(
            &recording.source,
            "gait_phase",
            format!(
                "there is no phase from {:.3} s to {:.3} s",
                time_s[run.start],
                time_s[run.end - 1]
            ),
            "cut the recording with --from and --to, or take the column out: the phase is then found from the positions",
        ));
    }
    let bridged: usize = unseen_runs(phase).map(|run| run.len()).sum();
    if bridged > 0 {
        bridge(time_s, phase);
        let note = format!("gait_phase is missing in {bridged} samples and was interpolated there");
        recording.warnings.push(note);
    }
    Ok(())
}

/// Tells metres from millimetres by the distances between cells, which do not depend on the origin.
fn check_lengths(recording: &Recording) -> Result<(), ReadError> {
    let pairs = || {
        recording
            .position_m
            .windows(2)
            .map(|pair| pair[0].iter().zip(&pair[1]).map(|(front_m, back_m)| front_m - back_m))
    };
    let median_of = |lengths: Vec<f64>| quantile(lengths, 0.5).unwrap_or(0.0);
    let apart_m = median_of(
        pairs()
            .filter_map(|distances| quantile(distances.map(f64::abs), 0.5))
            .collect(),
    );
    let relative_motion_m = median_of(pairs().map(spread).collect());
    let problem = if apart_m > TOO_LARGE_M {
        format!("neighbouring cells are {apart_m:.1} m apart")
    } else if relative_motion_m > TOO_LARGE_M {
        format!("neighbouring cells move by {relative_motion_m:.1} m against each other")
    } else {
        return Ok(());
    };
    Err(ReadError::whole(
        &recording.source,
        format!("{problem}, which no worm does: the positions seem to be in millimetres"),
        "divide them by 1000; columns that end in _m hold metres",
    ))
}

fn check_motion(recording: &Recording) -> Result<(), ReadError> {
    if recording.position_m.iter().any(|series| moves(series)) {
        return Ok(());
    }
    Err(ReadError::whole(
        &recording.source,
        "no cell moves beyond its noise",
        "give a recording of a crawling worm, or the part of it where it crawls with --from and --to",
    ))
}

/// Warns where cell 1 lies lowest: cells numbered the other way round, or each with an origin of its own.
fn note_order(recording: &mut Recording) {
    let middle: Vec<f64> = recording
        .position_m
        .iter()
        .filter_map(|series| quantile(series.iter().copied(), 0.5))
        .collect();
    if middle.windows(2).all(|pair| pair[0] < pair[1]) {
        let note = format!(
            "{} lies lowest in the canal: positions grow up the canal and cell 1 leads, unless the worm was recorded backwards",
            recording.name_of(0)
        );
        recording.warnings.push(note);
    }
}

#[cfg(test)]
mod tests;
