//! The torque profile that the exact quasi-static cycle gives, and what else it gives: advance, slides, energies.
//!
//! The mean torque of a bin is the actuator work (13) in it over its angle. The work comes from the ledger of the exact motion, so a bin is
//! exact whatever happens in it.

use super::parameters::Parameters;
use std::f64::consts::TAU;
use worm_physics::{Contact, MAX_CELLS, Motion, Worm};

/// Change of a deformation over a cycle, as a share of the stroke, below which the crawl counts as periodic.
const PERIODIC_SHARE: f64 = 1e-7;
/// Cycles after which the search for the periodic crawl ends; from a neighbouring worm's it takes two or three.
const MAX_CYCLES: u32 = 12;

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
#[derive(Debug, Clone)]
pub(super) struct CycleModel {
    worm: Worm, // level, without resisting force
    deformation_m: [f64; MAX_CELLS],
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

    /// The periodic crawl at phase 0.
    fn settle(&self, worm: &Worm) -> Option<Motion> {
        let cells = worm.cells();
        let mut motion = Motion::under_way(worm, 0.0, &[0.0; MAX_CELLS][..cells], &self.deformation_m[..cells]);
        for cycle in 0..MAX_CYCLES {
            let mut before_m = [0.0; MAX_CELLS];
            before_m[..cells].copy_from_slice(motion.deformations_m());
            motion.advance_to(worm, f64::from(cycle + 1)).ok()?;
            let apart_m = before_m
                .iter()
                .zip(motion.deformations_m())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            if apart_m < PERIODIC_SHARE * worm.stroke_m() {
                break;
            }
        }
        Some(Motion::under_way(
            worm,
            0.0,
            &[0.0; MAX_CELLS][..cells],
            motion.deformations_m(),
        ))
    }

    /// Mean torque of every bin, N m. `None` when the tips could not hold such a worm.
    pub(super) fn profile(&self, parameters: &Parameters, bins: &mut [f64]) -> Option<()> {
        let worm = self.worm_of(parameters)?;
        let mut motion = self.settle(&worm)?;
        let per_bin = bins.len() as f64 / TAU;
        let count = bins.len() as f64;
        let ends = (1..=bins.len()).map(|end| end as f64 / count);
        let (mut done_j, mut bin) = (0.0, bins.iter_mut());
        let held = motion.advance_through(&worm, ends, |motion| {
            let work_j = motion.ledger().actuator_net_j;
            if let Some(torque_n_m) = bin.next() {
                *torque_n_m = (work_j - done_j) * per_bin;
            }
            done_j = work_j;
        });
        held.ok()
    }

    /// Begins later searches at the periodic crawl of these parameters.
    pub(super) fn begin_at(&mut self, parameters: &Parameters) {
        if let Some(motion) = self.worm_of(parameters).and_then(|worm| self.settle(&worm)) {
            self.deformation_m[..motion.deformations_m().len()].copy_from_slice(motion.deformations_m());
        }
    }

    /// Figures of the steady cycle, of the crawl forward or backward; distances are along the crawl.
    pub(super) fn figures(&self, parameters: &Parameters, backward: bool) -> Option<CycleFigures> {
        let mut worm = self.worm_of(parameters)?;
        let mut motion = if backward {
            worm = worm.mirrored();
            let from_rest = Self {
                deformation_m: [0.0; MAX_CELLS],
                ..self.clone()
            };
            from_rest.settle(&worm)?
        } else {
            self.settle(&worm)?
        };
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
    }
}
