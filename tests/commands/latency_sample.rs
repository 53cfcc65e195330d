//! A run of the latency benchmark as it could be: log-normal durations with rare long tails, from a seed.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, LogNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_estimator::message::Culprit;
use wormd::latency::outcome::{Cyclictest, RateTrial};
use wormd::latency::{Durations, HostPauses, Outcome, Tick, WorstTicks};
use wormd::realtime::machine::Setting;

const TICKS: u64 = 60_000;
const PERIOD_NS: u64 = 1_000_000;

/// A run in which nothing was measured.
pub fn nothing() -> Outcome {
    Outcome {
        headline: "Nothing was measured.".to_owned(),
        worm: "worm".to_owned(),
        port: "the virtual worm".to_owned(),
        rate_hz: 1000.0,
        duration_s: 0.0,
        load: false,
        ticks: 0,
        overruns: 0,
        overruns_of_product: 0,
        wake_us: Durations::default(),
        floor_wake_us: Durations::default(),
        period_us: Durations::default(),
        execution_us: Durations::default(),
        bus_us: Durations::default(),
        compute_us: Durations::default(),
        publish_us: Durations::default(),
        own_work_us: Durations::default(),
        notify_us: Durations::default(),
        floor_notify_us: Durations::default(),
        delivery_us: Durations::default(),
        floor_delivery_us: Durations::default(),
        polled_delivery_us: Durations::default(),
        floor_polled_delivery_us: Durations::default(),
        alarm_us: Durations::default(),
        culprits: Default::default(),
        host_pauses: host_pauses(),
        worst_ticks: WorstTicks::default(),
        controller_cpu_share: f64::NAN,
        floor_cpu_share: f64::NAN,
        estimator_cpu_share: f64::NAN,
        highest_rate_hz: None,
        rate_trials: Vec::new(),
        scheduler: "SCHED_OTHER".to_owned(),
        memory_locked: false,
        settings: Vec::new(),
        cyclictest: None,
        warnings: Vec::new(),
    }
}

/// A minute of a loop at 1 kHz on a virtual machine whose host takes the CPU away now and then.
pub fn outcome() -> Outcome {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let mut run = Outcome {
        headline:
            "The loop wakes 1.04 times as late as a bare sleeper at the median and 1.19 times at the 99th percentile; \
                   SCHED_FIFO was granted, locking of memory was refused."
                .to_owned(),
        worm: "crawler".to_owned(),
        port: "the virtual worm".to_owned(),
        duration_s: 60.0,
        load: true,
        ticks: TICKS,
        controller_cpu_share: 0.041,
        floor_cpu_share: 0.012,
        estimator_cpu_share: 0.063,
        highest_rate_hz: Some(2000.0),
        rate_trials: rate_trials(),
        scheduler: "SCHED_FIFO 80".to_owned(),
        settings: settings(),
        cyclictest: Some(Cyclictest {
            command: "cyclictest --mlockall --priority=80 --interval=1000 --quiet --duration=10".to_owned(),
            min_us: 3.0,
            mean_us: 51.0,
            max_us: 2873.0,
        }),
        warnings: vec![
            "This is a virtual machine: the host can take the CPU away at any time, and no setting within it helps."
                .to_owned(),
            "Two CPUs are shared by the loop, the virtual worm, the estimator and the load.".to_owned(),
        ],
        ..nothing()
    };
    for sequence in 0..TICKS {
        count(&mut run, &mut random, sequence);
    }
    for _ in 0..20 {
        run.alarm_us.record(log_normal(&mut random, 38e6, 0.3));
    }
    run
}

fn log_normal(random: &mut Xoshiro256PlusPlus, median_ns: f64, sigma: f64) -> u64 {
    let distribution = LogNormal::new(median_ns.ln(), sigma).expect("a distribution");
    distribution.sample(random) as u64
}

/// One tick with what was measured beside it.
fn count(run: &mut Outcome, random: &mut Xoshiro256PlusPlus, sequence: u64) {
    let mut sample = |median_ns: f64, sigma: f64| log_normal(random, median_ns, sigma);
    let floor_ns = sample(50e3, 0.28);
    let (mut wake_ns, mut bus_ns) = (sample(52e3, 0.29), sample(310e3, 0.06));
    let (mut compute_ns, mut publish_ns) = (sample(3.1e3, 0.15), sample(6.2e3, 0.2));
    let notify_ns = sample(5.2e3, 0.3);
    let tail_ns = sample(1.2e6, 0.7);
    let culprit = match random.random_range(0..20_000) {
        0..=6 => Culprit::Stolen,
        7..=9 => Culprit::Wake,
        10..=12 => Culprit::Scheduler,
        13..=14 => Culprit::Bus,
        15 => Culprit::Publish,
        16 => Culprit::PageFault,
        _ => Culprit::None,
    };
    match culprit {
        Culprit::None => {}
        Culprit::Bus => bus_ns += tail_ns,
        Culprit::Publish => publish_ns += tail_ns,
        Culprit::PageFault => compute_ns += tail_ns,
        _ => wake_ns += tail_ns,
    }
    let us = |ns: u64| ns as f64 * 1e-3;
    let total_ns = wake_ns + bus_ns + compute_ns + publish_ns + notify_ns;
    let late = total_ns > PERIOD_NS;
    let if_by = |blamed: Culprit| if late && culprit == blamed { us(tail_ns) } else { 0.0 };
    if late {
        run.overruns += total_ns / PERIOD_NS;
        *run.culprits.entry(culprit.name()).or_default() += 1;
        run.overruns_of_product += u64::from(matches!(culprit, Culprit::Compute | Culprit::Publish));
    }
    run.worst_ticks.consider(Tick {
        sequence,
        wake_us: us(wake_ns),
        bus_us: us(bus_ns),
        compute_us: us(compute_ns),
        publish_us: us(publish_ns),
        notify_us: us(notify_ns),
        waited_us: if_by(Culprit::Scheduler),
        stolen_us: (if_by(Culprit::Stolen) / 1e4).ceil() * 1e4,
        page_faults: u32::from(culprit == Culprit::PageFault) * 3,
        late,
        culprit: if late { culprit } else { Culprit::Bus },
    });
    run.wake_us.record_due(wake_ns, PERIOD_NS);
    let floor_tail_ns = if random.random_range(0..3000) == 0 { tail_ns } else { 0 };
    run.floor_wake_us.record_due(floor_ns + floor_tail_ns, PERIOD_NS);
    let mut sample = |median_ns: f64, sigma: f64| log_normal(random, median_ns, sigma);
    run.period_us.record(if late {
        2 * PERIOD_NS
    } else {
        PERIOD_NS + wake_ns - 52_000.min(wake_ns)
    });
    run.execution_us.record(total_ns - wake_ns);
    run.bus_us.record(bus_ns);
    run.compute_us.record(compute_ns);
    run.publish_us.record(publish_ns);
    run.own_work_us.record(compute_ns + publish_ns);
    run.notify_us.record(notify_ns);
    run.floor_notify_us.record(sample(4.8e3, 0.3));
    run.delivery_us.record(sample(41e3, 0.4) + publish_ns);
    run.floor_delivery_us.record(sample(38e3, 0.4));
    run.polled_delivery_us.record(sample(640.0, 0.2));
    run.floor_polled_delivery_us.record(sample(600.0, 0.2));
}

fn rate_trials() -> Vec<RateTrial> {
    [(1000.0, 5000, 1), (2000.0, 10_000, 7), (4000.0, 19_216, 784)]
        .map(|(rate_hz, ticks, overruns)| RateTrial {
            rate_hz,
            ticks,
            overruns,
            failed_exchanges: overruns / 2,
            sustained: rate_hz < 3000.0,
        })
        .to_vec()
}

fn settings() -> Vec<Setting> {
    [
        ("scheduler of the loop", "SCHED_FIFO, priority 80", None),
        (
            "memory",
            "not locked: RLIMIT_MEMLOCK is 8388608 bytes",
            Some("raise LimitMEMLOCK of the service, or memlock in /etc/security/limits.conf, to unlimited"),
        ),
        ("CPU of the loop", "1, which it shares with nobody of wormd", None),
        (
            "kernel",
            "6.1.0 with voluntary preemption only (PREEMPT_DYNAMIC)",
            Some(
                "boot with preempt=full, or install a kernel with PREEMPT_RT, whose wake-ups are bounded by design and not only \
                 on average",
            ),
        ),
        ("throttling of real-time tasks", "950000 of 1000000 µs", None),
    ]
    .map(|(subject, found, remedy)| Setting {
        subject,
        found: found.to_owned(),
        good: remedy.is_none(),
        remedy: remedy.map(str::to_owned),
    })
    .to_vec()
}

fn host_pauses() -> HostPauses {
    let mut pauses = HostPauses::default();
    for ms in [22, 51, 12] {
        pauses.add(ms * 1_000_000);
    }
    pauses
}
