//! Where a worm stopped in a log, and by what.

use crate::relay::departure::Departure;
use worm_estimator::config::{Config, Policy};
use worm_estimator::message::{
    Alarm, AlarmKind, CommandKind, CommandOutcome, CommandRecord, Fault, HoldReason, Mode, State,
};
use worm_log::Log;

/// A message that an alarm was raised may be younger than the tick that acts on it by this, ns.
const ALARM_AFTER_NS: u64 = 50_000_000;

/// What the controller, or what was left of it, stopped the worm for.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// An alarm with a policy of more than `warn`.
    Alarm(AlarmKind),
    /// A fault that the controller found by itself.
    Fault(Fault),
    /// A command.
    Command(CommandRecord),
    /// The relay's hold, because nothing was heard of the watcher that drove.
    DriverSilent(CommandRecord),
    /// Whoever made it crawl is gone.
    LeaseLapsed,
    /// The time for which it was to crawl was over.
    TimeLimit,
    /// The controller fell silent, or another one took its place.
    ControllerGone,
    /// The log does not say.
    Unknown,
}

impl Cause {
    /// Whether somebody wanted it so.
    pub const fn is_wanted(&self) -> bool {
        matches!(self, Self::Command(_) | Self::TimeLimit)
    }
}

/// A worm that crawled, or had torque, and did so no more.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// When, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// The mode before.
    pub from: Mode,
    /// The mode after; none where the controller was gone.
    pub to: Option<Mode>,
    /// Why.
    pub cause: Cause,
    /// The alarm behind it, as it was raised.
    pub alarm: Option<Alarm>,
}

/// Every stop in a log, in the order of time: the end of each crawl, and each fault that switched torque off.
pub fn stops(log: &Log, config: &Config) -> Vec<Stop> {
    let mut stops = Vec::new();
    for pair in log.states.windows(2) {
        let [last, state] = pair else { continue };
        let (Ok(from), Ok(to)) = (Mode::try_from(last.mode), Mode::try_from(state.mode)) else {
            continue;
        };
        let had_torque = !matches!(from, Mode::Disarmed | Mode::Fault);
        if state.sequence < last.sequence {
            if had_torque {
                stops.push(Stop {
                    time_ns: last.time_ns,
                    from,
                    to: None,
                    cause: Cause::ControllerGone,
                    alarm: None,
                });
            }
            continue;
        }
        let ends_crawl = from == Mode::Crawling && to != Mode::Crawling;
        let loses_torque = had_torque && to == Mode::Fault;
        if !ends_crawl && !loses_torque {
            continue;
        }
        let (cause, alarm) = cause(state, to, log, config);
        stops.push(Stop {
            time_ns: state.time_ns,
            from,
            to: Some(to),
            cause,
            alarm,
        });
    }
    stops
}

fn cause(state: &State, to: Mode, log: &Log, config: &Config) -> (Cause, Option<Alarm>) {
    let fault = Fault::try_from(state.fault).unwrap_or(Fault::None);
    if to == Mode::Fault && fault != Fault::Alarm {
        return (Cause::Fault(turned_out(fault, state, log)), None);
    }
    if to == Mode::Fault {
        let Ok(kind) = AlarmKind::try_from(state.fault_alarm) else {
            return (Cause::Unknown, None);
        };
        return (
            Cause::Alarm(kind),
            last_raised(log, state.time_ns, |other| other == kind),
        );
    }
    let reason = HoldReason::try_from(state.hold_reason).unwrap_or(HoldReason::None);
    match reason {
        HoldReason::LeaseLapsed => (Cause::LeaseLapsed, None),
        HoldReason::TimeLimit => (Cause::TimeLimit, None),
        HoldReason::Alarm => {
            let acts = |kind: AlarmKind| config.alarms.of(kind).policy != Policy::Warn;
            match last_raised(log, state.time_ns, acts) {
                Some(alarm) => (
                    AlarmKind::try_from(alarm.kind).map_or(Cause::Unknown, Cause::Alarm),
                    Some(alarm),
                ),
                None => (Cause::Unknown, None),
            }
        }
        HoldReason::Command | HoldReason::None => (last_command(log, state.time_ns), None),
    }
}

/// A servo that restarts is silent at first: its first answer changes the lost link into what it was.
fn turned_out(fault: Fault, state: &State, log: &Log) -> Fault {
    if fault != Fault::LinkLost {
        return fault;
    }
    let later = log.states.partition_point(|other| other.time_ns <= state.time_ns);
    let mut same_fault = log.states[later..]
        .iter()
        .take_while(|other| other.mode == Mode::Fault.code());
    match same_fault.any(|other| other.fault == Fault::ServoRestarted.code()) {
        true => Fault::ServoRestarted,
        false => fault,
    }
}

/// The newest of these alarms that was raised until then.
fn last_raised(log: &Log, time_ns: u64, wanted: impl Fn(AlarmKind) -> bool) -> Option<Alarm> {
    let until_ns = time_ns + ALARM_AFTER_NS;
    let is_wanted = |alarm: &&Alarm| alarm.raised == 1 && AlarmKind::try_from(alarm.kind).is_ok_and(&wanted);
    let raised = log.alarms.iter().filter(is_wanted);
    raised
        .filter(|alarm| alarm.time_ns <= until_ns)
        .max_by_key(|alarm| alarm.time_ns)
        .copied()
}

/// The newest command that ends a crawl, accepted until then.
fn last_command(log: &Log, time_ns: u64) -> Cause {
    let ending = [CommandKind::Hold, CommandKind::Stop];
    let ends = |record: &&CommandRecord| {
        ending.iter().any(|kind| record.kind == kind.code()) && record.outcome == CommandOutcome::Accepted.code()
    };
    let commands = log.commands.iter().filter(ends);
    commands
        .filter(|record| record.time_ns <= time_ns)
        .max_by_key(|record| record.time_ns)
        .map_or(Cause::Unknown, |record| match Departure::of(record) {
            Some(departure) if departure.is_silence() => Cause::DriverSilent(*record),
            _ => Cause::Command(*record),
        })
}

/// The alarms that stand at a moment, as they were raised, the oldest first.
pub fn standing(log: &Log, time_ns: u64) -> Vec<Alarm> {
    let mut standing: Vec<Alarm> = Vec::new();
    let until = log.alarms.iter().filter(|alarm| alarm.time_ns <= time_ns);
    for alarm in until {
        standing.retain(|other| other.kind != alarm.kind);
        if alarm.raised == 1 {
            standing.push(*alarm);
        }
    }
    standing.retain(|alarm| alarm.kind != AlarmKind::RecordingStopped.code());
    standing
}
