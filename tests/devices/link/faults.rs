//! How much of what a tick wants comes through a bad line.

use std::fmt::Write;
use std::time::{Duration, Instant};

use wormd::link::servo::{register, scale};
use wormd::link::{ExchangePlan, FaultInjector, Faults, Port, PortError, ReadPlan, TrackerQuery, WormBus};

use super::worm::{SERVO, TRACKER, Worm, id};

const TICKS: u32 = 2000;

fn bus(faults: Faults, seed: u64) -> WormBus<FaultInjector<Worm>> {
    let mut worm = Worm::new(5);
    worm.set_servo(register::STATUS_RETURN_LEVEL, 1);
    let mut bus = WormBus::new(FaultInjector::new(worm, faults, seed));
    bus.set_writes_are_answered(false);
    bus
}

fn plan(read: ReadPlan) -> ExchangePlan {
    ExchangePlan {
        servo: id(SERVO),
        tracker: Some(TrackerQuery {
            id: id(TRACKER),
            cells: 5,
            emergency_stop_mask: None,
            pitch: false,
        }),
        read,
    }
}

/// Percent of ticks with a servo reading, with a tracker reading, and with a wrong one.
fn usable(faults: Faults, read: ReadPlan) -> (f64, f64, u32) {
    let mut bus = bus(faults, 1);
    let (mut servo, mut tracker, mut wrong) = (0, 0, 0);
    for tick in 0..TICKS {
        let goal_rad_s = f64::from(tick % 40) * 0.1;
        let outcome = bus.exchange(&plan(read), goal_rad_s, Instant::now() + Duration::from_millis(2));
        servo += u32::from(outcome.servo.is_ok());
        tracker += u32::from(outcome.tracker.is_ok());
        let other_goal = |found: f64| (found - goal_rad_s).abs() > scale::VELOCITY_RAD_S;
        wrong += u32::from(outcome.servo.is_ok_and(|servo| other_goal(servo.goal_velocity_rad_s)));
        wrong += u32::from(
            outcome
                .tracker
                .is_ok_and(|tracker| (tracker.positions_m[4] - 0.4).abs() > 1e-9),
        );
    }
    let percent = |count: u32| 100.0 * f64::from(count) / f64::from(TICKS);
    (percent(servo), percent(tracker), wrong)
}

#[test]
fn usable_answers_over_loss() {
    let mut table = String::from("fault        rate   fast: servo tracker   bulk: servo tracker   wrong\n");
    type OfRate = fn(f64) -> Faults;
    let kinds: [(&str, OfRate); 4] = [
        ("drop a byte", |rate| Faults {
            drop: rate,
            ..Faults::NONE
        }),
        ("flip a bit", |rate| Faults {
            flip: rate,
            ..Faults::NONE
        }),
        ("double", |rate| Faults {
            duplicate: rate,
            ..Faults::NONE
        }),
        ("truncate", |rate| Faults {
            truncate: rate,
            ..Faults::NONE
        }),
    ];
    for (name, faults) in kinds {
        for rate in [0.0, 0.0001, 0.001, 0.01] {
            let (fast_servo, fast_tracker, fast_wrong) = usable(faults(rate), ReadPlan::FastBulk);
            let (bulk_servo, bulk_tracker, bulk_wrong) = usable(faults(rate), ReadPlan::Bulk);
            let wrong = fast_wrong + bulk_wrong;
            writeln!(
                table,
                "{name:12} {rate:<6} {fast_servo:11.1} {fast_tracker:7.1} {bulk_servo:13.1} {bulk_tracker:7.1} {wrong:7}",
            )
            .expect("a string takes anything");
        }
    }
    assert_eq!(table, EXPECTED, "\n{table}");
}

const EXPECTED: &str = "\
fault        rate   fast: servo tracker   bulk: servo tracker   wrong
drop a byte  0            100.0   100.0         100.0   100.0       0
drop a byte  0.0001        99.0    98.8          99.3    99.5       0
drop a byte  0.001         93.4    90.5          94.2    95.6       0
drop a byte  0.01          55.5    39.2          56.0    65.5       0
flip a bit   0            100.0   100.0         100.0   100.0       0
flip a bit   0.0001        99.2    98.8          99.2    99.7       0
flip a bit   0.001         94.1    90.7          93.6    96.0       0
flip a bit   0.01          55.8    39.4          56.1    65.2       0
double       0            100.0   100.0         100.0   100.0       0
double       0.0001        99.1    98.9          99.3    99.5       0
double       0.001         93.7    90.9          94.3    95.9       0
double       0.01          57.5    40.4          57.5    67.7       0
truncate     0            100.0   100.0         100.0   100.0       0
truncate     0.0001       100.0   100.0         100.0   100.0       0
truncate     0.001        100.0   100.0         100.0   100.0       0
truncate     0.01          99.3    99.2          99.3    99.2       0
";

#[test]
fn same_seed_same_faults() {
    let faults = Faults {
        drop: 0.01,
        flip: 0.01,
        duplicate: 0.01,
        truncate: 0.1,
        ..Faults::NONE
    };
    let run = |seed| {
        let mut bus = bus(faults.clone(), seed);
        for _ in 0..200 {
            bus.exchange(
                &plan(ReadPlan::FastBulk),
                1.0,
                Instant::now() + Duration::from_millis(2),
            );
        }
        bus.link_counters()
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
}

#[test]
fn silence_is_an_interval_of_requests() {
    let mut bus = bus(
        Faults {
            silence: 10..15,
            ..Faults::NONE
        },
        1,
    );
    let answered: Vec<bool> = (0..20)
        .map(|_| {
            bus.exchange(
                &plan(ReadPlan::FastBulk),
                1.0,
                Instant::now() + Duration::from_millis(2),
            )
            .is_complete()
        })
        .collect();
    let expected: Vec<bool> = (0..20).map(|tick| !(10..15).contains(&tick)).collect();
    assert_eq!(answered, expected);
}

#[test]
fn a_late_answer_stands_in_for_the_next_one_and_is_none_that_was_lost() {
    let late = Faults {
        delay: 1.0,
        delay_by: Duration::from_millis(4),
        ..Faults::NONE
    };
    let mut bus = bus(late, 1);
    let mut exchange = |goal_rad_s, wait_ms| {
        let wait = Duration::from_millis(wait_ms);
        bus.exchange(&plan(ReadPlan::FastBulk), goal_rad_s, Instant::now() + wait)
    };
    for number in 0..5 {
        let outcome = exchange(f64::from(number), 1);
        assert_eq!(
            (outcome.late, outcome.servo.is_ok()),
            (number > 0, number > 0),
            "{number}"
        );
        assert_eq!((outcome.goal_taken, outcome.lost), (false, 0), "{number}");
        if let Ok(servo) = outcome.servo {
            let earlier_rad_s = f64::from(number - 1);
            assert!((servo.goal_velocity_rad_s - earlier_rad_s).abs() < scale::VELOCITY_RAD_S);
        }
        std::thread::sleep(Duration::from_millis(45));
    }
    bus.port_mut().set_faults(Faults::NONE);
    let wait = Instant::now() + Duration::from_millis(50);
    let outcome = bus.exchange(&plan(ReadPlan::FastBulk), 5.0, wait);
    assert!(outcome.is_complete() && outcome.goal_taken && !outcome.late && outcome.lost == 0);
    let counters = bus.counters();
    assert_eq!(
        (counters.stale_bytes, bus.exchange_counters().late_answers),
        (5 * 96, 4)
    );
}

/// A port on which the answer to the first exchange arrives just before the second request, which discards it.
struct JustTooLate {
    worm: Worm,
    is_late: bool,
}

impl Port for JustTooLate {
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), PortError> {
        self.worm.send(bytes, deadline)
    }

    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError> {
        if self.is_late {
            Ok(0)
        } else {
            self.worm.receive(into, deadline)
        }
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        let discarded = self.worm.discard_input()?;
        self.is_late &= discarded == 0;
        Ok(discarded)
    }

    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError> {
        self.worm.set_baud_rate(baud)
    }
}

#[test]
fn an_answer_that_the_next_request_discards_is_not_lost() {
    for read in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
        let mut worm = Worm::new(5);
        worm.set_servo(register::STATUS_RETURN_LEVEL, 1);
        let mut bus = WormBus::new(JustTooLate { worm, is_late: true });
        bus.set_writes_are_answered(false);
        let outcomes: Vec<(bool, u32)> = (0..4)
            .map(|_| {
                let wait = Instant::now() + Duration::from_millis(2);
                let outcome = bus.exchange(&plan(read), 1.0, wait);
                (outcome.is_complete(), outcome.lost)
            })
            .collect();
        assert_eq!(outcomes, [(false, 0), (true, 0), (true, 0), (true, 0)], "{read:?}");
    }
}

#[test]
fn answers_that_never_come_are_lost_when_many_later_ones_have_come() {
    let silent = Faults {
        silence: 2..5,
        ..Faults::NONE
    };
    let mut bus = bus(silent, 1);
    let mut lost_of = |exchanges: u32| -> u32 {
        let exchange = |_| {
            let wait = Instant::now() + Duration::from_millis(2);
            bus.exchange(&plan(ReadPlan::FastBulk), 1.0, wait).lost
        };
        (0..exchanges).map(exchange).sum()
    };
    assert_eq!(lost_of(5 + 31), 0, "they might still be on their way");
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!((lost_of(1), lost_of(100)), (3, 0));
}

#[test]
fn answers_that_never_come_are_lost_at_once_when_the_next_one_repeats_a_new_goal() {
    let silent = Faults {
        silence: 2..5,
        ..Faults::NONE
    };
    let mut bus = bus(silent, 1);
    let lost: Vec<u32> = (0..8)
        .map(|exchange| {
            let wait = Instant::now() + Duration::from_millis(2);
            let goal_rad_s = if exchange == 5 { 1.1 } else { 1.0 };
            bus.exchange(&plan(ReadPlan::FastBulk), goal_rad_s, wait).lost
        })
        .collect();
    assert_eq!(lost, [0, 0, 0, 0, 0, 3, 0, 0]);
}

/// Each answer comes just after the next request, for some exchanges in a row; then the line catches up.
fn assert_catches_up(read: ReadPlan, behind_for: u32, change_rad_s: f64) {
    let mut worm = Worm::new(5);
    worm.set_servo(register::STATUS_RETURN_LEVEL, 1);
    let mut bus = WormBus::new(worm);
    bus.set_writes_are_answered(false);
    let mut goal_rad_s = 1.0;
    let mut exchange = |bus: &mut WormBus<Worm>| {
        let wait = Instant::now() + Duration::from_millis(2);
        goal_rad_s += change_rad_s;
        bus.exchange(&plan(read), goal_rad_s, wait)
    };
    bus.port_mut().quirks.one_late = true;
    let mut lost = exchange(&mut bus).lost;
    for _ in 0..behind_for {
        let outcome = exchange(&mut bus);
        assert!(outcome.is_complete() && !outcome.late, "{read:?}");
        lost += outcome.lost;
    }
    // Two come at once, and then each in its time.
    bus.port_mut().quirks.one_late = false;
    lost += (0..50).map(|_| exchange(&mut bus).lost).sum::<u32>();
    assert_eq!(lost, 0, "{read:?}, behind for {behind_for} exchanges");
}

#[test]
fn a_line_one_answer_behind_that_catches_up_has_lost_nothing() {
    for read in [ReadPlan::FastBulk, ReadPlan::Bulk] {
        for behind_for in [1, 2, 3, 10, 31, 90] {
            // Goals that differ show which question an answer belongs to; equal ones do not.
            for change_rad_s in [0.0, 0.05] {
                assert_catches_up(read, behind_for, change_rad_s);
            }
        }
    }
}

#[test]
fn lost_bytes_of_the_request_leave_devices_silent() {
    let mut bus = bus(
        Faults {
            drop_sent: 1.0,
            ..Faults::NONE
        },
        1,
    );
    assert!(
        bus.exchange(
            &plan(ReadPlan::FastBulk),
            1.0,
            Instant::now() + Duration::from_millis(1)
        )
        .servo
        .is_err()
    );
    assert_eq!(bus.counters().timeouts, 2);
}
