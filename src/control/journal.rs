//! The loop's log, without a log call in a tick: entries go through a bounded queue to a thread that logs. The same thread reads
//! the loop's counters regularly, as [evidence](super::sched_counters) for late ticks.

use super::interface::Note;
use super::sched_counters::{Counters, Counts, Snapshot};
use crate::logging::Summed;
use crate::realtime::monotonic_ns;
use crossbeam::queue::ArrayQueue;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use worm_estimator::message::{AlarmKind, Culprit, Fault, Mode};

/// Length of the queue; further entries are dropped and counted.
const CAPACITY: usize = 256;

/// How often the logging thread empties the queue and reads the counters. The log is for people; programs read the topics.
const POLL: Duration = Duration::from_millis(20);

/// An event in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Entry {
    ModeChanged {
        from: Mode,
        to: Mode,
        fault: Fault,
        alarm: u32,
        /// The pause behind [`Fault::HostPaused`].
        pause_ns: u64,
    },
    HostPaused {
        pause_ns: u64,
        evidence: Counts,
    },
    RateChanged {
        configured_hz: f64,
        held_hz: f64,
    },
    Overrun {
        sequence: u64,
        skipped: u64,
        culprit: Culprit,
        late_us: u32,
    },
    PortLost,
    PortBack,
    Noted(Note),
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
    /// Starts the logging thread for the loop in the calling thread. Call it before requesting real-time priority, so that the
    /// logging thread keeps the ordinary scheduler.
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

    /// Adds an entry; never blocks, never allocates.
    pub(super) fn note(&self, entry: Entry) {
        if self.shared.queue.push(entry).is_err() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Sets how many ticks the loop has run.
    pub(super) fn count_ticks(&self, ticks: u64) {
        self.shared.ticks.store(ticks, Ordering::Relaxed);
    }

    /// What the kernel has counted in tick number `tick`, which ends now. Only for late ticks: it costs system calls.
    pub(super) fn evidence(&self, tick: u64) -> Counts {
        let now = self.shared.counters.read();
        let evidence = self.shared.snapshot.evidence(tick, now);
        // The next late tick may come before the logging thread reads again; it must not inherit the causes of this one.
        self.shared.snapshot.store(tick, now);
        evidence
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        self.shared.end.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A panic of the logging thread has been reported by the panic itself.
            let _ = thread.join();
        }
    }
}

fn write_entries(shared: &Shared) {
    let mut recurring = Recurring::default();
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
                } => recurring.take_late(sequence, skipped, culprit, late_us),
                Entry::HostPaused { pause_ns, evidence } => recurring.take_pause(pause_ns, evidence),
                Entry::RateChanged { configured_hz, held_hz } => recurring.take_rate(configured_hz, held_hz),
                Entry::ModeChanged {
                    from,
                    to: Mode::Fault,
                    fault: Fault::HostPaused,
                    pause_ns,
                    ..
                } => log_host_paused(from, pause_ns),
                Entry::ModeChanged {
                    from, to, fault, alarm, ..
                } => log_mode(from, to, fault, alarm),
                Entry::PortLost => {
                    tracing::error!("the serial port is gone: plug it in again, then `wormd command reset`")
                }
                Entry::Noted(note) => log_note(note),
                Entry::PortBack => tracing::info!("the serial port is open again"),
            }
        }
        recurring.take_dropped(shared.dropped.swap(0, Ordering::Relaxed));
        recurring.log_what_is_due(monotonic_ns(), is_over);
        if is_over {
            return;
        }
        std::thread::sleep(POLL);
    }
}

fn log_host_paused(from: Mode, pause_ns: u64) {
    tracing::error!(
        "the worm was stopped while {from}: {} is longer than the servo's watchdog waits; `wormd command reset` goes on, \
         control.resume_after_pause does so by itself, and `wormd check` says what keeps the computer from pausing",
        format_args!(
            "host-paused, the computer did not run the controller for {} ms, which",
            pause_ns / 1_000_000
        )
    );
}

fn log_mode(from: Mode, to: Mode, fault: Fault, alarm: u32) {
    if to == Mode::Fault {
        let alarm = AlarmKind::try_from(alarm).map_or("", AlarmKind::name);
        tracing::error!(%fault, alarm, "the worm was stopped while {from}: remove the cause, then `wormd command reset`");
    } else {
        tracing::info!("{from} -> {to}");
    }
}

fn log_note(note: Note) {
    match note {
        Note::LeaseLapsed => tracing::error!(
            "the lease of the crawl has lapsed: whoever made the worm crawl is gone or silent; the motor was stopped"
        ),
        Note::TimeLimit => tracing::warn!("the time for which the worm was to crawl is over: it holds"),
        Note::Idle => tracing::info!("no motion for control.idle_disarm_s: torque goes off"),
        Note::HeldByAlarm(kind) => tracing::warn!(alarm = kind.name(), "the worm holds because of an alarm"),
        Note::BackedOff(kind) => tracing::warn!(alarm = kind.name(), "the worm backs off because of an alarm"),
        Note::BackOffTimedOut => tracing::warn!("the back-off did not get to its end in time: the worm holds"),
        Note::Permitted { mask, user } => {
            for kind in kinds_of(mask) {
                tracing::warn!("motion despite alarm {kind} permitted by user {user}");
            }
        }
        Note::Acknowledged { mask, user } => {
            for kind in kinds_of(mask) {
                tracing::info!("alarm {kind} acknowledged by user {user}");
            }
        }
        Note::Marked { position_um, user } => {
            let position_m = position_um as f64 * 1e-6;
            tracing::info!("the worm is at {position_m} m along the canal, says user {user}");
        }
        Note::SilenceWasRestart => tracing::error!(
            "the servo has restarted: it was silent because it had no power, or was rebooted; check supply and connectors"
        ),
    }
}

fn kinds_of(mask: u32) -> impl Iterator<Item = AlarmKind> {
    let kinds = AlarmKind::ALL.iter().copied();
    kinds.filter(move |kind| mask >> kind.code() & 1 == 1)
}

/// Ticks that ended late.
#[derive(Default)]
struct LateTicks {
    ticks: u64,
    skipped: u64,
    worst_us: u32,
    worst: Option<(u64, Culprit)>,
}

impl LateTicks {
    fn log(&self) {
        let (tick, culprit) = self.worst.unwrap_or((0, Culprit::None));
        tracing::warn!(
            ticks = self.ticks,
            deadlines_missed = self.skipped,
            worst_late_us = self.worst_us,
            worst_tick = tick,
            %culprit,
            "ticks ended late"
        );
    }
}

/// Pauses of the computer, and what the kernel has counted in them.
#[derive(Default)]
struct Pauses {
    count: u64,
    total_ms: f64,
    longest_ms: f64,
    stolen_ms: f64,
    waited_ms: f64,
}

impl Pauses {
    fn log(&self) {
        tracing::warn!(
            pauses = self.count,
            total_ms = self.total_ms.round(),
            longest_ms = self.longest_ms.round(),
            stolen_by_host_ms = self.stolen_ms.round(),
            waited_for_cpu_ms = self.waited_ms.round(),
            "host-paused: the computer did not run the controller for a while; no device is blamed for it"
        );
    }
}

/// Recurring events, each kind summed by itself.
#[derive(Default)]
struct Recurring {
    late: Summed<LateTicks>,
    pauses: Summed<Pauses>,
    changes_of_rate: Summed<(u64, f64)>,
    dropped: Summed<u64>,
    told_of_rate: bool,
}

impl Recurring {
    fn take_late(&mut self, sequence: u64, skipped: u64, culprit: Culprit, late_us: u32) {
        self.late.add(|late| {
            late.ticks += 1;
            late.skipped += skipped;
            if late_us >= late.worst_us {
                late.worst_us = late_us;
                late.worst = Some((sequence, culprit));
            }
        });
    }

    fn take_pause(&mut self, pause_ns: u64, evidence: Counts) {
        let ms = |ns: u64| ns as f64 * 1e-6;
        self.pauses.add(|pauses| {
            pauses.count += 1;
            pauses.total_ms += ms(pause_ns);
            pauses.longest_ms = pauses.longest_ms.max(ms(pause_ns));
            pauses.stolen_ms += ms(evidence.stolen_ns);
            pauses.waited_ms += ms(evidence.waited_ns);
        });
    }

    /// The first change says which rate the computer sustains and what to set; further changes are summed.
    fn take_rate(&mut self, configured_hz: f64, held_hz: f64) {
        if std::mem::replace(&mut self.told_of_rate, true) {
            self.changes_of_rate.add(|(count, newest_hz)| {
                *count += 1;
                *newest_hz = held_hz;
            });
        } else {
            tracing::warn!(
                "this computer, or its link, does not hold {configured_hz:.0} Hz: the loop goes on at a steady {held_hz:.0} Hz; set \
                 control.rate_hz = {held_hz:.0}, or give the loop real-time priority and a CPU of its own (`wormd check` says how)"
            );
        }
    }

    /// Entries for which there was no place in the queue.
    fn take_dropped(&mut self, entries: u64) {
        if entries > 0 {
            self.dropped.add(|dropped| *dropped += entries);
        }
    }

    fn log_what_is_due(&mut self, now_ns: u64, is_over: bool) {
        if let Some(late) = self.late.take_due(now_ns, is_over) {
            late.log();
        }
        if let Some(pauses) = self.pauses.take_due(now_ns, is_over) {
            pauses.log();
        }
        if let Some((changes, newest_hz)) = self.changes_of_rate.take_due(now_ns, is_over) {
            tracing::info!(changes, newest_hz, "the loop's rate was adapted again");
        }
        if let Some(dropped) = self.dropped.take_due(now_ns, is_over) {
            tracing::warn!(
                dropped,
                "log entries were dropped: the loop logged faster than the entries could be written"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Seek};

    /// What ten minutes on a computer log that pauses, is late and starves the logging thread several times a second.
    fn log_of_ten_bad_minutes() -> String {
        let mut written = tempfile::tempfile().expect("a temporary file");
        let subscriber = tracing_subscriber::fmt()
            .with_writer(Arc::new(written.try_clone().expect("a descriptor is free")))
            .with_ansi(false)
            .finish();
        tracing::subscriber::with_default(subscriber, || {
            let mut recurring = Recurring::default();
            let polls = 10 * 60 * 50;
            for poll in 0..=polls {
                if poll % 10 == 0 {
                    recurring.take_pause(20_000_000, Counts::default());
                    recurring.take_late(poll, 3, Culprit::Wake, 4_000);
                    recurring.take_rate(1000.0, 500.0);
                    recurring.take_dropped(7);
                }
                recurring.log_what_is_due(poll * 20_000_000, poll == polls);
            }
        });
        let mut log = String::new();
        written.rewind().expect("is a file");
        written.read_to_string(&mut log).expect("is text");
        log
    }

    #[test]
    fn a_busy_computer_does_not_fill_the_log() {
        let log = log_of_ten_bad_minutes();
        for (what, counter, lines, sum) in [
            ("host-paused", "pauses=", 12, 3001),
            ("ticks ended late", "deadlines_missed=", 12, 9003),
            ("log entries were dropped", "dropped=", 12, 21_007),
            ("adapted again", "changes=", 11, 3000),
            ("does not hold 1000 Hz", "", 1, 0),
        ] {
            let of_kind: Vec<&str> = log.lines().filter(|line| line.contains(what)).collect();
            assert!(of_kind.len() <= lines, "{what}: {} lines", of_kind.len());
            let count = |line: &&str| {
                let number = line.split_once(counter)?.1.split_whitespace().next()?;
                number.parse::<u64>().ok()
            };
            let counted: u64 = of_kind.iter().filter_map(count).sum();
            assert_eq!(counted, sum, "{what}: nothing is left out\n{log}");
        }
    }
}
