//! The `state` topic: what the controller measured and commanded in one tick.

use super::ZeroCopySend;
use super::json::{Name, OrNone};
use super::{AlarmKind, coded_enum, message};
use worm_physics::MAX_CELLS;

coded_enum! {
    /// The state of the controller's state machine.
    Mode, "controller mode" {
        /// No torque; the cam can be turned by hand.
        Disarmed = 0 => "disarmed",
        /// Torque on, goal velocity zero, ready to crawl.
        Armed = 1 => "armed",
        /// The cam turns at the commanded speed.
        Crawling = 2 => "crawling",
        /// The cam is actively kept at the angle it had when the hold began.
        Holding = 3 => "holding",
        /// The speed ramps down; torque goes off when the cam stands still.
        Stopping = 4 => "stopping",
        /// A safety rule stopped the worm; the reason is latched until a reset.
        Fault = 5 => "fault",
    }
}

coded_enum! {
    /// Why the controller is in [`Mode::Fault`]: the first reason, latched.
    Fault, "fault" {
        /// No fault.
        None = 0 => "none",
        /// The servo did not answer for longer than the configured time.
        LinkLost = 1 => "link-lost",
        /// The tracker gave no new sample for longer than the configured time.
        TrackerStale = 2 => "tracker-stale",
        /// The estimator was silent for longer than the configured time.
        EstimatorSilent = 3 => "estimator-silent",
        /// The motor current stayed above its limit.
        OverCurrent = 4 => "over-current",
        /// The servo is hotter than its limit.
        OverTemperature = 5 => "over-temperature",
        /// The bus voltage fell below its limit.
        UnderVoltage = 6 => "under-voltage",
        /// The servo reports a hardware error (register 70).
        ServoHardware = 7 => "servo-hardware",
        /// The servo's own bus watchdog had stopped the motor.
        WatchdogTripped = 8 => "watchdog-tripped",
        /// The servo restarted on its own, which resets torque and watchdog.
        ServoRestarted = 9 => "servo-restarted",
        /// An alarm whose policy is `stop`.
        Alarm = 10 => "alarm",
        /// The computer did not run the controller for so long that the servo's own bus watchdog stopped the motor.
        HostPaused = 11 => "host-paused",
        /// The emergency stop is pressed, or cannot be read.
        EmergencyStop = 12 => "emergency-stop",
    }
}

coded_enum! {
    /// Why the controller is in [`Mode::Holding`].
    HoldReason, "hold reason" {
        /// It is not holding.
        None = 0 => "none",
        /// A command.
        Command = 1 => "command",
        /// An alarm with policy `hold`, or the end of a back-off.
        Alarm = 2 => "alarm",
        /// Whoever made the worm crawl is gone, or does not renew its lease.
        LeaseLapsed = 3 => "lease-lapsed",
        /// The time for which it was to crawl is over.
        TimeLimit = 4 => "time-limit",
    }
}

message! {
    /// One tick of the controller, published every tick.
    State = "wormd_state_v4", made: time_ns, cells: |state| state.cell_count, {
        /// Tick number since the controller started; skipped ticks leave a gap in `time_ns`, never here.
        sequence: u64,
        /// When the tick's exchange with the bus ended, ns of `CLOCK_MONOTONIC`.
        time_ns: u64,
        /// Gait cycles done, unwrapped: the cam angle over one turn, zero at the configured home.
        phase: f64,
        /// Cam angle, rad, unwrapped.
        motor_angle_rad: f64,
        /// Cam velocity, rad/s.
        motor_velocity_rad_s: f64,
        /// Velocity commanded in this tick, rad/s.
        goal_velocity_rad_s: f64,
        /// Current in the motor winding, A.
        motor_current_a: f64,
        /// Fraction of the bus voltage that the driver applies to the winding, −1 to 1.
        motor_duty: f64,
        /// Bus voltage, V.
        bus_voltage_v: f64,
        /// Servo temperature, °C.
        motor_temperature_c: f64,
        /// When the servo took these readings, s of its own clock (register 120, realtime tick), unwrapped. It stands still
        /// while a simulated servo does because its computer pauses.
        motor_time_s: f64,
        /// When the newest tracker sample was captured, s of the tracker's own clock, unwrapped.
        sample_time_s: f64,
        /// Cell positions along the canal of the newest tracker sample, m; `NaN` where not seen.
        position_m: [f64; MAX_CELLS],
        /// Tracker samples since the controller started, unwrapped; grows by one with each sample that was seen.
        sample: u64,
        /// Tracker samples missed between two reads, since the controller started.
        samples_missed: u64,
        /// Exchanges since the controller started without a usable answer of the servo. A late answer counts as an answer.
        link_failures: u64,
        /// Time since the controller started in which the computer did not run it though it was due, ns: the sum of all pauses of 10 ms
        /// and more.
        host_paused_ns: u64,
        /// How many cells are in use.
        cell_count: u32,
        /// Bit i set: cell i was seen in the newest sample.
        valid_mask: u32,
        /// 1 when the tracker sample is new in this tick, else 0.
        sample_is_new: u32,
        /// 1 when the motor readings came in this tick, 0 when the last ones are repeated.
        motor_is_new: u32,
        /// The state of the state machine: [`Mode`] as a code.
        mode: u32 as Name<Mode>,
        /// [`Fault`] as a code: the latched reason.
        fault: u32 as Name<Fault>,
        /// The [`super::AlarmKind`] behind [`Fault::Alarm`], or `u32::MAX`.
        fault_alarm: u32 as OrNone<Name<AlarmKind>>,
        /// Servo register 70, hardware error status, as last read.
        hardware_error: u32,
        /// [`HoldReason`] as a code.
        hold_reason: u32 as Name<HoldReason>,
        /// Bit k set: the alarm with code k stands and was acknowledged.
        acknowledged_mask: u32,
        /// User ID of whoever acknowledged an alarm last, or `u32::MAX`.
        acknowledged_by: u32 as OrNone<u32>,
        /// 1 while the emergency stop is pressed, else 0; `u32::MAX` where there is none.
        emergency_stop: u32 as OrNone<u32>,
        /// Pitch of the body, rad, growing up the canal, by the inertial sensor; `NaN` where there is none or it is silent.
        pitch_rad: f64,
    }
}

impl State {
    /// A state in which nothing is known yet, for `cell_count` cells.
    pub fn unknown(cell_count: usize) -> Self {
        Self {
            sequence: 0,
            time_ns: 0,
            phase: f64::NAN,
            motor_angle_rad: f64::NAN,
            motor_velocity_rad_s: f64::NAN,
            goal_velocity_rad_s: 0.0,
            motor_current_a: f64::NAN,
            motor_duty: f64::NAN,
            bus_voltage_v: f64::NAN,
            motor_temperature_c: f64::NAN,
            motor_time_s: f64::NAN,
            sample_time_s: f64::NAN,
            position_m: [f64::NAN; MAX_CELLS],
            sample: 0,
            samples_missed: 0,
            link_failures: 0,
            host_paused_ns: 0,
            cell_count: cell_count as u32,
            valid_mask: 0,
            sample_is_new: 0,
            motor_is_new: 0,
            mode: Mode::Disarmed.code(),
            fault: Fault::None.code(),
            fault_alarm: u32::MAX,
            hardware_error: 0,
            hold_reason: HoldReason::None.code(),
            acknowledged_mask: 0,
            acknowledged_by: u32::MAX,
            emergency_stop: u32::MAX,
            pitch_rad: f64::NAN,
        }
    }

    /// Position of cell `index` if it was seen in the newest sample, m.
    pub fn position_of(&self, index: usize) -> Option<f64> {
        (index < self.cell_count as usize && self.valid_mask >> index & 1 == 1)
            .then(|| self.position_m[index])
            .filter(|position| position.is_finite())
    }
}
