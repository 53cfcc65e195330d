//! The controller in virtual time, against a servo that obeys unless a test says otherwise.

mod faults;
mod modes;
mod pauses;
mod properties;
mod readings;

use super::*;
use crate::control::{EstimateSeen, Lease};
use crate::link::TrackerReading;

const MS: u64 = 1_000_000;

/// A controller with an ideal servo, tracker and estimator around it, one tick a millisecond.
struct Rig {
    controller: Controller,
    now_ns: u64,
    absent_ns: u64,
    servo: ServoReading,
    tracker: TrackerReading,
    goal_counts: i32,
    service: Option<Service>,
    servo_answers: bool,
    tracker_runs: bool,
    estimator_runs: bool,
    services_fail: bool,
    alarm: Option<Alarm>,
    end: bool,
    last: Option<Outputs>,
    disarms: u32,
}

impl Rig {
    fn new(toml: &str) -> Self {
        let config = Config::from_toml(toml, "test".as_ref()).expect("a valid test configuration");
        Self {
            controller: Controller::new(&config),
            now_ns: 1_000 * MS,
            absent_ns: 0,
            servo: ServoReading {
                watchdog: 5,
                goal_velocity_rad_s: 0.0,
                realtime_tick_ms: 0,
                moving: false,
                duty: 0.1,
                current_a: 0.15,
                velocity_rad_s: 0.0,
                position_rad: 0.0,
                voltage_v: 5.0,
                temperature_c: 30.0,
                alert: false,
            },
            tracker: TrackerReading {
                sample: 7,
                capture_time_us: 0,
                cell_count: 4,
                valid: 0b1111,
                positions_m: [0.0; worm_physics::MAX_CELLS],
            },
            goal_counts: 0,
            service: None,
            servo_answers: true,
            tracker_runs: true,
            estimator_runs: true,
            services_fail: false,
            alarm: None,
            end: false,
            last: None,
            disarms: 0,
        }
    }

    /// A rig that has been armed and crawls at full speed.
    fn crawling(toml: &str) -> Self {
        let mut rig = Self::new(toml);
        rig.run(10);
        rig.command(CommandKind::Arm, 0.0);
        rig.run(2);
        assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::Accepted);
        rig.run(500);
        assert_eq!(rig.mode(), Mode::Crawling);
        rig
    }

    fn mode(&self) -> Mode {
        self.controller.mode()
    }

    fn tick(&mut self, command: Option<Command>) -> Outputs {
        self.now_ns += MS;
        self.servo.velocity_rad_s = f64::from(self.goal_counts) * RAD_S_PER_COUNT;
        self.servo.position_rad += self.servo.velocity_rad_s * 1e-3;
        if self.tracker_runs && (self.now_ns / MS).is_multiple_of(8) {
            self.tracker.sample += 1;
            self.tracker.capture_time_us += 8_000;
        }
        let service = self.service.take().map(|service| {
            self.disarms += u32::from(service == Service::Disarm);
            if self.services_fail {
                ServiceOutcome::Failed(service)
            } else {
                ServiceOutcome::Done(service)
            }
        });
        let alarm = self.alarm.take();
        let outputs = self.controller.tick(&Inputs {
            now_ns: self.now_ns,
            absent_ns: std::mem::take(&mut self.absent_ns),
            lost_exchanges: 0,
            servo: self.servo_answers.then_some(&self.servo),
            tracker: self.servo_answers.then_some(&self.tracker),
            command,
            alarms: alarm.as_slice(),
            estimate: self.estimator_runs.then(|| EstimateSeen {
                state_sequence: self.last.map_or(0, |last| last.state.sequence),
                raised_mask: 0,
            }),
            lease: Lease::Held,
            emergency_stop: None,
            end: self.end,
            service,
            hardware_error: None,
        });
        self.goal_counts = outputs.goal_counts;
        self.service = outputs.service;
        self.last = Some(outputs);
        outputs
    }

    fn run(&mut self, ms: u64) {
        for _ in 0..ms {
            self.tick(None);
        }
    }

    /// The computer does not run the loop for `ms`, and no device answers in the first tick after it.
    fn pause(&mut self, ms: u64) {
        self.now_ns += ms * MS;
        self.absent_ns = ms * MS;
        let answers = std::mem::replace(&mut self.servo_answers, false);
        self.tick(None);
        self.servo_answers = answers;
    }

    fn command(&mut self, kind: CommandKind, cycles_per_s: f64) -> CommandOutcome {
        let reply = self
            .tick(Some(Command {
                cycles_per_s,
                ..Command::new(kind)
            }))
            .reply;
        CommandOutcome::try_from(reply.expect("every command is answered").verdict).expect("a known verdict")
    }

    fn raise(&mut self, kind: AlarmKind) {
        self.alarm = Some(Alarm {
            sequence: 0,
            time_ns: self.now_ns,
            since_ns: self.now_ns,
            value: 1.0,
            threshold: 0.5,
            phase: 0.0,
            kind: kind.code(),
            severity: 0,
            raised: 1,
            cell: u32::MAX,
        });
    }
}
