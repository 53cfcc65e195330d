//! The worm that a configuration describes.

use super::worm::{Contact, Worm, WormError};
use crate::config::Config;

impl TryFrom<&Config> for Worm {
    type Error = WormError;

    /// The worm of `[worm]` in the canal of `[canal]`.
    ///
    /// # Errors
    /// [`WormError`] for values that a checked configuration does not hold.
    fn try_from(config: &Config) -> Result<Self, WormError> {
        let body = &config.worm;
        let contact = |cell| Contact::symmetric(body.stiffness_n_per_m.of(cell), body.max_deformation_m.of(cell));
        let mut worm = Self::uniform(body.cells, contact(0), body.mass_kg, body.stroke_m)?
            .with_step_order(&body.step_order_from_zero())?
            .with_slope_rad(config.canal.slope_deg.to_radians())?;
        for cell in 1..body.cells {
            worm = worm.with_contact(cell, contact(cell))?;
        }
        Ok(worm)
    }
}
