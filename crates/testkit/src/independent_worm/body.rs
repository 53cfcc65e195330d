//! A body with mass on tips that give, damp and slide.
//!
//! The cam fixes how the cells stand to each other, so what is left is the body's translation b. Its momentum is
//! P = M b' + Σ mᵢ eᵢ' with eᵢ the cells' extensions, and only contacts and weight change it:
//! P' = −Σ (k δᵢ + c δᵢ') − M g sin λ. The momentum is what is integrated, so a sudden change of eᵢ' needs no infinite
//! force. A tip's place on the canal stays while its deformation keeps within the bounds and follows the cell otherwise.

use super::balance::TrueBalance;
use super::cam::Cam;
use crate::nominal::{DAMPING_RATIO, GRAVITY_M_S2, LOWERING_S, MASS_KG, SPACING_M, STIFFNESS_N_PER_M};

/// What the worm is made of, and where it lies.
#[derive(Debug, Clone)]
pub struct Body {
    /// Mass of the whole worm in equal shares, kg.
    pub mass_kg: f64,
    /// Stiffness of each contact, N/m.
    pub stiffness_n_per_m: f64,
    /// Largest deformation while a tip slides forward, each cell, m.
    pub forward_bound_m: Vec<f64>,
    /// And while it slides backward, m.
    pub backward_bound_m: Vec<f64>,
    /// Damping of the contacts; 1 is critical for the body on all its tips.
    pub damping_ratio: f64,
    /// Drag on a sliding tip beyond its dry friction, N s/m.
    pub slip_drag_n_s_per_m: f64,
    /// Slope of the canal, degrees.
    pub slope_deg: f64,
    /// Time over which the worm's weight comes onto its tips as it is laid down, s.
    pub lowering_s: f64,
}

impl Body {
    /// The paper's worm with given bounds.
    pub fn with_bounds(bound_m: &[f64], slope_deg: f64) -> Self {
        Self {
            mass_kg: MASS_KG,
            stiffness_n_per_m: STIFFNESS_N_PER_M,
            forward_bound_m: bound_m.to_vec(),
            backward_bound_m: bound_m.to_vec(),
            damping_ratio: DAMPING_RATIO,
            slip_drag_n_s_per_m: 0.0,
            slope_deg,
            lowering_s: LOWERING_S,
        }
    }

    pub fn cells(&self) -> usize {
        self.forward_bound_m.len()
    }

    /// Pull of the whole weight down the canal, N.
    pub fn pull_n(&self) -> f64 {
        self.mass_kg * GRAVITY_M_S2 * self.slope_deg.to_radians().sin()
    }

    /// Whether the other tips can hold each stepping cell and the weight, with a twentieth to spare.
    pub fn holds(&self) -> bool {
        (0..self.cells()).all(|stepping| {
            let others = (0..self.cells()).filter(|&cell| cell != stepping);
            let hold_m: f64 = others.map(|cell| self.backward_bound_m[cell]).sum();
            let load_m = self.forward_bound_m[stepping] + self.pull_n() / self.stiffness_n_per_m;
            hold_m > 1.05 * load_m
        })
    }

    fn damping_n_s_per_m(&self) -> f64 {
        let stiffness = self.stiffness_n_per_m * self.cells() as f64;
        2.0 * self.damping_ratio * (stiffness * self.mass_kg).sqrt() / self.cells() as f64
    }
}

/// The body in motion.
#[derive(Debug, Clone)]
pub struct Motion {
    body: Body,
    cam: Cam,
    step_s: f64,
    time_s: f64,
    momentum_n_s: f64,
    /// Velocity of the body's translation b over the last time step, m/s.
    pub translation_m_s: f64,
    pub position_m: Vec<f64>,
    velocity_m_s: Vec<f64>,
    contact_m: Vec<f64>,
    deformation_m: Vec<f64>,
    deformation_rate_m_s: Vec<f64>,
    extension_m: Vec<f64>,
    next_extension_m: Vec<f64>,
    pub balance: TrueBalance,
}

impl Motion {
    /// A worm just laid down, undeformed and at rest; `step_s` is the integrator's time step.
    pub fn laid_down(body: Body, cam: Cam, phase: f64, step_s: f64) -> Self {
        let cells = body.cells();
        assert_eq!(cam.cells(), cells, "the cam moves every cell");
        let mut extension_m = vec![0.0; cells];
        cam.extensions_m(phase, &mut extension_m);
        let position_m: Vec<f64> = (0..cells).map(|cell| -SPACING_M * cell as f64).collect();
        Self {
            step_s,
            time_s: 0.0,
            momentum_n_s: 0.0,
            translation_m_s: 0.0,
            velocity_m_s: vec![0.0; cells],
            contact_m: position_m.clone(),
            balance: TrueBalance::zero(cells, position_m.iter().sum::<f64>() / cells as f64),
            position_m,
            deformation_m: vec![0.0; cells],
            deformation_rate_m_s: vec![0.0; cells],
            next_extension_m: extension_m.clone(),
            extension_m,
            body,
            cam,
        }
    }

    /// One time step, at the end of which the cam stands at `phase`.
    pub fn step_to(&mut self, phase: f64) {
        let cells = self.body.cells();
        let step_s = self.step_s;
        let stiffness = self.body.stiffness_n_per_m;
        let damping = self.body.damping_n_s_per_m();
        let cell_kg = self.body.mass_kg / cells as f64;
        let lowered = (self.time_s / self.body.lowering_s).min(1.0);
        let pull_n = lowered * self.body.pull_n();

        self.cam.extensions_m(phase, &mut self.next_extension_m);
        let contacts_n: f64 = (0..cells)
            .map(|cell| stiffness * self.deformation_m[cell] + damping * self.deformation_rate_m_s[cell])
            .sum();
        self.momentum_n_s -= (contacts_n + pull_n) * step_s;
        let carried_n_s: f64 = (0..cells)
            .map(|cell| cell_kg * (self.next_extension_m[cell] - self.extension_m[cell]) / step_s)
            .sum();
        self.translation_m_s = (self.momentum_n_s - carried_n_s) / self.body.mass_kg;

        let mut moved_m = 0.0;
        for cell in 0..cells {
            let extended_m = self.next_extension_m[cell] - self.extension_m[cell];
            let displacement_m = extended_m + self.translation_m_s * step_s;
            let velocity_m_s = displacement_m / step_s;
            let inertia_n = cell_kg * (velocity_m_s - self.velocity_m_s[cell]) / step_s;
            let before_m = self.deformation_m[cell];
            let damped_n = damping * self.deformation_rate_m_s[cell];
            self.position_m[cell] += displacement_m;
            let slid_m = self.slide(cell);
            let after_m = self.deformation_m[cell];
            let spring_n = 0.5 * stiffness * (before_m + after_m);
            let weight_n = pull_n / cells as f64;
            moved_m += displacement_m / cells as f64;

            let balance = &mut self.balance;
            balance.forward_slide_m[cell] += slid_m.max(0.0);
            balance.backward_slide_m[cell] += (-slid_m).max(0.0);
            balance.friction_j += stiffness * after_m.abs() * slid_m.abs();
            balance.weight_j += weight_n * displacement_m;
            balance.damping_j += damped_n * self.deformation_rate_m_s[cell] * step_s;
            balance.actuator_net_j += (spring_n + weight_n) * extended_m;
            balance.actuator_positive_j += ((spring_n + weight_n) * extended_m).max(0.0);
            balance.cam_j += (spring_n + weight_n + damped_n + inertia_n) * extended_m;
            self.velocity_m_s[cell] = velocity_m_s;
        }
        self.balance.mean_m += moved_m;
        std::mem::swap(&mut self.extension_m, &mut self.next_extension_m);
        self.time_s += step_s;
    }

    /// Lets a tip beyond its bound slide, and returns how far it slid, m.
    fn slide(&mut self, cell: usize) -> f64 {
        let reach_m = self.position_m[cell] - self.contact_m[cell];
        let bounded_m = reach_m.clamp(-self.body.backward_bound_m[cell], self.body.forward_bound_m[cell]);
        let drag = self.body.slip_drag_n_s_per_m;
        let fraction = if drag > 0.0 {
            1.0 - (-self.body.stiffness_n_per_m * self.step_s / drag).exp()
        } else {
            1.0
        };
        let slid_m = fraction * (reach_m - bounded_m);
        self.contact_m[cell] += slid_m;
        let deformation_m = self.position_m[cell] - self.contact_m[cell];
        self.deformation_rate_m_s[cell] = (deformation_m - self.deformation_m[cell]) / self.step_s;
        self.deformation_m[cell] = deformation_m;
        slid_m
    }

    /// Energy in springs and motion, J.
    pub fn stored_j(&self) -> f64 {
        let cell_kg = self.body.mass_kg / self.body.cells() as f64;
        let springs: f64 = self.deformation_m.iter().map(|m| m * m).sum();
        let motion: f64 = self.velocity_m_s.iter().map(|v| v * v).sum();
        0.5 * (self.body.stiffness_n_per_m * springs + cell_kg * motion)
    }

    pub fn time_s(&self) -> f64 {
        self.time_s
    }
}
