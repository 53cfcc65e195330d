//! What the motor's current alone shows: friction that was lost, a cell that does not move, more load.
//!
//! Self-sensing compares each gait cycle with those before ([`crate::self_sensing::change`]); two in a row that differ make the worm another
//! one. These detectors only read what it says. They need no positions, and are armed whether or not there are any.
//!
//! `friction-loss`: the value is the largest share of a cell's friction that was lost, the cell the one that lost it, none where several did.
//! `inferred-jam`: the cell whose step takes no torque. The value is the share of the usual torque late in the step that is left at most.
//! `more-load`: the value is the rise of the load as a pull on the body, N; the current hardly says whether it is that or friction in the
//! gears. Each clears when cycles are again like those before the change. A raised one stays while a cycle is
//! odd, and while the worm crawls backward: those cycles are not fitted, so nothing is armed.

use super::cam_motion::Tick;
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::message::{Inferred, InferredStanding, Severity};

#[derive(Debug, Clone)]
pub(super) struct ByCurrent {
    friction_loss: f64,
    jam: f64,
    load_n: f64,
}

impl ByCurrent {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            friction_loss: config.alarms.friction_loss.threshold,
            jam: config.alarms.inferred_jam.threshold,
            load_n: config.alarms.more_load.threshold,
        }
    }

    /// Friction loss, jam, load.
    pub(super) fn update(&self, tick: &Tick, inferred: Option<&Inferred>) -> [DetectorOutput; 3] {
        let is_warm = |inferred: &&Inferred| inferred.standing != InferredStanding::WarmingUp.code();
        let Some(inferred) = inferred.filter(is_warm).filter(|_| tick.direction > 0.0) else {
            return [DetectorOutput::Unknown; 3];
        };
        let reading = |is_armed: bool, is_changed: bool, value: f64, threshold: f64, mask: u32| {
            if !(is_armed || is_changed) {
                return DetectorOutput::Unknown;
            }
            let verdict = match (is_changed, value >= threshold) {
                (true, true) => ReadingState::Bad,
                (true, false) => ReadingState::Between,
                (false, _) if inferred.standing == InferredStanding::Odd.code() => ReadingState::Between,
                (false, _) => ReadingState::Good,
            };
            DetectorOutput::Measured(Reading {
                value,
                threshold,
                verdict,
                since_ns: inferred.end_ns,
                cell: (mask.count_ones() == 1).then(|| mask.trailing_zeros() as usize),
                severity: Severity::Warning,
            })
        };
        let or_zero = |value: f64| if value.is_finite() { value } else { 0.0 };
        let (lost, jammed) = (inferred.friction_lost_mask, inferred.jammed_mask);
        let jam_share = if jammed == 0 { 1.0 } else { self.jam };
        [
            reading(
                inferred.friction_armed_mask != 0,
                lost != 0,
                or_zero(inferred.friction_loss_share),
                self.friction_loss,
                lost,
            ),
            reading(inferred.jam_armed_mask != 0, jammed != 0, jam_share, self.jam, jammed),
            reading(
                inferred.load_armed == 1,
                inferred.more_load == 1,
                or_zero(inferred.load_rise_n),
                self.load_n,
                0,
            ),
        ]
    }
}
