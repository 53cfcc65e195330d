//! What happened in a log, event by event: alarms, faults, modes, commands, and what the readings show of silences and limits.

use crate::relay::remark;
use serde::Serialize;
use worm_estimator::config::Config;
use worm_estimator::message::{
    Alarm, AlarmKind, CommandKind, CommandOutcome, CommandRecord, Fault, HoldReason, Mode, Severity, State,
};
use worm_estimator::number::significant;
use worm_estimator::winding::Reported;
use worm_log::Log;

/// Failed exchanges less than this apart are one event, ns.
const BURST_NS: u64 = 50_000_000;
/// So many failed exchanges are an event.
const FAILURES: u64 = 3;
/// A tracker that is silent for so many of its periods is an event …
const SILENT_PERIODS: f64 = 5.0;
/// … and a limit that is passed for so long.
const BEYOND_NS: u64 = 20_000_000;
/// What ends such an event must last as long as this, ns.
const CALM_NS: u64 = 500_000_000;
/// Ticks that are this far apart are a gap, ns.
const GAP_NS: u64 = 100_000_000;

/// The kinds of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MomentKind {
    /// An alarm was raised.
    AlarmRaised,
    /// An alarm was cleared.
    AlarmCleared,
    /// The mode changed.
    Mode,
    /// A fault was latched.
    Fault,
    /// A command came.
    Command,
    /// A reading of servo or supply passed a limit.
    Limit,
    /// A device did not answer.
    Silence,
    /// The computer paused, or ticks are missing.
    Computer,
    /// The controller was started.
    Start,
    /// The emergency stop.
    EmergencyStop,
}

/// One event.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// When, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// What kind.
    pub kind: MomentKind,
    /// In words.
    pub text: String,
}

/// Everything that happened in a log, in the order of time.
pub fn moments(log: &Log, config: &Config) -> Vec<Moment> {
    let mut moments: Vec<Moment> = log.alarms.iter().filter_map(|alarm| of_alarm(alarm, log)).collect();
    moments.extend(of_commands(&log.commands));
    moments.extend(of_states(&log.states));
    moments.extend(silences_of_servo(&log.states));
    if let Some(rate_hz) = config.tracker_rate_hz() {
        moments.extend(silences_of_tracker(&log.states, rate_hz));
    }
    moments.extend(limits(&log.states, config));
    // Of several at one moment, what the controller read comes first, and what it did last.
    let rank = |kind: MomentKind| match kind {
        MomentKind::Start | MomentKind::Computer => 0,
        MomentKind::Silence | MomentKind::Limit | MomentKind::EmergencyStop => 1,
        MomentKind::AlarmRaised | MomentKind::AlarmCleared | MomentKind::Command => 2,
        MomentKind::Fault => 3,
        MomentKind::Mode => 4,
    };
    moments.sort_by_key(|moment| (moment.time_ns, rank(moment.kind)));
    moments
}

fn of_alarm(alarm: &Alarm, log: &Log) -> Option<Moment> {
    let kind = AlarmKind::try_from(alarm.kind).ok()?;
    // A late joiner gets alarms of before the log.
    let begun_ns = log.states.first().map_or(0, |state| state.time_ns);
    if alarm.time_ns < begun_ns {
        return None;
    }
    let cell = match alarm.cell {
        u32::MAX => String::new(),
        cell => format!(" (cell {})", cell + 1),
    };
    let (moment_kind, text) = if alarm.raised == 1 {
        let severity = Severity::try_from(alarm.severity).map_or("", Severity::name);
        let text = format!(
            "alarm {kind}{cell} raised, {severity}: {} against {}",
            figure(alarm.value),
            figure(alarm.threshold)
        );
        (MomentKind::AlarmRaised, text)
    } else {
        (MomentKind::AlarmCleared, format!("alarm {kind}{cell} cleared"))
    };
    Some(Moment {
        time_ns: alarm.time_ns,
        kind: moment_kind,
        text,
    })
}

/// A number with three significant digits.
pub(crate) fn figure(value: f64) -> String {
    significant(value, 3)
}

/// Each command but the renewals of a crawl, of which there are four a second.
fn of_commands(commands: &[CommandRecord]) -> impl Iterator<Item = Moment> {
    commands
        .iter()
        .filter(|record| !record.is_mere_renewal())
        .map(|record| Moment {
            time_ns: record.time_ns,
            kind: MomentKind::Command,
            text: command_in_words(record),
        })
}

/// A command, who gave it, and what became of it.
pub(crate) fn command_in_words(record: &CommandRecord) -> String {
    if let Some(text) = remark::in_words(record) {
        return text;
    }
    let kind = CommandKind::try_from(record.kind).map_or("unknown", CommandKind::name);
    let outcome = CommandOutcome::try_from(record.outcome).map_or("unknown", CommandOutcome::name);
    let sender = match record.sender.as_str() {
        "" => "an unnamed sender".to_owned(),
        sender => sender.to_owned(),
    };
    format!("command {kind} from {sender} (user {}): {outcome}", record.user)
}

fn of_states(states: &[State]) -> Vec<Moment> {
    let mut moments = Vec::new();
    let mut push = |time_ns, kind, text| moments.push(Moment { time_ns, kind, text });
    for pair in states.windows(2) {
        let [last, state] = pair else { continue };
        let time_ns = state.time_ns;
        if state.sequence < last.sequence {
            push(time_ns, MomentKind::Start, "the controller was started anew".to_owned());
            continue;
        }
        let pause_ns = state.host_paused_ns.saturating_sub(last.host_paused_ns);
        if pause_ns > 0 {
            let ms = pause_ns / 1_000_000;
            push(
                time_ns,
                MomentKind::Computer,
                format!("the computer had paused for {ms} ms"),
            );
        } else if state.sequence == last.sequence + 1 && time_ns.saturating_sub(last.time_ns) > GAP_NS {
            let ms = time_ns.saturating_sub(last.time_ns) / 1_000_000;
            push(time_ns, MomentKind::Computer, format!("no tick for {ms} ms"));
        }
        if state.emergency_stop != last.emergency_stop {
            let text = if state.emergency_stop == 1 {
                "emergency stop pressed"
            } else {
                "emergency stop released"
            };
            push(time_ns, MomentKind::EmergencyStop, text.to_owned());
        }
        if state.hardware_error != last.hardware_error {
            let text = format!("the servo's hardware errors (register 70): {}", state.hardware_error);
            push(time_ns, MomentKind::Limit, text);
        }
        if state.fault != last.fault && state.fault != Fault::None.code() {
            push(
                time_ns,
                MomentKind::Fault,
                format!("fault {} latched", fault_name(state)),
            );
        }
        if state.mode != last.mode {
            push(time_ns, MomentKind::Mode, mode_change(last, state));
        }
    }
    moments
}

/// The latched fault of a state, with the alarm behind it.
pub(crate) fn fault_name(state: &State) -> String {
    let fault = Fault::try_from(state.fault).unwrap_or(Fault::None);
    match AlarmKind::try_from(state.fault_alarm) {
        Ok(alarm) if fault == Fault::Alarm => format!("{fault} {alarm}"),
        _ => fault.name().to_owned(),
    }
}

fn mode_change(last: &State, state: &State) -> String {
    let name = |state: &State| Mode::try_from(state.mode).map_or("unknown", Mode::name);
    let why = match HoldReason::try_from(state.hold_reason) {
        Ok(reason) if reason != HoldReason::None => format!(", because of {reason}"),
        _ => String::new(),
    };
    format!("from {} to {}{why}", name(last), name(state))
}

/// Bursts of exchanges that the servo did not answer.
fn silences_of_servo(states: &[State]) -> Vec<Moment> {
    let mut moments = Vec::new();
    // When it began, when its last failure was, and how many there were.
    let mut burst: Option<(u64, u64, u64)> = None;
    let mut end = |burst: Option<(u64, u64, u64)>| {
        if let Some((since_ns, until_ns, failures)) = burst
            && failures >= FAILURES
        {
            let ms = until_ns.saturating_sub(since_ns) / 1_000_000;
            moments.push(Moment {
                time_ns: since_ns,
                kind: MomentKind::Silence,
                text: format!("the servo did not answer {failures} times within {ms} ms"),
            });
        }
    };
    for pair in states.windows(2) {
        let [last, state] = pair else { continue };
        let failures = if state.sequence < last.sequence {
            0
        } else {
            state.link_failures.saturating_sub(last.link_failures)
        };
        let is_over = burst.is_some_and(|(_, until_ns, _)| state.time_ns.saturating_sub(until_ns) > BURST_NS);
        if is_over {
            end(burst.take());
        }
        if failures > 0 {
            let (since_ns, _, count) = burst.unwrap_or((state.time_ns, 0, 0));
            burst = Some((since_ns, state.time_ns, count + failures));
        }
    }
    end(burst);
    moments
}

/// Times without a new sample of the tracker, while the servo answered.
fn silences_of_tracker(states: &[State], rate_hz: f64) -> Vec<Moment> {
    let longest_ns = (SILENT_PERIODS * 1e9 / rate_hz) as u64;
    let mut moments = Vec::new();
    let mut since_ns: Option<u64> = None;
    let mut end = |since_ns: Option<u64>, until_ns: u64| {
        if let Some(since_ns) = since_ns
            && until_ns.saturating_sub(since_ns) > longest_ns.max(BURST_NS)
        {
            let ms = until_ns.saturating_sub(since_ns) / 1_000_000;
            moments.push(Moment {
                time_ns: since_ns,
                kind: MomentKind::Silence,
                text: format!("no new sample of the tracker for {ms} ms"),
            });
        }
    };
    for state in states {
        // While the servo is armed, prepared or silent, nobody asks the tracker.
        if state.sample_is_new == 1 || state.motor_is_new == 0 || state.mode == Mode::Disarmed.code() {
            end(since_ns, state.time_ns);
            since_ns = Some(state.time_ns);
        }
    }
    end(since_ns, states.last().map_or(0, |state| state.time_ns));
    moments
}

/// Readings beyond the configured limits, from when to how far.
fn limits(states: &[State], config: &Config) -> Vec<Moment> {
    let limits = &config.limits;
    let winding = config.winding();
    let current = |state: &State| winding.current_a(&Reported::from(state)).abs() - limits.current_a;
    let heat = |state: &State| state.motor_temperature_c - limits.temperature_c;
    let voltage = |state: &State| limits.voltage_v - state.bus_voltage_v;
    let mut moments = beyond(states, current, |by| {
        let most = figure(limits.current_a + by);
        format!(
            "the motor's current is above its limit of {} A, up to {most} A",
            figure(limits.current_a)
        )
    });
    moments.extend(beyond(states, heat, |by| {
        let most = figure(limits.temperature_c + by);
        format!(
            "the servo is hotter than its limit of {} °C, up to {most} °C",
            figure(limits.temperature_c)
        )
    }));
    moments.extend(beyond(states, voltage, |by| {
        let least = figure(limits.voltage_v - by);
        format!(
            "the bus voltage is below its limit of {} V, down to {least} V",
            figure(limits.voltage_v)
        )
    }));
    moments
}

/// Where an excess is positive for longer than a moment: since when, and by how much at most.
fn beyond(states: &[State], excess: impl Fn(&State) -> f64, words: impl Fn(f64) -> String) -> Vec<Moment> {
    let mut moments = Vec::new();
    // Since when, until when, the most.
    let mut span: Option<(u64, u64, f64)> = None;
    let mut end = |span: Option<(u64, u64, f64)>| {
        if let Some((since_ns, until_ns, most)) = span
            && until_ns.saturating_sub(since_ns) >= BEYOND_NS
        {
            moments.push(Moment {
                time_ns: since_ns,
                kind: MomentKind::Limit,
                text: words(most),
            });
        }
    };
    for state in states {
        let by = excess(state);
        if by > 0.0 {
            let (since_ns, _, most) = span.unwrap_or((state.time_ns, 0, by));
            span = Some((since_ns, state.time_ns, most.max(by)));
        } else if span.is_some_and(|(_, until_ns, _)| state.time_ns.saturating_sub(until_ns) > CALM_NS) {
            end(span.take());
        }
    }
    end(span);
    moments
}
