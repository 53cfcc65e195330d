//! The exact quasi-static motion, as a stream of increments.
//!
//! # One step
//! While a step runs forward, the stepping cell moves forward or stands still and all others move backward or stand still, because
//! the balance keeps the body's translation between 0 and minus the extension. A contact therefore loads until it reaches its bound
//! and then slides until the step ends. Between two such events the balance of rates is linear: with K
//! the stiffness of the other cells that still load and k that of the stepping cell (0 once it slides), an extension e
//! translates the body by −e k/(k + K) and the stepping cell by e K/(k + K). When nothing loads any more every
//! translation between 0 and −e balances, and the one nearest to rest is taken. A step has at most n + 1 such pieces. Run
//! in reverse, all signs change.
//!
//! # Rounding
//! A contact closer to its bound than 10⁻¹² of the lengths involved counts as having reached it. Otherwise two
//! contacts that arrive together, as they do in symmetric worms, would arrive one rounding error apart, and a worm of two
//! cells would slide the wrong way. The balance that this disturbs is restored at the next increment.

#[cfg(test)]
pub(crate) mod tests;

use super::ledger::Ledger;
use super::worm::{SlidesDown, Worm};
use crate::MAX_CELLS;

/// Distance from a bound, as a fraction of bounds and stroke, that counts as zero.
const ARRIVAL_FRACTION: f64 = 1e-12;
/// Unbalanced force, as a fraction of what the contacts can exert, that counts as zero. It is well below the arrival fraction, so that
/// restoring the balance does not lift a sliding contact off its bound.
const BALANCE_FRACTION: f64 = 1e-14;

/// Largest phase, cycles: beyond it f64 does not resolve a piece of a step.
const MAX_PHASE: f64 = 1e12;

/// A part of a step without events: over it the stepping cell extends, and the force of its actuator changes linearly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// How long it is, in steps; negative in reverse.
    pub steps: f64,
    /// How far the stepping cell extends, m; negative in reverse.
    pub extension_m: f64,
    /// Force of its actuator at the beginning and at the end, N, as [`Motion::actuator_force_n`].
    pub force_n: [f64; 2],
}

/// A worm in motion: positions, deformations, phase and ledger. Fixed size, no heap.
///
/// Every method takes the [`Worm`] it describes, so that the worm may change while it moves. Cells are counted from 0.
///
/// # Panics
/// All methods panic when given a worm with another number of cells than the motion began with.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    cells: usize,
    position_m: [f64; MAX_CELLS],
    deformation_m: [f64; MAX_CELLS], // in −backward_bound..=forward_bound of the worm last used
    phase: f64,                      // finite
    ledger: Ledger,
}

impl Motion {
    /// A worm at rest at the given positions, phase 0: laid down unloaded, the tips have given way together until they carry the pull.
    /// If they cannot carry it, all are at their bounds and the next [`advance_to`](Self::advance_to) returns [`SlidesDown`].
    ///
    /// # Panics
    /// When there is not one position for each cell.
    pub fn at_rest(worm: &Worm, first_positions_m: &[f64]) -> Self {
        assert_eq!(
            first_positions_m.len(),
            worm.cells(),
            "one first position for each cell"
        );
        let mut position_m = [0.0; MAX_CELLS];
        position_m[..worm.cells()].copy_from_slice(first_positions_m);
        let mut motion = Self {
            cells: worm.cells(),
            position_m,
            deformation_m: [0.0; MAX_CELLS],
            phase: 0.0,
            ledger: Ledger::default(),
        };
        if let Err(slides) = motion.rebalance(worm) {
            for (deformation_m, contact) in motion.deformation_m.iter_mut().zip(worm.contacts()) {
                *deformation_m = if slides.pull_n > 0.0 {
                    -contact.backward_bound_m
                } else {
                    contact.forward_bound_m
                };
            }
        }
        Self {
            position_m,
            ledger: Ledger::default(),
            ..motion
        }
    }

    /// A worm in the middle of its crawl, with these deformations at this phase; those beyond a bound are set to it. The body
    /// gives way until the balance holds, and stays where it is if it cannot.
    ///
    /// # Panics
    /// When there is not one position and one deformation for each cell.
    pub fn under_way(worm: &Worm, phase: f64, positions_m: &[f64], deformations_m: &[f64]) -> Self {
        assert_eq!(deformations_m.len(), worm.cells(), "one deformation for each cell");
        let mut motion = Self::at_rest(worm, positions_m);
        motion.phase = phase;
        motion.deformation_m[..worm.cells()].copy_from_slice(deformations_m);
        motion.slide_into_bounds(worm);
        // A body that cannot be held is reported by the next advance.
        let _ = motion.rebalance(worm);
        motion.ledger = Ledger::default();
        motion
    }

    /// Advances to a phase, in gait cycles, unwrapped; a smaller phase than the present one runs the gait in reverse.
    /// Exact for any increment: many small ones end where a large one does, to rounding. Parameters of the worm that
    /// changed since the last call take effect first, as by [`rebalance`](Self::rebalance).
    ///
    /// # Errors
    /// [`SlidesDown`] when the tips cannot hold the worm. Nothing has moved then; [`translate`](Self::translate) lets it
    /// slide.
    ///
    /// # Panics
    /// When the phase is not finite or beyond 10¹² cycles, where a step could no longer be resolved.
    pub fn advance_to(&mut self, worm: &Worm, phase: f64) -> Result<(), SlidesDown> {
        self.advance_through(worm, [phase], |_| {})
    }

    /// Advances to one phase after the other, as [`advance_to`](Self::advance_to) does, of a worm that does not change meanwhile: it is
    /// balanced once. `each` sees the motion at every phase.
    ///
    /// # Errors
    /// [`SlidesDown`] when the tips cannot hold the worm. Nothing has moved then.
    ///
    /// # Panics
    /// As [`advance_to`](Self::advance_to).
    pub fn advance_through(
        &mut self,
        worm: &Worm,
        phases: impl IntoIterator<Item = f64>,
        mut each: impl FnMut(&Self),
    ) -> Result<(), SlidesDown> {
        self.rebalance(worm)?;
        for phase in phases {
            self.run_to(worm, phase, &mut |_| {});
            each(self);
        }
        Ok(())
    }

    /// Advances as [`advance_to`](Self::advance_to) does, and shows every piece of the way in its order.
    ///
    /// # Errors
    /// [`SlidesDown`] when the tips cannot hold the worm. Nothing has moved then.
    ///
    /// # Panics
    /// As [`advance_to`](Self::advance_to).
    pub fn advance_in_pieces(
        &mut self,
        worm: &Worm,
        phase: f64,
        mut each: impl FnMut(&Piece),
    ) -> Result<(), SlidesDown> {
        self.rebalance(worm)?;
        self.run_to(worm, phase, &mut each);
        Ok(())
    }

    /// Runs to a phase from a balanced instant.
    fn run_to(&mut self, worm: &Worm, phase: f64, each: &mut dyn FnMut(&Piece)) {
        assert!(
            phase.abs() <= MAX_PHASE,
            "the gait phase must be finite and within ±{MAX_PHASE} cycles, not {phase}"
        );
        let steps_per_cycle = self.cells as f64;
        let target = phase * steps_per_cycle;
        let mut at = self.phase * steps_per_cycle;
        while at != target {
            let (step, end) = if target > at {
                (at.floor(), (at.floor() + 1.0).min(target))
            } else {
                (at.ceil() - 1.0, (at.ceil() - 1.0).max(target))
            };
            self.extend(worm, cell_of_step(worm, step), end - at, each);
            at = end;
        }
        self.phase = phase;
    }

    /// Changes the parameters at the present phase: tips beyond a bound that shrank slide to it, then the body gives way until the
    /// balance holds again. The energy that the sudden motion releases is added to the settling loss.
    ///
    /// # Errors
    /// [`SlidesDown`] when no balance exists; nothing has moved then.
    pub fn rebalance(&mut self, worm: &Worm) -> Result<(), SlidesDown> {
        assert_eq!(self.cells, worm.cells(), "a motion keeps its number of cells");
        worm.check_hold()?;
        let elastic_before_j = self.elastic_energy_j(worm);
        let mut spent_j = self.slide_into_bounds(worm);
        let full_force_n: f64 = worm
            .contacts()
            .iter()
            .map(|contact| contact.stiffness_n_per_m * (contact.range_m() + worm.stroke_m()))
            .sum();
        // Each pass takes one more contact to its bound or restores the balance.
        for _ in 0..=self.cells {
            let excess_n = self.unbalanced_force_n(worm);
            if excess_n.abs() <= BALANCE_FRACTION * full_force_n {
                break;
            }
            let sign = -excess_n.signum();
            let mut stiffness_n_per_m = 0.0;
            let mut nearest_m = f64::INFINITY;
            for cell in 0..self.cells {
                let room_m = self.settle_at_bound(worm, cell, sign);
                if room_m > 0.0 {
                    stiffness_n_per_m += worm.contacts()[cell].stiffness_n_per_m;
                    nearest_m = nearest_m.min(room_m);
                }
            }
            if stiffness_n_per_m == 0.0 {
                break; // All tips slide and the rest of the excess is rounding, for the hold was checked.
            }
            let shift_m = sign * nearest_m.min(excess_n.abs() / stiffness_n_per_m);
            spent_j += (0..self.cells)
                .map(|cell| self.displace(worm, cell, shift_m))
                .sum::<f64>();
        }
        self.ledger.settling_loss_j += elastic_before_j - self.elastic_energy_j(worm) - spent_j;
        Ok(())
    }

    /// Moves the whole body along the canal against the contacts, whether or not forces balance. This is how a worm that cannot hold
    /// slides down. `distance_m` is negative towards smaller positions. Tips load up to their bounds first and then slide. The
    /// energy that the slide releases beyond friction is added to the settling loss.
    pub fn translate(&mut self, worm: &Worm, distance_m: f64) {
        assert_eq!(self.cells, worm.cells(), "a motion keeps its number of cells");
        let elastic_before_j = self.elastic_energy_j(worm);
        let mut spent_j = self.slide_into_bounds(worm);
        spent_j += (0..self.cells)
            .map(|cell| self.displace(worm, cell, distance_m))
            .sum::<f64>();
        self.ledger.settling_loss_j += elastic_before_j - self.elastic_energy_j(worm) - spent_j;
    }

    /// Lets a tip slide for a reason outside this motion: its contact point moves by `slide_m` while the cell stays. The body gives way
    /// at the next increment.
    pub fn slide_tip(&mut self, worm: &Worm, cell: usize, slide_m: f64) {
        let contact = &worm.contacts()[cell];
        let deformation_m = self.deformation_m[cell] - slide_m;
        self.deformation_m[cell] = deformation_m.clamp(-contact.backward_bound_m, contact.forward_bound_m);
    }

    /// Positions Xᵢ along the canal, m, cell 0 first.
    pub fn positions_m(&self) -> &[f64] {
        &self.position_m[..self.cells]
    }

    /// Mean position of the cells, m.
    pub fn mean_position_m(&self) -> f64 {
        self.positions_m().iter().sum::<f64>() / self.cells as f64
    }

    /// Deformations δᵢ = Xᵢ − X_C,i (4), m, cell 0 first.
    pub fn deformations_m(&self) -> &[f64] {
        &self.deformation_m[..self.cells]
    }

    /// Deformation of a cell, m.
    pub fn deformation_m(&self, cell: usize) -> f64 {
        self.deformations_m()[cell]
    }

    /// Where a cell's tip touches the canal, X_C,i, m.
    pub fn tip_m(&self, cell: usize) -> f64 {
        self.positions_m()[cell] - self.deformation_m(cell)
    }

    /// Gait phase, cycles, unwrapped.
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// The stepping cell; on the boundary of two steps, the one that steps next in a forward crawl.
    pub fn stepping_cell(&self, worm: &Worm) -> usize {
        cell_of_step(worm, (self.phase * self.cells as f64).floor())
    }

    /// How far the stepping cell has extended in its present step, m.
    pub fn extension_m(&self, worm: &Worm) -> f64 {
        let steps = self.phase * self.cells as f64;
        worm.stroke_of_m(self.stepping_cell(worm)) * (steps - steps.floor())
    }

    /// Energies and slides since the motion began.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Force that the stepping cell's actuator must exert now: its contact force k δ, its weight along the canal and its
    /// part of the resisting force (13), N. Positive when extending takes work.
    pub fn actuator_force_n(&self, worm: &Worm) -> f64 {
        self.extending_force_n(worm, self.stepping_cell(worm))
    }

    /// Σ kᵢ δᵢ + m g sin λ + resisting force, N: 0 up to rounding after every advance.
    pub fn unbalanced_force_n(&self, worm: &Worm) -> f64 {
        let contacts = worm.contacts().iter().zip(self.deformations_m());
        contacts
            .map(|(contact, deformation_m)| contact.stiffness_n_per_m * deformation_m)
            .sum::<f64>()
            + worm.pull_n()
    }

    /// Elastic energy in the contacts, ½ Σ kᵢ δᵢ², J.
    pub fn elastic_energy_j(&self, worm: &Worm) -> f64 {
        let contacts = worm.contacts().iter().zip(self.deformations_m());
        contacts
            .map(|(contact, deformation_m)| 0.5 * contact.stiffness_n_per_m * deformation_m * deformation_m)
            .sum()
    }

    fn extending_force_n(&self, worm: &Worm, cell: usize) -> f64 {
        let contact_force_n = worm.contacts()[cell].stiffness_n_per_m * self.deformation_m[cell];
        contact_force_n + worm.cell_weight_n(cell) + worm.cell_resistance_n()
    }

    /// Runs a part of one cell's step, in steps, negative in reverse, from event to event.
    fn extend(&mut self, worm: &Worm, stepping: usize, steps: f64, each: &mut dyn FnMut(&Piece)) {
        let sign = steps.signum();
        let extension_per_step_m = worm.stroke_of_m(stepping);
        let mut left = steps.abs();
        while left > 0.0 {
            let stepping_room_m = self.settle_at_bound(worm, stepping, sign);
            let stepping_stiffness_n_per_m = if stepping_room_m > 0.0 {
                worm.contacts()[stepping].stiffness_n_per_m
            } else {
                0.0
            };
            let mut others_stiffness_n_per_m = 0.0;
            let mut others_room_m = f64::INFINITY;
            for cell in (0..self.cells).filter(|&cell| cell != stepping) {
                let room_m = self.settle_at_bound(worm, cell, -sign);
                if room_m > 0.0 {
                    others_stiffness_n_per_m += worm.contacts()[cell].stiffness_n_per_m;
                    others_room_m = others_room_m.min(room_m);
                }
            }
            let loading_n_per_m = stepping_stiffness_n_per_m + others_stiffness_n_per_m;
            let (stepping_fraction, others_fraction) = if loading_n_per_m > 0.0 {
                (
                    others_stiffness_n_per_m / loading_n_per_m,
                    stepping_stiffness_n_per_m / loading_n_per_m,
                )
            } else {
                (1.0, 0.0)
            };
            let mut piece = left;
            if stepping_stiffness_n_per_m > 0.0 {
                piece = piece.min(steps_to_go(stepping_room_m, stepping_fraction * extension_per_step_m));
            }
            if others_stiffness_n_per_m > 0.0 {
                piece = piece.min(steps_to_go(others_room_m, others_fraction * extension_per_step_m));
            }
            each(&self.run_piece(worm, stepping, sign * piece, stepping_fraction, others_fraction));
            left -= piece;
        }
    }

    /// Runs a piece without events: the stepping cell takes its part of the extension, the others theirs backward.
    fn run_piece(
        &mut self,
        worm: &Worm,
        stepping: usize,
        steps: f64,
        stepping_fraction: f64,
        others_fraction: f64,
    ) -> Piece {
        let extension_m = steps * worm.stroke_of_m(stepping);
        let force_before_n = self.extending_force_n(worm, stepping);
        let deformation_before_m: f64 = self.deformations_m().iter().sum();
        for cell in 0..self.cells {
            let shift_m = if cell == stepping {
                stepping_fraction
            } else {
                -others_fraction
            } * extension_m;
            self.displace(worm, cell, shift_m);
        }
        let deformation_after_m: f64 = self.deformations_m().iter().sum();
        let cycles = steps.abs() / self.cells as f64;
        self.ledger.deformation_integral_m += 0.5 * (deformation_before_m + deformation_after_m) * cycles;
        let force_after_n = self.extending_force_n(worm, stepping);
        self.ledger
            .add_actuator_work(force_before_n, force_after_n, extension_m);
        Piece {
            steps,
            extension_m,
            force_n: [force_before_n, force_after_n],
        }
    }

    /// How far a cell can still load when it moves in the given direction, m; 0 once it slides. A contact within rounding of its bound
    /// is set to it.
    fn settle_at_bound(&mut self, worm: &Worm, cell: usize, sign: f64) -> f64 {
        let contact = &worm.contacts()[cell];
        let bound_m = if sign > 0.0 {
            contact.forward_bound_m
        } else {
            -contact.backward_bound_m
        };
        let room_m = sign * (bound_m - self.deformation_m[cell]);
        if room_m > ARRIVAL_FRACTION * (contact.range_m() + worm.stroke_m()) {
            room_m
        } else {
            self.deformation_m[cell] = bound_m;
            0.0
        }
    }

    /// Moves a cell; its tip follows once the bound is reached (2, 3). Exact because the move is monotone. Returns what it
    /// took besides elastic energy: sliding loss and work against weight and resisting force, J.
    fn displace(&mut self, worm: &Worm, cell: usize, shift_m: f64) -> f64 {
        self.position_m[cell] += shift_m;
        let weight_work_j = worm.cell_weight_n(cell) * shift_m;
        let resisting_work_j = worm.cell_resistance_n() * shift_m;
        self.ledger.weight_work_j += weight_work_j;
        self.ledger.resisting_work_j += resisting_work_j;
        self.deformation_m[cell] += shift_m;
        self.slide_cell_into_bounds(worm, cell) + weight_work_j + resisting_work_j
    }

    /// Lets every tip beyond a bound slide to it. Returns the sliding loss, J.
    fn slide_into_bounds(&mut self, worm: &Worm) -> f64 {
        (0..self.cells)
            .map(|cell| self.slide_cell_into_bounds(worm, cell))
            .sum()
    }

    fn slide_cell_into_bounds(&mut self, worm: &Worm, cell: usize) -> f64 {
        let contact = &worm.contacts()[cell];
        let held_m = self.deformation_m[cell].clamp(-contact.backward_bound_m, contact.forward_bound_m);
        let slide_m = self.deformation_m[cell] - held_m;
        if slide_m == 0.0 {
            return 0.0;
        }
        self.deformation_m[cell] = held_m;
        let loss_j = contact.stiffness_n_per_m * held_m * slide_m;
        self.ledger.slide(cell, slide_m, loss_j);
        loss_j
    }
}

/// The stepping cell of a step; steps are counted from phase 0 and may be negative.
fn cell_of_step(worm: &Worm, step: f64) -> usize {
    worm.step_order()[step.rem_euclid(worm.cells() as f64) as usize]
}

/// Steps until a cell that moves by `rate_m` per step has used up its room; infinite when it stands still.
fn steps_to_go(room_m: f64, rate_m: f64) -> f64 {
    if rate_m > 0.0 { room_m / rate_m } else { f64::INFINITY }
}
