//! Alarms: as messages and as a level, what stands in the way of a crawl, and what a user may permit.

use super::*;

const ALL_BACK_OFF: &str = "[alarms]\nno_progress = { policy = \"back-off\", threshold = 0.3 }\n\
                            motor_stall = { policy = \"back-off\", threshold = 0.01 }\n\
                            sliding_down = { policy = \"hold\", threshold = 0.003 }\n\
                            jammed_cell = { policy = \"stop\", threshold = 0.4 }\n";

#[test]
fn a_lost_message_is_recovered_from_the_level() {
    for (kind, mode) in [
        (AlarmKind::MotorStall, Mode::Fault),
        (AlarmKind::SlidingDown, Mode::Holding),
        (AlarmKind::EnergyOverBudget, Mode::Crawling),
    ] {
        let mut rig = Rig::crawling("");
        rig.raised_mask = bit(kind);
        rig.run(1);
        assert_eq!(rig.mode(), mode, "{kind}");
        // The message comes after all: it changes nothing.
        rig.raise(kind);
        rig.run(3000);
        assert_eq!(rig.mode(), mode, "{kind}");
    }
    let mut rig = Rig::crawling(ALL_BACK_OFF);
    rig.raised_mask = bit(AlarmKind::NoProgress);
    rig.run(1);
    rig.raise(AlarmKind::NoProgress);
    let at_rad = rig.servo.position_rad;
    rig.run(4000);
    let turns = (rig.servo.position_rad - at_rad) / TAU;
    assert!((-1.06..-0.99).contains(&turns), "backs off once: {turns} turns");
}

#[test]
fn an_estimate_from_before_a_message_does_not_undo_it() {
    // Both are read in one tick, and the estimate is the older one.
    let mut rig = Rig::crawling("");
    rig.command(CommandKind::Hold, 0.0);
    rig.message(AlarmKind::SlidingDown, true);
    rig.run(1);
    rig.raised_mask = bit(AlarmKind::SlidingDown);
    let blocked = (CommandOutcome::AlarmStands, bit(AlarmKind::SlidingDown));
    assert_eq!(
        rig.send(Command::new(CommandKind::Crawl)),
        blocked,
        "a fresh raise counts"
    );
    rig.message(AlarmKind::SlidingDown, false);
    rig.run(1);
    rig.raised_mask = 0;
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::Accepted);
    rig.run(1000);
    assert_eq!(rig.mode(), Mode::Crawling, "the old level does not count again");
}

#[test]
fn a_jam_that_still_stands_after_a_reset_forbids_to_crawl() {
    let mut rig = Rig::crawling("");
    rig.raise(AlarmKind::JammedCell);
    rig.run(600);
    assert_eq!((rig.mode(), rig.controller.fault()), (Mode::Fault, Fault::Alarm));
    assert_eq!(rig.command(CommandKind::Reset, 0.0), CommandOutcome::Accepted);
    rig.run(100);
    assert_eq!(rig.mode(), Mode::Armed, "the level alone does not fault again");
    let jam = bit(AlarmKind::JammedCell);
    assert_eq!(
        rig.send(Command::new(CommandKind::Crawl)),
        (CommandOutcome::AlarmStands, jam)
    );
    // It clears at rest, so there is nothing to permit.
    assert_eq!(
        rig.send(Command::new(CommandKind::Reset)),
        (CommandOutcome::AlarmStands, jam)
    );
    rig.clear(AlarmKind::JammedCell);
    rig.run(1);
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::Accepted);
    rig.run(14_000);
    assert_eq!(rig.mode(), Mode::Crawling);
}

#[test]
fn a_reset_permits_motion_despite_what_does_not_clear_at_rest_until_it_is_raised_again() {
    let toml = "[alarms]\nbattery_low = { policy = \"stop\", threshold = 1.0 }\n";
    let battery = bit(AlarmKind::BatteryLow);
    let reset = Command {
        user: 1000,
        ..Command::new(CommandKind::Reset)
    };
    let mut rig = Rig::crawling(toml);
    assert_eq!(rig.send(reset).0, CommandOutcome::WrongMode, "while crawling");
    rig.raise(AlarmKind::BatteryLow);
    rig.run(10);
    assert_eq!(rig.send(reset).0, CommandOutcome::Accepted, "leaves the fault");
    rig.run(10);
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::AlarmStands);
    assert_eq!(rig.send(reset), (CommandOutcome::Accepted, 0), "permits motion");
    assert!(rig.notes.contains(&Note::Permitted {
        mask: battery,
        user: 1000
    }));
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::Accepted);
    rig.run(5000);
    assert_eq!(rig.mode(), Mode::Crawling);
    // Neither does it come back by itself where a message is lost, nor is a new raise excused.
    rig.estimator_runs = false;
    rig.run(300);
    rig.estimator_runs = true;
    rig.run(300);
    assert_eq!(rig.mode(), Mode::Crawling);
    rig.clear(AlarmKind::BatteryLow);
    rig.run(10);
    rig.raise(AlarmKind::BatteryLow);
    rig.run(1);
    assert_eq!((rig.mode(), rig.controller.fault()), (Mode::Fault, Fault::Alarm));
    let mut rig = Rig::armed(toml);
    assert_eq!(rig.send(reset).0, CommandOutcome::WrongMode, "nothing to permit");
}

#[test]
fn what_a_further_alarm_does_to_a_back_off() {
    // (alarm, when it is raised after the first in ms; what becomes of the worm, and by how many turns it goes back)
    let table = [
        // Before the cam has turned round it is the same trouble.
        (AlarmKind::MotorStall, 50, Mode::Holding, 1.0),
        // On the way back it shows that going back does not help.
        (AlarmKind::MotorStall, 1000, Mode::Holding, 0.3),
        (AlarmKind::NoProgress, 1000, Mode::Holding, 0.3),
        (AlarmKind::SlidingDown, 1000, Mode::Holding, 0.3),
        (AlarmKind::JammedCell, 1000, Mode::Fault, 0.25),
        (AlarmKind::EnergyOverBudget, 1000, Mode::Holding, 1.0),
    ];
    for (kind, after_ms, mode, turns) in table {
        let mut rig = Rig::crawling(ALL_BACK_OFF);
        rig.raise(AlarmKind::NoProgress);
        let at_rad = rig.servo.position_rad;
        rig.run(after_ms);
        rig.raise(kind);
        rig.run(6000);
        assert_eq!(rig.mode(), mode, "{kind} after {after_ms} ms");
        let went = (at_rad - rig.servo.position_rad) / TAU;
        assert!(
            (went - turns).abs() < 0.07,
            "{kind} after {after_ms} ms: {went} turns back"
        );
        if mode == Mode::Holding {
            assert_eq!(rig.hold_reason(), HoldReason::Alarm);
            assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::AlarmStands);
        }
    }
}

#[test]
fn a_back_off_that_a_blocked_cam_never_ends_becomes_a_hold() {
    let mut rig = Rig::crawling(ALL_BACK_OFF);
    rig.raise(AlarmKind::MotorStall);
    let at_rad = rig.servo.position_rad;
    for _ in 0..8000 {
        rig.tick(None);
        rig.servo.position_rad = at_rad;
    }
    assert_eq!((rig.mode(), rig.hold_reason()), (Mode::Holding, HoldReason::Alarm));
    assert!(rig.notes.contains(&Note::BackOffTimedOut));
}

#[test]
fn to_acknowledge_marks_what_stands_and_permits_nothing() {
    let acknowledge = |alarm_mask, user| Command {
        alarm_mask,
        user,
        ..Command::new(CommandKind::Acknowledge)
    };
    let (slide, energy) = (bit(AlarmKind::SlidingDown), bit(AlarmKind::EnergyOverBudget));
    let marks = |rig: &Rig| (rig.state().acknowledged_mask, rig.state().acknowledged_by);
    for begin in [Rig::new, Rig::armed, Rig::crawling] {
        let mut rig = begin("");
        let nothing = (CommandOutcome::Accepted, 0);
        assert_eq!(rig.send(acknowledge(0, 7)), nothing, "none stands");
        assert_eq!((marks(&rig), rig.notes.len()), ((0, u32::MAX), 0));
        rig.raise(AlarmKind::SlidingDown);
        rig.raise(AlarmKind::EnergyOverBudget);
        rig.run(1);
        let mode = rig.mode();
        assert_eq!(rig.send(acknowledge(slide, 7)), (CommandOutcome::Accepted, slide));
        assert_eq!((marks(&rig), rig.mode()), ((slide, 7), mode));
        assert_eq!(rig.send(acknowledge(0, 8)), (CommandOutcome::Accepted, slide | energy));
        assert_eq!(marks(&rig), (slide | energy, 8));
        if mode == Mode::Holding {
            assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::AlarmStands);
        }
        rig.clear(AlarmKind::SlidingDown);
        rig.run(1);
        assert_eq!(marks(&rig), (energy, 8));
        // Raised again, it has not been seen; also where the level alone shows that it was cleared.
        rig.raise(AlarmKind::SlidingDown);
        rig.raised_mask &= !energy;
        rig.run(1);
        assert_eq!(marks(&rig), (0, u32::MAX));
    }
}

#[test]
fn a_silent_estimator_that_is_not_required_leaves_no_alarm_behind() {
    let mut rig = Rig::crawling("[control]\nrequire_estimator = false\n");
    rig.raise(AlarmKind::NoProgress);
    rig.run(10);
    rig.estimator_runs = false;
    rig.run(300);
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::AlarmStands);
    rig.run(300);
    assert_eq!(rig.command(CommandKind::Crawl, 0.0), CommandOutcome::Accepted);
}
