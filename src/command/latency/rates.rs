//! Which rate can be kept: the controller is run at one rate after the other, each for a short while.

use super::bench::Bench;
use super::measure::{Findings, LOOK};
use super::testbed::Testbed;
use crate::command::Failure;
use crate::command::child_process::Log;
use crate::command::progress::Progress;
use crate::control::bus_allowed_ns;
use crate::latency::TickStats;
use crate::latency::outcome::RateTrial;
use crate::topics::Hub;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::message::Timing;

/// The highest rate that can be configured, Hz.
const HIGHEST_HZ: f64 = 10_000.0;

/// A rate counts as kept when at most this share of its deadlines is missed, and this share of its exchanges fails.
pub(super) const MISSED_FRACTION: f64 = 0.01;

/// How long a rate is tried, after it has come to rest.
const TRIAL: Duration = Duration::from_secs(1);
const SETTLING: Duration = Duration::from_millis(300);

/// How often the range is halved: to within 1.5 % of three octaves.
const TRIALS: usize = 6;

/// Looks for the highest rate between that of the main measurement and the highest there is; below it where that one was not
/// kept.
pub(super) fn search(
    bench: &Bench,
    testbed: &mut Testbed,
    hub: &Hub,
    log: &Log,
    end: &AtomicBool,
    findings: &mut Findings,
    progress: &mut Progress,
) -> Result<(), Failure> {
    let main = RateTrial::new(bench.config.control.rate_hz, &findings.account, 0);
    findings.rates.push(main);
    let (mut kept, mut missed) = if main.sustained {
        (main.rate_hz, HIGHEST_HZ)
    } else {
        (main.rate_hz / 10.0, main.rate_hz)
    };
    for number in 0..TRIALS {
        if end.load(Ordering::Relaxed) || missed <= kept {
            break;
        }
        progress.tell("trying other rates", 0.8 + 0.2 * number as f64 / TRIALS as f64);
        // Round numbers: nobody runs a loop at 3162.3 Hz.
        let rate_hz = ((kept * missed).sqrt() / 50.0).round() * 50.0;
        if rate_hz <= kept || rate_hz >= missed {
            break;
        }
        testbed.restart_controller(bench, rate_hz, log, end)?;
        let trial = try_rate(rate_hz, bench.config.control.bus_wait_share, hub, end)?;
        if trial.sustained {
            kept = rate_hz;
        } else {
            missed = rate_hz;
        }
        findings.rates.push(trial);
    }
    Ok(())
}

fn try_rate(rate_hz: f64, bus_wait_share: f64, hub: &Hub, end: &AtomicBool) -> Result<RateTrial, Failure> {
    let mut timings = hub.subscriber::<Timing>().map_err(Failure::failed)?;
    let mut account = TickStats::default();
    let mut unanswered = 0; // in time: answers that come late show a rate that is too high
    let begun = Instant::now();
    while begun.elapsed() < SETTLING + TRIAL && !end.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
        let settled = begun.elapsed() >= SETTLING;
        while let Some(timing) = timings.next().map_err(Failure::failed)? {
            if settled {
                account.take(&timing);
                let allowed_ns = bus_allowed_ns(bus_wait_share, timing.period_ns, timing.wake_lateness_ns);
                unanswered += u64::from(timing.bus_ns >= allowed_ns);
            }
        }
    }
    Ok(RateTrial::new(rate_hz, &account, unanswered))
}

impl RateTrial {
    fn new(rate_hz: f64, account: &TickStats, failed_exchanges: u64) -> Self {
        let (ticks, overruns) = (account.ticks, account.overruns);
        let allowed = ((ticks + overruns) as f64 * MISSED_FRACTION).ceil() as u64;
        Self {
            rate_hz,
            ticks,
            overruns,
            failed_exchanges,
            sustained: ticks > 0 && overruns <= allowed && failed_exchanges <= allowed,
        }
    }
}
