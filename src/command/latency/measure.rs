//! The run itself: start, crawl, measure, look at busy subscribers, try other rates, end.

use super::bench::Bench;
use super::busy_poll::{self, Polling};
use super::floor::Floor;
use super::testbed::{Testbed, estimator_realtime};
use super::{cyclictest, rates, verdict};
use crate::command::child_process::Log;
use crate::command::progress::Progress;
use crate::command::telemetry_receiver::TelemetryReceiver;
use crate::command::{Failure, print};
use crate::latency::floor::{BareListener, FloorOutcome, FloorPlan};
use crate::latency::ipc_baseline::Bare;
use crate::latency::outcome::{Cyclictest, RateTrial};
use crate::latency::stress::Stress;
use crate::latency::{Deliveries, Durations, Outcome, TickStats};
use crate::realtime::{InForce, monotonic_ns};
use crate::topics::{Hub, Instance, Subscriber};
use crate::watch::Telemetry;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::message::Timing;

/// How often what the loop tells is taken: as seldom as the topic's buffer allows at any rate, for every wake of this process may
/// interrupt the loop.
pub(super) const LOOK: Duration = Duration::from_millis(20);

/// How long the floor is measured where there is no loop to measure.
const FLOOR_ALONE: Duration = Duration::from_secs(5);

/// How long the process of the floor may take to start before it counts.
const FLOOR_START: Duration = Duration::from_millis(500);

/// What is not measured yet.
const STARTING: Stage = ("starting", 0.0, 0.0);

/// Share of the duration in which subscribers that never sleep are looked at, within bounds.
const POLLED_FRACTION: f64 = 0.25;
const POLLED_LEAST: Duration = Duration::from_secs(1);
const POLLED_MOST: Duration = Duration::from_secs(5);

/// An alarm that comes later than this after the cam was blocked is none of that block.
const ALARM_WITHIN_NS: u64 = 1_000_000_000;

/// Everything that was measured.
#[derive(Default)]
pub(super) struct Findings {
    pub(super) account: TickStats,
    pub(super) floor: FloorOutcome,
    pub(super) floor_delivery: Durations,
    pub(super) delivery: Durations,
    pub(super) polled_delivery: Durations,
    pub(super) floor_polled_delivery: Durations,
    pub(super) alarm: Durations,
    pub(super) measured_s: f64,
    pub(super) controller_cpu_share: f64,
    pub(super) estimator_cpu_share: f64,
    pub(super) in_force: Option<InForce>,
    pub(super) rates: Vec<RateTrial>,
    pub(super) cyclictest: Option<Cyclictest>,
    pub(super) warnings: Vec<String>,
}

/// Measures. What fails on the way is told beside what was measured all the same.
pub(super) fn run(bench: &Bench, end: &AtomicBool) -> Result<(Outcome, Option<Failure>), Failure> {
    let instance = Instance::of(&bench.config).map_err(Failure::unusable)?;
    let log = Log::new();
    let mut findings = Findings::default();
    let trouble = measure(bench, &instance, &log, end, &mut findings).err();
    // What the processes say of late ticks is told by the outcome. Only who asks, or wonders what went wrong, wants their words.
    if trouble.is_some() || bench.verbose > 0 {
        log.lines.try_iter().for_each(print::log_line);
    }
    Ok((verdict::outcome(bench, findings, trouble.as_ref()), trouble))
}

fn measure(
    bench: &Bench,
    instance: &Instance,
    log: &Log,
    end: &AtomicBool,
    findings: &mut Findings,
) -> Result<(), Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let bare = Arc::new(Bare::open(instance).map_err(Failure::failed)?);
    let mut progress = Progress::begin();
    progress.tell("starting", 0.0);
    // Before the worm, so that it begins under the load that it is measured under.
    let _stress =
        match bench.load {
            true => Some(Stress::start(&std::env::temp_dir()).map_err(|error| {
                Failure::failed(format!("the load cannot be started: {error}: is TMPDIR writable?"))
            })?),
            false => None,
        };
    let mut testbed = match Testbed::start(bench, instance, log, end) {
        Ok(testbed) => testbed,
        Err(failure) => {
            measure_floor_alone(bench, instance.folder(), log, end, findings, &mut progress)?;
            return Err(failure);
        }
    };
    if bench.config.port.is_none() {
        // Gone before it is measured: every subscriber costs the publisher something.
        let mut receiver = TelemetryReceiver::open(&hub)?;
        let mut telemetry = Telemetry::default();
        let client = hub.command_client().map_err(Failure::failed)?;
        receiver
            .start_crawling(&client, &bench.config, &mut telemetry, end, || {
                testbed.find_ended().is_some()
            })
            .map_err(|failure| testbed.find_ended().map_or(failure, Failure::failed))?;
    } else {
        findings.warnings.push(
            "a real worm is neither made to crawl nor blocked by a benchmark: it stays disarmed, and the way from stall to alarm \
             is not measured"
                .to_owned(),
        );
    }
    findings.in_force = InForce::of_process(testbed.controller.id()).ok();
    let run = Measurement {
        bench,
        log,
        end,
        testbed: &mut testbed,
        bare: &bare,
        findings,
        progress: &mut progress,
        timings: hub.subscriber().map_err(Failure::failed)?,
        deadline_ns: 0,
    };
    let mut outcome = run.measure();
    if outcome.is_ok() && bench.cyclictest && !end.load(Ordering::Relaxed) {
        progress.tell("cyclictest", 0.8);
        match cyclictest::run(bench) {
            Ok(cyclictest) => findings.cyclictest = Some(cyclictest),
            Err(warning) => findings.warnings.push(warning),
        }
    }
    if outcome.is_ok() && bench.searches_rates && !end.load(Ordering::Relaxed) {
        outcome = rates::search(bench, &mut testbed, &hub, log, end, findings, &mut progress);
    }
    let alarms: Vec<u64> = testbed.stall_alarms.try_iter().collect();
    if let Some(crawl_began_ns) = testbed.end() {
        findings.alarm = alarm_latencies(&bench.stalls_s(), crawl_began_ns, &alarms);
    }
    outcome
}

/// The running measurement.
struct Measurement<'r> {
    bench: &'r Bench,
    log: &'r Log,
    end: &'r AtomicBool,
    testbed: &'r mut Testbed,
    bare: &'r Arc<Bare>,
    findings: &'r mut Findings,
    progress: &'r mut Progress,
    timings: Subscriber<Timing>,
    /// The newest deadline of the loop, ns.
    deadline_ns: u64,
}

/// A part of the run for whoever waits for it: its name, and the shares of everything at which it begins and ends.
type Stage = (&'static str, f64, f64);

impl Measurement<'_> {
    /// The loop with the floor beside it, and then subscribers that never sleep.
    fn measure(mut self) -> Result<(), Failure> {
        self.go_on(STARTING, self.bench.settling(), |_, _| {})?;
        let bare_listener = BareListener::start(self.bare, estimator_realtime(&self.bench.config.realtime))
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        let plan = floor_plan(self.bench, self.deadline_ns, self.bench.duration);
        let mut floor = Floor::start(self.testbed.config(), &plan, self.log, self.end)?;
        let left = Duration::from_nanos(plan.from_ns.saturating_sub(monotonic_ns()));
        self.go_on(STARTING, left, |_, _| {})?;
        self.testbed.heard.try_iter().for_each(drop);
        bare_listener.count(true);
        let measured = self.measure_loop(&mut floor);
        bare_listener.count(false);
        let polled = measured.and_then(|()| self.look_at_busy_subscribers(floor.id()));
        self.findings.floor = floor.finish()?;
        self.findings.floor_delivery = bare_listener.finish().map_err(Failure::failed)?.unwrap_or_default();
        polled
    }

    fn measure_loop(&mut self, floor: &mut Floor) -> Result<(), Failure> {
        let (mut account, mut deliveries) = (TickStats::default(), Deliveries::default());
        let (begun, cpu_before) = (Instant::now(), self.testbed.cpu_ns());
        let outcome = self.go_on(
            ("measuring the loop", 0.0, 0.6),
            self.bench.duration,
            |testbed, timings| {
                for timing in timings {
                    account.take(timing);
                    deliveries.take(timing);
                }
                for (sequence, received_ns) in testbed.heard.try_iter() {
                    deliveries.received(sequence, received_ns);
                }
                floor.follow(testbed.controller.id());
            },
        );
        let cpu = self.testbed.cpu_ns();
        let findings = &mut self.findings;
        findings.measured_s = begun.elapsed().as_secs_f64();
        let fraction = |before: u64, after: u64| after.saturating_sub(before) as f64 * 1e-9 / findings.measured_s;
        findings.controller_cpu_share = fraction(cpu_before.0, cpu.0);
        findings.estimator_cpu_share = fraction(cpu_before.1, cpu.1);
        findings.account = account;
        findings.delivery = deliveries.durations;
        outcome
    }

    /// How fast subscribers that never sleep are. Apart from the rest, for they take a whole CPU; loop and floor keep off it, as
    /// they would where somebody means to do this.
    fn look_at_busy_subscribers(&mut self, floor_pid: u32) -> Result<(), Failure> {
        let cpu = match self.bench.load {
            true => Err("under load they have no CPU of their own"),
            false => busy_poll::keep_off([self.testbed.controller.id(), floor_pid])
                .ok_or("they need a CPU of their own, beside that of the loop"),
        };
        let cpu = match cpu {
            Ok(cpu) => cpu,
            Err(why) => {
                let warning = format!("busy subscribers were not looked at: {why}");
                self.findings.warnings.push(warning);
                return Ok(());
            }
        };
        let duration = self
            .bench
            .duration
            .mul_f64(POLLED_FRACTION)
            .clamp(POLLED_LEAST, POLLED_MOST);
        let polling = Polling::start(&self.testbed.instance, self.bare, cpu)?;
        let mut deliveries = Deliveries::default();
        let outcome = self.go_on(("measuring busy subscribers", 0.6, 0.8), duration, |_, timings| {
            timings.iter().for_each(|timing| deliveries.take(timing));
            for (sequence, received_ns) in polling.heard.try_iter() {
                deliveries.received(sequence, received_ns);
            }
        });
        self.findings.floor_polled_delivery = polling.finish()?;
        self.findings.polled_delivery = deliveries.durations;
        outcome
    }

    /// Goes on for a while, hands over what the loop tells, and says how far it is; ends early when `end` is set, or a process
    /// has ended.
    fn go_on(
        &mut self,
        (stage, from, to): Stage,
        duration: Duration,
        mut look: impl FnMut(&Testbed, &[Timing]),
    ) -> Result<(), Failure> {
        let begun = Instant::now();
        let mut timings = Vec::new();
        while begun.elapsed() < duration && !self.end.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
            timings.clear();
            while let Some(timing) = self.timings.next().map_err(Failure::failed)? {
                timings.push(*timing);
            }
            self.deadline_ns = timings.last().map_or(self.deadline_ns, |timing| timing.deadline_ns);
            look(self.testbed, &timings);
            let fraction = begun.elapsed().div_duration_f64(duration);
            self.progress.tell(stage, from + fraction * (to - from));
            if let Some(how) = self.testbed.find_ended() {
                return Err(Failure::failed(format!("{how}; what was measured before it is told")));
            }
        }
        Ok(())
    }
}

/// A floor beside a loop with this deadline, which counts for `duration` as soon as it has started.
fn floor_plan(bench: &Bench, loop_deadline_ns: u64, duration: Duration) -> FloorPlan {
    let from_ns = monotonic_ns() + FLOOR_START.as_nanos() as u64;
    FloorPlan {
        rate_hz: bench.config.control.rate_hz,
        loop_deadline_ns,
        from_ns,
        until_ns: from_ns + duration.as_nanos() as u64,
    }
}

/// The floor, where there is no loop that it could be held against.
fn measure_floor_alone(
    bench: &Bench,
    folder: &Path,
    log: &Log,
    end: &AtomicBool,
    findings: &mut Findings,
    progress: &mut Progress,
) -> Result<(), Failure> {
    let plan = floor_plan(bench, monotonic_ns(), bench.duration.min(FLOOR_ALONE));
    let file = bench.file(folder)?;
    let floor = Floor::start(file.path(), &plan, log, end)?;
    while monotonic_ns() < plan.until_ns && !end.load(Ordering::Relaxed) {
        progress.tell("measuring the bare sleeper alone", 0.5);
        std::thread::sleep(LOOK);
    }
    findings.floor = floor.finish()?;
    Ok(())
}

/// How long each block of the cam took to wake a listener of the alarms.
fn alarm_latencies(stalls_s: &[f64], crawl_began_ns: u64, alarms: &[u64]) -> Durations {
    let mut latencies = Durations::default();
    for stall_s in stalls_s {
        let blocked_ns = crawl_began_ns + (stall_s * 1e9) as u64;
        let alarm = alarms
            .iter()
            .find(|&&alarm_ns| alarm_ns > blocked_ns && alarm_ns < blocked_ns + ALARM_WITHIN_NS);
        if let Some(alarm_ns) = alarm {
            latencies.record(alarm_ns - blocked_ns);
        }
    }
    latencies
}
