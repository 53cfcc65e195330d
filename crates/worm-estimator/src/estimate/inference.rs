//! Self-sensing on a worm's states: what the estimator process runs, a replay, and `wormd infer`.
//!
//! [`SelfSensing`] gets the reading of every state that has one, and nothing else. This adds what a running worm has besides: a controller
//! that starts anew, positions and marks that correct the dead reckoning, and the message of the topic `inferred`.
//!
//! **Marks** come with the records of commands. When a record reaches the estimator is chance, so a mark counts from the state on that
//! follows the command by [`MARK_DELAY_TICKS`]: live and in a replay the same one. What the worm has crawled since is added to it. One that is further
//! off than [`CONTRADICTING_SIGMAS`] is counted as contradicting, so that whoever gave it is told.
//!
//! **Positions** count once a cycle, at its end, where the newest sample is no older than [`FRESH_S`]: within a cycle the mean of the cells
//! does not move evenly, and the dead reckoning does not know that. The first one says where the worm begins.

use super::EstimatorError;
use crate::config::{Config, PhysicsError};
use crate::message::{CommandKind, CommandOutcome, CommandRecord, FieldAccess, Inferred, InferredStanding, State};
use crate::self_sensing::{Mark, MotorSample, SelfSensed, SelfSensing};
use worm_physics::Worm;

/// Ticks between a command and the state with which its mark counts: longer than a record is on its way.
const MARK_DELAY_TICKS: u64 = 100;
/// Marks that may wait: as many commands as a late joiner gets.
const MAX_WAITING: usize = 32;
/// Age of a tracker sample up to which it says where the worm is, s.
const FRESH_S: f64 = 0.1;
/// Standard error of a tracker's mean position as the end of a cycle, m: its age, and cells that have not come to rest.
const TRACKER_SIGMA_M: f64 = 3e-4;

/// Standard errors from which on a mark contradicts the dead reckoning, and with it the marks before.
const CONTRADICTING_SIGMAS: f64 = 3.0;

/// A mark that waits for its state.
#[derive(Debug, Clone, Copy)]
struct WaitingMark {
    state_sequence: u64,
    phase: f64,
    mark: Mark,
}

/// Of the state before.
#[derive(Debug, Clone, Copy)]
struct LastState {
    sequence: u64,
    time_ns: u64,
    /// Gait phase, the last that was known.
    phase: f64,
}

/// Self-sensing on a worm's states.
#[derive(Debug, Clone)]
pub struct Inference {
    sensing: SelfSensing,
    uses_positions: bool,
    first_sequence: Option<u64>,
    last: Option<LastState>,
    sample: Option<(u64, f64)>, // time, ns, and mean position, m, of the newest tracker sample with all cells
    is_placed: bool,            // a sample has said where the worm begins
    waiting: [Option<WaitingMark>; MAX_WAITING],
    made: u64,
    marks: u32,
    contradicting_marks: u32,
    tracker_marks: u32,
    inferred: Inferred,
}

impl Inference {
    /// For the configured worm, whether or not `self_sensing.enabled` says so.
    ///
    /// # Errors
    /// [`EstimatorError`] where the model refuses the worm.
    pub fn new(config: &Config) -> Result<Self, EstimatorError> {
        let worm = Worm::try_from(config).map_err(PhysicsError::from)?;
        Ok(Self {
            sensing: SelfSensing::new(&worm, &config.self_sensing()),
            uses_positions: true,
            first_sequence: None,
            last: None,
            sample: None,
            is_placed: false,
            waiting: [None; MAX_WAITING],
            made: 0,
            marks: 0,
            contradicting_marks: 0,
            tracker_marks: 0,
            inferred: nothing_known(worm.cells()),
        })
    }

    /// Without a look at positions.
    pub fn by_current_alone(config: &Config) -> Result<Self, EstimatorError> {
        Ok(Self {
            uses_positions: false,
            ..Self::new(config)?
        })
    }

    /// Takes a command that the controller answered. All but marks are ignored, and those from before the first state.
    pub fn note_command(&mut self, record: &CommandRecord) {
        let is_mark = record.kind == CommandKind::Mark.code() && record.outcome == CommandOutcome::Accepted.code();
        let is_known = self.first_sequence.is_none_or(|first| record.state_sequence >= first);
        let is_finite = [record.phase, record.position_m, record.position_sigma_m]
            .iter()
            .all(|value| value.is_finite());
        if !(is_mark && is_known && is_finite) {
            return;
        }
        let waiting = WaitingMark {
            state_sequence: record.state_sequence,
            phase: record.phase,
            mark: Mark {
                position_m: record.position_m,
                sigma_m: record.position_sigma_m,
            },
        };
        if let Some(free) = self.waiting.iter_mut().find(|place| place.is_none()) {
            *free = Some(waiting);
        }
    }

    /// Takes the controller's next state. Returns what is known where something new is: after a cycle once it is fitted, or at its end where it
    /// is not, after a mark, and with the first state.
    pub fn update(&mut self, state: &State) -> Option<&Inferred> {
        let is_first = self.first_sequence.is_none();
        let has_restarted = self.last.is_some_and(|last| state.sequence <= last.sequence);
        if is_first || has_restarted {
            self.first_sequence = Some(state.sequence);
            for place in &mut self.waiting {
                place.take_if(|waiting| waiting.state_sequence < state.sequence);
            }
        }
        if has_restarted {
            self.sensing.interrupt();
            self.waiting = [None; MAX_WAITING];
            self.sample = None;
            self.last = None;
        }
        let mut is_new = is_first;
        if state.motor_is_new == 1
            && let Some(sensed) = self.sensing.update(&MotorSample::from(state))
        {
            fill(&mut self.inferred, sensed);
            is_new = true;
        }
        let ends_cycle = self
            .last
            .is_some_and(|last| state.phase.is_finite() && last.phase.floor() != state.phase.floor());
        if self.uses_positions {
            self.take_position(state, ends_cycle);
        }
        is_new |= self.take_marks(state);
        // One backward, or one with a rest: where the worm is now is known all the same.
        is_new |= ends_cycle && !self.sensing.is_at_work();
        let phase = if state.phase.is_finite() {
            state.phase
        } else {
            self.last.map_or(f64::NAN, |last| last.phase)
        };
        let last = LastState {
            sequence: state.sequence,
            time_ns: state.time_ns,
            phase,
        };
        self.last = Some(last);
        is_new.then(|| self.message(last))
    }

    /// Does the work that is left at the end of a recording. Returns what is known, where that is new.
    pub fn finish(&mut self) -> Option<&Inferred> {
        let sensed = self.sensing.finish()?;
        fill(&mut self.inferred, sensed);
        self.last.map(|last| self.message(last))
    }

    /// Where the worm is with the last state, and how the message is numbered.
    fn message(&mut self, last: LastState) -> &Inferred {
        let reckoned = self.sensing.reckoned();
        // What the samples at the ends of cycles are off by is much the same each time, so it is no smaller for many of them.
        let of_tracker_m = if self.tracker_marks > 0 { TRACKER_SIGMA_M } else { 0.0 };
        let inferred = &mut self.inferred;
        inferred.position_m = reckoned.position_m;
        inferred.position_sigma_m = reckoned.sigma_m.hypot(of_tracker_m);
        inferred.sequence = self.made;
        inferred.time_ns = last.time_ns;
        inferred.state_sequence = last.sequence;
        inferred.phase = last.phase;
        inferred.marks = self.marks;
        inferred.contradicting_marks = self.contradicting_marks;
        inferred.tracker_marks = self.tracker_marks;
        self.made += 1;
        inferred
    }

    /// The newest message.
    pub fn latest(&self) -> &Inferred {
        &self.inferred
    }

    /// What self-sensing knows beyond the message.
    pub fn sensing(&self) -> &SelfSensing {
        &self.sensing
    }

    fn take_position(&mut self, state: &State, ends_cycle: bool) {
        let cells = state.cell_count as usize;
        if state.sample_is_new == 1 {
            let positions_m = state.position_m.get(..cells).unwrap_or_default();
            let mean_m = positions_m.iter().sum::<f64>() / cells as f64;
            if mean_m.is_finite() {
                self.sample = Some((state.time_ns, mean_m));
            }
        }
        let Some((time_ns, mean_m)) = self.sample else { return };
        let mark = Mark {
            position_m: mean_m,
            sigma_m: TRACKER_SIGMA_M,
        };
        if !self.is_placed {
            self.is_placed = true;
            self.sensing.place(&mark);
            return;
        }
        let age_s = state.time_ns.saturating_sub(time_ns) as f64 * 1e-9;
        if ends_cycle && age_s < FRESH_S {
            self.tracker_marks = self.tracker_marks.saturating_add(1);
            self.sensing.mark(&mark);
        }
    }

    /// Marks whose state this is.
    fn take_marks(&mut self, state: &State) -> bool {
        let mut is_new = false;
        for place in &mut self.waiting {
            let is_due = |waiting: &WaitingMark| {
                state.phase.is_finite() && state.sequence >= waiting.state_sequence.saturating_add(MARK_DELAY_TICKS)
            };
            let Some(WaitingMark { phase, mark, .. }) = place.take_if(|waiting| is_due(waiting)) else {
                continue;
            };
            let since_m = self.sensing.crawled_m(state.phase - phase);
            let off = self.sensing.mark(&Mark {
                position_m: mark.position_m + since_m,
                sigma_m: mark.sigma_m,
            });
            // Where a worm began that no tracker sees is 0 by definition, until the first mark says it.
            let says_where_it_began = self.marks == 0 && !self.is_placed;
            self.marks = self.marks.saturating_add(1);
            if !says_where_it_began {
                let contradicts = u32::from(off.sigmas() > CONTRADICTING_SIGMAS);
                self.contradicting_marks = self.contradicting_marks.saturating_add(contradicts);
                (self.inferred.mark_off_m, self.inferred.mark_off_sigma_m) = (off.ahead_m, off.sigma_m);
            }
            is_new = true;
        }
        is_new
    }
}

/// Before the first cycle: where the worm begins is 0 by definition, and everything else is open.
fn nothing_known(cells: usize) -> Inferred {
    const UNKNOWN: f64 = f64::NAN;
    Inferred {
        cell_count: cells as u32,
        standing: InferredStanding::WarmingUp.code(),
        end_phase: UNKNOWN,
        pull_n: UNKNOWN,
        pull_sigma_n: UNKNOWN,
        slope_rad: UNKNOWN,
        slope_sigma_rad: UNKNOWN,
        other_pull_n: UNKNOWN,
        other_probability: UNKNOWN,
        advance_m: UNKNOWN,
        advance_sigma_m: UNKNOWN,
        energy_loss_j: UNKNOWN,
        energy_loss_sigma_j: UNKNOWN,
        energy_actuator_net_j: UNKNOWN,
        energy_actuator_net_sigma_j: UNKNOWN,
        energy_electrical_j: UNKNOWN,
        energy_electrical_sigma_j: UNKNOWN,
        residual_n_m: UNKNOWN,
        phase: UNKNOWN,
        friction_loss_share: UNKNOWN,
        load_rise_n: UNKNOWN,
        change_friction_sigma: UNKNOWN,
        change_pull_sigma_n: UNKNOWN,
        slide_sigma_m: UNKNOWN,
        friction_loss_sigma: UNKNOWN,
        load_rise_sigma_n: UNKNOWN,
        mark_off_m: UNKNOWN,
        mark_off_sigma_m: UNKNOWN,
        ..Inferred::empty()
    }
}

fn fill(inferred: &mut Inferred, sensed: &SelfSensed) {
    let (figures, sigma, changes, armed) = (&sensed.figures, &sensed.figures_sigma, &sensed.changes, &sensed.armed);
    let known = |is_known: bool, value: f64| if is_known { value } else { f64::NAN };
    inferred.end_ns = sensed.end_ns;
    inferred.end_phase = sensed.end_phase;
    inferred.cycles = sensed.cycles;
    inferred.friction_n = sensed.friction_n;
    inferred.friction_sigma_n = sensed.friction_sigma_n;
    inferred.stiffness_n_per_m = sensed.stiffness_n_per_m;
    inferred.stiffness_sigma_n_per_m = sensed.stiffness_sigma_n_per_m;
    inferred.forward_slide_m = figures.forward_slide_m;
    inferred.backward_slide_m = figures.backward_slide_m;
    let of_slides = sigma.forward_slide_m.iter().chain(&sigma.backward_slide_m);
    inferred.slide_sigma_m = of_slides.copied().fold(0.0, f64::max);
    inferred.pull_n = sensed.pull_n;
    inferred.pull_sigma_n = sensed.pull_sigma_n;
    inferred.slope_rad = sensed.slope_rad;
    inferred.slope_sigma_rad = sensed.slope_sigma_rad;
    inferred.slope_is_measured = sensed.slope_is_measured.into();
    (inferred.other_pull_n, inferred.other_probability) = sensed.blind.other_pull.unwrap_or((f64::NAN, f64::NAN));
    inferred.advance_m = figures.advance_m;
    inferred.advance_sigma_m = sigma.advance_m;
    inferred.energy_loss_j = figures.energy_loss_j;
    inferred.energy_loss_sigma_j = sigma.energy_loss_j;
    inferred.energy_actuator_net_j = figures.energy_net_j;
    inferred.energy_actuator_net_sigma_j = sigma.energy_net_j;
    inferred.energy_electrical_j = sensed.electrical_j;
    inferred.energy_electrical_sigma_j = sensed.electrical_sigma_j;
    inferred.residual_n_m = sensed.residual_n_m;
    inferred.friction_loss_share = known(changes.friction_lost != 0, changes.loss_share);
    inferred.friction_loss_sigma = known(changes.friction_lost != 0, changes.loss_sigma);
    inferred.load_rise_n = known(changes.any(), changes.load_rise_n);
    inferred.load_rise_sigma_n = known(changes.any(), changes.load_rise_sigma_n);
    inferred.change_friction_sigma = known(armed.friction != 0, armed.friction_sigma);
    inferred.change_pull_sigma_n = known(armed.load, armed.pull_sigma_n);
    inferred.friction_lost_mask = changes.friction_lost.into();
    inferred.jammed_mask = changes.jammed.into();
    inferred.more_load = changes.more_load.into();
    inferred.friction_armed_mask = armed.friction.into();
    inferred.jam_armed_mask = armed.jammed.into();
    inferred.load_armed = armed.load.into();
    inferred.standing = InferredStanding::from(sensed.standing).code();
}
