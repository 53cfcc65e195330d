//! The machine's own limit, measured beside the loop: a bare sleeper on absolute deadlines, like `cyclictest`, in a process of
//! its own, like the loop; and the [bare pair](super::ipc_baseline) of iceoryx2 that it feeds.

use super::ipc_baseline::{IpcBaseline, IpcBaselineError};
use crate::control::Schedule;
use crate::latency::Durations;
use crate::realtime::{self, Grant, monotonic_ns};
use serde::{Deserialize, Serialize};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use worm_estimator::config::Realtime;

/// Longest sleep of the listener, and so the delay with which it notices the end.
const MAX_SLEEP: Duration = Duration::from_millis(20);

/// When the sleeper wakes, and which wakes count. Times are ns of `CLOCK_MONOTONIC`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorPlan {
    /// Wakes per second.
    pub rate_hz: f64,
    /// Any deadline of the loop. The sleeper's deadlines lie half a period off, so that the two do not disturb each other.
    pub loop_deadline_ns: u64,
    /// Only deadlines from this time on count.
    pub from_ns: u64,
    /// Only deadlines before this time count.
    pub until_ns: u64,
}

/// What the bare sleeper has measured.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct FloorOutcome {
    /// Wake lateness.
    pub wake: Durations,
    /// Duration of the call that wakes the bare listener.
    pub notify: Durations,
    /// Share of one CPU that it used while it counted, 0 to 1.
    pub cpu_share: f64,
    /// What the operating system refused, with the remedies.
    pub refusals: Vec<String>,
}

/// Runs the bare sleeper by the plan until `end` is set; it feeds the bare pair. Calls `ready` once, before the first sleep.
///
/// # Errors
/// [`IpcBaselineError`].
pub fn run(
    baseline: &IpcBaseline,
    plan: &FloorPlan,
    wanted: &Realtime,
    end: &AtomicBool,
    ready: impl FnOnce(),
) -> Result<FloorOutcome, IpcBaselineError> {
    let mut publisher = baseline.publisher()?;
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
    // Deadlines before the start do not count as missed.
    schedule.finish_pause(monotonic_ns());
    let mut cpu_before_ns = None;
    while !end.load(Ordering::Relaxed) {
        let deadline = schedule.deadline_ns();
        while monotonic_ns() < deadline && !end.load(Ordering::Relaxed) {
            realtime::sleep_until(deadline);
        }
        let late_ns = monotonic_ns().saturating_sub(deadline);
        let notify_ns = publisher.publish()?;
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
        // It ended early.
        outcome.cpu_share = cpu_share(before_ns, plan);
    }
    Ok(outcome)
}

/// Share of one CPU that the calling thread has used since it began to count.
fn cpu_share(before_ns: u64, plan: &FloorPlan) -> f64 {
    let counted_ns = monotonic_ns().min(plan.until_ns).saturating_sub(plan.from_ns).max(1);
    (realtime::thread_cpu_ns() - before_ns) as f64 / counted_ns as f64
}

/// A thread that the bare sleeper's event wakes, and that measures the age of what it then receives.
pub struct BaselineListener {
    end: Arc<AtomicBool>,
    counts: Arc<AtomicBool>,
    thread: JoinHandle<Result<Durations, IpcBaselineError>>,
}

impl BaselineListener {
    /// Starts the thread; it counts nothing yet.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(baseline: &Arc<IpcBaseline>, wanted: Realtime) -> io::Result<Self> {
        let (end, counts) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let (baseline, thread_end, thread_counts) = (Arc::clone(baseline), Arc::clone(&end), Arc::clone(&counts));
        let thread = std::thread::Builder::new()
            .name("bare listener".to_owned())
            .spawn(move || {
                let subscriber = baseline.waiting_subscriber()?;
                realtime::request(&wanted, 0);
                let mut delivery = Durations::default();
                while !thread_end.load(Ordering::Relaxed) {
                    subscriber.wait(MAX_SLEEP, |age_ns| {
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

    /// Ends the thread; returns the times from before publishing until the woken subscriber had the value. None when the thread
    /// panicked.
    ///
    /// # Errors
    /// [`IpcBaselineError`].
    pub fn finish(self) -> Result<Option<Durations>, IpcBaselineError> {
        self.end.store(true, Ordering::Relaxed);
        self.thread.join().ok().transpose()
    }
}
