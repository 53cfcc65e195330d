use super::*;

const REST: Truth = Truth {
    velocity_rad_s: 0.0,
    phase: 0.0,
    stood_ns: 0,
};

/// The state of a tick at 250 Hz, and what is changed in it.
fn state(tick: u64, change: impl FnOnce(&mut State)) -> State {
    let mut state = State::unknown(4);
    (state.sequence, state.time_ns) = (tick, 1_000_000_000 + tick * 4_000_000);
    (state.mode, state.motor_is_new) = (Mode::Armed.code(), 1);
    (state.phase, state.motor_angle_rad) = (0.0, 0.0);
    state.motor_time_s = tick as f64 * 4e-3;
    change(&mut state);
    state
}

fn invariants() -> Invariants {
    Invariants::new(&Config::from_toml("control.rate_hz = 250.0", "test".as_ref()).expect("a valid configuration"))
}

/// The rule that the last of these ticks breaks; the ones before it break none.
fn broken(ticks: &[(State, i32, Truth)]) -> Option<&'static str> {
    let mut invariants = invariants();
    let (last, before) = ticks.split_last()?;
    for (state, goal_counts, truth) in before {
        assert_eq!(invariants.look(state, *goal_counts, truth), None);
    }
    invariants.look(&last.0, last.1, &last.2).map(|broken| broken.rule)
}

#[test]
fn every_rule_can_be_broken() {
    let rest = |tick| (state(tick, |_| {}), 0, REST);
    assert_eq!(broken(&[rest(1), rest(2)]), None);
    assert_eq!(broken(&[rest(1), rest(3)]), Some("states have no gap"));
    let fault = |tick, fault: Fault| {
        let state = state(tick, |state| {
            (state.mode, state.fault) = (Mode::Fault.code(), fault.code());
        });
        (state, 0, REST)
    };
    assert_eq!(
        broken(&[fault(1, Fault::LinkLost), fault(2, Fault::UnderVoltage)]),
        Some("the first reason is kept")
    );
    assert_eq!(
        broken(&[fault(1, Fault::LinkLost), fault(2, Fault::ServoRestarted)]),
        None,
        "the same event, known better"
    );
    assert_eq!(
        broken(&[(state(1, |_| {}), 3, REST)]),
        Some("no goal but 0 unless the worm is to move")
    );
    // 0.25 s from rest to a turn in 2.5 s.
    let crawl = |tick, goal_velocity_rad_s| {
        let state = state(tick, |state| {
            (state.mode, state.goal_velocity_rad_s) = (Mode::Crawling.code(), goal_velocity_rad_s);
        });
        (state, 1, REST)
    };
    assert_eq!(broken(&[rest(1), crawl(2, 0.04)]), None);
    assert_eq!(broken(&[rest(1), crawl(2, 0.05)]), Some("the goal follows the ramp"));
    assert_eq!(
        broken(&[crawl(1, 2.5), crawl(2, 2.4)]),
        Some("the goal follows the ramp")
    );
    let turning = Truth {
        velocity_rad_s: 2.5,
        ..REST
    };
    let turns = |tick| (fault(tick, Fault::Alarm).0, 0, turning);
    let while_allowed: Vec<_> = (1..=17).map(turns).collect();
    assert_eq!(broken(&while_allowed), None, "while the servo decelerates");
    let mut for_long: Vec<_> = (1..=18).map(turns).collect();
    for_long[17].0.time_ns += 1_000_000; // off the bound itself
    assert_eq!(broken(&for_long), Some("the motor stands when nothing commands it"));
    let elsewhere = Truth { phase: 0.3, ..REST };
    let mut ticks: Vec<_> = (1..=4).map(rest).collect();
    ticks.push((state(5, |_| {}), 0, elsewhere));
    assert_eq!(broken(&ticks), Some("the phase is continuous"));
}
