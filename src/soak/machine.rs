//! The worm's end of the loop in virtual time: the real link code on a port in memory, and the virtual worm's devices at its other end.

use crate::control::{DriveError, Service, ServiceOutcome, link_settings};
use crate::link::servo::scale;
use crate::link::virtual_worm::{Devices, DevicesError, Fault, Options, Plant, VirtualPort};
use crate::link::{
    ArmError, EmergencyStopError, EmergencyStopInput, ExchangePlan, FaultInjector, Faults, LinkSettings, ServoReading,
    StartupError, TrackerReading, WormBus, arm, disarm, prepare,
};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;

/// What one exchange brought.
#[derive(Debug, Clone, Copy)]
pub struct Exchange {
    /// The servo's answer, if it came.
    pub servo: Option<ServoReading>,
    /// The tracker's answer, if it came.
    pub tracker: Option<TrackerReading>,
    /// Earlier exchanges whose answer never comes.
    pub lost: u32,
    /// Whether the emergency stop is pressed, where there is one.
    pub emergency_stop: Option<bool>,
}

/// What became of a service.
#[derive(Debug, Clone, Copy)]
pub struct Served {
    /// Whether it was done.
    pub outcome: ServiceOutcome,
    /// What the servo's hardware error register said, where it was read.
    pub hardware_error: Option<u8>,
    /// When it was over, s.
    pub ended_s: f64,
}

/// Something that takes goals and gives readings, at times that are given to it.
pub trait Machine {
    /// Sends a goal velocity in counts at `now_s`, and receives the readings.
    fn exchange(&mut self, goal_counts: i32, now_s: f64) -> Exchange;
    /// Executes a service that begins at `now_s`.
    fn serve(&mut self, service: Service, now_s: f64) -> Served;
    /// The truth.
    fn plant(&mut self) -> &Plant;
}

/// Why there is no worm to simulate.
#[derive(Debug, thiserror::Error)]
pub enum MachineError {
    /// The devices cannot be simulated.
    #[error(transparent)]
    Devices(#[from] DevicesError),
    /// The configuration names impossible devices.
    #[error(transparent)]
    Settings(#[from] DriveError),
    /// The devices failed the start-up checks.
    #[error(transparent)]
    Startup(#[from] StartupError),
    /// The emergency stop cannot be read.
    #[error(transparent)]
    EmergencyStop(#[from] EmergencyStopError),
}

/// How long a service waits for one answer, s.
pub(super) const SERVICE_TIMEOUT_S: f64 = 0.06;
/// The codec's own deadlines are on the real clock, which means nothing here.
const NEVER: Duration = Duration::from_secs(3600);

/// The virtual worm behind the real codec: every goal and every reading are packets.
pub struct Wired {
    bus: WormBus<FaultInjector<VirtualPort>>,
    settings: LinkSettings,
    plan: ExchangePlan,
    emergency_stop: Option<EmergencyStopInput>,
    /// How long a tick waits for answers, s.
    tick_timeout_s: f64,
    /// Deadline of an exchange at the virtual time 0, far enough away never to pass.
    epoch: Instant,
}

impl Wired {
    /// The devices after the controller's start-up checks, at time 0.
    ///
    /// # Errors
    /// [`MachineError`] when there is nothing to simulate, or the devices fail the checks.
    pub fn new(config: &Config, options: &Options) -> Result<Self, MachineError> {
        let wire = VirtualPort::new(Devices::new(config, options)?, SERVICE_TIMEOUT_S);
        let seed = options.seed.unwrap_or(config.virtual_worm.seed);
        let mut bus = WormBus::new(FaultInjector::new(wire, Faults::NONE, seed));
        let settings = link_settings(config, 4_000_000)?;
        let plan = prepare(&mut bus, &settings, &mut Vec::new())?.plan;
        Ok(Self {
            bus,
            settings,
            plan,
            emergency_stop: EmergencyStopInput::open(config)?,
            tick_timeout_s: config.control.bus_wait_share / config.control.rate_hz,
            epoch: Instant::now() + NEVER,
        })
    }

    fn wire(&mut self) -> &mut VirtualPort {
        self.bus.port_mut().port_mut()
    }

    /// When the first goal velocity other than zero was obeyed, s.
    pub fn crawl_began_s(&mut self) -> Option<f64> {
        self.wire().devices.crawl_began_s()
    }

    /// Switches a fault on from now on; START and END of its window are seconds from now.
    ///
    /// # Errors
    /// [`DevicesError`] when this worm cannot have it.
    pub fn switch_on(&mut self, fault: Fault) -> Result<(), DevicesError> {
        self.wire().devices.switch_on(fault)
    }

    /// Ends all faults, or those of a kind. Returns how many there were.
    pub fn clear_faults(&mut self, kind: Option<&str>) -> usize {
        self.wire().devices.clear_faults(kind)
    }

    /// Changes the faults of the cable, byte by byte.
    pub fn set_line_faults(&mut self, faults: Faults) {
        self.bus.port_mut().set_faults(faults);
    }

    /// As [`Drive`](crate::control::Drive) serves: the same operations of the link.
    fn execute(&mut self, service: Service) -> Result<Option<u8>, ArmError> {
        match service {
            Service::Arm => {
                self.plan = arm(&mut self.bus, &self.settings, &mut Vec::new())?.plan;
                Ok(Some(0))
            }
            Service::Disarm => {
                let errors = disarm(&mut self.bus, self.settings.servo_id).map_err(StartupError::from)?;
                Ok(errors.map(|errors| errors.0))
            }
        }
    }
}

impl Machine for Wired {
    fn exchange(&mut self, goal_counts: i32, now_s: f64) -> Exchange {
        let timeout_s = self.tick_timeout_s;
        let wire = self.wire();
        // Late answers are taken before the request is sent, without waiting for them.
        (wire.now_s, wire.timeout_s, wire.give_up_s) = (now_s, timeout_s, now_s);
        let goal_rad_s = f64::from(goal_counts) * scale::VELOCITY_RAD_S;
        let deadline = self.epoch + Duration::from_secs_f64(now_s);
        let outcome = self.bus.exchange(&self.plan, goal_rad_s, deadline);
        let emergency_stop = self.emergency_stop.as_mut();
        Exchange {
            emergency_stop: emergency_stop.map(|input| input.is_pressed((now_s * 1e9) as u64, &outcome)),
            servo: outcome.servo.ok(),
            tracker: outcome.tracker.ok(),
            lost: outcome.lost,
        }
    }

    fn serve(&mut self, service: Service, now_s: f64) -> Served {
        let wire = self.wire();
        (wire.now_s, wire.timeout_s) = (wire.now_s.max(now_s), SERVICE_TIMEOUT_S);
        let executed = self.execute(service);
        Served {
            outcome: match executed {
                Ok(_) => ServiceOutcome::Done(service),
                Err(_) => ServiceOutcome::Failed(service),
            },
            hardware_error: executed.ok().flatten(),
            ended_s: self.wire().now_s,
        }
    }

    fn plant(&mut self) -> &Plant {
        self.wire().devices.plant()
    }
}
