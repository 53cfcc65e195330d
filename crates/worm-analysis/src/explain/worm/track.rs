//! A crawl at knots, until it repeats.
//!
//! Samples lie between the knots, of which a step has as many as a crawl has increments: what a sample costs is an interpolation, however
//! many there are.

use super::observed::Observed;
use worm_physics::{Crawl, MAX_CELLS, Mechanics};

/// Changes of every pad's deformation from cycle to cycle below which the cycle is the one that repeats, and below which the next
/// is, m: each change is a twentieth of the one before, or less.
const SETTLED_M: f64 = 2e-8;
const NEARLY_SETTLED_M: f64 = 3e-7;
/// Cycles after which a crawl that was under way before the recording counts as settled.
const MAX_SETTLING_CYCLES: usize = 5;

/// A crawl at knots, which lie evenly and on the boundaries of the steps.
pub(in crate::explain) struct Track<'a> {
    observed: &'a Observed<'a>,
    cells: usize,
    per_cycle: usize,
    /// The first knot, in knots since phase 0, and the number of knots after it.
    first: i64,
    knots: usize,
    position_m: Vec<f64>, // `[knot][cell]`, flat
    work_j: Vec<f64>,     // of the drive, up to each knot
    may_repeat: bool,
    /// Of every pad after the last whole cycle, and the largest change in it.
    deformation_m: [f64; MAX_CELLS],
    change_m: f64,
    /// Whether the last cycle goes on for ever, and the advance of each cell in it, m.
    repeats: bool,
    advance_m: Vec<f64>,
    /// Work of the drive in that cycle, J.
    cycle_j: f64,
}

/// Where a phase lies: the knot before it, the fraction of the way to the next, and by how many cycles it is beyond the knots.
struct Place {
    knot: usize,
    fraction: f64,
    cycles: f64,
}

impl<'a> Track<'a> {
    /// From a crawl at a knot. One that may repeat has a pace that does.
    pub fn begin(crawl: &Crawl, observed: &'a Observed<'a>, may_repeat: bool) -> Self {
        Self {
            observed,
            cells: observed.cells(),
            per_cycle: observed.pace.knots(),
            knots: 0,
            first: (crawl.phase() * observed.pace.knots() as f64).round() as i64,
            position_m: crawl.positions_m().to_vec(),
            work_j: vec![crawl.ledger().actuator_net_j],
            may_repeat,
            deformation_m: deformations_m(crawl),
            change_m: f64::INFINITY,
            repeats: false,
            advance_m: vec![0.0; observed.cells()],
            cycle_j: 0.0,
        }
    }

    /// The cycle that a crawl at a knot comes to repeat, shifted to go through some positions at a phase.
    pub fn settled(
        crawl: &mut Crawl,
        mechanics: &Mechanics,
        observed: &'a Observed<'a>,
        (phase, at_m): (f64, &[f64]),
    ) -> Option<Self> {
        let mut track = Self::begin(crawl, observed, true);
        while !track.repeats && track.knots < MAX_SETTLING_CYCLES * track.per_cycle {
            track.advance(crawl, mechanics)?;
        }
        track.repeat();
        let forgotten = track.knots - track.per_cycle;
        track.position_m.drain(..forgotten * track.cells);
        track.work_j.drain(..forgotten);
        track.first += forgotten as i64;
        track.knots -= forgotten;
        let mut here_m = Vec::with_capacity(track.cells);
        track.extend(phase, &mut here_m);
        for knot_m in track.position_m.chunks_exact_mut(track.cells) {
            for ((knot_m, here_m), at_m) in knot_m.iter_mut().zip(&here_m).zip(at_m) {
                *knot_m += at_m - here_m;
            }
        }
        Some(track)
    }

    /// Whether it goes on for ever.
    pub fn repeats(&self) -> bool {
        self.repeats
    }

    /// Phase of the knot that comes next.
    pub fn next_phase(&self) -> f64 {
        (self.first + self.knots as i64 + 1) as f64 / self.per_cycle as f64
    }

    /// Whether the positions at a phase lie before the last knot.
    pub fn reaches(&self, phase: f64) -> bool {
        self.repeats || self.place(phase) < self.knots as f64
    }

    /// Place of a phase, in knots after the first.
    fn place(&self, phase: f64) -> f64 {
        phase * self.per_cycle as f64 - self.first as f64
    }

    /// Simulates up to the next knot.
    pub fn advance(&mut self, crawl: &mut Crawl, mechanics: &Mechanics) -> Option<()> {
        let phase = self.next_phase();
        let duration_s = if self.may_repeat {
            self.observed.pace.after_s(self.first + self.knots as i64)
        } else {
            self.observed.time_at_s(phase) - self.observed.time_left_s(crawl.phase())
        };
        crawl.advance_to(mechanics, phase, duration_s).ok()?;
        self.position_m.extend_from_slice(crawl.positions_m());
        self.work_j.push(crawl.ledger().actuator_net_j);
        self.knots += 1;
        if self.may_repeat && self.knots.is_multiple_of(self.per_cycle) && self.has_settled(crawl) {
            self.repeat();
        }
        Some(())
    }

    /// From here on the last cycle goes on for ever.
    fn repeat(&mut self) {
        let at_m = |knot: usize| &self.position_m[knot * self.cells..];
        let ends_m = at_m(self.knots).iter().zip(at_m(self.knots - self.per_cycle));
        self.advance_m = ends_m.map(|(last_m, first_m)| last_m - first_m).collect();
        self.cycle_j = self.work_j[self.knots] - self.work_j[self.knots - self.per_cycle];
        self.repeats = true;
    }

    /// Whether the cycle that has just ended repeats: the tips are as they were a cycle ago.
    fn has_settled(&mut self, crawl: &Crawl) -> bool {
        let now_m = deformations_m(crawl);
        let before_m = std::mem::replace(&mut self.deformation_m, now_m);
        let changes_m = now_m
            .iter()
            .zip(&before_m)
            .map(|(now_m, before_m)| (now_m - before_m).abs());
        let change_m = changes_m.fold(0.0, f64::max);
        let change_before_m = std::mem::replace(&mut self.change_m, change_m);
        change_m < SETTLED_M || change_before_m < NEARLY_SETTLED_M
    }

    /// Appends the positions of all cells at a phase that it reaches.
    pub fn extend(&self, phase: f64, out: &mut Vec<f64>) {
        let Place { knot, fraction, cycles } = self.find(phase);
        let from = knot * self.cells;
        let (low_m, high_m) = self.position_m[from..from + 2 * self.cells].split_at(self.cells);
        let ends = low_m.iter().zip(high_m).zip(&self.advance_m);
        out.extend(ends.map(|((low_m, high_m), advance_m)| low_m + fraction * (high_m - low_m) + cycles * advance_m));
    }

    /// Work of the drive up to a phase that it reaches, J.
    pub fn work_j(&self, phase: f64) -> f64 {
        let Place { knot, fraction, cycles } = self.find(phase);
        let (low_j, high_j) = (self.work_j[knot], self.work_j[knot + 1]);
        low_j + fraction * (high_j - low_j) + cycles * self.cycle_j
    }

    fn find(&self, phase: f64) -> Place {
        let (last, per_cycle) = (self.knots as f64, self.per_cycle as f64);
        let place = self.place(phase);
        let is_beyond = self.repeats && !(0.0..=last).contains(&place);
        let cycles = if is_beyond {
            1.0 + ((place - last) / per_cycle).floor()
        } else {
            0.0
        };
        let place = place - cycles * per_cycle;
        // A phase may run backwards a little where the drive rests.
        let knot = (place.max(0.0) as usize).min(self.knots - 1);
        Place {
            knot,
            fraction: place - knot as f64,
            cycles,
        }
    }
}

fn deformations_m(crawl: &Crawl) -> [f64; MAX_CELLS] {
    let cells = crawl.positions_m().len();
    std::array::from_fn(|cell| if cell < cells { crawl.deformation_m(cell) } else { 0.0 })
}
