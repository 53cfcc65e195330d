//! How each effect of the library enters the true worm.

use super::MAX_CELLS;
use super::tip::laws::Laws;

/// Low friction over a stretch of the canal.
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    pub from_m: f64,
    pub length_m: f64,
    pub friction_factor: f64,
}

impl Patch {
    /// Friction at a place over that elsewhere; the patch begins and ends along `edge_m`.
    pub fn friction_at(&self, place_m: f64, edge_m: f64) -> f64 {
        let inside = if edge_m > 0.0 {
            let rise = |from_m: f64| 0.5 * (1.0 + (2.0 * (place_m - from_m) / edge_m).tanh());
            rise(self.from_m) * (1.0 - rise(self.from_m + self.length_m))
        } else {
            f64::from((self.from_m..self.from_m + self.length_m).contains(&place_m))
        };
        1.0 - (1.0 - self.friction_factor) * inside
    }
}

/// How a worm differs from the nominal one. The default does not.
#[derive(Debug, Clone)]
pub struct Deviations {
    /// Friction force of each cell over what it would be.
    pub friction_factor: [f64; MAX_CELLS],
    /// Pad stiffness of each cell over what it would be; the friction force stays.
    pub stiffness_factor: [f64; MAX_CELLS],
    /// Friction limit of a tip that slides backward over that of one that slides forward.
    pub backward_over_forward: f64,
    /// Friction limit of a tip at rest over that of a sliding one.
    pub static_over_kinetic: f64,
    /// Growth of each pad's secant stiffness at a deformation of 1.75 mm.
    pub hardening: f64,
    /// Stiffness of the Maxwell branch beside the pad's spring, as a fraction of the spring's.
    pub creep_share: f64,
    /// Time constant of that branch, s.
    pub creep_s: f64,
    /// Share of the pad's stiffness that yields.
    pub yielding_share: f64,
    /// Force against a cell's velocity, N s/m.
    pub drag_n_s_per_m: f64,
    /// Constant force on the whole worm against the forward direction, N.
    pub force_n: f64,
    /// Mass more than was weighed, kg.
    pub mass_kg: f64,
    /// Slope more than was stated, degrees, on every run.
    pub angle_deg: f64,
    /// Force that grows with the displacement since the run's start, N/m.
    pub tether_n_per_m: f64,
    /// Stroke of each cell over what it would be.
    pub stroke_factor: [f64; MAX_CELLS],
    /// Compliance of the drive: displacement of a cell for each newton of its contact force, m/N.
    pub compliance_m_per_n: f64,
    /// Play between drive and cell, m.
    pub play_m: f64,
    /// Share of a step by which each begins early.
    pub overlap: f64,
    pub patch: Option<Patch>,
    /// Share of the friction lost in each cycle.
    pub loss_per_cycle: f64,
    /// Slowing of the cam by the stepping cell's force, 1/N.
    pub slowdown_per_n: f64,
    /// Measured positions over true ones.
    pub scale: f64,
    /// How old positions are when they are recorded, s.
    pub latency_s: f64,
    /// Forms of hardening, creep, wear and patch.
    pub laws: Laws,
    /// Size of a discrepancy in all pads: how far a smooth wave of their law moves the body, m.
    pub discrepancy_m: f64,
    /// s of the friction's factor 1 − s (1 − cos λ).
    pub slope_sensitivity: f64,
}

impl Default for Deviations {
    fn default() -> Self {
        Self {
            friction_factor: [1.0; MAX_CELLS],
            stiffness_factor: [1.0; MAX_CELLS],
            backward_over_forward: 1.0,
            static_over_kinetic: 1.0,
            hardening: 0.0,
            creep_share: 0.0,
            creep_s: 1.0,
            yielding_share: 0.0,
            drag_n_s_per_m: 0.0,
            force_n: 0.0,
            mass_kg: 0.0,
            angle_deg: 0.0,
            tether_n_per_m: 0.0,
            stroke_factor: [1.0; MAX_CELLS],
            compliance_m_per_n: 0.0,
            play_m: 0.0,
            overlap: 0.0,
            patch: None,
            loss_per_cycle: 0.0,
            slowdown_per_n: 0.0,
            scale: 1.0,
            latency_s: 0.0,
            laws: Laws::default(),
            discrepancy_m: 0.0,
            slope_sensitivity: 0.0,
        }
    }
}
