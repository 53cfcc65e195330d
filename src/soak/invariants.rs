//! What must hold in every tick, whatever happens to the worm.

use super::machine::Machine;
use super::session::{Session, Tick};
use crate::control::{Service, ServiceOutcome};
use worm_estimator::config::Config;
use worm_estimator::message::{Cycle, Fault, Mode, State};

/// After its last reason to turn, a motor with torque may take this long to stand, s: the servo's velocity loop brakes its inertia J with
/// b = k (P V + k)/R + c, so that the velocity falls at least as e^(−b t/2J). From the fastest crawl to standing that is
/// 2 · 0.0023/0.075 · ln(6.3/0.06) = 0.29 s for the heaviest rotor that is drawn.
const DECELERATION_S: f64 = 0.3;
/// Cam velocity below which the motor stands, rad/s.
const STANDING_RAD_S: f64 = 0.06;
/// How far the phase that is published may be from the true one, cycles: a count of the encoder, and the motion since the
/// reading.
const PHASE_TOLERANCE: f64 = 0.02;
/// Fastest crawl over the configured gait.
const MAX_SPEED: f64 = 1.25;
/// Rounding of the ramp.
const RAMP_TOLERANCE: f64 = 1e-6;
/// After an attempt that failed, torque is switched off again after this time, s.
const RETRY_S: f64 = 0.5;
/// How long the cam may take to come to rest after the ramp, s.
const SETTLING_S: f64 = 0.5;
/// How far a holding worm may be from where it came to rest, cycles.
const HOLD_TOLERANCE: f64 = 0.02;

/// What is true at the end of a tick, and no controller can know.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    /// Velocity of the cam, rad/s.
    pub velocity_rad_s: f64,
    /// Gait phase, cycles.
    pub phase: f64,
    /// How long the worm's world has stood still, ns.
    pub stood_ns: u64,
    /// Whether the servo's torque is on.
    pub torque_is_on: bool,
}

impl Truth {
    /// The truth of a session as it stands.
    pub fn of<M: Machine>(session: &mut Session<M>) -> Self {
        let stood_ns = session.stood_ns();
        let plant = session.machine.plant();
        Self {
            velocity_rad_s: plant.motor().velocity_rad_per_s(),
            phase: plant.body().phase(),
            stood_ns,
            torque_is_on: plant.torque_is_on(),
        }
    }
}

/// A rule that was broken.
#[derive(Debug, Clone, PartialEq)]
pub struct Broken {
    /// The rule.
    pub rule: &'static str,
    /// How.
    pub text: String,
}

/// The rules, with what they remember from tick to tick.
#[derive(Debug, Clone)]
pub struct Invariants {
    acceleration_rad_s2: f64,
    /// Fastest crawl that is commanded here, cycles per second.
    max_cycles_per_s: f64,
    tick_s: f64,
    watchdog_s: f64,
    last: Option<State>,
    /// When the motor lost its last reason to turn, s.
    resting_since_s: Option<f64>,
    /// How long it may turn after that, s.
    may_turn_s: f64,
    /// Since when torque is on, s: it may come on while the worm turns the cam.
    powered_since_s: Option<f64>,
    stood_ns: u64,
    /// Ticks in a row in which torque was on though a fault is latched.
    torque_ticks: u32,
    /// How many of these there may be: more while attempts to switch it off fail.
    max_torque_ticks: u32,
    /// Ticks in a row with an answer of the servo.
    answered_ticks: u32,
    /// Ticks in the present mode.
    mode_ticks: u32,
    /// Gait phase at which a hold came to rest, cycles.
    hold_phase: Option<f64>,
    /// The longest ramp, s.
    ramp_s: f64,
    /// Servo readings in a row without a miss.
    answers: u32,
    /// A reset was accepted since the worm stood in a fault for the last time: a new reason may take the place of the old one.
    was_reset: bool,
    /// By how much the virtual worm's clock was ahead of the servo's at the least since torque came on, s.
    clock_offset_s: f64,
    /// Difference of the published phase from the true one, cycles, as first seen.
    phase_offset: Option<f64>,
}

/// Torque may be on for so many ticks after a fault is seen.
const TWO_TICKS: u32 = 2;

/// The latched reason of a fault.
fn reason(state: &State) -> (u32, u32) {
    (state.fault, state.fault_alarm)
}

impl Invariants {
    /// For a worm whose controller has not ticked yet.
    pub fn new(config: &Config) -> Self {
        let gait_rad_s = config.gait_cycles_per_s().abs() * std::f64::consts::TAU;
        Self {
            acceleration_rad_s2: gait_rad_s / config.gait.ramp_s,
            max_cycles_per_s: MAX_SPEED * config.gait_cycles_per_s().abs(),
            tick_s: 1.0 / config.control.rate_hz,
            watchdog_s: f64::from(config.servo.watchdog_ms) * 1e-3,
            last: None,
            resting_since_s: None,
            may_turn_s: 0.0,
            powered_since_s: None,
            stood_ns: 0,
            torque_ticks: 0,
            max_torque_ticks: TWO_TICKS,
            answered_ticks: 0,
            mode_ticks: 0,
            hold_phase: None,
            ramp_s: MAX_SPEED * config.gait.ramp_s,
            answers: 0,
            was_reset: false,
            clock_offset_s: f64::INFINITY,
            phase_offset: None,
        }
    }

    /// A reset was accepted in the next tick that is looked at.
    pub fn note_reset(&mut self) {
        self.was_reset = true;
    }

    /// Holds a tick against the rules; the first one that it breaks.
    pub fn look(&mut self, tick: &Tick, truth: &Truth) -> Option<Broken> {
        let state = &tick.state;
        let same_mode = self.last.is_some_and(|last| last.mode == state.mode);
        self.mode_ticks = if same_mode {
            self.mode_ticks.saturating_add(1)
        } else {
            0
        };
        let broken = self
            .sequence(state)
            .or_else(|| self.first_reason(state))
            .or_else(|| self.goal(state, tick.goal_counts))
            .or_else(|| self.ramp(state))
            .or_else(|| self.stopping(state))
            .or_else(|| self.torque(tick, truth))
            .or_else(|| self.hold(state, truth))
            .or_else(|| self.rest(tick, truth))
            .or_else(|| self.phase(tick, truth));
        if state.mode != Mode::Fault.code() || self.last.is_some_and(|last| reason(&last) != reason(state)) {
            self.was_reset = false;
        }
        self.last = Some(*state);
        broken
    }

    /// Holds a finished cycle against the rules. NaN says that an energy is not known, which is no surprise while a fault hides
    /// the positions, but is one in a settled cycle of an undisturbed worm.
    pub fn look_at_cycle(cycle: &Cycle, undisturbed: bool) -> Option<Broken> {
        let must_be_known = undisturbed && cycle.settled == 1;
        let energies = [
            cycle.energy_loss_j,
            cycle.energy_actuator_net_j,
            cycle.energy_actuator_positive_j,
            cycle.energy_electrical_j,
            cycle.energy_copper_j,
            cycle.energy_friction_inside_j,
            cycle.duration_s,
        ];
        let is_wrong = |energy: &f64| energy.is_infinite() || (must_be_known && energy.is_nan());
        energies.iter().any(is_wrong).then(|| Broken {
            rule: "energies are finite",
            text: format!("cycle {}: {energies:?}", cycle.index),
        })
    }

    fn sequence(&self, state: &State) -> Option<Broken> {
        let last = self.last.as_ref()?;
        let is_next = state.sequence == last.sequence + 1 && state.time_ns > last.time_ns;
        (!is_next).then(|| Broken {
            rule: "states have no gap",
            text: format!(
                "state {} at {} ns after {} at {} ns",
                state.sequence, state.time_ns, last.sequence, last.time_ns
            ),
        })
    }

    fn first_reason(&self, state: &State) -> Option<Broken> {
        let last = self.last.as_ref()?;
        let stays = last.mode == Mode::Fault.code() && state.mode == Mode::Fault.code();
        // The same event, known better: when the servo answers again, it turns out why it was silent.
        let is_explained = last.fault == Fault::LinkLost.code() && state.fault == Fault::ServoRestarted.code();
        (stays && !is_explained && !self.was_reset && reason(last) != reason(state)).then(|| Broken {
            rule: "the first reason is kept",
            text: format!("{:?} became {:?}", reason(last), reason(state)),
        })
    }

    fn goal(&self, state: &State, goal_counts: i32) -> Option<Broken> {
        let mode = Mode::try_from(state.mode).ok()?;
        let must_rest = matches!(mode, Mode::Disarmed | Mode::Armed | Mode::Fault);
        (must_rest && goal_counts != 0).then(|| Broken {
            rule: "no goal but 0 unless the worm is to move",
            text: format!("{goal_counts} counts while {mode}"),
        })
    }

    /// The commanded velocity follows the ramp: it never jumps to what it was before a fault or a rest.
    fn ramp(&self, state: &State) -> Option<Broken> {
        let last = self.last.as_ref()?;
        let ramps = |state: &State| [Mode::Crawling.code(), Mode::Stopping.code()].contains(&state.mode);
        let rests =
            |state: &State| [Mode::Disarmed.code(), Mode::Armed.code(), Mode::Fault.code()].contains(&state.mode);
        if !ramps(state) || !(ramps(last) || rests(last)) {
            return None;
        }
        let from_rad_s = if rests(last) { 0.0 } else { last.goal_velocity_rad_s };
        let dt_s = (state.time_ns - last.time_ns) as f64 * 1e-9;
        let jump_rad_s = (state.goal_velocity_rad_s - from_rad_s).abs();
        (jump_rad_s > self.acceleration_rad_s2 * dt_s + RAMP_TOLERANCE).then(|| Broken {
            rule: "the goal follows the ramp",
            text: format!("from {from_rad_s} to {} rad/s in {dt_s} s", state.goal_velocity_rad_s),
        })
    }

    /// How many ticks take this long.
    fn ticks(&self, seconds: f64) -> u32 {
        (seconds / self.tick_s).ceil() as u32
    }

    /// A worm that stops becomes slower until it stands, and never faster; then torque goes off.
    fn stopping(&self, state: &State) -> Option<Broken> {
        let last = self.last.as_ref()?;
        if state.mode != Mode::Stopping.code() {
            return None;
        }
        if self.mode_ticks > self.ticks(self.ramp_s + SETTLING_S) + TWO_TICKS {
            return Some(Broken {
                rule: "a stop ends with torque off",
                text: format!("still stopping after {} ticks", self.mode_ticks),
            });
        }
        let (from_rad_s, to_rad_s) = (last.goal_velocity_rad_s.abs(), state.goal_velocity_rad_s.abs());
        let for_long = self.mode_ticks > self.ticks(self.ramp_s) + TWO_TICKS;
        (to_rad_s > from_rad_s + RAMP_TOLERANCE || (for_long && to_rad_s > 0.0)).then(|| Broken {
            rule: "the goal falls while the worm stops",
            text: format!(
                "from {from_rad_s} to {to_rad_s} rad/s, {} ticks after the stop",
                self.mode_ticks
            ),
        })
    }

    /// Torque is off in mode `disarmed`, and in a fault within two ticks; services take place between ticks. An attempt that fails is
    /// made again after [`RETRY_S`], but only a servo that misses answers is an excuse for failing.
    fn torque(&mut self, tick: &Tick, truth: &Truth) -> Option<Broken> {
        let state = &tick.state;
        let retry_ticks = self.ticks(RETRY_S) + TWO_TICKS;
        self.answered_ticks = if state.motor_is_new == 1 {
            self.answered_ticks.saturating_add(1)
        } else {
            0
        };
        let arms = matches!(
            tick.service,
            Some(ServiceOutcome::Done(Service::Arm) | ServiceOutcome::Failed(Service::Arm))
        );
        let is_disarmed = state.mode == Mode::Disarmed.code();
        if arms || !truth.torque_is_on || !(is_disarmed || state.mode == Mode::Fault.code()) {
            (self.torque_ticks, self.max_torque_ticks) = (0, TWO_TICKS);
            return None;
        }
        self.torque_ticks = self.torque_ticks.saturating_add(1);
        if tick.service == Some(ServiceOutcome::Failed(Service::Disarm)) {
            self.max_torque_ticks = self.torque_ticks.saturating_add(retry_ticks);
        }
        let answers_all_along = self.answered_ticks.min(self.torque_ticks) > retry_ticks;
        (is_disarmed || self.torque_ticks > self.max_torque_ticks || answers_all_along).then(|| Broken {
            rule: "torque is off in a fault and while disarmed",
            text: format!(
                "on in mode {} (fault {}) for {} ticks, {} at most",
                state.mode, state.fault, self.torque_ticks, self.max_torque_ticks
            ),
        })
    }

    /// A worm that holds stays where it came to rest.
    fn hold(&mut self, state: &State, truth: &Truth) -> Option<Broken> {
        if state.mode != Mode::Holding.code() {
            self.hold_phase = None;
            return None;
        }
        if self.mode_ticks < self.ticks(self.ramp_s + SETTLING_S) {
            return None;
        }
        let rest = *self.hold_phase.get_or_insert(truth.phase);
        ((truth.phase - rest).abs() > HOLD_TOLERANCE).then(|| Broken {
            rule: "a hold keeps the cam where it rests",
            text: format!("phase {:.4} instead of {rest:.4}", truth.phase),
        })
    }

    /// Without a torque command, and in a fault, the motor stands: two ticks, the servo's deceleration and, if the servo cannot be
    /// reached, its own watchdog after the last reason to turn. A motor without torque runs out, and the worm itself may turn it: its
    /// tips push the cam with up to 13 mN m, and the gears hold 9. So this holds for a motor with torque.
    fn rest(&mut self, tick: &Tick, truth: &Truth) -> Option<Broken> {
        let state = &tick.state;
        let now_s = (state.time_ns - truth.stood_ns.min(state.time_ns)) as f64 * 1e-9;
        let powered_since_s = match self.powered_since_s {
            Some(since_s) if truth.torque_is_on && tick.service.is_none() => since_s,
            _ => now_s,
        };
        // Arming switches torque off and on again, and takes some tenths of a second after the reading: what counts begins with the next one.
        self.powered_since_s = (truth.torque_is_on && tick.service.is_none()).then_some(powered_since_s);
        let may_turn = [Mode::Crawling.code(), Mode::Holding.code(), Mode::Stopping.code()].contains(&state.mode);
        if may_turn {
            self.resting_since_s = None;
            return None;
        }
        let since_s = match self.resting_since_s {
            Some(since_s) => since_s,
            None => {
                let reachable = state.motor_is_new == 1
                    && ![
                        Fault::LinkLost,
                        Fault::HostPaused,
                        Fault::WatchdogTripped,
                        Fault::ServoRestarted,
                    ]
                    .iter()
                    .any(|fault| state.fault == fault.code());
                self.may_turn_s = 2.0 * self.tick_s + DECELERATION_S + if reachable { 0.0 } else { self.watchdog_s };
                self.resting_since_s = Some(now_s);
                now_s
            }
        };
        let moves = truth.torque_is_on && truth.velocity_rad_s.abs() > STANDING_RAD_S;
        (moves && now_s - since_s.max(powered_since_s) > self.may_turn_s).then(|| Broken {
            rule: "the motor stands when nothing commands it",
            text: format!(
                "{:.3} rad/s in mode {} (fault {}) after {:.3} s",
                truth.velocity_rad_s,
                state.mode,
                state.fault,
                now_s - since_s
            ),
        })
    }

    /// The published phase is the true one, but for the whole cycles that the servo had forgotten before it was first heard.
    fn phase(&mut self, tick: &Tick, truth: &Truth) -> Option<Broken> {
        let state = &tick.state;
        if tick.service.is_some() {
            // A service takes some tenths of a second after the reading, and loaded tips may turn the cam meanwhile.
            return None;
        }
        if state.motor_is_new == 0 || truth.stood_ns != self.stood_ns {
            (self.answers, self.stood_ns) = (0, truth.stood_ns);
            return None;
        }
        self.answers = self.answers.saturating_add(1);
        if self.answers < 3 || state.phase.is_nan() {
            return None;
        }
        let offset = state.phase - truth.phase;
        let known = *self.phase_offset.get_or_insert(offset);
        // A late answer is right for the moment at which it was given.
        if state.mode == Mode::Armed.code() {
            self.clock_offset_s = f64::INFINITY;
        }
        let ahead_s = (state.time_ns - truth.stood_ns.min(state.time_ns)) as f64 * 1e-9 - state.motor_time_s;
        self.clock_offset_s = self.clock_offset_s.min(ahead_s);
        let age_s = 2.0 * self.tick_s + (ahead_s - self.clock_offset_s);
        let tolerance = PHASE_TOLERANCE + age_s * self.max_cycles_per_s;
        ((offset - known).abs() > tolerance).then(|| Broken {
            rule: "the phase is continuous",
            text: format!(
                "published {:.4}, true {:.4}, {known:.4} apart before; the cam turns with {:.3} rad/s, the answer is {age_s:.4} s old",
                state.phase, truth.phase, truth.velocity_rad_s
            ),
        })
    }
}

#[cfg(test)]
mod tests;
