//! What every recording must satisfy, wherever it comes from, so that no result is made of nothing.

use super::gaps::{bridge, holes, is_longer, round_up};
use super::options::OpenOptions;
use super::series::Recording;
use super::statistics::{moves, quantile, spread};
use worm_log::ReadError;

/// Fewest samples that can show anything.
const MIN_SAMPLES: usize = 10;
/// No worm's neighbouring cells are this far apart, or move this far against each other, m: stroke and spacing are at most
/// 1 m, and a worm of some millimetres that is written down in millimetres has numbers beyond this.
const TOO_LARGE_M: f64 = 5.0;
/// A jump in time of so many usual periods is a hole.
const HOLE_PERIODS: f64 = 5.0;

/// Checks a recording that has just been read and cut, and bridges short holes in its phase. `whole_s` is the time of the first
/// and the last sample before the cut.
///
/// # Errors
/// [`ReadError`] for a recording that no worm could have made, or that leaves too much unseen.
pub(super) fn check(
    recording: &mut Recording,
    options: &OpenOptions,
    whole_s: Option<(f64, f64)>,
) -> Result<(), ReadError> {
    check_samples(recording, options, whole_s)?;
    check_seen(recording)?;
    check_time(recording, options.max_gap_s)?;
    recording.check_gaps(options.max_gap_s)?;
    complete_phase(recording, options.max_gap_s)?;
    check_lengths(recording)?;
    check_motion(recording)?;
    note_order(recording);
    Ok(())
}

fn check_samples(recording: &Recording, options: &OpenOptions, whole_s: Option<(f64, f64)>) -> Result<(), ReadError> {
    let samples = recording.samples();
    if samples >= MIN_SAMPLES {
        return Ok(());
    }
    let (left, remedy) = match (options.from_s.or(options.to_s), whole_s) {
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

fn check_time(recording: &Recording, max_gap_s: f64) -> Result<(), ReadError> {
    let steps = || recording.time_s.windows(2).map(|pair| pair[1] - pair[0]);
    let period_s = quantile(steps(), 0.5).unwrap_or(0.0);
    let longest_s = max_gap_s.max(HOLE_PERIODS * period_s);
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
            format!(
                "give --max-gap {:.1} to accept it, or leave it out with --from or --to",
                round_up(pair[1] - pair[0])
            ),
        )),
    }
}

/// The phase is a clock: short holes are bridged, anything else is refused.
fn complete_phase(recording: &mut Recording, max_gap_s: f64) -> Result<(), ReadError> {
    let Some(phase) = &mut recording.gait_phase else {
        return Ok(());
    };
    let time_s = &recording.time_s;
    let last = time_s.len() - 1;
    let long = holes(phase).find(|hole| {
        let is_edge = hole.start == 0 || hole.end > last;
        is_edge || is_longer(time_s[hole.end] - time_s[hole.start - 1], max_gap_s)
    });
    if let Some(hole) = long {
        return Err(ReadError::at(
            &recording.source,
            "gait_phase",
            format!(
                "there is no phase from {:.3} s to {:.3} s",
                time_s[hole.start],
                time_s[hole.end - 1]
            ),
            "cut the recording with --from and --to, or take the column out: the phase is then found from the positions",
        ));
    }
    let bridged: usize = holes(phase).map(|hole| hole.len()).sum();
    if bridged > 0 {
        bridge(time_s, phase);
        let note = format!("gait_phase is missing in {bridged} samples and was interpolated there");
        recording.warnings.push(note);
    }
    Ok(())
}

/// Distances between cells, which no choice of origin changes, tell metres from millimetres.
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
    let play_m = median_of(pairs().map(spread).collect());
    let problem = if apart_m > TOO_LARGE_M {
        format!("neighbouring cells are {apart_m:.1} m apart")
    } else if play_m > TOO_LARGE_M {
        format!("neighbouring cells move by {play_m:.1} m against each other")
    } else {
        return Ok(());
    };
    Err(ReadError::whole(
        &recording.source,
        format!("{problem}, which no worm does: the positions are evidently in millimetres"),
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

/// Cell 1 leads, unless somebody numbered them the other way round or gave each cell an origin of its own.
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
