//! What holds for every sequence of commands, alarms and readings.

use super::*;
use proptest::prelude::*;

#[derive(Debug, Clone)]
enum Event {
    Command(u32, f64),
    Alarm(u32),
    Level(u32),
    Lease(Lease),
    EmergencyStop(Option<bool>),
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
        (0u32..8, prop_oneof![Just(0.0), -1.5f64..1.5, Just(f64::NAN)])
            .prop_map(|(kind, speed)| Event::Command(kind, speed)),
        (0u32..12).prop_map(Event::Alarm),
        prop_oneof![Just(0u32), any::<u32>()].prop_map(Event::Level),
        prop_oneof![Just(Lease::None), Just(Lease::Held), Just(Lease::Lapsed)].prop_map(Event::Lease),
        prop_oneof![Just(None), Just(Some(false)), Just(Some(true))].prop_map(Event::EmergencyStop),
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
                Event::Command(kind, cycles_per_s) => command = Some(Command { cycles_per_s, kind, ..Command::new(CommandKind::Stop) }),
                Event::Alarm(kind) => {
                    rig.raise(AlarmKind::MotorStall);
                    if let Some(alarm) = rig.messages.last_mut() {
                        alarm.kind = kind;
                    }
                }
                Event::Level(mask) => rig.raised_mask = mask,
                Event::Lease(lease) => rig.lease = lease,
                Event::EmergencyStop(pressed) => rig.emergency_stop = pressed,
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
                if rig.emergency_stop == Some(true) {
                    prop_assert!(matches!(mode, Mode::Disarmed | Mode::Fault), "{} in an emergency", mode);
                }
                prop_assert_eq!(mode == Mode::Holding, outputs.state.hold_reason != HoldReason::None.code());
                prop_assert_eq!(outputs.state.acknowledged_mask & !((1 << AlarmKind::ALL.len()) - 1), 0);
                let may_arm = matches!(mode, Mode::Disarmed | Mode::Fault);
                prop_assert!(outputs.service != Some(Service::Arm) || may_arm, "arming while {}", mode);
            }
        }
        rig.end = true;
        let ended = (0..4000).any(|_| rig.tick(None).finished);
        prop_assert!(ended, "an ending process ends");
    }
}
