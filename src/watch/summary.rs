//! The summary of a run that `wormd up` prints, as text and as JSON. The JSON names are a contract.

mod text;

use super::inferred::InferredSummary;
use super::mismatch;
use super::telemetry::Telemetry;
use crate::latency::{HostPauses, Percentiles, WorstTicks};
use serde::Serialize;
use std::collections::BTreeMap;
use worm_estimator::config::Config;
use worm_estimator::estimate::alarm::Coverage;
use worm_estimator::message::{Alarm, AlarmKind, Cycle, Fault, Mode, Range, Severity};
use worm_estimator::time::seconds;

pub use text::remarks;

/// A run in numbers.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Name of the worm.
    pub worm: String,
    /// Time from the first to the last tick, s.
    pub duration_s: f64,
    /// Ticks that the controller ran.
    pub ticks: u64,
    /// Deadlines that passed without a tick.
    pub overruns: u64,
    /// States that the controller published and the estimator never received.
    pub samples_lost: u64,
    /// Tracker samples that came and went between two reads.
    pub tracker_samples_missed: u64,
    /// Exchanges that the servo did not answer, or not usably.
    pub link_failures: u64,
    /// The controller's mode before the stop at the end.
    pub mode: &'static str,
    /// The latched fault, `none` where there is none.
    pub fault: &'static str,
    /// Every finished gait cycle, the newest 65,536 of a longer run.
    pub cycles: Vec<CycleSummary>,
    /// How far and how long the battery lasts, after the newest cycle; null without a battery.
    pub range: Option<RangeSummary>,
    /// What the motor's current alone says, beside what was measured; null where self-sensing is off.
    pub inferred: Option<InferredSummary>,
    /// Older cycles, which are not among them.
    pub cycles_dropped: u64,
    /// Every alarm that was raised, as far as it is among the newest 8,192 changes.
    pub alarms: Vec<AlarmSummary>,
    /// Older changes of alarms, which are not among them.
    pub alarm_changes_dropped: u64,
    /// What each alarm can watch with the sensors of this worm.
    pub alarm_coverage: Vec<CoverageSummary>,
    /// Where the ticks' time went.
    pub timing: TimingSummary,
}

/// One gait cycle.
#[derive(Debug, Clone, Serialize)]
pub struct CycleSummary {
    /// Number of the cycle, from 0.
    pub index: u64,
    /// Duration, s.
    pub duration_s: f64,
    /// Part of it in which the computer paused, s; 0 in an undisturbed cycle.
    pub host_paused_s: f64,
    /// Whether every tip's deformation was known from the start of the cycle.
    pub settled: bool,
    /// Distance travelled, m.
    pub advance_m: f64,
    /// Its standard error, m.
    pub advance_sigma_m: f64,
    /// Forward slide of each tip, m.
    pub forward_slide_m: Vec<f64>,
    /// Backward slide of each tip, m.
    pub backward_slide_m: Vec<f64>,
    /// Energy by (11), J.
    pub energy_loss_j: f64,
    /// Its standard error, J.
    pub energy_loss_sigma_j: f64,
    /// Net actuator work (13), J.
    pub energy_actuator_net_j: f64,
    /// Positive actuator work, J.
    pub energy_actuator_positive_j: f64,
    /// Electrical energy, J.
    pub energy_electrical_j: f64,
    /// Copper heat, J.
    pub energy_copper_j: f64,
    /// Friction inside the device, J.
    pub energy_friction_inside_j: f64,
    /// Cost of transport; null without progress, and while the energy is not known yet.
    pub cot: Option<f64>,
    /// Predicted advance, m; null where the model slides down.
    pub predicted_advance_m: Option<f64>,
    /// Predicted energy by (11), J.
    pub predicted_energy_loss_j: Option<f64>,
    /// Predicted positive actuator work, J.
    pub predicted_energy_positive_j: Option<f64>,
    /// How far and how long the battery lasted then; null without a battery, and in cycles older than the newest 16,384.
    pub range: Option<RangeSummary>,
}

/// How far and how long the battery lasts if the worm crawls on as in its last cycles. Low and high bound a 90 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RangeSummary {
    /// Share of the battery's energy that is left.
    pub charge_share: f64,
    /// Its standard error.
    pub charge_sigma_share: f64,
    /// Energy that a cycle takes from the battery, J.
    pub energy_per_cycle_j: f64,
    /// Gait cycles left.
    pub cycles: f64,
    /// Distance left, m.
    pub range_m: f64,
    /// Lower bound of it, m.
    pub range_low_m: f64,
    /// Upper bound of it, m.
    pub range_high_m: f64,
    /// Time left, s.
    pub time_s: f64,
    /// Lower bound of it, s.
    pub time_low_s: f64,
    /// Upper bound of it, s.
    pub time_high_s: f64,
}

/// One alarm that was raised.
#[derive(Debug, Clone, Serialize)]
pub struct AlarmSummary {
    /// What it watches.
    pub alarm: &'static str,
    /// How serious it is.
    pub severity: &'static str,
    /// The cell that is meant, from 1; null where no single cell is meant.
    pub cell: Option<u32>,
    /// When it was raised, s since the first tick.
    pub raised_s: f64,
    /// When its condition began, s since the first tick.
    pub since_s: f64,
    /// When it was cleared, s since the first tick; null while it is still raised.
    pub cleared_s: Option<f64>,
    /// The watched quantity when it was raised.
    pub value: f64,
    /// The threshold that it passed.
    pub threshold: f64,
    /// Where in the gait a model mismatch shows; null for other alarms.
    pub place: Option<PlaceSummary>,
}

/// What an alarm can watch on this worm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct CoverageSummary {
    /// The alarm.
    pub alarm: &'static str,
    /// `full`, `partial`, or `off` where it can never be raised.
    pub coverage: &'static str,
    /// By what it watches, or why it does not; null where it watches fully.
    pub reason: Option<&'static str>,
}

impl CoverageSummary {
    /// Every alarm's, on the configured worm.
    pub fn of_all(config: &Config) -> Vec<Self> {
        let of = |kind: &AlarmKind| {
            let coverage = Coverage::of(*kind, config);
            Self {
                alarm: kind.name(),
                coverage: coverage.name(),
                reason: coverage.reason(),
            }
        };
        AlarmKind::ALL.iter().map(of).collect()
    }
}

/// A place in the gait.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PlaceSummary {
    /// Gait phase, 0 to 1.
    pub phase: f64,
    /// The cell that steps there, from 1.
    pub stepping_cell: usize,
}

/// Where the ticks' time went.
#[derive(Debug, Clone, Serialize)]
pub struct TimingSummary {
    /// Wake lateness, µs.
    pub wake_us: Percentiles,
    /// Bus exchange, µs.
    pub bus_us: Percentiles,
    /// Computation, µs.
    pub compute_us: Percentiles,
    /// Publishing, µs.
    pub publish_us: Percentiles,
    /// Waking the listeners, µs.
    pub notify_us: Percentiles,
    /// Late ticks by culprit.
    pub culprits: BTreeMap<&'static str, u64>,
    /// Rate at the end, Hz: the configured one, or the fraction of it that the computer holds.
    pub rate_hz: Option<f64>,
    /// Pauses of the computer.
    pub host_pauses: HostPauses,
    /// The worst ticks, the worst first.
    pub worst_ticks: WorstTicks,
}

impl Summary {
    /// The summary of a worm's telemetry. `end_mode` is its mode before it was stopped.
    pub fn new(config: &Config, telemetry: &Telemetry, end_mode: Mode) -> Self {
        let worm = &config.worm;
        let start_ns = telemetry.first_state.map_or(0, |state| state.time_ns);
        let state = telemetry.state;
        let fault = state
            .and_then(|state| Fault::try_from(state.fault).ok())
            .unwrap_or(Fault::None);
        let tick_stats = &telemetry.tick_stats;
        Self {
            worm: worm.name.clone(),
            duration_s: state.map_or(0.0, |state| seconds_since(start_ns, state.time_ns)),
            ticks: telemetry.ticks(),
            overruns: telemetry.timing.map_or(0, |timing| timing.overruns),
            samples_lost: telemetry.estimate.map_or(0, |estimate| estimate.states_lost),
            tracker_samples_missed: state.map_or(0, |state| state.samples_missed),
            link_failures: state.map_or(0, |state| state.link_failures),
            mode: end_mode.name(),
            fault: fault.name(),
            cycles: cycle_summaries(telemetry),
            range: telemetry.ranges.last().map(RangeSummary::of),
            inferred: telemetry
                .inferred
                .map(|inferred| InferredSummary::of(&inferred, state.map_or(f64::NAN, |state| state.phase))),
            cycles_dropped: telemetry.cycles.dropped(),
            alarms: alarm_summaries(telemetry.alarms.iter(), start_ns, &worm.step_order),
            alarm_changes_dropped: telemetry.alarms.dropped(),
            alarm_coverage: CoverageSummary::of_all(config),
            timing: TimingSummary {
                wake_us: tick_stats.wake.percentiles(),
                bus_us: tick_stats.bus.percentiles(),
                compute_us: tick_stats.compute.percentiles(),
                publish_us: tick_stats.publish.percentiles(),
                notify_us: tick_stats.notify.percentiles(),
                culprits: tick_stats.culprits.clone(),
                rate_hz: telemetry
                    .timing
                    .map(|timing| 1e9 / timing.period_ns as f64)
                    .filter(|rate_hz| rate_hz.is_finite()),
                host_pauses: tick_stats.host_pauses,
                worst_ticks: tick_stats.worst.clone(),
            },
        }
    }
}

/// Every cycle, with the range that followed it.
fn cycle_summaries(telemetry: &Telemetry) -> Vec<CycleSummary> {
    let ranges: BTreeMap<u64, &Range> = telemetry.ranges.iter().map(|range| (range.index, range)).collect();
    let cycles = telemetry.cycles.iter();
    cycles
        .map(|cycle| CycleSummary {
            range: ranges.get(&cycle.index).map(|range| RangeSummary::of(range)),
            ..CycleSummary::new(cycle)
        })
        .collect()
}

impl RangeSummary {
    /// What the message says.
    pub fn of(range: &Range) -> Self {
        Self {
            charge_share: range.charge_share,
            charge_sigma_share: range.charge_sigma_share,
            energy_per_cycle_j: range.energy_per_cycle_j,
            cycles: range.cycles,
            range_m: range.range_m,
            range_low_m: range.range_low_m,
            range_high_m: range.range_high_m,
            time_s: range.time_s,
            time_low_s: range.time_low_s,
            time_high_s: range.time_high_s,
        }
    }
}

fn seconds_since(start_ns: u64, time_ns: u64) -> f64 {
    seconds(time_ns.saturating_sub(start_ns))
}

impl CycleSummary {
    fn new(cycle: &Cycle) -> Self {
        let cells = (cycle.cell_count as usize).min(worm_physics::MAX_CELLS);
        let known = |value: f64| value.is_finite().then_some(value);
        Self {
            index: cycle.index,
            duration_s: cycle.duration_s,
            host_paused_s: cycle.host_paused_s,
            settled: cycle.settled != 0,
            advance_m: cycle.advance_m,
            advance_sigma_m: cycle.advance_sigma_m,
            forward_slide_m: cycle.forward_slide_m[..cells].to_vec(),
            backward_slide_m: cycle.backward_slide_m[..cells].to_vec(),
            energy_loss_j: cycle.energy_loss_j,
            energy_loss_sigma_j: cycle.energy_loss_sigma_j,
            energy_actuator_net_j: cycle.energy_actuator_net_j,
            energy_actuator_positive_j: cycle.energy_actuator_positive_j,
            energy_electrical_j: cycle.energy_electrical_j,
            energy_copper_j: cycle.energy_copper_j,
            energy_friction_inside_j: cycle.energy_friction_inside_j,
            cot: known(cycle.cot).filter(|_| cycle.energy_loss_sigma_j.is_finite()),
            predicted_advance_m: known(cycle.predicted_advance_m),
            predicted_energy_loss_j: known(cycle.predicted_energy_loss_j),
            predicted_energy_positive_j: known(cycle.predicted_energy_positive_j),
            range: None,
        }
    }
}

fn alarm_summaries<'a>(
    changes: impl Iterator<Item = &'a Alarm>,
    start_ns: u64,
    step_order: &[usize],
) -> Vec<AlarmSummary> {
    let mut summaries: Vec<AlarmSummary> = Vec::new();
    // Where in it are those that are not cleared yet, by kind.
    let mut open: BTreeMap<AlarmKind, Vec<usize>> = BTreeMap::new();
    for alarm in changes {
        let Ok(kind) = AlarmKind::try_from(alarm.kind) else {
            continue;
        };
        if alarm.raised == 0 {
            for index in open.remove(&kind).unwrap_or_default() {
                summaries[index].cleared_s = Some(seconds_since(start_ns, alarm.time_ns));
            }
            continue;
        }
        open.entry(kind).or_default().push(summaries.len());
        summaries.push(AlarmSummary {
            alarm: kind.name(),
            severity: Severity::try_from(alarm.severity).map_or("unknown", Severity::name),
            cell: (alarm.cell != u32::MAX).then(|| alarm.cell + 1),
            raised_s: seconds_since(start_ns, alarm.time_ns),
            since_s: seconds_since(start_ns, alarm.since_ns),
            cleared_s: None,
            value: alarm.value,
            threshold: alarm.threshold,
            place: mismatch::place_of(alarm, step_order)
                .map(|(phase, stepping_cell)| PlaceSummary { phase, stepping_cell }),
        });
    }
    summaries
}
