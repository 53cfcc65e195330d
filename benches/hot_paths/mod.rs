//! The hot paths as the benches run them, each ready for its next step.

use dynamixel_bus::packet::{DeviceId, FastReplyWriter, FastSegment, MAX_PACKET_LEN, ReadSpan, StatusFlags};
use std::hint::black_box;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{Command, CommandKind};
use worm_physics::MAX_CELLS;
use wormd::control::{Controller, EstimateSeen, Inputs, Lease, Service, ServiceOutcome};
use wormd::link::{
    ExchangePlan, Port, PortError, ReadPlan, ServoReading, TrackerQuery, TrackerReading, WormBus, servo, tracker,
};

const SERVO_READING: ServoReading = ServoReading {
    watchdog: 5,
    goal_velocity_rad_s: 2.5,
    realtime_tick_ms: 0,
    moving: true,
    duty: 0.3,
    current_a: 0.15,
    velocity_rad_s: 2.5,
    position_rad: 1.0,
    voltage_v: 5.0,
    temperature_c: 30.0,
    alert: false,
};

/// A controller that has been armed and told to crawl.
pub struct Crawling {
    controller: Controller,
    tracker: TrackerReading,
    now_ns: u64,
    tick: u64,
}

impl Crawling {
    pub fn new() -> Self {
        let mut crawling = Self {
            controller: Controller::new(&Config::default()),
            tracker: TrackerReading {
                sample: 0,
                capture_time_us: 0,
                cell_count: 4,
                valid: 0b1111,
                positions_m: [0.1; MAX_CELLS],
                pitch_rad: None,
            },
            now_ns: 0,
            tick: 0,
        };
        crawling.tick_with(None, Some(ServiceOutcome::Done(Service::Arm)));
        let crawl = Command::new(CommandKind::Crawl);
        crawling.tick_with(Some(crawl), None);
        crawling
    }

    /// A tick with fresh readings of both devices.
    pub fn tick(&mut self) {
        self.tick_with(None, None);
    }

    fn tick_with(&mut self, command: Option<Command>, service: Option<ServiceOutcome>) {
        self.now_ns += 1_000_000;
        self.tick += 1;
        self.tracker.sample += 1;
        let inputs = Inputs {
            now_ns: self.now_ns,
            absent_ns: 0,
            lost_exchanges: 0,
            servo: Some(&SERVO_READING),
            tracker: Some(&self.tracker),
            command,
            alarms: &[],
            estimate: Some(EstimateSeen {
                state_sequence: self.tick.saturating_sub(2),
                raised_mask: 0,
            }),
            lease: Lease::Held,
            emergency_stop: Some(false),
            end: false,
            service,
            service_ns: 0,
            hardware_error: None,
        };
        black_box(self.controller.tick(black_box(&inputs)));
    }
}

/// A worm's bus on a port in memory, on which both devices answer every question at once.
pub struct AnsweredExchange {
    bus: WormBus<AnsweringPort>,
    plan: ExchangePlan,
}

impl AnsweredExchange {
    pub fn new() -> Self {
        let id = |id| DeviceId::new(id).expect("a valid ID");
        let plan = ExchangePlan {
            servo: id(1),
            tracker: Some(TrackerQuery {
                id: id(100),
                cells: 4,
                emergency_stop_mask: None,
                pitch: false,
            }),
            read: ReadPlan::FastBulk,
        };
        Self {
            bus: WormBus::new(AnsweringPort::new(&plan)),
            plan,
        }
    }

    /// One exchange, with the answers of both devices.
    pub fn exchange(&mut self) {
        let deadline = Instant::now() + Duration::from_secs(1);
        let outcome = self.bus.exchange(&self.plan, black_box(2.5), deadline);
        assert!(black_box(outcome).is_complete(), "both devices answer");
    }
}

struct AnsweringPort {
    reply: Vec<u8>,
    is_asked: bool,
}

impl AnsweringPort {
    fn new(plan: &ExchangePlan) -> Self {
        let tracker = plan.tracker.expect("this worm has one");
        let spans = [
            servo::block_span(plan.servo),
            tracker::block_span(tracker.id, tracker.cells),
        ];
        Self {
            reply: fast_reply(spans),
            is_asked: false,
        }
    }
}

impl Port for AnsweringPort {
    fn send(&mut self, bytes: &[u8], _deadline: Instant) -> Result<(), PortError> {
        black_box(bytes);
        self.is_asked = true;
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _deadline: Instant) -> Result<usize, PortError> {
        if !std::mem::take(&mut self.is_asked) {
            return Ok(0);
        }
        into[..self.reply.len()].copy_from_slice(&self.reply);
        Ok(self.reply.len())
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        Ok(0)
    }

    fn set_baud_rate(&mut self, _baud: u32) -> Result<(), PortError> {
        Ok(())
    }
}

/// The answer of both devices to a fast bulk read of these spans, with some data in it.
pub fn fast_reply(spans: [ReadSpan; 2]) -> Vec<u8> {
    let mut reply = [0; MAX_PACKET_LEN];
    let mut writer = FastReplyWriter::new(&mut reply, spans.iter().map(|span| span.length)).expect("it fits");
    for span in spans {
        let data: Vec<u8> = (0..span.length).map(|at| (at * 37 + 11) as u8).collect();
        writer
            .push(FastSegment {
                id: span.id,
                flags: StatusFlags::OK,
                data: &data,
            })
            .expect("as asked");
    }
    let length = writer.len();
    reply[..length].to_vec()
}
