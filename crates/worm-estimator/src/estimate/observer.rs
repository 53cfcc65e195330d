//! Estimator and alarms together: what an estimator process, or a recording that is played back, runs.

use super::alarm::{self, AlarmChanges, AlarmMonitor};
use super::{Estimator, EstimatorError, ResidualMap};
use crate::config::Config;
use crate::message::{Cycle, Estimate, State};

/// What one state has brought.
#[derive(Debug, Clone)]
pub struct ObserverOutput {
    /// The estimate, when the state carried a tracker sample.
    pub estimate: Option<Estimate>,
    /// The gait cycle that ended.
    pub cycle: Option<Cycle>,
    /// Alarms that were raised or cleared.
    pub alarms: AlarmChanges,
}

/// Follows one worm by its states.
///
/// Pure: the same states give the same reports, to the last bit.
#[derive(Debug)]
pub struct Observer {
    estimator: Estimator,
    watch: AlarmMonitor,
}

impl Observer {
    /// An observer that has seen nothing yet.
    ///
    /// # Errors
    /// [`EstimatorError`] for a configuration that is not valid.
    pub fn new(config: &Config) -> Result<Self, EstimatorError> {
        Ok(Self {
            estimator: Estimator::new(config)?,
            watch: AlarmMonitor::new(config),
        })
    }

    /// Takes the controller's next state.
    pub fn update(&mut self, state: &State) -> ObserverOutput {
        let update = self.estimator.update(state);
        let (estimate, cycle) = (update.estimate.copied(), update.cycle.copied());
        let observation = alarm::Observation {
            state,
            estimate: estimate.as_ref(),
            cycle: cycle.as_ref(),
            residuals: Some(self.estimator.residual_map()),
        };
        let alarms = self.watch.update(&observation);
        if !self.watch.is_sound() {
            self.estimator.exclude_cycle();
        }
        ObserverOutput {
            estimate: estimate.map(|estimate| self.with_alarms(estimate)),
            cycle,
            alarms,
        }
    }

    /// The newest estimate, with the alarms as they stand now: for a heartbeat while no sample comes.
    pub fn latest(&self) -> Estimate {
        self.with_alarms(*self.estimator.latest())
    }

    /// What the model does not explain of the last cycles: cell by cell, step by step, bin by bin.
    pub fn residual_map(&self) -> &ResidualMap {
        self.estimator.residual_map()
    }

    fn with_alarms(&self, estimate: Estimate) -> Estimate {
        Estimate {
            armed_mask: self.watch.armed_mask(),
            raised_mask: self.watch.raised_mask(),
            battery_fraction: self.watch.battery_fraction(),
            ..estimate
        }
    }
}
