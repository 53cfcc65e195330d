//! From device readings to the [`State`] message: angles of the cam, unwrapped counters, freshness.

use super::loop_clock::seconds_to_ns;
use crate::link::{ServoReading, TrackerReading};
use std::f64::consts::TAU;
use worm_estimator::config::Config;
use worm_estimator::message::State;
use worm_estimator::time::seconds;

/// How the servo's shaft relates to the cam.
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

    fn angle_rad(&self, servo_rad: f64) -> f64 {
        self.sign * (servo_rad - self.home_rad)
    }

    pub(super) fn servo_velocity_rad_s(&self, cam_velocity_rad_s: f64) -> f64 {
        self.sign * cam_velocity_rad_s
    }
}

/// Follows the servo's position where its register forgets whole turns, so that the cam's angle goes on: after 15 days at 24 rev/min the
/// register of 32 bits passes its end, and a servo that restarts counts from within one turn again (XL330-M288 e-manual, present
/// position). Otherwise the worm would seem to have stepped back by all that was forgotten, and a hold would turn the cam to make up
/// for it.
#[derive(Debug, Clone, Copy, Default)]
struct PositionUnwrapper {
    last_rad: Option<f64>,
    forgotten_turns: f64,
}

impl PositionUnwrapper {
    fn unwrap_rad(&mut self, position_rad: f64) -> f64 {
        let step_rad = position_rad - self.last_rad.replace(position_rad).unwrap_or(position_rad);
        // No cam turns by half a turn between two readings: at its fastest that takes more than a second, and without instructions
        // the servo's watchdog stops it long before.
        if step_rad.abs() > TAU / 2.0 {
            self.forgotten_turns -= (step_rad / TAU).round();
        }
        position_rad + self.forgotten_turns * TAU
    }
}

/// Fills states from readings, and keeps the values that a tick without an answer repeats.
#[derive(Debug, Clone)]
pub(super) struct StateAssembler {
    cam: Cam,
    pub(super) state: State,
    position: PositionUnwrapper,
    servo_clock: Option<ServoClock>,
    /// The servo's clock without its wrapping, ns; counted from when it was first seen to count.
    motor_time_ns: u64,
    tracker: Option<TrackerClock>,
    /// The tracker's clock without its wrapping, ns.
    sample_time_ns: u64,
    /// When the servo last answered, ns of the loop's own clock.
    pub(super) servo_seen_ns: Option<u64>,
    /// When the last new tracker sample came, ns of the loop's own clock.
    pub(super) sample_seen_ns: Option<u64>,
    has_positions: bool,
    has_pitch: bool,
    /// When the pitch last came, and how long it holds, ns of the loop's own clock.
    pitch_seen_ns: u64,
    pitch_holds_ns: u64,
}

/// The servo's own clock as last read.
#[derive(Debug, Clone, Copy)]
struct ServoClock {
    tick_ms: u16,
    read_ns: u64,
    /// Whether the register has been seen to count; some imitations of the servo never do.
    counts: bool,
}

/// The tracker's own counters as last seen.
#[derive(Debug, Clone, Copy)]
struct TrackerClock {
    sample: u32,
    capture_us: u32,
    arrived_ns: u64,
}

/// Values of the servo's realtime tick (XL330-M288 e-manual, register 120: 0 to 32,767 ms).
const REALTIME_TICKS: u16 = 32_768;

/// How much further the servo's clock may advance than the computer's between two readings, ms: the first reading may have
/// arrived late, from before a pause of the computer.
const MAX_READING_AGE_MS: u64 = 2_000;

/// A larger step of the counter means that the tracker restarted, not that samples were missed.
const RESTART_STEP: u32 = 100_000;

impl StateAssembler {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            cam: Cam::new(config),
            state: State::unknown(config.worm.cells),
            position: PositionUnwrapper::default(),
            servo_clock: None,
            motor_time_ns: 0,
            tracker: None,
            sample_time_ns: 0,
            servo_seen_ns: None,
            sample_seen_ns: None,
            has_positions: config.tracker.present,
            has_pitch: config.inertial_sensor.is_some(),
            pitch_seen_ns: 0,
            pitch_holds_ns: seconds_to_ns(config.control.tracker_timeout_s),
        }
    }

    pub(super) fn cam(&self) -> Cam {
        self.cam
    }

    /// Takes the servo's answer, or its lack, at `now_ns` of the computer's clock, which is `present_ns` of the loop's own.
    pub(super) fn take_servo(&mut self, now_ns: u64, present_ns: u64, reading: Option<&ServoReading>) {
        let state = &mut self.state;
        state.motor_is_new = u32::from(reading.is_some());
        let Some(reading) = reading else { return };
        self.servo_seen_ns = Some(present_ns);
        state.motor_angle_rad = self.cam.angle_rad(self.position.unwrap_rad(reading.position_rad));
        state.phase = state.motor_angle_rad / TAU;
        state.motor_velocity_rad_s = self.cam.sign * reading.velocity_rad_s;
        state.motor_current_a = self.cam.sign * reading.current_a;
        state.motor_duty = self.cam.sign * reading.duty;
        state.bus_voltage_v = reading.voltage_v;
        state.motor_temperature_c = reading.temperature_c;
        self.follow_servo_clock(now_ns, reading.realtime_tick_ms);
    }

    /// Unwraps the servo's clock. When the reading is implausible, because the servo restarted or was silent for longer than its
    /// counter's range, the computer's clock measures the time instead.
    fn follow_servo_clock(&mut self, now_ns: u64, tick_ms: u16) {
        let Some(last) = self.servo_clock else {
            self.servo_clock = Some(ServoClock {
                tick_ms,
                read_ns: now_ns,
                counts: false,
            });
            return;
        };
        let counts = last.counts || tick_ms != last.tick_ms;
        self.servo_clock = Some(ServoClock {
            tick_ms,
            read_ns: now_ns,
            counts,
        });
        if !counts {
            return;
        }
        let by_servo_ms = u64::from(tick_ms.wrapping_sub(last.tick_ms) % REALTIME_TICKS);
        let elapsed_ns = now_ns.saturating_sub(last.read_ns);
        let elapsed_ms = elapsed_ns / 1_000_000;
        let is_plausible = by_servo_ms <= elapsed_ms + MAX_READING_AGE_MS
            && elapsed_ms < u64::from(REALTIME_TICKS) - MAX_READING_AGE_MS;
        self.motor_time_ns += if is_plausible {
            by_servo_ms * 1_000_000
        } else {
            elapsed_ns
        };
        self.state.motor_time_s = seconds(self.motor_time_ns);
    }

    /// Takes the tracker's answer, likewise.
    pub(super) fn take_tracker(&mut self, now_ns: u64, present_ns: u64, reading: Option<&TrackerReading>) {
        self.state.sample_is_new = 0;
        if self.has_pitch {
            self.take_pitch(present_ns, reading.and_then(|reading| reading.pitch_rad));
        }
        let Some(reading) = reading.filter(|_| self.has_positions) else {
            return;
        };
        let clock = TrackerClock {
            sample: reading.sample,
            capture_us: reading.capture_time_us,
            arrived_ns: now_ns,
        };
        let (step, elapsed_us) = match self.tracker {
            None => (1, 0),
            Some(last) if last.sample == clock.sample => return,
            Some(last) => (
                clock.sample.wrapping_sub(last.sample),
                clock.capture_us.wrapping_sub(last.capture_us),
            ),
        };
        let before = self.tracker.replace(clock);
        let state = &mut self.state;
        let restarted = step > RESTART_STEP;
        state.sample += 1;
        if !restarted {
            state.samples_missed += u64::from(step) - 1;
        }
        if before.is_none() {
            self.sample_time_ns = u64::from(clock.capture_us) * 1_000;
        } else if restarted {
            // The tracker's clock started again; the computer's clock measures how long it was away.
            let away_ns = now_ns.saturating_sub(before.map_or(now_ns, |before| before.arrived_ns));
            self.sample_time_ns += away_ns;
        } else {
            self.sample_time_ns += u64::from(elapsed_us) * 1_000;
        }
        state.sample_time_s = seconds(self.sample_time_ns);
        state.sample_is_new = 1;
        state.valid_mask = u32::from(reading.valid) & ((1u32 << state.cell_count) - 1);
        for cell in 0..state.cell_count as usize {
            let is_valid = state.valid_mask >> cell & 1 == 1;
            state.position_m[cell] = if is_valid { reading.positions_m[cell] } else { f64::NAN };
        }
        self.sample_seen_ns = Some(present_ns);
    }

    /// A pitch is repeated while it does not come, but not for longer than a tracker may be silent.
    fn take_pitch(&mut self, present_ns: u64, pitch_rad: Option<f64>) {
        if let Some(pitch_rad) = pitch_rad {
            self.state.pitch_rad = pitch_rad;
            self.pitch_seen_ns = present_ns;
        } else if present_ns.saturating_sub(self.pitch_seen_ns) > self.pitch_holds_ns {
            self.state.pitch_rad = f64::NAN;
        }
    }
}
