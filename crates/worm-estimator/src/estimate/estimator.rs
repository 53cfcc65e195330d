//! The estimator: states in, estimates and cycles out.

use super::bounds::Identification;
use super::capture::Capture;
use super::contact::Contacts;
use super::cycles::{Cycles, Event};
use super::electrical::{Electrical, Energies};
use super::energy_balance::{EnergyBalance, EnergyIntegrator, Start, Tip};
use super::filter::BodyFilter;
use super::fit::Fit;
use super::gait::StepSequence;
use super::mismatch::{Mismatch, ResidualMap};
use super::motor_time::MotorTime;
use super::prediction::Predictor;
use super::unknown;
use super::update::{EstimatorError, Update};
use super::window::Window;
use crate::config::{Config, DeformationSource};
use crate::message::{Cycle, Estimate, Mode, State};
use worm_physics::MAX_CELLS;

/// Positions beyond this are no positions, m.
const FARTHEST_M: f64 = 1e5;
/// Steps of the gait without a believed position after which the contact points are lost.
const MAX_BLIND_STEPS: f64 = 0.5;
/// Tracker periods that are no silence yet, however far the gait goes in them.
const SHORTEST_SILENCE_PERIODS: f64 = 2.5;
/// Standard deviation of largest tip deformations that are only guessed, as a share: that of all of them together.
const GUESSED_BOUND_FRACTION: f64 = 0.15;

/// Account of the open cycle.
#[derive(Debug, Clone, Copy)]
struct CycleStart {
    time_s: f64,
    host_paused_ns: u64,
    electrical: Energies,
    forward_m: [f64; MAX_CELLS],
    backward_m: [f64; MAX_CELLS],
    loss_j: f64,
}

/// The estimator of one worm. Feed it every state in order; gaps, repeats and nonsense are survived.
#[derive(Debug, Clone)]
pub struct Estimator {
    cells: usize,
    gait: StepSequence,
    tracker_period_s: f64,
    tips: Vec<Tip>, // in forward direction
    filter: BodyFilter,
    contacts: Contacts,
    motor_time: MotorTime,
    capture: Capture,
    host_paused_ns: u64, // as of the last state
    cycles: Cycles,
    electrical: Electrical,
    window: Window,
    window_contact_m: [f64; MAX_CELLS], // at the window's start, in the direction of the crawl
    window_is_complete: bool,           // no silence in the open cycle
    has_crawled: bool,                  // a cycle has ended
    starts_at_rest: bool,               // the open cycle is the first, and began at rest
    fit: Fit,
    energy_integrator: EnergyIntegrator,
    identification: Option<Identification>,
    mismatch: Mismatch,
    predictor: Predictor,
    cycle_start: CycleStart,
    cycle_index: u64,
    last: Option<(u64, f64, f64)>, // sequence, time and phase of the last state
    last_seen: Option<(f64, f64)>, // time and phase of the last believed position
    first_mean_m: f64,             // mean position when it was first known
    entered: (f64, f64),           // step share at which the present step was entered, and the cell's lead then
    estimate: Estimate,
    cycle: Cycle,
}

impl Estimator {
    /// An estimator for the configured worm. All memory is taken here.
    ///
    /// # Errors
    /// [`EstimatorError`] when the configuration is not one that [`Config::load`] would have let through.
    pub fn new(config: &Config) -> Result<Self, EstimatorError> {
        if let Some(problem) = config.problems().into_iter().next() {
            return Err(EstimatorError::Config(problem));
        }
        let cells = config.worm.cells;
        let gait = StepSequence::new(&config.worm);
        let predictor = Predictor::new(config)?;
        let tips = predictor.tips();
        let fit = Fit::new(cells, config.worm.stroke_m);
        let identified = config.worm.max_deformation == DeformationSource::Identified;
        let mut estimator = Self {
            cells,
            gait,
            tracker_period_s: 1.0 / config.tracker.rate_hz,
            filter: BodyFilter::new(config, gait),
            contacts: Contacts::new(&tips),
            motor_time: MotorTime::default(),
            capture: Capture::default(),
            host_paused_ns: 0,
            cycles: Cycles::new(config.gait.direction.sign() as i32),
            electrical: Electrical::new(config.servo.winding_resistance_ohm),
            window: Window::new(cells),
            window_contact_m: [f64::NAN; MAX_CELLS],
            window_is_complete: false,
            has_crawled: false,
            starts_at_rest: false,
            energy_integrator: EnergyIntegrator::new(cells, fit.unknowns()),
            fit,
            identification: identified.then(|| Identification::new(&tips)),
            mismatch: Mismatch::new(predictor.worm()),
            predictor,
            cycle_start: CycleStart {
                time_s: 0.0,
                host_paused_ns: 0,
                electrical: Energies::default(),
                forward_m: [0.0; MAX_CELLS],
                backward_m: [0.0; MAX_CELLS],
                loss_j: 0.0,
            },
            cycle_index: 0,
            last: None,
            last_seen: None,
            first_mean_m: f64::NAN,
            entered: (f64::NAN, f64::NAN),
            estimate: unknown::estimate(cells),
            cycle: unknown::cycle(cells),
            tips,
        };
        estimator.show_bounds();
        Ok(estimator)
    }

    /// The estimate after the last tracker sample, for a heartbeat; positions are `NaN` before the first.
    pub fn latest(&self) -> &Estimate {
        &self.estimate
    }

    /// What the model does not explain of the last cycles; empty while the bounds are still being identified.
    pub fn residual_map(&self) -> &ResidualMap {
        self.mismatch.map()
    }

    /// Something is wrong with the worm that has a name of its own: the open cycle does not enter the residual map.
    pub fn exclude_cycle(&mut self) {
        self.mismatch.disturb();
    }

    /// Takes up one state.
    pub fn update(&mut self, state: &State) -> Update<'_> {
        let time_s = state.time_ns as f64 * 1e-9;
        self.detect_restart(state, time_s);
        let motor_ns = self.motor_time.update(state);
        let motor_s = motor_ns as f64 * 1e-9;
        self.electrical.update(state, motor_ns);
        self.host_paused_ns = state.host_paused_ns;
        if state.mode != Mode::Crawling.code() {
            self.mismatch.disturb();
        }
        let mut cycle_ended = false;
        if state.phase.is_finite() {
            cycle_ended = self.follow_phase(state.phase, time_s);
        }
        let sampled = state.sample_is_new == 1 && state.phase.is_finite();
        if sampled {
            self.take_sample(state, time_s, motor_s);
        }
        if state.phase.is_finite() {
            self.capture.note_tick(motor_s, state.phase);
            self.detect_silence(state.phase, time_s);
            self.last = Some((state.sequence, time_s, state.phase));
        } else if let Some((sequence, ..)) = &mut self.last {
            *sequence = state.sequence;
        }
        if sampled {
            self.fill_estimate(state);
        }
        Update {
            estimate: sampled.then_some(&self.estimate),
            cycle: cycle_ended.then_some(&self.cycle),
        }
    }

    /// Counts lost states; starts over when the controller did.
    fn detect_restart(&mut self, state: &State, time_s: f64) {
        let Some((sequence, last_s, _)) = self.last else { return };
        if state.sequence > sequence && time_s >= last_s {
            self.estimate.states_lost += state.sequence - sequence - 1;
            return;
        }
        self.filter.forget();
        self.motor_time.forget();
        self.capture.forget();
        self.cycles.forget();
        self.electrical.restart();
        self.mismatch.forget();
        self.last_seen = None;
        self.last = None;
        self.lose_contacts();
    }

    fn lose_contacts(&mut self) {
        self.contacts.forget();
        self.window.clear();
        self.window_contact_m = [f64::NAN; MAX_CELLS];
        self.window_is_complete = false;
        // Where the open step began was not seen well enough for (1) to hold at its end.
        self.entered = (f64::NAN, f64::NAN);
        if let Some(identification) = &mut self.identification {
            identification.interrupt();
        }
    }

    fn detect_silence(&mut self, phase: f64, time_s: f64) {
        let Some((seen_s, seen_phase)) = self.last_seen else {
            return;
        };
        let blind_steps = (phase - seen_phase).abs() * self.cells as f64;
        if blind_steps > MAX_BLIND_STEPS && time_s - seen_s > SHORTEST_SILENCE_PERIODS * self.tracker_period_s {
            self.last_seen = None;
            self.lose_contacts();
        }
    }

    /// Follows the phase over the ends of cycles. True when `self.cycle` is a new one.
    fn follow_phase(&mut self, phase: f64, time_s: f64) -> bool {
        match self.cycles.advance_to(phase) {
            Event::Continues => false,
            Event::AtRest => {
                self.starts_at_rest = !self.has_crawled;
                self.mismatch.rest();
                self.open(time_s);
                false
            }
            Event::Began => {
                self.starts_at_rest = false;
                self.begin_window();
                self.cycle_index = 0;
                self.open(time_s);
                false
            }
            Event::Ended { fraction, whole } => {
                let end_s = match self.last {
                    Some((_, last_s, _)) => last_s + fraction * (time_s - last_s),
                    None => time_s,
                };
                if whole {
                    self.close(end_s);
                } else {
                    self.begin_window();
                }
                self.open(end_s);
                (self.has_crawled, self.starts_at_rest) = (true, false);
                whole
            }
        }
    }

    /// A window that begins here, with the contact points of this moment.
    fn begin_window(&mut self) {
        self.window.clear();
        self.window_is_complete = true;
        self.mismatch.begin(self.cycles.direction());
        let sign = f64::from(self.cycles.direction());
        self.window_contact_m = self.contacts.contact_m().map(|contact_m| sign * contact_m);
        if let Some(identification) = &mut self.identification {
            identification.interrupt();
        }
    }

    fn open(&mut self, time_s: f64) {
        self.cycle_start = CycleStart {
            time_s,
            host_paused_ns: self.host_paused_ns,
            electrical: self.electrical.total(),
            forward_m: *self.contacts.forward_m(),
            backward_m: *self.contacts.backward_m(),
            loss_j: self.contacts.loss_j(),
        };
    }

    /// Closes the open cycle: fit, account, prediction.
    fn close(&mut self, end_s: f64) {
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
                self.mismatch.take_up(&self.window);
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
        self.cycle.duration_s = end_s - self.cycle_start.time_s;
        self.cycle.host_paused_s = self.host_paused_ns.saturating_sub(self.cycle_start.host_paused_ns) as f64 / 1e9;
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

    /// Replaces what the live positions gave for this cycle by what the fit gave.
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
        if identification.take_up(&self.fit, tips) && self.predictor.set_bounds(identification.bound_m()).is_ok() {
            for (tip, &bound_m) in self.tips.iter_mut().zip(identification.bound_m()) {
                tip.bound_m = bound_m;
            }
            self.contacts.set_tips(&self.tips);
            self.mismatch.set_identified(self.predictor.worm());
            // The window is accounted for from its start with the new bounds, so its contact points are found anew.
            self.window_contact_m = [f64::NAN; MAX_CELLS];
            self.show_bounds();
        }
    }

    fn show_bounds(&mut self) {
        for (to, tip) in self.estimate.max_deformation_m.iter_mut().zip(&self.tips) {
            *to = tip.bound_m;
        }
    }

    /// Takes up the tracker sample of a state.
    fn take_sample(&mut self, state: &State, time_s: f64, motor_s: f64) {
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

    /// Carries the filter to a phase, over the boundaries of steps, where (1) applies.
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

    fn fill_estimate(&mut self, state: &State) {
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
        estimate.state_sequence = state.sequence;
        estimate.time_ns = state.time_ns;
        estimate.sample = state.sample;
        estimate.phase = state.phase;
        estimate.contact_m = *contacts.contact_m();
        estimate.forward_slide_m = *contacts.forward_m();
        estimate.backward_slide_m = *contacts.backward_m();
        estimate.power_electrical_w = self.electrical.power_w();
        estimate.energy_electrical_j = self.electrical.total().electrical_j;
        estimate.sliding_mask = contacts.sliding_mask();
    }
}
