//! The alarms: what is wrong with the worm, since when, and by how much.
//!
//! [`AlarmMonitor::update`] takes every state, with the estimate from a new tracker sample and the cycle that ended, if any, and returns the
//! alarms that were raised or cleared. It has no clock: time is [`State::time_ns`]. It allocates nothing.
//!
//! Reading order: `cam_motion` follows the cam and `sample` selects the positions to trust. Each detector (`stall`, `jam`, `stride` with
//! `progress` and `sliding`, `cusum` with `energy`, `battery`, `link`, `tracker`, `device`, `mismatch`, `recording`, `inferred`) describes its decision rule at
//! the top of its file. `latch` turns their output into one "raised" and one "cleared".
//!
//! **Calibration.** Baselines are learned on the first `estimator.calibration_cycles` good cycles, as functions of the gait phase:
//! extensions and energy for the present speed and direction, advance and retraction for each direction. Where a gross fault shows without
//! calibration (a cell that does not move, a worm that does not advance, a long slide) the alarm is armed from the start with a wide
//! threshold. Where it does not (energy), it is unarmed until then, and [`AlarmMonitor::armed_mask`] says so. Cycles with a fault are never
//! used for calibration.
//!
//! **Without positions** jam, progress, sliding and model mismatch cannot be armed, and `energy` and `battery` watch less; `coverage` says
//! what each can watch on the configured worm.
//!
//! **Clearing.** An alarm is cleared when its condition has clearly been over for a while. Stall, jam and lack of progress can exist only
//! while the worm is commanded to move: they also clear two seconds after it no longer is, so that the fault that they caused can be
//! reset. Energy, battery and model mismatch keep their alarm through pauses.
//!
//! **Restart.** When the controller's sequence goes back, everything raised is cleared and learned anew, except the charge of the battery
//! and the state of the recorder, which did not change.
//!
//! **Recorder.** `recording` is the only detector with an input besides the states: [`AlarmMonitor::note_recording`]. A log does not hold
//! that input, so a replay of the log has no `recording-stopped`, and the comparison with the log leaves that alarm out.

mod battery;
mod cam_motion;
mod changes;
mod coverage;
mod cusum;
mod device;
mod energy;
mod inferred;
mod jam;
mod latch;
mod link;
mod mismatch;
mod progress;
mod recording;
mod sample;
mod sliding;
mod stall;
mod stride;
mod tracker;

#[cfg(test)]
mod tests;

pub use changes::AlarmChanges;
pub use coverage::Coverage;

use crate::config::Config;
use crate::estimate::ResidualMap;
use crate::message::{AlarmKind, BlackBoxStatus, Cycle, Estimate, Inferred, RecordingStatus, State};
use cam_motion::{CamMotion, Tick};
use latch::{Delays, DetectorOutput, Latch};
use sample::VisibleCells;
use worm_physics::MAX_CELLS;

/// The input of one tick.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a> {
    /// The controller's state, every tick.
    pub state: &'a State,
    /// The estimate, if a new tracker sample came.
    pub estimate: Option<&'a Estimate>,
    /// The gait cycle that ended, if one did.
    pub cycle: Option<&'a Cycle>,
    /// The present residuals against the model.
    pub residuals: Option<&'a ResidualMap>,
    /// What the motor's current alone says, as of the last cycle that was fitted.
    pub inferred: Option<&'a Inferred>,
}

/// Monitors one worm for every [`AlarmKind`].
#[derive(Debug, Clone)]
pub struct AlarmMonitor {
    cells: usize,
    initial: Detectors, // as they are before the first tick
    detectors: Detectors,
    battery: battery::BatteryLow,
    recording: recording::RecordingStopped,
    by_current: inferred::ByCurrent,
    latches: [Latch; KINDS],
    armed_mask: u32,
    next_sequence: u64,
}

const KINDS: usize = AlarmKind::ALL.len();

/// Age from which the output of a position detector no longer counts, s.
const STALE_S: f64 = 0.5;

/// Everything that starts over when the controller does.
#[derive(Debug, Clone)]
struct Detectors {
    cam_motion: CamMotion,
    visible_cells: VisibleCells,
    strides: stride::Strides,
    stall: stall::MotorStall,
    jam: jam::JammedCell,
    progress: progress::NoProgress,
    sliding: sliding::SlidingDown,
    energy: energy::EnergyOverBudget,
    link: link::LinkFault,
    tracker: Option<tracker::TrackerFault>, // none without a tracker
    device: device::DeviceFault,
    mismatch: mismatch::ModelMismatch,
    by_position: [DetectorOutput; 3], // jam, progress, sliding, as of the last sample
    sample_age_s: f64,
}

impl AlarmMonitor {
    /// A monitor for a worm of a checked configuration, before its first tick.
    pub fn new(config: &Config) -> Self {
        let detectors = Detectors {
            cam_motion: CamMotion::new(config),
            visible_cells: VisibleCells::new(),
            strides: stride::Strides::new(),
            stall: stall::MotorStall::new(config),
            jam: jam::JammedCell::new(config),
            progress: progress::NoProgress::new(config),
            sliding: sliding::SlidingDown::new(config),
            energy: energy::EnergyOverBudget::new(config),
            link: link::LinkFault::new(config),
            tracker: config.tracker.present.then(|| tracker::TrackerFault::new(config)),
            device: device::DeviceFault::new(config),
            mismatch: mismatch::ModelMismatch::new(config),
            by_position: [DetectorOutput::Unknown; 3],
            sample_age_s: 0.0,
        };
        Self {
            cells: config.worm.cells.min(MAX_CELLS),
            initial: detectors.clone(),
            detectors,
            battery: battery::BatteryLow::new(config),
            recording: recording::RecordingStopped::new(config),
            by_current: inferred::ByCurrent::new(config),
            latches: std::array::from_fn(|index| {
                let kind = AlarmKind::ALL[index];
                Latch::new(kind, delays_of(kind))
            }),
            armed_mask: 0,
            next_sequence: 0,
        }
    }

    /// Takes what the recorder reports. It counts from the next tick on.
    pub const fn note_recording(&mut self, status: &RecordingStatus) {
        self.recording.note(status);
    }

    /// Takes what the black box reports, for the same alarm.
    pub const fn note_black_box(&mut self, status: &BlackBoxStatus) {
        self.recording.note_black_box(status);
    }

    /// Processes one tick and returns the alarms that it raised or cleared.
    pub fn update(&mut self, observation: &Observation<'_>) -> AlarmChanges {
        let state = observation.state;
        let mut changes = AlarmChanges::none();
        let mut tick = self.detectors.cam_motion.update(state);
        if tick.restarted {
            for latch in &mut self.latches {
                if let Some(alarm) = latch.reset(tick.now_ns, state.phase) {
                    changes.push(alarm, &mut self.next_sequence);
                }
            }
            self.detectors.clone_from(&self.initial);
            tick = self.detectors.cam_motion.update(state);
        }
        let fault_free = self.is_fault_free();
        let findings = self.findings(&tick, observation, fault_free);
        self.armed_mask = 0;
        for (finding, latch) in findings.iter().zip(&mut self.latches) {
            self.armed_mask |= u32::from(finding.is_armed()) << latch.kind().code();
            let phase = match latch.kind() {
                AlarmKind::ModelMismatch => self.detectors.mismatch.phase_before(state.phase),
                _ => state.phase,
            };
            if let Some(alarm) = latch.update(tick.now_ns, phase, finding) {
                changes.push(alarm, &mut self.next_sequence);
            }
        }
        changes
    }

    /// Bit k is set while the alarm with code k is armed.
    pub const fn armed_mask(&self) -> u32 {
        self.armed_mask
    }

    /// Bit k is set while the alarm with code k is raised.
    pub fn raised_mask(&self) -> u32 {
        self.latches
            .iter()
            .map(|latch| u32::from(latch.is_raised()) << latch.kind().code())
            .sum()
    }

    /// Whether no alarm is raised that makes a cycle unfit for calibration.
    pub fn is_fault_free(&self) -> bool {
        [
            AlarmKind::MotorStall,
            AlarmKind::JammedCell,
            AlarmKind::NoProgress,
            AlarmKind::SlidingDown,
            AlarmKind::TrackerFault,
        ]
        .iter()
        .all(|kind| !self.is_raised(*kind))
    }

    /// Charge left in the battery, 0 to 1; `NaN` without a battery or before its voltage was read.
    pub const fn battery_fraction(&self) -> f64 {
        self.battery.fraction()
    }

    fn is_raised(&self, kind: AlarmKind) -> bool {
        self.latches[kind as usize].is_raised()
    }

    /// The output of every detector, in the order of [`AlarmKind::ALL`].
    fn findings(&mut self, tick: &Tick, observation: &Observation<'_>, fault_free: bool) -> [DetectorOutput; KINDS] {
        let Observation {
            state,
            estimate,
            cycle,
            residuals,
            inferred,
        } = *observation;
        let detectors = &mut self.detectors;
        detectors.visible_cells.follow(state, self.cells);
        if let Some(cycle) = cycle {
            detectors.progress.note_cycle(cycle);
            self.battery.note_cycle(tick, cycle);
        }
        match estimate {
            Some(estimate) => {
                let positions = detectors.visible_cells.positions(estimate, self.cells);
                self.battery.note_positions(&positions);
                detectors.sample_age_s = 0.0;
                detectors.by_position = detectors.evaluate_positions(tick, &positions, fault_free);
            }
            None => {
                detectors.sample_age_s += tick.step_s;
                if detectors.sample_age_s > STALE_S {
                    detectors.by_position = [DetectorOutput::Unknown; 3];
                }
            }
        }
        let [jam, progress, sliding] = detectors.by_position;
        let [friction_loss, inferred_jam, more_load] = self.by_current.update(tick, inferred);
        [
            detectors.stall.update(tick, state),
            jam,
            progress,
            sliding,
            detectors.energy.update(tick, cycle, fault_free),
            self.battery.update(tick, state),
            detectors.link.update(tick, state),
            match &mut detectors.tracker {
                Some(tracker) => tracker.update(tick, state),
                None => DetectorOutput::Unknown,
            },
            detectors.device.update(tick, state),
            detectors.mismatch.update(tick, residuals),
            self.recording.update(tick),
            friction_loss,
            inferred_jam,
            more_load,
        ]
    }
}

impl Detectors {
    fn evaluate_positions(
        &mut self,
        tick: &Tick,
        positions: &sample::Positions,
        fault_free: bool,
    ) -> [DetectorOutput; 3] {
        if self.progress.rests_after_no_progress(tick) || self.sliding.rests_after_slide(tick) {
            // The cycle in which that was must not stop the worm again as soon as it crawls on.
            self.strides.begin_anew();
        }
        let stride = self.strides.update(tick, positions);
        let progress = self.progress.update(tick, &self.strides, stride.as_ref(), fault_free);
        let baseline_m = self.progress.baseline_m(tick.direction);
        [
            self.jam.update(tick, positions),
            progress,
            self.sliding
                .update(tick, positions, &self.strides, baseline_m, fault_free),
        ]
    }
}

/// How long each condition must hold, and be over. Where `raise_after_ns` is 0, the detector confirms it itself.
const fn delays_of(kind: AlarmKind) -> Delays {
    let (raise_after_s, clear_after_s) = match kind {
        AlarmKind::MotorStall => (0.0, 2.0),
        AlarmKind::JammedCell => (0.0, 2.0),
        AlarmKind::NoProgress => (0.0, 2.0),
        AlarmKind::SlidingDown => (0.0, 0.0),
        AlarmKind::EnergyOverBudget => (0.0, 0.0),
        AlarmKind::BatteryLow => (5.0, 10.0),
        AlarmKind::LinkFault => (0.0, 1.0),
        AlarmKind::TrackerFault => (0.0, 2.0),
        AlarmKind::DeviceFault => (0.0, 2.0),
        AlarmKind::ModelMismatch => (0.0, 0.0),
        AlarmKind::RecordingStopped => (0.0, 1.0),
        AlarmKind::FrictionLoss | AlarmKind::InferredJam | AlarmKind::MoreLoad => (0.0, 0.0),
    };
    Delays {
        raise_after_ns: (raise_after_s * 1e9) as u64,
        clear_after_ns: (clear_after_s * 1e9) as u64,
    }
}
