//! The worm's body in its canal, driven by the cam: the motion of [`model`](worm_physics) under every `[[effect]]`, with scatter and
//! faults.

use super::conditions::PlantConditions;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use worm_estimator::config::Config;
use worm_physics::MAX_CELLS;
use worm_physics::effect::{Setting, SettingError};
use worm_physics::{Contact, Ledger, Locomotion, Physics, SlidesDown, View, Worm, WormError};

/// A tip's friction scatters by no more than this many standard deviations, and never to nothing.
pub const SCATTER_LIMIT: f64 = 4.0;

/// Drag of a body that slides because its tips cannot hold it, N s/m: a tenth of a newton too much makes 2 mm/s. The model
/// is quasi-static and knows no such velocity; this makes the slide slow and finite.
const SLIDE_DRAG_N_S_PER_M: f64 = 50.0;

/// Share by which a sliding body's pull stays below what its tips hold, so that the balance exists.
const HOLD_MARGIN: f64 = 1e-9;

/// Times that a step is tried again with less pull on a body that begins to slide within it.
const SLIDING_TRIALS: u32 = 4;

/// Why there is no body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// The configuration describes no worm.
    #[error(transparent)]
    Worm(#[from] WormError),
    /// An effect cannot be switched on.
    #[error(transparent)]
    Effect(#[from] SettingError),
    /// Nothing holds it, whatever slides.
    #[error("{0}: give worm.max_deformation_m or canal.slope_deg, or an effect, other values")]
    SlidesDown(#[from] SlidesDown),
}

/// The worm as it is, which the configuration may only guess: with the largest tip deformations of `[virtual_worm]` where it has them.
///
/// # Errors
/// [`BodyError`] when the configuration was not checked and describes no worm.
pub fn true_worm(config: &Config) -> Result<Worm, BodyError> {
    let worm = Worm::try_from(config)?;
    let Some(bounds_m) = &config.virtual_worm.max_deformation_m else {
        return Ok(worm);
    };
    let bounds_m: Vec<f64> = (0..worm.cells()).map(|cell| bounds_m.of(cell)).collect();
    Ok(worm.with_max_deformations_m(&bounds_m)?)
}

/// Cells, contacts and cam.
#[derive(Debug, Clone)]
pub struct Body {
    nominal: Worm, // without scatter, faults and effects
    effects: Vec<Setting>,
    slope_rad: f64,
    scatter_share: f64,
    scatter: [f64; MAX_CELLS], // factors of the largest tip deformations, in this cycle
    conditions: PlantConditions,
    physics: Physics, // as they are now, but for what a slide takes off the pull
    relief_n: f64,    // what the slide takes off the pull
    dragged_m: f64,   // down the canal, tips and all
    motion: Locomotion,
}

impl Body {
    /// At rest at phase 0, cell 1 in front.
    ///
    /// # Errors
    /// [`BodyError`] when the configuration was not checked and describes no worm.
    pub fn new(config: &Config) -> Result<Self, BodyError> {
        let nominal = true_worm(config)?;
        let positions_m: Vec<f64> = (0..nominal.cells())
            .rev()
            .map(|behind| behind as f64 * config.worm.cell_spacing_m)
            .collect();
        let effects = config.effect_settings()?;
        let physics = Physics::of(nominal.clone()).with(&effects);
        let relief_n = relief_n(&physics);
        Ok(Self {
            slope_rad: nominal.slope_rad(),
            nominal,
            effects,
            scatter_share: config.virtual_worm.scatter_share,
            scatter: [1.0; MAX_CELLS],
            conditions: PlantConditions::default(),
            motion: at_rest(&relieved(&physics, relief_n)?, &positions_m, config)?,
            physics,
            relief_n,
            dragged_m: 0.0,
        })
    }

    /// Slope of the canal where it is, rad.
    pub fn slope_rad(&self) -> f64 {
        self.physics.worm.slope_rad()
    }

    /// Draws the tip deformations of the next cycle.
    ///
    /// # Errors
    /// [`WormError`] never for a checked configuration.
    pub fn scatter(&mut self, rng: &mut Xoshiro256PlusPlus) -> Result<(), WormError> {
        if self.scatter_share > 0.0 {
            for factor in &mut self.scatter[..self.nominal.cells()] {
                let normal: f64 = StandardNormal.sample(rng);
                *factor = (1.0 + self.scatter_share * normal.clamp(-SCATTER_LIMIT, SCATTER_LIMIT)).max(0.05);
            }
            self.take_up()?;
        }
        Ok(())
    }

    /// Changes what surrounds the worm, or what it is made of.
    ///
    /// # Errors
    /// [`WormError`] never for a checked configuration and values within a fault's domains.
    pub fn set_conditions(&mut self, conditions: &PlantConditions) -> Result<(), WormError> {
        self.conditions = conditions.clone();
        self.take_up()
    }

    /// Makes the physics of this moment from what is nominal, scattered and wrong.
    fn take_up(&mut self) -> Result<(), WormError> {
        let slope_rad = self.conditions.slope_deg.map_or(self.slope_rad, f64::to_radians);
        let mut worm = self
            .nominal
            .clone()
            .with_slope_rad(slope_rad)?
            .with_resisting_force_n(self.conditions.drag_n)?;
        for cell in 0..worm.cells() {
            let contact = worm.contact(cell);
            let scale = self.scatter[cell] * self.conditions.friction_scale[cell];
            worm = worm
                .with_contact(
                    cell,
                    Contact::symmetric(contact.stiffness_n_per_m, contact.forward_bound_m * scale),
                )?
                .with_stroke_scale(cell, self.conditions.stroke_scale[cell])?;
        }
        self.physics = Physics::of(worm).with(&self.effects);
        self.relieve(relief_n(&self.physics))
    }

    /// Takes the drag of a sliding body off the pull.
    fn relieve(&mut self, relief_n: f64) -> Result<(), WormError> {
        self.relief_n = relief_n;
        // The balance exists, so this cannot fail; if it did, the next advance would fail, too.
        let _balanced = self.motion.take_up(&relieved(&self.physics, relief_n)?);
        Ok(())
    }

    /// Turns the cam to a phase in gait cycles within `dt_s`. Returns the net work that the cam did, J.
    ///
    /// # Errors
    /// [`WormError`] never for a checked configuration.
    pub fn advance_to(&mut self, phase: f64, dt_s: f64) -> Result<f64, WormError> {
        self.dragged_m += self.conditions.drag_speed_m_per_s * dt_s;
        if self.relief_n != 0.0 {
            self.motion.translate(self.slide_m_per_s() * dt_s, dt_s);
        }
        if self.motion.is_exact() && phase == self.motion.phase() {
            return Ok(0.0);
        }
        let before_j = self.motion.ledger().actuator_net_j;
        if self.relief_n != 0.0 && !self.motion.is_exact() {
            self.relieve(relief_n(&self.physics))?;
        }
        // Tips that hold at rest may fail on the way: worn down, on a slick patch, against a tether.
        for _ in 0..SLIDING_TRIALS {
            let Err(slides) = self.motion.advance_to(phase, dt_s) else {
                break;
            };
            self.relieve(self.relief_n + excess_n(&slides))?;
        }
        Ok(self.motion.ledger().actuator_net_j - before_j)
    }

    /// Load torque on the cam now, N m.
    pub fn torque_n_m(&self) -> f64 {
        self.motion.drive_load_j() / TAU
    }

    /// Share of its speed that the motor is left under its present load.
    pub fn speed_fraction(&self, sign: f64) -> f64 {
        self.physics.speed_fraction(sign * self.motion.actuator_force_n())
    }

    /// What lengths look like to the tracker.
    pub fn view(&self) -> View {
        self.physics.view
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.nominal.cells()
    }

    /// Gait phase that the cells have reached, cycles.
    pub fn phase(&self) -> f64 {
        self.motion.phase()
    }

    /// Positions along the canal, m, cell 1 first.
    pub fn positions_m(&self) -> Vec<f64> {
        let positions_m = self.motion.positions_m().iter();
        positions_m.map(|position_m| position_m - self.dragged_m).collect()
    }

    /// Mean position, m.
    pub fn mean_position_m(&self) -> f64 {
        self.motion.mean_position_m() - self.dragged_m
    }

    /// How far the worm was dragged down the canal by a fault, tips and all, m.
    pub fn dragged_m(&self) -> f64 {
        self.dragged_m
    }

    /// The solver's account since the beginning.
    pub fn ledger(&self) -> &Ledger {
        self.motion.ledger()
    }

    /// Velocity of the slide of a body that its tips cannot hold, m/s; 0 while they hold.
    pub fn slide_m_per_s(&self) -> f64 {
        -self.relief_n / SLIDE_DRAG_N_S_PER_M
    }
}

/// The motion of a body with or without mass, before it moves.
fn at_rest(physics: &Physics, positions_m: &[f64], config: &Config) -> Result<Locomotion, SlidesDown> {
    match config.virtual_worm.body_damping_ratio {
        Some(damping_ratio) => Locomotion::with_mass(physics, positions_m, damping_ratio),
        None => Locomotion::at_rest(physics, positions_m),
    }
}

/// What must be taken off the pull of a body so that its tips hold it at rest, N: a body that slides is balanced by the drag of
/// its sliding, its tips hold what they can.
fn relief_n(physics: &Physics) -> f64 {
    physics
        .clamped_worm()
        .check_hold()
        .map_or_else(|slides| excess_n(&slides), |()| 0.0)
}

fn excess_n(slides: &SlidesDown) -> f64 {
    slides.pull_n - (slides.hold_n * (1.0 - HOLD_MARGIN)).copysign(slides.pull_n)
}

fn relieved(physics: &Physics, relief_n: f64) -> Result<Physics, WormError> {
    let resisting_n = physics.worm.resisting_force_n() - relief_n;
    Ok(Physics {
        worm: physics.worm.clone().with_resisting_force_n(resisting_n)?,
        ..physics.clone()
    })
}
