//! The description of one worm in one canal.

mod contact;
mod error;

pub use contact::Contact;
pub use error::{SlidesDown, WormError};

use crate::MAX_CELLS;
use error::require;
use std::f64::consts::FRAC_PI_2;

/// Standard gravity as the paper's figures use it, m/s².
pub const GRAVITY_M_PER_S2: f64 = 9.81;

/// Fraction by which the pull may exceed the hold and still count as rounding.
const HOLD_ROUNDING: f64 = 1e-12;

/// One worm in one canal, validated. Cells are counted from 0.
///
/// Fixed size, no heap: a virtual worm can exchange it between two ticks of a real-time loop.
///
/// ```
/// use worm_physics::{Contact, Worm};
/// let worm = Worm::paper()
///     .with_max_deformations_m(&[2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3])?
///     .with_slope_rad(30f64.to_radians())?;
/// assert_eq!(worm.contact(1), Contact::symmetric(980.0, 1.1e-3));
/// # Ok::<(), worm_physics::WormError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Worm {
    cells: usize, // in 2..=MAX_CELLS
    contact: [Contact; MAX_CELLS],
    mass_kg: [f64; MAX_CELLS],
    stroke_m: f64,                  // above 0
    stroke_scale: [f64; MAX_CELLS], // 0 or more
    slope_rad: f64,                 // in −π/2..=π/2
    slope_sine: f64,                // of slope_rad, kept because the solver needs it in every increment
    step_order: [usize; MAX_CELLS], // its first `cells` entries are a permutation
    gravity_m_per_s2: f64,
    resisting_force_n: f64,
}

impl Worm {
    /// Equal cells on the level that step in the order 0, 1, 2, …; `mass_kg` is the mass of the whole worm.
    ///
    /// # Errors
    /// [`WormError`] when there are fewer than 2 or more than [`MAX_CELLS`] cells or a quantity is out of its range.
    pub fn uniform(cells: usize, contact: Contact, mass_kg: f64, stroke_m: f64) -> Result<Self, WormError> {
        if !(2..=MAX_CELLS).contains(&cells) {
            return Err(WormError::CellCount(cells));
        }
        contact.check()?;
        require(mass_kg > 0.0, "mass_kg", mass_kg, "above 0")?;
        require(stroke_m > 0.0, "stroke_m", stroke_m, "above 0")?;
        Ok(Self {
            cells,
            contact: [contact; MAX_CELLS],
            mass_kg: [mass_kg / cells as f64; MAX_CELLS],
            stroke_m,
            stroke_scale: [1.0; MAX_CELLS],
            slope_rad: 0.0,
            slope_sine: 0.0,
            step_order: std::array::from_fn(|cell| cell),
            gravity_m_per_s2: GRAVITY_M_PER_S2,
            resisting_force_n: 0.0,
        })
    }

    /// The robot of the paper (section 2) with equal clamps: 4 cells, 0.333 kg, 11.5 mm stroke, 980 N/m, 1.75 mm.
    pub fn paper() -> Self {
        let contact = Contact::symmetric(980.0, 1.75e-3);
        Self::uniform(4, contact, 0.333, 11.5e-3).expect("the figures of the paper are in range")
    }

    /// This worm with another contact at one cell.
    ///
    /// # Errors
    /// [`WormError::NoSuchCell`] or [`WormError::OutOfRange`].
    pub fn with_contact(mut self, cell: usize, contact: Contact) -> Result<Self, WormError> {
        self.check_cell(cell)?;
        contact.check()?;
        self.contact[cell] = contact;
        Ok(self)
    }

    /// This worm with a largest tip deformation for each cell, the same both ways, m.
    ///
    /// # Errors
    /// [`WormError::ListLength`] or [`WormError::OutOfRange`].
    pub fn with_max_deformations_m(mut self, max_deformation_m: &[f64]) -> Result<Self, WormError> {
        self.check_length("max_deformation_m", max_deformation_m.len())?;
        for (contact, &bound_m) in self.contact.iter_mut().zip(max_deformation_m) {
            *contact = Contact::symmetric(contact.stiffness_n_per_m, bound_m);
            contact.check()?;
        }
        Ok(self)
    }

    /// This worm with a mass for each cell, kg; 0 is allowed for some, not for all.
    ///
    /// # Errors
    /// [`WormError::ListLength`] or [`WormError::OutOfRange`].
    pub fn with_masses_kg(mut self, mass_kg: &[f64]) -> Result<Self, WormError> {
        self.check_length("mass_kg", mass_kg.len())?;
        for &mass in mass_kg {
            require(mass >= 0.0, "mass_kg", mass, "0 or more")?;
        }
        self.mass_kg[..self.cells].copy_from_slice(mass_kg);
        require(
            self.mass_kg() > 0.0,
            "mass_kg",
            self.mass_kg(),
            "above 0 for the whole worm",
        )?;
        Ok(self)
    }

    /// This worm in a canal of another slope, rad, positive uphill, from −π/2 to π/2.
    ///
    /// # Errors
    /// [`WormError::OutOfRange`].
    pub fn with_slope_rad(mut self, slope_rad: f64) -> Result<Self, WormError> {
        require(
            slope_rad.abs() <= FRAC_PI_2,
            "slope_rad",
            slope_rad,
            "from -π/2 to π/2 (-90° to 90°)",
        )?;
        self.slope_rad = slope_rad;
        self.slope_sine = slope_rad.sin();
        Ok(self)
    }

    /// This worm with another stroke, m.
    ///
    /// # Errors
    /// [`WormError::OutOfRange`].
    pub fn with_stroke_m(mut self, stroke_m: f64) -> Result<Self, WormError> {
        require(stroke_m > 0.0, "stroke_m", stroke_m, "above 0")?;
        self.stroke_m = stroke_m;
        Ok(self)
    }

    /// This worm with another total mass, kg; the cells keep their fractions of it.
    ///
    /// # Errors
    /// [`WormError::OutOfRange`].
    pub fn with_mass_kg(mut self, mass_kg: f64) -> Result<Self, WormError> {
        require(mass_kg > 0.0, "mass_kg", mass_kg, "above 0")?;
        let scale = mass_kg / self.mass_kg();
        self.mass_kg[..self.cells].iter_mut().for_each(|mass| *mass *= scale);
        Ok(self)
    }

    /// This worm with its cells stepping in another order: `step_order[0]` steps first.
    ///
    /// # Errors
    /// [`WormError::StepOrder`] unless every cell is named once.
    pub fn with_step_order(mut self, step_order: &[usize]) -> Result<Self, WormError> {
        let names_all = (0..self.cells).all(|cell| step_order.contains(&cell));
        if step_order.len() != self.cells || !names_all {
            return Err(WormError::StepOrder(step_order.to_vec()));
        }
        self.step_order[..self.cells].copy_from_slice(step_order);
        Ok(self)
    }

    /// This worm with one cell making only a fraction of the stroke, 0 (jammed: its step passes without motion) to 1.
    ///
    /// Over a cycle such a cell falls behind the others by what it lacks; restored, it goes on from where it is.
    ///
    /// # Errors
    /// [`WormError::NoSuchCell`] or [`WormError::OutOfRange`].
    pub fn with_stroke_scale(mut self, cell: usize, scale: f64) -> Result<Self, WormError> {
        self.check_cell(cell)?;
        require((0.0..=1.0).contains(&scale), "stroke_scale", scale, "from 0 to 1")?;
        self.stroke_scale[cell] = scale;
        Ok(self)
    }

    /// This worm under another gravity, m/s².
    ///
    /// # Errors
    /// [`WormError::OutOfRange`].
    pub fn with_gravity_m_per_s2(mut self, gravity_m_per_s2: f64) -> Result<Self, WormError> {
        require(
            gravity_m_per_s2 >= 0.0,
            "gravity_m_per_s2",
            gravity_m_per_s2,
            "0 or more",
        )?;
        self.gravity_m_per_s2 = gravity_m_per_s2;
        Ok(self)
    }

    /// This worm against a constant force besides its weight (a tether, say), N, positive towards smaller positions.
    /// All cells share it equally.
    ///
    /// # Errors
    /// [`WormError::OutOfRange`].
    pub fn with_resisting_force_n(mut self, resisting_force_n: f64) -> Result<Self, WormError> {
        require(true, "resisting_force_n", resisting_force_n, "of either sign")?;
        self.resisting_force_n = resisting_force_n;
        Ok(self)
    }

    /// The same worm seen from the other end of the canal: positions, slope, resisting force and bounds change sign,
    /// and the step order is reversed. Its forward crawl is the mirror image of this worm's crawl in reverse.
    pub fn mirrored(mut self) -> Self {
        self.slope_rad = -self.slope_rad;
        self.slope_sine = -self.slope_sine;
        self.resisting_force_n = -self.resisting_force_n;
        self.step_order[..self.cells].reverse();
        for contact in &mut self.contact {
            std::mem::swap(&mut contact.forward_bound_m, &mut contact.backward_bound_m);
        }
        self
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// The contact of a cell.
    pub fn contact(&self, cell: usize) -> Contact {
        self.contacts()[cell]
    }

    /// The contacts, cell 0 first.
    pub fn contacts(&self) -> &[Contact] {
        &self.contact[..self.cells]
    }

    /// Mass of each cell, kg.
    pub fn masses_kg(&self) -> &[f64] {
        &self.mass_kg[..self.cells]
    }

    /// Mass of the whole worm, kg.
    pub fn mass_kg(&self) -> f64 {
        self.masses_kg().iter().sum()
    }

    /// The stroke of an unhindered cell, m.
    pub fn stroke_m(&self) -> f64 {
        self.stroke_m
    }

    /// The stroke of a cell, its scale included, m.
    pub fn stroke_of_m(&self, cell: usize) -> f64 {
        self.stroke_m * self.stroke_scale[..self.cells][cell]
    }

    /// Slope of the canal, rad.
    pub fn slope_rad(&self) -> f64 {
        self.slope_rad
    }

    /// The cells in the order in which they step.
    pub fn step_order(&self) -> &[usize] {
        &self.step_order[..self.cells]
    }

    /// Gravity, m/s².
    pub fn gravity_m_per_s2(&self) -> f64 {
        self.gravity_m_per_s2
    }

    /// Constant force besides the weight, N.
    pub fn resisting_force_n(&self) -> f64 {
        self.resisting_force_n
    }

    /// Weight m g of the whole worm, N.
    pub fn weight_n(&self) -> f64 {
        self.mass_kg() * self.gravity_m_per_s2
    }

    /// Pull on the body, back along the canal: m g sin λ and the resisting force, N.
    pub fn pull_n(&self) -> f64 {
        self.weight_n() * self.slope_sine + self.resisting_force_n
    }

    /// A cell's own weight along the canal, mᵢ g sin λ, N.
    pub fn cell_weight_n(&self, cell: usize) -> f64 {
        self.mass_kg[cell] * self.gravity_m_per_s2 * self.slope_sine
    }

    /// A cell's part of the resisting force, N.
    pub fn cell_resistance_n(&self) -> f64 {
        self.resisting_force_n / self.cells as f64
    }

    /// Scales the friction of one cell, or of all: both bounds.
    pub fn scale_friction(&mut self, cell: Option<usize>, factor: f64) {
        for contact in &mut self.contact[cells_meant(cell, self.cells)] {
            contact.forward_bound_m *= factor;
            contact.backward_bound_m *= factor;
        }
    }

    /// Scales the stiffness of one cell's contact, or of all; the friction force stays, so the bounds shrink as it grows.
    pub fn scale_stiffness(&mut self, cell: Option<usize>, factor: f64) {
        for contact in &mut self.contact[cells_meant(cell, self.cells)] {
            contact.stiffness_n_per_m *= factor;
            contact.forward_bound_m /= factor;
            contact.backward_bound_m /= factor;
        }
    }

    /// Scales what every tip holds backward.
    pub(super) fn scale_backward_friction(&mut self, factor: f64) {
        for contact in &mut self.contact {
            contact.backward_bound_m *= factor;
        }
    }

    /// Scales the stroke of one cell, or of all.
    pub fn scale_stroke(&mut self, cell: Option<usize>, factor: f64) {
        for scale in &mut self.stroke_scale[cells_meant(cell, self.cells)] {
            *scale *= factor;
        }
    }

    /// Adds a resisting force, N.
    pub(super) fn add_resisting_force_n(&mut self, force_n: f64) {
        self.resisting_force_n += force_n;
    }

    /// Adds mass in equal parts, kg; no cell gets less than 0.
    pub fn add_mass_kg(&mut self, mass_kg: f64) {
        let part_kg = mass_kg / self.cells as f64;
        for mass in &mut self.mass_kg[..self.cells] {
            *mass = (*mass + part_kg).max(0.0);
        }
    }

    /// Restores the forward bounds, the masses and the mean stroke of `found`, the same worm before effects.
    pub(super) fn keep_found(&mut self, found: &Self) {
        let mean_scale = self.stroke_scale[..self.cells].iter().sum::<f64>() / self.cells as f64;
        for cell in 0..self.cells {
            let contact = &mut self.contact[cell];
            let bound_m = found.contact[cell].forward_bound_m;
            if contact.forward_bound_m > 0.0 {
                contact.backward_bound_m *= bound_m / contact.forward_bound_m;
            }
            contact.forward_bound_m = bound_m;
            self.stroke_scale[cell] /= mean_scale;
        }
        self.mass_kg = found.mass_kg;
    }

    /// Tilts the canal further, rad, up to the vertical.
    pub fn tilt_rad(&mut self, angle_rad: f64) {
        self.slope_rad = (self.slope_rad + angle_rad).clamp(-FRAC_PI_2, FRAC_PI_2);
        self.slope_sine = self.slope_rad.sin();
    }

    /// Whether the tips can hold the resting worm.
    ///
    /// # Errors
    /// [`SlidesDown`] when the pull exceeds what all tips hold at their bounds together.
    pub fn check_hold(&self) -> Result<(), SlidesDown> {
        let pull_n = self.pull_n();
        let hold_n: f64 = self
            .contacts()
            .iter()
            .map(|contact| {
                let bound_m = if pull_n >= 0.0 {
                    contact.backward_bound_m
                } else {
                    contact.forward_bound_m
                };
                contact.stiffness_n_per_m * bound_m
            })
            .sum();
        if pull_n.abs() > hold_n * (1.0 + HOLD_ROUNDING) {
            return Err(SlidesDown { pull_n, hold_n });
        }
        Ok(())
    }

    fn check_cell(&self, cell: usize) -> Result<(), WormError> {
        if cell < self.cells {
            Ok(())
        } else {
            Err(WormError::NoSuchCell {
                cell,
                cells: self.cells,
            })
        }
    }

    fn check_length(&self, quantity: &'static str, given: usize) -> Result<(), WormError> {
        if given == self.cells {
            Ok(())
        } else {
            Err(WormError::ListLength {
                quantity,
                given,
                cells: self.cells,
            })
        }
    }
}

/// One cell, or all of them.
fn cells_meant(cell: Option<usize>, cells: usize) -> std::ops::Range<usize> {
    cell.map_or(0..cells, |cell| cell.min(cells - 1)..cell.min(cells - 1) + 1)
}
