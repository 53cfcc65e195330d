//! The estimator: states in, estimates and cycles out.

mod cycle_end;
mod sample;

use super::bounds::Identification;
use super::capture::Capture;
use super::contact::Contacts;
use super::cycles::{Cycles, Event};
use super::electrical::{Electrical, Energies};
use super::energy_balance::{EnergyIntegrator, Tip};
use super::filter::BodyFilter;
use super::fit::Fit;
use super::gait::StepSequence;
use super::mismatch::{Mismatch, ResidualMap};
use super::motor_time::MotorTime;
use super::pace::Pace;
use super::prediction::Predictor;
use super::unknown;
use super::update::{EstimatorError, Update};
use super::window::Window;
use crate::config::{Config, DeformationSource, PositionSource};
use crate::message::{Cycle, Estimate, Mode, State};
use worm_physics::MAX_CELLS;

/// Steps of the gait without an accepted position after which the contact points are lost.
const MAX_BLIND_STEPS: f64 = 0.5;
/// Tracker periods that do not count as silence yet, however far the gait goes in them.
const SHORTEST_SILENCE_PERIODS: f64 = 2.5;

/// The totals at the start of the open cycle.
#[derive(Debug, Clone, Copy)]
struct CycleStart {
    time_s: f64,
    host_paused_ns: u64,
    electrical: Energies,
    forward_m: [f64; MAX_CELLS],
    backward_m: [f64; MAX_CELLS],
    loss_j: f64,
}

/// The estimator of one worm. Feed it every state in order; it tolerates gaps, repeats and invalid values.
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
    pace: Pace,
    host_paused_ns: u64, // as of the last state
    cycles: Cycles,
    electrical: Electrical,
    window: Window,
    window_contact_m: [f64; MAX_CELLS], // at the window's start, in the direction of the crawl
    window_is_complete: bool,           // the tracker was never silent in the open cycle
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
    last_seen: Option<(f64, f64)>, // time and phase of the last accepted position
    is_blind: bool,                // the tracker fell silent, and no position was accepted since
    first_mean_m: f64,             // mean position when it was first known
    entered: (f64, f64),           // fraction of the present step at which it was entered, and the cell's lead then
    estimate: Estimate,
    cycle: Cycle,
}

impl Estimator {
    /// An estimator for the configured worm. All memory is allocated here.
    ///
    /// # Errors
    /// [`EstimatorError`] for a configuration that [`Config::load`] would have refused.
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
            pace: Pace::new(config),
            host_paused_ns: 0,
            cycles: Cycles::new(config.gait.direction.sign() as i32),
            electrical: Electrical::new(config.winding()),
            window: Window::new(cells),
            window_contact_m: [f64::NAN; MAX_CELLS],
            window_is_complete: false,
            has_crawled: false,
            starts_at_rest: false,
            energy_integrator: EnergyIntegrator::new(cells, fit.unknowns()),
            fit,
            identification: identified.then(|| Identification::new(&tips)),
            mismatch: Mismatch::new(
                predictor.worm(),
                predictor.exact_worm(),
                config.alarms.model_mismatch.threshold,
            ),
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
            is_blind: false,
            first_mean_m: f64::NAN,
            entered: (f64::NAN, f64::NAN),
            estimate: match config.position_source() {
                PositionSource::Nothing => unknown::estimate_without_positions(cells),
                PositionSource::Tracker | PositionSource::TrackerWhileItLasts => unknown::estimate(cells),
            },
            cycle: unknown::cycle(cells),
            tips,
        };
        estimator.show_bounds();
        Ok(estimator)
    }

    /// The last estimate, for a heartbeat; positions are `NaN` before the first sample.
    pub fn latest(&self) -> &Estimate {
        &self.estimate
    }

    /// The residuals of the last cycles against the model; empty while the bounds are still being identified.
    pub fn residual_map(&self) -> &ResidualMap {
        self.mismatch.map()
    }

    /// Keeps the open cycle out of the residual map, because an alarm explains what is wrong with it.
    pub fn exclude_cycle(&mut self) {
        self.mismatch.disturb();
    }

    /// Whether the state is of a worm with as many cells as the configured one.
    ///
    /// # Errors
    /// [`EstimatorError::CellCount`] where it is not: [`update`](Self::update) ignores such a state.
    pub fn check(&self, state: &State) -> Result<(), EstimatorError> {
        if state.cell_count as usize == self.cells {
            Ok(())
        } else {
            Err(EstimatorError::CellCount {
                states: state.cell_count,
                configured: self.cells,
            })
        }
    }

    /// Processes one state. A state with another number of cells than the configured worm is ignored.
    pub fn update(&mut self, state: &State) -> Update<'_> {
        if self.check(state).is_err() {
            return Update {
                estimate: None,
                cycle: None,
            };
        }
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
            self.pace.note_sample(time_s);
            self.take_sample(state, time_s, motor_s);
        }
        if state.phase.is_finite() {
            if state.motor_is_new == 1 {
                self.capture.note_reading(motor_s, state.phase);
            }
            self.detect_silence(state.phase, time_s);
            self.last = Some((state.sequence, time_s, state.phase));
        } else if let Some((sequence, ..)) = &mut self.last {
            *sequence = state.sequence;
        }
        let unsampled = !sampled && state.phase.is_finite() && self.pace.is_due(time_s);
        if sampled {
            self.fill_estimate(state);
        } else if unsampled {
            self.fill_estimate_without_sample(state, time_s);
        }
        Update {
            estimate: (sampled || unsampled).then_some(&self.estimate),
            cycle: cycle_ended.then_some(&self.cycle),
        }
    }

    /// Counts lost states; starts over when the controller did.
    fn detect_restart(&mut self, state: &State, time_s: f64) {
        let Some((sequence, last_s, _)) = self.last else { return };
        if state.sequence > sequence && time_s >= last_s {
            let lost = state.sequence - sequence - 1;
            // The sequence may be anything; the total stays at its end rather than to begin again.
            self.estimate.states_lost = self.estimate.states_lost.saturating_add(lost);
            return;
        }
        self.filter.forget();
        self.motor_time.forget();
        self.capture.forget();
        self.pace.forget();
        self.cycles.forget();
        self.electrical.restart();
        self.mismatch.forget();
        self.last_seen = None;
        self.is_blind = false;
        self.last = None;
        self.lose_contacts();
    }

    fn lose_contacts(&mut self) {
        self.contacts.forget();
        self.window.clear();
        self.window_contact_m = [f64::NAN; MAX_CELLS];
        self.window_is_complete = false;
        // The start of the open step was not seen well enough to apply (1) at its end.
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
            self.is_blind = true;
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

    /// Starts a window here, with the present contact points.
    fn begin_window(&mut self) {
        self.window.clear();
        self.window_is_complete = !self.is_blind;
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

    fn show_bounds(&mut self) {
        for (to, tip) in self.estimate.max_deformation_m.iter_mut().zip(&self.tips) {
            *to = tip.bound_m;
        }
    }
}
