//! What `wormd up` hears of its worm.

use crate::command::Failure;
use crate::message::{Alarm, Cycle, Estimate, Mode, State, Timing};
use crate::topics::{Hub, Subscriber};
use crate::watch::Telemetry;
use std::time::{Duration, Instant};

/// All topics of the worm.
pub(super) struct Ears {
    state: Subscriber<State>,
    timing: Subscriber<Timing>,
    estimate: Subscriber<Estimate>,
    cycle: Subscriber<Cycle>,
    alarm: Subscriber<Alarm>,
}

impl Ears {
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

    /// Listens until a condition holds; false when it did not within `patience`, or `hopeless` says that it will not.
    pub(super) fn wait_for(
        &mut self,
        telemetry: &mut Telemetry,
        patience: Duration,
        mut hopeless: impl FnMut() -> bool,
        condition: impl Fn(&Telemetry) -> bool,
    ) -> bool {
        let begun = Instant::now();
        loop {
            self.listen(telemetry);
            if condition(telemetry) {
                return true;
            }
            if begun.elapsed() > patience || hopeless() {
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
}
