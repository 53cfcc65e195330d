//! The advance over the last gait cycle, updated many times a cycle.
//!
//! Positions are stored at [`BINS`] phases. One cycle later, at the same phase, the periodic part of the motion cancels, and the difference
//! is the advance of the last cycle, whatever the shape of the gait. So nothing has to wait for the end of a cycle, and the baseline of
//! the advance can be calibrated for each direction.

use super::cam_motion::Tick;
use super::sample::Positions;

/// Phases per cycle at which positions are kept.
pub(super) const BINS: usize = 32;
/// A worm that moved by more than this while its cam stood still was carried or slid: what its gait does begins anew, m.
const CARRIED_M: f64 = 1e-3;

/// The newest advance over one cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stride {
    /// Along the crawling direction, m.
    pub advance_m: f64,
    /// Cycles travelled in this direction without a break.
    pub cycles: f64,
}

/// The baseline of the advance in one direction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Baseline {
    strides: u32,
    mean_m: f64,
    square_m2: f64, // sum of squared deviations
}

impl Baseline {
    pub(super) fn add(&mut self, advance_m: f64) {
        self.strides += 1;
        let off = advance_m - self.mean_m;
        self.mean_m += off / f64::from(self.strides);
        self.square_m2 += off * (advance_m - self.mean_m);
    }

    pub(super) fn is_known(&self, calibration_cycles: u32) -> bool {
        self.strides >= calibration_cycles.saturating_mul(BINS as u32)
    }

    pub(super) const fn mean_m(&self) -> f64 {
        self.mean_m
    }

    pub(super) fn sigma_m(&self) -> f64 {
        (self.square_m2 / f64::from(self.strides.max(2) - 1)).sqrt()
    }
}

/// Keeps the positions of the last cycle.
#[derive(Debug, Clone)]
pub(super) struct Strides {
    slots: [(i64, Positions); BINS], // bin counted from phase 0, and the positions on entering it
    bin: Option<i64>,
    began_phase: f64, // where the uninterrupted travel in this direction began
    reversals: u32,
    torque: bool,
    /// Positions at the beginning of a rest; none while the cam turns.
    rested: Option<Positions>,
    after_reversal: bool,
    newest: Option<Stride>,
    newest_at: Positions,
}

impl Strides {
    pub(super) const fn new() -> Self {
        Self {
            slots: [(i64::MIN, Positions::NONE); BINS],
            bin: None,
            began_phase: 0.0,
            reversals: 0,
            torque: false,
            rested: None,
            after_reversal: false,
            newest: None,
            newest_at: Positions::NONE,
        }
    }

    /// Processes a sample; returns the stride when the cam entered a new bin and the positions one cycle ago are known.
    pub(super) fn update(&mut self, tick: &Tick, positions: &Positions) -> Option<Stride> {
        let phase = tick.phase?;
        let bin = (phase * BINS as f64).floor() as i64;
        let reversed = tick.reversals != self.reversals;
        let carried = self.was_carried(tick, positions);
        if reversed || !tick.torque || !self.torque || self.bin.is_none() || carried {
            // Without torque the worm may be carried; after a reversal the tips must first unload.
            self.after_reversal = reversed && self.bin.is_some() || self.after_reversal && self.newest.is_none();
            self.slots.fill((i64::MIN, Positions::NONE));
            self.newest = None;
            self.began_phase = phase;
            self.reversals = tick.reversals;
            self.torque = tick.torque;
            self.bin = Some(bin);
            return None;
        }
        if self.bin.is_some_and(|last| (bin - last) as f64 * tick.direction <= 0.0) {
            return None; // in the same bin, or back in an earlier one because a hold gave way
        }
        self.bin = Some(bin);
        let slot = &mut self.slots[bin.rem_euclid(BINS as i64) as usize];
        let cycle_ago = bin.saturating_sub(tick.direction as i64 * BINS as i64);
        let earlier = std::mem::replace(slot, (bin, *positions));
        let moved_m = (earlier.0 == cycle_ago)
            .then(|| positions.moved_since(&earlier.1))
            .flatten();
        self.newest = moved_m.map(|moved_m| Stride {
            advance_m: moved_m * tick.direction,
            cycles: (phase - self.began_phase).abs(),
        });
        self.newest_at = *positions;
        self.newest
    }

    /// Forgets what lies behind: the next stride is the advance of the next whole cycle.
    pub(super) fn begin_anew(&mut self) {
        self.bin = None;
    }

    /// Whether a rest ends in which the worm moved.
    fn was_carried(&mut self, tick: &Tick, positions: &Positions) -> bool {
        if tick.still {
            if self.rested.is_none() && positions.mask != 0 {
                self.rested = Some(*positions);
            }
            return false;
        }
        let moved_m = self.rested.take().and_then(|rested| positions.moved_since(&rested));
        moved_m.is_some_and(|moved_m| moved_m.abs() > CARRIED_M)
    }

    /// The newest stride plus the displacement since, along the crawling direction, m.
    pub(super) fn advance_until(&self, tick: &Tick, positions: &Positions) -> Option<f64> {
        let since_m = positions.moved_since(&self.newest_at)?;
        Some(self.newest?.advance_m + since_m * tick.direction)
    }

    /// Whether the tips have settled into this direction, so that a stride can be compared.
    pub(super) fn is_settled(&self) -> bool {
        let needed = if self.after_reversal { 2.0 } else { 1.0 };
        self.newest.is_some_and(|stride| stride.cycles >= needed)
    }

    /// Whether a stride may be used for calibration.
    pub(super) fn can_calibrate(&self) -> bool {
        self.newest.is_some_and(|stride| stride.cycles >= 2.0)
    }
}
