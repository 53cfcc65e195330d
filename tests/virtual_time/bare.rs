//! The plant with nothing around it but the rounding of the servo's registers: no packets, for many hours.

use std::f64::consts::TAU;
use worm_estimator::config::Config;
use wormd::control::{Service, ServiceOutcome};
use wormd::link::ServoReading;
use wormd::link::servo::scale;
use wormd::link::virtual_worm::Plant;
use wormd::link::virtual_worm::motor::{Drive, Gains};
use wormd::soak::{Exchange, Machine, Served};

/// The plant with nothing around it but the rounding of the servo's registers: for many hours.
pub struct Bare {
    plant: Plant,
    torque_is_on: bool,
}

/// What the servo makes of its factory gains (velocity P 180, velocity I 1600).
const FACTORY_GAINS: Gains = Gains {
    velocity_p: 0.0663,
    velocity_i: 11.5,
    position_p: 1.15,
    duty_limit: 1.0,
};

impl Bare {
    pub fn new(config: &Config, seed: u64, step_s: f64) -> Self {
        Self {
            plant: Plant::with_step(config, Some(seed), step_s).expect("a worm that can be simulated"),
            torque_is_on: false,
        }
    }
}

impl Machine for Bare {
    fn exchange(&mut self, goal_counts: i32, now_s: f64) -> Exchange {
        self.plant.advance_to(now_s).expect("a checked configuration");
        let goal_velocity_rad_s = f64::from(goal_counts) * scale::VELOCITY_RAD_S;
        if self.torque_is_on {
            self.plant
                .set_drive(Drive::Velocity(goal_velocity_rad_s), FACTORY_GAINS);
        }
        let motor = self.plant.motor();
        let rounded = |value: f64, unit: f64| (value / unit).round() * unit;
        let servo = ServoReading {
            watchdog: 5,
            goal_velocity_rad_s,
            realtime_tick_ms: (now_s * 1e3) as u64 as u16 & 0x7FFF,
            moving: motor.velocity_rad_per_s() != 0.0,
            duty: rounded(motor.duty(), scale::DUTY),
            current_a: rounded(motor.current_a(), scale::CURRENT_A),
            velocity_rad_s: rounded(motor.velocity_rad_per_s(), scale::VELOCITY_RAD_S),
            position_rad: rounded(motor.angle_rad(), TAU / 4096.0),
            voltage_v: rounded(motor.bus_v(), scale::VOLTAGE_V),
            temperature_c: motor.case_c().round(),
            alert: false,
        };
        Exchange {
            servo: Some(servo),
            tracker: Some(*self.plant.capture()),
            lost: 0,
            emergency_stop: None,
        }
    }

    fn serve(&mut self, service: Service, now_s: f64) -> Served {
        let drive = match service {
            Service::Arm => Drive::Velocity(0.0),
            Service::Disarm => Drive::Off,
        };
        self.plant.reset_loop();
        self.plant.set_drive(drive, FACTORY_GAINS);
        self.torque_is_on = service == Service::Arm;
        Served {
            outcome: ServiceOutcome::Done(service),
            hardware_error: Some(0),
            ended_s: now_s + 5e-3,
        }
    }

    fn plant(&mut self) -> &Plant {
        &self.plant
    }
}
