//! Settings of the servo: those that are wrong are corrected, and the duty is limited by what the winding may draw.

use super::{LinkSettings, StartupError};
use crate::link::operations::OperationError;
use crate::link::packet::DeviceId;
use crate::link::servo::{self, HardwareErrors, register, scale};
use crate::link::{Finding, Port, Register, TransactionError, WormBus};

/// Hardware errors at which the servo has to switch torque off by itself.
const REQUIRED_SHUTDOWN: HardwareErrors =
    HardwareErrors(HardwareErrors::OVERHEATING.0 | HardwareErrors::ELECTRICAL_SHOCK.0 | HardwareErrors::OVERLOAD.0);
/// A servo that answers has at least this supply, V: with less its reading is wrong.
pub(super) const LEAST_VOLTAGE_V: f64 = 3.0;
/// How often the voltage is read before it counts as too low.
const VOLTAGE_ATTEMPTS: usize = 3;
/// Resistance of copper grows by this share per kelvin.
const COPPER_PER_K: f64 = 0.00393;
/// Temperature at which the configured resistance holds, °C.
const RESISTANCE_AT_C: f64 = 25.0;

pub(super) fn set_up<P: Port>(
    bus: &mut WormBus<P>,
    settings: &LinkSettings,
    findings: &mut Vec<Finding>,
) -> Result<(), StartupError> {
    let counts = |register: Register, value: f64, unit: f64| {
        let counts = (value / unit).round();
        let greatest = 256f64.powi(i32::from(register.size)) - 1.0;
        if (1.0..=greatest).contains(&counts) {
            Ok(counts as u32)
        } else {
            Err(StartupError::Limit { register, value })
        }
    };
    let velocity_limit = counts(
        register::VELOCITY_LIMIT,
        settings.velocity_limit_rad_s,
        scale::VELOCITY_RAD_S,
    )?;
    let servo_id = settings.servo_id;
    let shutdown = bus.register(servo_id, register::SHUTDOWN)? | u32::from(REQUIRED_SHUTDOWN.0);
    let wanted = [
        (register::RETURN_DELAY, 0),
        (register::DRIVE_MODE, 0),
        (register::OPERATING_MODE, u32::from(servo::VELOCITY_MODE)),
        (register::HOMING_OFFSET, 0),
        (
            register::TEMPERATURE_LIMIT,
            counts(register::TEMPERATURE_LIMIT, settings.temperature_limit_c, 1.0)?,
        ),
        (register::PWM_LIMIT, u32::from(servo::FULL_PWM)),
        (
            register::CURRENT_LIMIT,
            counts(register::CURRENT_LIMIT, settings.current_limit_a, scale::CURRENT_A)?,
        ),
        (register::VELOCITY_LIMIT, velocity_limit),
        (register::STARTUP_CONFIGURATION, 0),
        (register::SHUTDOWN, shutdown),
        (register::PROFILE_ACCELERATION, 0),
        (register::PROFILE_VELOCITY, 0),
    ];
    let (velocity_i, velocity_p) = servo::XL330_M288_VELOCITY_GAINS;
    let gains = [
        (register::VELOCITY_I_GAIN, u32::from(velocity_i)),
        (register::VELOCITY_P_GAIN, u32::from(velocity_p)),
    ];
    // Other models have other gains from the factory, which are not known here.
    let gains = gains
        .into_iter()
        .filter(|_| settings.servo_model == servo::XL330_M288_MODEL);
    for (register, wanted) in wanted.into_iter().chain(gains) {
        let found = match bus.register(servo_id, register) {
            Err(OperationError::Transaction {
                error: TransactionError::Refused { .. },
                ..
            }) if register == register::STARTUP_CONFIGURATION => continue, // an older firmware without it
            found => found?,
        };
        if found != wanted {
            bus.set_register(servo_id, register, wanted)?;
            findings.push(Finding::corrected(
                describe_setting(register, found),
                format!("set to {wanted}"),
            ));
        }
    }
    Ok(())
}

/// What it means that a register was found with a value that it must not have.
fn describe_setting(register: Register, found: u32) -> String {
    let was = format!("{register} of the servo was {found}");
    match register {
        register::RETURN_DELAY => format!("the servo waited {} µs before each answer", found * 2),
        register::DRIVE_MODE if found & 1 != 0 => format!("{was}: it turned in reverse"),
        register::DRIVE_MODE if found & 8 != 0 => format!("{was}: any goal would have switched torque on"),
        register::HOMING_OFFSET => format!(
            "{register} of the servo was {0}: its positions read {0} counts too high, so look at servo.home_position",
            found as i32
        ),
        register::VELOCITY_I_GAIN | register::VELOCITY_P_GAIN => {
            format!("{was}: the motor may oscillate or hardly turn with it")
        }
        register::STARTUP_CONFIGURATION if found & 1 != 0 => format!("{was}: torque would have come on with the power"),
        register::SHUTDOWN => format!("{was}: it would have gone on in spite of overheating, shock or overload"),
        _ => was,
    }
}

/// Limits the duty so that a blocked motor draws no more than the configured current, as far as resistance and supply now say. Returns
/// the limit, in (0, 1].
///
/// In velocity mode the servo limits nothing but its duty (e-manual, "Goal PWM(100)"; "Current Limit(38)" is of the current modes). The
/// goal PWM is in RAM: a limit that follows the supply's voltage wears no EEPROM.
///
/// A warm winding has more resistance, but it cools: the resistance is taken to be no more than that at the reference temperature.
pub(super) fn limit_duty<P: Port>(bus: &mut WormBus<P>, settings: &LinkSettings) -> Result<f64, StartupError> {
    limit_duty_to(bus, settings, servo::FULL_PWM)
}

/// As [`limit_duty`], with another greatest goal PWM: the servo refuses one beyond its PWM limit.
pub(crate) fn limit_duty_to<P: Port>(
    bus: &mut WormBus<P>,
    settings: &LinkSettings,
    most: u16,
) -> Result<f64, StartupError> {
    let servo_id = settings.servo_id;
    let voltage_v = supply_voltage_v(bus, servo_id)?;
    let temperature_c = f64::from(bus.register(servo_id, register::PRESENT_TEMPERATURE)?).min(RESISTANCE_AT_C);
    let resistance_ohm = settings.winding_resistance_ohm * (1.0 + COPPER_PER_K * (temperature_c - RESISTANCE_AT_C));
    let share = settings.current_limit_a * resistance_ohm / voltage_v;
    let counts = (share / scale::DUTY).floor().clamp(1.0, f64::from(most));
    bus.set_register(servo_id, register::GOAL_PWM, counts as u32)?;
    Ok((counts * scale::DUTY).min(1.0))
}

/// The supply as the servo measures it. A reading that is too low to be true is taken again.
fn supply_voltage_v<P: Port>(bus: &mut WormBus<P>, servo_id: DeviceId) -> Result<f64, StartupError> {
    let mut voltage_v = 0.0;
    for _ in 0..VOLTAGE_ATTEMPTS {
        voltage_v = f64::from(bus.register(servo_id, register::PRESENT_INPUT_VOLTAGE)?) * scale::VOLTAGE_V;
        if voltage_v >= LEAST_VOLTAGE_V {
            return Ok(voltage_v);
        }
    }
    Err(StartupError::NoSupply { voltage_v })
}
