//! The servo that turns the cam: a DYNAMIXEL of the X series, by default an XL330-M288-T.
//!
//! [`register`] is its control table as far as it is used, [`scale`] the unit of each kind of count, and [`ServoReading`] what
//! one tick learns from it: the block from the bus watchdog (98) to the temperature (146), read in one stretch, because a
//! second stretch would cost more on the wire than the 30 bytes in between.
//!
//! Source: ROBOTIS e-manual, "XL330-M288", control table of EEPROM and RAM area.

use dynamixel_bus::Block;
use dynamixel_bus::packet::ReadSpan;

/// Registers of the control table. Those below 64 are EEPROM: they can be written only while torque is off.
pub mod register {
    use crate::link::Register;

    /// Tells XL330-M288-T (1200) from others. Read-only.
    pub const MODEL_NUMBER: Register = Register::new(0, 2, "model number");
    /// Version of the firmware. Read-only.
    pub const FIRMWARE_VERSION: Register = Register::new(6, 1, "firmware version");
    /// The device's ID, 0 to 252.
    pub const ID: Register = Register::new(7, 1, "ID");
    /// Code of the baud rate: see [`BAUD_RATES`](super::BAUD_RATES).
    pub const BAUD_RATE: Register = Register::new(8, 1, "baud rate");
    /// Wait before an answer, in 2 µs; 250 (500 µs) as the factory sets it.
    pub const RETURN_DELAY: Register = Register::new(9, 1, "return delay time");
    /// Bit 0: reverse; bit 2: profiles by time; bit 3: a goal switches torque on.
    pub const DRIVE_MODE: Register = Register::new(10, 1, "drive mode");
    /// What the goal is: see [`VELOCITY_MODE`](super::VELOCITY_MODE).
    pub const OPERATING_MODE: Register = Register::new(11, 1, "operating mode");
    /// Added to the present position, signed.
    pub const HOMING_OFFSET: Register = Register::new(20, 4, "homing offset");
    /// Beyond this, in °C, the servo shuts down.
    pub const TEMPERATURE_LIMIT: Register = Register::new(31, 1, "temperature limit");
    /// Beyond this, in 0.1 V, the servo shuts down.
    pub const MAX_VOLTAGE_LIMIT: Register = Register::new(32, 2, "max voltage limit");
    /// Below this, in 0.1 V, the servo shuts down.
    pub const MIN_VOLTAGE_LIMIT: Register = Register::new(34, 2, "min voltage limit");
    /// Greatest goal PWM, in 0.113 % of full duty.
    pub const PWM_LIMIT: Register = Register::new(36, 2, "PWM limit");
    /// Greatest goal current, in 1 mA. It limits the current in the current modes only, not in velocity mode.
    pub const CURRENT_LIMIT: Register = Register::new(38, 2, "current limit");
    /// Greatest goal velocity, in 0.229 rev/min.
    pub const VELOCITY_LIMIT: Register = Register::new(44, 4, "velocity limit");
    /// Greatest goal position in position mode, 0 to 4095.
    pub const MAX_POSITION_LIMIT: Register = Register::new(48, 4, "max position limit");
    /// Least goal position in position mode, 0 to 4095.
    pub const MIN_POSITION_LIMIT: Register = Register::new(52, 4, "min position limit");
    /// What the servo does when it gets power; bit 0: torque on, bit 1: gains and profile from a backup. Servos with an older firmware do
    /// not have it.
    pub const STARTUP_CONFIGURATION: Register = Register::new(60, 1, "startup configuration");
    /// Which hardware errors switch torque off.
    pub const SHUTDOWN: Register = Register::new(63, 1, "shutdown");
    /// 1: the motor obeys; 0: it is free.
    pub const TORQUE_ENABLE: Register = Register::new(64, 1, "torque enable");
    /// Which instructions are answered: 0 ping, 1 ping and reads, 2 all.
    pub const STATUS_RETURN_LEVEL: Register = Register::new(68, 1, "status return level");
    /// See [`HardwareErrors`](super::HardwareErrors). Read-only.
    pub const HARDWARE_ERROR_STATUS: Register = Register::new(70, 1, "hardware error status");
    /// Integral gain of the velocity loop, in 1/65536 of the servo's own unit.
    pub const VELOCITY_I_GAIN: Register = Register::new(76, 2, "velocity I gain");
    /// Proportional gain of the velocity loop, in 1/128 of the servo's own unit.
    pub const VELOCITY_P_GAIN: Register = Register::new(78, 2, "velocity P gain");
    /// Derivative gain of the position loop.
    pub const POSITION_D_GAIN: Register = Register::new(80, 2, "position D gain");
    /// Integral gain of the position loop.
    pub const POSITION_I_GAIN: Register = Register::new(82, 2, "position I gain");
    /// Proportional gain of the position loop: PWM counts for 256 counts of error.
    pub const POSITION_P_GAIN: Register = Register::new(84, 2, "position P gain");
    /// Gain of the goal's acceleration.
    pub const FEEDFORWARD_2ND_GAIN: Register = Register::new(88, 2, "feedforward 2nd gain");
    /// Gain of the goal's velocity.
    pub const FEEDFORWARD_1ST_GAIN: Register = Register::new(90, 2, "feedforward 1st gain");
    /// Silence after which the motor stops by itself, in 20 ms; 0 is never, 0xFF says that it has happened.
    pub const BUS_WATCHDOG: Register = Register::new(98, 1, "bus watchdog");
    /// Limit of the duty in all modes but PWM mode, in 0.113 %; the PWM limit after a start and a change of mode.
    pub const GOAL_PWM: Register = Register::new(100, 2, "goal PWM");
    /// What the motor shall do, in 0.229 rev/min, signed.
    pub const GOAL_VELOCITY: Register = Register::new(104, 4, "goal velocity");
    /// Ramp of the velocity, in 214.577 rev/min²; 0 is none.
    pub const PROFILE_ACCELERATION: Register = Register::new(108, 4, "profile acceleration");
    /// Velocity on the way to a goal position, in 0.229 rev/min; 0 is the velocity limit.
    pub const PROFILE_VELOCITY: Register = Register::new(112, 4, "profile velocity");
    /// Where the motor shall turn to in the position modes, 4096 to a turn, signed.
    pub const GOAL_POSITION: Register = Register::new(116, 4, "goal position");
    /// Milliseconds, 0 to 32767 and over again. Read-only.
    pub const REALTIME_TICK: Register = Register::new(120, 2, "realtime tick");
    /// 1 while the velocity is above a threshold. Read-only.
    pub const MOVING: Register = Register::new(122, 1, "moving");
    /// Bits about profiles. Read-only.
    pub const MOVING_STATUS: Register = Register::new(123, 1, "moving status");
    /// Duty of the bridge, in 0.113 %, signed. Read-only.
    pub const PRESENT_PWM: Register = Register::new(124, 2, "present PWM");
    /// In 1 mA, signed. Read-only.
    pub const PRESENT_CURRENT: Register = Register::new(126, 2, "present current");
    /// In 0.229 rev/min, signed. Read-only.
    pub const PRESENT_VELOCITY: Register = Register::new(128, 4, "present velocity");
    /// 4096 to a turn, signed, counting whole turns. Read-only.
    pub const PRESENT_POSITION: Register = Register::new(132, 4, "present position");
    /// In 0.1 V. Read-only.
    pub const PRESENT_INPUT_VOLTAGE: Register = Register::new(144, 2, "present input voltage");
    /// In °C. Read-only.
    pub const PRESENT_TEMPERATURE: Register = Register::new(146, 1, "present temperature");
}

/// What a count of each kind is worth, in SI units, and back.
pub mod scale {
    use core::f64::consts::TAU;

    /// rad/s of a velocity count: 0.229 rev/min.
    pub const VELOCITY_RAD_S: f64 = 0.229 * TAU / 60.0;
    /// rad of a position count: 4096 to a turn.
    pub const POSITION_RAD: f64 = TAU / 4096.0;
    /// A of a current count.
    pub const CURRENT_A: f64 = 1e-3;
    /// V of a voltage count.
    pub const VOLTAGE_V: f64 = 0.1;
    /// Full duty of a PWM count: 0.113 %.
    pub const DUTY: f64 = 0.113e-2;
    /// rad/s² of a profile acceleration count: 214.577 rev/min².
    pub const ACCELERATION_RAD_S2: f64 = 214.577 * TAU / 3600.0;
    /// Seconds of a return delay count.
    pub const RETURN_DELAY_S: f64 = 2e-6;
    /// Milliseconds of a bus watchdog count.
    pub const WATCHDOG_MS: u32 = 20;

    /// The nearest velocity count. What no count can say becomes the nearest that can; NaN becomes standstill.
    #[must_use]
    pub fn velocity_counts(velocity_rad_s: f64) -> i32 {
        // A cast from float saturates, and takes NaN to zero.
        (velocity_rad_s / VELOCITY_RAD_S).round() as i32
    }

    /// Watchdog counts, rounded up so that it never bites early: 1 to 127, that is 20 ms to 2.54 s.
    #[must_use]
    pub const fn watchdog_counts(watchdog_ms: u32) -> u8 {
        let counts = watchdog_ms.div_ceil(WATCHDOG_MS);
        match counts {
            0 => 1,
            1..=127 => counts as u8,
            _ => 127,
        }
    }
}

/// Model number of the XL330-M288-T.
pub const XL330_M288_MODEL: u16 = 1200;

/// Gains of the velocity loop of an XL330-M288-T as the factory sets them: I, P (e-manual, "Velocity PI Gain(76, 78)").
pub const XL330_M288_VELOCITY_GAINS: (u16, u16) = (1600, 180);

/// Full duty in counts of 0.113 %.
pub const FULL_PWM: u16 = 885;

/// Operating mode in which the goal is a velocity.
pub const VELOCITY_MODE: u8 = 1;

/// Operating mode in which the goal is a position within one turn.
pub const POSITION_MODE: u8 = 3;

/// Value of the bus watchdog after it has stopped the motor; the goal is then read-only until 0 is written to it.
pub const WATCHDOG_LATCHED: u8 = 0xFF;

/// Baud rates of the X series in the order of their codes 0 to 6, in bit/s.
pub const BAUD_RATES: [u32; 7] = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000];

/// First address of the block that a tick reads.
pub const BLOCK_ADDRESS: u16 = register::BUS_WATCHDOG.address;

/// Bytes of the block that a tick reads: 98 to 146.
pub const BLOCK_LEN: usize = (register::PRESENT_TEMPERATURE.end() - BLOCK_ADDRESS) as usize;

/// What a tick reads of the servo with this ID.
#[must_use]
pub const fn block_span(id: super::packet::DeviceId) -> ReadSpan {
    ReadSpan {
        id,
        address: BLOCK_ADDRESS,
        length: BLOCK_LEN as u16,
    }
}

/// What one tick learns from the servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoReading {
    /// Bus watchdog as it stands, in 20 ms; [`WATCHDOG_LATCHED`] after it has stopped the motor.
    pub watchdog: u8,
    /// The goal that the servo has, in rad/s: the receipt for the one that was written.
    pub goal_velocity_rad_s: f64,
    /// The servo's clock in ms, 0 to 32767 and over again.
    pub realtime_tick_ms: u16,
    /// The velocity is above the servo's threshold.
    pub moving: bool,
    /// Duty of the bridge, −1 to 1.
    pub duty: f64,
    /// Motor current in A, signed.
    pub current_a: f64,
    /// Velocity of the horn in rad/s.
    pub velocity_rad_s: f64,
    /// Position of the horn in rad, counting whole turns.
    pub position_rad: f64,
    /// Supply in V.
    pub voltage_v: f64,
    /// Temperature in °C.
    pub temperature_c: f64,
    /// The answer said that there is a hardware error.
    pub alert: bool,
}

impl ServoReading {
    /// From the block of [`block_span`], and the alert bit of the answer that brought it.
    #[must_use]
    pub fn from_block(bytes: &[u8; BLOCK_LEN], alert: bool) -> Self {
        let block = Block {
            first_address: BLOCK_ADDRESS,
            bytes,
        };
        Self {
            watchdog: block.u8(register::BUS_WATCHDOG),
            goal_velocity_rad_s: f64::from(block.i32(register::GOAL_VELOCITY)) * scale::VELOCITY_RAD_S,
            realtime_tick_ms: block.u16(register::REALTIME_TICK),
            moving: block.u8(register::MOVING) != 0,
            duty: (f64::from(block.i16(register::PRESENT_PWM)) * scale::DUTY).clamp(-1.0, 1.0),
            current_a: f64::from(block.i16(register::PRESENT_CURRENT)) * scale::CURRENT_A,
            velocity_rad_s: f64::from(block.i32(register::PRESENT_VELOCITY)) * scale::VELOCITY_RAD_S,
            position_rad: f64::from(block.i32(register::PRESENT_POSITION)) * scale::POSITION_RAD,
            voltage_v: f64::from(block.u16(register::PRESENT_INPUT_VOLTAGE)) * scale::VOLTAGE_V,
            temperature_c: f64::from(block.u8(register::PRESENT_TEMPERATURE)),
            alert,
        }
    }

    /// The bus watchdog has stopped the motor, and locks the goal until it is cleared.
    #[must_use]
    pub const fn watchdog_latched(&self) -> bool {
        self.watchdog == WATCHDOG_LATCHED
    }
}

/// Bits of the hardware error status (register 70) and of the shutdown mask (register 63).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HardwareErrors(pub u8);

impl HardwareErrors {
    /// The supply is outside its limits.
    pub const INPUT_VOLTAGE: Self = Self(1 << 0);
    /// Hotter than the temperature limit.
    pub const OVERHEATING: Self = Self(1 << 2);
    /// The encoder does not work.
    pub const MOTOR_ENCODER: Self = Self(1 << 3);
    /// Shock on the circuit, or too little power to turn the motor.
    pub const ELECTRICAL_SHOCK: Self = Self(1 << 4);
    /// A load beyond the greatest output for too long.
    pub const OVERLOAD: Self = Self(1 << 5);

    const NAMES: [(Self, &'static str); 5] = [
        (Self::INPUT_VOLTAGE, "input voltage"),
        (Self::OVERHEATING, "overheating"),
        (Self::MOTOR_ENCODER, "motor encoder"),
        (Self::ELECTRICAL_SHOCK, "electrical shock"),
        (Self::OVERLOAD, "overload"),
    ];

    /// No error.
    #[must_use]
    pub const fn is_none(self) -> bool {
        self.0 == 0
    }

    /// All errors of `other` are among these.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl core::fmt::Display for HardwareErrors {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mut unnamed = self.0;
        let mut separator = "";
        for (error, name) in Self::NAMES {
            if self.contains(error) {
                write!(f, "{separator}{name}")?;
                separator = ", ";
                unnamed &= !error.0;
            }
        }
        match (self.0, unnamed) {
            (0, _) => f.write_str("none"),
            (_, 0) => Ok(()),
            _ => write!(f, "{separator}unknown bits 0x{unnamed:02X}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reading_from_a_block_byte_for_byte() {
        let mut bytes = [0; BLOCK_LEN];
        let mut put = |register: dynamixel_bus::Register, value: &[u8]| {
            let from = usize::from(register.address - BLOCK_ADDRESS);
            bytes[from..from + usize::from(register.size)].copy_from_slice(value);
        };
        put(register::BUS_WATCHDOG, &[0xFF]);
        put(register::GOAL_VELOCITY, &(-105i32).to_le_bytes());
        put(register::REALTIME_TICK, &32_767u16.to_le_bytes());
        put(register::MOVING, &[1]);
        put(register::PRESENT_PWM, &(-885i16).to_le_bytes());
        put(register::PRESENT_CURRENT, &(-1_472i16).to_le_bytes());
        put(register::PRESENT_VELOCITY, &105i32.to_le_bytes());
        put(register::PRESENT_POSITION, &(-6_144i32).to_le_bytes());
        put(register::PRESENT_INPUT_VOLTAGE, &50u16.to_le_bytes());
        put(register::PRESENT_TEMPERATURE, &[31]);
        let reading = ServoReading::from_block(&bytes, true);
        assert!(reading.watchdog_latched() && reading.moving && reading.alert);
        assert_eq!(reading.realtime_tick_ms, 32_767);
        let close = |value: f64, expected: f64| (value - expected).abs() < 1e-9;
        assert!(close(
            reading.goal_velocity_rad_s,
            -105.0 * 0.229 * core::f64::consts::TAU / 60.0
        ));
        assert!(close(reading.velocity_rad_s, -reading.goal_velocity_rad_s));
        assert!(
            close(reading.duty, -1.0),
            "885 counts of 0.113 % are 100.005 %: {}",
            reading.duty
        );
        assert!(close(reading.current_a, -1.472));
        assert!(close(reading.position_rad, -1.5 * core::f64::consts::TAU));
        assert!(close(reading.voltage_v, 5.0) && close(reading.temperature_c, 31.0));
    }

    #[test]
    fn block_is_what_the_manual_says() {
        assert_eq!((BLOCK_ADDRESS, BLOCK_LEN), (98, 49));
    }

    #[test]
    fn counts_saturate() {
        let gait = core::f64::consts::TAU / 2.5; // one turn in 2.5 s
        assert_eq!(scale::velocity_counts(gait), 105);
        assert_eq!(scale::velocity_counts(f64::NAN), 0);
        assert_eq!(scale::velocity_counts(f64::NEG_INFINITY), i32::MIN);
        assert_eq!(
            [0, 1, 20, 21, 2_540, 2_541, 9_999].map(scale::watchdog_counts),
            [1, 1, 1, 2, 127, 127, 127]
        );
    }

    #[test]
    fn hardware_errors_have_names() {
        assert_eq!(
            HardwareErrors(0b10_0101).to_string(),
            "input voltage, overheating, overload"
        );
        assert_eq!(
            HardwareErrors(0b1000_0001).to_string(),
            "input voltage, unknown bits 0x80"
        );
        assert_eq!(HardwareErrors(0b10).to_string(), "unknown bits 0x02");
        assert_eq!(HardwareErrors(0).to_string(), "none");
    }
}
