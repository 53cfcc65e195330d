//! The benchmark of `wormd latency`: a worm of its own, measured end to end beside the machine's own limit.
//!
//! - [`settings`]: the options, and the configuration that they make.
//! - [`testbed`]: the worm that is measured; [`stress`]: a load beside it.
//! - [`floor`] and [`ipc_baseline`]: the best that the machine and iceoryx2 can do; [`floor_process`] runs them beside the worm.
//! - [`busy_poll`]: subscribers that never sleep; [`cyclictest`]: the external reference.
//! - [`measurement`]: the run, step by step, into [`findings`]; [`rates`]: its search for the highest sustained rate.
//! - [`verdict`]: the [`Outcome`] from the findings.

mod busy_poll;
mod cyclictest;
mod findings;
pub(crate) mod floor;
mod floor_process;
pub(crate) mod ipc_baseline;
mod measurement;
mod rates;
mod settings;
mod stress;
mod testbed;
mod verdict;

pub(crate) use settings::{Benchmark, Options};

use crate::failure::Failure;
use crate::latency::Outcome;
use crate::print;
use crate::supervisor::child_process::Log;
use crate::topics::Instance;
use findings::Findings;
use std::sync::atomic::AtomicBool;

/// Runs the benchmark until it is complete or `end` is set. Returns the outcome of what was measured, and what cut it short, if
/// anything. `progress` gets the name of each stage and the completed fraction of the whole; it is dropped before any log is
/// printed.
///
/// # Errors
/// [`Failure::Unusable`] for a worm that cannot be used.
pub(crate) fn run(
    benchmark: &Benchmark,
    end: &AtomicBool,
    mut progress: impl FnMut(&str, f64),
) -> Result<(Outcome, Option<Failure>), Failure> {
    let instance = Instance::of(&benchmark.config).map_err(Failure::unusable)?;
    let log = Log::new();
    let mut findings = Findings::default();
    let problem = measurement::run(benchmark, &instance, &log, end, &mut findings, &mut progress).err();
    drop(progress);
    // The outcome covers what the processes log about late ticks: their log is printed only on request, or after a failure.
    if problem.is_some() || benchmark.options.verbose > 0 {
        log.lines.try_iter().for_each(print::log_line);
    }
    Ok((verdict::outcome(benchmark, findings, problem.as_ref()), problem))
}
