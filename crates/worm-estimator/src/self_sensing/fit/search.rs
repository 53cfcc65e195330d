//! Where the fit begins: everywhere, for the kinks of the profile make local minima.
//!
//! Another answer with another pull is kept while the profile does not exclude it.

use super::super::profile::BINS_PER_STEP;
use super::Fit;

/// Where the first search begins: pulls as shares of what all tips hold, and changes of every ln stiffness.
const FIRST_PULLS: [f64; 12] = [0.0, 0.03, 0.07, 0.11, 0.16, 0.21, 0.27, 0.34, 0.42, 0.5, 0.6, -0.1];
const FIRST_STIFFNESSES: [f64; 2] = [-0.2, 0.1];
/// The best of these searches go on.
const BEST: usize = 3;
/// Gauss-Newton steps from each first place, then from each of the best.
const ROUNDS: [usize; 2] = [2, 12];
/// Difference of two pulls, N, that makes another answer of them.
const OTHER_PULL_N: f64 = 0.25;
/// Difference of what is minimised up to which another answer still counts.
const OTHER_COUNTS: f64 = 12.0;

impl Fit {
    /// The first search: from several pulls, for the kinks of the profile make local minima.
    pub(super) fn search_everywhere(&mut self) {
        let before = self.at;
        self.begin_with_swings();
        let start = self.at;
        let hold_n: f64 = (0..start.cells).map(|cell| start.friction_n(cell)).sum();
        let mut best = [(f64::INFINITY, start); BEST];
        let starts = FIRST_PULLS
            .iter()
            .flat_map(|share| FIRST_STIFFNESSES.map(|stiffness| Some((share, stiffness))));
        for (pull_share, stiffness) in starts.chain([None]).map(|start| start.unwrap_or((&f64::NAN, 0.0))) {
            self.at = if pull_share.is_nan() {
                before
            } else {
                let mut at = start;
                let pull_n = pull_share * hold_n;
                at.values[start.pull_at()] = pull_n;
                at.values[start.gears_at()] -= pull_n / (start.cells as f64 * self.force_per_torque);
                (0..start.cells).for_each(|cell| at.values[start.cells + cell] += stiffness);
                at
            };
            self.descend(ROUNDS[0]);
            let at = self.at;
            if let Some(cost) = self.cost(&at)
                && let Some(place) = best.iter().position(|(other, _)| cost < *other)
            {
                best[place..].rotate_right(1);
                best[place] = (cost, at);
            }
        }
        (self.at, self.other) = (before, None);
        let mut least = f64::INFINITY;
        for (_, at) in best.into_iter().filter(|(cost, _)| cost.is_finite()) {
            let settled = std::mem::replace(&mut self.at, at);
            self.descend(ROUNDS[1]);
            let at = self.at;
            let Some(cost) = self.cost(&at) else { continue };
            let is_other = (at.pull_n() - settled.pull_n()).abs() > OTHER_PULL_N;
            if cost < least {
                self.other = if is_other && least.is_finite() {
                    Some(settled)
                } else {
                    self.other
                };
                least = cost;
            } else {
                self.at = settled;
                if is_other && self.other.is_none() {
                    self.other = Some(at);
                }
            }
        }
    }

    /// Follows the other answer, too, and takes it where it has become the better one.
    pub(super) fn weigh_other(&mut self) {
        self.other_odds = 0.0;
        let Some(other) = self.other else { return };
        let best = std::mem::replace(&mut self.at, other);
        self.descend(1);
        let other = std::mem::replace(&mut self.at, best);
        let (Some(cost), Some(other_cost)) = (self.cost(&best), self.cost(&other)) else {
            self.other = None;
            return;
        };
        if (best.pull_n() - other.pull_n()).abs() < OTHER_PULL_N || other_cost - cost > OTHER_COUNTS {
            self.other = None;
            return;
        }
        (self.at, self.other) = if other_cost < cost {
            (other, Some(best))
        } else {
            (best, Some(other))
        };
        self.other_odds = (-0.5 * (other_cost - cost).abs()).exp();
    }

    /// Begins at what is known before, with each cell's friction by the swing of the torque in its step: from −k·δmax to k·δmax.
    fn begin_with_swings(&mut self) {
        let cells = self.at.cells;
        self.at.values = self.prior;
        let mut offset_n_m = 0.0;
        for place in 0..cells {
            let step = &self.mean_n_m[place * BINS_PER_STEP..(place + 1) * BINS_PER_STEP];
            let mean = |bins: &[f64]| bins.iter().sum::<f64>() / bins.len() as f64;
            let (begin_n_m, end_n_m) = (mean(&step[1..3]), mean(&step[BINS_PER_STEP - 9..BINS_PER_STEP - 1]));
            let friction_n = 0.5 * (end_n_m - begin_n_m) * self.force_per_torque;
            let cell = self.model.cell_at(place);
            let far = 2.5 / self.prior_information[cell].sqrt();
            self.at.values[cell] += (friction_n.max(1e-6).ln() - self.prior[cell]).clamp(-far, far);
            offset_n_m += 0.5 * (end_n_m + begin_n_m) / cells as f64;
        }
        let gears = self.at.gears_at();
        self.at.values[gears] = offset_n_m;
    }
}
