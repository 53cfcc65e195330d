//! The controller in virtual time, against a servo that does what it is told unless a test says otherwise.

use super::*;
use proptest::prelude::*;

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
            estimate_arrived: self.estimator_runs,
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

    /// The computer does not run the loop for so long, and nobody answers in the first tick behind it.
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
                kind: kind.code(),
                reserved: 0,
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

#[test]
fn a_life_from_arming_to_the_end() {
    let mut rig = Rig::crawling("");
    // 0.4 turns per second are 104.8 counts; the goal alternates so that the mean is exact.
    let before_rad = rig.servo.position_rad;
    rig.run(1000);
    let turns_per_s = (rig.servo.position_rad - before_rad) / TAU;
    assert!((turns_per_s - 0.4).abs() < 1e-5, "{turns_per_s} turns per second");

    rig.command(CommandKind::Hold, 0.0);
    rig.run(400);
    assert_eq!(rig.mode(), Mode::Holding);
    let held_rad = rig.servo.position_rad;
    rig.servo.position_rad += 0.3; // somebody turns the cam by hand
    rig.run(1500);
    assert!(
        (rig.servo.position_rad - held_rad).abs() < 0.01,
        "a hold holds: it turns the cam back"
    );

    rig.command(CommandKind::Crawl, -0.2);
    rig.run(1000);
    let state = rig.last.expect("has ticked").state;
    assert!(
        (state.motor_velocity_rad_s / TAU + 0.2).abs() < 2e-3,
        "backward at the asked speed"
    );
    assert!((state.phase - rig.servo.position_rad / TAU).abs() < 1e-12);

    rig.end = true;
    let ticks = (0..2000).take_while(|_| !rig.tick(None).finished).count();
    assert_eq!((rig.mode(), rig.goal_counts, rig.disarms), (Mode::Disarmed, 0, 1));
    assert!((100..400).contains(&ticks), "ramps down, then ends, after {ticks} ms");
}

#[test]
fn commands_by_mode() {
    use CommandKind::{Arm, Crawl, Hold, Reset, Stop};
    use CommandOutcome::{Accepted, BadSpeed, NoEstimator, WrongMode};
    type Prepare = fn() -> Rig;
    let disarmed: Prepare = || Rig::new("");
    let armed: Prepare = || {
        let mut rig = Rig::new("");
        rig.command(Arm, 0.0);
        rig.run(2);
        rig
    };
    let crawling: Prepare = || Rig::crawling("");
    let fault: Prepare = || {
        let mut rig = Rig::crawling("");
        rig.servo.alert = true;
        rig.run(1);
        rig.servo.alert = false;
        rig.run(2);
        rig
    };
    let without_estimator: Prepare = || {
        let mut rig = Rig::new("");
        rig.estimator_runs = false;
        rig.command(Arm, 0.0);
        rig.run(2);
        rig
    };
    // (from, command, speed, verdict, mode half a second later)
    let table: [(Prepare, CommandKind, f64, CommandOutcome, Mode); 18] = [
        (disarmed, Arm, 0.0, Accepted, Mode::Armed),
        (disarmed, Crawl, 0.0, WrongMode, Mode::Disarmed),
        (disarmed, Hold, 0.0, WrongMode, Mode::Disarmed),
        (disarmed, Stop, 0.0, Accepted, Mode::Disarmed),
        (disarmed, Reset, 0.0, WrongMode, Mode::Disarmed),
        (armed, Arm, 0.0, Accepted, Mode::Armed),
        (armed, Crawl, 0.2, Accepted, Mode::Crawling),
        (armed, Crawl, 100.0, BadSpeed, Mode::Armed),
        (armed, Crawl, f64::NAN, BadSpeed, Mode::Armed),
        (armed, Hold, 0.0, Accepted, Mode::Holding),
        (armed, Stop, 0.0, Accepted, Mode::Disarmed),
        (without_estimator, Crawl, 0.0, NoEstimator, Mode::Armed),
        (crawling, Arm, 0.0, WrongMode, Mode::Crawling),
        (crawling, Crawl, -0.3, Accepted, Mode::Crawling),
        (crawling, Hold, 0.0, Accepted, Mode::Holding),
        (crawling, Stop, 0.0, Accepted, Mode::Disarmed),
        (fault, Crawl, 0.0, WrongMode, Mode::Fault),
        (fault, Reset, 0.0, Accepted, Mode::Armed),
    ];
    for (prepare, kind, speed, verdict, mode) in table {
        let mut rig = prepare();
        let from = rig.mode();
        assert_eq!(rig.command(kind, speed), verdict, "{kind} {speed} while {from}");
        rig.run(500);
        assert_eq!(rig.mode(), mode, "after {kind} {speed} while {from}");
    }
}

#[test]
fn what_stops_the_worm_and_how_fast() {
    // (what goes wrong, the fault, ms within which the motor must have been stopped)
    type Trouble = fn(&mut Rig);
    let table: [(Trouble, Fault, u64); 10] = [
        (|rig| rig.servo_answers = false, Fault::LinkLost, 101),
        (|rig| rig.tracker_runs = false, Fault::TrackerStale, 501),
        (|rig| rig.estimator_runs = false, Fault::EstimatorSilent, 501),
        (|rig| rig.servo.current_a = -0.95, Fault::OverCurrent, 502),
        (|rig| rig.servo.temperature_c = 66.0, Fault::OverTemperature, 1),
        (|rig| rig.servo.voltage_v = 3.0, Fault::UnderVoltage, 110),
        (|rig| rig.servo.alert = true, Fault::ServoHardware, 1),
        (|rig| rig.servo.watchdog = 0xFF, Fault::WatchdogTripped, 1),
        (|rig| rig.servo.watchdog = 0, Fault::ServoRestarted, 1),
        (|rig| rig.raise(AlarmKind::MotorStall), Fault::Alarm, 1),
    ];
    for (trouble, fault, within_ms) in table {
        let mut rig = Rig::crawling("");
        trouble(&mut rig);
        rig.run(within_ms);
        assert_eq!(
            (rig.mode(), rig.controller.fault(), rig.goal_counts),
            (Mode::Fault, fault, 0)
        );
        rig.run(1);
        assert_eq!(rig.disarms, 1, "{fault}: torque is switched off");
        // The first reason stays, whatever comes after it.
        rig.servo.alert = true;
        rig.run(50);
        assert_eq!(rig.controller.fault(), fault, "the first reason is latched");
    }
}

#[test]
fn short_troubles_do_not_stop_the_worm() {
    type Trouble = fn(&mut Rig, bool);
    let table: [(Trouble, u64); 4] = [
        (|rig, on| rig.servo_answers = !on, 95),
        (|rig, on| rig.tracker_runs = !on, 450),
        (|rig, on| rig.servo.current_a = if on { 0.95 } else { 0.2 }, 490),
        (|rig, on| rig.servo.voltage_v = if on { 3.0 } else { 5.0 }, 30),
    ];
    for (index, (trouble, ms)) in table.into_iter().enumerate() {
        let mut rig = Rig::crawling("");
        for _ in 0..5 {
            trouble(&mut rig, true);
            rig.run(ms);
            trouble(&mut rig, false);
            rig.run(200);
        }
        assert_eq!(rig.mode(), Mode::Crawling, "row {index}");
    }
}

#[test]
fn a_reset_is_refused_while_the_cause_is_there_and_starts_from_the_measured_position() {
    let mut rig = Rig::crawling("");
    rig.servo.temperature_c = 80.0;
    rig.run(3);
    assert_eq!(rig.command(CommandKind::Reset, 0.0), CommandOutcome::FaultPersists);
    rig.servo.temperature_c = 40.0;
    rig.servo.position_rad += 1.0; // the cam was turned meanwhile
    rig.run(1);
    assert_eq!(rig.command(CommandKind::Reset, 0.0), CommandOutcome::Accepted);
    rig.run(100);
    assert_eq!(
        (rig.mode(), rig.controller.fault(), rig.goal_counts),
        (Mode::Armed, Fault::None, 0)
    );
}

#[test]
fn a_reset_forgets_what_the_servo_said_before_it() {
    // The reading of the tick in which the servo is prepared anew was taken before that.
    let troubles: [fn(&mut Rig, bool); 3] = [
        |rig, bad| rig.servo.alert = bad,
        |rig, bad| rig.servo.watchdog = if bad { 0xFF } else { 5 },
        |rig, bad| rig.servo.watchdog = if bad { 0 } else { 5 },
    ];
    for (index, trouble) in troubles.into_iter().enumerate() {
        let mut rig = Rig::crawling("");
        trouble(&mut rig, true);
        rig.run(100);
        assert_eq!(rig.mode(), Mode::Fault, "row {index}");
        assert_eq!(
            rig.command(CommandKind::Reset, 0.0),
            CommandOutcome::Accepted,
            "row {index}"
        );
        rig.run(1);
        trouble(&mut rig, false);
        rig.run(10);
        assert_eq!(
            (rig.mode(), rig.controller.fault()),
            (Mode::Armed, Fault::None),
            "row {index}"
        );
    }
}

#[test]
fn a_pause_of_the_computer_is_nobody_s_silence() {
    let mut rig = Rig::crawling("");
    for pause_ms in [300, 20, 90, 600, 300] {
        rig.pause(pause_ms);
        rig.run(5);
        assert_eq!(rig.mode(), Mode::Crawling, "after {pause_ms} ms");
    }
    let state = rig.tick(None).state;
    assert_eq!(state.host_paused_ns, 1310 * MS);
    // What is silent besides is still told in its time, and only the computer's own time is left out.
    rig.servo_answers = false;
    rig.run(50);
    rig.pause(300);
    rig.run(45);
    assert_eq!(rig.mode(), Mode::Crawling, "96 ms of silence while the loop was there");
    rig.run(10);
    assert_eq!(rig.controller.fault(), Fault::LinkLost);
}

#[test]
fn a_ramp_goes_on_after_a_pause_where_it_was() {
    let mut rig = Rig::new("");
    rig.run(10);
    rig.command(CommandKind::Arm, 0.0);
    rig.run(2);
    rig.command(CommandKind::Crawl, 0.0);
    rig.run(100);
    let before = rig.goal_counts;
    rig.pause(300);
    let after = rig.goal_counts;
    assert!((0..=2).contains(&(after - before)), "from {before} to {after} counts");
}

#[test]
fn a_pause_that_outlasts_the_watchdog_is_told_as_what_it_was() {
    for (pause_ms, fault) in [
        (150, Fault::HostPaused),
        (50, Fault::HostPaused),
        (40, Fault::WatchdogTripped),
    ] {
        let mut rig = Rig::crawling("");
        rig.pause(pause_ms);
        rig.servo.watchdog = 0xFF;
        rig.run(1);
        assert_eq!(
            (rig.mode(), rig.controller.fault()),
            (Mode::Fault, fault),
            "{pause_ms} ms"
        );
        if fault == Fault::HostPaused {
            assert_eq!(rig.controller.pause_of_fault_ns(), pause_ms * MS);
        }
    }
    // An answer from before the pause, read behind it, knows of nothing yet.
    let mut rig = Rig::crawling("");
    rig.now_ns += 150 * MS;
    rig.absent_ns = 150 * MS;
    rig.run(1);
    rig.servo.watchdog = 0xFF;
    rig.run(1);
    assert_eq!(rig.controller.fault(), Fault::HostPaused);
}

/// Lets a pause trip the watchdog, and two seconds pass in which the servo can be prepared anew.
fn trip(rig: &mut Rig, meanwhile: impl Fn(&mut Rig)) {
    rig.pause(150);
    rig.servo.watchdog = 0xFF;
    rig.run(10);
    assert_eq!(rig.controller.fault(), Fault::HostPaused);
    rig.servo.watchdog = 5;
    meanwhile(rig);
    rig.run(2_000);
}

#[test]
fn the_worm_crawls_on_by_itself_only_where_that_is_safe() {
    const RESUME: &str = "[control]\nresume_after_pause = true\n";
    type Meanwhile = fn(&mut Rig);
    let table: [(&str, &str, Meanwhile, Mode); 7] = [
        ("nothing else is wrong", RESUME, |_| {}, Mode::Crawling),
        ("it is not allowed", "", |_| {}, Mode::Fault),
        (
            "an alarm stands that stops the worm",
            RESUME,
            |rig| rig.raise(AlarmKind::JammedCell),
            Mode::Fault,
        ),
        (
            "an alarm stands that only warns",
            RESUME,
            |rig| rig.raise(AlarmKind::EnergyOverBudget),
            Mode::Crawling,
        ),
        (
            "the servo is silent",
            RESUME,
            |rig| rig.servo_answers = false,
            Mode::Fault,
        ),
        (
            "the tracker is silent",
            RESUME,
            |rig| rig.tracker_runs = false,
            Mode::Fault,
        ),
        (
            "a person decides",
            RESUME,
            |rig| {
                rig.command(CommandKind::Stop, 0.0);
            },
            Mode::Fault,
        ),
    ];
    for (what, toml, meanwhile, mode) in table {
        let mut rig = Rig::crawling(toml);
        let speed = rig.goal_counts;
        trip(&mut rig, meanwhile);
        assert_eq!(rig.mode(), mode, "{what}");
        if mode == Mode::Crawling {
            assert!((rig.goal_counts - speed).abs() <= 1, "{what}: as fast as before");
        }
    }
    let mut rig = Rig::crawling(RESUME);
    for _ in 0..3 {
        trip(&mut rig, |_| {});
        assert_eq!(rig.mode(), Mode::Crawling);
    }
    trip(&mut rig, |_| {});
    assert_eq!(rig.mode(), Mode::Fault, "not a fourth time within a minute");
}

#[test]
fn the_servo_s_clock_is_unwrapped_and_survives_a_restart() {
    let mut rig = Rig::new("");
    rig.run(5);
    assert!(
        rig.tick(None).state.motor_time_s.is_nan(),
        "a register that never counts is no clock"
    );
    // (time that passes, register; the servo's time; all ms)
    for (passes, register, expected) in [
        (1, 32_766, 1),
        (3, 1, 4),
        (300, 3, 6),
        (8, 311, 314),
        (1000, 7, 1314),
        (40_000, 7_239, 41_314),
    ] {
        rig.now_ns += (passes - 1) * MS;
        rig.servo.realtime_tick_ms = register;
        let time_s = rig.tick(None).state.motor_time_s;
        assert!(
            (time_s - expected as f64 * 1e-3).abs() < 1e-9,
            "{time_s} s at register {register}"
        );
    }
}

#[test]
fn alarms_do_what_the_configuration_says() {
    let policies = ["warn", "hold", "back-off", "stop"];
    let expected = [Mode::Crawling, Mode::Holding, Mode::Holding, Mode::Fault];
    for (policy, mode) in policies.into_iter().zip(expected) {
        let toml = format!("[alarms]\nno_progress = {{ policy = \"{policy}\", threshold = 0.3 }}\n");
        let mut rig = Rig::crawling(&toml);
        let at_rad = rig.servo.position_rad;
        rig.raise(AlarmKind::NoProgress);
        rig.run(4000);
        assert_eq!(rig.mode(), mode, "{policy}");
        let turns = (rig.servo.position_rad - at_rad) / TAU;
        let (min, max) = match policy {
            "warn" => (1.59, 1.61),
            "hold" => (0.0, 0.06),
            "back-off" => (-1.06, -0.99),
            _ => (0.0, 0.001),
        };
        assert!(
            (min..=max).contains(&turns),
            "{policy}: the cam went on by {turns} turns"
        );
    }
}

#[test]
fn an_end_waits_for_the_motor_but_not_for_ever() {
    // (servo answers, services fail, longest wait in ms)
    for (servo_answers, services_fail, max_ms) in [(true, false, 400), (false, true, 2500), (true, true, 2500)] {
        let mut rig = Rig::crawling("");
        rig.servo_answers = servo_answers;
        rig.services_fail = services_fail;
        rig.end = true;
        let ticks = (0..10_000).take_while(|_| !rig.tick(None).finished).count();
        assert!(
            ticks < max_ms,
            "{ticks} ms with servo_answers {servo_answers}, services_fail {services_fail}"
        );
    }
}

#[test]
fn missed_and_restarted_tracker_samples_are_counted_apart() {
    let mut rig = Rig::new("");
    rig.tracker_runs = false;
    // (tracker's counter, new, samples, missed)
    for (counter, is_new, samples, missed) in [
        (100, 1, 1, 0),
        (100, 0, 1, 0),
        (101, 1, 2, 0),
        (104, 1, 3, 2),
        (1, 1, 4, 2),
        (2, 1, 5, 2),
    ] {
        rig.tracker.sample = counter;
        let state = rig.tick(None).state;
        assert_eq!(
            (state.sample_is_new, state.sample, state.samples_missed),
            (is_new, samples, missed),
            "{counter}"
        );
    }
}

#[derive(Debug, Clone)]
enum Event {
    Command(u32, f64),
    Alarm(u32),
    Servo(bool),
    Tracker(bool),
    Estimator(bool),
    ServicesFail(bool),
    Reading(f64),
    Watchdog(u8),
    Wait(u64),
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        (0u32..7, prop_oneof![Just(0.0), -1.5f64..1.5, Just(f64::NAN)])
            .prop_map(|(kind, speed)| Event::Command(kind, speed)),
        (0u32..12).prop_map(Event::Alarm),
        any::<bool>().prop_map(Event::Servo),
        any::<bool>().prop_map(Event::Tracker),
        any::<bool>().prop_map(Event::Estimator),
        any::<bool>().prop_map(Event::ServicesFail),
        prop_oneof![Just(f64::NAN), Just(f64::INFINITY), -1e3f64..1e3].prop_map(Event::Reading),
        prop_oneof![Just(0u8), Just(0xFF), Just(5)].prop_map(Event::Watchdog),
        (1u64..800).prop_map(Event::Wait),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever happens: no panic, no motion without torque, no speed beyond the limit, and a fault has a reason.
    #[test]
    fn the_motor_is_never_commanded_where_it_must_not_be(events in prop::collection::vec(event(), 1..40)) {
        let mut rig = Rig::new("[alarms]\nno_progress = { policy = \"back-off\", threshold = 0.3 }\n");
        let limit_counts = (60.0 / 0.229_f64).ceil() as i32;
        for event in events {
            let mut ticks = 1;
            let mut command = None;
            match event {
                Event::Command(kind, cycles_per_s) => command = Some(Command { cycles_per_s, kind, reserved: 0 }),
                Event::Alarm(kind) => {
                    rig.raise(AlarmKind::MotorStall);
                    if let Some(alarm) = &mut rig.alarm {
                        alarm.kind = kind;
                    }
                }
                Event::Servo(on) => rig.servo_answers = on,
                Event::Tracker(on) => rig.tracker_runs = on,
                Event::Estimator(on) => rig.estimator_runs = on,
                Event::ServicesFail(on) => rig.services_fail = on,
                Event::Reading(value) => {
                    rig.servo.current_a = value;
                    rig.servo.voltage_v = value;
                }
                Event::Watchdog(value) => rig.servo.watchdog = value,
                Event::Wait(ms) => ticks = ms,
            }
            for _ in 0..ticks {
                let outputs = rig.tick(command.take());
                let mode = Mode::try_from(outputs.state.mode).expect("a known mode");
                if matches!(mode, Mode::Disarmed | Mode::Armed | Mode::Fault) {
                    prop_assert_eq!(outputs.goal_counts, 0, "while {}", mode);
                }
                prop_assert!(outputs.goal_counts.abs() <= limit_counts);
                prop_assert_eq!(mode == Mode::Fault, outputs.state.fault != Fault::None.code());
                let may_arm = matches!(mode, Mode::Disarmed | Mode::Fault);
                prop_assert!(outputs.service != Some(Service::Arm) || may_arm, "arming while {}", mode);
            }
        }
        rig.end = true;
        let ended = (0..4000).any(|_| rig.tick(None).finished);
        prop_assert!(ended, "an ending process ends");
    }
}
