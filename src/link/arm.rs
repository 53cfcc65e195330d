//! Arming and disarming: torque comes on only on a worm that is prepared, and never stays on when arming fails.

use super::packet::DeviceId;
use super::servo::HardwareErrors;
use super::{Finding, LinkSettings, OperationError, Port, Prepared, StartupError, WormBus, prepare};

/// Why a worm was not armed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArmError {
    /// Torque is off, or was never asked for.
    #[error(transparent)]
    NotArmed(#[from] StartupError),
    /// Torque may be on: neither the answer to switching it on nor that to switching it off came.
    #[error("{cause}; torque could not be switched off again either ({off}): it may be on")]
    TorqueUnknown {
        /// Why arming failed.
        cause: OperationError,
        /// Why torque could not be switched off.
        off: OperationError,
    },
}

/// Prepares the worm as [`prepare`], and switches torque on. Where that cannot be verified, torque goes off again. A servo with a
/// hardware error is restarted before.
///
/// # Errors
/// [`ArmError`]
pub fn arm<P: Port>(
    bus: &mut WormBus<P>,
    settings: &LinkSettings,
    findings: &mut Vec<Finding>,
) -> Result<Prepared, ArmError> {
    let servo = settings.servo_id;
    if bus.hardware_errors(servo).is_ok_and(|errors| !errors.is_none()) {
        // The only way out of a hardware error is a restart (XL330-M288 e-manual, "Hardware Error Status").
        bus.reboot_servo(servo).map_err(StartupError::from)?;
    }
    let prepared = prepare(bus, settings, findings)?;
    if let Err(cause) = bus.set_torque(servo, true) {
        // The servo may have obeyed though it was not heard.
        return Err(match bus.set_torque(servo, false) {
            Ok(()) => ArmError::NotArmed(cause.into()),
            Err(off) => ArmError::TorqueUnknown { cause, off },
        });
    }
    Ok(prepared)
}

/// Switches torque off, and reads why the servo has shut down, if it has. Torque that is off is what counts: where the reason
/// cannot be read, there is none.
///
/// # Errors
/// [`OperationError`]: torque may be on.
pub fn disarm<P: Port>(bus: &mut WormBus<P>, servo: DeviceId) -> Result<Option<HardwareErrors>, OperationError> {
    bus.set_torque(servo, false)?;
    Ok(bus.hardware_errors(servo).ok())
}
