//! `wormd estimate`: the estimator alone, beside a running controller.

use super::{Failure, WormArgs, end_on_signal, print, report_grants};
use crate::realtime::{self, Grant};
use crate::topics::{Estimator, Hub, Instance, Notifier, PortError, PublishError, Publisher, RoleLock};
use clap::Args;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::estimate::{Observer, ObserverOutput};
use worm_estimator::message::{Alarm, Cycle, Estimate, State};

/// How long the estimator sleeps at most while the controller wakes it with no state, and so how late it knows at most should
/// an event ever get lost.
const LONGEST_SLEEP: Duration = Duration::from_millis(10);

/// How often it says that it lives while no sample comes.
const HEARTBEAT: Duration = Duration::from_millis(50);

/// The estimator runs so far below the loop's priority: above ordinary processes, never in the loop's way.
pub(super) const PRIORITY_BELOW_LOOP: u8 = 20;

/// Arguments of `wormd estimate`.
#[derive(Debug, Args)]
pub struct EstimateArgs {
    #[command(flatten)]
    worm: WormArgs,
}

/// Runs `wormd estimate` until it is told to end. When it is ready it says so on one line of standard output.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration or worm that cannot be used; [`Failure::Failed`] when the topics fail.
pub fn run(args: &EstimateArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let role = RoleLock::<Estimator>::take(&instance).map_err(Failure::unusable)?;
    let hub = Hub::open(&instance).map_err(Failure::failed)?;
    attend(
        &config,
        &hub,
        &role,
        &end,
        |grants| {
            report_grants(grants);
            // One who does not want to know when it is ready may have closed the pipe.
            let _ = print::line("ready");
        },
        |_| {},
    )
}

/// Estimates until `end` is set: sleeps until the controller's event, takes every state that has come, tells what it found.
/// `ready` is called once it listens; `heard` for each state as soon as it is in hand.
///
/// # Errors
/// As [`run`].
pub(super) fn attend(
    config: &Config,
    hub: &Hub,
    role: &RoleLock<Estimator>,
    end: &AtomicBool,
    ready: impl FnOnce(&[Grant]),
    mut heard: impl FnMut(&State),
) -> Result<(), Failure> {
    let mut observer = Observer::new(config).map_err(Failure::unusable)?;
    let mut states = hub.subscriber::<State>().map_err(Failure::failed)?;
    let bell = hub.listener::<State>().map_err(Failure::failed)?;
    let mut voice = Voice::open(hub, role).map_err(Failure::failed)?;
    ready(&realtime::request(&config.realtime, PRIORITY_BELOW_LOOP));
    while !end.load(Ordering::Relaxed) {
        bell.wait(LONGEST_SLEEP).map_err(Failure::failed)?;
        while let Some(state) = states.next().map_err(Failure::failed)? {
            heard(&state);
            voice.tell(&observer.update(&state)).map_err(Failure::failed)?;
        }
        if voice.spoken.elapsed() >= HEARTBEAT {
            voice.beat(&observer.latest()).map_err(Failure::failed)?;
        }
    }
    Ok(())
}

/// The topics that the estimator writes.
struct Voice {
    estimate: Publisher<Estimate>,
    cycle: Publisher<Cycle>,
    alarm: Publisher<Alarm>,
    alarm_event: Notifier<Alarm>,
    spoken: Instant,
}

impl Voice {
    fn open(hub: &Hub, role: &RoleLock<Estimator>) -> Result<Self, PortError> {
        Ok(Self {
            estimate: hub.publisher(role)?,
            cycle: hub.publisher(role)?,
            alarm: hub.publisher(role)?,
            alarm_event: hub.notifier(role)?,
            spoken: Instant::now(),
        })
    }

    fn tell(&mut self, report: &ObserverOutput) -> Result<(), PublishError> {
        for alarm in report.alarms.iter() {
            self.alarm.publish(alarm)?;
        }
        if !report.alarms.is_empty() {
            // Nobody listening is no trouble of the estimator's.
            let _ = self.alarm_event.notify();
        }
        if let Some(estimate) = &report.estimate {
            self.estimate.publish(estimate)?;
            self.spoken = Instant::now();
        }
        if let Some(cycle) = &report.cycle {
            self.cycle.publish(cycle)?;
        }
        Ok(())
    }

    /// Says that the estimator lives, and lets late joiners of the quiet topics have their last values.
    fn beat(&mut self, latest: &Estimate) -> Result<(), PublishError> {
        self.estimate.publish(latest)?;
        self.spoken = Instant::now();
        self.cycle.idle()?;
        self.alarm.idle()
    }
}
