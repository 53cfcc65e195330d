//! Whether all CPUs of this computer run.
//!
//! The host of a virtual machine can take away a single CPU. A thread on another CPU does not notice, except that a device's answer
//! waits for the missing CPU, so that the device looks silent. The kernel counts stolen time only when the CPU is back. But a
//! thread can find out: it moves to each CPU in turn, and returns when all of them have run it.

use super::request::set_fifo;
use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;

/// The calling thread.
const THIS_THREAD: Pid = Pid::from_raw(0);

/// Runs on each CPU in turn that the calling thread may use. Returns when all of them have run it: as soon as the last one is back.
pub fn visit_every_cpu() {
    let Ok(allowed) = sched_getaffinity(THIS_THREAD) else {
        return;
    };
    for cpu in 0..CpuSet::count() {
        let mut alone = CpuSet::new();
        // A CPU that went off line meanwhile cannot be visited, and delays nothing.
        if allowed.is_set(cpu).unwrap_or(false) && alone.set(cpu).is_ok() {
            let _ = sched_setaffinity(THIS_THREAD, &alone);
        }
    }
    // What was allowed before is allowed again.
    let _ = sched_setaffinity(THIS_THREAD, &allowed);
}

/// A thread that goes and sees whether all CPUs run, for one who must not wait for them.
#[derive(Debug)]
pub struct CpuWitness {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    asked: AtomicU64,
    seen: AtomicU64,
    end: AtomicBool,
}

impl CpuWitness {
    /// Starts the thread, with real-time priority `priority` where the system allows it (0: none). To be called before the
    /// calling thread is pinned to a CPU, for it may go where that one may.
    ///
    /// # Errors
    /// When there is no thread to be had.
    pub fn start(priority: u8) -> io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let there = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("cpu-witness".to_owned())
            .spawn(move || {
                if priority > 0 {
                    // Where it is refused, so is the loop's own, which has been reported.
                    let _ = set_fifo(priority);
                }
                there.go_and_see();
            })?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Starts a new round of the thread, unless one is under way. Returns whether the last round was complete: then every CPU has run
    /// since the previous call.
    pub fn check(&self) -> bool {
        let asked = self.shared.asked.load(Ordering::Relaxed);
        if self.shared.seen.load(Ordering::Acquire) != asked {
            return false;
        }
        self.shared.asked.store(asked + 1, Ordering::Release);
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
        true
    }
}

impl Drop for CpuWitness {
    fn drop(&mut self) {
        self.shared.end.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // It has nothing to say about how it ended.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn go_and_see(&self) {
        while !self.end.load(Ordering::Acquire) {
            let asked = self.asked.load(Ordering::Acquire);
            if self.seen.load(Ordering::Relaxed) == asked {
                std::thread::park();
                continue;
            }
            visit_every_cpu();
            self.seen.store(asked, Ordering::Release);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_back_from_every_cpu_and_may_go_where_it_might_before() {
        let before = sched_getaffinity(THIS_THREAD).expect("can be read");
        visit_every_cpu();
        assert_eq!(sched_getaffinity(THIS_THREAD), Ok(before));
        let witness = CpuWitness::start(0).expect("a thread");
        assert!(witness.check(), "no round is under way yet");
        while !witness.check() {
            std::thread::yield_now();
        }
    }
}
