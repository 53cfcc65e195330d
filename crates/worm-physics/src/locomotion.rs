//! One motion for any physics: exact under the paper's laws, incremental otherwise.

use super::crawl::Crawl;
use super::ledger::Ledger;
use super::mechanics::Mechanics;
use super::motion::Motion;
use super::physics::Physics;
use super::worm::{SlidesDown, Worm};

/// A worm in motion under its [`Physics`]. Quasi-static: the exact [`Motion`] while they are piecewise linear, else a [`Crawl`]. With mass:
/// always a [`Crawl`].
#[derive(Debug, Clone)]
pub struct Locomotion(MotionKind);

#[derive(Debug, Clone)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is one for each worm, and none is ever moved about in a loop"
)]
enum MotionKind {
    Exact { worm: Worm, motion: Motion },
    Incremental { mechanics: Mechanics, crawl: Crawl },
}

impl Locomotion {
    /// A worm at rest at phase 0: laid down unloaded, the tips have given way together until they carry the pull.
    ///
    /// # Errors
    /// [`SlidesDown`] when they cannot.
    ///
    /// # Panics
    /// When there is not one position for each cell.
    pub fn at_rest(physics: &Physics, first_positions_m: &[f64]) -> Result<Self, SlidesDown> {
        Ok(Self(if physics.is_piecewise_linear() {
            let worm = physics.clamped_worm();
            worm.check_hold()?;
            let motion = Motion::at_rest(&worm, first_positions_m);
            MotionKind::Exact { worm, motion }
        } else {
            let mechanics = Mechanics::new(physics);
            let crawl = Crawl::at_rest(&mechanics, 0.0, first_positions_m, None)?;
            MotionKind::Incremental { mechanics, crawl }
        }))
    }

    /// As [`at_rest`](Self::at_rest), but the body has its mass in motion as well, and this damping ratio on its pads.
    ///
    /// # Errors
    /// [`SlidesDown`] when they cannot.
    ///
    /// # Panics
    /// When there is not one position for each cell.
    pub fn with_mass(physics: &Physics, first_positions_m: &[f64], damping_ratio: f64) -> Result<Self, SlidesDown> {
        let mechanics = Mechanics::new(physics);
        let crawl = Crawl::at_rest(&mechanics, 0.0, first_positions_m, Some(damping_ratio))?;
        Ok(Self(MotionKind::Incremental { mechanics, crawl }))
    }

    /// Changes the physics at the present phase; cells step on from where they are. The exact motion lets the body give way at once, the
    /// incremental one in its next increment.
    ///
    /// # Errors
    /// [`SlidesDown`] when the tips cannot hold the changed worm at rest. The change is made nevertheless.
    ///
    /// # Panics
    /// When the number of cells changes, or the physics now need the other motion.
    pub fn take_up(&mut self, physics: &Physics) -> Result<(), SlidesDown> {
        match &mut self.0 {
            MotionKind::Exact { worm, motion } => {
                assert!(
                    physics.is_piecewise_linear(),
                    "an exact motion keeps to the paper's laws"
                );
                *worm = physics.clamped_worm();
                motion.rebalance(worm)
            }
            MotionKind::Incremental { mechanics, crawl } => {
                *mechanics = Mechanics::new(physics);
                crawl.take_up(mechanics);
                mechanics.worm.check_hold()
            }
        }
    }

    /// Advances to a phase, in gait cycles, unwrapped, at a uniform rate over `duration_s`.
    ///
    /// # Errors
    /// [`SlidesDown`] when the tips cannot hold the worm.
    pub fn advance_to(&mut self, phase: f64, duration_s: f64) -> Result<(), SlidesDown> {
        match &mut self.0 {
            MotionKind::Exact { worm, motion } => motion.advance_to(worm, phase),
            MotionKind::Incremental { mechanics, crawl } => crawl.advance_to(mechanics, phase, duration_s),
        }
    }

    /// Moves the whole body along the canal against the contacts, whether or not forces balance, within `duration_s`. This is how a worm that cannot hold
    /// slides down.
    pub fn translate(&mut self, distance_m: f64, duration_s: f64) {
        match &mut self.0 {
            MotionKind::Exact { worm, motion } => motion.translate(worm, distance_m),
            MotionKind::Incremental { mechanics, crawl } => crawl.translate(mechanics, distance_m, duration_s),
        }
    }

    /// Whether it is exact: under the paper's laws alone, without mass.
    pub fn is_exact(&self) -> bool {
        matches!(self.0, MotionKind::Exact { .. })
    }

    /// The present worm, with the effect of the slope on its clamps.
    pub fn worm(&self) -> &Worm {
        match &self.0 {
            MotionKind::Exact { worm, .. } => worm,
            MotionKind::Incremental { mechanics, .. } => mechanics.worm(),
        }
    }

    /// Positions Xᵢ along the canal, m, cell 0 first.
    pub fn positions_m(&self) -> &[f64] {
        match &self.0 {
            MotionKind::Exact { motion, .. } => motion.positions_m(),
            MotionKind::Incremental { crawl, .. } => crawl.positions_m(),
        }
    }

    /// Mean position of the cells, m.
    pub fn mean_position_m(&self) -> f64 {
        match &self.0 {
            MotionKind::Exact { motion, .. } => motion.mean_position_m(),
            MotionKind::Incremental { crawl, .. } => crawl.mean_position_m(),
        }
    }

    /// Deformation δᵢ of a cell's pad, m.
    pub fn deformation_m(&self, cell: usize) -> f64 {
        match &self.0 {
            MotionKind::Exact { motion, .. } => motion.deformation_m(cell),
            MotionKind::Incremental { crawl, .. } => crawl.deformation_m(cell),
        }
    }

    /// Contact force on a cell's pad, N, positive when the pad is deformed forward.
    pub fn contact_force_n(&self, cell: usize) -> f64 {
        match &self.0 {
            MotionKind::Exact { worm, motion } => worm.contact(cell).stiffness_n_per_m * motion.deformation_m(cell),
            MotionKind::Incremental { crawl, .. } => crawl.contact_force_n(cell),
        }
    }

    /// Gait phase, cycles, unwrapped.
    pub fn phase(&self) -> f64 {
        match &self.0 {
            MotionKind::Exact { motion, .. } => motion.phase(),
            MotionKind::Incremental { crawl, .. } => crawl.phase(),
        }
    }

    /// Energies and slides since the motion began.
    pub fn ledger(&self) -> &Ledger {
        match &self.0 {
            MotionKind::Exact { motion, .. } => motion.ledger(),
            MotionKind::Incremental { crawl, .. } => crawl.ledger(),
        }
    }

    /// Force that the stepping cell's actuator exerts, N (13).
    pub fn actuator_force_n(&self) -> f64 {
        match &self.0 {
            MotionKind::Exact { worm, motion } => motion.actuator_force_n(worm),
            MotionKind::Incremental { mechanics, crawl } => crawl.actuator_force_n(mechanics),
        }
    }

    /// Present work of the whole drive per cycle of phase, J: Σ force × dX/dφ over the stepping cells.
    pub fn drive_load_j(&self) -> f64 {
        match &self.0 {
            MotionKind::Exact { worm, motion } => {
                let stroke_m = worm.stroke_of_m(motion.stepping_cell(worm));
                motion.actuator_force_n(worm) * stroke_m * worm.cells() as f64
            }
            MotionKind::Incremental { mechanics, crawl } => crawl.drive_load_j(mechanics),
        }
    }
}
