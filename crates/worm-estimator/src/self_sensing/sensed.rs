//! What self-sensing says after a cycle.

use super::{Armed, Blind, Changes, ClosedCycle, CycleFigures, ROUNDING, SelfSensing};
use worm_physics::MAX_CELLS;

/// Share of their friction that all cells have lost beyond which an advance is not known: it may be any part of the stroke, either way.
const SLIPPING_LOSS: f64 = 0.5;

/// What the current says after a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfSensed {
    /// Number of cells.
    pub cells: usize,
    /// [`MotorSample::stamp_ns`](super::MotorSample::stamp_ns) of the reading that ended the newest cycle.
    pub end_ns: u64,
    /// Gait phase at its end, cycles.
    pub end_phase: f64,
    /// How the newest cycle was taken.
    pub standing: Standing,
    /// Cycles that were fitted together, forgotten ones counted less.
    pub cycles: f64,
    /// Friction force k·δmax of each cell, N.
    pub friction_n: [f64; MAX_CELLS],
    /// Its standard error, N.
    pub friction_sigma_n: [f64; MAX_CELLS],
    /// Stiffness of each cell, N/m.
    pub stiffness_n_per_m: [f64; MAX_CELLS],
    /// Its standard error, N/m.
    pub stiffness_sigma_n_per_m: [f64; MAX_CELLS],
    /// Pull on the body down the canal, N: weight and constant drag together.
    pub pull_n: f64,
    /// Its standard error, N.
    pub pull_sigma_n: f64,
    /// The slope, rad: as measured in the newest cycle, or if all the pull is the stated mass's weight.
    pub slope_rad: f64,
    /// Its standard error, rad.
    pub slope_sigma_rad: f64,
    /// Whether a pitch sensor measured it in that cycle.
    pub slope_is_measured: bool,
    /// Figures of the cycle by the model.
    pub figures: CycleFigures,
    /// Their standard errors.
    pub figures_sigma: CycleFigures,
    /// Electrical energy of the last cycle, measured, J.
    pub electrical_j: f64,
    /// Its standard error, J.
    pub electrical_sigma_j: f64,
    /// Root mean square of what the model leaves unexplained in the mean profile, N m at the cam.
    pub residual_n_m: f64,
    /// What the current cannot tell.
    pub blind: Blind,
    /// What differs from the usual.
    pub changes: Changes,
    /// What could be seen to differ.
    pub armed: Armed,
}

/// How the newest cycle was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// Fitted; but of so few cycles no change can be seen yet, and a better answer may still be found.
    WarmingUp,
    /// Fitted with those before.
    Fitted,
    /// Set aside: it is not like those before, and the next one will show whether that was an accident.
    Odd,
    /// Fitted: the worm is another than it was, and [`SelfSensed::changes`] says in what.
    Changed,
}

impl SelfSensing {
    /// Figures of the steady cycle with their standard errors.
    pub(super) fn figures(&self) -> Option<(CycleFigures, CycleFigures)> {
        let (figures, mut sigma) = self.fit.figures().copied()?;
        let changes = self.detector.changes();
        let slips = changes.all_friction_lost && changes.loss_share > SLIPPING_LOSS;
        if slips || changes.jammed != 0 {
            // Tips that hardly hold slide as a whole, and in the exact cycle every cell moves.
            sigma.advance_m = sigma.advance_m.max(self.stroke_m);
        }
        if changes.jammed != 0 {
            sigma.energy_loss_j = sigma.energy_loss_j.max(figures.energy_loss_j.abs());
            sigma.energy_net_j = sigma.energy_net_j.max(figures.energy_net_j.abs());
        }
        if let Some(before) = self.figures_before.filter(|_| changes.more_load) {
            // A pull or stiffer gears, which leave the cycle as it was: the current hardly says which.
            let [sigmas, now, before] = [sigma.flat(), figures.flat(), before.flat()];
            let between = |index: usize| sigmas[index].hypot(now[index] - before[index]);
            sigma = CycleFigures::from_flat(&std::array::from_fn(between));
        }
        Some((figures, sigma))
    }

    /// Says what is known after a cycle, where something is.
    pub(super) fn show(&mut self, cycle: &ClosedCycle, standing: Standing) {
        let Some((figures, figures_sigma)) = self.figures() else {
            return;
        };
        let (parameters, covariance) = (self.fit.parameters(), self.fit.covariance());
        let cells = parameters.cells;
        let sigma = |unknown: usize| covariance[(unknown, unknown)].max(0.0).sqrt();
        let of_cells = |of: &dyn Fn(usize) -> f64| {
            let mut values = [0.0; MAX_CELLS];
            (0..cells).for_each(|cell| values[cell] = of(cell));
            values
        };
        let pull_n = parameters.pull_n();
        let changes = *self.detector.changes();
        let mut pull_sigma_n = sigma(parameters.pull_at());
        if changes.more_load {
            pull_sigma_n = pull_sigma_n.hypot(changes.load_rise_n);
        }
        let pulled_rad = (pull_n / self.weight_n).clamp(-1.0, 1.0).asin();
        let pulled = (pulled_rad, pull_sigma_n / (self.weight_n * pulled_rad.cos().max(0.05)));
        let measured = self.fit.newest_pull_n().map(|weight_n| {
            let slope_rad = (weight_n / self.weight_n).clamp(-1.0, 1.0).asin();
            (slope_rad, self.pitch_sensor.sigma_rad)
        });
        let (slope_rad, slope_sigma_rad) = measured.unwrap_or(pulled);
        let energy = &cycle.energy;
        self.sensed = Some(SelfSensed {
            cells,
            end_ns: cycle.end_ns,
            end_phase: cycle.end_phase,
            standing,
            cycles: self.fit.cycles(),
            friction_n: of_cells(&|cell| parameters.friction_n(cell)),
            friction_sigma_n: of_cells(&|cell| parameters.friction_n(cell) * sigma(cell)),
            stiffness_n_per_m: of_cells(&|cell| parameters.stiffness_n_per_m(cell)),
            stiffness_sigma_n_per_m: of_cells(&|cell| parameters.stiffness_n_per_m(cell) * sigma(cells + cell)),
            pull_n,
            pull_sigma_n,
            slope_rad,
            slope_sigma_rad,
            slope_is_measured: measured.is_some(),
            figures,
            figures_sigma,
            electrical_j: energy.electrical_j,
            electrical_sigma_j: (energy.by_voltage * ROUNDING[0]).hypot(energy.by_current * ROUNDING[1]),
            residual_n_m: self.fit.residual_n_m(),
            blind: Blind::of(&self.fit),
            changes,
            armed: *self.detector.armed(),
        });
    }
}
