//! Which cell steps when, found from the positions alone.
//!
//! Relative to the mean of all cells a cell rises during its own step and falls during all others, by so much more than noise
//! that its turning points can be found without knowing the period: a turn counts once the cell has come back by a good part
//! of its swing. From the turning points follow the steps, their cyclic order, and a first idea of the gait phase.

use super::gait_error::GaitError;
use super::running_median::running_median;
use std::ops::Range;

/// Share of a cell's swing by which it must come back for a turn to count.
const TURN_FRACTION: f64 = 0.4;
/// Share of a cell's swing that a step cut off by an end of the recording must show to count.
const PARTIAL_FRACTION: f64 = 0.3;
/// Samples of the running median that takes outliers out before turns are looked for.
const MEDIAN_SAMPLES: usize = 5;
/// Share of all steps that may fall out of the order before there is none.
const DISORDER_FRACTION: f64 = 0.1;
/// What a missing step costs, in steps found: more than half, so that leaving one out is better than missing two.
const MISSING: f64 = 0.75;
/// Swing, as a multiple of the noise, below which nothing can be seen to step.
const MIN_SWING: f64 = 10.0;
/// Share of a cell's time that it may spend rising: half, and some doubt, would be a crawl in reverse.
const RISING_FRACTION: f64 = 0.55;

/// A cell is left behind that goes to and fro by less than the first share of what is usual, and away by more than the second.
const LEFT_BEHIND: (f64, f64) = (0.5, 1.5);

/// One step of one cell.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// The cell, from 0.
    pub cell: usize,
    /// Samples from its beginning to its end; a step that an end of the recording cuts off begins or ends there.
    pub samples: Range<usize>,
    /// Share of a whole step seen: below 1 for one that is cut off.
    pub fraction: f64,
    /// Number of the step since the first, counting those that were not seen.
    pub slot: usize,
}

/// The steps of all cells in time, and the order in which the cells step, from 0, beginning with that of the first step.
pub(super) fn find(
    position_m: &[Vec<f64>],
    time_s: &[f64],
    noise_m: f64,
) -> Result<(Vec<Step>, Vec<usize>), GaitError> {
    let relative_m = relative(position_m);
    let mut steps = Vec::new();
    let (mut rising, mut turning) = (0, 0);
    for (cell, series_m) in relative_m.iter().enumerate() {
        let smooth_m = running_median(series_m, MEDIAN_SAMPLES);
        let swing_m = swing(&smooth_m);
        if swing_m.is_nan() || swing_m == 0.0 || swing_m < MIN_SWING * noise_m {
            return Err(GaitError::NoStep { cell, swing_m });
        }
        let turns = turning_points(&smooth_m, TURN_FRACTION * swing_m);
        for pair in turns.windows(2) {
            let (low, high) = (&pair[0], &pair[1]);
            turning += high.sample - low.sample;
            if low.is_peak {
                continue;
            }
            rising += high.sample - low.sample;
            let seen_m = smooth_m[high.sample] - smooth_m[low.sample];
            steps.push((
                cell,
                low.sample..high.sample,
                (seen_m / swing_m).min(1.0),
                low.is_end || high.is_end,
            ));
        }
    }
    if rising as f64 > RISING_FRACTION * turning as f64 {
        return Err(GaitError::Backward);
    }
    steps.retain(|(_, _, fraction, at_end)| !at_end || *fraction > PARTIAL_FRACTION);
    steps.sort_by_key(|(_, samples, ..)| samples.start + samples.end);
    let sequence: Vec<usize> = steps.iter().map(|step| step.0).collect();
    let numbered = cyclic_order(&sequence, position_m.len()).and_then(|mut order| {
        let steps = number(&steps, &order, time_s)?;
        let first = order.iter().position(|&cell| cell == steps[0].cell).unwrap_or(0);
        order.rotate_left(first);
        Ok((steps, order))
    });
    // One cell that stays behind makes all look out of order, and it is to be named.
    numbered.map_err(|error| left_behind(&relative_m).unwrap_or(error))
}

/// A cell that does not step while the others crawl on: against their mean it goes straight away, with little to and fro.
fn left_behind(relative_m: &[Vec<f64>]) -> Option<GaitError> {
    let ways: Vec<(f64, f64)> = relative_m
        .iter()
        .map(|series_m| {
            let smooth_m = running_median(series_m, MEDIAN_SAMPLES);
            let displacement_m = smooth_m.last()? - smooth_m.first()?;
            let last = (smooth_m.len() - 1).max(1) as f64;
            let bent_m: Vec<f64> = (0..)
                .zip(&smooth_m)
                .map(|(at, at_m)| at_m - displacement_m * f64::from(at) / last)
                .collect();
            Some((displacement_m.abs(), swing(&bent_m)))
        })
        .collect::<Option<_>>()?;
    let (cell, &(displacement_m, swing_m)) = ways.iter().enumerate().min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let mut swings: Vec<f64> = ways.iter().map(|way| way.1).collect();
    swings.sort_by(f64::total_cmp);
    let usual_m = swings[swings.len() / 2];
    (swing_m < LEFT_BEHIND.0 * usual_m && displacement_m > LEFT_BEHIND.1 * usual_m)
        .then_some(GaitError::NoStep { cell, swing_m })
}

/// Gives every step its number, and leaves out those that are in nobody's turn.
fn number(found: &[(usize, Range<usize>, f64, bool)], order: &[usize], time_s: &[f64]) -> Result<Vec<Step>, GaitError> {
    let kept = chain(&found.iter().map(|step| step.0).collect::<Vec<_>>(), order);
    let mut steps: Vec<Step> = Vec::with_capacity(kept.len());
    let mut disorder: Vec<usize> = Vec::new();
    let mut expected = 0;
    for at in kept {
        let (cell, samples, fraction, at_end) = &found[at];
        let slot = steps
            .last()
            .map_or(0, |last| next_slot(order, last.slot, last.cell, *cell));
        // Steps left out, and steps not seen.
        let amiss = (at - expected).max(steps.last().map_or(0, |last| slot - last.slot - 1));
        disorder.extend(std::iter::repeat_n(samples.start, amiss));
        expected = at + 1;
        steps.push(Step {
            cell: *cell,
            samples: samples.clone(),
            fraction: if *at_end { *fraction } else { 1.0 },
            slot,
        });
    }
    if disorder.len() + found.len() - expected > (DISORDER_FRACTION * found.len() as f64) as usize {
        let sample = disorder
            .first()
            .copied()
            .unwrap_or(found[expected.min(found.len() - 1)].1.start);
        return Err(GaitError::Disorder { at_s: time_s[sample] });
    }
    Ok(steps)
}

/// The steps that follow one another best in an order: each kept counts one, each that is missing between two costs
/// [`MISSING`]. One that noise made up would otherwise shift all after it by a cycle.
fn chain(cells: &[usize], order: &[usize]) -> Vec<usize> {
    let reach = 2 * order.len();
    let mut best: Vec<(f64, Option<usize>)> = Vec::with_capacity(cells.len()); // of the chain that ends here; what precedes
    for (at, &cell) in cells.iter().enumerate() {
        let mut here = (1.0, None);
        for before in (at.saturating_sub(reach)..at).rev() {
            let missing = next_slot(order, 0, cells[before], cell) - 1;
            let score = best[before].0 + 1.0 - MISSING * missing as f64;
            if score > here.0 {
                here = (score, Some(before));
            }
        }
        best.push(here);
    }
    let mut at = (0..best.len()).max_by(|&a, &b| best[a].0.total_cmp(&best[b].0));
    let mut kept = Vec::with_capacity(best.len());
    while let Some(last) = at {
        kept.push(last);
        at = best[last].1;
    }
    kept.reverse();
    kept
}

/// The number of the first step of `cell` after step number `slot`, which was of cell `last`.
fn next_slot(order: &[usize], slot: usize, last: usize, cell: usize) -> usize {
    let place = |cell| order.iter().position(|&other| other == cell).unwrap_or(0);
    let ahead = (place(cell) + order.len() - place(last)) % order.len();
    slot + if ahead == 0 { order.len() } else { ahead }
}

/// The order in which each cell is most often followed by the next.
fn cyclic_order(sequence: &[usize], cells: usize) -> Result<Vec<usize>, GaitError> {
    let mut follows = vec![vec![0_usize; cells]; cells];
    for pair in sequence.windows(2) {
        follows[pair[0]][pair[1]] += 1;
    }
    let mut order = vec![sequence.first().copied().unwrap_or(0)];
    while order.len() < cells {
        let row = &follows[order[order.len() - 1]];
        let next = (0..cells)
            .filter(|cell| !order.contains(cell))
            .max_by_key(|&cell| row[cell])
            .filter(|&cell| row[cell] > 0);
        let Some(next) = next else {
            return Err(GaitError::TooFewSteps {
                cycles: sequence.len() as f64 / cells as f64,
            });
        };
        order.push(next);
    }
    Ok(order)
}

/// Positions less the mean of all cells, m.
fn relative(position_m: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let cells = position_m.len() as f64;
    let mut relative_m = position_m.to_vec();
    for sample in 0..position_m[0].len() {
        let mean_m = position_m.iter().map(|series| series[sample]).sum::<f64>() / cells;
        for series in &mut relative_m {
            series[sample] -= mean_m;
        }
    }
    relative_m
}

/// How far a series goes up and down, its rarest values left out.
fn swing(series: &[f64]) -> f64 {
    let mut sorted = series.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = |fraction: f64| sorted[((sorted.len() - 1) as f64 * fraction).round() as usize];
    rank(0.995) - rank(0.005)
}

struct Turn {
    sample: usize,
    is_peak: bool,
    is_end: bool, // an end of the series, no turn
}

/// Alternating valleys and peaks that differ by `threshold` at least, and both ends of the series.
fn turning_points(series: &[f64], threshold: f64) -> Vec<Turn> {
    let mut turns: Vec<Turn> = Vec::new();
    let (mut lowest, mut highest) = (0, 0);
    let mut rising: Option<bool> = None;
    for (at, &value) in series.iter().enumerate() {
        if value < series[lowest] {
            lowest = at;
        }
        if value > series[highest] {
            highest = at;
        }
        if rising != Some(false) && series[highest] - value >= threshold {
            turns.push(Turn {
                sample: highest,
                is_peak: true,
                is_end: false,
            });
            (rising, lowest) = (Some(false), at);
        } else if rising != Some(true) && value - series[lowest] >= threshold {
            turns.push(Turn {
                sample: lowest,
                is_peak: false,
                is_end: false,
            });
            (rising, highest) = (Some(true), at);
        }
    }
    if let Some(first) = turns.first() {
        let (sample, is_peak) = (first.sample, first.is_peak);
        if sample > 0 {
            let edge = Turn {
                sample: 0,
                is_peak: !is_peak,
                is_end: true,
            };
            turns.insert(0, edge);
        }
    }
    if let Some(last) = turns.last() {
        let is_peak = !last.is_peak;
        // The open swing ends at its extreme, not where the recording does: the worm may stand there.
        let sample = if is_peak { highest } else { lowest };
        if sample > last.sample {
            turns.push(Turn {
                sample,
                is_peak,
                is_end: true,
            });
        }
    }
    turns
}
