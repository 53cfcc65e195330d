//! The alarm that a log is about, and what is said of it: also where none was raised.

use super::answer::{Reason, Trigger, lower_first, relative_s};
use super::timeline::{fault_name, figure};
use crate::remedy;
use worm_estimator::config::{Config, Policy};
use worm_estimator::message::{Alarm, AlarmKind, Mode};
use worm_estimator::time::seconds;
use worm_log::Log;

/// The alarm that a log without a stop is about: that of the box's event, or else the last since the log began. A log begins with the
/// newest alarms of before, which are told to every late joiner.
pub(super) fn alarm_of(log: &Log, trigger: Option<&Trigger>) -> Option<Alarm> {
    let mut raised = log.alarms.iter().filter(|alarm| is_raised(alarm));
    match trigger {
        Some(trigger) => raised.find(|alarm| alarm.time_ns == trigger.time_ns).copied(),
        None => raised.rfind(|alarm| alarm.time_ns >= begun_ns(log)).copied(),
    }
}

/// Whether the message says that an alarm of the worm was raised.
fn is_raised(alarm: &Alarm) -> bool {
    alarm.raised == 1 && alarm.kind != AlarmKind::RecordingStopped.code()
}

/// When the log begins: with its first state.
fn begun_ns(log: &Log) -> u64 {
    log.states.first().map_or(0, |state| state.time_ns)
}

/// What is said of a log in which nothing stopped, and no alarm was raised.
pub(super) fn of_nothing(log: &Log) -> String {
    let in_fault = log.states.first().filter(|state| state.mode == Mode::Fault.code());
    if let Some(state) = in_fault {
        return format!(
            "Nothing in this log stopped the worm: the fault {} was latched before it began.",
            fault_name(state)
        );
    }
    let begun_ns = begun_ns(log);
    let before = log
        .alarms
        .iter()
        .filter(|alarm| is_raised(alarm) && alarm.time_ns < begun_ns);
    match before.max_by_key(|alarm| alarm.time_ns) {
        Some(alarm) => format!(
            "Nothing in this log stopped the worm, and no alarm was raised in it: the alarm {} was raised {:.1} s before it began.",
            AlarmKind::try_from(alarm.kind).map_or("unknown", AlarmKind::name),
            seconds(begun_ns - alarm.time_ns)
        ),
        None => "Nothing in this log stopped the worm, and no alarm was raised.".to_owned(),
    }
}

/// The mode of the worm at a moment: that of the last state until then, or else of the first.
pub(super) fn mode_at(log: &Log, time_ns: u64) -> Option<Mode> {
    let until = log.states.partition_point(|state| state.time_ns <= time_ns);
    let state = log.states.get(until.saturating_sub(1))?;
    Mode::try_from(state.mode).ok()
}

/// What an alarm did to the worm.
#[derive(Clone, Copy)]
pub(super) enum Then {
    /// It stopped it.
    Stopped,
    /// It did not, and this was the mode of the worm, as far as the log says.
    WentOn(Option<Mode>),
}

/// The alarm as the reason of what happened at a moment.
pub(super) fn of_alarm(alarm: &Alarm, time_ns: u64, then: Then, config: &Config) -> Reason {
    let kind = AlarmKind::try_from(alarm.kind);
    let name = kind.map_or("unknown", AlarmKind::name);
    let cell = (alarm.cell != u32::MAX).then(|| alarm.cell + 1);
    let since_s = relative_s(alarm.since_ns, time_ns);
    let (meaning, policy) = match kind {
        Ok(kind) => (lower_first(&remedy::meaning(kind)), config.alarms.of(kind).policy),
        Err(_) => ("it is of another version".to_owned(), Policy::Warn),
    };
    let of_cell = cell.map_or_else(String::new, |cell| format!(" of cell {cell}"));
    let is_to = match policy {
        Policy::Warn => "warn",
        Policy::Stop => "stop",
        Policy::BackOff => "go back and hold",
        Policy::Hold => "hold",
    };
    let did = match then {
        Then::Stopped => format!("its policy is to {is_to}"),
        Then::WentOn(Some(Mode::Crawling)) if policy == Policy::Warn => {
            "its policy is to warn, so the worm went on".to_owned()
        }
        Then::WentOn(Some(Mode::Crawling)) => {
            format!("its policy is to {is_to}, and this log does not show that the worm did")
        }
        Then::WentOn(Some(mode)) => format!("the worm did not crawl then: it was {mode}"),
        Then::WentOn(None) => "what the worm did then is not in this log".to_owned(),
    };
    let sentence = format!(
        "The alarm {name}{of_cell}: {meaning}. {} against a threshold of {}, since {since_s:.3} s; {did}.",
        figure(alarm.value),
        figure(alarm.threshold)
    );
    Reason {
        kind: "alarm",
        name: name.to_owned(),
        time_s: relative_s(alarm.time_ns, time_ns),
        since_s: Some(since_s),
        cell,
        value: Some(alarm.value).filter(|value| value.is_finite()),
        threshold: Some(alarm.threshold).filter(|threshold| threshold.is_finite()),
        sender: None,
        user: None,
        sentence,
    }
}

#[cfg(test)]
mod tests {
    use super::super::explain_stop;
    use super::*;
    use testkit::log_sample::crawl;
    use worm_estimator::message::{Fault, FieldAccess, Severity, State};

    /// Headline and sentence of a crawl's log of a second, with an alarm that was raised so long after its beginning, s.
    fn told(kind: AlarmKind, raised_s: f64) -> (String, String) {
        let mut telemetry = crawl(1.0);
        for state in &mut telemetry.states {
            state.mode = Mode::Crawling.code();
            // The log begins later than the worm.
            state.time_ns += 1_000_000_000_000;
        }
        let begun_ns = telemetry.states[0].time_ns;
        let raised = Alarm {
            kind: kind.code(),
            raised: 1,
            severity: Severity::Critical.code(),
            time_ns: begun_ns.saturating_add_signed((raised_s * 1e9) as i64),
            ..Alarm::empty()
        };
        explained(telemetry.states, vec![raised])
    }

    fn explained(states: Vec<State>, alarms: Vec<Alarm>) -> (String, String) {
        let log = Log {
            states,
            alarms,
            ..Log::default()
        };
        let found = explain_stop(&log, &Config::default(), None, None);
        let heading = super::super::text::text(&found);
        let notes = found.warnings.join("; ");
        assert!(!notes.contains("older version"), "{notes}");
        let heading = heading.lines().next().unwrap_or_default().to_owned();
        (heading, found.reason.sentence)
    }

    #[test]
    fn an_alarm_of_before_the_log_is_not_its_reason_and_the_mode_says_what_another_did() {
        for (kind, raised_s, heading, part) in [
            (
                AlarmKind::MotorStall,
                -120.0,
                "did not stop",
                "no alarm was raised in it: the alarm motor-stall was raised 120.0 s before it began",
            ),
            (
                AlarmKind::MotorStall,
                0.9,
                "did not stop; alarm motor-stall",
                "its policy is to stop, and this log does not show that the worm did",
            ),
            (
                AlarmKind::ModelMismatch,
                0.3,
                "did not stop; alarm model-mismatch",
                "its policy is to warn, so the worm went on",
            ),
        ] {
            let (said, sentence) = told(kind, raised_s);
            assert!(said.ends_with(heading), "{kind}: {said}");
            assert!(sentence.contains(part), "{kind}: {sentence}");
        }
        let mut telemetry = crawl(1.0);
        telemetry
            .states
            .iter_mut()
            .for_each(|state| state.mode = Mode::Armed.code());
        let alarm = Alarm {
            kind: AlarmKind::MotorStall.code(),
            raised: 1,
            time_ns: telemetry.states[300].time_ns,
            ..Alarm::empty()
        };
        let (_, sentence) = explained(telemetry.states.clone(), vec![alarm]);
        assert!(
            sentence.ends_with("the worm did not crawl then: it was armed."),
            "{sentence}"
        );
        for state in &mut telemetry.states {
            (state.mode, state.fault) = (Mode::Fault.code(), Fault::OverCurrent.code());
        }
        let (_, sentence) = explained(telemetry.states, Vec::new());
        assert!(
            sentence.contains("the fault over-current was latched before it began"),
            "{sentence}"
        );
    }
}
