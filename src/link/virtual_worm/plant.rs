//! The whole machine without its electronics: supply, motor, body and camera, stepped together, and the truth about them.
//!
//! One cam turn is one gait cycle. In a step of fixed length the motor is solved against the load torque that the body
//! exerts at its beginning; then the cam turns the body, and what the body really took beyond that torque is
//! taken out of the motor's kinetic energy. So electrical energy = copper heat + friction inside + net actuator work +
//! change of kinetic energy holds to rounding over any stretch.

use super::body::{Body, BodyError};
use super::camera::Camera;
use super::conditions::{CameraConditions, PlantConditions};
use super::ledger::{PlantLedger, Standing, TruthLedger};
use super::motor::{Drive, Gains, Motor};
use super::supply::Supply;
use crate::link::TrackerReading;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use std::f64::consts::TAU;
use worm_estimator::config::Config;
use worm_physics::WormError;
use worm_physics::servo::Pendulum;

/// Length of a step unless asked otherwise, s. An answer is at most this old, and the cam turns by less than a count of
/// the servo's encoder in it.
pub const DEFAULT_STEP_S: f64 = 2.5e-4;

/// Supply, motor, body and camera.
#[derive(Debug, Clone)]
pub struct Plant {
    step_s: f64,
    steps: u64,
    drive: Drive,
    gains: Gains,
    supply: Supply,
    motor: Motor,
    body: Body,
    /// What the horn carries instead of the cam.
    arm: Option<Pendulum>,
    camera: Camera,
    conditions: PlantConditions,
    cycle_began_at: f64, // phase, a whole number
    owed_j: f64,         // work of the body that the motor could not give yet
    ledger: TruthLedger,
    rng: Xoshiro256PlusPlus,
}

impl Plant {
    /// At rest at gait phase 0 and time 0. `seed` takes the place of the configured one.
    ///
    /// # Errors
    /// [`BodyError`] when the configuration was not checked and describes no worm.
    pub fn new(config: &Config, seed: Option<u64>) -> Result<Self, BodyError> {
        Self::with_step(config, seed, DEFAULT_STEP_S)
    }

    /// As [`new`](Self::new), in steps of `step_s`: longer ones are faster, and shift events by up to a step.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_step(config: &Config, seed: Option<u64>, step_s: f64) -> Result<Self, BodyError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.unwrap_or(config.virtual_worm.seed));
        let mut body = Body::new(config)?;
        body.scatter(&mut rng)?;
        let camera = Camera::new(config, &mut rng);
        let ledger = TruthLedger::new(body.cells(), &standing(0.0, &body));
        Ok(Self {
            step_s,
            steps: 0,
            drive: Drive::Off,
            gains: Gains {
                velocity_p: 0.0,
                velocity_i: 0.0,
                position_p: 0.0,
                duty_limit: 1.0,
            },
            supply: Supply::new(config),
            motor: Motor::new(config)?,
            body,
            arm: None,
            camera,
            conditions: PlantConditions::default(),
            cycle_began_at: 0.0,
            owed_j: 0.0,
            ledger,
            rng,
        })
    }

    /// Puts an arm on the horn, which hangs down at angle 0; the worm rests beside it.
    pub fn carry(&mut self, arm: Pendulum) {
        self.motor.carry(arm.inertia_kg_m2());
        self.arm = Some(arm);
    }

    /// Sets what the servo commands its bridge from now on.
    pub fn set_drive(&mut self, drive: Drive, gains: Gains) {
        self.drive = drive;
        self.gains = gains;
    }

    /// Whether the servo's torque is on: its bridge drives or brakes the motor.
    pub fn torque_is_on(&self) -> bool {
        !matches!(self.drive, Drive::Off)
    }

    /// Forgets the velocity loop's integral.
    pub fn reset_loop(&mut self) {
        self.motor.reset_loop();
    }

    /// Changes the world around the worm.
    ///
    /// # Errors
    /// [`WormError`] never for values within a fault's domains.
    pub fn set_conditions(&mut self, conditions: &PlantConditions, camera: CameraConditions) -> Result<(), WormError> {
        self.motor.set_friction_scale(conditions.inner_friction_scale);
        self.motor.heat_to(conditions.heated_to_c);
        self.supply
            .set_defect(conditions.supply_drop_v, conditions.supply_extra_ohm);
        if let Some(charge) = conditions.battery_charge
            && self.conditions.battery_charge != Some(charge)
        {
            self.supply.set_charge_fraction(charge);
        }
        self.camera.set_conditions(camera);
        self.conditions = conditions.clone();
        self.body.set_conditions(conditions)
    }

    /// Steps until no whole step is left before `time_s`.
    ///
    /// # Errors
    /// [`WormError`] never for a checked configuration.
    pub fn advance_to(&mut self, time_s: f64) -> Result<(), WormError> {
        // Half a thousandth of a step makes up for rounding of the quotient.
        let target = (time_s / self.step_s + 5e-4).floor().max(0.0) as u64;
        while self.steps < target {
            self.step()?;
        }
        Ok(())
    }

    /// One step.
    ///
    /// # Errors
    /// [`WormError`] never for a checked configuration.
    pub fn step(&mut self) -> Result<(), WormError> {
        if let Some(arm) = self.arm {
            self.step_with(&arm);
            return Ok(());
        }
        let load_n_m = self.body.torque_n_m();
        let drive = match self.drive {
            Drive::Velocity(rad_per_s) => Drive::Velocity(rad_per_s * self.body.speed_fraction(rad_per_s.signum())),
            other => other,
        };
        let before_j = self.motor.kinetic_j();
        let mut energy = self
            .motor
            .step(drive, &self.gains, load_n_m, &mut self.supply, self.step_s);
        self.steps += 1;
        let phase = self.motor.angle_rad() / TAU;
        let mut work_j = 0.0;
        let mut left_s = self.step_s;
        if (phase - self.cycle_began_at).abs() >= 1.0 {
            let boundary = self.cycle_began_at + (phase - self.cycle_began_at).signum();
            let fraction = (boundary - self.body.phase()) / (phase - self.body.phase());
            work_j += self.body.advance_to(boundary, fraction * self.step_s)?;
            left_s -= fraction * self.step_s;
            self.cycle_began_at = boundary;
            self.ledger.close_cycle(&standing(self.time_s(), &self.body));
            self.body.scatter(&mut self.rng)?;
        }
        work_j += self.body.advance_to(phase, left_s)?;
        let missing_j = energy.load_j - work_j + self.owed_j;
        if missing_j != 0.0 {
            self.owed_j = self.motor.give_kinetic(missing_j);
        }
        energy.kinetic_j = self.motor.kinetic_j() - before_j;
        self.ledger.add(&energy);
        self.film();
        Ok(())
    }

    /// One step of the servo with an arm on its horn. What it lifts is the load's work.
    fn step_with(&mut self, arm: &Pendulum) {
        let (before_rad, before_j) = (self.motor.angle_rad(), self.motor.kinetic_j());
        let load_n_m = arm.torque_n_m(before_rad);
        let mut energy = self
            .motor
            .step(self.drive, &self.gains, load_n_m, &mut self.supply, self.step_s);
        self.steps += 1;
        let lifted_j = arm.potential_j(self.motor.angle_rad()) - arm.potential_j(before_rad);
        let missing_j = energy.load_j - lifted_j + self.owed_j;
        if missing_j != 0.0 {
            self.owed_j = self.motor.give_kinetic(missing_j);
        }
        energy.kinetic_j = self.motor.kinetic_j() - before_j;
        self.ledger.add(&energy);
        self.film();
    }

    /// Lets the camera look, if it is time.
    fn film(&mut self) {
        if self.time_s() >= self.camera.due_s() {
            let view = self.body.view();
            let mut seen_m = self.body.positions_m();
            seen_m.iter_mut().for_each(|position_m| *position_m *= view.scale);
            self.camera.capture(&seen_m, view.latency_s, &mut self.rng);
        }
    }

    /// Time of the plant, s: the last step's end.
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * self.step_s
    }

    /// The motor.
    pub fn motor(&self) -> &Motor {
        &self.motor
    }

    /// The supply.
    pub fn supply(&self) -> &Supply {
        &self.supply
    }

    /// The body.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The tracker's last capture.
    pub fn capture(&self) -> &TrackerReading {
        self.camera.reading()
    }

    /// The account of everything since the beginning.
    pub fn total(&self) -> PlantLedger {
        self.ledger.total(&standing(self.time_s(), &self.body))
    }

    /// The accounts of the cycles.
    pub fn ledger(&self) -> &TruthLedger {
        &self.ledger
    }
}

fn standing(time_s: f64, body: &Body) -> Standing<'_> {
    Standing {
        time_s,
        phase: body.phase(),
        mean_position_m: body.mean_position_m(),
        dragged_m: body.dragged_m(),
        model: body.ledger(),
    }
}

#[cfg(test)]
mod tests;
