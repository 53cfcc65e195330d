//! What the loop has to tell, without a log call in a tick: entries go through a bounded queue to a thread that logs. The same
//! thread reads the loop's counters every now and then, for the [evidence](super::evidence) in late ticks.

use super::evidence::{Counters, Counts, Snapshot};
use crate::message::{Culprit, Fault, Mode};
use crossbeam::queue::ArrayQueue;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Entries that may wait; more are dropped and counted.
const CAPACITY: usize = 256;

/// How often the logging thread looks, and reads the counters. A person reads the log; the topics are for those in a hurry.
const POLL: Duration = Duration::from_millis(20);

/// One thing that happened in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Entry {
    ModeChanged {
        from: Mode,
        to: Mode,
        fault: Fault,
        alarm: u32,
    },
    Overrun {
        sequence: u64,
        skipped: u64,
        culprit: Culprit,
        late_us: u32,
    },
    PortLost,
    PortBack,
}

struct Shared {
    queue: ArrayQueue<Entry>,
    dropped: AtomicU64,
    end: AtomicBool,
    counters: Counters,
    snapshot: Snapshot,
    ticks: AtomicU64,
}

/// The loop's end of the queue. Dropping it ends the logging thread, after the last entry.
pub(super) struct Journal {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Journal {
    /// Starts the logging thread of the calling thread's loop. It runs under the ordinary scheduler as long as this is called
    /// before real-time priority is requested.
    pub(super) fn start() -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            queue: ArrayQueue::new(CAPACITY),
            dropped: AtomicU64::new(0),
            end: AtomicBool::new(false),
            counters: Counters::of_this_thread(),
            snapshot: Snapshot::default(),
            ticks: AtomicU64::new(0),
        });
        let writer = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("journal".to_owned())
            .spawn(move || write_entries(&writer))?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Notes an entry; never blocks, never allocates.
    pub(super) fn note(&self, entry: Entry) {
        if self.shared.queue.push(entry).is_err() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Tells how many ticks the loop has run.
    pub(super) fn count_ticks(&self, ticks: u64) {
        self.shared.ticks.store(ticks, Ordering::Relaxed);
    }

    /// What the kernel has counted in tick number `tick`, which ends now. For late ticks alone: it costs system calls.
    pub(super) fn evidence(&self, tick: u64) -> Counts {
        let now = self.shared.counters.read();
        let evidence = self.shared.snapshot.evidence(tick, now);
        // The next late tick may come before the logging thread looks again; this one's causes are not its.
        self.shared.snapshot.store(tick, now);
        evidence
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        self.shared.end.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A logging thread that panicked has said so itself.
            let _ = thread.join();
        }
    }
}

fn write_entries(shared: &Shared) {
    let mut overruns = Overruns::default();
    loop {
        let ticks = shared.ticks.load(Ordering::Relaxed);
        shared.snapshot.store(ticks, shared.counters.read());
        // Read before the queue, so that entries noted before the end are not lost.
        let is_over = shared.end.load(Ordering::Acquire);
        while let Some(entry) = shared.queue.pop() {
            match entry {
                Entry::Overrun {
                    sequence,
                    skipped,
                    culprit,
                    late_us,
                } => overruns.add(sequence, skipped, culprit, late_us),
                Entry::ModeChanged { from, to, fault, alarm } => log_mode(from, to, fault, alarm),
                Entry::PortLost => {
                    tracing::error!("the serial port is gone: plug it in again, then `wormd command reset`")
                }
                Entry::PortBack => tracing::info!("the serial port is open again"),
            }
        }
        overruns.log_now_and_then(is_over);
        let dropped = shared.dropped.swap(0, Ordering::Relaxed);
        if dropped > 0 {
            tracing::warn!(
                dropped,
                "log entries were dropped: the loop had more to tell than could be written"
            );
        }
        if is_over {
            return;
        }
        std::thread::sleep(POLL);
    }
}

fn log_mode(from: Mode, to: Mode, fault: Fault, alarm: u32) {
    if to == Mode::Fault {
        let alarm = crate::message::AlarmKind::try_from(alarm).map_or("", crate::message::AlarmKind::name);
        tracing::error!(%fault, alarm, "the worm was stopped while {from}: mend the cause, then `wormd command reset`");
    } else {
        tracing::info!("{from} -> {to}");
    }
}

/// Overruns come in swarms when a machine is busy; one line a second tells of all of them.
#[derive(Default)]
struct Overruns {
    count: u64,
    skipped: u64,
    worst_us: u32,
    last: Option<(u64, Culprit)>,
    quiet_polls: u32,
}

impl Overruns {
    fn add(&mut self, sequence: u64, skipped: u64, culprit: Culprit, late_us: u32) {
        self.count += 1;
        self.skipped += skipped;
        if late_us >= self.worst_us {
            self.worst_us = late_us;
            self.last = Some((sequence, culprit));
        }
    }

    fn log_now_and_then(&mut self, is_over: bool) {
        self.quiet_polls += 1;
        let a_second_has_passed = self.quiet_polls >= 50;
        if let (Some((tick, culprit)), true) = (self.last, a_second_has_passed || is_over) {
            tracing::warn!(
                ticks = self.count,
                deadlines_missed = self.skipped,
                worst_late_us = self.worst_us,
                worst_tick = tick,
                %culprit,
                "ticks ended late"
            );
            *self = Self::default();
        }
    }
}
