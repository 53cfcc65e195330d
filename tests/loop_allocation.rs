//! A tick allocates nothing of its own: two messages a tick, one allocation of iceoryx2's for each loan, and no more.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use worm_estimator::config::Config;
use wormd::attendance::Attendance;
use wormd::control::{self, Drive, Ending, link_settings};
use wormd::link::virtual_worm::{Options, VirtualWorm};
use wormd::topics::{Controller, Hub, Instance, RoleLock};

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
