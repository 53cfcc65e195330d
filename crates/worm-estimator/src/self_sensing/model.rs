//! The torque profile that the exact quasi-static cycle gives, and what else it gives: advance, slides, energies.
//!
//! The mean torque of a bin is the actuator work (13) in it over its angle. The work is that of the pieces of the exact motion, so a bin is
//! exact whatever happens in it.

use super::parameters::Parameters;
use std::f64::consts::TAU;
use std::task::Poll;
use worm_physics::{Contact, MAX_CELLS, Motion, Piece, Worm};

/// Change of a deformation over a cycle, as a share of the stroke, below which the crawl counts as periodic.
const PERIODIC_SHARE: f64 = 1e-7;
/// Cycles after which the search for the periodic crawl ends; from a neighbouring worm's it takes two or three.
const MAX_CYCLES: u32 = 12;
/// Most cycles of it in one call.
const CYCLES_AT_ONCE: u32 = 3;

/// What a steady cycle gives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CycleFigures {
    /// Advance, m.
    pub advance_m: f64,
    /// Losses and work against the pull (11), J.
    pub energy_loss_j: f64,
    /// Net actuator work (13), J.
    pub energy_net_j: f64,
    /// Positive part of the actuator work, J.
    pub energy_positive_j: f64,
    /// Distance that each tip slides forward, m.
    pub forward_slide_m: [f64; MAX_CELLS],
    /// Distance that each tip slides backward, m.
    pub backward_slide_m: [f64; MAX_CELLS],
}

/// Number of figures in [`CycleFigures::flat`].
pub(super) const FIGURES: usize = 4 + 2 * MAX_CELLS;

impl CycleFigures {
    pub(super) fn flat(&self) -> [f64; FIGURES] {
        let mut flat = [0.0; FIGURES];
        flat[..4].copy_from_slice(&[
            self.advance_m,
            self.energy_loss_j,
            self.energy_net_j,
            self.energy_positive_j,
        ]);
        flat[4..4 + MAX_CELLS].copy_from_slice(&self.forward_slide_m);
        flat[4 + MAX_CELLS..].copy_from_slice(&self.backward_slide_m);
        flat
    }

    pub(super) fn from_flat(flat: &[f64; FIGURES]) -> Self {
        Self {
            advance_m: flat[0],
            energy_loss_j: flat[1],
            energy_net_j: flat[2],
            energy_positive_j: flat[3],
            forward_slide_m: std::array::from_fn(|cell| flat[4 + cell]),
            backward_slide_m: std::array::from_fn(|cell| flat[4 + MAX_CELLS + cell]),
        }
    }
}

/// The exact cycle of any parameters, begun from where the last one ended.
///
/// A long computation is split: it returns [`Poll::Pending`], and continues when it is called again with the same arguments. `Ready(None)`
/// means that there is no such worm, or that its tips cannot hold it.
#[derive(Debug, Clone)]
pub(super) struct CycleModel {
    worm: Worm, // level, without resisting force
    deformation_m: [f64; MAX_CELLS],
    settling: Option<Settling>,
}

/// Which way the worm crawls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heading {
    Forward,
    Backward,
}

/// A worm on its way to the periodic crawl.
#[derive(Debug, Clone)]
struct Settling {
    parameters: Parameters,
    heading: Heading,
    worm: Worm,
    motion: Motion,
    cycles: u32,
}

impl Settling {
    /// Runs a cycle. Whether the crawl is periodic, or close enough; `None` when the tips cannot hold the worm.
    fn run_cycle(&mut self) -> Option<bool> {
        let cells = self.worm.cells();
        let mut before_m = [0.0; MAX_CELLS];
        before_m[..cells].copy_from_slice(self.motion.deformations_m());
        self.cycles += 1;
        self.motion.advance_to(&self.worm, f64::from(self.cycles)).ok()?;
        let apart_m = before_m
            .iter()
            .zip(self.motion.deformations_m())
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        Some(apart_m < PERIODIC_SHARE * self.worm.stroke_m() || self.cycles == MAX_CYCLES)
    }
}

impl CycleModel {
    /// `worm` gives cells, strokes and step order.
    pub(super) fn new(worm: &Worm) -> Self {
        let level = worm
            .clone()
            .with_slope_rad(0.0)
            .and_then(|worm| worm.with_resisting_force_n(0.0));
        Self {
            worm: level.unwrap_or_else(|_| worm.clone()),
            deformation_m: [0.0; MAX_CELLS],
            settling: None,
        }
    }

    /// The cell that makes the step at a place in the cycle.
    pub(super) fn cell_at(&self, place: usize) -> usize {
        self.worm.step_order()[place]
    }

    /// The worm of some parameters; `None` when no worm can have them.
    fn worm_of(&self, parameters: &Parameters) -> Option<Worm> {
        let mut worm = self.worm.clone().with_resisting_force_n(parameters.pull_n()).ok()?;
        for cell in 0..worm.cells() {
            let stiffness = parameters.stiffness_n_per_m(cell);
            let contact = Contact::symmetric(stiffness, parameters.friction_n(cell) / stiffness);
            worm = worm.with_contact(cell, contact).ok()?;
        }
        Some(worm)
    }

    fn begin_settling(&self, parameters: &Parameters, heading: Heading) -> Option<Settling> {
        let worm = self.worm_of(parameters)?;
        let (worm, deformation_m) = match heading {
            Heading::Forward => (worm, self.deformation_m),
            Heading::Backward => (worm.mirrored(), [0.0; MAX_CELLS]),
        };
        Some(Settling {
            parameters: *parameters,
            heading,
            motion: under_way(&worm, &deformation_m[..worm.cells()]),
            worm,
            cycles: 0,
        })
    }

    /// The worm of some parameters in its periodic crawl, at phase 0.
    fn settle(&mut self, parameters: &Parameters, heading: Heading) -> Poll<Option<(Worm, Motion)>> {
        let of_these = |settling: &Settling| settling.parameters == *parameters && settling.heading == heading;
        let begun = self.settling.take().filter(of_these);
        let Some(mut settling) = begun.or_else(|| self.begin_settling(parameters, heading)) else {
            return Poll::Ready(None);
        };
        for _ in 0..CYCLES_AT_ONCE {
            match settling.run_cycle() {
                None => return Poll::Ready(None),
                Some(true) => {
                    let motion = under_way(&settling.worm, settling.motion.deformations_m());
                    return Poll::Ready(Some((settling.worm, motion)));
                }
                Some(false) => {}
            }
        }
        self.settling = Some(settling);
        Poll::Pending
    }

    /// Mean torque of every bin, N m.
    pub(super) fn profile(&mut self, parameters: &Parameters, bins: &mut [f64]) -> Poll<Option<()>> {
        self.settle(parameters, Heading::Forward).map(|settled| {
            let (worm, mut motion) = settled?;
            let mut work = WorkInBins::new(bins, worm.cells());
            motion.advance_in_pieces(&worm, 1.0, |piece| work.add(piece)).ok()?;
            let per_rad = bins.len() as f64 / TAU;
            bins.iter_mut().for_each(|bin| *bin *= per_rad);
            Some(())
        })
    }

    /// Begins later searches at the periodic crawl of these parameters, where there is one.
    pub(super) fn begin_at(&mut self, parameters: &Parameters) -> Poll<()> {
        self.settle(parameters, Heading::Forward).map(|settled| {
            if let Some((_, motion)) = settled {
                self.deformation_m[..motion.deformations_m().len()].copy_from_slice(motion.deformations_m());
            }
        })
    }

    /// Figures of the steady cycle; distances are along the crawl.
    pub(super) fn figures(&mut self, parameters: &Parameters, heading: Heading) -> Poll<Option<CycleFigures>> {
        self.settle(parameters, heading).map(|settled| {
            let (worm, mut motion) = settled?;
            let from_m = motion.mean_position_m();
            motion.advance_to(&worm, 1.0).ok()?;
            let ledger = motion.ledger();
            Some(CycleFigures {
                advance_m: motion.mean_position_m() - from_m,
                energy_loss_j: ledger.loss_j(),
                energy_net_j: ledger.actuator_net_j,
                energy_positive_j: ledger.actuator_positive_j,
                forward_slide_m: ledger.forward_slide_m,
                backward_slide_m: ledger.backward_slide_m,
            })
        })
    }
}

/// A worm at phase 0 with these deformations.
fn under_way(worm: &Worm, deformations_m: &[f64]) -> Motion {
    Motion::under_way(worm, 0.0, &[0.0; MAX_CELLS][..worm.cells()], deformations_m)
}

/// Spreads the work of a cycle's pieces over bins of the same length.
struct WorkInBins<'b> {
    bins_j: &'b mut [f64],
    bins_per_step: f64,
    at: f64, // in bins
}

impl<'b> WorkInBins<'b> {
    fn new(bins_j: &'b mut [f64], steps: usize) -> Self {
        bins_j.fill(0.0);
        Self {
            bins_per_step: bins_j.len() as f64 / steps as f64,
            bins_j,
            at: 0.0,
        }
    }

    /// Adds the piece that comes next, of a worm that crawls forward.
    fn add(&mut self, piece: &Piece) {
        let width = piece.steps * self.bins_per_step;
        let (begin, end) = (self.at, self.at + width);
        let [force_n, end_n] = piece.force_n;
        let rise_n = (end_n - force_n) / width;
        let extension_m = piece.extension_m / width;
        let mut from = begin;
        while from < end {
            let to = (from.floor() + 1.0).min(end);
            // A force that is linear has its mean in the middle.
            let mean_n = force_n + rise_n * (0.5 * (from + to) - begin);
            if let Some(work_j) = self.bins_j.get_mut(from as usize) {
                *work_j += mean_n * extension_m * (to - from);
            }
            from = to;
        }
        self.at = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::self_sensing::parameters::Vector;

    /// Against the ledger of a motion that stops at the end of every bin.
    #[test]
    fn the_work_of_a_bin_is_what_the_ledger_has_of_it() {
        for (pull_n, friction_n) in [
            (0.0, [0.98, 0.9, 1.1, 1.0]),
            (1.9, [1.2, 0.7, 1.0, 1.3]),
            (-0.4, [1.0; 4]),
        ] {
            let mut parameters = Parameters {
                cells: 4,
                values: Vector::zeros(),
            };
            for (cell, friction_n) in friction_n.into_iter().enumerate() {
                parameters.values[cell] = f64::ln(friction_n);
                parameters.values[4 + cell] = f64::ln(800.0 + 100.0 * cell as f64);
            }
            let pull_at = parameters.pull_at();
            parameters.values[pull_at] = pull_n;
            let mut model = CycleModel::new(&Worm::paper());
            let mut bins_n_m = [0.0; 128];
            while model
                .profile(&parameters, &mut bins_n_m)
                .map(|held| held.expect("a worm that holds"))
                .is_pending()
            {}
            let (worm, mut motion) = loop {
                if let Poll::Ready(settled) = model.settle(&parameters, Heading::Forward) {
                    break settled.expect("a worm that holds");
                }
            };
            for (bin, torque_n_m) in bins_n_m.into_iter().enumerate() {
                let before_j = motion.ledger().actuator_net_j;
                motion
                    .advance_to(&worm, (bin + 1) as f64 / 128.0)
                    .expect("a worm that holds");
                let by_ledger_n_m = (motion.ledger().actuator_net_j - before_j) * 128.0 / TAU;
                assert!(
                    (torque_n_m - by_ledger_n_m).abs() < 1e-12,
                    "bin {bin} under {pull_n} N: {torque_n_m}, not {by_ledger_n_m} N m"
                );
            }
        }
    }
}
