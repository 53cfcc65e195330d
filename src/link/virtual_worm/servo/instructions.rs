//! The instructions that a servo carries out: reads and writes of its control table, reboot, reset and backup.

use super::super::control_table::{Area, Entry};
use super::super::plant::Plant;
use super::super::servo_table::*;
use super::{Backup, GOAL_SWITCHES_TORQUE_ON, Servo};
use crate::link::Register;
use crate::link::servo::register::*;
use crate::link::servo::{POSITION_MODE, WATCHDOG_LATCHED, scale};
use dynamixel_bus::packet::{BackupAction, ResetScope, StatusError};
use rand_distr::{Distribution, StandardNormal};
use worm_estimator::config::PresentCurrent;

impl Servo {
    /// Bytes of the control table as they are now.
    pub(in super::super) fn read(
        &mut self,
        address: u16,
        length: u16,
        plant: &Plant,
        now_s: f64,
    ) -> Result<&[u8], StatusError> {
        self.refresh(plant, now_s);
        self.table.read(address, length)
    }

    fn refresh(&mut self, plant: &Plant, now_s: f64) {
        let motor = plant.motor();
        let sign = self.sign();
        let turning = motor.velocity_rad_per_s() != 0.0;
        let error: f64 = if turning {
            StandardNormal.sample(&mut self.rng)
        } else {
            0.0
        };
        let velocity = scale::velocity_counts(sign * motor.velocity_rad_per_s() + self.velocity_noise_rad_s * error);
        let counts = |value: f64, unit: f64| (value / unit).round() as i64;
        let moving = velocity.unsigned_abs() > self.table.get(MOVING_THRESHOLD);
        let position = i64::from(self.position_counts(plant));
        let ramped_goal = self.ramped_goal.round() as i64;
        let moved_goal = self.moved_goal.round() as i64;
        let current = match self.present_current {
            PresentCurrent::Winding => counts(sign * motor.current_a(), scale::CURRENT_A),
            PresentCurrent::Supply => counts(sign * motor.duty().abs() * motor.current_a(), scale::CURRENT_A),
            PresentCurrent::Duty => counts(sign * motor.duty(), scale::DUTY),
        };
        for (register, value) in [
            (REALTIME_TICK, (now_s * 1e3) as i64 % 32_768),
            (MOVING, i64::from(moving)),
            (PRESENT_PWM, counts(sign * motor.duty(), scale::DUTY)),
            (PRESENT_CURRENT, current),
            (PRESENT_VELOCITY, i64::from(velocity)),
            (PRESENT_POSITION, position),
            (VELOCITY_TRAJECTORY, ramped_goal),
            (POSITION_TRAJECTORY, moved_goal),
            (PRESENT_INPUT_VOLTAGE, counts(motor.bus_v(), scale::VOLTAGE_V)),
            (PRESENT_TEMPERATURE, counts(motor.case_c().clamp(0.0, 255.0), 1.0)),
        ] {
            self.table.set(register, value);
        }
    }

    /// Everything a write must pass before anything of it happens.
    fn check_write(&self, address: u16, data: &[u8]) -> Result<Vec<(&'static Entry, i64)>, StatusError> {
        let writes = self.table.check_write(address, data, self.torque_on())?;
        let latched = self.table.get(BUS_WATCHDOG) == u32::from(WATCHDOG_LATCHED);
        for &(entry, value) in &writes {
            let magnitude = value.unsigned_abs();
            let beyond = |limit| magnitude > u64::from(self.table.get(limit));
            if latched && (is_goal(entry.register) || (entry.register == BUS_WATCHDOG && value != 0)) {
                return Err(StatusError::DataRange);
            }
            let beyond_limit = match entry.register {
                GOAL_PWM => beyond(PWM_LIMIT),
                GOAL_CURRENT => beyond(CURRENT_LIMIT),
                GOAL_VELOCITY => beyond(VELOCITY_LIMIT),
                GOAL_POSITION if self.table.get(OPERATING_MODE) as u8 == POSITION_MODE => {
                    let range =
                        i64::from(self.table.get(MIN_POSITION_LIMIT))..=i64::from(self.table.get(MAX_POSITION_LIMIT));
                    !range.contains(&value)
                }
                _ => false,
            };
            if beyond_limit {
                return Err(StatusError::DataLimit);
            }
            match entry.register {
                OPERATING_MODE if !MODES.contains(&(value as u8)) => return Err(StatusError::DataRange),
                TORQUE_ENABLE if value == 1 && self.shut_down => return Err(StatusError::ResultFail),
                _ => {}
            }
        }
        Ok(writes)
    }

    pub(in super::super) fn write(&mut self, address: u16, data: &[u8], plant: &mut Plant) -> Result<(), StatusError> {
        for (entry, value) in self.check_write(address, data)? {
            if is_goal(entry.register) && self.table.get(DRIVE_MODE) & GOAL_SWITCHES_TORQUE_ON != 0 && !self.shut_down {
                self.table.set(TORQUE_ENABLE, 1);
            }
            let before = self.table.get(entry.register);
            self.table.set(entry.register, value);
            match entry.register {
                OPERATING_MODE => {
                    self.table.set(GOAL_PWM, i64::from(self.table.get(PWM_LIMIT)));
                    plant.reset_loop();
                }
                TORQUE_ENABLE if value == 1 && before == 0 => {
                    plant.reset_loop();
                    self.stand(plant);
                }
                _ => {}
            }
        }
        self.drive(plant);
        Ok(())
    }

    pub(in super::super) fn register_write(&mut self, address: u16, data: &[u8]) -> Result<(), StatusError> {
        self.check_write(address, data)?;
        self.registered = Some((address, data.to_vec()));
        self.table.set(REGISTERED_INSTRUCTION, 1);
        Ok(())
    }

    pub(in super::super) fn action(&mut self, plant: &mut Plant) -> Result<(), StatusError> {
        let (address, data) = self.registered.take().ok_or(StatusError::Instruction)?;
        self.table.set(REGISTERED_INSTRUCTION, 0);
        self.write(address, &data, plant)
    }

    pub(in super::super) fn reboot(&mut self, plant: &mut Plant, now_s: f64) -> Result<(), StatusError> {
        self.restart(plant, now_s);
        Ok(())
    }

    pub(in super::super) fn factory_reset(
        &mut self,
        scope: ResetScope,
        plant: &mut Plant,
        now_s: f64,
    ) -> Result<(), StatusError> {
        match scope {
            ResetScope::All => self.table.reset(Area::Eeprom, &[]),
            ResetScope::AllButId => self.table.reset(Area::Eeprom, &[ID]),
            ResetScope::AllButIdAndBaudRate => self.table.reset(Area::Eeprom, &[ID, BAUD_RATE]),
        }
        self.restart(plant, now_s);
        Ok(())
    }

    pub(in super::super) fn clear_multi_turn(&mut self, plant: &mut Plant) -> Result<(), StatusError> {
        if plant.motor().velocity_rad_per_s() != 0.0 {
            return Err(StatusError::ResultFail);
        }
        self.forget_turns(plant.motor().angle_rad());
        self.stand(plant);
        Ok(())
    }

    pub(in super::super) fn backup(
        &mut self,
        action: BackupAction,
        plant: &mut Plant,
        now_s: f64,
    ) -> Result<(), StatusError> {
        match action {
            BackupAction::Store if self.torque_on() => return Err(StatusError::Access),
            BackupAction::Store => {
                self.backup = Some(Backup {
                    eeprom: self.table.copy_of(Area::Eeprom),
                    ram: self.table.copy_of(Area::Ram),
                });
                self.table.set(BACKUP_READY, 1);
            }
            BackupAction::Restore => {
                let backup = self.backup.as_ref().ok_or(StatusError::ResultFail)?;
                self.table.take_from(Area::Eeprom, &backup.eeprom);
                self.restart(plant, now_s);
            }
        }
        Ok(())
    }
}

/// Whether a write to this register is a command to the motor.
fn is_goal(register: Register) -> bool {
    [GOAL_PWM, GOAL_CURRENT, GOAL_VELOCITY, GOAL_POSITION].contains(&register)
}
