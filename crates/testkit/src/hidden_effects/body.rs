//! A body with mass on tips that give, damp, grip and slide.
//!
//! The drive fixes how the cells stand to each other but for its compliance, so what is left is the body's translation b. Its
//! momentum is P = M b' + Σ mᵢ eᵢ' with eᵢ the cells' extensions, and only contacts, weight and drags change it. The momentum
//! is what is integrated, so a sudden change of eᵢ' needs no infinite force.

use super::MAX_CELLS;
use super::cam_profile::CamProfile;
use super::deviations::Deviations;
use super::parameters::WormParameters;
use super::tip::{Limits, Pad, Tip};
use super::unmodelled::{Situation, UnmodelledEffect};
use crate::nominal::{GRAVITY_M_S2, LOWERING_S};

/// Time in which a cell held by a compliant drive follows its force, s: far below any step, far above the time step.
const FOLLOW_S: f64 = 2e-3;
/// Resistance of the grease in the drive's play to a cell that crosses it, N s/m: in a few milliseconds.
const GREASE_N_S_PER_M: f64 = 5.0;

/// A worm with what is hidden in it.
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

    fn pads(&self, deviations: &Deviations) -> [Pad; MAX_CELLS] {
        let Self { parameters, .. } = self;
        let mass_kg = parameters.mass_kg;
        let cells = parameters.cells;
        let stiffness: f64 = parameters.stiffness_n_per_m[..cells].iter().sum();
        let damping = 2.0 * parameters.damping_ratio * (stiffness * mass_kg).sqrt() / cells as f64;
        std::array::from_fn(|cell| {
            let stiffness_n_per_m = parameters.stiffness_n_per_m[cell] * deviations.stiffness_factor[cell];
            let friction_n = parameters.friction_n[cell] * deviations.friction_factor[cell];
            Pad {
                stiffness_n_per_m,
                damping_n_s_per_m: damping,
                hardening: deviations.hardening,
                laws: deviations.laws,
                discrepancy_m: deviations.discrepancy_m,
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

/// Slope, payload and start of one run.
#[derive(Debug, Clone, Copy)]
pub struct Placement {
    /// True slope, without a hidden slope error, degrees.
    pub slope_deg: f64,
    /// Known extra mass, kg.
    pub payload_kg: f64,
    /// Where the first cell is laid down, m.
    pub start_m: f64,
}

/// What mass, slope and clamps come to.
struct Load {
    mass_kg: f64,
    weight_n: f64,
    grip_on_slope: f64,
}

impl Load {
    fn of(worm: &Worm, deviations: &Deviations, placement: Placement) -> Self {
        let mass_kg = worm.parameters.mass_kg + deviations.mass_kg + placement.payload_kg;
        let slope_rad = (placement.slope_deg + deviations.angle_deg).to_radians();
        Self {
            mass_kg,
            weight_n: mass_kg * GRAVITY_M_S2 * slope_rad.sin(),
            grip_on_slope: 1.0 - deviations.slope_sensitivity * (1.0 - slope_rad.cos()),
        }
    }
}

/// Inputs of one time step.
#[derive(Debug, Clone, Copy)]
pub struct StepInput<'a> {
    /// Gait phase at the end of the time step, cycles.
    pub phase: f64,
    /// Cycles since the run's start.
    pub cycles: f64,
    /// Each tip's friction over its mean in this cycle.
    pub scatter: &'a [f64; MAX_CELLS],
    /// Whether a jump of the friction is due.
    pub jumped: bool,
}

/// The body in motion.
#[derive(Debug, Clone)]
pub struct Motion<'a> {
    worm: &'a Worm,
    /// Those of the worm, while what is hidden is there.
    deviations: Deviations,
    cells: usize,
    placement: Placement,
    cam_profile: CamProfile,
    /// What the cam's profile lost or won where it changed in mid-run, m.
    extension_offset_m: [f64; MAX_CELLS],
    pads: [Pad; MAX_CELLS],
    mass_kg: f64,
    /// Weight along the canal, N.
    weight_n: f64,
    /// Friction on this slope over that on the level.
    grip_on_slope: f64,
    step_s: f64,
    time_s: f64,
    momentum_n_s: f64,
    /// Velocity of the body's translation over the last time step, m/s.
    pub translation_m_s: f64,
    pub position_m: [f64; MAX_CELLS],
    velocity_m_s: [f64; MAX_CELLS],
    tips: [Tip; MAX_CELLS],
    extension_m: [f64; MAX_CELLS],
    /// How far the drive's compliance holds each cell back, m.
    stand_off_m: [f64; MAX_CELLS],
    /// How far back from the middle of the drive's play each cell is, m.
    in_play_m: [f64; MAX_CELLS],
    mean_m: f64,
    /// Positive work of the drive so far (13), J.
    pub work_j: f64,
    /// All its work, with what dampers, drags and the body's inertia take, J.
    pub drive_j: f64,
    /// Mean position where the run began, m.
    begin_m: f64,
    effect_acts: bool,
    /// Displacement to which what trails behind the worm has followed, m.
    followed_m: f64,
}

/// What deviates while the hidden is there, and while it is not.
fn deviations(worm: &Worm, acts: bool) -> Deviations {
    if acts {
        worm.deviations.clone()
    } else {
        Deviations::default()
    }
}

impl<'a> Motion<'a> {
    /// A worm just laid down, undeformed and at rest; `step_s` is the integrator's time step.
    /// With `begun`, what is hidden is there from the start; without, [`switch_effect`](Self::switch_effect) brings it.
    pub fn laid_down(worm: &'a Worm, placement: Placement, phase: f64, step_s: f64, begun: bool) -> Self {
        let deviations = deviations(worm, begun);
        let cam_profile = CamProfile::new(&worm.parameters, &deviations, worm.unmodelled.as_ref());
        let position_m: [f64; MAX_CELLS] =
            std::array::from_fn(|cell| placement.start_m - worm.parameters.spacing_m * cell as f64);
        let cells = worm.parameters.cells;
        let mean_m = position_m[..cells].iter().sum::<f64>() / cells as f64;
        let load = Load::of(worm, &deviations, placement);
        Self {
            pads: worm.pads(&deviations),
            deviations,
            placement,
            extension_offset_m: [0.0; MAX_CELLS],
            mass_kg: load.mass_kg,
            weight_n: load.weight_n,
            grip_on_slope: load.grip_on_slope,
            step_s,
            time_s: 0.0,
            momentum_n_s: 0.0,
            translation_m_s: 0.0,
            position_m,
            velocity_m_s: [0.0; MAX_CELLS],
            tips: position_m.map(Tip::laid_down),
            extension_m: cam_profile.extensions_m(phase),
            stand_off_m: [0.0; MAX_CELLS],
            in_play_m: [0.0; MAX_CELLS],
            mean_m,
            work_j: 0.0,
            drive_j: 0.0,
            begin_m: mean_m,
            effect_acts: begun,
            followed_m: 0.0,
            cells,
            cam_profile,
            worm,
        }
    }

    /// What is hidden begins or ends now: positions and momentum stay, all else may change.
    pub fn switch_effect(&mut self, acts: bool, phase: f64) {
        self.effect_acts = acts;
        let before_m = self.cam_profile.extensions_m(phase);
        self.deviations = deviations(self.worm, acts);
        self.cam_profile = CamProfile::new(&self.worm.parameters, &self.deviations, self.worm.unmodelled.as_ref());
        let after_m = self.cam_profile.extensions_m(phase);
        for cell in 0..self.cells {
            self.extension_offset_m[cell] += before_m[cell] - after_m[cell];
        }
        self.in_play_m = [0.0; MAX_CELLS];
        self.pads = self.worm.pads(&self.deviations);
        let load = Load::of(self.worm, &self.deviations, self.placement);
        self.momentum_n_s *= load.mass_kg / self.mass_kg;
        (self.mass_kg, self.weight_n, self.grip_on_slope) = (load.mass_kg, load.weight_n, load.grip_on_slope);
    }

    /// Starts the run: its displacement counts from here.
    pub fn begin(&mut self) {
        self.followed_m -= self.mean_m - self.begin_m;
        self.begin_m = self.mean_m;
    }

    /// Whether what is hidden is there.
    pub fn effect_acts(&self) -> bool {
        self.effect_acts
    }

    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Force that the drive gives the stepping cell (13), N.
    pub fn actuator_n(&self, phase: f64) -> f64 {
        self.tips[self.cam_profile.stepping(phase)].elastic_n + self.weight_n / self.cells as f64
    }

    /// One time step.
    pub fn step(&mut self, now: StepInput) {
        let step_s = self.step_s;
        let cell_kg = self.mass_kg / self.cells as f64;
        let pull_n = self.pull_n();
        self.momentum_n_s -= pull_n * step_s;

        let follow = step_s / (FOLLOW_S + step_s);
        let mut extension_m = self.cam_profile.extensions_m(now.phase);
        for (cell, extension_m) in extension_m.iter_mut().enumerate().take(self.cells) {
            let held_m = self.deviations.compliance_m_per_n * self.tips[cell].elastic_n;
            self.stand_off_m[cell] += follow * (held_m - self.stand_off_m[cell]);
            *extension_m += self.extension_offset_m[cell] - self.stand_off_m[cell];
        }
        // A cell's load pushes it through the drive's play to one flank or the other.
        let mut gave_m = [0.0; MAX_CELLS];
        if self.deviations.play_m > 0.0 {
            let half_m = 0.5 * self.deviations.play_m;
            for (cell, gave_m) in gave_m.iter_mut().enumerate().take(self.cells) {
                let load_n = self.tips[cell].elastic_n + self.weight_n / self.cells as f64;
                let before_m = self.in_play_m[cell];
                self.in_play_m[cell] = (before_m + load_n / GREASE_N_S_PER_M * step_s).clamp(-half_m, half_m);
                *gave_m = self.in_play_m[cell] - before_m;
            }
        }
        let extended_m: f64 = (0..self.cells)
            .map(|cell| extension_m[cell] - self.extension_m[cell] - gave_m[cell])
            .sum();
        let work_j: f64 = (0..self.cells)
            .map(|cell| {
                let force_n = self.tips[cell].elastic_n + self.weight_n / self.cells as f64;
                force_n * (extension_m[cell] - self.extension_m[cell])
            })
            .sum();
        self.work_j += work_j.max(0.0);
        // The drive pushes the cells apart: its forces are in balance. Each bears what pulls at its cell, less its part of what moves the body.
        self.drive_j += (0..self.cells)
            .map(|cell| {
                let on_cell_n = self.tips[cell].force_n + self.deviations.drag_n_s_per_m * self.velocity_m_s[cell];
                let on_all_n: f64 = (0..self.cells)
                    .map(|cell| self.tips[cell].force_n + self.deviations.drag_n_s_per_m * self.velocity_m_s[cell])
                    .sum();
                (on_cell_n - on_all_n / self.cells as f64) * (extension_m[cell] - self.extension_m[cell])
            })
            .sum::<f64>();
        self.translation_m_s = (self.momentum_n_s - cell_kg * extended_m / step_s) / self.mass_kg;
        for (cell, extension_m) in extension_m.into_iter().enumerate().take(self.cells) {
            let displacement_m = extension_m - self.extension_m[cell] - gave_m[cell] + self.translation_m_s * step_s;
            let limits = self.limits(cell, now);
            self.position_m[cell] += displacement_m;
            self.velocity_m_s[cell] = displacement_m / step_s;
            self.tips[cell].follow(displacement_m, step_s, &self.pads[cell], limits);
        }
        self.extension_m = extension_m;
        self.mean_m = self.position_m[..self.cells].iter().sum::<f64>() / self.cells as f64;
        if let Some(follows_s) = self.worm.unmodelled.as_ref().and_then(UnmodelledEffect::follows_s) {
            self.followed_m += (self.mean_m - self.begin_m - self.followed_m) * step_s / (follows_s + step_s);
        }
        self.time_s += step_s;
    }

    /// Sum of the forces that pull the worm backward, N.
    fn pull_n(&self) -> f64 {
        let deviations = &self.deviations;
        let lowered = (self.time_s / LOWERING_S).min(1.0);
        let displacement_from_start_m = self.mean_m - self.begin_m;
        let mut pull_n = lowered * (self.weight_n + deviations.force_n);
        pull_n += deviations.tether_n_per_m * displacement_from_start_m.max(0.0);
        for cell in 0..self.cells {
            pull_n += self.tips[cell].force_n + deviations.drag_n_s_per_m * self.velocity_m_s[cell];
        }
        if let Some(unmodelled) = &self.worm.unmodelled {
            pull_n += lowered * unmodelled.on_worm_n(displacement_from_start_m, self.followed_m, self.time_s);
            pull_n += lowered
                * self.position_m[..self.cells]
                    .iter()
                    .zip(&self.velocity_m_s)
                    .map(|(&place_m, &velocity_m_s)| unmodelled.on_cell_n(place_m, velocity_m_s))
                    .sum::<f64>();
        }
        pull_n
    }

    fn limits(&self, cell: usize, now: StepInput) -> Limits {
        let Worm {
            parameters, unmodelled, ..
        } = self.worm;
        let deviations = &self.deviations;
        let mut limit_n = parameters.friction_n[cell] * deviations.friction_factor[cell] * now.scatter[cell];
        limit_n *= self.grip_on_slope;
        if deviations.loss_per_cycle > 0.0 {
            limit_n *= deviations.laws.wear.left(deviations.loss_per_cycle, now.cycles);
        }
        if let Some(patch) = deviations.patch {
            limit_n *= patch.friction_at(self.tips[cell].place_m, deviations.laws.patch_edge_m);
        }
        if let Some(unmodelled) = unmodelled {
            let situation = Situation {
                cycles: now.cycles,
                jumped: now.jumped,
            };
            limit_n *= unmodelled.friction_factor(cell, self.tips[cell].place_m, self.velocity_m_s[cell], situation);
        }
        Limits {
            forward_n: limit_n,
            backward_n: limit_n * deviations.backward_over_forward,
        }
    }
}
