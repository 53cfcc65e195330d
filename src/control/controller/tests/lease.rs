//! How long a crawl lasts: the lease, its time limit, and idling.

use super::*;

const BACK_OFF: &str = "[alarms]\nno_progress = { policy = \"back-off\", threshold = 0.3 }\n";

fn crawl_for(limit_s: f64) -> Command {
    Command {
        limit_s,
        ..Command::new(CommandKind::Crawl)
    }
}

#[test]
fn a_lapsed_lease_stops_the_motor_at_once() {
    let stop = format!("{BACK_OFF}[control]\non_lapsed_lease = \"stop\"\n");
    for toml in [BACK_OFF, &stop] {
        for is_backing_off in [false, true] {
            let mut rig = Rig::crawling(toml);
            if is_backing_off {
                rig.raise(AlarmKind::NoProgress);
                rig.run(700);
                assert!(rig.goal_counts < 0, "it goes back");
            }
            rig.lease = Lease::Lapsed;
            rig.run(1);
            assert_eq!(rig.goal_counts, 0, "without a ramp");
            assert_eq!(rig.notes.last(), Some(&Note::LeaseLapsed));
            let at_rad = rig.servo.position_rad;
            rig.run(1000);
            let went_rad = (rig.servo.position_rad - at_rad).abs();
            assert!(
                went_rad < 0.003,
                "{went_rad} rad: a hold does not turn the cam back either"
            );
            if toml == BACK_OFF {
                assert_eq!(
                    (rig.mode(), rig.hold_reason()),
                    (Mode::Holding, HoldReason::LeaseLapsed)
                );
                assert_eq!(rig.disarms, 0, "a worm on a slope must not fall");
            } else {
                assert_eq!((rig.mode(), rig.disarms), (Mode::Disarmed, 1));
            }
        }
    }
}

#[test]
fn a_lease_that_lapses_cuts_a_ramp_short() {
    for kind in [CommandKind::Hold, CommandKind::Stop] {
        let mut rig = Rig::crawling("");
        rig.command(kind, 0.0);
        rig.run(20);
        assert!(rig.goal_counts > 50, "the ramp takes 250 ms");
        rig.lease = Lease::Lapsed;
        rig.run(1);
        assert_eq!(rig.goal_counts, 0, "{kind}");
    }
}

#[test]
fn a_lease_that_is_back_does_not_move_the_worm_but_a_command_does() {
    let mut rig = Rig::crawling("");
    rig.lease = Lease::Lapsed;
    rig.run(100);
    rig.lease = Lease::Held;
    rig.run(1000);
    assert_eq!((rig.mode(), rig.goal_counts), (Mode::Holding, 0));
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::Accepted);
    rig.run(700_000);
    assert_eq!(rig.mode(), Mode::Crawling, "under a held lease there is no limit");
}

#[test]
fn a_crawl_ends_after_its_time() {
    // (lease when commanded, limit_s of the command; the time after which it must have ended, s)
    for (lease, limit_s, ends_s) in [
        (Lease::None, 0.0, 5),
        (Lease::None, 2.0, 2),
        (Lease::None, 8.0, 8),
        (Lease::Lapsed, 8.0, 8),
        (Lease::Held, 3.0, 3),
    ] {
        let mut rig = Rig::armed("[control]\ncrawl_limit_s = 5.0\n");
        rig.lease = lease;
        assert_eq!(rig.send(crawl_for(limit_s)).0, CommandOutcome::Accepted);
        rig.run(ends_s * 1000 - 2);
        assert_eq!(rig.mode(), Mode::Crawling, "{lease:?}, {limit_s} s: not yet");
        // A pause of the computer takes nothing of it.
        rig.pause(300);
        rig.run(2);
        assert_eq!(
            (rig.mode(), rig.hold_reason()),
            (Mode::Holding, HoldReason::TimeLimit),
            "{lease:?}, {limit_s} s"
        );
        assert!(rig.goal_counts > 50, "it ramps down");
        rig.run(500);
        assert_eq!((rig.goal_counts, rig.notes.last()), (0, Some(&Note::TimeLimit)));
    }
}

#[test]
fn every_crawl_command_renews_the_time() {
    let mut rig = Rig::armed("[control]\ncrawl_limit_s = 5.0\n");
    rig.lease = Lease::None;
    for _ in 0..20 {
        assert_eq!(rig.send(crawl_for(1.0)).0, CommandOutcome::Accepted);
        rig.run(900);
        assert_eq!(rig.mode(), Mode::Crawling);
    }
    rig.run(101);
    assert_eq!(rig.mode(), Mode::Holding);
}

#[test]
fn a_renewal_never_overrules_a_hold() {
    let mut rig = Rig::armed("[control]\ncrawl_limit_s = 5.0\n");
    rig.lease = Lease::None;
    let renewal = Command {
        limit_s: 1.0,
        cycles_per_s: 0.1,
        ..Command::new(CommandKind::Renew)
    };
    assert_eq!(rig.send(renewal).0, CommandOutcome::WrongMode, "it begins no crawl");
    assert_eq!(rig.send(crawl_for(1.0)).0, CommandOutcome::Accepted);
    for _ in 0..20 {
        rig.run(900);
        assert_eq!(rig.send(renewal).0, CommandOutcome::Accepted);
    }
    let speed_counts = rig.goal_counts;
    rig.run(900);
    assert_eq!(rig.goal_counts, speed_counts, "the speed stays as it was commanded");
    // A hold, and in the very next tick the renewal that was on its way.
    assert_eq!(rig.command(CommandKind::Hold, 0.0), CommandOutcome::Accepted);
    assert_eq!(rig.send(renewal).0, CommandOutcome::WrongMode);
    rig.run(1000);
    assert_eq!((rig.mode(), rig.goal_counts), (Mode::Holding, 0));
}

#[test]
fn a_renewed_crawl_backs_off_to_the_end() {
    let mut rig = Rig::armed(BACK_OFF);
    rig.lease = Lease::None;
    assert_eq!(rig.send(crawl_for(1.0)).0, CommandOutcome::Accepted);
    rig.run(500);
    rig.raise(AlarmKind::NoProgress);
    let renewal = Command {
        limit_s: 1.0,
        ..Command::new(CommandKind::Renew)
    };
    let mut renewals = 0;
    while rig.mode() == Mode::Crawling {
        assert_eq!(rig.send(renewal).0, CommandOutcome::Accepted);
        renewals += 1;
        rig.run(249);
    }
    assert!(renewals > 8, "a back-off takes a cycle");
    assert_eq!(rig.hold_reason(), HoldReason::Alarm);
}

#[test]
fn without_its_lease_a_crawl_needs_a_time() {
    let mut rig = Rig::armed("");
    rig.lease = Lease::Lapsed;
    // The last command of a supervisor that has died.
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::NoLease);
    assert_eq!(rig.mode(), Mode::Armed);
    assert_eq!(rig.send(crawl_for(600.0)).0, CommandOutcome::Accepted);
    rig.run(500);
    // The supervisor is back, and watches over this crawl, too.
    rig.lease = Lease::Held;
    rig.run(500);
    rig.lease = Lease::Lapsed;
    rig.run(1);
    assert_eq!((rig.mode(), rig.goal_counts), (Mode::Holding, 0));
}

#[test]
fn a_limit_that_is_no_time_is_refused() {
    for limit_s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
        let mut rig = Rig::armed("");
        assert_eq!(rig.send(crawl_for(limit_s)).0, CommandOutcome::BadSpeed, "{limit_s}");
        assert_eq!(rig.mode(), Mode::Armed);
    }
    let mut rig = Rig::armed("");
    assert_eq!(rig.send(crawl_for(f64::MAX)).0, CommandOutcome::Accepted);
    rig.run(1000);
    assert_eq!(rig.mode(), Mode::Crawling, "a limit beyond every clock is none");
}

#[test]
fn torque_goes_off_after_idling_where_that_is_configured() {
    // (slope in degrees, idle_disarm, whether torque goes off)
    for (slope_deg, idle_disarm, goes_off) in [
        (0, "level", true),
        (-5, "level", true),
        (6, "level", false),
        (-30, "level", false),
        (30, "always", true),
        (0, "never", false),
    ] {
        let toml =
            format!("canal.slope_deg = {slope_deg}\n[control]\nidle_disarm = \"{idle_disarm}\"\nidle_disarm_s = 2.0\n");
        for is_holding in [false, true] {
            let mut rig = if is_holding {
                Rig::crawling(&toml)
            } else {
                Rig::armed(&toml)
            };
            if is_holding {
                rig.command(CommandKind::Hold, 0.0);
                rig.run(400);
                // Someone turns the cam, and the hold turns it back: the worm does not idle.
                rig.run(1000);
                rig.servo.position_rad += 0.1;
                rig.run(900);
            }
            rig.run(1800);
            assert!(matches!(rig.mode(), Mode::Armed | Mode::Holding), "not yet");
            rig.run(2000);
            let case = format!("{slope_deg}°, {idle_disarm}, holding: {is_holding}");
            assert_eq!(rig.mode() == Mode::Disarmed, goes_off, "{case}");
            assert_eq!(rig.notes.contains(&Note::Idle), goes_off, "{case}");
        }
    }
}

#[test]
fn a_crawling_worm_does_not_idle_and_a_command_begins_the_time_anew() {
    let mut rig = Rig::crawling("[control]\nidle_disarm_s = 2.0\n");
    rig.run(10_000);
    assert_eq!(rig.mode(), Mode::Crawling);
    rig.command(CommandKind::Hold, 0.0);
    for _ in 0..5 {
        rig.run(1_800);
        assert_eq!(rig.command(CommandKind::Hold, 0.0), CommandOutcome::Accepted);
    }
    assert_eq!(rig.mode(), Mode::Holding);
}
