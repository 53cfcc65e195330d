//! The measurement itself: start, crawl, measure the loop, measure busy subscribers, try other rates, end.

use super::busy_poll::{self, BusySubscriber};
use super::findings::Findings;
use super::floor::{BaselineListener, FloorPlan};
use super::floor_process::FloorProcess;
use super::ipc_baseline::IpcBaseline;
use super::settings::{Benchmark, POLL_INTERVAL};
use super::stress::Stress;
use super::testbed::{Testbed, estimator_realtime};
use super::{cyclictest, rates};
use crate::failure::Failure;
use crate::latency::{Deliveries, Durations, TickStats};
use crate::realtime::{InForce, monotonic_ns};
use crate::supervisor::child_process::Log;
use crate::supervisor::telemetry_receiver::TelemetryReceiver;
use crate::topics::{Hub, Instance, Subscriber};
use crate::watch::Telemetry;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::message::Timing;
use worm_estimator::time::seconds;

/// How long the floor is measured when the loop cannot be.
const FLOOR_ALONE: Duration = Duration::from_secs(5);

/// Time for the process of the floor to start before it counts.
const FLOOR_START: Duration = Duration::from_millis(500);

/// Before the measurement.
const STARTING: Stage = ("starting", 0.0, 0.0);

/// Busy subscribers are measured for this fraction of the duration, within bounds.
const POLLED_FRACTION: f64 = 0.25;
const POLLED_MIN: Duration = Duration::from_secs(1);
const POLLED_MAX: Duration = Duration::from_secs(5);

/// An alarm that comes later than this after a block of the cam does not belong to it.
const MAX_ALARM_DELAY_NS: u64 = 1_000_000_000;

/// Measures into `findings`, step by step: what was measured before a failure stays. `progress` gets the name of the stage and
/// the completed fraction of the whole.
///
/// # Errors
/// [`Failure`] of the step that failed.
pub(super) fn run(
    benchmark: &Benchmark,
    instance: &Instance,
    log: &Log,
    end: &AtomicBool,
    findings: &mut Findings,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<(), Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let baseline = Arc::new(IpcBaseline::open(instance).map_err(Failure::failed)?);
    progress("starting", 0.0);
    // Before the worm, so that it already starts under the load.
    let _stress =
        match benchmark.options.load {
            true => Some(Stress::start(&std::env::temp_dir()).map_err(|error| {
                Failure::failed(format!("the load cannot be started: {error}: is TMPDIR writable?"))
            })?),
            false => None,
        };
    let mut testbed = match Testbed::start(benchmark, instance, log, end) {
        Ok(testbed) => testbed,
        Err(failure) => {
            measure_floor_alone(benchmark, instance.folder(), log, end, findings, progress)?;
            return Err(failure);
        }
    };
    if benchmark.config.port.is_none() {
        // Dropped before the measurement: every subscriber costs the publisher time.
        let mut receiver = TelemetryReceiver::open(&hub)?;
        let mut telemetry = Telemetry::default();
        let client = hub.command_client().map_err(Failure::failed)?;
        receiver
            .start_crawling(&client, &benchmark.config, &mut telemetry, end, || {
                testbed.find_ended().is_some()
            })
            .map_err(|failure| testbed.find_ended().map_or(failure, Failure::failed))?;
    } else {
        findings.warnings.push(
            "the benchmark neither moves nor blocks a real worm: it stays disarmed, and the time from stall to alarm is not \
             measured"
                .to_owned(),
        );
    }
    findings.in_force = InForce::of_process(testbed.controller.id()).ok();
    let measurement = Measurement {
        benchmark,
        log,
        end,
        testbed: &mut testbed,
        baseline: &baseline,
        findings,
        progress,
        timings: hub.subscriber().map_err(Failure::failed)?,
        deadline_ns: 0,
    };
    let mut outcome = measurement.measure();
    if outcome.is_ok() && benchmark.options.cyclictest && !end.load(Ordering::Relaxed) {
        progress("cyclictest", 0.8);
        match cyclictest::run(benchmark) {
            Ok(cyclictest) => findings.cyclictest = Some(cyclictest),
            Err(warning) => findings.warnings.push(warning),
        }
    }
    if outcome.is_ok() && benchmark.options.search_rates && !end.load(Ordering::Relaxed) {
        outcome = rates::search(benchmark, &mut testbed, &hub, log, end, findings, progress);
    }
    let alarms: Vec<u64> = testbed.stall_alarms.try_iter().collect();
    if let Some(crawl_began_ns) = testbed.end() {
        findings.alarm = alarm_latencies(&benchmark.stalls_s(), crawl_began_ns, &alarms);
    }
    outcome
}

/// The running measurement.
struct Measurement<'r> {
    benchmark: &'r Benchmark,
    log: &'r Log,
    end: &'r AtomicBool,
    testbed: &'r mut Testbed,
    baseline: &'r Arc<IpcBaseline>,
    findings: &'r mut Findings,
    progress: &'r mut dyn FnMut(&str, f64),
    timings: Subscriber<Timing>,
    /// The newest deadline of the loop, ns.
    deadline_ns: u64,
}

/// A stage for the progress bar: its name, and the fractions of the whole at which it begins and ends.
type Stage = (&'static str, f64, f64);

impl Measurement<'_> {
    /// Measures the loop with the floor beside it, and then busy subscribers.
    fn measure(mut self) -> Result<(), Failure> {
        self.poll_for(STARTING, self.benchmark.settling(), |_, _| {})?;
        let baseline_listener =
            BaselineListener::start(self.baseline, estimator_realtime(&self.benchmark.config.realtime))
                .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        let plan = floor_plan(self.benchmark, self.deadline_ns, self.benchmark.options.duration);
        let mut floor = FloorProcess::start(self.testbed.config(), &plan, self.log, self.end)?;
        let left = Duration::from_nanos(plan.from_ns.saturating_sub(monotonic_ns()));
        self.poll_for(STARTING, left, |_, _| {})?;
        self.testbed.received.try_iter().for_each(drop);
        baseline_listener.count(true);
        let measured = self.measure_loop(&mut floor);
        baseline_listener.count(false);
        let polled = measured.and_then(|()| self.measure_busy_subscribers(floor.id()));
        self.findings.floor = floor.finish()?;
        self.findings.floor_delivery = baseline_listener.finish().map_err(Failure::failed)?.unwrap_or_default();
        polled
    }

    fn measure_loop(&mut self, floor: &mut FloorProcess) -> Result<(), Failure> {
        let (mut stats, mut deliveries) = (TickStats::default(), Deliveries::default());
        let (begun, cpu_before) = (Instant::now(), self.testbed.cpu_ns());
        let outcome = self.poll_for(
            ("measuring the loop", 0.0, 0.6),
            self.benchmark.options.duration,
            |testbed, timings| {
                for timing in timings {
                    stats.take(timing);
                    deliveries.take(timing);
                }
                for (sequence, received_ns) in testbed.received.try_iter() {
                    deliveries.received(sequence, received_ns);
                }
                floor.follow(testbed.controller.id());
            },
        );
        let cpu = self.testbed.cpu_ns();
        let findings = &mut self.findings;
        findings.measured_s = seconds(begun.elapsed().as_nanos() as u64);
        let fraction = |before: u64, after: u64| seconds(after.saturating_sub(before)) / findings.measured_s;
        findings.controller_cpu_share = fraction(cpu_before.0, cpu.0);
        findings.estimator_cpu_share = fraction(cpu_before.1, cpu.1);
        findings.ticks = stats;
        findings.delivery = deliveries.durations;
        outcome
    }

    /// Measures subscribers that never sleep. Not together with the loop, because they use a whole CPU. Loop and floor are kept off
    /// that CPU, as in a deployment that uses such a subscriber.
    fn measure_busy_subscribers(&mut self, floor_pid: u32) -> Result<(), Failure> {
        let cpu = match self.benchmark.options.load {
            true => Err("under load they have no CPU of their own"),
            false => busy_poll::reserve_cpu([self.testbed.controller.id(), floor_pid])
                .ok_or("they need a CPU of their own, beside that of the loop"),
        };
        let cpu = match cpu {
            Ok(cpu) => cpu,
            Err(why) => {
                let warning = format!("busy subscribers were not measured: {why}");
                self.findings.warnings.push(warning);
                return Ok(());
            }
        };
        let duration = self
            .benchmark
            .options
            .duration
            .mul_f64(POLLED_FRACTION)
            .clamp(POLLED_MIN, POLLED_MAX);
        let subscriber = BusySubscriber::start(&self.testbed.instance, self.baseline, cpu)?;
        let mut deliveries = Deliveries::default();
        let outcome = self.poll_for(("measuring busy subscribers", 0.6, 0.8), duration, |_, timings| {
            timings.iter().for_each(|timing| deliveries.take(timing));
            for (sequence, received_ns) in subscriber.received.try_iter() {
                deliveries.received(sequence, received_ns);
            }
        });
        self.findings.floor_polled_delivery = subscriber.finish()?;
        self.findings.polled_delivery = deliveries.durations;
        outcome
    }

    /// Polls the loop's timings for `duration`, passes them to `take`, and reports the progress. Returns early when `end` is set.
    ///
    /// # Errors
    /// [`Failure::Failed`] when a process has ended.
    fn poll_for(
        &mut self,
        (stage, from, to): Stage,
        duration: Duration,
        mut take: impl FnMut(&Testbed, &[Timing]),
    ) -> Result<(), Failure> {
        let begun = Instant::now();
        let mut timings = Vec::new();
        while begun.elapsed() < duration && !self.end.load(Ordering::Relaxed) {
            std::thread::sleep(POLL_INTERVAL);
            timings.clear();
            while let Some(timing) = self.timings.next().map_err(Failure::failed)? {
                timings.push(*timing);
            }
            self.deadline_ns = timings.last().map_or(self.deadline_ns, |timing| timing.deadline_ns);
            take(self.testbed, &timings);
            let fraction = begun.elapsed().div_duration_f64(duration);
            (self.progress)(stage, from + fraction * (to - from));
            if let Some(how) = self.testbed.find_ended() {
                return Err(Failure::failed(format!(
                    "{how}; only what was measured before is reported"
                )));
            }
        }
        Ok(())
    }
}

/// The plan of a floor beside a loop with this deadline, which counts for `duration` once it has started.
fn floor_plan(benchmark: &Benchmark, loop_deadline_ns: u64, duration: Duration) -> FloorPlan {
    let from_ns = monotonic_ns() + FLOOR_START.as_nanos() as u64;
    FloorPlan {
        rate_hz: benchmark.config.control.rate_hz,
        loop_deadline_ns,
        from_ns,
        until_ns: from_ns + duration.as_nanos() as u64,
    }
}

/// Measures the floor when there is no loop to compare with.
fn measure_floor_alone(
    benchmark: &Benchmark,
    folder: &Path,
    log: &Log,
    end: &AtomicBool,
    findings: &mut Findings,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<(), Failure> {
    let plan = floor_plan(benchmark, monotonic_ns(), benchmark.options.duration.min(FLOOR_ALONE));
    let file = benchmark.file(folder)?;
    let floor = FloorProcess::start(file.path(), &plan, log, end)?;
    while monotonic_ns() < plan.until_ns && !end.load(Ordering::Relaxed) {
        progress("measuring the bare sleeper alone", 0.5);
        std::thread::sleep(POLL_INTERVAL);
    }
    findings.floor = floor.finish()?;
    Ok(())
}

/// How long each block of the cam took to wake the alarm listener.
fn alarm_latencies(stalls_s: &[f64], crawl_began_ns: u64, alarms: &[u64]) -> Durations {
    let mut latencies = Durations::default();
    for stall_s in stalls_s {
        let blocked_ns = crawl_began_ns + (stall_s * 1e9) as u64;
        let alarm = alarms
            .iter()
            .find(|&&alarm_ns| alarm_ns > blocked_ns && alarm_ns < blocked_ns + MAX_ALARM_DELAY_NS);
        if let Some(alarm_ns) = alarm {
            latencies.record(alarm_ns - blocked_ns);
        }
    }
    latencies
}
