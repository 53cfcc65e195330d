//! Why the worm stopped: one answer from all that the log holds.

use super::alarm::{Then, alarm_of, mode_at, of_alarm, of_nothing};
use super::answer::{Event, Explanation, LastCycles, Reason, Sign, Trigger, lower_first, relative_s};
use super::stops::{Cause, Stop, standing, stops};
use super::timeline::{Moment, command_in_words, moments};
use crate::relay::departure::{Departure, Way};
use crate::remedy;
use worm_estimator::config::Config;
use worm_estimator::message::{Alarm, AlarmKind, CommandKind, Mode, Severity};
use worm_log::Log;

/// How much of a log is told of before the stop, and after it, ns.
const BEFORE_NS: u64 = 60_000_000_000;
const AFTER_NS: u64 = 20_000_000_000;
/// An event and the box that was made of it may differ by this, ns.
const NEAR_NS: u64 = 1_000_000_000;

/// Explains the stop with this number, from 1; without one, that of the box's event, or else the last. `trigger` is what a box was
/// made of.
pub fn explain_stop(log: &Log, config: &Config, trigger: Option<&Trigger>, wanted: Option<usize>) -> Explanation {
    let mut config = config.clone();
    // The name may have been given on the command line.
    if let Some(worm) = log.metadata.get("worm") {
        config.worm.name.clone_from(worm);
    }
    let config = &config;
    let mut all = stops(log, config);
    if let Some(trigger) = trigger
        && trigger.event == GONE
        && let Some(last) = log.states.last()
        && last.time_ns < trigger.time_ns
    {
        all.push(Stop {
            time_ns: last.time_ns,
            from: Mode::try_from(last.mode).unwrap_or(Mode::Disarmed),
            to: None,
            cause: Cause::ControllerGone,
            alarm: None,
        });
    }
    let chosen = match wanted {
        Some(number) => number.checked_sub(1).filter(|place| *place < all.len()),
        None => choose(&all, log, trigger),
    };
    let subject = match chosen.and_then(|place| all.get(place)) {
        Some(stop) => Subject::Stop(stop.clone()),
        None => match alarm_of(log, trigger) {
            Some(alarm) => Subject::Alarm(alarm),
            None => Subject::Nothing(log.states.last().map_or(0, |state| state.time_ns)),
        },
    };
    let time_ns = subject.time_ns();
    let reason = reason(&subject, log, config);
    let (from, to) = match &subject {
        Subject::Stop(stop) => (Some(stop.from.name()), stop.to.map(Mode::name)),
        _ => (None, None),
    };
    let mut warnings = log.warnings.clone();
    if log.commands.is_empty() {
        warnings.push(
            "the log holds no command: none was given while it was recorded, or the topic `command` was not recorded"
                .to_owned(),
        );
    }
    if log.alarms.is_empty() && log.estimates.is_empty() {
        warnings
            .push("the log holds neither alarms nor estimates: an alarm behind the stop would not be known".to_owned());
    }
    Explanation {
        worm: config.worm.name.clone(),
        log: log.file.display().to_string(),
        stopped: matches!(subject, Subject::Stop(_)),
        time_ns,
        unix_ns: unix_ns(log, time_ns),
        from,
        to,
        signs: signs(log, &subject, time_ns),
        events: events(log, config, time_ns),
        remedy: remedy_for(&subject, config),
        stop: chosen.map_or(0, |place| place + 1),
        stops: all.len(),
        last_cycles: LastCycles::default(),
        reason,
        warnings,
    }
}

/// How the black box calls a controller that fell silent.
const GONE: &str = "controller-silent";

/// What the explanation is of.
enum Subject {
    Stop(Stop),
    /// One that stopped nothing.
    Alarm(Alarm),
    Nothing(u64),
}

impl Subject {
    fn time_ns(&self) -> u64 {
        match self {
            Self::Stop(stop) => stop.time_ns,
            Self::Alarm(alarm) => alarm.time_ns,
            Self::Nothing(time_ns) => *time_ns,
        }
    }
}

/// The stop that a log is about. That somebody stops a worm after an alarm is not what the alarm's box is about.
fn choose(stops: &[Stop], log: &Log, trigger: Option<&Trigger>) -> Option<usize> {
    let last = stops.len().checked_sub(1);
    let Some(trigger) = trigger else { return last };
    let is_near = |stop: &Stop| stop.time_ns + NEAR_NS >= trigger.time_ns;
    let unwanted = stops.iter().position(|stop| is_near(stop) && !stop.cause.is_wanted());
    if unwanted.is_some() || alarm_of(log, Some(trigger)).is_some() {
        return unwanted;
    }
    stops.iter().position(is_near).or(last)
}

fn reason(subject: &Subject, log: &Log, config: &Config) -> Reason {
    let plain = |kind, name: &str, sentence: String| Reason {
        kind,
        name: name.to_owned(),
        time_s: 0.0,
        since_s: None,
        cell: None,
        value: None,
        threshold: None,
        sender: None,
        user: None,
        sentence,
    };
    let stop = match subject {
        Subject::Alarm(alarm) => {
            let then = Then::WentOn(mode_at(log, alarm.time_ns));
            return of_alarm(alarm, alarm.time_ns, then, config);
        }
        Subject::Nothing(_) => return plain("none", "none", of_nothing(log)),
        Subject::Stop(stop) => stop,
    };
    match &stop.cause {
        Cause::Alarm(kind) => match &stop.alarm {
            Some(alarm) => of_alarm(alarm, stop.time_ns, Then::Stopped, config),
            None => plain(
                "alarm",
                kind.name(),
                format!(
                    "The alarm {kind} stopped the worm: {}. When it was raised is not in the log.",
                    lower_first(&remedy::meaning(*kind))
                ),
            ),
        },
        Cause::Fault(fault) => {
            let meaning = remedy::of_fault(*fault).map_or_else(String::new, |(meaning, _)| meaning);
            plain(
                "fault",
                fault.name(),
                format!("The controller latched the fault {fault}: {}", as_sentence(&meaning)),
            )
        }
        Cause::Command(record) | Cause::DriverSilent(record) => {
            let kind = CommandKind::try_from(record.kind).map_or("unknown", CommandKind::name);
            let by_command = match Departure::of(record) {
                Some(Departure {
                    name,
                    way: Way::Silent(s),
                }) => plain(
                    "driver-silent",
                    "driver-silent",
                    format!(
                        "{name}, who drove, was not heard for {s} s: the page was closed, or its network was gone."
                    ),
                ),
                Some(departure) => plain("command", kind, format!("{departure}: so the worm holds.")),
                None => plain(
                    "command",
                    kind,
                    format!("Somebody wanted it: {}.", command_in_words(record)),
                ),
            };
            Reason {
                time_s: relative_s(record.time_ns, stop.time_ns),
                sender: Some(record.sender.as_str().to_owned()),
                user: Some(record.user),
                ..by_command
            }
        }
        Cause::LeaseLapsed => plain(
            "lease-lapsed",
            "lease-lapsed",
            format!(
                "Whoever made the worm crawl is gone, or was silent for control.lease_s ({} s).",
                config.control.lease_s
            ),
        ),
        Cause::TimeLimit => plain(
            "time-limit",
            "time-limit",
            "The time for which the worm was to crawl was over.".to_owned(),
        ),
        Cause::ControllerGone => plain(
            "controller-gone",
            "controller-gone",
            format!(
                "The controller published no more while the motor had torque. It was killed, crashed or hung; the servo's watchdog stopped the \
                 motor {} ms after its last request.",
                config.servo.watchdog_ms
            ),
        ),
        Cause::Unknown => plain("unknown", "unknown", "The log does not say why.".to_owned()),
    }
}

fn signs(log: &Log, subject: &Subject, time_ns: u64) -> Vec<Sign> {
    let reason = match subject {
        Subject::Stop(stop) => stop.alarm,
        Subject::Alarm(alarm) => Some(*alarm),
        Subject::Nothing(_) => None,
    };
    let is_other = |alarm: &Alarm| reason.is_none_or(|reason| reason.kind != alarm.kind);
    let standing = standing(log, time_ns).into_iter().filter(is_other);
    standing
        .map(|alarm| Sign {
            alarm: AlarmKind::try_from(alarm.kind).map_or("unknown", AlarmKind::name),
            severity: Severity::try_from(alarm.severity).map_or("unknown", Severity::name),
            time_s: relative_s(alarm.time_ns, time_ns),
        })
        .collect()
}

fn events(log: &Log, config: &Config, time_ns: u64) -> Vec<Event> {
    let span = time_ns.saturating_sub(BEFORE_NS)..=time_ns.saturating_add(AFTER_NS);
    let within = |moment: &Moment| span.contains(&moment.time_ns);
    moments(log, config)
        .into_iter()
        .filter(within)
        .map(|moment| Event {
            time_s: relative_s(moment.time_ns, time_ns),
            kind: moment.kind,
            text: moment.text,
        })
        .collect()
}

fn remedy_for(subject: &Subject, config: &Config) -> String {
    let cause = match subject {
        Subject::Stop(stop) => stop.cause.clone(),
        Subject::Alarm(alarm) => AlarmKind::try_from(alarm.kind).map_or(Cause::Unknown, Cause::Alarm),
        Subject::Nothing(_) => return "Nothing.".to_owned(),
    };
    let name = &config.worm.name;
    match cause {
        Cause::Alarm(kind) => remedy::of(kind),
        Cause::Fault(fault) => {
            let todo = remedy::of_fault(fault).map_or_else(String::new, |(_, remedy)| as_sentence(&remedy));
            format!("{todo} Nothing moves until `wormd command reset --name {name}`.")
        }
        Cause::Command(_) | Cause::TimeLimit => format!("Nothing is wrong: `wormd command crawl --name {name}` goes on."),
        Cause::DriverSilent(_) => format!(
            "Crawl again when somebody watches: with the page, `wormd watch --name {name}`, or on board `wormd command crawl --attend`."
        ),
        Cause::LeaseLapsed => format!(
            "Find out why `wormd up`, the driving screen or the script ended; `wormd command crawl --name {name}` goes on. On board, crawl \
             with --attend or --for."
        ),
        Cause::ControllerGone => "Look at the log of the controller (journalctl, or what `wormd up` printed) for a crash or a kill, and at the \
             watchdog of systemd. On a slope secure the worm before a controller is started again: it begins by switching torque off."
            .to_owned(),
        Cause::Unknown => "Look at the events around it, and record all topics.".to_owned(),
    }
}

/// The wall-clock time of a moment, by the clocks' comparison in the log.
fn unix_ns(log: &Log, time_ns: u64) -> Option<u64> {
    let number = |key: &str| log.metadata.get(key)?.parse::<i128>().ok();
    let unix_ns = number("begun_unix_ns")? + i128::from(time_ns) - number("begun_monotonic_ns")?;
    u64::try_from(unix_ns).ok()
}

fn as_sentence(text: &str) -> String {
    let text = text.trim();
    if text.is_empty() || text.ends_with(['.', '?']) {
        return text.to_owned();
    }
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().collect::<String>() + letters.as_str() + "."
    })
}
