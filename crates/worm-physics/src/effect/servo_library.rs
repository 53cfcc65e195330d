//! Every effect of a servo by its name.

use super::definition::Effect;
use super::error::SettingError;
use super::library::{LIBRARY, unknown};
use super::servo;

/// Every effect of a servo on a bench, in the order in which reports list them.
pub static SERVO_LIBRARY: [&Effect; 11] = [
    &servo::STRIBECK,
    &servo::LOAD,
    &servo::LOAD_SQUARED,
    &servo::BACK_DRIVING,
    &servo::PLAY,
    &servo::RIPPLE,
    &servo::SAG,
    &servo::HEAT,
    &servo::DELAY,
    &servo::DEAD_DUTY,
    &servo::ZERO,
];

/// The effect of a servo of a name.
///
/// # Errors
/// [`SettingError::Unknown`] with the nearest name, where one is near, and all that there are.
pub fn named_of_servo(name: &str) -> Result<&'static Effect, SettingError> {
    let found = SERVO_LIBRARY.iter().find(|effect| effect.name == name);
    found.copied().ok_or_else(|| unknown(name, &SERVO_LIBRARY))
}

/// The effect of a name, of a worm or of a servo: no name is in both libraries.
///
/// # Errors
/// [`SettingError::Unknown`] with the nearest name, where one is near, and all that there are.
pub fn named_of_either(name: &str) -> Result<&'static Effect, SettingError> {
    let both: Vec<&'static Effect> = LIBRARY.iter().chain(&SERVO_LIBRARY).copied().collect();
    let found = both.iter().find(|effect| effect.name == name);
    found.copied().ok_or_else(|| unknown(name, &both))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Setting;
    use crate::servo::{Pendulum, ServoMotor, ServoPhysics};

    fn bench() -> ServoPhysics {
        let pendulum = Pendulum {
            mass_kg: 0.5,
            length_m: 0.1,
            arm_mass_kg: 0.0,
            zero_rad: 0.0,
        };
        ServoPhysics::new(ServoMotor::XL330_M288_T, pendulum, 7.4)
    }

    #[test]
    fn each_changes_the_servo_and_the_neutral_ones_do_not_move_it() {
        for effect in SERVO_LIBRARY {
            let severity = effect.severity();
            let with = |severity: f64| {
                let values = effect.values_with_neutral_shape(severity);
                bench().with(&[Setting::within(effect, None, &values)])
            };
            assert_ne!(
                with(severity.neutral),
                with(severity.neutral + severity.notable),
                "{}",
                effect.name
            );
            for shape in effect.starting_shapes((0.0, 1.0)) {
                assert_eq!(shape.len() + 1, effect.parameters.len(), "{}", effect.name);
                for (value, parameter) in shape.iter().zip(&effect.parameters[1..]) {
                    assert!((parameter.min..=parameter.max).contains(value), "{}", effect.name);
                }
            }
        }
    }

    #[test]
    fn no_name_is_one_of_a_worms_effect() {
        for effect in SERVO_LIBRARY {
            assert!(LIBRARY.iter().all(|other| other.name != effect.name), "{}", effect.name);
        }
        for (name, meant) in [("load-frictoin", "load-friction"), ("paylaod", "payload")] {
            let error = named_of_either(name).expect_err("mistyped").to_string();
            assert!(error.contains(&format!("did you mean `{meant}`?")), "{error}");
        }
    }
}
