//! Where the energy goes.

use crate::MAX_CELLS;

/// The energies and slides of a motion, cumulative since it began. Entries of cells that the worm does not have stay 0.
///
/// As long as the worm's description stays the same, the energy balance closes at every instant, not only over a cycle:
/// `actuator_net_j` = [`loss_j`](Self::loss_j) + `settling_loss_j` + change of the elastic energy in the contacts.
/// Over a steady crawl, where the last two vanish, this is the identity of (11) and (13).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ledger {
    /// Heat of each tip's sliding, the inner sum of (11, 12), J.
    pub sliding_loss_j: [f64; MAX_CELLS],
    /// Distance each tip slid forward, m.
    pub forward_slide_m: [f64; MAX_CELLS],
    /// Distance each tip slid backward, m, counted positive.
    pub backward_slide_m: [f64; MAX_CELLS],
    /// Work against the weight, Σ mᵢ g sin λ ΔXᵢ, J; negative downhill.
    pub weight_work_j: f64,
    /// Work against resisting forces and drag, J.
    pub resisting_work_j: f64,
    /// Heat that (11) does not contain, J: released by sudden slides of an unbalanced body, or lost in pads that creep or yield.
    pub settling_loss_j: f64,
    /// Net actuator work (13), J.
    pub actuator_net_j: f64,
    /// Positive part of the actuator work: the cost for a drive without energy recovery, J.
    pub actuator_positive_j: f64,
    /// ∫ Σ δᵢ over the travelled phase, m·cycles; divided by the cycles it is the mean deformation (8).
    pub deformation_integral_m: f64,
}

impl Ledger {
    /// Losses and work against the pull, (11), J.
    pub fn loss_j(&self) -> f64 {
        self.sliding_loss_j.iter().sum::<f64>() + self.weight_work_j + self.resisting_work_j
    }

    /// The difference to `earlier`, a copy taken from the same motion.
    pub fn since(&self, earlier: &Self) -> Self {
        let difference =
            |now: &[f64; MAX_CELLS], then: &[f64; MAX_CELLS]| std::array::from_fn(|cell| now[cell] - then[cell]);
        Self {
            sliding_loss_j: difference(&self.sliding_loss_j, &earlier.sliding_loss_j),
            forward_slide_m: difference(&self.forward_slide_m, &earlier.forward_slide_m),
            backward_slide_m: difference(&self.backward_slide_m, &earlier.backward_slide_m),
            weight_work_j: self.weight_work_j - earlier.weight_work_j,
            resisting_work_j: self.resisting_work_j - earlier.resisting_work_j,
            settling_loss_j: self.settling_loss_j - earlier.settling_loss_j,
            actuator_net_j: self.actuator_net_j - earlier.actuator_net_j,
            actuator_positive_j: self.actuator_positive_j - earlier.actuator_positive_j,
            deformation_integral_m: self.deformation_integral_m - earlier.deformation_integral_m,
        }
    }

    /// The mean of so many cycles that it holds.
    pub(super) fn mean_of(&self, cycles: u32) -> Self {
        let part = f64::from(cycles).recip();
        let of = |all: &[f64; MAX_CELLS]| all.map(|one| part * one);
        Self {
            sliding_loss_j: of(&self.sliding_loss_j),
            forward_slide_m: of(&self.forward_slide_m),
            backward_slide_m: of(&self.backward_slide_m),
            weight_work_j: part * self.weight_work_j,
            resisting_work_j: part * self.resisting_work_j,
            settling_loss_j: part * self.settling_loss_j,
            actuator_net_j: part * self.actuator_net_j,
            actuator_positive_j: part * self.actuator_positive_j,
            deformation_integral_m: part * self.deformation_integral_m,
        }
    }

    /// Adds a slide of a tip, m with its sign, and its heat, J.
    pub(super) fn slide(&mut self, cell: usize, slide_m: f64, loss_j: f64) {
        if slide_m > 0.0 {
            self.forward_slide_m[cell] += slide_m;
        } else {
            self.backward_slide_m[cell] -= slide_m;
        }
        self.sliding_loss_j[cell] += loss_j;
    }

    /// Adds the work of an actuator force that is linear while the cell extends by `extension_m`.
    pub fn add_actuator_work(&mut self, force_before_n: f64, force_after_n: f64, extension_m: f64) {
        self.actuator_net_j += 0.5 * (force_before_n + force_after_n) * extension_m;
        let sign = extension_m.signum();
        let (before, after) = (force_before_n * sign, force_after_n * sign);
        let (low, high) = (before.min(after), before.max(after));
        // Mean over the piece of max(force, 0); the force is positive in the fraction high/(high − low) of it.
        let positive_mean = if low >= 0.0 {
            0.5 * (low + high)
        } else if high > 0.0 {
            0.5 * high * high / (high - low)
        } else {
            0.0
        };
        self.actuator_positive_j += positive_mean * extension_m.abs();
    }
}
