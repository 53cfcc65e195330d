//! The tick's exchange.

use std::time::{Duration, Instant};

use dynamixel_bus::packet::{ReadSpan, StatusError};
use wormd::link::servo::{self, register, scale};
use wormd::link::{ExchangePlan, PortError, ReadFailure, ReadPlan, TrackerQuery, TransactionError, WormBus, tracker};

use super::worm::{SERVO, TRACKER, Worm, id};

const CELLS: usize = 5;
const GOAL_RAD_S: f64 = 2.518;

fn plan(read: ReadPlan) -> ExchangePlan {
    ExchangePlan {
        servo: id(SERVO),
        tracker: Some(TrackerQuery {
            id: id(TRACKER),
            cells: CELLS,
            emergency_stop_mask: None,
            pitch: false,
        }),
        read,
    }
}

/// A worm as start-up leaves it.
fn bus() -> WormBus<Worm> {
    let mut worm = Worm::new(CELLS);
    worm.set_servo(register::STATUS_RETURN_LEVEL, 1);
    let mut bus = WormBus::new(worm);
    bus.set_writes_are_answered(false);
    bus
}

fn soon() -> Instant {
    Instant::now() + Duration::from_millis(50)
}

/// With switches and without, of a tracker and of a device that tracks no cells.
#[test]
fn an_inertial_sensor_is_read_with_the_rest() {
    let pitches = [(0x04d2, Some(12.34)), (0xfb2e, Some(-12.34)), (0x8000, None)];
    let reads = [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate];
    for (counts, pitch_deg) in pitches {
        for (read, cells, mask) in [(0, CELLS, None), (1, CELLS, Some(2)), (2, 0, None), (0, 0, Some(2))] {
            let mut bus = bus();
            bus.port_mut().put_tracker(tracker::register::PITCH, counts);
            bus.port_mut().put_tracker(tracker::register::SWITCHES, 2);
            let plan = plan(reads[read]);
            let query = plan.tracker.map(|query| TrackerQuery {
                cells,
                emergency_stop_mask: mask,
                pitch: true,
                ..query
            });
            let outcome = bus.exchange(&ExchangePlan { tracker: query, ..plan }, GOAL_RAD_S, soon());
            let reading = outcome.tracker.expect("the tracker's block");
            let found_deg = reading.pitch_rad.map(f64::to_degrees);
            let is_right = match (found_deg, pitch_deg) {
                (Some(found), Some(expected)) => f64::abs(found - expected) < 1e-9,
                (found, expected) => found == expected,
            };
            assert!(is_right, "{counts:#x}, {read}: {found_deg:?}");
            assert_eq!(reading.valid.count_ones() as usize, cells);
            assert_eq!(outcome.emergency_stop, mask.map(|_| true));
            assert!(outcome.is_complete());
        }
    }
}

/// Whatever the tracker would say: it is not asked, and nothing waits for it.
#[test]
fn a_worm_without_a_tracker_asks_the_servo_alone() {
    for read in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
        let mut bus = bus();
        let plan = ExchangePlan {
            tracker: None,
            ..plan(read)
        };
        let outcome = bus.exchange(&plan, GOAL_RAD_S, soon());
        let servo = outcome.servo.expect("the servo's block");
        assert!((servo.goal_velocity_rad_s - GOAL_RAD_S).abs() < scale::VELOCITY_RAD_S / 2.0);
        assert_eq!(outcome.tracker, Err(ReadFailure::NotAsked));
        assert!(outcome.is_complete() && outcome.emergency_stop.is_none());
        assert_eq!((outcome.sent_bytes, outcome.received_bytes), (30, 60), "{read:?}");
        assert_eq!(bus.counters().timeouts + bus.exchange_counters().partial_answers, 0);
    }
}

#[test]
fn both_devices_are_read_whatever_the_plan() {
    for (read, sent, received) in [
        (ReadPlan::FastBulk, 36, 96),
        (ReadPlan::Bulk, 36, 102),
        (ReadPlan::Separate, 44, 102),
    ] {
        let mut bus = bus();
        let outcome = bus.exchange(&plan(read), GOAL_RAD_S, soon());
        let servo = outcome.servo.expect("the servo's block");
        let tracker = outcome.tracker.expect("the tracker's block");
        assert!((servo.goal_velocity_rad_s - GOAL_RAD_S).abs() < scale::VELOCITY_RAD_S / 2.0);
        assert!((servo.position_rad - std::f64::consts::TAU).abs() < 1e-9);
        assert_eq!((tracker.cell_count, tracker.valid), (5, 0b1_1111));
        assert!((tracker.positions_m[4] - 0.4).abs() < 1e-9);
        assert_eq!(
            (outcome.sent_bytes, outcome.received_bytes),
            (sent, received),
            "{read:?}"
        );
        assert_eq!(
            bus.counters().timeouts + bus.exchange_counters().partial_answers + bus.counters().garbage_bytes,
            0
        );
    }
}

#[test]
fn what_the_servo_says_is_used_though_the_tracker_is_silent() {
    for read in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
        let mut bus = bus();
        bus.port_mut().quirks.tracker_silent = true;
        let outcome = bus.exchange(&plan(read), GOAL_RAD_S, soon());
        assert!(outcome.servo.is_ok(), "{read:?}");
        assert_eq!(outcome.tracker, Err(ReadFailure::Silent));
        assert_eq!(
            (bus.exchange_counters().partial_answers, bus.counters().timeouts),
            (1, 1)
        );
    }
}

#[test]
fn tracker_is_read_though_the_servo_is_silent() {
    for (read, tracker_is_read) in [
        (ReadPlan::FastBulk, false),
        (ReadPlan::Bulk, true),
        (ReadPlan::Separate, true),
    ] {
        let mut bus = bus();
        bus.port_mut().quirks.servo_silent = true;
        let outcome = bus.exchange(&plan(read), GOAL_RAD_S, soon());
        assert_eq!(
            (outcome.servo.is_ok(), outcome.tracker.is_ok()),
            (false, tracker_is_read),
            "{read:?}"
        );
    }
}

#[test]
fn answer_to_the_last_question_is_not_taken_for_this_one() {
    let mut bus = bus();
    let plan = plan(ReadPlan::FastBulk);
    bus.port_mut().quirks.one_late = true;
    assert_eq!(bus.exchange(&plan, 1.0, soon()).servo, Err(ReadFailure::Silent));
    // It comes between the ticks: thrown away.
    bus.port_mut().quirks.one_late = false;
    bus.port_mut().say_now(&[0; 96]);
    // It comes behind the next question, together with the answer to it: the newer one has the last word.
    let outcome = bus.exchange(&plan, 2.0, soon());
    let goal_rad_s = outcome.servo.expect("the servo's block").goal_velocity_rad_s;
    assert!(
        (goal_rad_s - 2.0).abs() < scale::VELOCITY_RAD_S,
        "the goal of this exchange, not {goal_rad_s}"
    );
    assert_eq!(bus.counters().stale_bytes, 96);
    assert_eq!(outcome.received_bytes, 2 * 96);
}

#[test]
fn noise_before_the_answer_is_passed_over() {
    for read in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
        let mut bus = bus();
        // The middle one is a header whose length reaches into the answer.
        bus.port_mut()
            .say_with_next_answer(&[0x55, 0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x20, 0x00, 0x55, 0x00, 0xFF, 0xFF]);
        assert!(bus.exchange(&plan(read), 0.0, soon()).is_complete(), "{read:?}");
        assert_eq!((bus.counters().crc_errors, bus.counters().garbage_bytes), (1, 12));
    }
}

#[test]
fn unplugged_port_is_an_error_of_its_own() {
    let mut bus = bus();
    bus.port_mut().quirks.unplugged = true;
    let outcome = bus.exchange(&plan(ReadPlan::FastBulk), 0.0, soon());
    assert!(outcome.is_disconnected());
    assert_eq!(outcome.tracker, Err(ReadFailure::Port(PortError::Disconnected)));
    assert_eq!((bus.counters().disconnections, bus.counters().timeouts), (1, 0));
}

#[test]
fn exchanges_without_any_answer_are_counted_until_one_comes() {
    let mut bus = bus();
    let mut silent_in_a_row = Vec::new();
    for silent in [false, true, true, true, false, true] {
        bus.port_mut().quirks.servo_silent = silent;
        let outcome = bus.exchange(&plan(ReadPlan::FastBulk), 0.0, soon());
        silent_in_a_row.push(outcome.silent_in_a_row);
    }
    assert_eq!(silent_in_a_row, [0, 1, 2, 3, 0, 1]);
}

#[test]
fn alert_and_refusals_are_counted() {
    let mut bus = bus();
    bus.port_mut().alert = true;
    assert!(
        bus.exchange(&plan(ReadPlan::FastBulk), 0.0, soon())
            .servo
            .is_ok_and(|servo| servo.alert)
    );
    let refused = bus.read(id(SERVO), 250, &mut [0; 20], soon());
    assert_eq!(
        refused,
        Err(TransactionError::Refused {
            id: id(SERVO),
            error: StatusError::Access
        })
    );
    assert_eq!(
        (
            bus.counters().alerts,
            bus.counters().refusals.access,
            bus.counters().refusals.total()
        ),
        (2, 1, 1)
    );
}

#[test]
fn transactions() {
    let mut bus = bus();
    assert_eq!(
        bus.ping(id(SERVO), soon()).map(|who| (who.model, who.firmware)),
        Ok((1200, 52))
    );
    assert_eq!(bus.ping(id(7), soon()), Err(TransactionError::Silent(id(7))));
    let mut present = Vec::new();
    assert_eq!(
        bus.broadcast_ping(soon(), |id, who| present.push((id.get(), who.model))),
        Ok(2)
    );
    assert_eq!(present, [(SERVO, 1200), (TRACKER, tracker::MODEL)]);

    let mut lengths = Vec::new();
    let ids = [id(SERVO), id(TRACKER)];
    assert_eq!(
        bus.sync_read(0, 2, &ids, soon(), |status| lengths.push(status.data.len())),
        Ok(2)
    );
    let spans = [
        ReadSpan {
            id: id(SERVO),
            address: servo::BLOCK_ADDRESS,
            length: 49,
        },
        ReadSpan {
            id: id(TRACKER),
            address: 128,
            length: 11,
        },
    ];
    assert_eq!(
        bus.bulk_read(spans, soon(), |status| lengths.push(status.data.len())),
        Ok(2)
    );
    assert_eq!(lengths, [2, 2, 49, 11]);
}

#[test]
fn goal_that_does_not_arrive_is_noticed() {
    let mut bus = bus();
    let plan = plan(ReadPlan::FastBulk);
    assert!(bus.exchange(&plan, GOAL_RAD_S, soon()).goal_taken);
    bus.port_mut().set_servo(register::BUS_WATCHDOG, 0xFF);
    let locked = bus.exchange(&plan, 0.5 * GOAL_RAD_S, soon());
    assert!(locked.servo.is_ok() && !locked.goal_taken);
    // Two answers are on their way, and the older one is alone when the time is up.
    bus.port_mut().set_servo(register::BUS_WATCHDOG, 0);
    bus.port_mut().quirks.one_late = true;
    bus.exchange(&plan, 1.0, soon());
    let late = bus.exchange(&plan, 2.0, soon());
    assert!(late.servo.is_ok() && !late.goal_taken);
    assert_eq!(bus.exchange_counters().goals_not_taken, 2);
}

#[test]
fn watchdog_is_rearmed_with_the_goal_at_zero() {
    let mut bus = bus();
    bus.port_mut().set_servo(register::BUS_WATCHDOG, 0xFF);
    bus.port_mut().set_servo(register::GOAL_VELOCITY, 105);
    assert!(
        bus.exchange(&plan(ReadPlan::FastBulk), 0.0, soon())
            .servo
            .is_ok_and(|servo| servo.watchdog_latched())
    );
    assert_eq!(bus.rearm_watchdog(id(SERVO), 100), Ok(true));
    assert_eq!(bus.port_mut().servo(register::BUS_WATCHDOG), 5);
    assert_eq!(bus.port_mut().servo(register::GOAL_VELOCITY), 0);
    assert_eq!(bus.rearm_watchdog(id(SERVO), 100), Ok(false));
}

#[test]
fn servo_comes_back_from_a_reboot() {
    let mut bus = bus();
    bus.port_mut().set_servo(register::HARDWARE_ERROR_STATUS, 4);
    bus.reboot_servo(id(SERVO)).expect("back");
    assert_eq!(bus.port_mut().servo(register::HARDWARE_ERROR_STATUS), 0);
}

#[test]
fn exchange_allocates_nothing() {
    for read in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
        let mut bus = bus();
        let allocations = allocation_counter::measure(|| {
            for tick in 0..1000 {
                assert!(bus.exchange(&plan(read), f64::from(tick) * 1e-3, soon()).is_complete());
            }
        });
        assert_eq!(allocations.count_total, 0, "{read:?}");
    }
}

proptest::proptest! {
    /// Whatever is on the line in front of the answer: no panic, and no reading that the worm did not give.
    #[test]
    fn noise_makes_no_readings(noise in proptest::collection::vec(proptest::sample::select(vec![0xFF, 0xFD, 0, 1, 0x55, 100, 0xFE, 20]), 0..400)) {
        for read in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
            let mut bus = bus();
            bus.port_mut().say_with_next_answer(&noise);
            let outcome = bus.exchange(&plan(read), GOAL_RAD_S, soon());
            if let Ok(servo) = outcome.servo {
                proptest::prop_assert!((servo.goal_velocity_rad_s - GOAL_RAD_S).abs() < scale::VELOCITY_RAD_S);
            }
            if let Ok(tracker) = outcome.tracker {
                proptest::prop_assert_eq!(tracker.valid, 0b1_1111);
            }
        }
    }
}
