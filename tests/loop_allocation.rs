//! Memory. A tick allocates nothing of its own: two messages a tick, one allocation of iceoryx2's for each loan, and no more. Who watches
//! a worm for a year needs no more memory than after two days.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use worm_estimator::config::Config;
use worm_estimator::message::{Alarm, Cycle, Timing};
use wormd::control::{self, Drive, Ending, link_settings};
use wormd::link::virtual_worm::{Options, VirtualWorm};
use wormd::topics::{Controller, Hub, Instance, RoleLock};
use wormd::watch::Telemetry;

/// A tick publishes its state and its timing.
const LOANS_PER_TICK: u64 = 2;

/// Runs the real loop on a virtual worm for a while; gives its ticks and the allocations of the loop's thread.
fn run_for(time: Duration) -> (Ending, u64) {
    let mut config = Config::default();
    config.worm.name = format!("alloc-{}", std::process::id() % 100_000);
    // The test's own process must not lock its memory, nor starve the other tests.
    config.realtime.lock_memory = false;
    config.realtime.priority = 0;
    let worm = VirtualWorm::spawn(&config, &Options::default()).expect("a virtual worm");
    let settings = link_settings(&config, 1_000_000).expect("valid IDs");
    let (mut drive, _, _) = Drive::open(Path::new(worm.path()), settings).expect("the devices are ready");
    let instance = Instance::of(&config).expect("the topics' root can be used");
    let role = RoleLock::<Controller>::take(&instance).expect("no other controller");
    let hub = Hub::open(&instance).expect("the topics open");
    let end = Arc::new(AtomicBool::new(false));
    let mut ending = None;
    let allocations = allocation_counter::measure(|| {
        let timer = Arc::clone(&end);
        let outcome = control::run(&config, &mut drive, &hub, &role, &end, |_| {
            std::thread::spawn(move || {
                std::thread::sleep(time);
                timer.store(true, Ordering::Relaxed);
            });
        });
        ending = Some(outcome.expect("the loop runs"));
    });
    drop(drive);
    worm.stop().expect("the virtual worm ends");
    (ending.expect("was measured"), allocations.count_total)
}

#[test]
fn a_tick_allocates_only_what_a_loan_takes() {
    // The first run of a process sets things up once and for all; what later ones allocate at start and end is the same,
    // so the difference between a short and a long run is the ticks'.
    run_for(Duration::from_millis(50));
    let (short, short_allocations) = run_for(Duration::from_millis(300));
    let (long, long_allocations) = run_for(Duration::from_millis(1500));
    assert_eq!((short.unpublished, long.unpublished), (0, 0));
    let ticks = long.ticks - short.ticks;
    assert!(ticks > 200, "the loop ticks: {short:?}, {long:?}");
    let allocations = long_allocations - short_allocations;
    assert_eq!(allocations, LOANS_PER_TICK * ticks, "{ticks} ticks");
}

#[test]
fn a_year_of_watching_stays_within_fifty_megabytes() {
    const CYCLES: u64 = 365 * 24 * 3600 * 2 / 5; // of 2.5 s
    // SAFETY: messages are plain numbers, of which zero is one.
    let (cycle, timing): (Cycle, Timing) = unsafe { (std::mem::zeroed(), std::mem::zeroed()) };
    let mut telemetry = None;
    let allocated = allocation_counter::measure(|| {
        let mut watched = Telemetry::default();
        for index in 0..CYCLES {
            watched.take_cycle(&Cycle { index, ..cycle });
            if index % 50 == 0 {
                watched.take_alarm(&Alarm {
                    sequence: index / 50,
                    raised: (index / 50 % 2) as u32,
                    ..Alarm::NONE
                });
            }
            if index % 100 == 0 {
                watched.take_timing(&Timing {
                    sequence: index / 100,
                    // From 1 ns to far beyond the longest that is resolved, in no order.
                    bus_ns: 1 << (index / 100 * 7 % 40),
                    culprit: (index / 100 % 8) as u32,
                    overrun: 1,
                    ..timing
                });
            }
        }
        telemetry = Some(watched);
    });
    let telemetry = telemetry.expect("was measured");
    println!("{} bytes, {} at most", allocated.bytes_current, allocated.bytes_max);
    assert_eq!(telemetry.cycles.total(), CYCLES);
    assert!(telemetry.cycles.last().is_some_and(|cycle| cycle.index == CYCLES - 1));
    assert!(
        allocated.bytes_current < 50_000_000,
        "{} bytes",
        allocated.bytes_current
    );
    // While a list grows, the old one is there, too.
    assert!(allocated.bytes_max < 75_000_000, "{} bytes", allocated.bytes_max);
}
