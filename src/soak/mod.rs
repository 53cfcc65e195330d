//! Many hours in virtual time with drawn worms and drawn faults: do the alarms tell the truth, and does every invariant hold?
//!
//! A run is cut into segments of [`SEGMENT_S`]. Segment K of seed S is always the same: a worm is drawn ([`worm`]), crawls, holds, turns
//! round and rests as an operator would have it, for minutes without a fault; then a fault is drawn ([`draw`]) in kind, severity,
//! moment and duration, the operator removes it, resets, and crawls on ([`segment`]). Meanwhile every tick is held against the
//! [`invariants`], every alarm against the fault that may have caused it, and the energy of every cycle against the virtual worm's
//! ledger.
//!
//! All of it is the product's own code: the devices of [`crate::link::virtual_worm`] behind the real packet codec ([`machine`]), the
//! controller's tick and the estimator, wired in [`session`] as the processes are. The tests in virtual time use the same session.
//!
//! # What counts as what
//! - An alarm is **true** when the fault under way, or one that ended less than [`draw::AFTERMATH_CYCLES`] gait cycles ago, may cause its
//!   kind; otherwise it is **false**.
//! - A fault that must be noticed is **missed** when neither an alarm nor a fault of the controller that may follow from it came
//!   while it lasted, and **late** when the first came after its bound. Which follow from what, and the bounds, stand in one
//!   table, in [`draw`]. Faults too mild to be noticed for certain are only judged by what must not follow.

pub mod draw;
pub mod invariants;
pub mod machine;
pub mod report;
pub mod segment;
pub mod session;
pub mod worm;

pub use machine::{Exchange, Machine, MachineError, Served, Wired};
pub use report::{Finding, SoakReport};
pub use session::{Paused, Session, Tick};

use report::Tally;
use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Length of a segment, s.
pub const SEGMENT_S: f64 = 1800.0;
/// Ticks per second. Slower than a worm's loop, so that hours pass in seconds.
pub const RATE_HZ: f64 = 250.0;
/// Length of the plant's steps, s.
pub const STEP_S: f64 = 2e-3;

/// Which segments to run.
#[derive(Debug, Clone, Copy)]
pub struct SoakOptions {
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Number of the first segment.
    pub first: u64,
    /// How many segments.
    pub segments: u64,
}

impl SoakOptions {
    /// As many segments as make this many hours, and at least one.
    pub fn hours(seed: u64, hours: f64) -> Self {
        Self {
            seed,
            first: 0,
            segments: (hours * 3600.0 / SEGMENT_S).ceil().max(1.0) as u64,
        }
    }

    /// The rest of them, from a segment on; none if it is past the end.
    #[must_use]
    pub fn from_segment(self, first: u64) -> Self {
        Self {
            first: self.first + first,
            segments: self.segments.saturating_sub(first),
            ..self
        }
    }
}

/// How far a run has come.
#[derive(Debug, Clone, Copy)]
pub struct RunProgress<'a> {
    /// Segments that are done.
    pub done: u64,
    /// Every segment before this one is done: a run that is killed here is continued with it.
    pub continue_with: u64,
    /// The segment that was done just now.
    pub newest: &'a Tally,
}

/// What the cores share.
#[derive(Default)]
struct Done {
    tallies: Vec<Tally>,
    /// The first segment that is not done.
    next: u64,
    /// Those after it that are.
    ahead: BTreeSet<u64>,
}

impl Done {
    fn take(&mut self, tally: Tally) {
        self.ahead.insert(tally.segment);
        self.tallies.push(tally);
        while self.ahead.remove(&self.next) {
            self.next += 1;
        }
    }
}

/// Runs the segments on all cores. `progress` is called after each, one call at a time; it says whether to go on.
pub fn run(options: &SoakOptions, progress: impl Fn(&RunProgress<'_>) -> bool + Sync) -> SoakReport {
    let began = Instant::now();
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let next = AtomicU64::new(0);
    let done = Mutex::new(Done {
        next: options.first,
        ..Done::default()
    });
    std::thread::scope(|scope| {
        for _ in 0..cores.min(usize::try_from(options.segments).unwrap_or(cores)) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= options.segments {
                        return;
                    }
                    let tally = segment::run(options.seed, options.first + index);
                    // A thread that panicked leaves what it had pushed, and its panic ends the scope.
                    let mut done = done.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    done.take(tally);
                    let goes_on = done.tallies.last().is_none_or(|newest| {
                        progress(&RunProgress {
                            done: done.tallies.len() as u64,
                            continue_with: done.next,
                            newest,
                        })
                    });
                    if !goes_on {
                        next.store(options.segments, Ordering::Relaxed);
                    }
                }
            });
        }
    });
    let done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut tallies = done.tallies;
    tallies.sort_by_key(|tally| tally.segment);
    SoakReport::of(options.seed, &tallies, began.elapsed().as_secs_f64())
}
