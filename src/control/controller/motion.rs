//! Motion: the cam velocity of each mode.

use super::{Controller, RAD_S_PER_COUNT};
use crate::control::interface::Note;
use crate::control::loop_clock::seconds_to_ns;
use std::f64::consts::TAU;
use worm_estimator::message::{HoldReason, Mode};

/// Cam velocity below which the motor counts as standing still, rad/s: two counts.
const STANDSTILL_RAD_S: f64 = 2.0 * RAD_S_PER_COUNT;

/// How long the cam must have been at rest before a hold keeps its angle, ns. A servo that brakes hard turns back a little, and is slow for
/// a few milliseconds between: an angle from there would have to be corrected.
const STANDSTILL_NS: u64 = 20_000_000;

/// Longest wait for the cam to stand still before torque goes off, or before a hold keeps the angle that it has, ns.
const STANDSTILL_TIMEOUT_NS: u64 = 500_000_000;

/// Deviation that a hold leaves alone, rad: one and a half counts of the servo's position. The cam then really stands.
const HOLD_TOLERANCE_RAD: f64 = 1.5 * TAU / 4096.0;

/// A back-off may take so many times as long as it should, …
const BACK_OFF_PATIENCE: f64 = 2.0;
/// … and this much longer, for the ramps, s.
const BACK_OFF_GRACE_S: f64 = 2.0;

/// The end of a back-off.
#[derive(Debug, Clone, Copy)]
pub(super) struct BackOff {
    until_rad: f64,
    /// A blocked cam never gets there.
    until_ns: u64,
}

impl Controller {
    pub(super) fn begin_back_off(&mut self, now_ns: u64) {
        let backward = -self.ramp.direction_of_target();
        let speed_rad_s = self.gait_velocity_rad_s.abs();
        let way_rad = self.back_off_cycles * TAU;
        let patience_s = BACK_OFF_PATIENCE * way_rad / speed_rad_s + BACK_OFF_GRACE_S;
        self.ramp.aim(backward * speed_rad_s);
        self.back_off = Some(BackOff {
            until_rad: self.assembler.state.motor_angle_rad + backward * way_rad,
            until_ns: now_ns.saturating_add(seconds_to_ns(patience_s)),
        });
    }

    /// The cam velocity commanded in this tick, rad/s.
    pub(super) fn command_velocity(&mut self, now_ns: u64, dt_s: f64) -> f64 {
        match self.mode {
            Mode::Disarmed | Mode::Armed | Mode::Fault => {
                self.ramp.halt();
                0.0
            }
            Mode::Crawling => {
                self.end_back_off(now_ns);
                self.ramp.advance(dt_s)
            }
            Mode::Holding => self.hold_velocity(now_ns, dt_s),
            Mode::Stopping => {
                self.ramp.aim(0.0);
                let velocity_rad_s = self.ramp.advance(dt_s);
                if self.disarm_due_ns.is_none() && self.has_come_to_rest(now_ns) {
                    self.request_disarm(now_ns);
                }
                velocity_rad_s
            }
        }
    }

    fn end_back_off(&mut self, now_ns: u64) {
        let Some(BackOff { until_rad, until_ns }) = self.back_off else {
            return;
        };
        let beyond_rad = (self.assembler.state.motor_angle_rad - until_rad) * self.ramp.direction_of_target();
        let is_timed_out = now_ns >= until_ns;
        if beyond_rad >= 0.0 || is_timed_out {
            if is_timed_out {
                self.notes.add(Note::BackOffTimedOut);
            }
            self.enter_hold(HoldReason::Alarm, now_ns);
        }
    }

    /// Whether the ramp is over and the cam stands, or has had its time for that.
    fn has_come_to_rest(&mut self, now_ns: u64) -> bool {
        if !self.ramp.is_at_rest() {
            return false;
        }
        let since_ns = *self.at_rest_since_ns.get_or_insert(now_ns);
        self.cam_stands() || now_ns.saturating_sub(since_ns) > STANDSTILL_TIMEOUT_NS
    }

    fn cam_stands(&self) -> bool {
        self.assembler.state.motor_velocity_rad_s.abs() < STANDSTILL_RAD_S
    }

    /// A hold first ramps down, then keeps the angle at which the cam came to rest.
    fn hold_velocity(&mut self, now_ns: u64, dt_s: f64) -> f64 {
        let angle_rad = self.assembler.state.motor_angle_rad;
        let Some(hold_rad) = self.hold_angle_rad else {
            self.ramp.aim(0.0);
            let velocity_rad_s = self.ramp.advance(dt_s);
            if self.has_come_to_rest(now_ns) {
                let since_ns = *self.resting_since_ns.get_or_insert(now_ns);
                if now_ns.saturating_sub(since_ns) >= STANDSTILL_NS {
                    self.hold_angle_rad = Some(angle_rad);
                }
            } else {
                self.resting_since_ns = None;
            }
            return velocity_rad_s;
        };
        let error_rad = hold_rad - angle_rad;
        if error_rad.abs() <= HOLD_TOLERANCE_RAD {
            return 0.0;
        }
        let max_rad_s = self.gait_velocity_rad_s.abs();
        (self.hold_gain_per_s * error_rad).clamp(-max_rad_s, max_rad_s)
    }
}
