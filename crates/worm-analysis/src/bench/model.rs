//! The model of a servo as a file: what `explain` writes back, and `predict` reads.
//!
//! ```toml
//! [servo]
//! name = "xl330-m288-t"
//! torque_constant_n_m_per_a = 0.39
//! winding_ohm = 4.1
//! rotor_inertia_kg_m2 = 0.0016
//! dry_n_m = 0.009
//! viscous_n_m_s = 0.006
//! zero_rad = -0.014
//! current = "duty"                 # what the reported current measures: winding, supply, or duty
//!
//! [[effect]]
//! name = "load-friction"
//! coefficient = 0.3
//! motor_share = 0.9
//! ```

use crate::explain::model_update::table_fields;
use crate::explain::servo::Measures;
use serde::Deserialize;
use std::fmt::Write;
use std::path::Path;
use worm_estimator::config::{ServoEffect, read_text};
use worm_log::ReadError;
use worm_physics::effect::Setting;
use worm_physics::servo::{Pendulum, ServoMotor, ServoPhysics};

/// The one servo whose data sheet is known here.
pub const XL330: &str = "xl330-m288-t";
const REMEDY: &str = "a servo's model has a section [servo] with name, torque_constant_n_m_per_a, winding_ohm, rotor_inertia_kg_m2, dry_n_m, \
                      viscous_n_m_s and zero_rad, and [[effect]] sections";

/// A servo's model.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoModel {
    /// The servo's name.
    pub name: String,
    /// Motor and gears.
    pub motor: ServoMotor,
    /// Angle at which the arm hangs down, rad.
    pub zero_rad: f64,
    /// What its reported current measures.
    pub current: Measures,
    /// The effects in it.
    pub effects: Vec<Setting>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    servo: Servo,
    #[serde(default)]
    effect: Vec<ServoEffect>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Servo {
    name: String,
    torque_constant_n_m_per_a: f64,
    winding_ohm: f64,
    rotor_inertia_kg_m2: f64,
    dry_n_m: f64,
    viscous_n_m_s: f64,
    #[serde(default)]
    zero_rad: f64,
    current: Option<Measures>,
}

impl ServoModel {
    /// The XL330-M288-T by its data sheet.
    pub fn xl330_m288_t() -> Self {
        Self {
            name: XL330.to_owned(),
            motor: ServoMotor::XL330_M288_T,
            zero_rad: 0.0,
            current: Measures::Winding,
            effects: Vec::new(),
        }
    }

    /// Reads a model's file.
    ///
    /// # Errors
    /// [`ReadError`] names file and remedy.
    pub fn load(path: &Path) -> Result<Self, ReadError> {
        let text = read_text(path)
            .map_err(|error| ReadError::whole(path, error.to_string(), "give the file of a servo's model"))?;
        Self::from_toml(&text, path)
    }

    /// As [`load`](Self::load), from a text; errors call it `path`.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, ReadError> {
        let file: File = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| line_of(text, span.start));
            ReadError::at(path, format!("line {line}"), error.message().trim(), REMEDY)
        })?;
        let servo = file.servo;
        for (key, value, max) in [
            ("torque_constant_n_m_per_a", servo.torque_constant_n_m_per_a, 10.0),
            ("winding_ohm", servo.winding_ohm, 1e3),
            ("rotor_inertia_kg_m2", servo.rotor_inertia_kg_m2, 10.0),
            ("dry_n_m", servo.dry_n_m, 10.0),
            ("viscous_n_m_s", servo.viscous_n_m_s, 10.0),
        ] {
            let may_be_zero = matches!(key, "dry_n_m" | "viscous_n_m_s");
            let min = if may_be_zero { 0.0 } else { 1e-9 };
            if !(min..=max).contains(&value) {
                let from = if may_be_zero { "from 0" } else { "above 0, up" };
                return Err(ReadError::whole(
                    path,
                    format!("{key} = {value}"),
                    format!("must be {from} to {max}"),
                ));
            }
        }
        if !(-1.0..=1.0).contains(&servo.zero_rad) {
            return Err(ReadError::whole(
                path,
                format!("zero_rad = {}", servo.zero_rad),
                "must be from -1 to 1 rad",
            ));
        }
        let effects = file.effect.iter().map(|effect| {
            effect
                .setting()
                .map_err(|error| ReadError::whole(path, error.to_string(), REMEDY))
        });
        Ok(Self {
            name: servo.name,
            motor: ServoMotor {
                torque_constant: servo.torque_constant_n_m_per_a,
                winding_ohm: servo.winding_ohm,
                rotor_inertia_kg_m2: servo.rotor_inertia_kg_m2,
                dry_n_m: servo.dry_n_m,
                viscous_n_m_s: servo.viscous_n_m_s,
            },
            zero_rad: servo.zero_rad,
            current: servo.current.unwrap_or(Measures::Winding),
            effects: effects.collect::<Result<_, _>>()?,
        })
    }

    /// The model's file.
    pub fn to_toml(&self) -> String {
        let motor = &self.motor;
        let mut text = format!(
            "[servo]\nname = {}\n# torque per current, and back EMF per velocity (V s/rad)\ntorque_constant_n_m_per_a = {:.5}\n# winding \
             and bridge at 25 °C\nwinding_ohm = {:.4}\n# of the rotor, behind the gears\nrotor_inertia_kg_m2 = {:.6}\n# friction without \
             load\ndry_n_m = {:.6}\nviscous_n_m_s = {:.6}\n# angle at which the arm hangs down\nzero_rad = {:.5}\n# what the reported current measures: winding, supply, or duty\ncurrent = \"{}\"\n",
            toml::Value::from(self.name.as_str()),
            motor.torque_constant,
            motor.winding_ohm,
            motor.rotor_inertia_kg_m2,
            motor.dry_n_m,
            motor.viscous_n_m_s,
            self.zero_rad,
            self.current.name()
        );
        for setting in &self.effects {
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "\n# {}\n[[effect]]\nname = \"{}\"\n",
                setting.effect().sentence,
                setting.effect().name
            );
            for (parameter, value) in setting.effect().parameters.iter().zip(setting.values()) {
                let _ = writeln!(text, "{} = {value:?}", parameter.name);
            }
            if let Some(table) = setting.table() {
                let axes: Vec<(&str, &[f64])> = table
                    .axes()
                    .enumerate()
                    .map(|(number, axis)| (axis.name(), table.grid(number)))
                    .collect();
                text += &table_fields(table.acts_on().name(), &axes, table.period(), table.value());
            }
        }
        text
    }

    /// The physics of this servo on a bench, with its duty limited.
    pub fn on(&self, pendulum: Pendulum, supply_v: f64, duty_limit: f64) -> ServoPhysics {
        let pendulum = Pendulum {
            zero_rad: self.zero_rad,
            ..pendulum
        };
        let physics = ServoPhysics {
            duty_limit,
            ..ServoPhysics::new(self.motor, pendulum, supply_v)
        };
        physics.with(&self.effects)
    }
}

/// The line of a place in a text, from 1.
pub(super) fn line_of(text: &str, at: usize) -> usize {
    text.get(..at).map_or(0, |before| before.matches('\n').count()) + 1
}
