//! From the counters of servo and tracker to the state.

use super::*;

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

#[test]
fn the_servo_s_position_passes_the_end_of_its_register_without_a_jump() {
    let range_rad = 4_294_967_296.0 / 4096.0 * TAU;
    for sign in [1.0, -1.0] {
        let toml = format!("servo.positive_is_forward = {}\n", sign > 0.0);
        for direction in [1.0, -1.0] {
            let mut rig = Rig::new(&toml);
            // Five turns before the end in this direction.
            rig.servo.position_rad = direction * (range_rad / 2.0 - 5.0 * TAU);
            rig.run(10);
            rig.command(CommandKind::Arm, 0.0);
            rig.run(2);
            let began = rig.state().phase;
            rig.command(CommandKind::Crawl, sign * direction * 0.4);
            let mut last = began;
            for _ in 0..30_000 {
                if rig.servo.position_rad.abs() >= range_rad / 2.0 {
                    rig.servo.position_rad -= direction * range_rad;
                }
                let phase = rig.tick(None).state.phase;
                assert!((phase - last).abs() < 1e-3, "from {last} to {phase} cycles");
                last = phase;
            }
            assert!(
                (last - began) * sign * direction > 11.0,
                "it went on: {began} to {last}"
            );
            assert!(rig.servo.position_rad * direction < 0.0, "the end was passed");
            rig.command(CommandKind::Hold, 0.0);
            rig.run(1000);
            // Held just at the end, and pushed back and forth over it.
            let past_rad = direction * rig.servo.position_rad + range_rad / 2.0;
            rig.servo.position_rad -= direction * past_rad; // to the very end, by hand
            let within_a_turn_rad = past_rad - (past_rad / TAU).round() * TAU;
            rig.controller.hold_angle_rad = Some(rig.state().motor_angle_rad - sign * direction * within_a_turn_rad);
            for push in [-0.01, 0.01, -0.01, 0.01] {
                rig.servo.position_rad += push;
                if rig.servo.position_rad >= range_rad / 2.0 {
                    rig.servo.position_rad -= range_rad;
                } else if rig.servo.position_rad < -range_rad / 2.0 {
                    rig.servo.position_rad += range_rad;
                }
                rig.run(1);
                assert!(rig.goal_counts.abs() <= 5, "{} counts", rig.goal_counts);
            }
        }
    }
}

#[test]
fn a_servo_that_counts_its_turns_anew_after_a_restart_does_not_move_the_phase() {
    for sign in [1.0, -1.0] {
        let mut rig = Rig::crawling(&format!("servo.positive_is_forward = {}\n", sign > 0.0));
        for turns in [1.0, 3.0, -2.0] {
            rig.run(9_000);
            let before = rig.state().phase;
            rig.servo.position_rad -= turns * TAU;
            let after = rig.tick(None).state.phase;
            assert!(
                (0.0..1e-3).contains(&(after - before)),
                "from {before} to {after} cycles when {turns} turns are forgotten"
            );
        }
    }
}
