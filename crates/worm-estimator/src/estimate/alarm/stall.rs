//! Motor stall: the cam does not turn as commanded.
//!
//! The lag is ∫ (commanded − measured speed) dt, in turns, with a leak that runs with the *commanded travel*, not with time:
//!
//! d lag = (commanded − measured) − lag · |commanded| / memory, memory = [`MEMORY`] thresholds.
//!
//! A cam that stands still makes the lag grow to `memory`, so it passes the threshold after −5 ln(1 − 1/5) = 1.12 thresholds of commanded
//! travel **at any speed**. A cam that turns too slowly by a fraction e settles at e · `memory`, so up to 20 % too slow is not a stall. The
//! normal lag of a servo does not count: a rising command is followed with the time constant [`SERVO_LAG_S`] and a falling one at once,
//! whichever is less, and half a count of the goal register is the servo's own rounding. Time is motor time: a simulated motor stands still
//! in a pause of its computer.
//!
//! While the commanded speed changes, twice the threshold is needed, unless the current shows that the motor works hard: the current only
//! corroborates, the encoder decides.

use super::cam_motion::{GOAL_UNIT_TURNS_PER_S, Tick, finite_or_zero};
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::message::{Severity, State};
use crate::winding::{Reported, Winding};

/// Travel over which lag is forgotten, in thresholds.
const MEMORY: f64 = 5.0;
/// Time constant with which a healthy servo follows a rising command, s, generously.
const SERVO_LAG_S: f64 = 0.04;
/// Commanded speed below which the threshold falls in proportion. At this speed the default threshold is passed after 70 ms, which
/// leaves the rest of a tenth of a second for a lead of the cam, the confirmation and the command to the motor.
const FULL_SPEED_TURNS_PER_S: f64 = 0.16;
/// The threshold falls no further than this: eight counts of the encoder.
const MIN_TURNS: f64 = 0.002;
/// How far ahead the cam may count as, in thresholds, so that a fast moment does not hide a stall.
const MAX_AHEAD: f64 = 0.2;
/// Readings in a row beyond the threshold.
const CONFIRMATIONS: u32 = 3;
/// The condition began when the lag last passed this fraction of the threshold.
const ONSET_FRACTION: f64 = 0.2;
/// Fraction of the servo's current limit from which the motor works hard.
const HARD_WORK_FRACTION: f64 = 0.7;
/// The lag is reset once no motion was commanded for this long, s.
const SETTLED_S: f64 = 0.2;
/// Longest pause between readings that is bridged, s; beyond it what was commanded meanwhile is not known.
const LONGEST_GAP_S: f64 = 0.03;
/// Faster than any servo turns a cam, turns/s: the encoder's zero was changed.
const IMPLAUSIBLE_TURNS_PER_S: f64 = 50.0;

#[derive(Debug, Clone)]
pub(super) struct MotorStall {
    threshold_turns: f64,
    winding: Winding,
    hard_work_a: f64,
    longest_gap_s: f64,
    reference: f64, // the speed that a healthy servo must have reached by now, turns/s
    side: f64,      // direction in which the lag counts, +1 or −1
    lag: f64,       // turns
    commanded: f64, // travel commanded since the last reading, turns
    gap_s: f64,     // time since the last reading
    uncommanded_s: f64,
    last_phase: Option<f64>,
    beyond: u32,
    since_ns: u64,
}

impl MotorStall {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            threshold_turns: config.alarms.motor_stall.threshold,
            winding: config.winding(),
            hard_work_a: HARD_WORK_FRACTION * config.servo.current_limit_a,
            longest_gap_s: LONGEST_GAP_S.max(3.0 / config.control.rate_hz),
            reference: 0.0,
            side: 1.0,
            lag: 0.0,
            commanded: 0.0,
            gap_s: 0.0,
            uncommanded_s: 0.0,
            last_phase: None,
            beyond: 0,
            since_ns: 0,
        }
    }

    pub(super) fn update(&mut self, tick: &Tick, state: &State) -> DetectorOutput {
        let Some(phase) = tick.phase.filter(|_| tick.torque) else {
            self.forget();
            return DetectorOutput::Idle;
        };
        self.follow_command(tick);
        if tick.phase_is_new {
            self.leave_out_standstill(tick);
            self.follow_cam(phase, tick);
        }
        if self.uncommanded_s >= SETTLED_S {
            self.lag = 0.0;
            self.beyond = 0;
            return DetectorOutput::Idle;
        }
        let works_hard = finite_or_zero(self.winding.current_a(&Reported::from(state))).abs() >= self.hard_work_a;
        let baseline = self.threshold_at(tick.goal_turns_per_s);
        let threshold = if tick.steady || works_hard {
            baseline
        } else {
            2.0 * baseline
        };
        if tick.phase_is_new {
            self.beyond = if self.lag > threshold { self.beyond + 1 } else { 0 };
        }
        let verdict = if self.beyond >= CONFIRMATIONS {
            ReadingState::Bad
        } else if self.lag < 0.5 * threshold {
            ReadingState::Good
        } else {
            ReadingState::Between
        };
        DetectorOutput::Measured(Reading {
            value: self.lag,
            threshold,
            verdict,
            since_ns: self.since_ns,
            cell: None,
            severity: Severity::Critical,
        })
    }

    /// The threshold at a commanded speed, turns.
    fn threshold_at(&self, goal_turns_per_s: f64) -> f64 {
        let fraction = (goal_turns_per_s.abs() / FULL_SPEED_TURNS_PER_S).min(1.0);
        (fraction * self.threshold_turns).max(MIN_TURNS.min(self.threshold_turns))
    }

    fn follow_command(&mut self, tick: &Tick) {
        let goal = tick.goal_turns_per_s;
        let asked = if goal.abs() < GOAL_UNIT_TURNS_PER_S {
            0.0
        } else {
            goal - goal.signum() * 0.5 * GOAL_UNIT_TURNS_PER_S
        };
        self.uncommanded_s = if asked == 0.0 {
            self.uncommanded_s + tick.step_s
        } else {
            0.0
        };
        if asked * self.reference < 0.0 {
            self.reference = 0.0;
        }
        if asked.abs() <= self.reference.abs() {
            self.reference = asked;
        } else {
            self.reference += (asked - self.reference) * (tick.step_s / SERVO_LAG_S).min(1.0);
        }
        if asked != 0.0 && asked.signum() != self.side {
            self.side = asked.signum();
            self.lag = 0.0;
            self.beyond = 0;
        }
        self.commanded += self.reference * tick.step_s;
        self.gap_s += tick.step_s;
    }

    /// A simulated servo that stood still with its computer was commanded nothing meanwhile.
    fn leave_out_standstill(&mut self, tick: &Tick) {
        if tick.motor_s < self.gap_s {
            self.commanded *= tick.motor_s / self.gap_s;
            self.gap_s = tick.motor_s;
        }
    }

    fn follow_cam(&mut self, phase: f64, tick: &Tick) {
        let threshold = self.threshold_at(tick.goal_turns_per_s);
        let travelled = self.last_phase.map_or(f64::NAN, |last| phase - last);
        let bridged = self.gap_s <= self.longest_gap_s && travelled.abs() < 0.01 + IMPLAUSIBLE_TURNS_PER_S * self.gap_s;
        if bridged {
            let forgotten = (self.commanded.abs() / (MEMORY * threshold)).min(1.0);
            self.lag += (self.commanded - travelled) * self.side - self.lag * forgotten;
            self.lag = self.lag.max(-MAX_AHEAD * threshold);
        }
        if self.lag <= ONSET_FRACTION * threshold {
            self.since_ns = tick.now_ns;
        }
        self.last_phase = Some(phase);
        self.commanded = 0.0;
        self.gap_s = 0.0;
    }

    fn forget(&mut self) {
        self.reference = 0.0;
        self.lag = 0.0;
        self.beyond = 0;
        self.last_phase = None;
        self.commanded = 0.0;
        self.gap_s = 0.0;
        self.uncommanded_s = SETTLED_S;
    }
}
