//! What the controller does to the servo besides ticking. Each change is read back, since at status return level 1 the servo
//! says nothing to a write. Every wait is bounded; a question is asked up to three times.

use std::time::{Duration, Instant};

use super::packet::DeviceId;
use super::servo::{HardwareErrors, WATCHDOG_LATCHED, register, scale};
use super::{Port, Register, TransactionError, WormBus};

/// How long a device has to answer: more than 16 ms in an FTDI adapter and 14 bytes at 9600 baud both ways.
pub(super) const REPLY_TIME: Duration = Duration::from_millis(60);

/// How often a question is asked before a device counts as silent.
const ATTEMPTS: usize = 3;

/// How long a servo has to come back after a reboot.
const REBOOT_TIME: Duration = Duration::from_secs(2);

/// Why an operation was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum OperationError {
    /// No usable answer, or a refusal.
    #[error("{register}: {error}")]
    Transaction {
        /// What was read or written.
        register: Register,
        /// What came of it.
        error: TransactionError,
    },
    /// A value was written, and another one read back.
    #[error(
        "{register} of device {id}: {wanted} was written, {found} is read back: is torque off, the value in range?"
    )]
    NotKept {
        /// Who.
        id: DeviceId,
        /// What was written.
        register: Register,
        /// What was wanted.
        wanted: u32,
        /// What is there.
        found: u32,
    },
    /// The servo did not come back after a reboot.
    #[error("device {0} has not come back {REBOOT_TIME:?} after its reboot: switch its power off and on")]
    NotBack(DeviceId),
}

impl<P: Port> WormBus<P> {
    /// Switches torque on or off.
    ///
    /// # Errors
    /// [`OperationError`]; [`NotKept`](OperationError::NotKept) when a hardware error keeps torque off.
    pub fn set_torque(&mut self, servo: DeviceId, on: bool) -> Result<(), OperationError> {
        self.set_register(servo, register::TORQUE_ENABLE, u32::from(on))
    }

    /// Reads why the servo has shut down, if it has.
    ///
    /// # Errors
    /// [`OperationError`]
    pub fn hardware_errors(&mut self, servo: DeviceId) -> Result<HardwareErrors, OperationError> {
        let bits = self.register(servo, register::HARDWARE_ERROR_STATUS)?;
        Ok(HardwareErrors(bits as u8))
    }

    /// Sets the goal velocity to zero.
    ///
    /// # Errors
    /// [`OperationError`]; [`NotKept`](OperationError::NotKept) when a latched watchdog locks the goal; the motor then
    /// stands already.
    pub fn stop_motor(&mut self, servo: DeviceId) -> Result<(), OperationError> {
        self.set_register(servo, register::GOAL_VELOCITY, 0)
    }

    /// Clears a latched bus watchdog and sets it again, with the goal at zero in between, so that the motor does not continue with
    /// its old goal. Returns whether it was latched.
    ///
    /// # Errors
    /// [`OperationError`]
    pub fn rearm_watchdog(&mut self, servo: DeviceId, watchdog_ms: u32) -> Result<bool, OperationError> {
        let was_latched = self.register(servo, register::BUS_WATCHDOG)? == u32::from(WATCHDOG_LATCHED);
        self.set_register(servo, register::BUS_WATCHDOG, 0)?;
        self.stop_motor(servo)?;
        self.set_register(
            servo,
            register::BUS_WATCHDOG,
            u32::from(scale::watchdog_counts(watchdog_ms)),
        )?;
        Ok(was_latched)
    }

    /// Reboots the servo, which clears a hardware error, and waits until it is back. Its settings in RAM are then those of
    /// the factory: [`prepare`](super::prepare) it again.
    ///
    /// # Errors
    /// [`OperationError`]
    pub fn reboot_servo(&mut self, servo: DeviceId) -> Result<(), OperationError> {
        let deadline = self.port_mut().now() + REBOOT_TIME;
        // It may lose its receipt in the restart; whether it comes back is what counts.
        let _ = self.reboot(servo, Instant::now() + REPLY_TIME);
        self.set_writes_are_answered(true);
        // A servo that has not gone down yet still answers.
        let waited = self.port_mut().pass_time(REPLY_TIME);
        while waited.is_ok() && self.port_mut().now() < deadline {
            if self.ping(servo, Instant::now() + REPLY_TIME).is_ok() {
                return Ok(());
            }
        }
        Err(OperationError::NotBack(servo))
    }

    /// Reads a register, asking again when the answer is lost.
    pub(crate) fn register(&mut self, id: DeviceId, register: Register) -> Result<u32, OperationError> {
        self.ask_again(|bus, deadline| bus.read_register(id, register, deadline))
            .map_err(|error| OperationError::Transaction { register, error })
    }

    /// Writes a register and reads it back.
    pub(crate) fn set_register(&mut self, id: DeviceId, register: Register, wanted: u32) -> Result<(), OperationError> {
        let mut found = None;
        for _ in 0..ATTEMPTS {
            let written = self.ask_again(|bus, deadline| bus.write_register(id, register, wanted, deadline));
            written.map_err(|error| OperationError::Transaction { register, error })?;
            let read_back = self.register(id, register)?;
            if read_back == wanted {
                return Ok(());
            }
            // A write that is not answered may have got lost without notice.
            found = Some(read_back);
        }
        Err(OperationError::NotKept {
            id,
            register,
            wanted,
            found: found.unwrap_or_default(),
        })
    }

    /// Asks up to three times, as long as the answer is missing or damaged.
    pub(super) fn ask_again<T>(
        &mut self,
        mut ask: impl FnMut(&mut Self, Instant) -> Result<T, TransactionError>,
    ) -> Result<T, TransactionError> {
        let mut attempts_left = ATTEMPTS;
        loop {
            attempts_left -= 1;
            match ask(self, Instant::now() + REPLY_TIME) {
                Err(TransactionError::Silent(_) | TransactionError::Damaged(_)) if attempts_left > 0 => {}
                end => return end,
            }
        }
    }
}
