//! A subscriber that never sleeps: a thread that looks for states of the worm and of the bare pair in turn, on a CPU of its own.

use super::testbed::{NOTES, Received};
use crate::command::Failure;
use crate::latency::Durations;
use crate::latency::ipc_baseline::Bare;
use crate::realtime::monotonic_ns;
use crate::topics::{Hub, Instance};
use crossbeam::channel::{Receiver, bounded};
use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use worm_estimator::message::State;

/// Keeps the processes off one CPU that this one may use, and gives that one; none where they would be left without.
pub(super) fn keep_off(pids: [u32; 2]) -> Option<usize> {
    let mine = sched_getaffinity(Pid::from_raw(0)).ok()?;
    let pids = pids.map(|pid| Pid::from_raw(pid as i32));
    let theirs = [sched_getaffinity(pids[0]).ok()?, sched_getaffinity(pids[1]).ok()?];
    let has = |set: &CpuSet, cpu| set.is_set(cpu) == Ok(true);
    // The last one: the first CPU is the one that most interrupts go to.
    (0..CpuSet::count()).rev().filter(|&cpu| has(&mine, cpu)).find(|&cpu| {
        theirs.iter().zip(pids).all(|(cpus, pid)| {
            let mut left = *cpus;
            let others = left.unset(cpu).is_ok() && (0..CpuSet::count()).any(|other| has(&left, other));
            others && sched_setaffinity(pid, &left).is_ok()
        })
    })
}

/// The running thread.
pub(super) struct Polling {
    end: Arc<AtomicBool>,
    /// When it had each state of the worm in hand.
    pub(super) heard: Receiver<Received>,
    thread: JoinHandle<Result<Durations, Failure>>,
}

impl Polling {
    pub(super) fn start(instance: &Instance, bare: &Arc<Bare>, cpu: usize) -> Result<Self, Failure> {
        let hub = Hub::open(instance).map_err(Failure::failed)?;
        let (bare, end) = (Arc::clone(bare), Arc::new(AtomicBool::new(false)));
        let thread_end = Arc::clone(&end);
        let (sender, heard) = bounded(NOTES);
        let look = move || {
            let mut only = CpuSet::new();
            // Elsewhere it is slower, and that is all.
            let _ = only.set(cpu).and_then(|()| sched_setaffinity(Pid::from_raw(0), &only));
            let mut states = hub.subscriber::<State>().map_err(Failure::failed)?;
            let poller = bare.poller().map_err(Failure::failed)?;
            let mut bare_delivery = Durations::default();
            while !thread_end.load(Ordering::Relaxed) {
                while let Some(state) = states.next().map_err(Failure::failed)? {
                    // Notes that find no room are lost.
                    let _ = sender.try_send((state.sequence, monotonic_ns()));
                }
                poller
                    .look(|age_ns| bare_delivery.record(age_ns))
                    .map_err(Failure::failed)?;
            }
            Ok(bare_delivery)
        };
        let thread = std::thread::Builder::new()
            .name("busy subscriber".to_owned())
            .spawn(look)
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        Ok(Self { end, heard, thread })
    }

    /// Ends the thread, and gives how old the bare pair's values were.
    pub(super) fn finish(self) -> Result<Durations, Failure> {
        self.end.store(true, Ordering::Relaxed);
        self.thread
            .join()
            .map_err(|_| Failure::failed("the busy subscriber's thread panicked"))?
    }
}
