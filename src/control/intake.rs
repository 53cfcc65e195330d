//! From device readings to the [`State`] message: units of the cam, unwrapped counters, freshness.

use crate::config::Config;
use crate::link::{ServoReading, TrackerReading};
use crate::message::State;
use std::f64::consts::TAU;

/// How the servo's shaft and the cam relate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cam {
    home_rad: f64,
    sign: f64,
}

/// Servo counts per turn (XL330-M288 e-manual, present position).
const COUNTS_PER_TURN: f64 = 4096.0;

impl Cam {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            home_rad: f64::from(config.servo.home_position) / COUNTS_PER_TURN * TAU,
            sign: if config.servo.positive_is_forward { 1.0 } else { -1.0 },
        }
    }

    pub(super) fn angle_rad(&self, servo: &ServoReading) -> f64 {
        self.sign * (servo.position_rad - self.home_rad)
    }

    pub(super) fn servo_velocity_rad_s(&self, cam_velocity_rad_s: f64) -> f64 {
        self.sign * cam_velocity_rad_s
    }
}

/// Fills states from readings and remembers what a tick without an answer repeats.
#[derive(Debug, Clone)]
pub(super) struct Intake {
    cam: Cam,
    pub(super) state: State,
    tracker: Option<TrackerClock>,
    /// Time of the last servo answer, ns.
    pub(super) servo_seen_ns: Option<u64>,
    /// Time of the last new tracker sample, ns.
    pub(super) sample_seen_ns: Option<u64>,
}

/// The tracker's own counters as last seen.
#[derive(Debug, Clone, Copy)]
struct TrackerClock {
    sample: u32,
    capture_us: u32,
}

/// A counter step larger than this is a tracker that started anew, not samples that were missed.
const RESTART_STEP: u32 = 100_000;

impl Intake {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            cam: Cam::new(config),
            state: State::unknown(config.worm.cells),
            tracker: None,
            servo_seen_ns: None,
            sample_seen_ns: None,
        }
    }

    pub(super) fn cam(&self) -> Cam {
        self.cam
    }

    pub(super) fn take_servo(&mut self, now_ns: u64, reading: Option<&ServoReading>) {
        let state = &mut self.state;
        state.motor_is_new = u32::from(reading.is_some());
        let Some(reading) = reading else {
            state.link_failures += 1;
            return;
        };
        self.servo_seen_ns = Some(now_ns);
        state.motor_angle_rad = self.cam.angle_rad(reading);
        state.phase = state.motor_angle_rad / TAU;
        state.motor_velocity_rad_s = self.cam.sign * reading.velocity_rad_s;
        state.motor_current_a = self.cam.sign * reading.current_a;
        state.motor_duty = self.cam.sign * reading.duty;
        state.bus_voltage_v = reading.voltage_v;
        state.motor_temperature_c = reading.temperature_c;
    }

    pub(super) fn take_tracker(&mut self, now_ns: u64, reading: Option<&TrackerReading>) {
        self.state.sample_is_new = 0;
        let Some(reading) = reading else { return };
        let clock = TrackerClock {
            sample: reading.sample,
            capture_us: reading.capture_time_us,
        };
        let (step, elapsed_us) = match self.tracker {
            None => (1, 0),
            Some(last) if last.sample == clock.sample => return,
            Some(last) => (
                clock.sample.wrapping_sub(last.sample),
                clock.capture_us.wrapping_sub(last.capture_us),
            ),
        };
        let first = self.tracker.replace(clock).is_none();
        let state = &mut self.state;
        let restarted = step > RESTART_STEP;
        state.sample += 1;
        if !restarted {
            state.samples_missed += u64::from(step) - 1;
        }
        if first {
            state.sample_time_s = f64::from(clock.capture_us) * 1e-6;
        } else if restarted {
            // The old clock is gone; this computer's own clock tells how long the tracker was away.
            let away_ns = now_ns.saturating_sub(self.sample_seen_ns.unwrap_or(now_ns));
            state.sample_time_s += away_ns as f64 * 1e-9;
        } else {
            state.sample_time_s += f64::from(elapsed_us) * 1e-6;
        }
        state.sample_is_new = 1;
        state.valid_mask = u32::from(reading.valid) & ((1u32 << state.cell_count) - 1);
        for cell in 0..state.cell_count as usize {
            let seen = state.valid_mask >> cell & 1 == 1;
            state.position_m[cell] = if seen { reading.positions_m[cell] } else { f64::NAN };
        }
        self.sample_seen_ns = Some(now_ns);
    }
}
