//! What stops the worm, and how it leaves a fault.

use super::*;

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
        assert_eq!(
            rig.disarms, 1,
            "{fault}: torque is switched off in the tick that sees it"
        );
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
fn a_reset_ignores_readings_from_before_it() {
    // The reading of the tick that prepares the servo again was taken before that.
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
fn an_over_current_with_single_low_readings_is_still_one() {
    // (share of the readings that are above the limit, in per cent; whether the worm is stopped)
    for (high_percent, stops) in [(99, true), (90, true), (75, false), (50, false)] {
        let mut rig = Rig::crawling("");
        for tick in 0..20_000_u32 {
            rig.servo.current_a = if tick % 100 < high_percent { -0.95 } else { 0.2 };
            rig.run(1);
        }
        assert_eq!(rig.controller.fault() == Fault::OverCurrent, stops, "{high_percent} %");
    }
}
