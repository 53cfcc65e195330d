//! What the motor's current alone says of the worm, for summaries and pictures. A `~` before a value says that it was inferred.

use crate::relay::wire::Subject;
use serde::Serialize;
use worm_estimator::message::{Inferred, InferredStanding};

/// What the motor's current alone says. The names are those of `wormd infer --json`; what is not known is null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InferredSummary {
    /// How far self-sensing is: `warming-up`, `fitted`, `odd` or `changed`.
    pub standing: &'static str,
    /// Gait cycles that were fitted together, forgotten ones counted less.
    pub cycles: f64,
    /// Friction force k·δmax of each cell, N.
    pub friction_n: Vec<f64>,
    /// Its standard error, N.
    pub friction_sigma_n: Vec<f64>,
    /// Stiffness of each cell, N/m.
    pub stiffness_n_per_m: Vec<f64>,
    /// Its standard error, N/m.
    pub stiffness_sigma_n_per_m: Vec<f64>,
    /// Pull on the body down the canal, N.
    pub pull_n: f64,
    /// Its standard error, N.
    pub pull_sigma_n: f64,
    /// The slope, degrees: as the inertial sensor measured it, or if all the pull is the worm's own weight.
    pub slope_deg: f64,
    /// Its standard error, degrees.
    pub slope_sigma_deg: f64,
    /// Whether the inertial sensor measured it.
    pub slope_is_measured: bool,
    /// Another pull that the current does not exclude, N.
    pub other_pull_n: f64,
    /// Its probability.
    pub other_probability: f64,
    /// Advance of a cycle, m.
    pub advance_m: f64,
    /// Its standard error, m.
    pub advance_sigma_m: f64,
    /// Energy of a cycle by (11), J.
    pub energy_loss_j: f64,
    /// Its standard error, J.
    pub energy_loss_sigma_j: f64,
    /// Net actuator work (13) of a cycle, J.
    pub energy_actuator_net_j: f64,
    /// Its standard error, J.
    pub energy_actuator_net_sigma_j: f64,
    /// Electrical energy of the newest cycle, J.
    pub energy_electrical_j: f64,
    /// Its standard error, J.
    pub energy_electrical_sigma_j: f64,
    /// Distance that each tip slides forward in a cycle, m.
    pub forward_slide_m: Vec<f64>,
    /// Distance that each tip slides backward in a cycle, m.
    pub backward_slide_m: Vec<f64>,
    /// The largest of the standard errors of both, m.
    pub slide_sigma_m: f64,
    /// Distance along the canal by dead reckoning, m.
    pub position_m: f64,
    /// Its standard error, m.
    pub position_sigma_m: f64,
    /// Marks that corrected the distance.
    pub marks: u32,
    /// Marks that contradict the dead reckoning, and with it the marks before: further off than three standard errors.
    pub contradicting_marks: u32,
    /// How far the last mark was ahead of the dead reckoning, m.
    pub mark_off_m: f64,
    /// Its standard error, by mark and dead reckoning together, m.
    pub mark_off_sigma_m: f64,
    /// Cycles at whose end a tracker sample corrected it.
    pub tracker_marks: u32,
    /// The cells that lost friction, from 1.
    pub friction_lost: Vec<usize>,
    /// Largest share of a cell's friction that was lost.
    pub friction_loss_share: f64,
    /// Its standard error.
    pub friction_loss_sigma: f64,
    /// The cells that do not move, from 1.
    pub jammed: Vec<usize>,
    /// Whether the load is larger than it was.
    pub more_load: bool,
    /// How much, as a pull on the body, N.
    pub load_rise_n: f64,
    /// Its standard error, N.
    pub load_rise_sigma_n: f64,
    /// Which changes would be seen.
    pub armed: ArmedChanges,
}

impl InferredSummary {
    /// Advance, losses, pull and position in a few words; none before a cycle was fitted.
    pub(crate) fn text(&self) -> Option<String> {
        let standing = match self.standing {
            "fitted" => String::new(),
            standing => format!(" ({standing})"),
        };
        // So that a small error does not look like none.
        let digits = usize::from(self.position_sigma_m < 1e-3);
        let place = about(1e3 * self.position_m, 1e3 * self.position_sigma_m, digits);
        let advance = about(1e3 * self.advance_m, 1e3 * self.advance_sigma_m, 1);
        let energy = about(1e3 * self.energy_loss_j, 1e3 * self.energy_loss_sigma_j, 0);
        let pull = about(self.pull_n, self.pull_sigma_n, 1);
        let slope = match self.slope_is_measured {
            true => format!(", slope {:.1}±{:.1}°", self.slope_deg, self.slope_sigma_deg),
            false => String::new(),
        };
        let place = place.map_or_else(|| "position not yet known".to_owned(), |place| format!("at {place} mm"));
        let energy = energy.map_or_else(String::new, |energy| format!(" and {energy} mJ"));
        let pull = pull.map_or_else(String::new, |pull| format!(", pull {pull} N"));
        let marks = match self.contradicting_marks {
            0 => String::new(),
            count => format!(", {count} of {} marks contradict it", self.marks),
        };
        advance.map(|advance| format!("{place}{marks}, {advance} mm{energy} a cycle{pull}{slope}{standing}"))
    }
}

/// A value with its standard error; none before both are known.
fn about(value: f64, sigma: f64, digits: usize) -> Option<String> {
    (value.is_finite() && sigma.is_finite()).then(|| format!("~{value:.digits$}±{sigma:.digits$}"))
}

/// Which changes would be seen, and how sure one cycle is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ArmedChanges {
    /// Cells of which a loss of 30 % of their friction would be seen, from 1.
    pub friction_lost: Vec<usize>,
    /// Cells of which a jam would be seen, from 1.
    pub jammed: Vec<usize>,
    /// Whether more load would be seen.
    pub more_load: bool,
    /// Standard error of one cycle's ln friction, the worst cell's.
    pub friction_sigma: f64,
    /// Standard error of one cycle's pull, N.
    pub pull_sigma_n: f64,
}

fn cells_of(mask: u32) -> Vec<usize> {
    (0..u32::BITS as usize)
        .filter(|cell| mask >> cell & 1 == 1)
        .map(|cell| cell + 1)
        .collect()
}

impl InferredSummary {
    /// What the message says, with the position at a phase; `NaN` leaves it at the message's own.
    pub fn of(inferred: &Inferred, phase: f64) -> Self {
        let cells = (inferred.cell_count as usize).min(worm_physics::MAX_CELLS);
        let phase = if phase.is_finite() { phase } else { inferred.phase };
        Self {
            standing: InferredStanding::try_from(inferred.standing).map_or("unknown", InferredStanding::name),
            cycles: inferred.cycles,
            friction_n: inferred.friction_n[..cells].to_vec(),
            friction_sigma_n: inferred.friction_sigma_n[..cells].to_vec(),
            stiffness_n_per_m: inferred.stiffness_n_per_m[..cells].to_vec(),
            stiffness_sigma_n_per_m: inferred.stiffness_sigma_n_per_m[..cells].to_vec(),
            pull_n: inferred.pull_n,
            pull_sigma_n: inferred.pull_sigma_n,
            slope_deg: inferred.slope_rad.to_degrees(),
            slope_sigma_deg: inferred.slope_sigma_rad.to_degrees(),
            slope_is_measured: inferred.slope_is_measured == 1,
            other_pull_n: inferred.other_pull_n,
            other_probability: inferred.other_probability,
            advance_m: inferred.advance_m,
            advance_sigma_m: inferred.advance_sigma_m,
            energy_loss_j: inferred.energy_loss_j,
            energy_loss_sigma_j: inferred.energy_loss_sigma_j,
            energy_actuator_net_j: inferred.energy_actuator_net_j,
            energy_actuator_net_sigma_j: inferred.energy_actuator_net_sigma_j,
            energy_electrical_j: inferred.energy_electrical_j,
            energy_electrical_sigma_j: inferred.energy_electrical_sigma_j,
            forward_slide_m: inferred.forward_slide_m[..cells].to_vec(),
            backward_slide_m: inferred.backward_slide_m[..cells].to_vec(),
            slide_sigma_m: inferred.slide_sigma_m,
            position_m: inferred.position_at_m(phase),
            position_sigma_m: inferred.position_sigma_m,
            marks: inferred.marks,
            contradicting_marks: inferred.contradicting_marks,
            mark_off_m: inferred.mark_off_m,
            mark_off_sigma_m: inferred.mark_off_sigma_m,
            tracker_marks: inferred.tracker_marks,
            friction_lost: cells_of(inferred.friction_lost_mask),
            friction_loss_share: inferred.friction_loss_share,
            friction_loss_sigma: inferred.friction_loss_sigma,
            jammed: cells_of(inferred.jammed_mask),
            more_load: inferred.more_load == 1,
            load_rise_n: inferred.load_rise_n,
            load_rise_sigma_n: inferred.load_rise_sigma_n,
            armed: ArmedChanges {
                friction_lost: cells_of(inferred.friction_armed_mask),
                jammed: cells_of(inferred.jam_armed_mask),
                more_load: inferred.load_armed == 1,
                friction_sigma: inferred.change_friction_sigma,
                pull_sigma_n: inferred.change_pull_sigma_n,
            },
        }
    }
}

/// Where the cells are by dead reckoning, from 0, m, with the standard error: for a worm that nobody sees. None where the distance is not known.
pub(crate) fn place(inferred: &Inferred, subject: &Subject, phase: f64) -> Option<(Vec<(usize, f64)>, f64)> {
    let it = InferredSummary::of(inferred, phase);
    let cells = subject.cells.min(worm_physics::MAX_CELLS);
    let of_cell = |cell: usize| {
        let ahead = 0.5 * (cells as f64 - 1.0) - cell as f64;
        (cell, it.position_m + ahead * subject.cell_spacing_m)
    };
    (it.position_m.is_finite() && it.position_sigma_m.is_finite())
        .then(|| ((0..cells).map(of_cell).collect(), it.position_sigma_m))
}

/// Friction of a cell, N; none where it is not known.
pub(crate) fn friction_text(inferred: &Inferred, cell: usize) -> Option<String> {
    let (friction_n, sigma_n) = (inferred.friction_n.get(cell)?, inferred.friction_sigma_n.get(cell)?);
    friction_n.is_finite().then(|| format!("~{friction_n:.2}±{sigma_n:.2}"))
}
