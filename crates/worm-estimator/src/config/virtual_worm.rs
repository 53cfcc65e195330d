//! The simulated devices.

use super::check::Checker;
use super::worm::PerCell;
use serde::Deserialize;

/// Properties of the virtual worm beyond those in the other sections.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VirtualWorm {
    /// Seed of all its randomness.
    pub seed: u64,
    /// Standard deviation of one position measured by its tracker, m.
    pub noise_m: f64,
    /// Fraction of positions that its tracker does not see.
    pub dropout_share: f64,
    /// Its true largest tip deformations, m, where they differ from `worm.max_deformation_m`.
    pub max_deformation_m: Option<PerCell>,
    /// Standard deviation of the largest tip deformations from one cycle to the next, as a fraction.
    pub scatter_share: f64,
    /// Dry friction inside the device, N m at the cam.
    pub inner_friction_n_m: f64,
    /// Friction inside the device that grows with speed, N m s/rad at the cam.
    pub inner_viscous_n_m_s_per_rad: f64,
    /// Moment of inertia at the cam, kg m².
    pub inertia_kg_m2: f64,
    /// Supply voltage without load, V, where no battery is configured.
    pub supply_v: f64,
    /// Resistance of the supply, ohm, where no battery is configured.
    pub supply_resistance_ohm: f64,
    /// Temperature around the motor, °C.
    pub ambient_c: f64,
}

impl Default for VirtualWorm {
    fn default() -> Self {
        Self {
            seed: 1,
            noise_m: 1e-4,
            dropout_share: 0.0,
            max_deformation_m: None,
            scatter_share: 0.01,
            inner_friction_n_m: 0.05,
            inner_viscous_n_m_s_per_rad: 0.003,
            inertia_kg_m2: 2e-4,
            supply_v: 5.0,
            supply_resistance_ohm: 0.2,
            ambient_c: 25.0,
        }
    }
}

impl VirtualWorm {
    pub(super) fn check(&self, cells: usize, checker: &mut Checker) {
        checker.range("virtual_worm.noise_m", self.noise_m, 0.0..=5e-3, "m");
        checker.range("virtual_worm.dropout_share", self.dropout_share, 0.0..=0.9, "");
        if let Some(bounds) = &self.max_deformation_m {
            bounds.check("virtual_worm.max_deformation_m", cells, 1e-6..=0.1, "m", checker);
        }
        checker.range("virtual_worm.scatter_share", self.scatter_share, 0.0..=0.3, "");
        checker.range(
            "virtual_worm.inner_friction_n_m",
            self.inner_friction_n_m,
            0.0..=10.0,
            "N m",
        );
        let viscous = self.inner_viscous_n_m_s_per_rad;
        checker.range(
            "virtual_worm.inner_viscous_n_m_s_per_rad",
            viscous,
            0.0..=10.0,
            "N m s/rad",
        );
        checker.range("virtual_worm.inertia_kg_m2", self.inertia_kg_m2, 1e-6..=1.0, "kg m²");
        checker.range("virtual_worm.supply_v", self.supply_v, 0.0..=60.0, "V");
        checker.range(
            "virtual_worm.supply_resistance_ohm",
            self.supply_resistance_ohm,
            0.0..=10.0,
            "ohm",
        );
        checker.range("virtual_worm.ambient_c", self.ambient_c, -20.0..=80.0, "°C");
    }
}
