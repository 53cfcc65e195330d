//! A subscriber that never sleeps: a thread that polls the worm's states and the bare pair in turn, on a CPU of its own.

use super::ipc_baseline::IpcBaseline;
use super::testbed::{QUEUE, Received};
use crate::failure::Failure;
use crate::latency::Durations;
use crate::realtime::monotonic_ns;
use crate::topics::{Hub, Instance};
use crossbeam::channel::{Receiver, bounded};
use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use worm_estimator::message::State;

/// Excludes the processes from one CPU that this one may use, and returns it; none where they would have no CPU left.
pub(super) fn reserve_cpu(pids: [u32; 2]) -> Option<usize> {
    let mine = sched_getaffinity(Pid::from_raw(0)).ok()?;
    let pids = pids.map(|pid| Pid::from_raw(pid as i32));
    let theirs = [sched_getaffinity(pids[0]).ok()?, sched_getaffinity(pids[1]).ok()?];
    let has = |set: &CpuSet, cpu| set.is_set(cpu) == Ok(true);
    // The last one: most interrupts go to the first.
    (0..CpuSet::count()).rev().filter(|&cpu| has(&mine, cpu)).find(|&cpu| {
        theirs.iter().zip(pids).all(|(cpus, pid)| {
            let mut remaining = *cpus;
            let others = remaining.unset(cpu).is_ok() && (0..CpuSet::count()).any(|other| has(&remaining, other));
            others && sched_setaffinity(pid, &remaining).is_ok()
        })
    })
}

/// The running thread.
pub(super) struct BusySubscriber {
    end: Arc<AtomicBool>,
    /// When it received each state of the worm.
    pub(super) received: Receiver<Received>,
    thread: JoinHandle<Result<Durations, Failure>>,
}

impl BusySubscriber {
    /// Starts the thread on `cpu`.
    pub(super) fn start(instance: &Instance, baseline: &Arc<IpcBaseline>, cpu: usize) -> Result<Self, Failure> {
        let hub = Hub::open(instance).map_err(Failure::failed)?;
        let (baseline, end) = (Arc::clone(baseline), Arc::new(AtomicBool::new(false)));
        let thread_end = Arc::clone(&end);
        let (sender, received) = bounded(QUEUE);
        let poll = move || {
            let mut only = CpuSet::new();
            // On another CPU it is merely slower.
            let _ = only.set(cpu).and_then(|()| sched_setaffinity(Pid::from_raw(0), &only));
            let mut states = hub.subscriber::<State>().map_err(Failure::failed)?;
            let baseline_subscriber = baseline.polling_subscriber().map_err(Failure::failed)?;
            let mut baseline_delivery = Durations::default();
            while !thread_end.load(Ordering::Relaxed) {
                while let Some(state) = states.next().map_err(Failure::failed)? {
                    // What does not fit into the queue is dropped.
                    let _ = sender.try_send((state.sequence, monotonic_ns()));
                }
                baseline_subscriber
                    .poll(|age_ns| baseline_delivery.record(age_ns))
                    .map_err(Failure::failed)?;
            }
            Ok(baseline_delivery)
        };
        let thread = std::thread::Builder::new()
            .name("busy subscriber".to_owned())
            .spawn(poll)
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        Ok(Self { end, received, thread })
    }

    /// Ends the thread, and returns how old the bare pair's values were.
    pub(super) fn finish(self) -> Result<Durations, Failure> {
        self.end.store(true, Ordering::Relaxed);
        self.thread
            .join()
            .map_err(|_| Failure::failed("the busy subscriber's thread panicked"))?
    }
}
