//! What is worth a box: an alarm that is raised, a fault that is latched, a worm whose driver or controller is gone.
//!
//! Pure: messages and time in, events out. Times are ns of `CLOCK_MONOTONIC`; the wall clock decides nothing.

use crate::recorder::Batch;
use crate::relay::departure::Departure;
use std::fmt;
use std::time::Duration;
use worm_estimator::message::{Alarm, AlarmKind, CommandOutcome, CommandRecord, Fault, HoldReason, Mode, State};

/// Silence of a controller that had torque on after which it counts as gone.
const SILENCE: Duration = Duration::from_secs(1);
/// Most that one look at the topics counts as silence: a computer that pauses keeps this process from looking, too.
const LONGEST_LOOK: Duration = Duration::from_millis(100);

/// Why there is a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cause {
    /// An alarm was raised.
    Alarm(AlarmKind),
    /// The controller latched a fault, this one or, by its policy, this alarm.
    Fault(Fault, Option<AlarmKind>),
    /// Whoever made the worm crawl is gone.
    LeaseLapsed,
    /// The watcher that drove fell silent.
    DriverSilent,
    /// The controller fell silent with torque on.
    ControllerSilent,
    /// A controller started anew where one had torque on a moment ago.
    ControllerRestarted,
}

/// Something worth a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Event {
    /// When, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// Why.
    pub cause: Cause,
}

impl Cause {
    /// Its name in the name of a file.
    pub(super) fn short_name(self) -> &'static str {
        match self {
            Self::Alarm(alarm) | Self::Fault(Fault::Alarm, Some(alarm)) => alarm.name(),
            Self::Fault(fault, _) => fault.name(),
            Self::LeaseLapsed => HoldReason::LeaseLapsed.name(),
            Self::DriverSilent => "driver-silent",
            Self::ControllerSilent => "controller-silent",
            Self::ControllerRestarted => "controller-restarted",
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Alarm(alarm) => write!(f, "alarm {alarm}"),
            Self::Fault(Fault::Alarm, Some(alarm)) => write!(f, "fault alarm {alarm}"),
            Self::Fault(fault, _) => write!(f, "fault {fault}"),
            Self::LeaseLapsed | Self::DriverSilent => write!(f, "hold {}", self.short_name()),
            Self::ControllerSilent | Self::ControllerRestarted => f.write_str(self.short_name()),
        }
    }
}

/// Looks for events in what the topics bring.
#[derive(Debug)]
pub(super) struct EventWatch {
    /// Earlier alarms are those of the past: late joiners get them, too.
    begun_ns: u64,
    last: Option<State>,
    silent: Duration,
    is_silent: bool,
}

impl EventWatch {
    /// A watch that begins now.
    pub(super) const fn new(now_ns: u64) -> Self {
        Self {
            begun_ns: now_ns,
            last: None,
            silent: Duration::ZERO,
            is_silent: false,
        }
    }

    /// Takes the new messages. `looked` is how long ago the topics were read before, `now_ns` the present time.
    pub(super) fn update(&mut self, batch: &Batch, looked: Duration, now_ns: u64) -> Vec<Event> {
        let mut events = Vec::new();
        for state in &batch.states {
            events.extend(self.take_state(state));
        }
        events.extend(batch.alarms.iter().filter_map(|alarm| self.take_alarm(alarm)));
        events.extend(batch.commands.iter().filter_map(|record| self.take_command(record)));
        events.sort_by_key(|event| event.time_ns);
        if batch.states.is_empty() {
            self.silent += looked.min(LONGEST_LOOK);
            if self.silent >= SILENCE && !self.is_silent && self.last.as_ref().is_some_and(has_torque) {
                self.is_silent = true;
                events.push(Event {
                    time_ns: now_ns,
                    cause: Cause::ControllerSilent,
                });
            }
        } else {
            (self.silent, self.is_silent) = (Duration::ZERO, false);
        }
        events
    }

    fn take_alarm(&self, alarm: &Alarm) -> Option<Event> {
        let kind = AlarmKind::try_from(alarm.kind).ok()?;
        // Not of the worm, and the black box itself may be what raised it.
        let counts = alarm.raised == 1 && alarm.time_ns >= self.begun_ns && kind != AlarmKind::RecordingStopped;
        counts.then_some(Event {
            time_ns: alarm.time_ns,
            cause: Cause::Alarm(kind),
        })
    }

    fn take_command(&self, record: &CommandRecord) -> Option<Event> {
        let is_silence = Departure::of(record).is_some_and(|departure| departure.is_silence());
        let is_taken = record.outcome == CommandOutcome::Accepted.code();
        (is_silence && is_taken && record.time_ns >= self.begun_ns).then_some(Event {
            time_ns: record.time_ns,
            cause: Cause::DriverSilent,
        })
    }

    fn take_state(&mut self, state: &State) -> Option<Event> {
        let last = self.last.replace(*state)?;
        let cause = if state.sequence < last.sequence {
            // One that was silent before has a box already.
            (has_torque(&last) && !self.is_silent).then_some(Cause::ControllerRestarted)
        } else if state.fault != last.fault && state.fault != Fault::None.code() {
            Fault::try_from(state.fault)
                .ok()
                .map(|fault| Cause::Fault(fault, AlarmKind::try_from(state.fault_alarm).ok()))
        } else {
            let lapsed = HoldReason::LeaseLapsed.code();
            (state.hold_reason == lapsed && last.hold_reason != lapsed).then_some(Cause::LeaseLapsed)
        };
        cause.map(|cause| Event {
            time_ns: state.time_ns,
            cause,
        })
    }
}

/// Whether the motor has torque, as far as the controller knows.
fn has_torque(state: &State) -> bool {
    let without = [Mode::Disarmed, Mode::Fault];
    !without.iter().any(|mode| state.mode == mode.code())
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_estimator::message::{Command, CommandKind, Reply, ShortText};

    const LOOK: Duration = Duration::from_millis(20);

    fn state(sequence: u64, mode: Mode, fault: Fault) -> State {
        State {
            sequence,
            time_ns: 1_000 + sequence,
            mode: mode.code(),
            fault: fault.code(),
            ..State::unknown(4)
        }
    }

    fn of_states(states: &[State]) -> Batch {
        Batch {
            states: states.to_vec(),
            ..Batch::default()
        }
    }

    #[test]
    fn a_fault_counts_once_and_with_the_time_of_its_tick() {
        let mut watch = EventWatch::new(0);
        let crawling = state(1, Mode::Crawling, Fault::None);
        let stopped = [
            state(2, Mode::Fault, Fault::LinkLost),
            state(3, Mode::Fault, Fault::LinkLost),
        ];
        assert_eq!(watch.update(&of_states(&[crawling]), LOOK, 0), []);
        let events = watch.update(&of_states(&stopped), LOOK, 0);
        let cause = Cause::Fault(Fault::LinkLost, None);
        assert_eq!(events, [Event { time_ns: 1_002, cause }]);
        assert_eq!(
            watch.update(&of_states(&[state(4, Mode::Fault, Fault::LinkLost)]), LOOK, 0),
            []
        );
        // A black box that is started while a fault stands has not seen it come.
        assert_eq!(EventWatch::new(0).update(&of_states(&stopped), LOOK, 0), []);
    }

    #[test]
    fn alarms_of_the_past_and_those_about_recordings_do_not_count() {
        let mut watch = EventWatch::new(500);
        let alarm = |kind: AlarmKind, time_ns, raised| Alarm {
            kind: kind.code(),
            time_ns,
            raised,
            ..Alarm::NONE
        };
        let batch = Batch {
            alarms: vec![
                alarm(AlarmKind::MotorStall, 400, 1),
                alarm(AlarmKind::RecordingStopped, 600, 1),
                alarm(AlarmKind::NoProgress, 700, 0),
                alarm(AlarmKind::JammedCell, 800, 1),
            ],
            ..Batch::default()
        };
        let cause = Cause::Alarm(AlarmKind::JammedCell);
        assert_eq!(watch.update(&batch, LOOK, 900), [Event { time_ns: 800, cause }]);
    }

    #[test]
    fn a_driver_that_falls_silent_counts_and_one_that_leaves_does_not() {
        let hold = |time_ns, sender| {
            let command = Command {
                sender: ShortText::new(sender),
                ..Command::new(CommandKind::Hold)
            };
            let reply = Reply {
                sequence: 1,
                verdict: CommandOutcome::Accepted.code(),
                mode: Mode::Holding.code(),
                fault: Fault::None.code(),
                alarm_mask: 0,
            };
            CommandRecord::new(0, (time_ns, 0.0), false, &command, &reply)
        };
        let batch = Batch {
            commands: vec![
                hold(400, "relay: Zoe silent 0.8 s"),
                hold(600, "Zoe"),
                hold(700, "relay: Zoe left"),
                hold(800, "relay: Zoe silent 0.8 s"),
            ],
            ..Batch::default()
        };
        let cause = Cause::DriverSilent;
        let events = EventWatch::new(500).update(&batch, LOOK, 900);
        assert_eq!(events, [Event { time_ns: 800, cause }]);
        assert_eq!(cause.to_string(), "hold driver-silent");
    }

    #[test]
    fn a_controller_that_dies_counts_once_and_a_pause_of_the_computer_does_not() {
        let mut watch = EventWatch::new(0);
        watch.update(&of_states(&[state(9, Mode::Crawling, Fault::None)]), LOOK, 0);
        // The computer stood still for a minute.
        assert_eq!(watch.update(&Batch::default(), Duration::from_secs(60), 1), []);
        let silent: Vec<_> = (0..200)
            .flat_map(|_| watch.update(&Batch::default(), LOOK, 77))
            .collect();
        let cause = Cause::ControllerSilent;
        assert_eq!(silent, [Event { time_ns: 77, cause }]);
        // Its successor is no event of its own …
        assert_eq!(
            watch.update(&of_states(&[state(0, Mode::Disarmed, Fault::None)]), LOOK, 0),
            []
        );
        // … unless it comes before the silence is noticed.
        watch.update(&of_states(&[state(1, Mode::Holding, Fault::None)]), LOOK, 0);
        let restarted = watch.update(&of_states(&[state(0, Mode::Disarmed, Fault::None)]), LOOK, 0);
        let cause = Cause::ControllerRestarted;
        assert_eq!(restarted, [Event { time_ns: 1_000, cause }]);
        // A worm without torque may end.
        assert_eq!(
            (0..200).flat_map(|_| watch.update(&Batch::default(), LOOK, 0)).count(),
            0
        );
    }
}
