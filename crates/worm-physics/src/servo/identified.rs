//! The XL330-M288-T as it was identified on recordings of a real one.
//!
//! Source: the twelve recordings in `examples/xl330-bench`, made by the authors of BAM, and
//! `wormd explain examples/xl330-bench/bench.toml --out why` on them, whose `why/model.toml` has these values with more digits. Standard errors:
//! torque constant 0.017, winding 0.22, inertia 0.00008, dry friction 0.0013, viscous 0.0011; load friction 0.04 with a share of 0.81 ± 0.07, its
//! square 0.05 with a share of 1.0 ± 0.14. The bench ran with up to 0.7 N m on the gears; a worm's cam asks for 0.01 to 0.1.

use super::ServoMotor;
use crate::effect::{Setting, named_of_servo};

/// Motor and gears.
pub const XL330_IDENTIFIED: ServoMotor = ServoMotor {
    torque_constant: 0.372,
    winding_ohm: 3.32,
    rotor_inertia_kg_m2: 0.00189,
    dry_n_m: 0.0092,
    viscous_n_m_s: 0.0064,
};

/// What was missing: friction by the torque on the gears, in proportion and with its square. Name, and values in the order of the parameters.
pub const XL330_EFFECTS: [(&str, [f64; 2]); 2] = [
    ("load-friction", [0.316, 0.81]),
    ("load-squared-friction", [0.276, 1.0]),
];

/// [`XL330_EFFECTS`] as settings.
pub fn xl330_effects() -> Vec<Setting> {
    let known = XL330_EFFECTS.iter().filter_map(|(name, values)| {
        let effect = named_of_servo(name).ok()?;
        Some(Setting::within(effect, None, values))
    });
    known.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_knows_its_effects() {
        let effects = xl330_effects();
        assert_eq!(effects.len(), XL330_EFFECTS.len());
        for (setting, (name, values)) in effects.iter().zip(XL330_EFFECTS) {
            assert_eq!((setting.effect().name, setting.values()), (name, &values[..]));
        }
    }
}
