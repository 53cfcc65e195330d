//! The simulated devices.

use super::check::Checker;
use super::effect_table::TableFields;
use super::worm::PerCell;
use serde::Deserialize;
use std::collections::BTreeMap;
use worm_physics::effect::{Setting, SettingError};
use worm_physics::servo::identified::{XL330_EFFECTS, XL330_IDENTIFIED};

/// Properties of the virtual worm beyond those in the other sections.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VirtualWorm {
    /// Seed of all its randomness.
    pub seed: u64,
    /// Standard deviation of one position measured by its tracker, m.
    pub noise_m: f64,
    /// Standard deviation of the velocity that its servo reports while it turns, before it is rounded, rad/s.
    pub velocity_noise_rad_s: f64,
    /// Fraction of positions that its tracker does not see.
    pub dropout_share: f64,
    /// Its true largest tip deformations, m, where they differ from `worm.max_deformation_m`.
    pub max_deformation_m: Option<PerCell>,
    /// Damping of its body on its pads, over the critical damping. Without it the body is moved as if it had no mass.
    pub body_damping_ratio: Option<f64>,
    /// Standard deviation of the largest tip deformations from one cycle to the next, as a fraction.
    pub scatter_share: f64,
    /// Dry friction inside the device, N m at the cam.
    pub inner_friction_n_m: f64,
    /// Friction inside the device that grows with speed, N m s/rad at the cam.
    pub inner_viscous_n_m_s_per_rad: f64,
    /// Moment of inertia at the cam, kg m².
    pub inertia_kg_m2: f64,
    /// What else there is about its servo. Given, it takes the place of the default.
    pub servo_effect: Vec<ServoEffect>,
    /// What its servo's present current measures.
    pub present_current: PresentCurrent,
    /// Supply voltage without load, V, where no battery is configured.
    pub supply_v: f64,
    /// Resistance of the supply, ohm, where no battery is configured.
    pub supply_resistance_ohm: f64,
    /// Temperature around the motor, °C.
    pub ambient_c: f64,
}

impl Default for VirtualWorm {
    fn default() -> Self {
        Self {
            seed: 1,
            noise_m: 1e-4,
            velocity_noise_rad_s: 0.008,
            dropout_share: 0.0,
            max_deformation_m: None,
            body_damping_ratio: None,
            scatter_share: 0.01,
            inner_friction_n_m: XL330_IDENTIFIED.dry_n_m,
            inner_viscous_n_m_s_per_rad: XL330_IDENTIFIED.viscous_n_m_s,
            inertia_kg_m2: XL330_IDENTIFIED.rotor_inertia_kg_m2,
            servo_effect: XL330_EFFECTS.map(ServoEffect::identified).to_vec(),
            present_current: PresentCurrent::Winding,
            supply_v: 5.0,
            supply_resistance_ohm: 0.2,
            ambient_c: 25.0,
        }
    }
}

/// Effects of a servo on a bench that a worm's servo cannot have, and what has them instead.
const NOT_OF_A_WORM: [(&str, &str); 3] = [
    (
        "gear-backlash",
        "the body follows the cam without play: give the worm `[[effect]] name = \"backlash\"`",
    ),
    (
        "supply-sag",
        "give virtual_worm.supply_resistance_ohm, or battery.internal_resistance_ohm",
    ),
    (
        "zero-offset",
        "a cam has no angle at which it hangs down: leave it out, or give servo.home_position",
    ),
];

/// An effect of the servo, as in a servo's model and in the file: see [`worm_physics::effect::SERVO_LIBRARY`].
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ServoEffect {
    /// Its name in the library.
    pub name: String,
    /// Its law, where it is a table.
    #[serde(flatten)]
    pub table: TableFields,
    /// Its parameters by name.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}

impl ServoEffect {
    /// One with these values, in the order of its parameters.
    fn identified((name, values): (&str, [f64; 2])) -> Self {
        let parameters = worm_physics::effect::named_of_servo(name)
            .into_iter()
            .flat_map(|effect| effect.parameters);
        Self {
            name: name.to_owned(),
            table: TableFields::default(),
            parameters: parameters
                .zip(values)
                .map(|(parameter, value)| (parameter.name.to_owned(), value))
                .collect(),
        }
    }

    /// The effect as a setting.
    ///
    /// # Errors
    /// [`SettingError`] for an unknown name or parameter, and a value out of range.
    pub fn setting(&self) -> Result<Setting, SettingError> {
        if TableFields::is_of(&self.name) {
            TableFields::refuse_parameters(&self.parameters, "acts_on, axis, grid, value and period")?;
            return Setting::of_servo_table(self.table.table()?);
        }
        self.table.refuse_in(&self.name)?;
        Setting::of_servo_by_names(&self.name, &self.parameters)
    }

    fn check(&self, checker: &mut Checker) {
        let key = "virtual_worm.servo_effect";
        let quoted = || format!("\"{}\"", self.name);
        match NOT_OF_A_WORM.iter().find(|(name, _)| *name == self.name) {
            Some((_, remedy)) => checker.require(false, key, quoted(), remedy),
            None => {
                if let Err(error) = self.setting() {
                    checker.require(false, key, quoted(), error);
                }
            }
        }
    }
}

/// What a servo reports as its present current.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PresentCurrent {
    /// The current in the winding.
    #[default]
    Winding,
    /// The current from the supply.
    Supply,
    /// The duty of the bridge, in steps of 1/885: no current at all.
    Duty,
}

impl VirtualWorm {
    /// Every `[[virtual_worm.servo_effect]]`, as a setting of the physics.
    ///
    /// # Errors
    /// [`SettingError`] for an effect that a checked configuration cannot have.
    pub fn servo_effects(&self) -> Result<Vec<Setting>, SettingError> {
        self.servo_effect.iter().map(ServoEffect::setting).collect()
    }

    pub(super) fn check(&self, cells: usize, checker: &mut Checker) {
        checker.range("virtual_worm.noise_m", self.noise_m, 0.0..=5e-3, "m");
        checker.range(
            "virtual_worm.velocity_noise_rad_s",
            self.velocity_noise_rad_s,
            0.0..=0.1,
            "rad/s",
        );
        checker.range("virtual_worm.dropout_share", self.dropout_share, 0.0..=0.9, "");
        if let Some(bounds) = &self.max_deformation_m {
            bounds.check("virtual_worm.max_deformation_m", cells, 1e-6..=0.1, "m", checker);
        }
        if let Some(ratio) = self.body_damping_ratio {
            checker.range("virtual_worm.body_damping_ratio", ratio, 0.02..=5.0, "");
        }
        checker.range("virtual_worm.scatter_share", self.scatter_share, 0.0..=0.3, "");
        checker.range(
            "virtual_worm.inner_friction_n_m",
            self.inner_friction_n_m,
            0.0..=10.0,
            "N m",
        );
        let viscous = self.inner_viscous_n_m_s_per_rad;
        checker.range(
            "virtual_worm.inner_viscous_n_m_s_per_rad",
            viscous,
            0.0..=10.0,
            "N m s/rad",
        );
        checker.range("virtual_worm.inertia_kg_m2", self.inertia_kg_m2, 1e-6..=1.0, "kg m²");
        for effect in &self.servo_effect {
            effect.check(checker);
        }
        checker.range("virtual_worm.supply_v", self.supply_v, 0.0..=60.0, "V");
        checker.range(
            "virtual_worm.supply_resistance_ohm",
            self.supply_resistance_ohm,
            0.0..=10.0,
            "ohm",
        );
        checker.range("virtual_worm.ambient_c", self.ambient_c, -20.0..=80.0, "°C");
    }
}
