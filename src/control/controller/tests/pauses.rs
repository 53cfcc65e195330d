//! Pauses of the computer.

use super::*;

#[test]
fn a_pause_of_the_computer_is_not_silence() {
    let mut rig = Rig::crawling("");
    for pause_ms in [300, 20, 90, 600, 300] {
        rig.pause(pause_ms);
        rig.run(5);
        assert_eq!(rig.mode(), Mode::Crawling, "after {pause_ms} ms");
    }
    let state = rig.tick(None).state;
    assert_eq!(state.host_paused_ns, 1310 * MS);
    // Real silence is still detected in time; only the pause is left out.
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
fn a_pause_that_outlasts_the_watchdog_is_reported_as_a_pause() {
    for (pause_ms, fault) in [
        (150, Fault::HostPaused),
        // Half of what the servo's watchdog waits for.
        (40, Fault::HostPaused),
        (30, Fault::WatchdogTripped),
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

/// Trips the watchdog with a pause, then runs for two seconds, in which the servo can be prepared again.
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
            "an alarm is raised that stops the worm",
            RESUME,
            |rig| rig.raise(AlarmKind::JammedCell),
            Mode::Fault,
        ),
        (
            "an alarm is raised that only warns",
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
