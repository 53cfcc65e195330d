//! A tracker sample: filter, contact points, and the estimate that they give; and the estimate where no sample comes.

use super::Estimator;
use crate::message::State;
use worm_physics::MAX_CELLS;

/// Positions beyond this are no positions, m.
const FARTHEST_M: f64 = 1e5;

impl Estimator {
    /// Processes the tracker sample of a state.
    pub(super) fn take_sample(&mut self, state: &State, time_s: f64, motor_s: f64) {
        let (captured_s, phase) = self.capture.place(state.sample_time_s, motor_s, state.phase);
        let mut position_m = [f64::NAN; MAX_CELLS];
        for (cell, to) in position_m[..self.cells].iter_mut().enumerate() {
            *to = state
                .position_of(cell)
                .filter(|position_m| position_m.abs() < FARTHEST_M)
                .unwrap_or(f64::NAN);
        }
        self.predict(phase, captured_s);
        let accepted = self.filter.observe(&position_m[..self.cells]);
        if accepted != 0 {
            self.last_seen = Some((time_s, state.phase));
            self.is_blind = false;
        }
        let sign = f64::from(self.cycles.direction());
        for (cell, position_m) in position_m[..self.cells].iter_mut().enumerate() {
            self.contacts
                .follow(cell, self.filter.position_m(cell), self.filter.sigma_m(cell));
            *position_m = if accepted >> cell & 1 == 1 {
                sign * *position_m
            } else {
                f64::NAN
            };
        }
        if accepted != 0
            && self.window_is_complete
            && let Some(cycle_phase) = self.cycles.phase_in_cycle(phase)
        {
            self.window.add(cycle_phase, &position_m[..self.cells]);
        }
    }

    /// Predicts to a phase, across step boundaries, where (1) applies.
    fn predict(&mut self, phase: f64, time_s: f64) {
        let steps = phase * self.cells as f64;
        let near = self
            .filter
            .at()
            .is_some_and(|(at, _)| (steps - at).abs() <= self.cells as f64);
        if !near {
            self.filter.forget();
            self.filter.begin(steps, time_s);
            self.enter_step(steps - steps.floor());
        }
        while let Some(boundary) = self.filter.boundary_before(steps) {
            let (at, since_s) = self.filter.at().unwrap_or((boundary, time_s));
            let fraction = if steps == at {
                1.0
            } else {
                (boundary - at) / (steps - at)
            };
            self.filter.predict(boundary, since_s + fraction * (time_s - since_s));
            let forward = steps > at;
            let (cell, sign) = (self.filter.stepping_cell(), if forward { 1.0 } else { -1.0 });
            let (position_m, sigma_m) = (self.filter.position_m(cell), self.filter.sigma_m(cell));
            let whole_step = self.entered.0 == if forward { 0.0 } else { 1.0 };
            if whole_step {
                let step_m = self.filter.lead_m() - self.entered.1;
                self.contacts.anchor(cell, position_m, sigma_m, step_m, sign);
            }
            self.filter.cross(forward);
            self.enter_step(if forward { 0.0 } else { 1.0 });
        }
        self.filter.predict(steps, time_s);
    }

    fn enter_step(&mut self, fraction: f64) {
        self.entered = (fraction, self.filter.lead_m());
    }

    pub(super) fn fill_estimate(&mut self, state: &State) {
        let (mut mean_m, mut loss_j, contacts) = (0.0, self.contacts.loss_j(), &self.contacts);
        let estimate = &mut self.estimate;
        for cell in 0..self.cells {
            let position_m = self.filter.position_m(cell);
            mean_m += position_m / self.cells as f64;
            estimate.position_m[cell] = position_m;
            estimate.deformation_m[cell] = contacts.deformation_m(cell, position_m);
            estimate.force_n[cell] = self.tips[cell].stiffness_n_per_m * estimate.deformation_m[cell];
        }
        if self.first_mean_m.is_nan() {
            self.first_mean_m = mean_m;
        }
        let pull_n: f64 = self.tips.iter().map(|tip| tip.weight_n).sum();
        if mean_m.is_finite() {
            loss_j += pull_n * (mean_m - self.first_mean_m);
            estimate.energy_loss_j = loss_j;
        }
        estimate.contact_m = *contacts.contact_m();
        estimate.forward_slide_m = *contacts.forward_m();
        estimate.backward_slide_m = *contacts.backward_m();
        estimate.sliding_mask = contacts.sliding_mask();
        self.fill_from_motor(state);
    }

    /// The estimate at a state without a sample: positions and what follows from them as of the last one, and unknown once that is too
    /// old. Totals (slides, losses) leave out what nobody saw.
    pub(super) fn fill_estimate_without_sample(&mut self, state: &State, time_s: f64) {
        if self.pace.is_stale(time_s) {
            // What comes after is not to be joined to what was before.
            self.filter.forget();
            let estimate = &mut self.estimate;
            for unknown_m in [
                &mut estimate.position_m,
                &mut estimate.contact_m,
                &mut estimate.deformation_m,
            ] {
                unknown_m.fill(f64::NAN);
            }
            estimate.force_n.fill(f64::NAN);
            estimate.sliding_mask = 0;
        }
        self.fill_from_motor(state);
    }

    /// What an estimate says without positions.
    fn fill_from_motor(&mut self, state: &State) {
        let estimate = &mut self.estimate;
        estimate.state_sequence = state.sequence;
        estimate.time_ns = state.time_ns;
        estimate.sample = state.sample;
        estimate.phase = state.phase;
        estimate.power_electrical_w = self.electrical.power_w();
        estimate.energy_electrical_j = self.electrical.total().electrical_j;
    }
}
