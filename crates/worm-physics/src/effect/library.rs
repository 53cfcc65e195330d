//! Every effect by its name.

use super::definition::Effect;
use super::error::SettingError;
use super::{canal, contact, drive, load, pad, sensor};

/// Every effect, in the order in which reports list them.
pub static LIBRARY: [&Effect; 22] = [
    &contact::UNEQUAL_CLAMPING,
    &pad::UNEQUAL_STIFFNESS,
    &contact::DIRECTIONAL_FRICTION,
    &contact::BREAKAWAY_FRICTION,
    &pad::HARDENING,
    &pad::CREEP,
    &pad::HYSTERESIS,
    &load::VISCOUS_DRAG,
    &load::CONSTANT_DRAG,
    &load::PAYLOAD,
    &canal::SLOPE_ERROR,
    &load::TETHER_DRAG,
    &drive::LOST_STROKE,
    &drive::ACTUATOR_COMPLIANCE,
    &drive::BACKLASH,
    &drive::STEP_OVERLAP,
    &canal::SLICK_PATCH,
    &contact::WEAR,
    &drive::MOTOR_DROOP,
    &sensor::SCALE,
    &sensor::LATENCY,
    &canal::SLOPE_CLAMPING,
];

/// The one effect that changes when things happen and not where.
pub static MOTOR_DROOP: &Effect = &drive::MOTOR_DROOP;

/// Similarity (Jaro and Winkler) from which a name is suggested for another.
const SIMILAR: f64 = 0.8;

/// The effect of a name.
///
/// # Errors
/// [`SettingError::Unknown`] with the nearest name, where one is near, and all that there are.
pub fn named(name: &str) -> Result<&'static Effect, SettingError> {
    let found = LIBRARY.iter().find(|effect| effect.name == name);
    found.copied().ok_or_else(|| unknown(name, &LIBRARY))
}

/// The error for a name that a library does not have.
pub(super) fn unknown(name: &str, library: &[&'static Effect]) -> SettingError {
    let names: Vec<&str> = library.iter().map(|effect| effect.name).collect();
    SettingError::Unknown {
        name: name.to_owned(),
        nearest: nearest(name, library),
        names: names.join(", "),
    }
}

/// The name most like one that was mistyped.
fn nearest(name: &str, library: &[&'static Effect]) -> Option<&'static str> {
    let similar = library
        .iter()
        .map(|effect| (strsim::jaro_winkler(name, effect.name), effect.name));
    let best = similar.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > SIMILAR).then_some(best.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_name_gets_the_nearest_as_a_suggestion() {
        for (typed, meant) in [
            ("slick-path", "slick-patch"),
            ("moter-droop", "motor-droop"),
            ("Wear", "wear"),
            ("unequal-stifness", "unequal-stiffness"),
        ] {
            let error = named(typed).expect_err("mistyped").to_string();
            let expected =
                format!("there is no effect `{typed}` (did you mean `{meant}`?): the library has unequal-clamping, ");
            assert!(error.starts_with(&expected), "{error}");
            assert!(error.ends_with(", slope-clamping"), "{error}");
        }
        let error = named("gremlins").expect_err("unknown").to_string();
        assert!(
            error.starts_with("there is no effect `gremlins`: the library has unequal-clamping, "),
            "{error}"
        );
    }

    #[test]
    fn twins_are_mutual_effects_of_the_library() {
        for effect in LIBRARY {
            for twin in effect.twins {
                let twin = named(twin).expect("an effect of the library");
                assert!(twin.is_twin_of(effect) && effect.is_twin_of(twin), "{}", effect.name);
            }
            assert!(!effect.is_twin_of(effect), "{}", effect.name);
        }
    }

    #[test]
    fn cells_of_an_effect_of_any_cell_have_no_twins() {
        let lost_stroke = named("lost-stroke").expect("an effect");
        assert_eq!(
            lost_stroke.all_twins(None),
            ["sensor-scale", "sensor-scale, where all cells lose alike"]
        );
        assert!(lost_stroke.all_twins(Some(1)).is_empty());
        let clamping = named("unequal-clamping").expect("an effect");
        assert_eq!(
            clamping.all_twins(Some(1)),
            ["friction-coefficient of that cell (only μN shows)"]
        );
    }
}
