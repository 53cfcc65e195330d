//! The worm and the physics that a configuration describes.

use super::Config;
use worm_physics::effect::{Setting, SettingError};
use worm_physics::{Contact, Physics, Worm, WormError};

impl TryFrom<&Config> for Worm {
    type Error = WormError;

    /// The worm of `[worm]` in the canal of `[canal]`.
    ///
    /// # Errors
    /// [`WormError`] for values that a checked configuration cannot have.
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

/// Why a configuration describes no valid physics. A checked one always does.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PhysicsError {
    /// The worm is not valid.
    #[error(transparent)]
    Worm(#[from] WormError),
    /// An effect is not valid.
    #[error(transparent)]
    Effect(#[from] SettingError),
}

impl TryFrom<&Config> for Physics {
    type Error = PhysicsError;

    /// The worm of `[worm]` in the canal of `[canal]` with every `[[effect]]`.
    ///
    /// # Errors
    /// [`PhysicsError`] for values that a checked configuration cannot have.
    fn try_from(config: &Config) -> Result<Self, PhysicsError> {
        Ok(Self::of(Worm::try_from(config)?).with(&config.effect_settings()?))
    }
}

impl Config {
    /// Every `[[effect]]`, as a setting of the physics.
    ///
    /// # Errors
    /// [`SettingError`] for an effect that a checked configuration cannot have.
    pub fn effect_settings(&self) -> Result<Vec<Setting>, SettingError> {
        let cells = self.worm.cells;
        self.effect.iter().map(|effect| effect.setting(cells)).collect()
    }
}
