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
