//! The worm's body in its canal, driven by the cam: the exact solver of [`model`](crate::model) with scatter and faults.

use super::conditions::PlantConditions;
use crate::MAX_CELLS;
use crate::config::Config;
use crate::model::{Contact, Ledger, Motion, Worm, WormError};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// A tip's friction scatters by no more than this many standard deviations, and never to nothing.
const SCATTER_LIMIT: f64 = 4.0;

/// Drag of a body that slides because its tips cannot hold it, N s/m: a tenth of a newton too much makes 2 mm/s. The model
/// is quasi-static and knows no such velocity; this makes the slide slow and finite.
const SLIDE_DRAG_N_S_PER_M: f64 = 50.0;

/// Share by which a sliding body's pull stays below what its tips hold, so that the balance exists.
const HOLD_MARGIN: f64 = 1e-9;

/// Cells, contacts and cam.
#[derive(Debug, Clone)]
pub struct Body {
    nominal: Worm, // without scatter and faults
    slope_rad: f64,
    scatter_share: f64,
    scatter: [f64; MAX_CELLS], // factors of the largest tip deformations, in this cycle
    conditions: PlantConditions,
    worm: Worm, // as it is now
    slide_m_per_s: f64,
    dragged_m: f64, // down the canal, tips and all
    motion: Motion,
}

impl Body {
    /// At rest at phase 0, cell 1 in front.
    ///
    /// # Errors
    /// [`WormError`] when the configuration was not checked and describes no worm.
    pub fn new(config: &Config) -> Result<Self, WormError> {
        let body = &config.worm;
        let bounds_m = config
            .virtual_worm
            .max_deformation_m
            .as_ref()
            .unwrap_or(&body.max_deformation_m);
        let contact = |cell| Contact::symmetric(body.stiffness_n_per_m.of(cell), bounds_m.of(cell));
        let slope_rad = config.canal.slope_deg.to_radians();
        let mut nominal = Worm::uniform(body.cells, contact(0), body.mass_kg, body.stroke_m)?
            .with_step_order(&body.step_order_from_zero())?
            .with_slope_rad(slope_rad)?;
        for cell in 1..body.cells {
            nominal = nominal.with_contact(cell, contact(cell))?;
        }
        let positions_m: Vec<f64> = (0..body.cells)
            .map(|cell| (body.cells - 1 - cell) as f64 * body.cell_spacing_m)
            .collect();
        let mut new = Self {
            slope_rad,
            scatter_share: config.virtual_worm.scatter_share,
            scatter: [1.0; MAX_CELLS],
            conditions: PlantConditions::default(),
            worm: nominal.clone(),
            slide_m_per_s: 0.0,
            dragged_m: 0.0,
            motion: Motion::at_rest(&nominal, &positions_m),
            nominal,
        };
        new.take_up()?;
        Ok(new)
    }

    /// Draws the tip deformations of the next cycle.
    ///
    /// # Errors
    /// [`WormError`] never for a checked configuration.
    pub fn scatter(&mut self, chance: &mut Xoshiro256PlusPlus) -> Result<(), WormError> {
        if self.scatter_share > 0.0 {
            for factor in &mut self.scatter[..self.nominal.cells()] {
                let normal: f64 = StandardNormal.sample(chance);
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

    /// Makes the worm of this moment from what is nominal, scattered and wrong.
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
        // A body that slides is balanced by the drag of its sliding: its tips hold what they can, the drag the rest.
        let pull_n = worm.pull_n();
        let excess_n = match worm.check_hold() {
            Ok(()) => 0.0,
            Err(slides) => pull_n - (slides.hold_n * (1.0 - HOLD_MARGIN)).copysign(pull_n),
        };
        self.slide_m_per_s = -excess_n / SLIDE_DRAG_N_S_PER_M;
        self.worm = worm.with_resisting_force_n(self.conditions.drag_n - excess_n)?;
        // The balance exists, so this cannot fail; if it did, the next advance would say so again.
        let _balanced = self.motion.rebalance(&self.worm);
        Ok(())
    }

    /// Turns the cam to a phase in gait cycles within `dt_s`. Returns the net work that the cam did, J.
    pub fn advance_to(&mut self, phase: f64, dt_s: f64) -> f64 {
        self.dragged_m += self.conditions.drag_speed_m_per_s * dt_s;
        if self.slide_m_per_s != 0.0 {
            self.motion.translate(&self.worm, self.slide_m_per_s * dt_s);
        }
        if phase == self.motion.phase() {
            return 0.0;
        }
        let before_j = self.motion.ledger().actuator_net_j;
        // `take_up` has made sure that the tips hold, so the solver does not refuse.
        let advanced = self.motion.advance_to(&self.worm, phase);
        debug_assert!(advanced.is_ok(), "{advanced:?}");
        self.motion.ledger().actuator_net_j - before_j
    }

    /// Load torque on the cam now, N m: the stepping cell's actuator force times its extension per angle.
    pub fn torque_n_m(&self) -> f64 {
        let stroke_m = self.worm.stroke_of_m(self.motion.stepping_cell(&self.worm));
        self.motion.actuator_force_n(&self.worm) * stroke_m * self.worm.cells() as f64 / TAU
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
        self.slide_m_per_s
    }
}
