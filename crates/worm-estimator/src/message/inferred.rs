//! The `inferred` topic: what the motor's current alone says of the worm.

use super::ZeroCopySend;
use super::json::Name;
use super::{coded_enum, message};
use crate::self_sensing::{Standing, WARM_CYCLES};
use worm_physics::MAX_CELLS;

coded_enum! {
    /// How far self-sensing is.
    InferredStanding, "standing" {
        /// Too few cycles were fitted: intervals may be too narrow, and no change can be seen yet.
        WarmingUp = 0 => "warming-up",
        /// The newest cycle was fitted with those before.
        Fitted = 1 => "fitted",
        /// The newest cycle is not like those before, and was set aside: the next one shows whether that was an accident.
        Odd = 2 => "odd",
        /// The worm is another than it was; masks and loads say in what.
        Changed = 3 => "changed",
    }
}

impl From<Standing> for InferredStanding {
    fn from(standing: Standing) -> Self {
        match standing {
            Standing::WarmingUp => Self::WarmingUp,
            Standing::Fitted => Self::Fitted,
            Standing::Odd => Self::Odd,
            Standing::Changed => Self::Changed,
        }
    }
}

message! {
    /// What the motor's current alone says of the worm, with standard errors: after each gait cycle crawled forward, as soon as it is
    /// fitted, at the end of every other cycle, when only the place is new, and after a mark. Positions play no part in it, but for those that correct the dead reckoning.
    Inferred = "wormd_inferred_v3", made: time_ns, cells: |inferred| inferred.cell_count, {
        /// Number of this message since the estimator started.
        sequence: u64,
        /// When it was made, ns of `CLOCK_MONOTONIC`.
        time_ns: u64,
        /// When the newest cycle ended, ns of `CLOCK_MONOTONIC`; 0 before the first.
        end_ns: u64,
        /// The tick with which it was made, as in the topic `state`.
        state_sequence: u64,
        /// Gait phase at the end of the newest cycle, cycles.
        end_phase: f64,
        /// Cycles that were fitted together, forgotten ones counted less.
        cycles: f64,
        /// Friction force k·δmax of each cell, N.
        friction_n: [f64; MAX_CELLS],
        /// Standard error of `friction_n`, N.
        friction_sigma_n: [f64; MAX_CELLS],
        /// Stiffness of each cell, N/m.
        stiffness_n_per_m: [f64; MAX_CELLS],
        /// Standard error of `stiffness_n_per_m`, N/m.
        stiffness_sigma_n_per_m: [f64; MAX_CELLS],
        /// Distance that each tip slides forward in a cycle, m, by the model.
        forward_slide_m: [f64; MAX_CELLS],
        /// Distance that each tip slides backward in a cycle, m, counted positive.
        backward_slide_m: [f64; MAX_CELLS],
        /// Pull on the body down the canal, N: weight and constant drag together.
        pull_n: f64,
        /// Standard error of `pull_n`, N.
        pull_sigma_n: f64,
        /// The slope, rad: as the inertial sensor measured it, or if all the pull is the weight of the stated mass.
        slope_rad: f64,
        /// Standard error of `slope_rad`, rad.
        slope_sigma_rad: f64,
        /// Another pull that explains the current as well, N; `NaN` where there is none.
        other_pull_n: f64,
        /// Probability of that other answer; `NaN` where there is none.
        other_probability: f64,
        /// Advance of a cycle, m, by the model.
        advance_m: f64,
        /// Standard error of `advance_m`, m.
        advance_sigma_m: f64,
        /// Energy of a cycle by losses and weight, equation (11), J.
        energy_loss_j: f64,
        /// Standard error of `energy_loss_j`, J.
        energy_loss_sigma_j: f64,
        /// Net actuator work of a cycle, equation (13), J.
        energy_actuator_net_j: f64,
        /// Standard error of `energy_actuator_net_j`, J.
        energy_actuator_net_sigma_j: f64,
        /// Electrical energy of the newest cycle, J.
        energy_electrical_j: f64,
        /// Standard error of `energy_electrical_j`, J.
        energy_electrical_sigma_j: f64,
        /// Root mean square of what the model leaves unexplained in the mean torque, N m at the cam.
        residual_n_m: f64,
        /// Distance along the canal by dead reckoning, m, at `phase`: from where the worm began, or as the tracker or the last mark counts.
        position_m: f64,
        /// Standard error of `position_m`, m: it grows until a tracker sample or a mark comes.
        position_sigma_m: f64,
        /// Gait phase with which this was made, cycles.
        phase: f64,
        /// Largest share of a cell's friction that was lost; `NaN` where none was.
        friction_loss_share: f64,
        /// How much more the cam's load is than before, as a pull on the body, N; `NaN` while nothing has changed.
        load_rise_n: f64,
        /// Standard error of one cycle's ln friction, the worst cell's; `NaN` while no change could be seen.
        change_friction_sigma: f64,
        /// Standard error of one cycle's pull, N; `NaN` while no change could be seen.
        change_pull_sigma_n: f64,
        /// Bit i: friction of cell i was lost.
        friction_lost_mask: u32,
        /// Bit i: cell i does not move.
        jammed_mask: u32,
        /// 1 when the load is larger than it was: a pull on the body or friction in the gears.
        more_load: u32,
        /// Bit i: a loss of 30 % of cell i's friction would be seen.
        friction_armed_mask: u32,
        /// Bit i: a jam of cell i would be seen.
        jam_armed_mask: u32,
        /// 1 while more load would be seen.
        load_armed: u32,
        /// Marks that corrected the distance.
        marks: u32,
        /// Cycles at whose end a tracker sample corrected the distance.
        tracker_marks: u32,
        /// [`InferredStanding`] as a code.
        standing: u32 as Name<InferredStanding>,
        /// How many cells are in use.
        cell_count: u32,
        /// 1 when the inertial sensor measured the slope, 0 when it follows from the pull.
        slope_is_measured: u32,
        /// Marks that contradict the dead reckoning and each other: further off than three standard errors.
        contradicting_marks: u32,
        /// Standard error of `forward_slide_m` and `backward_slide_m`, m: the largest of all cells'.
        slide_sigma_m: f64,
        /// Standard error of `friction_loss_share`; `NaN` where none was lost.
        friction_loss_sigma: f64,
        /// Standard error of `load_rise_n`, N; `NaN` while nothing has changed.
        load_rise_sigma_n: f64,
        /// How far the last mark was ahead of the dead reckoning, m; `NaN` before the first.
        mark_off_m: f64,
        /// Standard error of that by mark and dead reckoning together, m; `NaN` before the first.
        mark_off_sigma_m: f64,
    }
}

impl Inferred {
    /// Advance of a forward cycle with its standard error, m; none while so few cycles were fitted that the search may have begun at a wrong
    /// answer.
    pub fn known_advance_m(&self) -> Option<(f64, f64)> {
        let is_known = self.advance_m.is_finite() && self.advance_sigma_m.is_finite() && self.cycles >= WARM_CYCLES;
        is_known.then_some((self.advance_m, self.advance_sigma_m))
    }

    /// The distance by dead reckoning at a later phase, m, where the worm crawls on as it did.
    pub fn position_at_m(&self, phase: f64) -> f64 {
        let advance_m = if self.advance_m.is_finite() {
            self.advance_m
        } else {
            0.0
        };
        self.position_m + (phase - self.phase) * advance_m
    }
}
