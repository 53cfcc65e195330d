//! The motion of the cam: the gait phase, its direction, whether it stands still, and whether its speed is steady.
//!
//! All detectors use it. Direction and rest are taken from the encoder, not from the mode, so a back-off or a cam turned by hand is seen
//! for what it is.

use crate::config::Config;
use crate::estimate::MotorTime;
use crate::message::{Mode, State};

/// Goal velocity of one count, turns/s: 0.229 rev/min (XL330-M288 e-manual, register 104).
pub(super) const GOAL_UNIT_TURNS_PER_S: f64 = 0.229 / 60.0;

/// The cam stands still while it stays this near to one angle, turns, …
const REST_BAND_TURNS: f64 = 0.003;
/// … for at least this long, s.
const REST_TIME_S: f64 = 0.3;
/// The direction has changed when the cam went back by this much, turns: more than a hold gives way.
const REVERSAL_TURNS: f64 = 0.02;
/// The commanded speed is steady after this long without a change, s.
const STEADY_TIME_S: f64 = 0.3;
/// Changes of the commanded speed below this fraction are the controller's trimming, …
const STEADY_FRACTION: f64 = 0.03;
/// … and so are changes below this part of a register count.
const STEADY_UNITS: f64 = 0.3;
/// A steady speed that differs from the regime's by more than this fraction makes a new regime.
const REGIME_FRACTION: f64 = 0.05;
/// Longest time step that is integrated, s: beyond it states were lost or the controller paused.
const LONGEST_STEP_S: f64 = 1.0;
/// Lowest fraction of the configured rate at which the loop ticks: see `control.adapt_rate`.
pub(super) const MIN_RATE_FRACTION: f64 = 0.125;
/// A tick that takes longer than this is none that was merely late, s: it ended with a service, such as arming.
const SHORTEST_SERVICE_S: f64 = 0.01;

/// One tick, as the detectors need it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tick {
    pub now_ns: u64,
    /// Since the previous tick, s; 0 in the first one and after a restart.
    pub step_s: f64,
    /// The part of it in which the devices could be heard, s: in which the computer did not pause, and no service of the servo (such as
    /// arming, 0.3 s) kept the controller from asking.
    pub present_s: f64,
    /// Motor time since the last reading before this tick, s: less than the time that passed where a simulated motor stood still with
    /// its computer.
    pub motor_s: f64,
    /// The controller restarted: its sequence went back.
    pub restarted: bool,
    /// Gait phase, cycles; `None` before it was read.
    pub phase: Option<f64>,
    /// The phase was read in this tick.
    pub phase_is_new: bool,
    /// Commanded cam speed, turns/s, signed.
    pub goal_turns_per_s: f64,
    /// The motor holds or turns the cam.
    pub torque: bool,
    /// Commanded to crawl at a speed that has not changed for a while.
    pub steady: bool,
    /// The cam stands and is not commanded to crawl.
    pub still: bool,
    /// Direction in which the cam last turned, +1 or −1.
    pub direction: f64,
    /// Grows whenever the direction changes.
    pub reversals: u32,
    /// Grows whenever the worm crawls steadily at another speed or in another direction than before.
    pub regime: u32,
    /// Speed of the regime, cycles/s, signed; the configured one before the first.
    pub regime_cycles_per_s: f64,
}

/// Follows the cam from tick to tick.
#[derive(Debug, Clone)]
pub(super) struct CamMotion {
    longest_tick_s: f64,
    last: Option<(u64, u64)>, // sequence and time of the last tick
    motor_time: MotorTime,
    read_ns: Option<u64>, // motor time of the last motor reading
    host_paused_ns: u64,
    phase: Option<f64>,
    rest_phase: f64,
    rest_s: f64,
    direction: f64,
    furthest_phase: f64, // in the present direction
    reversals: u32,
    goal_reference: f64,
    steady_s: f64,
    regime: u32,
    regime_cycles_per_s: f64,
}

impl CamMotion {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            longest_tick_s: SHORTEST_SERVICE_S.max(1.0 / (MIN_RATE_FRACTION * config.control.rate_hz)),
            last: None,
            motor_time: MotorTime::default(),
            read_ns: None,
            host_paused_ns: 0,
            phase: None,
            rest_phase: f64::NAN,
            rest_s: 0.0,
            direction: config.gait.direction.sign(),
            furthest_phase: f64::NAN,
            reversals: 0,
            goal_reference: 0.0,
            steady_s: 0.0,
            regime: 0,
            regime_cycles_per_s: config.gait_cycles_per_s(),
        }
    }

    pub(super) fn update(&mut self, state: &State) -> Tick {
        let restarted = self
            .last
            .is_some_and(|(sequence, time_ns)| state.sequence < sequence || state.time_ns < time_ns);
        let step_s = match self.last {
            Some((_, time_ns)) if !restarted => state.time_ns.saturating_sub(time_ns) as f64 * 1e-9,
            _ => 0.0,
        }
        .min(LONGEST_STEP_S);
        let ticks = match self.last {
            Some((sequence, _)) => state.sequence.saturating_sub(sequence).max(1),
            None => 1,
        };
        self.last = Some((state.sequence, state.time_ns));
        let motor_ns = self.motor_time.update(state);
        let seconds_since = |then_ns: u64, now_ns: u64| now_ns.saturating_sub(then_ns) as f64 * 1e-9;
        let motor_s = self.read_ns.map_or(0.0, |read_ns| seconds_since(read_ns, motor_ns));
        if state.motor_is_new == 1 {
            self.read_ns = Some(motor_ns);
        }
        let paused_s = seconds_since(
            std::mem::replace(&mut self.host_paused_ns, state.host_paused_ns),
            state.host_paused_ns,
        );
        let mode = Mode::try_from(state.mode).ok();
        let crawling = mode == Some(Mode::Crawling);
        let torque = matches!(
            mode,
            Some(Mode::Armed | Mode::Crawling | Mode::Holding | Mode::Stopping)
        );
        let goal = finite_or_zero(state.goal_velocity_rad_s) / std::f64::consts::TAU;
        let phase_is_new = state.motor_is_new != 0 && state.phase.is_finite() && state.phase.abs() < 1e12;
        if phase_is_new {
            self.follow_phase(state.phase);
        }
        self.rest_s = if self.phase.is_some_and(|phase| !self.is_at_rest_phase(phase)) {
            self.rest_phase = self.phase.unwrap_or(f64::NAN);
            0.0
        } else {
            self.rest_s + step_s
        };
        self.follow_goal(goal, crawling, step_s);
        Tick {
            now_ns: state.time_ns,
            step_s,
            present_s: (step_s - paused_s).clamp(0.0, ticks as f64 * self.longest_tick_s),
            motor_s,
            restarted,
            phase: self.phase,
            phase_is_new,
            goal_turns_per_s: goal,
            torque,
            steady: crawling && self.steady_s >= STEADY_TIME_S,
            still: !crawling && self.rest_s >= REST_TIME_S,
            direction: self.direction,
            reversals: self.reversals,
            regime: self.regime,
            regime_cycles_per_s: self.regime_cycles_per_s,
        }
    }

    fn is_at_rest_phase(&self, phase: f64) -> bool {
        (phase - self.rest_phase).abs() <= REST_BAND_TURNS
    }

    fn follow_phase(&mut self, phase: f64) {
        self.phase = Some(phase);
        let ahead = (phase - self.furthest_phase) * self.direction;
        if ahead >= 0.0 || self.furthest_phase.is_nan() {
            self.furthest_phase = phase;
        } else if ahead < -REVERSAL_TURNS {
            self.direction = -self.direction;
            self.reversals = self.reversals.wrapping_add(1);
            self.furthest_phase = phase;
        }
    }

    fn follow_goal(&mut self, goal: f64, crawling: bool, step_s: f64) {
        let trim = (STEADY_FRACTION * self.goal_reference.abs()).max(STEADY_UNITS * GOAL_UNIT_TURNS_PER_S);
        if !crawling || (goal - self.goal_reference).abs() > trim || goal.abs() < 0.5 * GOAL_UNIT_TURNS_PER_S {
            self.goal_reference = goal;
            self.steady_s = 0.0;
            return;
        }
        self.steady_s += step_s;
        let other =
            (self.goal_reference - self.regime_cycles_per_s).abs() > REGIME_FRACTION * self.regime_cycles_per_s.abs();
        if self.steady_s >= STEADY_TIME_S && (other || self.regime == 0) {
            self.regime = self.regime.wrapping_add(1).max(1);
            self.regime_cycles_per_s = self.goal_reference;
        }
    }
}

pub(super) fn finite_or_zero(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}
