//! The XL330-M288-T's control table: every register that a client may touch, its initial value and its range.
//!
//! Source: ROBOTIS e-manual, "XL330-M288", "Control Table of EEPROM Area" and "… of RAM Area". Left out are the indirect
//! addresses (168 and up), and current modes (0 and 5), which the virtual servo refuses with a range error.

use super::control_table::{ControlTable, Entry, eeprom, ram, read_only};
use crate::link::Register;
use crate::link::servo::register::*;
use crate::link::servo::{POSITION_MODE, VELOCITY_MODE, XL330_M288_MODEL};

/// Firmware version: one whose bus watchdog stops the motor.
pub(super) const FIRMWARE: i64 = 53;

/// Full duty in counts of 0.113 %.
const FULL_PWM: i64 = crate::link::servo::FULL_PWM as i64;
/// Position over many turns.
pub(super) const EXTENDED_POSITION_MODE: u8 = 4;
/// The goal is the bridge's duty.
pub(super) const PWM_MODE: u8 = 16;
/// Operating modes that the virtual servo has.
pub(super) const MODES: [u8; 4] = [VELOCITY_MODE, POSITION_MODE, EXTENDED_POSITION_MODE, PWM_MODE];

pub(super) const SECONDARY_ID: Register = Register::new(12, 1, "secondary ID");
const MODEL_INFORMATION: Register = Register::new(2, 4, "model information");
const PROTOCOL_TYPE: Register = Register::new(13, 1, "protocol type");
pub(super) const MOVING_THRESHOLD: Register = Register::new(24, 4, "moving threshold");
const PWM_SLOPE: Register = Register::new(62, 1, "PWM slope");
const LED: Register = Register::new(65, 1, "LED");
pub(super) const REGISTERED_INSTRUCTION: Register = Register::new(69, 1, "registered instruction");
pub(super) const GOAL_CURRENT: Register = Register::new(102, 2, "goal current");
pub(super) const VELOCITY_TRAJECTORY: Register = Register::new(136, 4, "velocity trajectory");
pub(super) const POSITION_TRAJECTORY: Register = Register::new(140, 4, "position trajectory");
pub(super) const BACKUP_READY: Register = Register::new(147, 1, "backup ready");

/// What a control table backup holds of the RAM (e-manual, Protocol 2.0, "Control Table Backup").
pub(super) const BACKED_UP_RAM: [Register; 9] = [
    VELOCITY_I_GAIN,
    VELOCITY_P_GAIN,
    POSITION_D_GAIN,
    POSITION_I_GAIN,
    POSITION_P_GAIN,
    FEEDFORWARD_2ND_GAIN,
    FEEDFORWARD_1ST_GAIN,
    PROFILE_ACCELERATION,
    PROFILE_VELOCITY,
];

const I32: (i64, i64) = (i32::MIN as i64, i32::MAX as i64);

static ENTRIES: [Entry; 54] = [
    read_only(MODEL_NUMBER, XL330_M288_MODEL as i64),
    read_only(MODEL_INFORMATION, 0),
    read_only(FIRMWARE_VERSION, FIRMWARE),
    eeprom(ID, 1, 0, 252),
    eeprom(BAUD_RATE, 1, 0, 6),
    eeprom(RETURN_DELAY, 250, 0, 254),
    eeprom(DRIVE_MODE, 0, 0, 13),
    eeprom(OPERATING_MODE, POSITION_MODE as i64, 0, 16),
    eeprom(SECONDARY_ID, 255, 0, 255),
    eeprom(PROTOCOL_TYPE, 2, 2, 2),
    eeprom(HOMING_OFFSET, 0, -1_044_479, 1_044_479),
    eeprom(MOVING_THRESHOLD, 10, 0, 2047),
    eeprom(TEMPERATURE_LIMIT, 70, 0, 100),
    eeprom(MAX_VOLTAGE_LIMIT, 70, 31, 70),
    eeprom(MIN_VOLTAGE_LIMIT, 35, 31, 70),
    eeprom(PWM_LIMIT, FULL_PWM, 0, FULL_PWM),
    eeprom(CURRENT_LIMIT, 1750, 0, 1750),
    eeprom(VELOCITY_LIMIT, 445, 0, 2047),
    eeprom(MAX_POSITION_LIMIT, 4095, 0, 4095),
    eeprom(MIN_POSITION_LIMIT, 0, 0, 4095),
    eeprom(STARTUP_CONFIGURATION, 0, 0, 3),
    eeprom(PWM_SLOPE, 140, 1, 255),
    eeprom(SHUTDOWN, 53, 0, 63),
    ram(TORQUE_ENABLE, 0, 0, 1),
    ram(LED, 0, 0, 1),
    ram(STATUS_RETURN_LEVEL, 2, 0, 2),
    read_only(REGISTERED_INSTRUCTION, 0),
    read_only(HARDWARE_ERROR_STATUS, 0),
    ram(VELOCITY_I_GAIN, 1600, 0, 16_383),
    ram(VELOCITY_P_GAIN, 180, 0, 16_383),
    ram(POSITION_D_GAIN, 0, 0, 16_383),
    ram(POSITION_I_GAIN, 0, 0, 16_383),
    ram(POSITION_P_GAIN, 400, 0, 16_383),
    ram(FEEDFORWARD_2ND_GAIN, 0, 0, 16_383),
    ram(FEEDFORWARD_1ST_GAIN, 0, 0, 16_383),
    ram(BUS_WATCHDOG, 0, 0, 127),
    ram(GOAL_PWM, FULL_PWM, -FULL_PWM, FULL_PWM),
    ram(GOAL_CURRENT, 0, -1750, 1750),
    ram(GOAL_VELOCITY, 0, I32.0, I32.1),
    ram(PROFILE_ACCELERATION, 0, 0, 32_767),
    ram(PROFILE_VELOCITY, 0, 0, 32_767),
    ram(GOAL_POSITION, 0, I32.0, I32.1),
    read_only(REALTIME_TICK, 0),
    read_only(MOVING, 0),
    read_only(MOVING_STATUS, 0),
    read_only(PRESENT_PWM, 0),
    read_only(PRESENT_CURRENT, 0),
    read_only(PRESENT_VELOCITY, 0),
    read_only(PRESENT_POSITION, 0),
    read_only(VELOCITY_TRAJECTORY, 0),
    read_only(POSITION_TRAJECTORY, 0),
    read_only(PRESENT_INPUT_VOLTAGE, 0),
    read_only(PRESENT_TEMPERATURE, 0),
    read_only(BACKUP_READY, 0),
];

/// A servo as it comes from the factory.
pub(super) fn factory_new() -> ControlTable {
    ControlTable::new(&ENTRIES, BACKUP_READY.end())
}
