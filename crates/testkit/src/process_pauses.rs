//! A computer that pauses, made by hand: processes of a worm are stopped and go on, at random moments.
//!
//! A stopped process cannot tell that it was not its computer that stood still. Used by the tests with processes and by the
//! benchmark of the same name. Only processes that the caller has started are ever signalled, and their children.

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Priority at which pauses are made where the system allows it, above all of the worm's: a pause must end when it is over.
const PRIORITY: i32 = 95;
/// How often the thread looks whether it is still wanted.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// What is stopped, and for how long.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pause {
    /// All processes together, for so many ms.
    Together(Range<u64>),
    /// One of them, for so many ms.
    OneOf(Range<u64>),
}

/// Processes that pause now and then, as long as this lives.
pub struct HostPauses {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    /// Held while processes are stopped, so that none is reaped meanwhile whose number another process could get.
    processes: Mutex<Vec<Pid>>,
    end: AtomicBool,
    made: AtomicU64,
}

impl HostPauses {
    /// Makes pauses drawn from `kinds`, `between` apart (ms), of the processes that are added, or of their children where they have
    /// some.
    pub fn start(kinds: Vec<Pause>, between: Range<u64>, seed: u64) -> Self {
        let shared = Arc::new(Shared {
            processes: Mutex::new(Vec::new()),
            end: AtomicBool::new(false),
            made: AtomicU64::new(0),
        });
        let for_thread = Arc::clone(&shared);
        let thread = std::thread::spawn(move || make_pauses(&for_thread, &kinds, &between, seed));
        Self {
            shared,
            thread: Some(thread),
        }
    }

    /// The processes, of which none pauses while this is held.
    pub fn processes(&self) -> MutexGuard<'_, Vec<Pid>> {
        self.shared
            .processes
            .lock()
            .expect("the thread that pauses does not panic")
    }

    /// Pauses that were made so far.
    pub fn made(&self) -> u64 {
        self.shared.made.load(Ordering::Relaxed)
    }
}

impl Drop for HostPauses {
    fn drop(&mut self) {
        self.shared.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // Whoever drops it may be panicking already.
            let _ = thread.join();
        }
    }
}

fn make_pauses(shared: &Shared, kinds: &[Pause], between: &Range<u64>, seed: u64) {
    raise_priority();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    loop {
        let next = Instant::now() + Duration::from_millis(rng.random_range(between.clone()));
        while Instant::now() < next {
            if shared.end.load(Ordering::Relaxed) {
                return;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        let processes = shared.processes.lock().expect("no holder panics");
        let mut stopped = running(&processes);
        if stopped.is_empty() {
            continue;
        }
        let ms = match &kinds[rng.random_range(0..kinds.len())] {
            Pause::Together(ms) => ms,
            Pause::OneOf(ms) => {
                stopped = vec![stopped[rng.random_range(0..stopped.len())]];
                ms
            }
        };
        signal(&stopped, Signal::SIGSTOP);
        std::thread::sleep(Duration::from_millis(rng.random_range(ms.clone())));
        signal(&stopped, Signal::SIGCONT);
        shared.made.fetch_add(1, Ordering::Relaxed);
    }
}

/// Real-time priority, where the system allows it.
fn raise_priority() {
    let parameters = libc::sched_param {
        sched_priority: PRIORITY,
    };
    // SAFETY: the pointer is to a live sched_param; pid 0 is the calling thread. A refusal leaves everything as it is.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
}

/// The processes that do the worm's work: each one, or its children where it has some.
fn running(processes: &[Pid]) -> Vec<Pid> {
    processes
        .iter()
        .flat_map(|&pid| {
            let children = children(pid);
            if children.is_empty() { vec![pid] } else { children }
        })
        .collect()
}

fn children(pid: Pid) -> Vec<Pid> {
    std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children"))
        .unwrap_or_default()
        .split_whitespace()
        .filter_map(|number| number.parse().ok().map(Pid::from_raw))
        .collect()
}

fn signal(processes: &[Pid], signal: Signal) {
    for &pid in processes {
        // It may have ended meanwhile.
        let _ = kill(pid, signal);
    }
}
