//! What the distance of model and data is measured in: of positions, or of the torque where nobody saw the cells.

use crate::explain::Answer;
use crate::explain::answer::Stage;
use worm_estimator::number::fixed;

/// A measure of the gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::report::explain) enum Distance {
    /// Of every cell's position within a cycle.
    Positions,
    /// Of the torque on the cam over the phase.
    Torque,
}

impl Distance {
    /// What an answer is judged by.
    pub fn of(answer: &Answer) -> Self {
        match answer.is_by_current_alone() {
            true => Self::Torque,
            false => Self::Positions,
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Positions => "mm",
            Self::Torque => "mN m",
        }
    }

    /// What it is, in words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Positions => "root mean square distance of model and data within a cycle",
            Self::Torque => "root mean square of what the model leaves of the torque on the cam",
        }
    }

    /// Of a stage on the cycles that it was fitted to, and on cycles held out; `NaN` where it is not known.
    pub fn of_stage(self, stage: &Stage) -> [f64; 2] {
        let [fitted, held_out] = match (self, &stage.torque) {
            (Self::Positions, _) => [stage.fit_rms_m, stage.held_out_rms_m],
            (Self::Torque, Some(torque)) => [torque.fit_rms_n_m, torque.held_out_rms_n_m],
            (Self::Torque, None) => [f64::NAN; 2],
        };
        [fitted * 1e3, held_out * 1e3]
    }

    /// On cycles held out.
    pub fn held_out(self, stage: &Stage) -> f64 {
        self.of_stage(stage)[1]
    }

    /// On cycles held out, with its unit.
    pub fn held_out_in_words(self, stage: &Stage) -> String {
        format!("{} {}", fixed(self.held_out(stage), 3), self.unit())
    }
}
