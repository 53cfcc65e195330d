use super::*;

const REST: Truth = Truth {
    velocity_rad_s: 0.0,
    phase: 0.0,
    stood_ns: 0,
    torque_is_on: false,
};
const POWERED: Truth = Truth {
    torque_is_on: true,
    ..REST
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

fn tick(state: State, goal_counts: i32, service: Option<ServiceOutcome>) -> Tick {
    Tick {
        state,
        goal_counts,
        verdict: None,
        service,
    }
}

/// The rule that the last of these ticks breaks; the ones before it break none.
fn broken(ticks: &[(State, i32, Truth)]) -> Option<&'static str> {
    let ticks: Vec<_> = ticks
        .iter()
        .map(|(state, goal_counts, truth)| (tick(*state, *goal_counts, None), *truth))
        .collect();
    broken_by(&ticks)
}

fn broken_by(ticks: &[(Tick, Truth)]) -> Option<&'static str> {
    let mut invariants = invariants();
    let (last, before) = ticks.split_last()?;
    for (tick, truth) in before {
        assert_eq!(invariants.look(tick, truth), None);
    }
    invariants.look(&last.0, &last.1).map(|broken| broken.rule)
}

fn in_mode(tick: u64, mode: Mode, change: impl FnOnce(&mut State)) -> State {
    state(tick, |state| {
        state.mode = mode.code();
        change(state);
    })
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
        ..POWERED
    };
    let turns = |tick| (state(tick, |_| {}), 0, turning);
    let while_allowed: Vec<_> = (1..=77).map(turns).collect();
    assert_eq!(broken(&while_allowed), None, "while the servo decelerates");
    let mut for_long: Vec<_> = (1..=78).map(turns).collect();
    for_long[77].0.time_ns += 1_000_000; // off the bound itself
    assert_eq!(broken(&for_long), Some("the motor stands when nothing commands it"));
    let runs_out = |tick| {
        let truth = Truth {
            torque_is_on: false,
            ..turning
        };
        (fault(tick, Fault::Alarm).0, 0, truth)
    };
    assert_eq!(
        broken(&(1..=100).map(runs_out).collect::<Vec<_>>()),
        None,
        "nothing brakes a motor without torque"
    );
    let elsewhere = Truth { phase: 0.3, ..REST };
    let mut ticks: Vec<_> = (1..=4).map(rest).collect();
    ticks.push((state(5, |_| {}), 0, elsewhere));
    assert_eq!(broken(&ticks), Some("the phase is continuous"));
}

const TORQUE: &str = "torque is off in a fault and while disarmed";
const FAILED: Option<ServiceOutcome> = Some(ServiceOutcome::Failed(Service::Disarm));

/// A fault that is seen in tick 1, with torque on for so many ticks; what became of the service in each.
fn fault_with_torque(ticks: u64, service: impl Fn(u64) -> Option<ServiceOutcome>, answers: bool) -> Vec<(Tick, Truth)> {
    let state = |number| {
        in_mode(number, Mode::Fault, |state| {
            state.fault = Fault::LinkLost.code();
            state.motor_is_new = u32::from(answers);
        })
    };
    (1..=ticks)
        .map(|number| (tick(state(number), 0, service(number)), POWERED))
        .collect()
}

#[test]
fn torque_goes_off_in_a_fault() {
    let never = |_| None;
    assert_eq!(broken_by(&fault_with_torque(2, never, true)), None);
    assert_eq!(broken_by(&fault_with_torque(3, never, true)), Some(TORQUE));
    // A failed attempt is made again after half a second: 125 ticks.
    let once = |number| FAILED.filter(|_| number == 1);
    assert_eq!(broken_by(&fault_with_torque(128, once, false)), None);
    assert_eq!(broken_by(&fault_with_torque(129, once, false)), Some(TORQUE));
    // Only a servo that cannot be reached excuses failure after failure.
    let again = |number| FAILED.filter(|_| number % 126 == 1);
    assert_eq!(broken_by(&fault_with_torque(1000, again, false)), None);
    assert_eq!(broken_by(&fault_with_torque(128, again, true)), Some(TORQUE));
}

#[test]
fn torque_is_off_while_disarmed() {
    let disarmed = |number, service| {
        let state = in_mode(number, Mode::Disarmed, |_| {});
        (tick(state, 0, service), POWERED)
    };
    assert_eq!(broken_by(&[disarmed(1, None)]), Some(TORQUE));
    let done = Some(ServiceOutcome::Done(Service::Arm));
    assert_eq!(broken_by(&[disarmed(1, done)]), None, "on its way to armed");
    assert_eq!(broken_by(&[disarmed(1, done), disarmed(2, None)]), Some(TORQUE));
}

#[test]
fn a_hold_stays_where_it_rests() {
    // The ramp, a quarter more for the fastest crawl, and half a second: 204 ticks.
    let hold = |ticks: u64, moves_at: u64| -> Vec<_> {
        (1..=ticks)
            .map(|number| {
                let phase = if number < moves_at { 0.0 } else { 0.021 };
                let state = in_mode(number, Mode::Holding, |state| state.phase = phase);
                (state, 0, Truth { phase, ..POWERED })
            })
            .collect()
    };
    assert_eq!(broken(&hold(400, 190)), None, "before it has come to rest");
    assert_eq!(broken(&hold(400, 400)), Some("a hold keeps the cam where it rests"));
}

#[test]
fn a_stop_ends() {
    let stop = |number, goal_velocity_rad_s| {
        let state = in_mode(number, Mode::Stopping, |state| {
            state.goal_velocity_rad_s = goal_velocity_rad_s;
        });
        (state, 0, POWERED)
    };
    const FALLS: &str = "the goal falls while the worm stops";
    assert_eq!(broken(&[stop(1, 1.0), stop(2, 0.97)]), None);
    assert_eq!(broken(&[stop(1, 1.0), stop(2, 1.01)]), Some(FALLS));
    // 79 ticks for the ramp, and two.
    let constant: Vec<_> = (1..=83).map(|number| stop(number, 1.0)).collect();
    assert_eq!(broken(&constant[..82]), None);
    assert_eq!(broken(&constant), Some(FALLS));
    let at_rest: Vec<_> = (1..=208).map(|number| stop(number, 0.0)).collect();
    assert_eq!(broken(&at_rest[..207]), None);
    assert_eq!(broken(&at_rest), Some("a stop ends with torque off"));
}
