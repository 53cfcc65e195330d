//! The topics that a recorder reads, and what one look at them brings.

use crate::failure::Failure;
use crate::topics::{Hub, Subscriber, Topic};
use worm_estimator::message::{Alarm, CommandRecord, Cycle, Estimate, Inferred, Range, State, Timing, TripStatus};
use worm_log::{Channel, Logged};

/// The new messages of one poll.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    pub states: Vec<State>,
    pub timings: Vec<Timing>,
    pub estimates: Vec<Estimate>,
    pub cycles: Vec<Cycle>,
    pub alarms: Vec<Alarm>,
    pub ranges: Vec<Range>,
    pub commands: Vec<CommandRecord>,
    pub trips: Vec<TripStatus>,
    pub inferred: Vec<Inferred>,
}

impl Batch {
    /// How many messages.
    pub(crate) fn len(&self) -> usize {
        let by_tick = self.states.len() + self.timings.len() + self.estimates.len();
        by_tick
            + self.cycles.len()
            + self.alarms.len()
            + self.ranges.len()
            + self.commands.len()
            + self.trips.len()
            + self.inferred.len()
    }

    /// Leaves out the results that were over before this time, ns of `CLOCK_MONOTONIC`: topics give their last messages to who joins late, and
    /// those are of another run. Alarms, commands and trips of before may still hold, and stay.
    pub(crate) fn leave_out_results_before(&mut self, time_ns: u64) {
        self.cycles.retain(|cycle| cycle.end_ns >= time_ns);
        self.ranges.retain(|range| range.end_ns >= time_ns);
        self.inferred.retain(|inferred| inferred.time_ns >= time_ns);
    }

    /// Leaves out what is of other topics than these; never the commands.
    pub(crate) fn keep_only(&mut self, topics: &[Channel]) {
        fn keep<T: Logged>(topics: &[Channel], messages: &mut Vec<T>) {
            if !topics.contains(&T::CHANNEL) {
                messages.clear();
            }
        }
        keep(topics, &mut self.states);
        keep(topics, &mut self.timings);
        keep(topics, &mut self.estimates);
        keep(topics, &mut self.cycles);
        keep(topics, &mut self.alarms);
        keep(topics, &mut self.ranges);
        keep(topics, &mut self.trips);
        keep(topics, &mut self.inferred);
    }
}

/// A topic, if it is recorded.
type Recorded<T> = Option<Subscriber<T>>;

/// The topics that are recorded.
pub(crate) struct RecordedTopics {
    state: Recorded<State>,
    timing: Recorded<Timing>,
    estimate: Recorded<Estimate>,
    cycle: Recorded<Cycle>,
    alarm: Recorded<Alarm>,
    range: Recorded<Range>,
    command: Recorded<CommandRecord>,
    trip: Recorded<TripStatus>,
    inferred: Recorded<Inferred>,
}

impl RecordedTopics {
    /// Subscribes to these topics, and to the commands.
    ///
    /// # Errors
    /// [`Failure::Failed`] when a topic has no room for another reader.
    pub(crate) fn open(hub: &Hub, topics: &[Channel]) -> Result<Self, Failure> {
        fn subscribe<T: Topic + Logged>(hub: &Hub, topics: &[Channel]) -> Result<Recorded<T>, Failure> {
            let is_wanted = topics.contains(&T::CHANNEL);
            is_wanted.then(|| hub.subscriber()).transpose().map_err(Failure::failed)
        }
        Ok(Self {
            state: subscribe(hub, topics)?,
            timing: subscribe(hub, topics)?,
            estimate: subscribe(hub, topics)?,
            cycle: subscribe(hub, topics)?,
            alarm: subscribe(hub, topics)?,
            range: subscribe(hub, topics)?,
            // Part of every recording: nobody can tell from the rest why the worm began or ended to crawl.
            command: subscribe(hub, &[Channel::CommandRecord])?,
            trip: subscribe(hub, topics)?,
            inferred: subscribe(hub, topics)?,
        })
    }

    /// Reads what is new.
    ///
    /// # Errors
    /// [`Failure::Failed`] when a topic cannot be read.
    pub(crate) fn read(&mut self) -> Result<Batch, Failure> {
        fn take<T: Topic>(topic: &mut Recorded<T>) -> Result<Vec<T>, Failure> {
            let mut messages = Vec::new();
            if let Some(subscriber) = topic {
                while let Some(message) = subscriber.next().map_err(Failure::failed)? {
                    messages.push(*message);
                }
            }
            Ok(messages)
        }
        Ok(Batch {
            states: take(&mut self.state)?,
            timings: take(&mut self.timing)?,
            estimates: take(&mut self.estimate)?,
            cycles: take(&mut self.cycle)?,
            alarms: take(&mut self.alarm)?,
            ranges: take(&mut self.range)?,
            commands: take(&mut self.command)?,
            trips: take(&mut self.trip)?,
            inferred: take(&mut self.inferred)?,
        })
    }

    /// How many messages of a topic were lost; none for a topic that is not recorded, or whose messages are not numbered.
    pub(crate) fn lost(&self, channel: Channel) -> Option<u64> {
        match channel {
            Channel::State => self.state.as_ref().map(Subscriber::lost),
            Channel::Timing => self.timing.as_ref().map(Subscriber::lost),
            Channel::Estimate => None,
            Channel::Cycle => self.cycle.as_ref().map(Subscriber::lost),
            Channel::Alarm => self.alarm.as_ref().map(Subscriber::lost),
            Channel::Range => self.range.as_ref().map(Subscriber::lost),
            Channel::CommandRecord => self.command.as_ref().map(Subscriber::lost),
            Channel::TripStatus => self.trip.as_ref().map(Subscriber::lost),
            Channel::Inferred => self.inferred.as_ref().map(Subscriber::lost),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::log_sample::crawl;

    #[test]
    fn results_of_before_the_recording_are_left_out_and_what_may_still_hold_stays() {
        let crawled = crawl(6.0);
        let begun_ns = crawled.cycles[0].end_ns + 1;
        let mut batch = Batch {
            cycles: crawled.cycles.clone(),
            alarms: vec![Alarm::NONE],
            ..Batch::default()
        };
        batch.leave_out_results_before(begun_ns);
        assert!(!batch.cycles.is_empty() && batch.cycles.len() == crawled.cycles.len() - 1);
        assert!(batch.cycles.iter().all(|cycle| cycle.end_ns >= begun_ns));
        assert_eq!(batch.alarms.len(), 1);
    }
}
