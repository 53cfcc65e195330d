//! The machine's own limit, measured beside the loop: a bare sleeper on absolute deadlines, as `cyclictest` is one, in a process
//! of its own as the loop is in one; and the [bare pair](super::bare) of iceoryx2 that it feeds.

use super::histogram::Durations;
use super::ipc_baseline::{Bare, BareError};
use crate::control::Schedule;
use crate::realtime::{self, Grant, monotonic_ns};
use serde::{Deserialize, Serialize};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use worm_estimator::config::Realtime;

/// How long the listener sleeps at most, and with it the time until an end is noticed.
const LONGEST_SLEEP: Duration = Duration::from_millis(20);

/// When the sleeper wakes, and when it counts. Times are ns of `CLOCK_MONOTONIC`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorPlan {
    /// Wakes per second.
    pub rate_hz: f64,
    /// Some deadline of the loop. The sleeper's lie half a period beside it, so that the two are not in each other's way.
    pub loop_deadline_ns: u64,
    /// Deadlines before this time are not counted,
    pub from_ns: u64,
    /// nor are those after this one.
    pub until_ns: u64,
}

/// What the bare sleeper has measured.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct FloorOutcome {
    /// Wake lateness.
    pub wake: Durations,
    /// Waking the bare listener.
    pub notify: Durations,
    /// Share of one CPU that it took while it counted, 0 to 1.
    pub cpu_share: f64,
    /// What the system has refused to it, with the remedy.
    pub refusals: Vec<String>,
}

/// Sleeps and wakes by the plan until `end` is set, and feeds the bare pair. `ready` is called once, before the first sleep.
///
/// # Errors
/// [`BareError`].
pub fn sleep(
    bare: &Bare,
    plan: &FloorPlan,
    wanted: &Realtime,
    end: &AtomicBool,
    ready: impl FnOnce(),
) -> Result<FloorOutcome, BareError> {
    let mut speaker = bare.speaker()?;
    let grants = realtime::request(wanted, 0);
    let mut outcome = FloorOutcome {
        refusals: grants
            .iter()
            .filter(|grant| grant.refusal.is_some())
            .map(Grant::to_string)
            .collect(),
        ..FloorOutcome::default()
    };
    ready();
    let period_ns = Schedule::new(plan.rate_hz, 0).period_ns();
    let mut schedule = Schedule::new(plan.rate_hz, plan.loop_deadline_ns + period_ns / 2);
    // Deadlines that have passed before the start are not missed ones.
    schedule.finish_pause(monotonic_ns());
    let mut cpu_before_ns = None;
    while !end.load(Ordering::Relaxed) {
        let deadline = schedule.deadline_ns();
        while monotonic_ns() < deadline && !end.load(Ordering::Relaxed) {
            realtime::sleep_until(deadline);
        }
        let late_ns = monotonic_ns().saturating_sub(deadline);
        let notify_ns = speaker.speak()?;
        if (plan.from_ns..plan.until_ns).contains(&deadline) {
            cpu_before_ns.get_or_insert_with(realtime::thread_cpu_ns);
            outcome.wake.record_due(late_ns, period_ns);
            outcome.notify.record(notify_ns);
        } else if let Some(before_ns) = cpu_before_ns.take() {
            outcome.cpu_share = cpu_share(before_ns, plan);
        }
        schedule.finish(monotonic_ns());
    }
    if let Some(before_ns) = cpu_before_ns {
        // Ended before its time.
        outcome.cpu_share = cpu_share(before_ns, plan);
    }
    Ok(outcome)
}

/// Share of one CPU that the calling thread has taken since it began to count.
fn cpu_share(before_ns: u64, plan: &FloorPlan) -> f64 {
    let counted_ns = monotonic_ns().min(plan.until_ns).saturating_sub(plan.from_ns).max(1);
    (realtime::thread_cpu_ns() - before_ns) as f64 / counted_ns as f64
}

/// A thread that the bare sleeper's event wakes, and that counts how old what it then receives is.
pub struct BareListener {
    end: Arc<AtomicBool>,
    counts: Arc<AtomicBool>,
    thread: JoinHandle<Result<Durations, BareError>>,
}

impl BareListener {
    /// Starts the thread; it counts nothing yet.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(bare: &Arc<Bare>, wanted: Realtime) -> io::Result<Self> {
        let (end, counts) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let (bare, thread_end, thread_counts) = (Arc::clone(bare), Arc::clone(&end), Arc::clone(&counts));
        let thread = std::thread::Builder::new()
            .name("bare listener".to_owned())
            .spawn(move || {
                let sleeper = bare.sleeper()?;
                realtime::request(&wanted, 0);
                let mut delivery = Durations::default();
                while !thread_end.load(Ordering::Relaxed) {
                    sleeper.sleep(LONGEST_SLEEP, |age_ns| {
                        if thread_counts.load(Ordering::Relaxed) {
                            delivery.record(age_ns);
                        }
                    })?;
                }
                Ok(delivery)
            })?;
        Ok(Self { end, counts, thread })
    }

    /// Begins or ends counting.
    pub fn count(&self, counts: bool) {
        self.counts.store(counts, Ordering::Relaxed);
    }

    /// Ends the thread; gives from before publishing until the woken subscriber had it. None when the thread panicked.
    ///
    /// # Errors
    /// [`BareError`].
    pub fn finish(self) -> Result<Option<Durations>, BareError> {
        self.end.store(true, Ordering::Relaxed);
        self.thread.join().ok().transpose()
    }
}
