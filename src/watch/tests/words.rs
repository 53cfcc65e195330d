//! What the screen says where a worm is stopped, or where little is known of it.

use super::super::app::Seat;
use super::super::*;
use super::fixture::{NOW_NS, alarm, drawn, inferred, painted, received, screen};
use worm_estimator::message::{AlarmKind, Fault, Inferred, Mode, Range, State};

/// Pages of a worm with this fault.
fn pages_of(fault: Fault, width: u16) -> [String; 2] {
    let mut telemetry = received(3.4);
    // The alarm has cleared since: the worm rests.
    telemetry.take_alarm(&alarm(3, 6_000_000_000, 0));
    telemetry.take_state(&State {
        mode: Mode::Fault.code(),
        fault: fault.code(),
        fault_alarm: match fault {
            Fault::Alarm => AlarmKind::JammedCell.code(),
            _ => u32::MAX,
        },
        ..telemetry.state.expect("a state")
    });
    let mut app = screen(Seat::Watch, &telemetry, None);
    let overview = drawn(width, 24, &app, NOW_NS).backend().to_string();
    app.key('a', NOW_NS);
    [overview, drawn(width, 24, &app, NOW_NS).backend().to_string()]
}

#[test]
fn a_latched_fault_says_why_and_what_to_do_when_its_alarm_has_cleared() {
    for (fault, status, parts) in [
        (
            Fault::Alarm,
            "fault jammed-cell cell 2; a: what to do, r twice: reset. nobody drives",
            [
                "off: jammed-cell cell 2: 0.6200 against 0.4000",
                "Do: free the cell, then reset",
            ],
        ),
        (
            Fault::LinkLost,
            "fault link-lost; a: what to do",
            ["off: link-lost: the servo did not answer", "Do: check cable and supply"],
        ),
    ] {
        let [overview, alarms] = pages_of(fault, 120);
        assert!(overview.contains(status), "{overview}");
        for part in parts.into_iter().chain(["r twice resets"]) {
            assert!(alarms.contains(part), "{part:?} is missing in\n{alarms}");
        }
        assert!(
            alarms.contains("no alarm is raised now"),
            "it is no good news:\n{alarms}"
        );
        let fault = alarms.find("fault, and the motor is off").expect("is there");
        assert!(
            fault < alarms.find("s ago  jammed-cell").expect("is there"),
            "it comes first:\n{alarms}"
        );
    }
    let [overview, _] = pages_of(Fault::Alarm, 80);
    assert!(overview.contains("r twice: reset. nobody drives"), "{overview}");
}

#[test]
fn distance_time_and_one_charge_are_in_the_edge_of_the_canal() {
    let mut telemetry = received(3.4);
    let estimate = telemetry.estimate.as_mut().expect("an estimate");
    estimate.battery_fraction = 1.0;
    telemetry.ranges.push(Range {
        index: 1,
        end_ns: 5_000_000_000,
        charge_share: 0.99,
        charge_sigma_share: 0.01,
        energy_left_j: 2800.0,
        energy_left_low_j: 2700.0,
        energy_left_high_j: 2900.0,
        energy_per_cycle_j: 0.7,
        energy_per_cycle_sigma_j: 0.01,
        advance_per_cycle_m: 0.0067,
        advance_per_cycle_sigma_m: 1e-4,
        cycles: 4000.0,
        cycles_low: 3900.0,
        cycles_high: 4100.0,
        range_m: 26.0,
        range_low_m: 24.1,
        range_high_m: 27.3,
        time_s: 3540.0,
        time_low_s: 3300.0,
        time_high_s: 3780.0,
        gauge_share: f64::NAN,
        cycles_used: 4,
        direction: 1,
    });
    for (width, edge) in [
        (120, "range 24.1 to 27.3 m, 55 to 63 min, battery 99 % "),
        (80, " goes on  range 24.1 to 27.3 m, 55 to 63 min, battery 99 % ┘"),
        (70, "─ 24.1 to 27.3 m, 55 to 63 min ┘"),
        (80, "? shows the keys ┐"),
    ] {
        let picture = painted_by_watcher(width, &telemetry);
        assert!(picture.contains(edge), "{edge:?} is missing in\n{picture}");
        assert!(!picture.contains("battery 100 %"), "one charge:\n{picture}");
    }
}

fn painted_by_watcher(width: u16, telemetry: &Telemetry) -> String {
    let app = screen(Seat::Watch, telemetry, None);
    drawn(width, 34, &app, NOW_NS).backend().to_string()
}

#[test]
fn what_the_current_does_not_tell_yet_is_no_number() {
    let mut telemetry = received(1.4);
    telemetry.take_inferred(&Inferred {
        position_m: f64::NAN,
        position_sigma_m: 0.0,
        pull_n: f64::NAN,
        ..inferred()
    });
    let picture = painted(110, 34, &telemetry);
    assert!(!picture.contains("NaN"), "{picture}");
    let words = "position not yet known, ~6.7±0.2 mm and ~47±2 mJ a cycle";
    assert!(picture.contains(words), "{picture}");
}

/// Without colours the parts of a bar are still told apart; on a low screen no key is lost.
#[test]
fn neither_colour_nor_height_is_needed() {
    let telemetry = received(3.4);
    let page = |key: char, height: u16| {
        let mut app = screen(Seat::Watch, &telemetry, None);
        app.key(key, NOW_NS);
        drawn(80, height, &app, NOW_NS).backend().to_string()
    };
    let energy = page('e', 24);
    assert!(energy.contains("█▓") && energy.contains("░ weight"), "{energy}");
    let help = page('?', 20);
    for part in ["a          alarms", "?          these", "q, Ctrl-C"] {
        assert!(help.contains(part), "{part:?} is missing in\n{help}");
    }
}
