//! The estimator process: feeds every state to the pure [`Observer`] and publishes what it finds.

mod gauge;

use crate::attendance::RoundCounter;
use crate::failure::Failure;
use crate::realtime::{self, Grant};
use crate::topics::{Estimator, Hub, Notifier, PortError, PublishError, Publisher, RoleLock, Subscriber};
use gauge::Gauge;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::estimate::{Observer, ObserverOutput};
use worm_estimator::message::{
    Alarm, BlackBoxStatus, CommandRecord, Cycle, Estimate, Inferred, Range, RecordingStatus, State,
};

/// Longest sleep without an event from the controller; should an event get lost, its state is read this much later.
const MAX_SLEEP: Duration = Duration::from_millis(10);

/// Interval at which the last estimate is published again while no state comes, so that the controller knows it is alive.
const HEARTBEAT: Duration = Duration::from_millis(50);

/// How often the recorder's reports, which come once a second, and the gauge's readings are read.
const RECORDER_POLL: Duration = Duration::from_millis(100);

/// The estimator's priority lies this far below the loop's: above ordinary processes, and never in the loop's way.
pub(crate) const PRIORITY_BELOW_LOOP: u8 = 20;

/// Estimates until `end` is set: sleeps until the controller's event, reads every new state, publishes the results.
/// Counts its rounds, calls `ready` once it listens, and `on_state` for each state as soon as it was read.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration that cannot be used; [`Failure::Failed`] when the topics fail.
pub(crate) fn run(
    config: &Config,
    hub: &Hub,
    role: &RoleLock<Estimator>,
    end: &AtomicBool,
    rounds: &RoundCounter,
    ready: impl FnOnce(&[Grant]),
    mut on_state: impl FnMut(&State),
) -> Result<(), Failure> {
    let mut observer = Observer::new(config).map_err(Failure::unusable)?;
    let mut states = hub.subscriber::<State>().map_err(Failure::failed)?;
    let mut recordings = hub.subscriber::<RecordingStatus>().map_err(Failure::failed)?;
    let mut black_boxes = hub.subscriber::<BlackBoxStatus>().map_err(Failure::failed)?;
    let mut commands = hub.subscriber::<CommandRecord>().map_err(Failure::failed)?;
    let mut recorder_polled = Instant::now();
    let state_event = hub.listener::<State>().map_err(Failure::failed)?;
    let mut output = OutputTopics::open(hub, role).map_err(Failure::failed)?;
    let gauge = match config.battery.as_ref().and_then(|battery| battery.gauge.as_ref()) {
        Some(file) => Some(Gauge::open(file.into()).map_err(Failure::failed)?),
        None => None,
    };
    let mut told_of_mismatch = false;
    let mut contradicting_marks = 0;
    ready(&realtime::request(&config.realtime, PRIORITY_BELOW_LOOP));
    while !end.load(Ordering::Relaxed) {
        rounds.count();
        state_event.wait(MAX_SLEEP).map_err(Failure::failed)?;
        if recorder_polled.elapsed() >= RECORDER_POLL {
            recorder_polled = Instant::now();
            note_recording(&mut recordings, &mut black_boxes, &mut observer);
            if let Some(share) = gauge.as_ref().and_then(Gauge::next) {
                observer.note_gauge(share);
            }
        }
        while let Some(record) = commands.next().map_err(Failure::failed)? {
            observer.note_command(&record);
        }
        while let Some(state) = states.next().map_err(Failure::failed)? {
            on_state(&state);
            // Such states get no estimate, so the controller refuses to crawl.
            if let Err(error) = observer.check(&state)
                && !std::mem::replace(&mut told_of_mismatch, true)
            {
                tracing::error!("the controller's states are ignored: {error}");
            }
            let found = observer.update(&state);
            if let Some(inferred) = &found.inferred {
                contradicting_marks = warn_of_mark(inferred, contradicting_marks);
            }
            output.publish(&found).map_err(Failure::failed)?;
        }
        if output.last_published.elapsed() >= HEARTBEAT {
            output.publish_heartbeat(&observer.latest()).map_err(Failure::failed)?;
        }
        if output.admitted.elapsed() >= HEARTBEAT {
            output.admit_late_joiners().map_err(Failure::failed)?;
        }
    }
    Ok(())
}

/// Says that a mark contradicts the dead reckoning where one more of them does than before; returns how many do.
fn warn_of_mark(inferred: &Inferred, before: u32) -> u32 {
    if inferred.contradicting_marks > before {
        tracing::warn!(
            "the mark is {:+.0} ± {:.0} mm off the dead reckoning: this mark or one before is wrong, or the worm slid or was carried; \
             give another mark where it can be seen",
            1e3 * inferred.mark_off_m,
            1e3 * inferred.mark_off_sigma_m
        );
    }
    inferred.contradicting_marks
}

/// Reads the reports of recorder and black box. One that cannot be read is one that did not come.
fn note_recording(
    recordings: &mut Subscriber<RecordingStatus>,
    black_boxes: &mut Subscriber<BlackBoxStatus>,
    observer: &mut Observer,
) {
    match recordings.latest() {
        Ok(Some(status)) => observer.note_recording(&status),
        Ok(None) => {}
        Err(error) => tracing::debug!("{error}"),
    }
    match black_boxes.latest() {
        Ok(Some(status)) => observer.note_black_box(&status),
        Ok(None) => {}
        Err(error) => tracing::debug!("{error}"),
    }
}

/// The topics that the estimator writes.
struct OutputTopics {
    estimate: Publisher<Estimate>,
    cycle: Publisher<Cycle>,
    alarm: Publisher<Alarm>,
    range: Publisher<Range>,
    inferred: Publisher<Inferred>,
    alarm_event: Notifier<Alarm>,
    /// When an estimate was last published.
    last_published: Instant,
    /// When late joiners were last admitted.
    admitted: Instant,
}

impl OutputTopics {
    fn open(hub: &Hub, role: &RoleLock<Estimator>) -> Result<Self, PortError> {
        Ok(Self {
            estimate: hub.publisher(role)?,
            cycle: hub.publisher(role)?,
            alarm: hub.publisher(role)?,
            range: hub.publisher(role)?,
            inferred: hub.publisher(role)?,
            alarm_event: hub.notifier(role)?,
            last_published: Instant::now(),
            admitted: Instant::now(),
        })
    }

    fn publish(&mut self, found: &ObserverOutput) -> Result<(), PublishError> {
        for alarm in found.alarms.iter() {
            self.alarm.publish(alarm)?;
        }
        if !found.alarms.is_empty() {
            // A lack of listeners is not the estimator's problem.
            let _ = self.alarm_event.notify();
        }
        if let Some(estimate) = &found.estimate {
            self.estimate.publish(estimate)?;
            self.last_published = Instant::now();
        }
        if let Some(cycle) = &found.cycle {
            self.cycle.publish(cycle)?;
        }
        if let Some(range) = &found.range {
            self.range.publish(range)?;
        }
        if let Some(inferred) = &found.inferred {
            self.inferred.publish(inferred)?;
        }
        Ok(())
    }

    /// Shows that the estimator is alive.
    fn publish_heartbeat(&mut self, latest: &Estimate) -> Result<(), PublishError> {
        self.estimate.publish(latest)?;
        self.last_published = Instant::now();
        Ok(())
    }

    /// Gives late joiners the last values of the topics that are rarely written.
    fn admit_late_joiners(&mut self) -> Result<(), PublishError> {
        self.admitted = Instant::now();
        self.cycle.idle()?;
        self.range.idle()?;
        self.inferred.idle()?;
        self.alarm.idle()
    }
}
