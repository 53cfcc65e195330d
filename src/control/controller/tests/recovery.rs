//! Stopping in every mode, the emergency stop, services that fail, and getting out of a fault.

use super::*;

#[test]
fn a_reset_during_the_attempts_to_disarm_is_not_undone_by_them() {
    let mut rig = Rig::crawling("");
    // The port is pulled: torque cannot be switched off, which is tried again every half second.
    rig.servo_answers = false;
    rig.services_fail = true;
    for reset_ms in [1_700, 2_000, 2_001, 2_350] {
        rig.run(reset_ms);
        assert_eq!(rig.controller.fault(), Fault::LinkLost);
    }
    rig.servo_answers = true;
    rig.services_fail = false;
    rig.servo.watchdog = 0xFF;
    assert_eq!(rig.command(CommandKind::Reset, 0.0), CommandOutcome::Accepted);
    rig.run(1);
    assert_eq!(rig.mode(), Mode::Armed);
    let disarms = rig.disarms;
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::Accepted);
    rig.run(20_000);
    assert_eq!((rig.mode(), rig.disarms), (Mode::Crawling, disarms));
}

#[test]
fn a_reset_in_the_tick_of_an_attempt_to_disarm_is_not_lost() {
    for offset_ms in 0..510 {
        let mut rig = Rig::crawling("");
        rig.servo_answers = false;
        rig.services_fail = true;
        rig.run(700 + offset_ms);
        rig.servo_answers = true;
        rig.services_fail = false;
        assert_eq!(rig.command(CommandKind::Reset, 0.0), CommandOutcome::Accepted);
        rig.run(3);
        assert_eq!(rig.mode(), Mode::Armed, "{offset_ms} ms");
    }
}

#[test]
fn an_arming_that_fails_ends_disarmed_only_once_torque_is_known_to_be_off() {
    let mut rig = Rig::new("");
    rig.run(10);
    rig.services_fail = true;
    rig.command(CommandKind::Arm, 0.0);
    rig.run(1);
    assert_ne!(rig.mode(), Mode::Disarmed, "torque may be on");
    rig.run(1000);
    assert_eq!((rig.mode(), rig.controller.fault()), (Mode::Fault, Fault::LinkLost));
    let disarms = rig.disarms;
    rig.run(1000);
    assert_eq!(rig.disarms, disarms + 2, "it goes on trying");
    rig.services_fail = false;
    rig.run(1000);
    let disarms = rig.disarms;
    rig.run(2000);
    assert_eq!(rig.disarms, disarms, "until it is confirmed");
    // A reset whose arming fails, likewise.
    rig.services_fail = true;
    rig.command(CommandKind::Reset, 0.0);
    rig.run(1000);
    assert_eq!(rig.mode(), Mode::Fault);
    assert!(rig.disarms >= disarms + 2);

    // Where only the arming fails, torque is confirmed to be off in the next tick.
    let mut rig = Rig::new("");
    rig.run(10);
    rig.services_fail = true;
    rig.servo.watchdog = 0; // never prepared
    rig.command(CommandKind::Arm, 0.0);
    rig.services_fail = false;
    rig.run(2);
    assert_eq!((rig.mode(), rig.disarms), (Mode::Disarmed, 1));
}

/// Without torque a cam that still turns would be turned on by the worm's weight. The wait for it begins where the ramp ends.
#[test]
fn torque_stays_on_until_the_cam_stands_after_a_long_ramp() {
    // A goal below one count is sent as none, so the ramp ends some ms later than the goal that is sent.
    for (stands_after_ms, disarmed_ms) in [(0, 0..=30), (300, 300..=310), (900, 500..=530)] {
        let mut rig = Rig::crawling("gait.ramp_s = 2.0");
        rig.run(2_000);
        rig.command(CommandKind::Stop, 0.0);
        rig.coasts_rad_s = 0.5;
        while rig.goal_counts != 0 {
            assert_eq!(rig.mode(), Mode::Stopping);
            rig.run(1);
        }
        let mut took_ms = 0;
        while rig.mode() == Mode::Stopping && took_ms < 2_000 {
            if took_ms == stands_after_ms {
                rig.coasts_rad_s = 0.0;
            }
            rig.run(1);
            took_ms += 1;
        }
        assert_eq!(rig.mode(), Mode::Disarmed);
        assert!(
            disarmed_ms.contains(&took_ms),
            "stands after {stands_after_ms} ms, disarmed after {took_ms} ms"
        );
    }
}

#[test]
fn stop_is_accepted_in_every_mode() {
    let crawling = || Rig::crawling("");
    let mut holding = crawling();
    holding.command(CommandKind::Hold, 0.0);
    let mut stopping = crawling();
    stopping.command(CommandKind::Stop, 0.0);
    stopping.run(10);
    let mut faulty = crawling();
    faulty.servo.alert = true;
    faulty.run(1);
    for mut rig in [Rig::new(""), Rig::armed(""), crawling(), holding, stopping, faulty] {
        let from = rig.mode();
        assert_eq!(rig.command(CommandKind::Stop, 0.0), CommandOutcome::Accepted, "{from}");
        rig.run(500);
        let expected = if from == Mode::Fault { from } else { Mode::Disarmed };
        assert_eq!((rig.mode(), rig.goal_counts), (expected, 0), "{from}");
    }
}

#[test]
fn stop_in_a_fault_tries_again_at_once_to_switch_torque_off() {
    let mut rig = Rig::crawling("");
    rig.servo_answers = false;
    rig.services_fail = true;
    rig.run(110);
    let disarms = rig.disarms;
    assert_eq!(rig.command(CommandKind::Stop, 0.0), CommandOutcome::Accepted);
    assert_eq!(rig.disarms, disarms + 1, "in the same tick");
    rig.services_fail = false;
    rig.command(CommandKind::Stop, 0.0);
    rig.run(1);
    let disarms = rig.disarms;
    rig.command(CommandKind::Stop, 0.0);
    rig.run(1000);
    assert_eq!(rig.disarms, disarms, "torque is known to be off");
}

#[test]
fn the_emergency_stop_disarms_in_the_tick_that_sees_it() {
    let mut holding = Rig::crawling("");
    holding.command(CommandKind::Hold, 0.0);
    let mut stopping = Rig::crawling("");
    stopping.command(CommandKind::Stop, 0.0);
    for mut rig in [Rig::armed(""), Rig::crawling(""), holding, stopping] {
        let from = rig.mode();
        rig.emergency_stop = Some(false);
        rig.run(1);
        assert_eq!(rig.state().emergency_stop, 0);
        let disarms = rig.disarms;
        rig.emergency_stop = Some(true);
        rig.run(1);
        assert_eq!(
            (rig.mode(), rig.controller.fault(), rig.goal_counts, rig.disarms),
            (Mode::Fault, Fault::EmergencyStop, 0, disarms + 1),
            "{from}"
        );
        assert_eq!(rig.state().emergency_stop, 1);
        for kind in [CommandKind::Arm, CommandKind::Crawl, CommandKind::Reset] {
            assert_eq!(rig.command(kind, 0.0), CommandOutcome::FaultPersists, "{kind}");
        }
        assert_eq!(rig.command(CommandKind::Stop, 0.0), CommandOutcome::Accepted);
        rig.run(1000);
        assert_eq!(rig.mode(), Mode::Fault);
        rig.emergency_stop = Some(false);
        assert_eq!(rig.command(CommandKind::Reset, 0.0), CommandOutcome::Accepted);
        rig.run(10);
        assert_eq!(rig.mode(), Mode::Armed, "{from}");
    }
    // Disarmed, it keeps the worm disarmed, also where it is pressed while the servo is being prepared.
    let mut rig = Rig::new("");
    rig.emergency_stop = Some(true);
    rig.run(10);
    assert_eq!(rig.command(CommandKind::Arm, 0.0), CommandOutcome::FaultPersists);
    assert_eq!((rig.mode(), rig.arms), (Mode::Disarmed, 0));
    rig.emergency_stop = Some(false);
    rig.command(CommandKind::Arm, 0.0);
    rig.emergency_stop = Some(true);
    rig.run(1);
    assert_eq!((rig.controller.fault(), rig.disarms), (Fault::EmergencyStop, 1));
    assert_eq!(Rig::armed("").state().emergency_stop, u32::MAX, "none is configured");
}

#[test]
fn the_time_of_a_service_is_neither_silence_nor_ramp_time() {
    let mut rig = Rig::new("");
    rig.service_ms = 900;
    rig.run(10);
    rig.command(CommandKind::Arm, 0.0);
    // The first exchange after it is lost.
    rig.servo_answers = false;
    rig.run(1);
    assert_eq!((rig.mode(), rig.controller.fault()), (Mode::Armed, Fault::None));
    rig.servo_answers = true;
    rig.run(5);
    assert_eq!(rig.state().host_paused_ns, 0, "nor a pause of the computer");

    // A crawl that begins with the arming ramps up as ever.
    let mut rig = Rig::crawling("[control]\nresume_after_pause = true\n");
    let speed = rig.goal_counts;
    rig.service_ms = 900;
    rig.pause(150);
    rig.servo.watchdog = 0xFF;
    rig.run(10);
    assert_eq!(rig.controller.fault(), Fault::HostPaused);
    while rig.mode() != Mode::Crawling {
        rig.run(1);
    }
    assert!(
        rig.goal_counts < speed / 20,
        "{} counts in the first tick",
        rig.goal_counts
    );
}

#[test]
fn a_worm_does_not_resume_what_a_lapsed_lease_an_emergency_stop_or_a_silent_estimator_forbids() {
    type Trouble = fn(&mut Rig);
    let table: [(Trouble, Mode); 4] = [
        (|_| {}, Mode::Crawling),
        (|rig| rig.lease = Lease::Lapsed, Mode::Fault),
        (|rig| rig.emergency_stop = Some(true), Mode::Fault),
        (|rig| rig.estimator_runs = false, Mode::Fault),
    ];
    for (index, (trouble, mode)) in table.into_iter().enumerate() {
        let mut rig = Rig::crawling("[control]\nresume_after_pause = true\n");
        rig.pause(150);
        rig.servo.watchdog = 0xFF;
        rig.run(10);
        trouble(&mut rig);
        rig.run(3000);
        assert_eq!(rig.mode(), mode, "row {index}");
    }
}

#[test]
fn a_servo_that_was_silent_because_it_restarted_is_reported_so() {
    for (watchdog, fault) in [
        (0, Fault::ServoRestarted),
        (0xFF, Fault::LinkLost),
        (5, Fault::LinkLost),
    ] {
        let mut rig = Rig::crawling("");
        rig.servo_answers = false;
        rig.services_fail = true;
        rig.run(300);
        assert_eq!(rig.controller.fault(), Fault::LinkLost);
        rig.servo_answers = true;
        rig.services_fail = false;
        rig.servo.watchdog = watchdog;
        rig.run(1);
        assert_eq!((rig.mode(), rig.controller.fault()), (Mode::Fault, fault), "{watchdog}");
        assert_eq!(rig.command(CommandKind::Reset, 0.0), CommandOutcome::Accepted);
        rig.run(10);
        assert_eq!(rig.mode(), Mode::Armed);
    }
}

#[test]
fn a_dead_line_is_the_reason_where_it_silences_the_emergency_stop_too() {
    let silent = |emergency_after_ms: u64| {
        let mut rig = Rig::crawling("");
        rig.emergency_stop = Some(false);
        rig.run(10);
        rig.servo_answers = false;
        let mut passed_ms = 0;
        while rig.mode() != Mode::Fault {
            passed_ms += 1;
            rig.emergency_stop = Some(passed_ms >= emergency_after_ms);
            rig.run(1);
        }
        (rig, passed_ms)
    };
    let (_, link_lost_ms) = silent(u64::MAX);
    for (emergency_ms, reason) in [
        (link_lost_ms - 1, Fault::EmergencyStop),
        (link_lost_ms, Fault::LinkLost),
        (link_lost_ms + 1, Fault::LinkLost),
    ] {
        let (mut rig, stopped_ms) = silent(emergency_ms);
        assert_eq!(rig.controller.fault(), reason, "unread from {emergency_ms} ms on");
        assert_eq!(stopped_ms, emergency_ms.min(link_lost_ms));
        rig.emergency_stop = Some(true);
        rig.servo_answers = true;
        rig.run(100);
        assert_eq!(rig.controller.fault(), reason, "the first reason stays");
        assert_eq!(rig.command(CommandKind::Reset, 0.0), CommandOutcome::FaultPersists);
    }
}

#[test]
fn a_worm_does_not_resume_long_after_the_pause() {
    for (silent_s, resumes) in [(5, true), (15, false)] {
        let mut rig = Rig::crawling("[control]\nresume_after_pause = true\n");
        rig.pause(150);
        rig.servo.watchdog = 0xFF;
        rig.run(10);
        assert_eq!(rig.controller.fault(), Fault::HostPaused);
        rig.tracker_runs = false;
        rig.run(silent_s * 1000);
        assert_eq!(rig.mode(), Mode::Fault);
        rig.tracker_runs = true;
        rig.run(3000);
        assert_eq!(rig.mode() == Mode::Crawling, resumes, "{silent_s} s without a tracker");
    }
}
