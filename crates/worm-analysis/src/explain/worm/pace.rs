//! How fast the drive turned, from knot to knot.
//!
//! The inertia of the body makes its motion depend on the pace. A crawl that repeats has a pace that does: the mean over all cycles, for
//! the phase of a single one is as rough as its encoder, or as the positions that it was found from.

use worm_physics::longest_increment_s;

/// Fewest knots of a step; and the time between two over the longest increment of a crawl.
const KNOTS_OF_STEP: f64 = 104.0;
const OF_INCREMENT: f64 = 0.98;

/// Times between the knots of a cycle, which lie evenly and on the boundaries of the steps.
#[derive(Debug, Clone, Default)]
pub(in crate::explain) struct Pace {
    /// From each knot of a cycle to the next, s.
    between_s: Vec<f64>,
}

impl Pace {
    /// The mean pace of all cycles seen at some samples of which the phases are known, one of which takes about `cycle_s`.
    pub fn mean(time_s: &[f64], phase: &[f64], cells: usize, cycle_s: f64) -> Self {
        let step_s = cycle_s / cells as f64;
        let at_most_s = OF_INCREMENT * longest_increment_s(step_s);
        let per_cycle = cells * KNOTS_OF_STEP.max((step_s / at_most_s).ceil()) as usize;
        let knots = per_cycle as f64;
        let at_s = |knot: i64| time_at_s(time_s, phase, knot as f64 / knots, cycle_s);
        let mut sums = vec![(0.0, 0.0); per_cycle];
        if let [first, .., last] = phase {
            let seen = (first * knots).ceil() as i64..(last * knots).floor() as i64;
            let mut before_s = at_s(seen.start);
            for knot in seen {
                let next_s = at_s(knot + 1);
                let (sum_s, count) = &mut sums[knot.rem_euclid(per_cycle as i64) as usize];
                *sum_s += next_s - before_s;
                *count += 1.0;
                before_s = next_s;
            }
        }
        let mean_s = |(sum_s, count): (f64, f64)| if count > 0.0 { sum_s / count } else { cycle_s / knots };
        Self {
            between_s: sums.into_iter().map(mean_s).collect(),
        }
    }

    /// Knots of a cycle.
    pub fn knots(&self) -> usize {
        self.between_s.len()
    }

    /// Time from a knot to the next, s; knots are counted from phase 0.
    pub fn after_s(&self, knot: i64) -> f64 {
        self.between_s[knot.rem_euclid(self.between_s.len() as i64) as usize]
    }
}

/// Time of a phase, s, by linear interpolation; before and after all samples it is extrapolated at a mean pace.
pub(in crate::explain) fn time_at_s(time_s: &[f64], phase: &[f64], at: f64, cycle_s: f64) -> f64 {
    let last = phase.len() - 1;
    // Most recordings are even, so that is tried first.
    let evenly = ((at - phase[0]) / (phase[last] - phase[0]) * last as f64) as usize;
    let mut near = evenly.saturating_sub(1)..last.min(evenly.saturating_add(2));
    let before = near.find(|&before| phase[before] < at && at <= phase[before + 1]);
    let after = before.map_or_else(|| phase.partition_point(|&here| here < at), |before| before + 1);
    if after == 0 || after > last {
        let end = after.min(last);
        return time_s[end] + (at - phase[end]) * cycle_s;
    }
    let fraction = (at - phase[after - 1]) / (phase[after] - phase[after - 1]);
    time_s[after - 1] + fraction * (time_s[after] - time_s[after - 1])
}
