//! What a parent of the worm's processes hears of its worm, and how it gets it to crawl.

use super::Failure;
use super::send_command::give;
use crate::topics::{CommandClient, Hub, Subscriber};
use crate::watch::Telemetry;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{Alarm, CommandKind, Cycle, Estimate, Mode, State, Timing};

/// How long the worm may take to reach a mode that it was commanded into, beside the time of the ramp.
pub(super) const MODE_PATIENCE: Duration = Duration::from_secs(5);

/// All topics of the worm.
pub(super) struct TelemetryReceiver {
    state: Subscriber<State>,
    timing: Subscriber<Timing>,
    estimate: Subscriber<Estimate>,
    cycle: Subscriber<Cycle>,
    alarm: Subscriber<Alarm>,
}

impl TelemetryReceiver {
    pub(super) fn open(hub: &Hub) -> Result<Self, Failure> {
        Ok(Self {
            state: hub.subscriber().map_err(Failure::failed)?,
            timing: hub.subscriber().map_err(Failure::failed)?,
            estimate: hub.subscriber().map_err(Failure::failed)?,
            cycle: hub.subscriber().map_err(Failure::failed)?,
            alarm: hub.subscriber().map_err(Failure::failed)?,
        })
    }

    /// Takes everything that has come. A topic that cannot be read is one that says nothing; the processes tell why.
    pub(super) fn listen(&mut self, telemetry: &mut Telemetry) {
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
    }

    /// Listens until a condition holds; false when it did not within `timeout`, or `should_abort` says that it will not.
    pub(super) fn wait_for(
        &mut self,
        telemetry: &mut Telemetry,
        timeout: Duration,
        mut should_abort: impl FnMut() -> bool,
        condition: impl Fn(&Telemetry) -> bool,
    ) -> bool {
        let begun = Instant::now();
        loop {
            self.listen(telemetry);
            if condition(telemetry) {
                return true;
            }
            if begun.elapsed() > timeout || should_abort() {
                return false;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Where the controller stands, by the newest state.
    pub(super) fn mode(&mut self, telemetry: &mut Telemetry) -> Mode {
        self.listen(telemetry);
        telemetry
            .state
            .and_then(|state| Mode::try_from(state.mode).ok())
            .unwrap_or(Mode::Disarmed)
    }

    /// Has the worm armed, waits until it and the estimator are ready, and has it crawl; nothing more once `end` is set.
    pub(super) fn start_crawling(
        &mut self,
        client: &CommandClient,
        config: &Config,
        telemetry: &mut Telemetry,
        end: &AtomicBool,
        mut should_abort: impl FnMut() -> bool,
    ) -> Result<(), Failure> {
        give(client, CommandKind::Arm)?;
        let armed = self.wait_for(
            telemetry,
            MODE_PATIENCE,
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
                "the worm was not ready to crawl within {MODE_PATIENCE:?} (it is {mode}); the log tells why"
            )));
        }
        give(client, CommandKind::Crawl)
    }
}
