//! The outcome of the benchmark from its findings, with headline and warnings.

use super::findings::{Findings, MAX_MISSED_FRACTION};
use super::settings::Benchmark;
use crate::failure::Failure;
use crate::latency::{Outcome, Percentiles, ratio};
use crate::realtime::{InForce, machine};

/// With fewer ticks the percentiles of the tail are meaningless.
const FEW_TICKS: u64 = 2_000;

/// The outcome. `problem` is what cut the measurement short, if anything.
pub(super) fn outcome(benchmark: &Benchmark, findings: Findings, problem: Option<&Failure>) -> Outcome {
    let mut warnings = Vec::new();
    if let Some(problem) = problem {
        warnings.push(problem.to_string());
    }
    let refused = refused(benchmark, findings.in_force.as_ref());
    warnings.extend(refused.iter().map(|what| format!("in force for the loop: {what}")));
    // The bare sleeper requested the same as the loop, and knows the reasons of the refusals.
    warnings.extend(findings.floor.refusals.iter().cloned());
    warnings.extend(findings.warnings.iter().cloned());
    let stats = &findings.ticks;
    let deadlines = stats.ticks + stats.overruns;
    if stats.ticks > 0 && stats.ticks < FEW_TICKS {
        warnings.push(format!(
            "only {} ticks were measured: the 99.9th percentile is little more than the largest value; give a longer --duration",
            stats.ticks
        ));
    }
    if stats.overruns as f64 > MAX_MISSED_FRACTION * deadlines as f64 {
        warnings.push(format!(
            "{} Hz is not met: {:.1} % of the deadlines were missed; try a lower --rate",
            benchmark.config.control.rate_hz,
            100.0 * stats.overruns as f64 / deadlines as f64
        ));
    }
    if benchmark.config.port.is_none() && stats.ticks > 0 && findings.alarm.is_empty() {
        warnings.push(match benchmark.stalls_s().len() {
            0 => "no alarm was measured: its first stall needs a --duration of 3 s".to_owned(),
            stalls => {
                format!("no alarm was measured: none came of {stalls} stall(s), too short for this gait or cut off")
            }
        });
    }
    let headline = headline(benchmark, &findings, &refused, problem);
    let highest_rate_hz = findings
        .rates
        .iter()
        .filter(|trial| trial.sustained)
        .map(|trial| trial.rate_hz)
        .reduce(f64::max);
    let mut settings = machine::settings(benchmark.config.realtime.cpu);
    if let Some(in_force) = &findings.in_force {
        settings.insert(0, in_force_setting(in_force, &refused));
    }
    // Without a measurement the shares are unknown.
    let fraction = |fraction: f64| if findings.measured_s > 0.0 { fraction } else { f64::NAN };
    let (controller_cpu_share, estimator_cpu_share) = (
        fraction(findings.controller_cpu_share),
        fraction(findings.estimator_cpu_share),
    );
    let Findings {
        ticks: stats, floor, ..
    } = findings;
    Outcome {
        headline,
        worm: benchmark.config.worm.name.clone(),
        port: benchmark
            .config
            .port
            .as_ref()
            .map_or("the virtual worm".to_owned(), |port| port.path.clone()),
        rate_hz: benchmark.config.control.rate_hz,
        duration_s: findings.measured_s,
        load: benchmark.options.load,
        ticks: stats.ticks,
        overruns: stats.overruns,
        overruns_of_product: stats.overruns_of_product,
        wake_us: stats.wake,
        floor_wake_us: floor.wake,
        period_us: stats.period,
        execution_us: stats.execution,
        bus_us: stats.bus,
        compute_us: stats.compute,
        publish_us: stats.publish,
        own_work_us: stats.own_work,
        notify_us: stats.notify,
        floor_notify_us: floor.notify,
        delivery_us: findings.delivery,
        floor_delivery_us: findings.floor_delivery,
        polled_delivery_us: findings.polled_delivery,
        floor_polled_delivery_us: findings.floor_polled_delivery,
        alarm_us: findings.alarm,
        culprits: stats.culprits,
        host_pauses: stats.host_pauses,
        worst_ticks: stats.worst,
        controller_cpu_share,
        floor_cpu_share: floor.cpu_share,
        estimator_cpu_share,
        highest_rate_hz,
        rate_trials: findings.rates,
        scheduler: findings
            .in_force
            .as_ref()
            .map_or("unknown".to_owned(), InForce::scheduler_text),
        memory_locked: findings
            .in_force
            .as_ref()
            .is_some_and(|in_force| in_force.memory_locked),
        settings,
        cyclictest: findings.cyclictest,
        warnings,
    }
}

/// What the loop was to get from the operating system and did not.
fn refused(benchmark: &Benchmark, in_force: Option<&InForce>) -> Vec<String> {
    in_force.map_or_else(Vec::new, |in_force| in_force.shortfalls(&benchmark.config.realtime, 0))
}

fn in_force_setting(in_force: &InForce, refused: &[String]) -> machine::Setting {
    let subject = "in force for the loop";
    if refused.is_empty() {
        machine::Setting::good(subject, in_force.to_string())
    } else {
        let remedy = format!(
            "less than asked for ({}): `wormd check` tells the remedy",
            refused.join("; ")
        );
        machine::Setting::bad(subject, in_force.to_string(), remedy)
    }
}

fn headline(benchmark: &Benchmark, findings: &Findings, refused: &[String], problem: Option<&Failure>) -> String {
    let stats = &findings.ticks;
    let floor = findings.floor.wake.percentiles();
    if stats.wake.is_empty() {
        let floor = match findings.floor.wake.is_empty() {
            true => String::new(),
            false => format!(
                "; a bare sleeper wakes {:.1} µs late (p50), {:.1} µs (p99)",
                floor.p50, floor.p99
            ),
        };
        let why = problem.map_or("no tick was measured".to_owned(), ToString::to_string);
        return format!("THE LOOP WAS NOT MEASURED: {why}{floor}");
    }
    let wake = stats.wake.percentiles();
    let times = |of: fn(&Percentiles) -> f64| {
        ratio(&stats.wake, &findings.floor.wake, of).map_or("-".to_owned(), |ratio| format!("{ratio:.2}"))
    };
    let mut headline = format!(
        "{} Hz{}: woken {:.1} µs late (p50), {:.1} µs (p99), {} and {} times the bare sleeper; {} of {} deadlines missed, {} by \
         wormd's own work",
        benchmark.config.control.rate_hz,
        if benchmark.options.load { " under load" } else { "" },
        wake.p50,
        wake.p99,
        times(|wake| wake.p50),
        times(|wake| wake.p99),
        stats.overruns,
        stats.ticks + stats.overruns,
        match stats.overruns_of_product {
            0 => "none".to_owned(),
            count => count.to_string(),
        },
    );
    if !refused.is_empty() {
        headline = format!("REFUSED BY THE SYSTEM: {}. {headline}", refused.join("; "));
    }
    if let Some(problem) = problem {
        headline = format!("CUT SHORT: {problem}. {headline}");
    }
    headline
}
