//! Commands, modes and the end of a run.

use super::*;

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
    let before_rad = rig.servo.position_rad;
    rig.run(1000);
    let turns_per_s = (rig.servo.position_rad - before_rad) / TAU;
    assert!(
        (turns_per_s + 0.2).abs() < 1e-5,
        "backward at the asked speed: {turns_per_s} turns per second"
    );
    let state = rig.state();
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
