//! The kernel's counters of the loop's thread, and from them the cause of a late tick.
//!
//! Reading the counters costs system calls, which a tick in time does not make. So the logging thread reads them every few
//! milliseconds, and the loop only in a late tick: the difference happened in that tick, or in the few before it. Every tick waits
//! a little for the CPU, so the usual waiting time of those few is subtracted.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::sync::atomic::{AtomicU64, Ordering};
use worm_estimator::message::Culprit;

/// Resolution of the kernel's stolen time, ns: `USER_HZ` is 100 on every Linux that wormd runs on.
const STOLEN_STEP_NS: u64 = 10_000_000;

/// Bytes read of a counter file: the first line of `/proc/stat`, all of the thread's files.
const READ_BYTES: usize = 512;

/// The kernel's counters since the thread, or the machine, started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Counts {
    /// Time in which the thread was runnable but had no CPU, ns (`run_delay` of `schedstat`).
    pub waited_ns: u64,
    /// Time that the host took from this machine's CPUs, ns.
    pub stolen_ns: u64,
    /// Page faults that memory could serve.
    pub minor_faults: u64,
    /// Page faults that waited for a disk.
    pub major_faults: u64,
}

impl Counts {
    /// What was counted from `earlier` on.
    pub fn since(self, earlier: Self) -> Self {
        Self {
            waited_ns: self.waited_ns.saturating_sub(earlier.waited_ns),
            stolen_ns: self.stolen_ns.saturating_sub(earlier.stolen_ns),
            minor_faults: self.minor_faults.saturating_sub(earlier.minor_faults),
            major_faults: self.major_faults.saturating_sub(earlier.major_faults),
        }
    }
}

/// The counters' files, open. Where a kernel does not have one, its counters stand still.
#[derive(Debug)]
pub(super) struct Counters {
    schedstat: Option<File>,
    stat: Option<File>,
    machine: Option<File>,
}

impl Counters {
    /// The counters of the calling thread. Any thread may read them then.
    pub fn of_this_thread() -> Self {
        let open = |path| File::open(path).ok();
        Self {
            schedstat: open("/proc/thread-self/schedstat"),
            stat: open("/proc/thread-self/stat"),
            machine: open("/proc/stat"),
        }
    }

    /// The counters now: three system calls, no allocation.
    pub fn read(&self) -> Counts {
        let mut text = [0; READ_BYTES];
        // schedstat(5): time on a CPU, time waiting for one, slices.
        let waited_ns = number(read_into(self.schedstat.as_ref(), &mut text), 1);
        // proc(5): behind the name in parentheses, minflt and majflt are the 8th and the 10th field.
        let stat = read_into(self.stat.as_ref(), &mut text);
        let behind_name = stat.rsplit(|&byte| byte == b')').next().unwrap_or_default();
        let (minor_faults, major_faults) = (number(behind_name, 7), number(behind_name, 9));
        // proc(5): "cpu", then user, nice, system, idle, iowait, irq, softirq, steal.
        let stolen_steps = number(read_into(self.machine.as_ref(), &mut text), 8);
        Counts {
            waited_ns,
            stolen_ns: stolen_steps * STOLEN_STEP_NS,
            minor_faults,
            major_faults,
        }
    }
}

fn read_into<'t>(file: Option<&File>, text: &'t mut [u8; READ_BYTES]) -> &'t [u8] {
    let count = file.and_then(|file| file.read_at(text, 0).ok()).unwrap_or(0);
    &text[..count]
}

/// The word at `index`, counted from zero, as a number; zero where there is none.
fn number(text: &[u8], index: usize) -> u64 {
    text.split(|byte| byte.is_ascii_whitespace())
        .filter(|word| !word.is_empty())
        .nth(index)
        .and_then(|word| std::str::from_utf8(word).ok()?.parse().ok())
        .unwrap_or(0)
}

/// The counters as the logging thread last read them. Each number is whole by itself; that they may be of two readings does
/// no harm, and spares the loop a lock that a thread of lower priority could hold.
#[derive(Debug, Default)]
pub(super) struct Snapshot {
    tick: AtomicU64,
    waited_ns: AtomicU64,
    stolen_ns: AtomicU64,
    minor_faults: AtomicU64,
    major_faults: AtomicU64,
}

impl Snapshot {
    /// Keeps what was counted when the loop had run `tick` ticks.
    pub fn store(&self, tick: u64, counts: Counts) {
        self.tick.store(tick, Ordering::Relaxed);
        self.waited_ns.store(counts.waited_ns, Ordering::Relaxed);
        self.stolen_ns.store(counts.stolen_ns, Ordering::Relaxed);
        self.minor_faults.store(counts.minor_faults, Ordering::Relaxed);
        self.major_faults.store(counts.major_faults, Ordering::Relaxed);
    }

    fn load(&self) -> (u64, Counts) {
        let counts = Counts {
            waited_ns: self.waited_ns.load(Ordering::Relaxed),
            stolen_ns: self.stolen_ns.load(Ordering::Relaxed),
            minor_faults: self.minor_faults.load(Ordering::Relaxed),
            major_faults: self.major_faults.load(Ordering::Relaxed),
        };
        (self.tick.load(Ordering::Relaxed), counts)
    }

    /// What was counted in the tick number `tick`, by the counters at its end.
    pub fn evidence(&self, tick: u64, now: Counts) -> Counts {
        let (then_tick, then) = self.load();
        let mut evidence = now.since(then);
        // What ticks wait as a rule, as far as the counters go back.
        let usual_ns = then.waited_ns.checked_div(then_tick).unwrap_or(0);
        let usual_ns = usual_ns.saturating_mul(tick.saturating_sub(then_tick));
        evidence.waited_ns = evidence.waited_ns.saturating_sub(usual_ns);
        evidence
    }
}

/// The parts of a tick, ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Parts {
    pub wake: u64,
    pub bus: u64,
    /// What the devices were given for their answer. What the exchange took beyond that was not theirs: the loop was to be woken
    /// then.
    pub bus_allowed: u64,
    pub compute: u64,
    pub publish: u64,
}

/// The cause of a late tick: its longest part, unless the kernel's counters show a cause behind that.
///
/// A thread that waited for half of that part was kept from running. A page fault explains a computation or publishing that
/// took long, for these touch memory and do nothing else that takes long. Stolen time is counted in steps so coarse that any is
/// taken for a sign.
pub(super) fn find_culprit(parts: &Parts, evidence: &Counts) -> Culprit {
    let parts = [
        (Culprit::Wake, parts.wake + parts.bus.saturating_sub(parts.bus_allowed)),
        (Culprit::Bus, parts.bus.min(parts.bus_allowed)),
        (Culprit::Compute, parts.compute),
        (Culprit::Publish, parts.publish),
    ];
    let (largest, ns) = parts
        .into_iter()
        .max_by_key(|part| part.1)
        .unwrap_or((Culprit::None, 0));
    let own_work = matches!(largest, Culprit::Compute | Culprit::Publish);
    if evidence.waited_ns >= ns / 2 {
        Culprit::Scheduler
    } else if evidence.major_faults > 0 || own_work && evidence.minor_faults > 0 {
        Culprit::PageFault
    } else if evidence.stolen_ns > 0 {
        Culprit::Stolen
    } else {
        largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_is_named() {
        // (wake, bus, compute, publish in µs; waited µs, stolen ms, minor and major faults; culprit)
        let table = [
            ([1500, 80, 2, 9], [0, 0, 0, 0], Culprit::Wake),
            ([1500, 80, 2, 9], [1400, 0, 0, 0], Culprit::Scheduler),
            ([1500, 80, 2, 9], [40, 10, 0, 0], Culprit::Stolen),
            ([1500, 80, 2, 9], [40, 0, 3, 0], Culprit::Wake),
            ([360, 690, 2, 9], [30, 0, 0, 0], Culprit::Bus),
            ([360, 690, 2, 9], [600, 10, 0, 0], Culprit::Scheduler),
            ([60, 1900, 2, 9], [30, 0, 0, 0], Culprit::Wake),
            ([60, 1900, 2, 9], [30, 10, 0, 0], Culprit::Stolen),
            ([60, 80, 1100, 9], [30, 0, 0, 0], Culprit::Compute),
            ([60, 80, 1100, 9], [30, 0, 2, 0], Culprit::PageFault),
            ([60, 80, 2, 2000], [30, 0, 0, 1], Culprit::PageFault),
            ([60, 80, 2, 2000], [30, 0, 0, 0], Culprit::Publish),
        ];
        for ([wake, bus, compute, publish], [waited_us, stolen_ms, minor_faults, major_faults], culprit) in table {
            let parts = Parts {
                wake: wake * 1_000,
                bus: bus * 1_000,
                bus_allowed: 700_000,
                compute: compute * 1_000,
                publish: publish * 1_000,
            };
            let evidence = Counts {
                waited_ns: waited_us * 1_000,
                stolen_ns: stolen_ms * 1_000_000,
                minor_faults,
                major_faults,
            };
            assert_eq!(find_culprit(&parts, &evidence), culprit, "{parts:?}, {evidence:?}");
        }
    }

    #[test]
    fn what_ticks_wait_as_a_rule_is_no_evidence() {
        let snapshot = Snapshot::default();
        let at = |waited_ns| Counts {
            waited_ns,
            ..Counts::default()
        };
        snapshot.store(1_000, at(5_000_000));
        assert_eq!(snapshot.evidence(1_020, at(5_100_000)).waited_ns, 0);
        assert_eq!(snapshot.evidence(1_020, at(6_100_000)).waited_ns, 1_000_000);
    }

    #[test]
    fn the_counters_count_what_this_thread_does() {
        let counters = Counters::of_this_thread();
        let before = counters.read();
        // Memory that was never touched faults once a page, were it not for huge pages: at least once.
        std::hint::black_box(vec![1_u8; 64 << 20]);
        let counted = counters.read().since(before);
        assert!(counted.minor_faults > 0, "{counted:?}");
    }
}
