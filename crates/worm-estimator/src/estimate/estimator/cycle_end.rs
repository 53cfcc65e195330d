//! The end of a gait cycle: fit, energy balance, prediction, and the corrections that follow.

use super::Estimator;
use crate::estimate::bounds::Identification;
use crate::estimate::energy_balance::{EnergyBalance, Start, Tip};
use crate::estimate::unknown;
use crate::time::seconds;
use worm_physics::MAX_CELLS;

/// Standard deviation of largest tip deformations that are only guessed, as a fraction: that of all of them together.
const GUESSED_BOUND_FRACTION: f64 = 0.15;

impl Estimator {
    /// Closes the open cycle: fit, energy balance, prediction.
    pub(super) fn close(&mut self, end_s: f64) {
        let direction = self.cycles.direction();
        let sign = f64::from(direction);
        let gait = self.gait.seen_along(direction);
        let fitted = self.window_is_complete
            && self.window.samples() as usize >= 2 * self.cells
            && self.fit.run(&self.window, &gait, self.filter.noise_m());
        self.cycle = unknown::cycle(self.cells);
        self.describe_electrical(end_s, direction);
        if fitted {
            let mut tips = [Tip::default(); MAX_CELLS];
            for (to, tip) in tips.iter_mut().zip(&self.tips) {
                *to = Tip {
                    weight_n: sign * tip.weight_n,
                    ..*tip
                };
            }
            let tips = &tips[..self.cells];
            let start = Start {
                contact_m: &self.window_contact_m[..self.cells],
                resting_m: self.predictor.resting_deformation_m().map(|m| sign * m),
                starts_at_rest: self.starts_at_rest,
            };
            let balance = self.energy_integrator.close(&self.fit, tips, &start);
            self.describe_motion(&balance, sign);
            self.correct_contacts(&balance, sign);
            self.window_contact_m = balance.contact_at_start_m;
            if self.bounds_are_known() {
                self.mismatch.add_cycle(&self.window);
            }
            self.window.next_cycle();
            self.identify(tips);
        } else {
            self.begin_window();
        }
        let prediction = self.predictor.cycle(direction);
        self.cycle.predicted_advance_m = prediction.advance_m;
        self.cycle.predicted_energy_loss_j = prediction.energy_loss_j;
        self.cycle.predicted_energy_positive_j = prediction.energy_positive_j;
        self.cycle.predicted_forward_slide_m = prediction.forward_slide_m;
        self.cycle.predicted_backward_slide_m = prediction.backward_slide_m;
        self.cycle_index += 1;
    }

    fn bounds_are_known(&self) -> bool {
        self.identification.as_ref().is_none_or(Identification::is_done)
    }

    fn describe_electrical(&mut self, end_s: f64, direction: i32) {
        let spent = self.electrical.total().since(&self.cycle_start.electrical);
        self.cycle.index = self.cycle_index;
        self.cycle.end_ns = (end_s * 1e9) as u64;
        let start_ns = (self.cycle_start.time_s * 1e9) as u64;
        self.cycle.duration_s = seconds(self.cycle.end_ns.saturating_sub(start_ns));
        self.cycle.host_paused_s = seconds(self.host_paused_ns.saturating_sub(self.cycle_start.host_paused_ns));
        self.cycle.energy_electrical_j = spent.electrical_j;
        self.cycle.energy_copper_j = spent.copper_j;
        self.cycle.energy_electrical_sigma_j = spent.sigma_j();
        self.cycle.samples = self.window.samples();
        self.cycle.direction = direction;
    }

    fn describe_motion(&mut self, balance: &EnergyBalance, sign: f64) {
        let known = self.bounds_are_known();
        let (forward_m, backward_m) = balance.slides_along_canal_m(sign);
        let cycle = &mut self.cycle;
        cycle.advance_m = sign * balance.advance_m;
        cycle.advance_sigma_m = balance.advance_sigma_m;
        cycle.forward_slide_m = forward_m;
        cycle.backward_slide_m = backward_m;
        cycle.energy_loss_j = balance.loss_j;
        cycle.energy_actuator_net_j = balance.actuator_net_j;
        cycle.energy_actuator_positive_j = balance.actuator_positive_j;
        cycle.energy_friction_inside_j = cycle.energy_electrical_j - cycle.energy_copper_j - balance.actuator_net_j;
        cycle.settled = u32::from(known && balance.settled);
        if balance.advance_m > balance.advance_sigma_m {
            let weight_n = self.predictor.weight_n();
            cycle.cot = balance.actuator_positive_j / (weight_n * balance.advance_m);
        }
        let mut by_bound = [0.0; MAX_CELLS];
        for (cell, tip) in self.tips.iter().enumerate() {
            by_bound[cell] = tip.stiffness_n_per_m * (forward_m[cell] + backward_m[cell]);
        }
        let from_bounds_j = match &self.identification {
            None => 0.0,
            Some(found) if known => found.standard_error(&by_bound),
            Some(_) => {
                let suspected = by_bound.iter().zip(&self.tips);
                GUESSED_BOUND_FRACTION * suspected.map(|(by_bound_n, tip)| by_bound_n * tip.bound_m).sum::<f64>()
            }
        };
        cycle.energy_loss_sigma_j = balance.loss_sigma_j.hypot(from_bounds_j);
        cycle.energy_actuator_sigma_j = balance.actuator_sigma_j.hypot(from_bounds_j);
    }

    /// Replaces the results of the live positions for this cycle by those of the fit.
    fn correct_contacts(&mut self, balance: &EnergyBalance, sign: f64) {
        let (slid_forward_m, slid_backward_m) = balance.slides_along_canal_m(sign);
        let mut forward_m = *self.contacts.forward_m();
        let mut backward_m = *self.contacts.backward_m();
        let mut loss_j = self.contacts.loss_j();
        if balance.complete {
            loss_j = self.cycle_start.loss_j;
            for (cell, tip) in self.tips.iter().enumerate() {
                forward_m[cell] = self.cycle_start.forward_m[cell] + slid_forward_m[cell];
                backward_m[cell] = self.cycle_start.backward_m[cell] + slid_backward_m[cell];
                loss_j += tip.stiffness_n_per_m * tip.bound_m * (slid_forward_m[cell] + slid_backward_m[cell]);
            }
        }
        let contact_m = balance.contact_at_end_m.map(|contact_m| sign * contact_m);
        self.contacts.correct(&contact_m, &forward_m, &backward_m, loss_j);
    }

    fn identify(&mut self, tips: &[Tip]) {
        let Some(identification) = &mut self.identification else {
            return;
        };
        if identification.add_cycle(&self.fit, tips) && self.predictor.set_bounds(identification.bound_m()).is_ok() {
            for (tip, &bound_m) in self.tips.iter_mut().zip(identification.bound_m()) {
                tip.bound_m = bound_m;
            }
            self.contacts.set_tips(&self.tips);
            let standard_error = |weights: &[f64; MAX_CELLS]| identification.standard_error(weights);
            self.mismatch
                .set_identified(self.predictor.exact_worm(), standard_error);
            // With new bounds the contact points at the window's start have to be found anew.
            self.window_contact_m = [f64::NAN; MAX_CELLS];
            self.show_bounds();
        }
    }
}
