//! The controller in virtual time, against a servo that obeys unless a test says otherwise.

mod alarms;
mod estimator;
mod faults;
mod lease;
mod modes;
mod pauses;
mod properties;
mod readings;
mod recovery;

use super::*;
use crate::control::EstimateSeen;
use crate::control::standing_alarms::bit;
use crate::link::{ServoReading, TrackerReading};
use worm_estimator::message::{Alarm, Command, CommandKind, CommandOutcome, Reply};

const MS: u64 = 1_000_000;

/// A controller with an ideal servo, tracker and estimator around it, one tick a millisecond.
struct Rig {
    controller: Controller,
    now_ns: u64,
    absent_ns: u64,
    servo: ServoReading,
    tracker: TrackerReading,
    goal_counts: i32,
    served: Option<ServiceOutcome>,
    /// How long a service takes, ms.
    service_ms: u64,
    servo_answers: bool,
    tracker_runs: bool,
    estimator_runs: bool,
    /// The state that the estimator has got stuck at, if it has.
    estimator_stuck_at: Option<u64>,
    services_fail: bool,
    /// What the motor still turns when its goal is zero, rad/s.
    coasts_rad_s: f64,
    /// The messages on their way.
    messages: Vec<Alarm>,
    /// The level in the estimates.
    raised_mask: u32,
    lease: Lease,
    emergency_stop: Option<bool>,
    end: bool,
    last: Option<Outputs>,
    arms: u32,
    disarms: u32,
    notes: Vec<Note>,
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
                pitch_rad: None,
            },
            goal_counts: 0,
            served: None,
            service_ms: 0,
            servo_answers: true,
            tracker_runs: true,
            estimator_runs: true,
            estimator_stuck_at: None,
            services_fail: false,
            coasts_rad_s: 0.0,
            messages: Vec::new(),
            raised_mask: 0,
            lease: Lease::Held,
            emergency_stop: None,
            end: false,
            last: None,
            arms: 0,
            disarms: 0,
            notes: Vec::new(),
        }
    }

    fn armed(toml: &str) -> Self {
        let mut rig = Self::new(toml);
        rig.run(10);
        rig.command(CommandKind::Arm, 0.0);
        rig.run(2);
        assert_eq!(rig.mode(), Mode::Armed);
        rig
    }

    /// A rig that has been armed and crawls at full speed.
    fn crawling(toml: &str) -> Self {
        let mut rig = Self::armed(toml);
        assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::Accepted);
        rig.run(500);
        assert_eq!(rig.mode(), Mode::Crawling);
        rig
    }

    fn mode(&self) -> Mode {
        self.controller.mode()
    }

    /// One tick, in the order of `control::run`.
    fn tick(&mut self, command: Option<Command>) -> Outputs {
        let service_ns = self.served.map_or(0, |_| self.service_ms * MS);
        self.now_ns += MS + service_ns;
        self.servo.velocity_rad_s = f64::from(self.goal_counts) * RAD_S_PER_COUNT + self.coasts_rad_s;
        self.servo.position_rad += self.servo.velocity_rad_s * 1e-3;
        if self.tracker_runs && (self.now_ns / MS).is_multiple_of(8) {
            self.tracker.sample += 1;
            self.tracker.capture_time_us += 8_000;
        }
        let messages = std::mem::take(&mut self.messages);
        let newest = self.last.map_or(0, |last| last.state.sequence);
        let outputs = self.controller.tick(&Inputs {
            now_ns: self.now_ns,
            absent_ns: std::mem::take(&mut self.absent_ns),
            lost_exchanges: 0,
            servo: self.servo_answers.then_some(&self.servo),
            tracker: self.servo_answers.then_some(&self.tracker),
            command,
            alarms: &messages,
            estimate: self.estimator_runs.then(|| EstimateSeen {
                state_sequence: self.estimator_stuck_at.unwrap_or(newest),
                raised_mask: self.raised_mask,
            }),
            lease: self.lease,
            emergency_stop: self.emergency_stop,
            end: self.end,
            service: self.served.take(),
            service_ns,
            hardware_error: None,
        });
        self.goal_counts = outputs.goal_counts;
        self.served = outputs.service.map(|service| self.serve(service));
        self.notes.extend(outputs.notes.iter());
        self.last = Some(outputs);
        outputs
    }

    fn serve(&mut self, service: Service) -> ServiceOutcome {
        match service {
            Service::Arm => self.arms += 1,
            Service::Disarm => self.disarms += 1,
        }
        if self.services_fail {
            return ServiceOutcome::Failed(service);
        }
        if service == Service::Arm {
            // As the start-up does: it reboots the servo after a hardware error, and sets the watchdog.
            self.servo.alert = false;
            self.servo.watchdog = 5;
        }
        ServiceOutcome::Done(service)
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
        self.send(Command {
            cycles_per_s,
            ..Command::new(kind)
        })
        .0
    }

    /// The answer to a command, and the alarms in it.
    fn send(&mut self, command: Command) -> (CommandOutcome, u32) {
        let reply: Reply = self.tick(Some(command)).reply.expect("every command is answered");
        let outcome = CommandOutcome::try_from(reply.verdict).expect("a known verdict");
        (outcome, reply.alarm_mask)
    }

    fn state(&self) -> State {
        self.last.expect("has ticked").state
    }

    fn hold_reason(&self) -> HoldReason {
        HoldReason::try_from(self.state().hold_reason).expect("a known reason")
    }

    fn raise(&mut self, kind: AlarmKind) {
        self.raised_mask |= bit(kind);
        self.message(kind, true);
    }

    fn clear(&mut self, kind: AlarmKind) {
        self.raised_mask &= !bit(kind);
        self.message(kind, false);
    }

    fn message(&mut self, kind: AlarmKind, is_raised: bool) {
        self.messages.push(Alarm {
            sequence: 0,
            time_ns: self.now_ns,
            since_ns: self.now_ns,
            value: 1.0,
            threshold: 0.5,
            phase: 0.0,
            kind: kind.code(),
            severity: 0,
            raised: u32::from(is_raised),
            cell: u32::MAX,
        });
    }
}
