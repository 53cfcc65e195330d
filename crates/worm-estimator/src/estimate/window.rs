//! Sums over the tracker samples of the open gait cycle and of the one before it.
//!
//! The phase of a cycle is divided into [`INTERVALS`] pieces for each step. For each piece and cell the window keeps the six sums that a
//! least-squares fit of anything linear within a piece needs, so its size depends neither on the tracker's rate nor on the duration of a
//! cycle, and [`fit`](super::fit) loses nothing.
//!
//! Positions and phases are seen in the direction of the crawl: crawling backward, both have the opposite sign.

/// Pieces of a step.
pub(super) const INTERVALS: usize = 16;
/// Gait cycles in the window.
pub(super) const CYCLES: usize = 2;

/// Sums over the samples of one cell in one piece; t runs from 0 to 1 across the piece, x is the position in m.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) count: f64,
    pub(super) t: f64,
    pub(super) tt: f64,
    pub(super) x: f64,
    pub(super) tx: f64,
    pub(super) xx: f64,
}

/// The window. Its first half is the cycle before, its second half the open one.
#[derive(Debug, Clone)]
pub(super) struct Window {
    cells: usize,
    sums: Vec<Sums>, // [cycle][piece][cell]
    samples: [u32; CYCLES],
    has_before: bool,
    last: Option<(usize, f64)>, // piece and phase of the sample taken last
    /// What is subtracted from every position, m.
    origin_m: f64,
}

impl Window {
    pub(super) fn new(cells: usize) -> Self {
        Self {
            cells,
            sums: vec![Sums::default(); CYCLES * cells * INTERVALS * cells],
            samples: [0; CYCLES],
            has_before: false,
            last: None,
            origin_m: 0.0,
        }
    }

    /// Pieces of one cycle.
    pub(super) fn pieces(&self) -> usize {
        self.cells * INTERVALS
    }

    /// Empties the window.
    pub(super) fn clear(&mut self) {
        self.sums.fill(Sums::default());
        self.samples = [0; CYCLES];
        self.has_before = false;
        self.last = None;
        self.origin_m = 0.0;
    }

    /// The open cycle becomes the cycle before.
    pub(super) fn next_cycle(&mut self) {
        let half = self.sums.len() / CYCLES;
        self.sums.copy_within(half.., 0);
        self.sums[half..].fill(Sums::default());
        self.samples = [self.samples[1], 0];
        self.has_before = true;
        self.last = None;
    }

    /// Adds a sample at a phase counted from the start of the open cycle, in cycles; `NaN` where a cell is not to be used.
    ///
    /// While the phase stands still, one sample in a piece is enough: a rest must not outweigh the crawl.
    pub(super) fn add(&mut self, cycle_phase: f64, position_m: &[f64]) {
        let pieces = self.pieces() as f64;
        let at = (cycle_phase + (CYCLES - 1) as f64) * pieces;
        if !(0.0..CYCLES as f64 * pieces).contains(&at) || (!self.has_before && cycle_phase < 0.0) {
            return;
        }
        let piece = at as usize;
        let t = at - piece as f64;
        if self
            .last
            .is_some_and(|(last, at)| last == piece && (t - at).abs() < 1e-3)
        {
            return;
        }
        self.last = Some((piece, t));
        if self.origin_m == 0.0 {
            self.origin_m = position_m.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
        }
        self.samples[usize::from(cycle_phase >= 0.0)] += 1;
        let row = &mut self.sums[piece * self.cells..][..self.cells];
        for (sums, x) in row.iter_mut().zip(position_m).filter(|(_, x)| x.is_finite()) {
            let x = x - self.origin_m;
            sums.count += 1.0;
            sums.t += t;
            sums.tt += t * t;
            sums.x += x;
            sums.tx += t * x;
            sums.xx += x * x;
        }
    }

    /// Cycles with samples: 1 or 2.
    pub(super) fn cycles(&self) -> usize {
        1 + usize::from(self.has_before)
    }

    /// The sums of a piece, counted from the start of the first cycle that has samples.
    pub(super) fn piece(&self, piece: usize) -> &[Sums] {
        let from = piece + (CYCLES - self.cycles()) * self.pieces();
        &self.sums[from * self.cells..][..self.cells]
    }

    /// Samples in the open cycle.
    pub(super) fn samples(&self) -> u32 {
        self.samples[CYCLES - 1]
    }

    /// What was subtracted from every position, m.
    pub(super) fn origin_m(&self) -> f64 {
        self.origin_m
    }
}
