//! The outcome of a run of the latency benchmark. The JSON names are a published contract.

use super::histogram::Durations;
use super::tick_stats::HostPauses;
use super::timeline::WorstTicks;
use crate::realtime::machine::Setting;
use serde::Serialize;
use std::collections::BTreeMap;

/// A run of the benchmark in numbers. Every duration is an object of its percentiles in µs with the whole histogram, or null
/// where it was not measured.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// One line: how late the loop was against the machine's own limit, and what was refused.
    pub headline: String,
    /// Name of the worm.
    pub worm: String,
    /// The port, or "the virtual worm".
    pub port: String,
    /// Configured ticks per second.
    pub rate_hz: f64,
    /// Time that was measured, s.
    pub duration_s: f64,
    /// Whether the built-in load ran beside it.
    pub load: bool,
    /// Ticks that were run in that time.
    pub ticks: u64,
    /// Deadlines that passed without a tick.
    pub overruns: u64,
    /// Those of them caused by the tick's own computation or publishing.
    pub overruns_of_product: u64,
    /// How long after its deadline the loop ran.
    pub wake_us: Durations,
    /// How long after its deadline a bare sleeper of the same rate, priority and CPU ran, in the same run.
    pub floor_wake_us: Durations,
    /// Time from one tick's beginning to the next one's.
    pub period_us: Durations,
    /// The tick itself, from its beginning to its end: bus, computation, publishing, waking the listeners.
    pub execution_us: Durations,
    /// The bus exchange.
    pub bus_us: Durations,
    /// The tick's own computation.
    pub compute_us: Durations,
    /// Publishing.
    pub publish_us: Durations,
    /// Computation and publishing: all of a tick that is wormd's own.
    pub own_work_us: Durations,
    /// Waking the listeners: the event's system call.
    pub notify_us: Durations,
    /// The same call between a bare notifier and a bare listener in the same run.
    pub floor_notify_us: Durations,
    /// From before the state is published until the estimator, woken by its event, has received it.
    pub delivery_us: Durations,
    /// The same between a bare iceoryx2 publisher and subscriber, of the same payload, in the same run.
    pub floor_delivery_us: Durations,
    /// As `delivery_us`, to a subscriber that never sleeps.
    pub polled_delivery_us: Durations,
    /// As `floor_delivery_us`, to a subscriber that never sleeps.
    pub floor_polled_delivery_us: Durations,
    /// From the moment at which the cam is blocked until the alarm has woken a listener. Not measured on a real worm,
    /// which is not blocked.
    pub alarm_us: Durations,
    /// Late ticks by culprit.
    pub culprits: BTreeMap<&'static str, u64>,
    /// Pauses of the computer, of which the late ticks are part.
    pub host_pauses: HostPauses,
    /// The worst ticks, the worst first.
    pub worst_ticks: WorstTicks,
    /// Share of one CPU that the controller took, 0 to 1.
    pub controller_cpu_share: f64,
    /// Share of one CPU that the bare sleeper took, 0 to 1.
    pub floor_cpu_share: f64,
    /// Share of one CPU that the estimator took, 0 to 1.
    pub estimator_cpu_share: f64,
    /// The highest sustained rate; null where it was not searched for, or none was found.
    pub highest_rate_hz: Option<f64>,
    /// What was tried for that.
    pub rate_trials: Vec<RateTrial>,
    /// Scheduler and priority that the loop really had.
    pub scheduler: String,
    /// Whether the controller's memory was really locked.
    pub memory_locked: bool,
    /// The settings of the loop and of this computer, and whether they suit it.
    pub settings: Vec<Setting>,
    /// What cyclictest measured, if it was requested and is installed.
    pub cyclictest: Option<Cyclictest>,
    /// What to know when reading these numbers.
    pub warnings: Vec<String>,
}

/// One rate that was tried.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RateTrial {
    /// Ticks per second.
    pub rate_hz: f64,
    /// Ticks that were run.
    pub ticks: u64,
    /// Deadlines that passed without a tick.
    pub overruns: u64,
    /// Ticks in which the servo's answer was missing or too late.
    pub failed_exchanges: u64,
    /// Whether so few deadlines were missed that the rate counts as sustained.
    pub sustained: bool,
}

/// What cyclictest says of the machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cyclictest {
    /// How it was called.
    pub command: String,
    /// Smallest wake lateness, µs.
    pub min_us: f64,
    /// Mean wake lateness, µs.
    pub mean_us: f64,
    /// Largest wake lateness, µs.
    pub max_us: f64,
}
