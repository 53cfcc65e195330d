//! Why a picture could not be drawn.

use plotters::drawing::DrawingAreaErrorKind;

/// A picture could not be drawn. Drawing into memory should not fail, but the backend may report that it did.
#[derive(Debug, thiserror::Error)]
#[error("a figure could not be drawn: {0}")]
pub struct DrawError(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for DrawError {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self(error.to_string())
    }
}
