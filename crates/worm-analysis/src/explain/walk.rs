//! A crawl through the samples of a recording: simulated until it repeats, and then repeated.

use super::observed::Observed;
use super::predict::{Clock, Predicted};
use worm_physics::{Crawl, MAX_CELLS, Mechanics, longest_increment_s};

/// Change of every pad's deformation from cycle to cycle below which a crawl has settled, m: the next is a twentieth or less.
const SETTLED_M: f64 = 3e-7;
/// Fewest knots of a step, of a cycle that is repeated; and the time between two over the longest increment of a crawl.
const KNOTS_OF_STEP: f64 = 104.0;
const OF_INCREMENT: f64 = 0.98;
/// Difference of two phases below which the drive rests, cycles.
const RESTS: f64 = 1e-12;

/// What is known of a crawl before it is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Gait {
    /// It never repeats.
    Changing,
    /// It repeats after some cycles.
    Settling,
    /// It repeats from the start.
    Settled,
}

impl Gait {
    pub fn new(repeats: bool, has_settled: bool) -> Self {
        match (repeats, has_settled) {
            (false, _) => Self::Changing,
            (true, false) => Self::Settling,
            (true, true) => Self::Settled,
        }
    }
}

/// Whether a crawl has settled: its tips are as they were a cycle ago.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Settling {
    deformation_m: Option<[f64; MAX_CELLS]>, // a cycle ago
}

impl Settling {
    /// To be asked once a cycle.
    pub fn has_settled(&mut self, crawl: &Crawl) -> bool {
        let cells = crawl.positions_m().len();
        let mut now_m = [0.0; MAX_CELLS];
        for (cell, now_m) in now_m[..cells].iter_mut().enumerate() {
            *now_m = crawl.deformation_m(cell);
        }
        let before_m = self.deformation_m.replace(now_m);
        before_m.is_some_and(|before_m| {
            let mut pairs = now_m.iter().zip(&before_m);
            pairs.all(|(now_m, before_m)| (now_m - before_m).abs() < SETTLED_M)
        })
    }
}

/// A crawl through the samples of a recording.
pub(super) struct Walk<'a> {
    observed: &'a Observed<'a>,
    clock: Clock<'a>,
    crawl: Crawl,
    /// Phase of the last sample that was reached.
    before: f64,
    position_m: Vec<f64>, // `[sample][cell]`, flat, of the samples so far
}

impl<'a> Walk<'a> {
    /// From a crawl at the first sample.
    pub fn new(observed: &'a Observed<'a>, clock: Clock<'a>, crawl: Crawl) -> Self {
        Self {
            before: crawl.phase(),
            position_m: Vec::with_capacity(observed.cells() * observed.samples()),
            observed,
            clock,
            crawl,
        }
    }

    /// Goes on through the samples up to a phase, which may be infinite; none where the worm slides down.
    pub fn go_to(&mut self, mechanics: &Mechanics, until: f64, gait: Gait) -> Option<()> {
        if gait != Gait::Settled {
            self.simulate(mechanics, until, gait == Gait::Settling)?;
        }
        if gait != Gait::Changing && self.next_sample() < self.observed.samples() && self.crawl.phase() < until {
            self.repeat(mechanics, until)?;
        }
        Some(())
    }

    /// Changes the mechanics: nothing moves.
    pub fn take_up(&mut self, mechanics: &Mechanics) {
        self.crawl.take_up(mechanics);
    }

    /// The positions at all samples, as a camera with some scale sees them.
    pub fn seen_at(mut self, scale: f64) -> Predicted {
        self.position_m.iter_mut().for_each(|at_m| *at_m *= scale);
        Predicted {
            position_m: self.position_m,
        }
    }

    fn next_sample(&self) -> usize {
        self.position_m.len() / self.observed.cells()
    }

    /// Simulates up to a phase, or until the crawl repeats.
    fn simulate(&mut self, mechanics: &Mechanics, until: f64, may_repeat: bool) -> Option<()> {
        let mut settling = Settling::default();
        let mut cycle_ends = if may_repeat {
            self.crawl.phase() + 1.0
        } else {
            f64::INFINITY
        };
        for sample in self.next_sample()..self.observed.samples() {
            let phase = self.clock.phase_at(sample);
            while cycle_ends < phase.min(until) {
                self.advance(mechanics, cycle_ends, sample, phase)?;
                if settling.has_settled(&self.crawl) {
                    return Some(());
                }
                cycle_ends += 1.0;
            }
            if phase > until {
                return self.advance(mechanics, until, sample, phase);
            }
            self.advance(mechanics, phase, sample, phase)?;
            self.position_m.extend_from_slice(self.crawl.positions_m());
            self.before = phase;
        }
        Some(())
    }

    /// Advances to a phase on the way to a sample, at the pace at which the recording came to it.
    fn advance(&mut self, mechanics: &Mechanics, phase: f64, sample: usize, phase_of_sample: f64) -> Option<()> {
        let time_s = &self.observed.run.recording.time_s;
        let whole_s = time_s[sample] - time_s[sample.saturating_sub(1)];
        let whole = phase_of_sample - self.before;
        let duration_s = if whole.abs() < RESTS {
            whole_s
        } else {
            whole_s * (phase - self.crawl.phase()) / whole
        };
        self.crawl.advance_to(mechanics, phase, duration_s.max(0.0)).ok()
    }

    /// Simulates a cycle and repeats it up to a phase.
    fn repeat(&mut self, mechanics: &Mechanics, until: f64) -> Option<()> {
        let cycle = SteadyCycle::record(&mut self.crawl, mechanics, self.observed)?;
        for sample in self.next_sample()..self.observed.samples() {
            let phase = self.clock.phase_at(sample);
            if phase > until {
                // Here the crawl is simulated again.
                let ended = self.crawl.phase();
                let further = (until - ended).rem_euclid(1.0);
                let duration_s = further * self.observed.cycle_s;
                self.crawl.advance_to(mechanics, ended + further, duration_s).ok()?;
                let mut at_m = Vec::with_capacity(self.observed.cells());
                cycle.extend(until, &mut at_m);
                self.crawl.begin_at_phase(mechanics, until, &at_m);
                break;
            }
            cycle.extend(phase, &mut self.position_m);
            self.before = phase;
        }
        Some(())
    }
}

/// A cycle of a crawl that repeats: its positions at knots, which lie evenly and on the boundaries of the steps.
struct SteadyCycle {
    cells: usize,
    knots: f64,
    first_phase: f64,
    position_m: Vec<f64>, // `[knot][cell]`, flat; the last knot is a cycle after the first
    advance_m: Vec<f64>,  // of each cell in a cycle
}

impl SteadyCycle {
    /// Simulates the next cycle of a crawl, at the pace of the recording there.
    fn record(crawl: &mut Crawl, mechanics: &Mechanics, observed: &Observed<'_>) -> Option<Self> {
        let cells = observed.cells();
        let step_s = observed.cycle_s / cells as f64;
        let between_s = OF_INCREMENT * longest_increment_s(step_s);
        let knots = cells as f64 * KNOTS_OF_STEP.max((step_s / between_s).ceil());
        let first = (crawl.phase() * knots).ceil();
        let first_phase = first / knots;
        let mut reached_s = observed.time_at_s(crawl.phase());
        let mut position_m = Vec::with_capacity(cells * (knots as usize + 1));
        for knot in 0..=knots as usize {
            let phase = (first + knot as f64) / knots;
            let time_s = observed.time_at_s(phase);
            crawl.advance_to(mechanics, phase, time_s - reached_s).ok()?;
            position_m.extend_from_slice(crawl.positions_m());
            reached_s = time_s;
        }
        let last_m = &position_m[position_m.len() - cells..];
        let advance_m = last_m
            .iter()
            .zip(&position_m)
            .map(|(last, first)| last - first)
            .collect();
        Some(Self {
            cells,
            knots,
            first_phase,
            position_m,
            advance_m,
        })
    }

    /// Appends the positions of all cells at a phase.
    fn extend(&self, phase: f64, out: &mut Vec<f64>) {
        let cycles = (phase - self.first_phase).floor();
        let knots = (phase - self.first_phase - cycles) * self.knots;
        let knot = (knots as usize).min(self.knots as usize - 1);
        let fraction = knots - knot as f64;
        let from = knot * self.cells;
        let (low_m, high_m) = self.position_m[from..from + 2 * self.cells].split_at(self.cells);
        let ends = low_m.iter().zip(high_m).zip(&self.advance_m);
        out.extend(ends.map(|((low_m, high_m), advance_m)| low_m + fraction * (high_m - low_m) + cycles * advance_m));
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{Campaign, record, scene};
    use super::super::predict::predict;

    /// Largest distance between a crawl that is repeated and one that is simulated to the end, where the whole may be shifted, m.
    fn apart_m(laid_down: bool) -> f64 {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let mut scene = scene(&recordings, &campaign);
        scene.observed[1].assume_laid_down(laid_down);
        let predicted_m = |repeats: bool| {
            let predicted = predict(&scene.observed[1], &scene.nominal[1], 0.4, repeats);
            predicted.expect("it holds").position_m
        };
        let pairs = predicted_m(true).into_iter().zip(predicted_m(false));
        let differences_m: Vec<f64> = pairs.map(|(repeated, simulated)| repeated - simulated).collect();
        let (least, most) = differences_m
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), m| {
                (least.min(*m), most.max(*m))
            });
        most - least
    }

    #[test]
    fn a_cycle_that_is_repeated_is_as_good_as_one_that_is_simulated() {
        for laid_down in [true, false] {
            let apart_m = apart_m(laid_down);
            // Increments that end elsewhere make another advance, by a thousandth at most.
            assert!(apart_m < 1.2e-5, "laid down {laid_down}: {apart_m} m");
        }
    }
}
