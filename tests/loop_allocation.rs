//! Memory. A tick allocates nothing of its own: two messages a tick, one allocation of iceoryx2's for each loan, and no more. Who watches
//! a worm for a year needs no more memory than after two days.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use worm_estimator::config::Config;
use worm_estimator::message::{Alarm, Cycle, Timing};
use wormd::attendance::Attendance;
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
        let outcome = control::run(&config, &mut drive, &hub, &role, &Attendance::default(), &end, |_| {
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

/// Gait cycles of 2.5 s in a year.
const CYCLES_PER_YEAR: u64 = 365 * 24 * 3600 * 2 / 5;

/// What a year of crawling leaves with who watches it, with a change of an alarm every two minutes.
fn watch_for_a_year() -> Telemetry {
    // SAFETY: messages are plain numbers, of which zero is one.
    let (mut cycle, mut timing): (Cycle, Timing) = unsafe { (std::mem::zeroed(), std::mem::zeroed()) };
    let mut alarm = Alarm::NONE;
    let mut telemetry = Telemetry::default();
    for index in 0..CYCLES_PER_YEAR {
        cycle.index = index;
        telemetry.take_cycle(&cycle);
        if index % 50 == 0 {
            alarm.sequence += 1;
            alarm.raised = 1 - alarm.raised;
            telemetry.take_alarm(&alarm);
        }
        if index % 100 == 0 {
            timing.sequence += 1;
            // From 1 ns to far beyond the longest that is resolved, in no order.
            timing.bus_ns = 1 << (timing.sequence * 7 % 40);
            timing.culprit = (timing.sequence % 8) as u32;
            timing.overrun = 1;
            telemetry.take_timing(&timing);
        }
    }
    telemetry
}

#[test]
fn a_year_of_watching_stays_within_fifty_megabytes() {
    let mut telemetry = None;
    let allocated = allocation_counter::measure(|| telemetry = Some(watch_for_a_year()));
    let telemetry = telemetry.expect("was measured");
    println!("{} bytes, {} at most", allocated.bytes_current, allocated.bytes_max);
    assert_eq!(telemetry.cycles.total(), CYCLES_PER_YEAR);
    assert_eq!(
        telemetry.cycles.last().map(|cycle| cycle.index),
        Some(CYCLES_PER_YEAR - 1)
    );
    assert!(telemetry.tick_stats.ticks > 100_000, "{}", telemetry.tick_stats.ticks);
    assert!(
        allocated.bytes_current < 50_000_000,
        "{} bytes",
        allocated.bytes_current
    );
    // While a list grows, the old one is there, too.
    assert!(allocated.bytes_max < 75_000_000, "{} bytes", allocated.bytes_max);
}
