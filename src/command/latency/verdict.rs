//! What the measurement amounts to: the outcome, its headline and its warnings.

use super::bench::Bench;
use super::measure::Findings;
use super::rates::MISSED_FRACTION;
use crate::command::Failure;
use crate::latency::{Outcome, Percentiles, ratio};
use crate::realtime::{InForce, machine};

/// Percentiles of the tail mean nothing with fewer ticks than this.
const FEW_TICKS: u64 = 2_000;

/// Everything that was found, put together.
pub(super) fn outcome(bench: &Bench, findings: Findings, trouble: Option<&Failure>) -> Outcome {
    let mut warnings = Vec::new();
    if let Some(trouble) = trouble {
        warnings.push(trouble.to_string());
    }
    let refused = refused(bench, findings.in_force.as_ref());
    warnings.extend(refused.iter().map(|what| format!("in force for the loop: {what}")));
    // The bare sleeper has asked for the same, and was told why.
    warnings.extend(findings.floor.refusals.iter().cloned());
    warnings.extend(findings.warnings.iter().cloned());
    let account = &findings.account;
    let deadlines = account.ticks + account.overruns;
    if account.ticks > 0 && account.ticks < FEW_TICKS {
        warnings.push(format!(
            "only {} ticks were measured: the 99.9th percentile is little more than the largest value; give a longer --duration",
            account.ticks
        ));
    }
    if account.overruns as f64 > MISSED_FRACTION * deadlines as f64 {
        warnings.push(format!(
            "{} Hz is not met: {:.1} % of the deadlines were missed; try a lower --rate",
            bench.config.control.rate_hz,
            100.0 * account.overruns as f64 / deadlines as f64
        ));
    }
    if bench.config.port.is_none() && account.ticks > 0 && findings.alarm.is_empty() {
        warnings.push(match bench.stalls_s().len() {
            0 => "no alarm was measured: its first stall needs a --duration of 3 s".to_owned(),
            stalls => {
                format!("no alarm was measured: none came of {stalls} stall(s), too short for this gait or cut off")
            }
        });
    }
    let headline = headline(bench, &findings, &refused, trouble);
    let highest_rate_hz = findings
        .rates
        .iter()
        .filter(|trial| trial.sustained)
        .map(|trial| trial.rate_hz)
        .reduce(f64::max);
    let mut settings = machine::settings(bench.config.realtime.cpu);
    if let Some(in_force) = &findings.in_force {
        settings.insert(0, in_force_setting(in_force, &refused));
    }
    // A share of nothing is not known.
    let fraction = |fraction: f64| if findings.measured_s > 0.0 { fraction } else { f64::NAN };
    let (controller_cpu_share, estimator_cpu_share) = (
        fraction(findings.controller_cpu_share),
        fraction(findings.estimator_cpu_share),
    );
    let Findings { account, floor, .. } = findings;
    Outcome {
        headline,
        worm: bench.config.worm.name.clone(),
        port: bench
            .config
            .port
            .as_ref()
            .map_or("the virtual worm".to_owned(), |port| port.path.clone()),
        rate_hz: bench.config.control.rate_hz,
        duration_s: findings.measured_s,
        load: bench.load,
        ticks: account.ticks,
        overruns: account.overruns,
        overruns_of_product: account.overruns_of_product,
        wake_us: account.wake,
        floor_wake_us: floor.wake,
        period_us: account.period,
        execution_us: account.execution,
        bus_us: account.bus,
        compute_us: account.compute,
        publish_us: account.publish,
        own_work_us: account.own_work,
        notify_us: account.notify,
        floor_notify_us: floor.notify,
        delivery_us: findings.delivery,
        floor_delivery_us: findings.floor_delivery,
        polled_delivery_us: findings.polled_delivery,
        floor_polled_delivery_us: findings.floor_polled_delivery,
        alarm_us: findings.alarm,
        culprits: account.culprits,
        host_pauses: account.host_pauses,
        worst_ticks: account.worst,
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

/// What the loop was to have and has not.
fn refused(bench: &Bench, in_force: Option<&InForce>) -> Vec<String> {
    in_force.map_or_else(Vec::new, |in_force| in_force.shortfalls(&bench.config.realtime, 0))
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

fn headline(bench: &Bench, findings: &Findings, refused: &[String], trouble: Option<&Failure>) -> String {
    let account = &findings.account;
    let floor = findings.floor.wake.percentiles();
    if account.wake.is_empty() {
        let floor = match findings.floor.wake.is_empty() {
            true => String::new(),
            false => format!(
                "; a bare sleeper wakes {:.1} µs late (p50), {:.1} µs (p99)",
                floor.p50, floor.p99
            ),
        };
        let why = trouble.map_or("no tick was measured".to_owned(), ToString::to_string);
        return format!("THE LOOP WAS NOT MEASURED: {why}{floor}");
    }
    let wake = account.wake.percentiles();
    let times = |of: fn(&Percentiles) -> f64| {
        ratio(&account.wake, &findings.floor.wake, of).map_or("-".to_owned(), |ratio| format!("{ratio:.2}"))
    };
    let mut headline = format!(
        "{} Hz{}: woken {:.1} µs late (p50), {:.1} µs (p99), {} and {} times the bare sleeper; {} of {} deadlines missed, {} by \
         wormd's own work",
        bench.config.control.rate_hz,
        if bench.load { " under load" } else { "" },
        wake.p50,
        wake.p99,
        times(|wake| wake.p50),
        times(|wake| wake.p99),
        account.overruns,
        account.ticks + account.overruns,
        match account.overruns_of_product {
            0 => "none".to_owned(),
            count => count.to_string(),
        },
    );
    if !refused.is_empty() {
        headline = format!("REFUSED BY THE SYSTEM: {}. {headline}", refused.join("; "));
    }
    if let Some(trouble) = trouble {
        headline = format!("CUT SHORT: {trouble}. {headline}");
    }
    headline
}
