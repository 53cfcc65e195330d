//! Estimator and alarms together: what the estimator process runs, and a replay.

use super::alarm::{self, AlarmChanges, AlarmMonitor};
use super::{Estimator, EstimatorError, Inference, RangeEstimator, ResidualMap};
use crate::config::Config;
use crate::message::{BlackBoxStatus, CommandRecord, Cycle, Estimate, Inferred, Range, RecordingStatus, State};

/// What one state gave.
#[derive(Debug, Clone)]
pub struct ObserverOutput {
    /// The estimate, if the state carried a tracker sample, or one was due without.
    pub estimate: Option<Estimate>,
    /// The gait cycle that ended, if one did.
    pub cycle: Option<Cycle>,
    /// How far the battery lasts, if a cycle ended and a battery is configured.
    pub range: Option<Range>,
    /// What the motor's current alone says, where that is new and self-sensing is enabled.
    pub inferred: Option<Inferred>,
    /// Alarms that were raised or cleared.
    pub alarms: AlarmChanges,
}

/// Follows one worm by its states. The same states give the same output, to the last bit; a recorder's reports change nothing but the
/// alarm `recording-stopped`, a gauge's readings nothing but the range, and commands nothing but the distance by dead reckoning.
#[derive(Debug)]
pub struct Observer {
    estimator: Estimator,
    monitor: AlarmMonitor,
    range: Option<RangeEstimator>,
    inference: Option<Inference>,
}

impl Observer {
    /// An observer that has seen nothing yet.
    ///
    /// # Errors
    /// [`EstimatorError`] for a configuration that is not valid.
    pub fn new(config: &Config) -> Result<Self, EstimatorError> {
        Ok(Self {
            estimator: Estimator::new(config)?,
            monitor: AlarmMonitor::new(config),
            range: RangeEstimator::new(config)?,
            inference: match config.self_sensing.enabled {
                true => Some(Inference::new(config)?),
                false => None,
            },
        })
    }

    /// Whether the state is of a worm with as many cells as the configured one.
    ///
    /// # Errors
    /// [`EstimatorError::CellCount`] where it is not: [`update`](Self::update) ignores such a state.
    pub fn check(&self, state: &State) -> Result<(), EstimatorError> {
        self.estimator.check(state)
    }

    /// Processes the controller's next state. A state with another number of cells than the configured worm is ignored.
    pub fn update(&mut self, state: &State) -> ObserverOutput {
        if self.check(state).is_err() {
            return ObserverOutput {
                estimate: None,
                cycle: None,
                range: None,
                inferred: None,
                alarms: AlarmChanges::none(),
            };
        }
        let update = self.estimator.update(state);
        let (estimate, cycle) = (update.estimate.copied(), update.cycle.copied());
        let inference = self.inference.as_mut();
        let inferred = inference.and_then(|inference| inference.update(state)).copied();
        let observation = alarm::Observation {
            state,
            estimate: estimate.as_ref().filter(|_| state.sample_is_new == 1),
            cycle: cycle.as_ref(),
            residuals: Some(self.estimator.residual_map()),
            inferred: self.inference.as_ref().map(Inference::latest),
        };
        let alarms = self.monitor.update(&observation);
        if !self.monitor.is_fault_free() {
            self.estimator.exclude_cycle();
        }
        let range = self.range.as_mut().and_then(|range| {
            range.note_state(state);
            if let Some((advance_m, sigma_m)) = inferred.as_ref().and_then(Inferred::known_advance_m) {
                range.note_inferred_advance(advance_m, sigma_m);
            }
            cycle.as_ref().and_then(|cycle| range.note_cycle(cycle))
        });
        ObserverOutput {
            estimate: estimate.map(|estimate| self.with_alarms(estimate)),
            cycle,
            range,
            inferred,
            alarms,
        }
    }

    /// Takes a command that the controller answered: a mark corrects the dead reckoning.
    pub fn note_command(&mut self, record: &CommandRecord) {
        if let Some(inference) = &mut self.inference {
            inference.note_command(record);
        }
    }

    /// Takes what the worm's recorder reports, for the alarm `recording-stopped`.
    pub const fn note_recording(&mut self, status: &RecordingStatus) {
        self.monitor.note_recording(status);
    }

    /// Takes what the worm's black box reports, for the same alarm.
    pub const fn note_black_box(&mut self, status: &BlackBoxStatus) {
        self.monitor.note_black_box(status);
    }

    /// Takes the reading of the battery's gauge, 0 to 1, for the range. A range says which reading it used.
    pub fn note_gauge(&mut self, share: f64) {
        if let Some(range) = &mut self.range {
            range.note_gauge(share);
        }
    }

    /// The newest estimate with the present alarms: a heartbeat while no sample comes.
    pub fn latest(&self) -> Estimate {
        self.with_alarms(*self.estimator.latest())
    }

    /// What the model does not explain of the last cycles: cell by cell, step by step, bin by bin.
    pub fn residual_map(&self) -> &ResidualMap {
        self.estimator.residual_map()
    }

    fn with_alarms(&self, estimate: Estimate) -> Estimate {
        Estimate {
            armed_mask: self.monitor.armed_mask(),
            raised_mask: self.monitor.raised_mask(),
            battery_fraction: self.monitor.battery_fraction(),
            ..estimate
        }
    }
}
