//! A body with mass on tips that give, damp, grip and slide.
//!
//! The drive fixes how the cells stand to each other but for its compliance, so what is left is the body's translation b. Its
//! momentum is P = M b' + Σ mᵢ eᵢ' with eᵢ the cells' extensions, and only contacts, weight and drags change it. The momentum
//! is what is integrated, so a sudden change of eᵢ' needs no infinite force.

use super::CELLS;
use super::cam_profile::CamProfile;
use super::deviations::Deviations;
use super::parameters::WormParameters;
use super::tip::{Limits, Pad, Tip};
use super::unmodelled::UnmodelledEffect;
use crate::nominal::{GRAVITY_M_S2, LOWERING_S};

/// Time in which a cell held by a compliant drive follows its force, s: far below any step, far above the time step.
const FOLLOW_S: f64 = 2e-3;

/// A worm with all that is hidden in it.
#[derive(Debug, Clone)]
pub struct Worm {
    pub parameters: WormParameters,
    pub deviations: Deviations,
    pub unmodelled: Option<UnmodelledEffect>,
}

impl Worm {
    /// The same worm with nothing hidden.
    pub fn baseline(&self) -> Self {
        Self {
            parameters: self.parameters.clone(),
            deviations: Deviations::default(),
            unmodelled: None,
        }
    }

    fn pads(&self, mass_kg: f64) -> [Pad; CELLS] {
        let Self {
            parameters, deviations, ..
        } = self;
        let stiffness: f64 = parameters.stiffness_n_per_m.iter().sum();
        let damping = 2.0 * parameters.damping_ratio * (stiffness * mass_kg).sqrt() / CELLS as f64;
        std::array::from_fn(|cell| {
            let stiffness_n_per_m = parameters.stiffness_n_per_m[cell] * deviations.stiffness_factor[cell];
            let friction_n = parameters.friction_n[cell] * deviations.friction_factor[cell];
            Pad {
                stiffness_n_per_m,
                damping_n_s_per_m: damping,
                hardening: deviations.hardening,
                creep_share: deviations.creep_share,
                creep_s: deviations.creep_s,
                yielding_share: deviations.yielding_share,
                yielding_m: friction_n / stiffness_n_per_m,
                bristle_n_per_m: friction_n / parameters.contact.presliding_m,
                contact: parameters.contact,
                // Hidden breakaway friction is what the two bounds then are; it does not come on top of the contact's own.
                static_over_kinetic: deviations
                    .static_over_kinetic
                    .max(parameters.contact.static_over_kinetic),
            }
        })
    }
}

/// Where and how heavily the worm crawls on one run.
#[derive(Debug, Clone, Copy)]
pub struct Placement {
    /// Slope as it truly is but for what is hidden, degrees.
    pub slope_deg: f64,
    /// Known extra mass, kg.
    pub payload_kg: f64,
    /// Where the first cell is laid down, m.
    pub start_m: f64,
}

/// What changes from cycle to cycle.
#[derive(Debug, Clone, Copy)]
pub struct StepInput<'a> {
    /// Gait phase at the end of the time step, cycles.
    pub phase: f64,
    /// Cycles since the run's start.
    pub cycles: f64,
    /// Each tip's friction over its mean in this cycle.
    pub scatter: &'a [f64; CELLS],
    /// Whether a jump of the friction is due.
    pub jumped: bool,
}

/// The body in motion.
#[derive(Debug, Clone)]
pub struct Motion<'a> {
    worm: &'a Worm,
    cam_profile: CamProfile,
    pads: [Pad; CELLS],
    mass_kg: f64,
    /// Weight along the canal, N.
    weight_n: f64,
    /// What the slope leaves of the friction.
    grip_on_slope: f64,
    step_s: f64,
    time_s: f64,
    momentum_n_s: f64,
    /// Velocity of the body's translation over the last time step, m/s.
    pub translation_m_s: f64,
    pub position_m: [f64; CELLS],
    velocity_m_s: [f64; CELLS],
    tips: [Tip; CELLS],
    extension_m: [f64; CELLS],
    /// How far each cell stands off from its place in the body, m, backward.
    stand_off_m: [f64; CELLS],
    mean_m: f64,
    /// Mean position where the run began, m.
    begin_m: f64,
}

impl<'a> Motion<'a> {
    /// A worm just laid down, undeformed and at rest; `step_s` is the integrator's time step.
    pub fn laid_down(worm: &'a Worm, placement: Placement, phase: f64, step_s: f64) -> Self {
        let cam_profile = CamProfile::new(&worm.parameters, &worm.deviations, worm.unmodelled.as_ref());
        let mass_kg = worm.parameters.mass_kg + worm.deviations.mass_kg + placement.payload_kg;
        let position_m: [f64; CELLS] =
            std::array::from_fn(|cell| placement.start_m - worm.parameters.spacing_m * cell as f64);
        let mean_m = position_m.iter().sum::<f64>() / CELLS as f64;
        let slope_rad = (placement.slope_deg + worm.deviations.angle_deg).to_radians();
        Self {
            pads: worm.pads(worm.parameters.mass_kg),
            mass_kg,
            weight_n: mass_kg * GRAVITY_M_S2 * slope_rad.sin(),
            grip_on_slope: 1.0 - worm.deviations.slope_sensitivity * (1.0 - slope_rad.cos()),
            step_s,
            time_s: 0.0,
            momentum_n_s: 0.0,
            translation_m_s: 0.0,
            position_m,
            velocity_m_s: [0.0; CELLS],
            tips: position_m.map(Tip::laid_down),
            extension_m: cam_profile.extensions_m(phase),
            stand_off_m: [0.0; CELLS],
            mean_m,
            begin_m: mean_m,
            cam_profile,
            worm,
        }
    }

    /// From here on counts the way of the run.
    pub fn begin(&mut self) {
        self.begin_m = self.mean_m;
    }

    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Force that the drive gives the stepping cell (13), N.
    pub fn actuator_n(&self, phase: f64) -> f64 {
        self.tips[self.cam_profile.stepping(phase)].elastic_n + self.weight_n / CELLS as f64
    }

    /// One time step.
    pub fn step(&mut self, now: StepInput) {
        let step_s = self.step_s;
        let cell_kg = self.mass_kg / CELLS as f64;
        self.momentum_n_s -= self.pull_n() * step_s;

        let follow = step_s / (FOLLOW_S + step_s);
        let mut extension_m = self.cam_profile.extensions_m(now.phase);
        for ((extension_m, stand_off_m), tip) in extension_m.iter_mut().zip(&mut self.stand_off_m).zip(&self.tips) {
            let held_m = self.worm.deviations.compliance_m_per_n * tip.elastic_n;
            *stand_off_m += follow * (held_m - *stand_off_m);
            *extension_m -= *stand_off_m;
        }
        let extended_m: f64 = extension_m
            .iter()
            .zip(&self.extension_m)
            .map(|(new, old)| new - old)
            .sum();
        self.translation_m_s = (self.momentum_n_s - cell_kg * extended_m / step_s) / self.mass_kg;
        for (cell, extension_m) in extension_m.into_iter().enumerate() {
            let displacement_m = extension_m - self.extension_m[cell] + self.translation_m_s * step_s;
            let limits = self.limits(cell, now);
            self.position_m[cell] += displacement_m;
            self.velocity_m_s[cell] = displacement_m / step_s;
            self.tips[cell].follow(displacement_m, step_s, &self.pads[cell], limits);
        }
        self.extension_m = extension_m;
        self.mean_m = self.position_m.iter().sum::<f64>() / CELLS as f64;
        self.time_s += step_s;
    }

    /// All that pulls the worm back, N.
    fn pull_n(&self) -> f64 {
        let deviations = &self.worm.deviations;
        let lowered = (self.time_s / LOWERING_S).min(1.0);
        let gone_m = self.mean_m - self.begin_m;
        let mut pull_n = lowered * (self.weight_n + deviations.force_n);
        pull_n += deviations.tether_n_per_m * gone_m.max(0.0);
        for cell in 0..CELLS {
            pull_n += self.tips[cell].force_n + deviations.drag_n_s_per_m * self.velocity_m_s[cell];
        }
        if let Some(unmodelled) = &self.worm.unmodelled {
            pull_n += lowered * unmodelled.on_worm_n(gone_m);
            pull_n += lowered
                * self
                    .position_m
                    .iter()
                    .map(|&place_m| unmodelled.on_cell_n(place_m))
                    .sum::<f64>();
        }
        pull_n
    }

    fn limits(&self, cell: usize, now: StepInput) -> Limits {
        let Worm {
            parameters,
            deviations,
            unmodelled,
        } = self.worm;
        let mut limit_n = parameters.friction_n[cell] * deviations.friction_factor[cell] * now.scatter[cell];
        limit_n *= self.grip_on_slope;
        if deviations.loss_per_cycle > 0.0 {
            limit_n *= (1.0 - deviations.loss_per_cycle).powf(now.cycles.max(0.0));
        }
        if let Some(patch) = deviations.patch {
            let inside = (patch.from_m..patch.from_m + patch.length_m).contains(&self.tips[cell].place_m);
            limit_n *= if inside { patch.friction_factor } else { 1.0 };
        }
        if let Some(unmodelled) = unmodelled {
            limit_n *= unmodelled.friction_factor(now.cycles, now.jumped);
        }
        Limits {
            forward_n: limit_n,
            backward_n: limit_n * deviations.backward_over_forward,
        }
    }
}
