//! Where the fit begins: everywhere, for the kinks of the profile make local minima.
//!
//! Another answer with another pull is kept while the profile does not exclude it.

use super::super::parameters::Parameters;
use super::super::profile::BINS_PER_STEP;
use super::Fit;
use super::descent::Descent;

/// Where the first search begins: pulls as shares of what all tips hold, and changes of every ln stiffness.
const FIRST_PULLS: [f64; 12] = [0.0, 0.03, 0.07, 0.11, 0.16, 0.21, 0.27, 0.34, 0.42, 0.5, 0.6, -0.1];
const FIRST_STIFFNESSES: [f64; 2] = [-0.2, 0.1];
/// How many places that makes; the first is where the fit was.
const PLACES: usize = 1 + FIRST_PULLS.len() * FIRST_STIFFNESSES.len();
/// The best of these searches go on.
const BEST: usize = 3;
/// Gauss-Newton steps from each first place, then from each of the best. From where the fit was at once as many as these: for a worm that has
/// changed it is mostly the answer, and a first one that others can wait for no longer.
const ROUNDS: [usize; 2] = [2, 12];
/// Standard deviations from what is stated up to which the swing of the torque says where a cell's friction begins.
const FAR_SIGMAS: f64 = 2.5;
/// Difference of two pulls, N, that makes another answer of them.
const OTHER_PULL_N: f64 = 0.25;
/// Difference of what is minimised up to which another answer still counts.
const OTHER_COUNTS: f64 = 12.0;

/// A search under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search {
    start: Parameters, // by the swings of the torque
    place: usize,
    best: [(f64, Parameters); BEST],
    settling: Option<usize>, // which of the best goes on
    least: f64,
    descent: Descent,
}

impl Search {
    /// The next piece; at the end, the least of what is minimised, if any worm holds.
    pub(super) fn step(&mut self, fit: &mut Fit) -> Option<Option<f64>> {
        if !self.descent.step(fit) {
            return None;
        }
        match self.settling {
            None => {
                self.sort_in();
                if self.place == 0 {
                    fit.first_answer = self.descent.cost.map(|_| self.descent.at);
                }
                self.place += 1;
                if self.place < PLACES {
                    self.descent = Descent::new(self.place(fit), ROUNDS[0]);
                    return None;
                }
                fit.other = None;
                self.settle(0)
            }
            Some(of_best) => {
                self.settled(fit);
                self.settle(of_best + 1)
            }
        }
    }

    fn place(&self, fit: &Fit) -> Parameters {
        let Some(start) = self.place.checked_sub(1) else {
            return fit.at;
        };
        let share = FIRST_PULLS[start / FIRST_STIFFNESSES.len()];
        let mut at = self.start;
        let hold_n: f64 = (0..at.cells).map(|cell| at.friction_n(cell)).sum();
        let pull_n = share * hold_n;
        let (pull_at, gears) = (at.pull_at(), at.gears_at());
        at.values[pull_at] = pull_n;
        at.values[gears] -= pull_n / (at.cells as f64 * fit.force_per_torque);
        let stiffness = FIRST_STIFFNESSES[start % FIRST_STIFFNESSES.len()];
        (0..at.cells).for_each(|cell| at.values[at.cells + cell] += stiffness);
        at
    }

    fn sort_in(&mut self) {
        let Some(cost) = self.descent.cost else { return };
        if let Some(place) = self.best.iter().position(|(other, _)| cost < *other) {
            self.best[place..].rotate_right(1);
            self.best[place] = (cost, self.descent.at);
        }
    }

    fn settle(&mut self, of_best: usize) -> Option<Option<f64>> {
        match self.best.get(of_best).filter(|(cost, _)| cost.is_finite()) {
            Some((_, at)) => {
                self.settling = Some(of_best);
                self.descent = Descent::new(*at, ROUNDS[1]);
                None
            }
            None => Some(Some(self.least).filter(|least| least.is_finite())),
        }
    }

    fn settled(&mut self, fit: &mut Fit) {
        let (at, settled) = (self.descent.at, fit.at);
        let Some(cost) = self.descent.cost else { return };
        let is_other = (at.pull_n() - settled.pull_n()).abs() > OTHER_PULL_N;
        if cost < self.least {
            if is_other && self.least.is_finite() {
                fit.other = Some(settled);
            }
            (fit.at, self.least) = (at, cost);
        } else if is_other && fit.other.is_none() {
            fit.other = Some(at);
        }
    }
}

impl Fit {
    /// The first search: from several pulls.
    pub(super) fn search_everywhere(&self) -> Search {
        let start = self.by_swings();
        Search {
            start,
            place: 0,
            best: [(f64::INFINITY, start); BEST],
            settling: None,
            least: f64::INFINITY,
            descent: Descent::new(self.at, ROUNDS[1]),
        }
    }

    /// Takes the other answer where it has become the better one. Both at the end of their descents, with what is minimised.
    pub(super) fn weigh_other(&mut self, cost: Option<f64>, other: &Descent) {
        let best = self.at;
        let (Some(cost), Some(other_cost)) = (cost, other.cost) else {
            self.other = None;
            return;
        };
        let other = other.at;
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

    /// What is known before, with each cell's friction by the swing of the torque in its step: from −k·δmax to k·δmax.
    fn by_swings(&self) -> Parameters {
        let mut at = self.at;
        let cells = at.cells;
        at.values = self.prior;
        let mut offset_n_m = 0.0;
        for place in 0..cells {
            let step = &self.mean_n_m[place * BINS_PER_STEP..(place + 1) * BINS_PER_STEP];
            let mean = |bins: &[f64]| bins.iter().sum::<f64>() / bins.len() as f64;
            let (begin_n_m, end_n_m) = (mean(&step[1..3]), mean(&step[BINS_PER_STEP - 9..BINS_PER_STEP - 1]));
            let friction_n = 0.5 * (end_n_m - begin_n_m) * self.force_per_torque;
            let cell = self.model.cell_at(place);
            let far = FAR_SIGMAS * self.friction_sigma(cell);
            at.values[cell] += (friction_n.max(1e-6).ln() - self.prior[cell]).clamp(-far, far);
            offset_n_m += 0.5 * (end_n_m + begin_n_m) / cells as f64;
        }
        let gears = at.gears_at();
        at.values[gears] = offset_n_m;
        at
    }
}
