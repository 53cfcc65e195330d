//! The simulated servo: an XL330-M288-T as its manual describes it, around the plant's motor.
//!
//! It obeys velocity mode, position and extended position mode, and PWM mode; torque, limits, shutdown and bus watchdog
//! are the manual's. Where the manual is silent:
//! - The unit of the velocity gains' time is open; the loop settles in about 20 ms with the factory's gains.
//! - Switching torque on, and the watchdog, set the velocity goal to 0, so that nothing moves without a new command.
//! - In the position modes the duty is the error in counts times the P gain over 256 · 885, as recordings of a real one show. A profile
//!   velocity moves the goal; I and D gain are kept and not used. The profile acceleration ramps velocity mode; profiles by time are
//!   not followed.
//! - The velocity that it reports scatters while it turns, as in recordings of a real one.
//! - An overload is a motor that stands at its greatest duty for 2 s; an input voltage error is one that lasts 0.1 s.
//! - A backup holds the EEPROM, gains and profiles; the startup configuration brings back the latter two.
//! - Below 2.8 V it does not run, and comes up as after a reboot.
//! - After a shutdown, writing 1 to torque enable fails (result fail) until a reboot.

mod instructions;

use super::conditions::ServoConditions;
use super::control_table::{Area, ControlTable};
use super::line::derived_seed;
use super::motor::{Drive, Gains};
use super::plant::Plant;
use super::servo_table::*;
use crate::link::servo::register::*;
use crate::link::servo::{BAUD_RATES, HardwareErrors, VELOCITY_MODE, WATCHDOG_LATCHED, scale};
use dynamixel_bus::packet::DeviceId;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use std::f64::consts::TAU;
use worm_estimator::config::{Config, PresentCurrent};
use worm_physics::servo::COUNT_RAD;
use worm_physics::servo::physics::FULL_DUTY;

/// Silence of a servo that starts, s.
const BOOT_S: f64 = 0.1;
/// How long the supply may be out of its limits, s.
const VOLTAGE_PATIENCE_S: f64 = 0.1;
/// How long the motor may stand at full duty, s.
const OVERLOAD_PATIENCE_S: f64 = 2.0;
/// Below this voltage the servo's processor does not run.
const BROWNOUT_V: f64 = 2.8;
/// Below this a motor at full duty counts as standing, rad/s.
const STANDING_RAD_PER_S: f64 = 0.05;
/// Time unit of the velocity I gain, s.
const INTEGRAL_TICK_S: f64 = 1e-4;
/// Duty per angle error and count of the position P gain, 1/rad.
const POSITION_P_PER_RAD: f64 = 1.0 / (FULL_DUTY * COUNT_RAD);
/// Position at which an arm hangs, counts: in the middle of the turn that position mode has.
const HANGING_COUNTS: f64 = 2048.0;
/// Counts of a turn.
const TURN: f64 = 4096.0;

/// Drive mode: a goal switches torque on.
const GOAL_SWITCHES_TORQUE_ON: u32 = 1 << 3;
/// Startup configuration: torque comes on with the power.
const STARTUP_TORQUE_ON: u32 = 1 << 0;
/// Startup configuration: gains and profiles come back from the backup.
const STARTUP_RESTORES_RAM: u32 = 1 << 1;

/// What a control table backup holds.
#[derive(Debug, Clone)]
struct Backup {
    eeprom: Vec<u8>,
    ram: Vec<u8>,
}

/// The servo's electronics.
#[derive(Debug, Clone)]
pub(super) struct Servo {
    table: ControlTable,
    backup: Option<Backup>,
    registered: Option<(u16, Vec<u8>)>,
    sign: f64, // +1 where positive is forward, −1 where it is not
    home_counts: f64,
    turn_base_counts: f64, // whole turns that were forgotten at a start
    ramped_goal: f64,      // the velocity goal behind the profile acceleration, counts
    moved_goal: f64,       // the position goal behind the profile velocity, counts
    present_current: PresentCurrent,
    velocity_noise_rad_s: f64,
    rng: Xoshiro256PlusPlus,
    duty_limit: f64, // the smaller of PWM limit and goal PWM
    conditions: ServoConditions,
    starved: bool, // below the brownout voltage
    boots_until_s: f64,
    supervised_s: f64,
    instruction_at_s: f64,
    shut_down: bool,
    voltage_bad_since_s: Option<f64>,
    overloaded_since_s: Option<f64>,
    moved_once: bool,
}

impl Servo {
    /// As it comes from the factory but for ID and baud rate, at the home position.
    pub(super) fn new(config: &Config, baud: Option<u32>, seed: u64) -> Self {
        let mut table = factory_new();
        table.set(ID, i64::from(config.servo.id));
        let code = baud.and_then(|baud| BAUD_RATES.iter().position(|&known| known == baud));
        if let Some(code) = code {
            table.set(BAUD_RATE, code as i64);
        }
        let mut servo = Self {
            table,
            backup: None,
            registered: None,
            sign: if config.servo.positive_is_forward { 1.0 } else { -1.0 },
            home_counts: f64::from(config.servo.home_position),
            turn_base_counts: 0.0,
            ramped_goal: 0.0,
            moved_goal: 0.0,
            present_current: config.virtual_worm.present_current,
            velocity_noise_rad_s: config.virtual_worm.velocity_noise_rad_s,
            rng: Xoshiro256PlusPlus::seed_from_u64(derived_seed(seed ^ 0x5e7f)),
            duty_limit: 1.0,
            conditions: ServoConditions::default(),
            starved: false,
            boots_until_s: 0.0,
            supervised_s: 0.0,
            instruction_at_s: 0.0,
            shut_down: false,
            voltage_bad_since_s: None,
            overloaded_since_s: None,
            moved_once: false,
        };
        servo.forget_turns(0.0);
        servo
    }

    /// Its horn carries an arm, which hangs in the middle of the turn.
    pub(super) fn carry_arm(&mut self) {
        self.home_counts = HANGING_COUNTS;
        self.forget_turns(0.0);
    }

    pub(super) fn id(&self) -> DeviceId {
        DeviceId::new(self.table.get(ID) as u8).unwrap_or(DeviceId::MAX) // the table keeps it within 0 to 252
    }

    /// Whether it listens to this ID besides its own.
    pub(super) fn has_secondary_id(&self, id: DeviceId) -> bool {
        self.table.get(SECONDARY_ID) == u32::from(id.get())
    }

    pub(super) fn baud(&self) -> u32 {
        BAUD_RATES[self.table.get(BAUD_RATE) as usize] // the table keeps it within 0 to 6
    }

    pub(super) fn return_delay_s(&self) -> f64 {
        f64::from(self.table.get(RETURN_DELAY)) * scale::RETURN_DELAY_S
    }

    pub(super) fn status_return_level(&self) -> u32 {
        self.table.get(STATUS_RETURN_LEVEL)
    }

    pub(super) fn alert(&self) -> bool {
        self.table.get(HARDWARE_ERROR_STATUS) != 0
    }

    /// Whether it has power and has started.
    pub(super) fn is_awake(&self, now_s: f64) -> bool {
        !self.conditions.unpowered && !self.starved && now_s >= self.boots_until_s
    }

    /// Whether it has ever moved on command.
    pub(super) fn has_moved(&self) -> bool {
        self.moved_once
    }

    pub(super) fn identity(&self) -> [u8; 3] {
        let [low, high] = (self.table.get(MODEL_NUMBER) as u16).to_le_bytes();
        [low, high, self.table.get(FIRMWARE_VERSION) as u8]
    }

    /// Notes that an instruction packet was on the bus, which resets the bus watchdog.
    pub(super) fn note_instruction(&mut self, now_s: f64) {
        self.instruction_at_s = now_s;
    }

    pub(super) fn set_conditions(&mut self, conditions: ServoConditions, plant: &mut Plant, now_s: f64) {
        let was_unpowered = std::mem::replace(&mut self.conditions, conditions).unpowered;
        if conditions.unpowered || was_unpowered {
            self.restart(plant, now_s);
        }
        let model_number = conditions
            .model_number
            .map_or_else(|| i64::from(crate::link::servo::XL330_M288_MODEL), i64::from);
        self.table.set(MODEL_NUMBER, model_number);
        let firmware = conditions.firmware.map_or(FIRMWARE, i64::from);
        self.table.set(FIRMWARE_VERSION, firmware);
    }

    /// Looks after itself: watchdog, voltage, temperature, load. To be called at least every few ms.
    pub(super) fn supervise(&mut self, plant: &mut Plant, now_s: f64) {
        let starved = plant.motor().bus_v() < BROWNOUT_V;
        if starved != self.starved {
            self.starved = starved;
            self.restart(plant, now_s);
        }
        if !self.is_awake(now_s) {
            return;
        }
        self.supervise_watchdog(plant, now_s);
        self.follow_profile(plant, now_s);
        let motor = plant.motor();
        let mut errors = self.conditions.hardware_errors;
        let voltage_counts = motor.bus_v() / scale::VOLTAGE_V;
        let voltage_bad = voltage_counts < f64::from(self.table.get(MIN_VOLTAGE_LIMIT))
            || voltage_counts > f64::from(self.table.get(MAX_VOLTAGE_LIMIT));
        if lasts(&mut self.voltage_bad_since_s, voltage_bad, now_s, VOLTAGE_PATIENCE_S) {
            errors |= HardwareErrors::INPUT_VOLTAGE.0;
        }
        if motor.case_c() > f64::from(self.table.get(TEMPERATURE_LIMIT)) {
            errors |= HardwareErrors::OVERHEATING.0;
        }
        let at_limit = self.torque_on() && motor.duty().abs() > 0.99 * self.duty_limit;
        let overloaded = at_limit && motor.velocity_rad_per_s().abs() < STANDING_RAD_PER_S;
        if lasts(&mut self.overloaded_since_s, overloaded, now_s, OVERLOAD_PATIENCE_S) {
            errors |= HardwareErrors::OVERLOAD.0;
        }
        let known = self.table.get(HARDWARE_ERROR_STATUS) as u8;
        if errors & !known != 0 {
            self.table.set(HARDWARE_ERROR_STATUS, i64::from(errors | known));
            if u32::from(errors) & self.table.get(SHUTDOWN) != 0 {
                self.shut_down = true;
                self.table.set(TORQUE_ENABLE, 0);
                self.drive(plant);
            }
        }
    }

    fn supervise_watchdog(&mut self, plant: &mut Plant, now_s: f64) {
        let watchdog = self.table.get(BUS_WATCHDOG);
        let armed = (1..=127).contains(&watchdog) && self.torque_on();
        let patience_s = f64::from(watchdog * scale::WATCHDOG_MS) * 1e-3;
        if armed && now_s - self.instruction_at_s >= patience_s {
            self.table.set(BUS_WATCHDOG, i64::from(WATCHDOG_LATCHED));
            if !self.conditions.watchdog_defect {
                self.stand(plant);
            }
        }
    }

    /// Moves the velocity goal on by the profile acceleration, since it was last called.
    fn follow_profile(&mut self, plant: &mut Plant, now_s: f64) {
        let elapsed_s = now_s - std::mem::replace(&mut self.supervised_s, now_s);
        let profile = f64::from(self.table.get(PROFILE_VELOCITY).min(self.table.get(VELOCITY_LIMIT)));
        let goal = f64::from(self.table.signed(GOAL_POSITION));
        if profile > 0.0 && self.moved_goal != goal && self.torque_on() {
            let step = profile * scale::VELOCITY_RAD_S / scale::POSITION_RAD * elapsed_s;
            self.moved_goal += (goal - self.moved_goal).clamp(-step, step);
            self.drive(plant);
        }
        let goal = f64::from(self.table.signed(GOAL_VELOCITY));
        let acceleration = f64::from(self.table.get(PROFILE_ACCELERATION));
        if acceleration == 0.0 || self.ramped_goal == goal || !self.torque_on() {
            return;
        }
        let step = acceleration * scale::ACCELERATION_RAD_S2 / scale::VELOCITY_RAD_S * elapsed_s;
        self.ramped_goal += (goal - self.ramped_goal).clamp(-step, step);
        self.drive(plant);
    }

    /// Sets every goal so that the motor stands.
    fn stand(&mut self, plant: &mut Plant) {
        self.table.set(GOAL_VELOCITY, 0);
        self.ramped_goal = 0.0;
        let position = self.position_counts(plant);
        self.table.set(GOAL_POSITION, i64::from(position));
        self.moved_goal = f64::from(position);
        if self.table.get(OPERATING_MODE) as u8 == PWM_MODE {
            self.table.set(GOAL_PWM, 0);
        }
        self.drive(plant);
    }

    fn torque_on(&self) -> bool {
        self.table.get(TORQUE_ENABLE) == 1
    }

    /// +1 where positive counts are forward, with the drive mode's reverse bit.
    fn sign(&self) -> f64 {
        if self.table.get(DRIVE_MODE) & 1 == 1 {
            -self.sign
        } else {
            self.sign
        }
    }

    /// Position without homing offset for a cam angle.
    fn raw_counts(&self, cam_rad: f64) -> f64 {
        self.home_counts + self.sign() * cam_rad / TAU * TURN - self.turn_base_counts
    }

    fn position_counts(&self, plant: &Plant) -> i32 {
        let offset = f64::from(self.table.signed(HOMING_OFFSET));
        (self.raw_counts(plant.motor().angle_rad()) + offset).round() as i32
    }

    fn cam_angle_rad(&self, position_counts: f64) -> f64 {
        let offset = f64::from(self.table.signed(HOMING_OFFSET));
        (position_counts - offset + self.turn_base_counts - self.home_counts) * self.sign() / TURN * TAU
    }

    /// Only the angle within a turn survives a start.
    fn forget_turns(&mut self, cam_rad: f64) {
        self.turn_base_counts = 0.0;
        self.turn_base_counts = (self.raw_counts(cam_rad) / TURN).floor() * TURN;
    }

    /// Power up: RAM as it is initially, no torque unless the startup configuration says otherwise, no errors, position within a turn.
    fn restart(&mut self, plant: &mut Plant, now_s: f64) {
        self.table.reset(Area::Ram, &[]);
        self.table.set(GOAL_PWM, i64::from(self.table.get(PWM_LIMIT)));
        self.table.set(HARDWARE_ERROR_STATUS, 0);
        self.table.set(REGISTERED_INSTRUCTION, 0);
        self.registered = None;
        self.shut_down = false;
        self.voltage_bad_since_s = None;
        self.overloaded_since_s = None;
        self.boots_until_s = now_s + BOOT_S;
        self.forget_turns(plant.motor().angle_rad());
        let startup = self.table.get(STARTUP_CONFIGURATION);
        if startup & STARTUP_RESTORES_RAM != 0
            && let Some(backup) = &self.backup
        {
            self.table.take_registers(&BACKED_UP_RAM, &backup.ram);
        }
        if startup & STARTUP_TORQUE_ON != 0 && !self.conditions.unpowered && !self.starved {
            self.table.set(TORQUE_ENABLE, 1);
            self.stand(plant);
        }
        self.drive(plant);
    }

    /// Tells the bridge what the registers say.
    fn drive(&mut self, plant: &mut Plant) {
        let per_count = scale::DUTY / scale::VELOCITY_RAD_S;
        let gain = |register, unit: f64| f64::from(self.table.get(register)) * unit;
        let mode = self.table.get(OPERATING_MODE) as u8;
        let goal_duty = f64::from(self.table.signed(GOAL_PWM)) * scale::DUTY;
        let duty_limit = (if mode == PWM_MODE { 1.0 } else { goal_duty.abs() })
            .min(f64::from(self.table.get(PWM_LIMIT)) * scale::DUTY)
            .min(1.0);
        self.duty_limit = duty_limit;
        if self.table.get(PROFILE_ACCELERATION) == 0 {
            self.ramped_goal = f64::from(self.table.signed(GOAL_VELOCITY));
        }
        if self.table.get(PROFILE_VELOCITY) == 0 {
            self.moved_goal = f64::from(self.table.signed(GOAL_POSITION));
        }
        let gains = Gains {
            velocity_p: gain(VELOCITY_P_GAIN, per_count / 128.0),
            velocity_i: gain(VELOCITY_I_GAIN, per_count / 65_536.0 / INTEGRAL_TICK_S),
            position_p: gain(POSITION_P_GAIN, POSITION_P_PER_RAD),
            duty_limit,
        };
        let drive = if !self.torque_on() {
            Drive::Off
        } else if mode == VELOCITY_MODE {
            Drive::Velocity(self.sign() * self.ramped_goal * scale::VELOCITY_RAD_S)
        } else if mode == PWM_MODE {
            Drive::Duty((self.sign() * goal_duty).clamp(-duty_limit, duty_limit))
        } else {
            Drive::Position(self.cam_angle_rad(self.moved_goal))
        };
        self.moved_once |= match drive {
            Drive::Off => false,
            Drive::Velocity(goal) | Drive::Duty(goal) => goal != 0.0,
            Drive::Position(goal_rad) => (goal_rad - plant.motor().angle_rad()).abs() > 2.0 * scale::POSITION_RAD,
        };
        plant.set_drive(drive, gains);
    }
}

/// Whether what `holds` has held for `patience_s`.
fn lasts(since_s: &mut Option<f64>, holds: bool, now_s: f64, patience_s: f64) -> bool {
    if !holds {
        *since_s = None;
        return false;
    }
    now_s - *since_s.get_or_insert(now_s) >= patience_s
}
