//! What self-sensing knows of the gears, and how well.

use super::Config;
use super::check::Checker;
use crate::self_sensing::gear::MAX_RIPPLES;
use crate::self_sensing::{CurrentSource, GearModel, PitchSensor, Ripple, SelfSensingConfig};
use crate::winding::Winding;
use serde::{Deserialize, Serialize};
use toml::value::Datetime;
use worm_physics::servo::identified::{XL330_EFFECTS, XL330_IDENTIFIED};

/// What the servo reports as its current.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReportedCurrent {
    /// The current in the winding.
    Winding,
    /// The duty of its bridge.
    Duty,
}

/// How the gears' friction was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CalibrationMode {
    /// On a worm held free: the motor drove nothing else.
    Lifted,
    /// In the canal, on the level.
    Level,
}

/// When and how `wormd calibrate` found the gears' friction.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Calibrated {
    /// When, RFC 3339.
    pub date: String,
    /// How.
    pub mode: CalibrationMode,
    /// Temperature of the servo then, °C.
    pub temperature_c: f64,
    /// Voltage on the bus then, V.
    pub supply_v: f64,
    /// Model number of the servo.
    pub servo_model: u16,
    /// Its ID.
    pub servo_id: u8,
    /// Standard error of the dry friction, N m.
    pub dry_friction_sigma_n_m: f64,
    /// Standard error of the friction that grows with speed, N m s/rad.
    pub viscous_friction_sigma_n_m_s_per_rad: f64,
}

impl Calibrated {
    /// Difference of temperatures, K, from which the friction of grease and seals is another.
    pub const FAR_K: f64 = 15.0;

    /// Why it does not hold for the configured servo at a temperature; none where it does.
    pub fn misfit(&self, config: &Config, temperature_c: f64) -> Option<String> {
        let (servo, apart_k) = (&config.servo, temperature_c - self.temperature_c);
        if (self.servo_model, self.servo_id) != (servo.model_number, servo.id) {
            return Some(format!(
                "the gears were calibrated on a servo of model {} with ID {}, and this is model {} with ID {}",
                self.servo_model, self.servo_id, servo.model_number, servo.id
            ));
        }
        (apart_k.abs() > Self::FAR_K).then(|| {
            format!(
                "the gears were calibrated at {:.0} °C, and the servo has {temperature_c:.0} °C",
                self.temperature_c
            )
        })
    }
}

/// The gears between motor and cam, for what follows from the motor's current. The torque constant and the winding are the servo's.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SelfSensing {
    /// Whether the estimator infers from the motor's current while the worm crawls.
    pub enabled: bool,
    /// What the servo reports as its current.
    pub current: ReportedCurrent,
    /// Standard deviation of `servo.torque_constant_n_m_per_a`, as a share; where the duty is reported that of the resistance, too.
    pub torque_constant_sigma_share: f64,
    /// Inertia of rotor and cam, at the cam, kg m².
    pub inertia_kg_m2: f64,
    /// Dry friction, N m.
    pub dry_friction_n_m: f64,
    /// Friction that grows with speed, N m s/rad.
    pub viscous_friction_n_m_s_per_rad: f64,
    /// Standard deviation of those two together, N m.
    pub friction_sigma_n_m: f64,
    /// Friction for each torque on the gears.
    pub load_friction: f64,
    /// Its standard deviation.
    pub load_friction_sigma: f64,
    /// Which end of the gear train that torque is: 1 the motor's, 0 the cam's.
    pub load_motor_share: f64,
    /// Friction for each square of the torque on the gears, 1/(N m).
    pub load_squared_friction_per_n_m: f64,
    /// As `load_motor_share`, for the square.
    pub load_squared_motor_share: f64,
    /// How often in a turn each ripple of the torque returns.
    pub ripple_waves: Vec<u32>,
    /// Standard deviation of each ripple's sine and cosine, N m.
    pub ripple_sigma_n_m: f64,
    /// Standard deviation of each cell's friction and stiffness about those of `[worm]`, as shares.
    pub worm_sigma_share: f64,
    /// Standard deviation of the pull about that of `canal.slope_deg`, N.
    pub pull_sigma_n: f64,
    /// Gait cycles over which the torque profile is averaged.
    pub memory_cycles: f64,
    /// When and how friction was calibrated, where it was.
    pub calibrated: Option<Calibrated>,
}

impl Default for SelfSensing {
    /// An XL330-M288-T as it was identified on recordings of a real one.
    fn default() -> Self {
        let motor = XL330_IDENTIFIED;
        let [
            (_, [load_friction, load_motor_share]),
            (_, [load_squared, load_squared_motor_share]),
        ] = XL330_EFFECTS;
        Self {
            enabled: true,
            current: ReportedCurrent::Winding,
            torque_constant_sigma_share: 0.02,
            inertia_kg_m2: motor.rotor_inertia_kg_m2,
            dry_friction_n_m: motor.dry_n_m,
            viscous_friction_n_m_s_per_rad: motor.viscous_n_m_s,
            friction_sigma_n_m: 0.005,
            load_friction,
            load_friction_sigma: 0.02,
            load_motor_share,
            load_squared_friction_per_n_m: load_squared,
            load_squared_motor_share,
            ripple_waves: Vec::new(),
            ripple_sigma_n_m: 0.001,
            worm_sigma_share: 0.35,
            pull_sigma_n: 2.5,
            memory_cycles: 40.0,
            calibrated: None,
        }
    }
}

impl SelfSensing {
    pub(super) fn check(&self, checker: &mut Checker) {
        for (key, value, range, unit) in [
            (
                "torque_constant_sigma_share",
                self.torque_constant_sigma_share,
                1e-4..=0.5,
                "",
            ),
            ("inertia_kg_m2", self.inertia_kg_m2, 0.0..=1.0, "kg m^2"),
            ("dry_friction_n_m", self.dry_friction_n_m, 0.0..=10.0, "N m"),
            (
                "viscous_friction_n_m_s_per_rad",
                self.viscous_friction_n_m_s_per_rad,
                0.0..=10.0,
                "N m s/rad",
            ),
            ("friction_sigma_n_m", self.friction_sigma_n_m, 1e-6..=10.0, "N m"),
            ("load_friction", self.load_friction, 0.0..=0.8, ""),
            ("load_friction_sigma", self.load_friction_sigma, 1e-4..=0.5, ""),
            ("load_motor_share", self.load_motor_share, 0.0..=1.0, ""),
            (
                "load_squared_friction_per_n_m",
                self.load_squared_friction_per_n_m,
                0.0..=10.0,
                "1/(N m)",
            ),
            ("load_squared_motor_share", self.load_squared_motor_share, 0.0..=1.0, ""),
            ("ripple_sigma_n_m", self.ripple_sigma_n_m, 1e-6..=1.0, "N m"),
            ("worm_sigma_share", self.worm_sigma_share, 0.01..=1.0, ""),
            ("pull_sigma_n", self.pull_sigma_n, 0.01..=100.0, "N"),
            ("memory_cycles", self.memory_cycles, 5.0..=1e4, "cycles"),
        ] {
            checker.range(&format!("self_sensing.{key}"), value, range, unit);
        }
        if let Some(calibrated) = &self.calibrated {
            checker.require(
                is_moment(&calibrated.date),
                "self_sensing.calibrated.date",
                format!("{:?}", calibrated.date),
                "must be a date with time and zone, as `wormd calibrate` writes it: \"2026-11-25T11:15:05Z\"",
            );
            for (key, value, range, unit) in [
                ("temperature_c", calibrated.temperature_c, -40.0..=120.0, "degrees C"),
                ("supply_v", calibrated.supply_v, 0.0..=60.0, "V"),
                (
                    "dry_friction_sigma_n_m",
                    calibrated.dry_friction_sigma_n_m,
                    0.0..=10.0,
                    "N m",
                ),
                (
                    "viscous_friction_sigma_n_m_s_per_rad",
                    calibrated.viscous_friction_sigma_n_m_s_per_rad,
                    0.0..=10.0,
                    "N m s/rad",
                ),
            ] {
                checker.range(&format!("self_sensing.calibrated.{key}"), value, range, unit);
            }
        }
        checker.require(
            self.ripple_waves.len() <= MAX_RIPPLES && self.ripple_waves.iter().all(|waves| (1..=200).contains(waves)),
            "self_sensing.ripple_waves",
            format!("{:?}", self.ripple_waves),
            format!("must be at most {MAX_RIPPLES} numbers from 1 to 200"),
        );
    }
}

/// Whether a text is a moment by RFC 3339: a day of the calendar, a time, and a zone.
fn is_moment(text: &str) -> bool {
    text.parse::<Datetime>()
        .is_ok_and(|moment| moment.date.is_some() && moment.time.is_some() && moment.offset.is_some())
}

/// Evaluations of the model in a gait cycle that leave the search everywhere some room.
const EVALUATIONS_PER_CYCLE: f64 = 2_500.0;

impl Config {
    /// So many evaluations with each tick that a search is over within a cycle: one at the usual rate and gait.
    fn evaluations_per_tick(&self) -> u32 {
        let ticks_per_cycle = self.control.rate_hz * self.gait.cycle_s;
        (EVALUATIONS_PER_CYCLE / ticks_per_cycle).ceil().clamp(1.0, 100.0) as u32
    }

    /// The motor's winding, and what the servo reports of it: the one answer to what its current is.
    pub fn winding(&self) -> Winding {
        self.self_sensing().gear.winding()
    }

    /// What self-sensing is told of this worm.
    pub fn self_sensing(&self) -> SelfSensingConfig {
        let known = &self.self_sensing;
        let mut ripple = [Ripple::default(); MAX_RIPPLES];
        for (term, &waves) in ripple.iter_mut().zip(&known.ripple_waves) {
            term.waves = f64::from(waves);
        }
        let gear = GearModel {
            source: match known.current {
                ReportedCurrent::Winding => CurrentSource::Winding,
                ReportedCurrent::Duty => CurrentSource::Duty,
            },
            torque_constant_n_m_per_a: self.servo.torque_constant_n_m_per_a,
            torque_constant_sigma: known.torque_constant_sigma_share,
            winding_resistance_ohm: self.servo.winding_resistance_ohm,
            inertia_kg_m2: known.inertia_kg_m2,
            dry_n_m: known.dry_friction_n_m,
            friction_sigma_n_m: known.friction_sigma_n_m,
            viscous_n_m_s_per_rad: known.viscous_friction_n_m_s_per_rad,
            load_friction: known.load_friction,
            load_friction_sigma: known.load_friction_sigma,
            load_share: known.load_motor_share,
            load_squared_per_n_m: known.load_squared_friction_per_n_m,
            load_squared_share: known.load_squared_motor_share,
            ripple,
            ripple_sigma_n_m: known.ripple_sigma_n_m,
        };
        SelfSensingConfig {
            friction_sigma: known.worm_sigma_share,
            stiffness_sigma: known.worm_sigma_share,
            pull_sigma_n: known.pull_sigma_n,
            pitch: self
                .inertial_sensor
                .as_ref()
                .map_or_else(PitchSensor::default, |sensor| PitchSensor {
                    sigma_rad: sensor.sigma_deg.to_radians(),
                    load_sigma_n: sensor.load_sigma_n,
                }),
            cycle_s: self.gait.cycle_s,
            memory_cycles: known.memory_cycles,
            evaluations_per_reading: self.evaluations_per_tick(),
            ..SelfSensingConfig::new(gear)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_date_of_a_calibration_is_a_moment() {
        let table = [
            ("2026-11-25T11:15:05Z", true),
            ("2028-02-29T23:59:59.5+01:00", true),
            ("2026-11-25T11:15:05", false),
            ("2026-11-25", false),
            ("11:15:05", false),
            ("2026-02-30T11:15:05Z", false),
            ("2026-13-01T11:15:05Z", false),
            ("yesterday", false),
            ("", false),
        ];
        for (date, is_valid) in table {
            let toml = format!(
                "[self_sensing.calibrated]\ndate = {date:?}\nmode = \"lifted\"\ntemperature_c = 31.0\nsupply_v = 5.0\nservo_model = 1200\n\
                 servo_id = 1\ndry_friction_sigma_n_m = 0.0003\nviscous_friction_sigma_n_m_s_per_rad = 0.0002\n"
            );
            let error = Config::from_toml(&toml, "test".as_ref())
                .err()
                .map(|error| error.to_string());
            let expected = format!("self_sensing.calibrated.date = {date:?}: must be a date with time and zone");
            assert_eq!(error.is_none(), is_valid, "{date}: {error:?}");
            assert!(error.is_none_or(|error| error.contains(&expected)), "{date}");
        }
    }
}
