//! What the screen says where a worm is stopped, or where little is known of it.

use super::super::app::Seat;
use super::fixture::{NOW_NS, alarm, drawn, received, screen};
use worm_estimator::message::{AlarmKind, Fault, Mode, State};

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
