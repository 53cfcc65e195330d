//! The search for the highest sustained rate: runs the controller at one rate after the other, each for a short while.

use super::findings::{Findings, MAX_MISSED_FRACTION};
use super::settings::{Benchmark, POLL_INTERVAL};
use super::testbed::Testbed;
use crate::control::bus_allowed_ns;
use crate::failure::Failure;
use crate::latency::TickStats;
use crate::latency::outcome::RateTrial;
use crate::supervisor::child_process::Log;
use crate::topics::Hub;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::message::Timing;

/// The highest rate that can be configured, Hz.
const MAX_HZ: f64 = 10_000.0;

/// How long a rate is tried, after it has settled.
const TRIAL: Duration = Duration::from_secs(1);
const SETTLING: Duration = Duration::from_millis(300);

/// How often the range is halved: to within 1.5 % of three octaves.
const TRIALS: usize = 6;

/// Searches by bisection between the rate of the main measurement and the highest one; below the former where that was not
/// sustained.
pub(super) fn search(
    benchmark: &Benchmark,
    testbed: &mut Testbed,
    hub: &Hub,
    log: &Log,
    end: &AtomicBool,
    findings: &mut Findings,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<(), Failure> {
    let main = RateTrial::new(benchmark.config.control.rate_hz, &findings.ticks, 0);
    findings.rates.push(main);
    let (mut sustained_hz, mut missed_hz) = if main.sustained {
        (main.rate_hz, MAX_HZ)
    } else {
        (main.rate_hz / 10.0, main.rate_hz)
    };
    for number in 0..TRIALS {
        if end.load(Ordering::Relaxed) || missed_hz <= sustained_hz {
            break;
        }
        progress("trying other rates", 0.8 + 0.2 * number as f64 / TRIALS as f64);
        // Round numbers: a loop at 3162.3 Hz is of no use.
        let rate_hz = ((sustained_hz * missed_hz).sqrt() / 50.0).round() * 50.0;
        if rate_hz <= sustained_hz || rate_hz >= missed_hz {
            break;
        }
        testbed.restart_controller(benchmark, rate_hz, log, end)?;
        let trial = try_rate(rate_hz, benchmark.config.control.bus_wait_share, hub, end)?;
        if trial.sustained {
            sustained_hz = rate_hz;
        } else {
            missed_hz = rate_hz;
        }
        findings.rates.push(trial);
    }
    Ok(())
}

fn try_rate(rate_hz: f64, bus_wait_share: f64, hub: &Hub, end: &AtomicBool) -> Result<RateTrial, Failure> {
    let mut timings = hub.subscriber::<Timing>().map_err(Failure::failed)?;
    let mut stats = TickStats::default();
    // Late answers count as missing: they show that the rate is too high.
    let mut unanswered = 0;
    let begun = Instant::now();
    while begun.elapsed() < SETTLING + TRIAL && !end.load(Ordering::Relaxed) {
        std::thread::sleep(POLL_INTERVAL);
        let settled = begun.elapsed() >= SETTLING;
        while let Some(timing) = timings.next().map_err(Failure::failed)? {
            if settled {
                stats.take(&timing);
                let allowed_ns = bus_allowed_ns(bus_wait_share, timing.period_ns, timing.wake_lateness_ns);
                unanswered += u64::from(timing.bus_ns >= allowed_ns);
            }
        }
    }
    Ok(RateTrial::new(rate_hz, &stats, unanswered))
}

impl RateTrial {
    fn new(rate_hz: f64, stats: &TickStats, failed_exchanges: u64) -> Self {
        let (ticks, overruns) = (stats.ticks, stats.overruns);
        let allowed = ((ticks + overruns) as f64 * MAX_MISSED_FRACTION).ceil() as u64;
        Self {
            rate_hz,
            ticks,
            overruns,
            failed_exchanges,
            sustained: ticks > 0 && overruns <= allowed && failed_exchanges <= allowed,
        }
    }
}
