//! The profile at some parameters and its derivatives, one evaluation of the model at a time.

use super::super::parameters::{MAX_UNKNOWNS, Parameters};
use super::super::profile::MAX_BINS;
use super::{Fit, moved, rise};
use std::task::Poll;

/// How far a linearisation has come.
#[derive(Debug, Clone)]
pub(super) struct Linearisation {
    next: usize,
    plain: Box<[f64; MAX_BINS]>, // of the worm alone, before the gears
    other: Box<[f64; MAX_BINS]>,
    width: f64, // between the two evaluations of a derivative
}

/// What a step of it gave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Linearised {
    /// More is to be done.
    Further,
    /// All derivatives are known, and `single` with them.
    Done,
    /// No such worm holds.
    Impossible,
}

impl Linearisation {
    pub(super) fn new() -> Self {
        Self {
            next: 0,
            plain: Box::new([0.0; MAX_BINS]),
            other: Box::new([0.0; MAX_BINS]),
            width: 0.0,
        }
    }

    pub(super) fn begin(&mut self) {
        self.next = 0;
    }
}

impl Fit {
    /// The next piece: the profile of the worm, then through the gears, two evaluations for each unknown of the worm, and the gears' unknowns
    /// one by one.
    pub(super) fn linearise(&mut self, at: &Parameters) -> Linearised {
        let of_worm = at.of_worm();
        let next = self.linearisation.next;
        let piece = match next {
            0 => self.model.profile(at, &mut self.linearisation.plain[..self.bins]),
            1 => {
                let mut predicted = *self.linearisation.plain;
                self.through_gears(at, &mut predicted[..self.bins]);
                *self.predicted_n_m = predicted;
                Poll::Ready(Some(()))
            }
            _ if next - 2 < 2 * of_worm => self.linearise_worm(at, (next - 2) / 2, next % 2 == 1),
            _ => {
                self.linearise_gears(at, next - 2 - of_worm);
                Poll::Ready(Some(()))
            }
        };
        match piece {
            Poll::Pending => Linearised::Further,
            Poll::Ready(None) => Linearised::Impossible,
            Poll::Ready(Some(())) => {
                self.linearisation.next += 1;
                if next + 1 < 2 + of_worm + self.unknowns {
                    Linearised::Further
                } else {
                    Linearised::Done
                }
            }
        }
    }

    fn linearise_worm(&mut self, at: &Parameters, unknown: usize, is_second: bool) -> Poll<Option<()>> {
        let bins = self.bins;
        let (moved, step) = moved(at, unknown, is_second);
        let Linearisation {
            plain, other, width, ..
        } = &mut self.linearisation;
        let into = if is_second {
            &mut other[..bins]
        } else {
            &mut self.column[unknown][..bins]
        };
        let Poll::Ready(held) = self.model.profile(&moved, into) else {
            return Poll::Pending;
        };
        if !is_second {
            *width = 2.0 * step;
        }
        if held.is_none() {
            into.copy_from_slice(&plain[..bins]);
            *width -= step;
        }
        if !is_second {
            return Poll::Ready(Some(()));
        }
        if *width <= 0.0 {
            return Poll::Ready(None);
        }
        let scale = (1.0 + at.values[at.gears_at() + 1]) / *width;
        for (forward, backward) in self.column[unknown][..bins].iter_mut().zip(&other[..bins]) {
            *forward = scale * (*forward - backward);
        }
        self.fill_single(unknown);
        Poll::Ready(Some(()))
    }

    fn linearise_gears(&mut self, at: &Parameters, unknown: usize) {
        let gears = at.gears_at();
        let gain = 1.0 + at.values[gears + 1];
        for bin in 0..self.bins {
            let plain = &self.linearisation.plain;
            self.column[unknown][bin] = match unknown - gears {
                0 => 1.0,
                1 => plain[bin],
                2 => self.load_on_gears_n_m(plain[bin]),
                3 => gain * self.bins_per_s() * rise(&plain[..], bin),
                of_ripple => {
                    let (sine, cosine) = self.ripples[(of_ripple - 4) / 2][bin];
                    if of_ripple % 2 == 0 { sine } else { cosine }
                }
            };
        }
        self.fill_single(unknown);
    }

    /// The row and column of M that a derivative and those before it make.
    fn fill_single(&mut self, row: usize) {
        let mut weighted = [0.0; MAX_BINS];
        for (bin, weighted) in weighted[..self.bins].iter_mut().enumerate() {
            *weighted = Self::bin_weight(bin) * self.column[row][bin];
        }
        for other in 0..=row.min(MAX_UNKNOWNS - 1) {
            let sum = dot(&weighted[..self.bins], &self.column[other][..self.bins]) / self.variance;
            self.single[(row, other)] = sum;
            self.single[(other, row)] = sum;
        }
    }
}

/// Σ a b, in four sums, which the processor adds side by side. The number of bins is a multiple of four.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}
