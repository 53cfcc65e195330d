//! All topics of the worm, read into one [`Telemetry`], and the start of a crawl, which waits for them.

use super::controller::order;
use crate::failure::Failure;
use crate::topics::{CommandClient, Hub, Subscriber};
use crate::watch::Telemetry;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{
    Alarm, CommandKind, CommandRecord, Cycle, Estimate, Inferred, Mode, Range, RecordingStatus, State, Timing,
    TripStatus,
};

/// How long the worm may take to reach a commanded mode, beyond the time of the ramp.
pub(crate) const MODE_TIMEOUT: Duration = Duration::from_secs(5);

/// All topics of the worm.
pub(crate) struct TelemetryReceiver {
    state: Subscriber<State>,
    timing: Subscriber<Timing>,
    estimate: Subscriber<Estimate>,
    cycle: Subscriber<Cycle>,
    alarm: Subscriber<Alarm>,
    range: Subscriber<Range>,
    command: Subscriber<CommandRecord>,
    recording: Subscriber<RecordingStatus>,
    trip: Subscriber<TripStatus>,
    inferred: Subscriber<Inferred>,
}

impl TelemetryReceiver {
    /// Subscribes to all topics.
    ///
    /// # Errors
    /// [`Failure::Failed`] when iceoryx2 refuses.
    pub(crate) fn open(hub: &Hub) -> Result<Self, Failure> {
        Ok(Self {
            state: hub.subscriber().map_err(Failure::failed)?,
            timing: hub.subscriber().map_err(Failure::failed)?,
            estimate: hub.subscriber().map_err(Failure::failed)?,
            cycle: hub.subscriber().map_err(Failure::failed)?,
            alarm: hub.subscriber().map_err(Failure::failed)?,
            range: hub.subscriber().map_err(Failure::failed)?,
            command: hub.subscriber().map_err(Failure::failed)?,
            recording: hub.subscriber().map_err(Failure::failed)?,
            trip: hub.subscriber().map_err(Failure::failed)?,
            inferred: hub.subscriber().map_err(Failure::failed)?,
        })
    }

    /// Reads everything new. A topic that cannot be read counts as silent; the processes log the reason.
    pub(crate) fn poll(&mut self, telemetry: &mut Telemetry) {
        while let Ok(Some(state)) = self.state.next() {
            telemetry.take_state(&state);
        }
        while let Ok(Some(timing)) = self.timing.next() {
            telemetry.take_timing(&timing);
        }
        while let Ok(Some(estimate)) = self.estimate.next() {
            telemetry.take_estimate(&estimate);
        }
        while let Ok(Some(cycle)) = self.cycle.next() {
            telemetry.take_cycle(&cycle);
        }
        while let Ok(Some(alarm)) = self.alarm.next() {
            telemetry.take_alarm(&alarm);
        }
        while let Ok(Some(range)) = self.range.next() {
            telemetry.take_range(&range);
        }
        while let Ok(Some(record)) = self.command.next() {
            telemetry.take_command(&record);
        }
        while let Ok(Some(status)) = self.recording.next() {
            telemetry.take_recording(&status);
        }
        while let Ok(Some(trip)) = self.trip.next() {
            telemetry.take_trip(&trip);
        }
        while let Ok(Some(inferred)) = self.inferred.next() {
            telemetry.take_inferred(&inferred);
        }
    }

    /// Reads until `condition` holds; false when it does not within `timeout`, or `should_abort` returns true.
    pub(crate) fn wait_for(
        &mut self,
        telemetry: &mut Telemetry,
        timeout: Duration,
        mut should_abort: impl FnMut() -> bool,
        condition: impl Fn(&Telemetry) -> bool,
    ) -> bool {
        let begun = Instant::now();
        loop {
            self.poll(telemetry);
            if condition(telemetry) {
                return true;
            }
            if begun.elapsed() > timeout || should_abort() {
                return false;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// The controller's mode in the newest state.
    pub(crate) fn mode(&mut self, telemetry: &mut Telemetry) -> Mode {
        self.poll(telemetry);
        telemetry
            .state
            .and_then(|state| Mode::try_from(state.mode).ok())
            .unwrap_or(Mode::Disarmed)
    }

    /// Arms the worm, waits until it and the estimator are ready, and makes it crawl; returns early once `end` is set.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the controller refuses a command, or the worm is not ready in time.
    pub(crate) fn start_crawling(
        &mut self,
        client: &CommandClient,
        config: &Config,
        telemetry: &mut Telemetry,
        end: &AtomicBool,
        mut should_abort: impl FnMut() -> bool,
    ) -> Result<(), Failure> {
        order(client, CommandKind::Arm)?;
        let armed = self.wait_for(
            telemetry,
            MODE_TIMEOUT,
            || end.load(Ordering::Relaxed) || should_abort(),
            |telemetry| {
                telemetry.state.is_some_and(|state| state.mode == Mode::Armed.code())
                    && (telemetry.estimate.is_some() || !config.control.require_estimator)
            },
        );
        if end.load(Ordering::Relaxed) {
            return Ok(());
        }
        if !armed {
            let mode = self.mode(telemetry);
            return Err(Failure::failed(format!(
                "the worm was not ready to crawl within {MODE_TIMEOUT:?} (it is {mode}); the log says why"
            )));
        }
        order(client, CommandKind::Crawl)
    }
}
