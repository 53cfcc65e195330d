//! The worm's end of the loop: readings for goals, either through the real packet codec or straight from the plant.

use std::f64::consts::TAU;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use wormd::control::{Service, ServiceOutcome, link_settings};
use wormd::link::servo::scale;
use wormd::link::virtual_worm::motor::{Drive, Gains};
use wormd::link::virtual_worm::{Devices, Options, Plant};
use wormd::link::{ExchangePlan, LinkSettings, Port, PortError, ServoReading, TrackerReading, WormBus, prepare};

/// What one exchange brought.
pub struct Exchange {
    pub servo: Option<ServoReading>,
    pub tracker: Option<TrackerReading>,
    /// Earlier exchanges whose answer never comes.
    pub lost: u32,
}

/// What became of a service, what the servo's hardware error register said, and when it was over.
pub struct Served {
    pub outcome: ServiceOutcome,
    pub hardware_error: Option<u8>,
    pub ended_s: f64,
}

/// Something that takes goals and gives readings.
pub trait Machine {
    fn exchange(&mut self, goal_counts: i32, now_s: f64) -> Exchange;
    fn serve(&mut self, service: Service, now_s: f64) -> Served;
    fn plant(&mut self) -> &Plant;
}

/// A port in memory with the virtual worm's devices at its other end. Its time runs only while the link waits, and then for at most
/// `timeout_s`.
struct Wire {
    devices: Devices,
    now_s: f64,
    timeout_s: f64,
    give_up_s: f64,
    line: Vec<u8>,
}

/// How long a tick waits for answers: what `control.bus_wait_share` leaves of a millisecond.
const TICK_PATIENCE_S: f64 = 0.7e-3;
/// How long a service waits for one answer.
const SERVICE_PATIENCE_S: f64 = 0.06;
/// The codec's own deadlines are on the real clock, which means nothing here.
const NEVER: Duration = Duration::from_secs(3600);

impl Port for Wire {
    fn send(&mut self, bytes: &[u8], _: Instant) -> Result<(), PortError> {
        self.devices
            .receive(bytes, self.now_s)
            .expect("a checked configuration");
        self.give_up_s = self.now_s + self.timeout_s;
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _: Instant) -> Result<usize, PortError> {
        if self.line.is_empty() {
            self.devices.take_due(self.now_s, &mut self.line);
        }
        if self.line.is_empty() {
            let due_s = self.devices.next_due_s().unwrap_or(f64::INFINITY);
            self.now_s = due_s.min(self.give_up_s).max(self.now_s);
            self.devices.advance_to(self.now_s).expect("a checked configuration");
            self.devices.take_due(self.now_s, &mut self.line);
        }
        let count = into.len().min(self.line.len());
        into[..count].copy_from_slice(&self.line[..count]);
        self.line.drain(..count);
        Ok(count)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        self.devices.take_due(self.now_s, &mut self.line);
        let count = self.line.len();
        self.line.clear();
        Ok(count)
    }

    fn set_baud_rate(&mut self, _: u32) -> Result<(), PortError> {
        Ok(())
    }
}

/// The virtual worm behind the real codec: every goal and every reading are packets.
pub struct Wired {
    bus: WormBus<Wire>,
    settings: LinkSettings,
    plan: ExchangePlan,
    /// Deadline of an exchange at the virtual time 0, far enough away never to pass.
    epoch: Instant,
}

impl Wired {
    pub fn new(config: &Config, options: &Options) -> Self {
        let devices = Devices::new(config, options).expect("a worm that can be simulated");
        let mut bus = WormBus::new(Wire {
            devices,
            now_s: 0.0,
            timeout_s: SERVICE_PATIENCE_S,
            give_up_s: 0.0,
            line: Vec::new(),
        });
        let settings = link_settings(config, 4_000_000).expect("valid IDs");
        let plan = prepare(&mut bus, &settings, &mut Vec::new())
            .expect("a sound worm")
            .plan;
        Self {
            bus,
            settings,
            plan,
            epoch: Instant::now() + NEVER,
        }
    }

    /// When the first goal velocity other than zero was obeyed, s.
    pub fn crawl_began_s(&mut self) -> Option<f64> {
        self.bus.port_mut().devices.crawl_began_s()
    }

    /// As `control::Drive` arms.
    fn arm(&mut self) -> bool {
        if self.hardware_errors().is_some_and(|bits| bits != 0)
            && self.bus.reboot_servo(self.settings.servo_id).is_err()
        {
            return false;
        }
        prepare(&mut self.bus, &self.settings, &mut Vec::new()).is_ok_and(|prepared| {
            self.plan = prepared.plan;
            self.bus.set_torque(self.settings.servo_id, true).is_ok()
        })
    }

    fn hardware_errors(&mut self) -> Option<u8> {
        let register = wormd::link::servo::register::HARDWARE_ERROR_STATUS;
        let servo = self.settings.servo_id;
        let bits = self.bus.read_register(servo, register, Instant::now() + NEVER);
        bits.ok().map(|bits| bits as u8)
    }
}

impl Machine for Wired {
    fn exchange(&mut self, goal_counts: i32, now_s: f64) -> Exchange {
        let wire = self.bus.port_mut();
        (wire.now_s, wire.timeout_s) = (now_s, TICK_PATIENCE_S);
        let goal_rad_s = f64::from(goal_counts) * scale::VELOCITY_RAD_S;
        let outcome = self
            .bus
            .exchange(&self.plan, goal_rad_s, self.epoch + Duration::from_secs_f64(now_s));
        Exchange {
            servo: outcome.servo.ok(),
            tracker: outcome.tracker.ok(),
            lost: outcome.lost,
        }
    }

    fn serve(&mut self, service: Service, now_s: f64) -> Served {
        let wire = self.bus.port_mut();
        (wire.now_s, wire.timeout_s) = (wire.now_s.max(now_s), SERVICE_PATIENCE_S);
        let done = match service {
            Service::Arm => self.arm(),
            Service::Disarm => self.bus.set_torque(self.settings.servo_id, false).is_ok(),
        };
        let hardware_error = self.hardware_errors();
        Served {
            outcome: if done {
                ServiceOutcome::Done(service)
            } else {
                ServiceOutcome::Failed(service)
            },
            hardware_error,
            ended_s: self.bus.port_mut().now_s,
        }
    }

    fn plant(&mut self) -> &Plant {
        self.bus.port_mut().devices.plant()
    }
}

/// The plant with nothing around it but the rounding of the servo's registers: for many hours.
pub struct Bare {
    plant: Plant,
    torque_is_on: bool,
}

/// What the servo makes of its factory gains (velocity P 180, velocity I 1600).
const FACTORY_GAINS: Gains = Gains {
    velocity_p: 0.0663,
    velocity_i: 11.5,
    position_p: 20.0,
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
