//! The style of a line.

use super::palette::Colour;
use super::units::dots;
use plotters::style::{Color, ShapeStyle};

/// How a line is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Stroke {
    colour: Colour,
    width: f64,
    opacity: f64,
    pub(super) dashed: bool,
}

impl Stroke {
    /// A full line of a width in units.
    pub fn new(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            opacity: 1.0,
            dashed: false,
        }
    }

    /// The line with less than full colour, 0 to 1.
    pub fn faint(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }

    /// The line broken into dashes.
    pub fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }

    /// The style for `plotters`.
    pub(super) fn style(self) -> ShapeStyle {
        self.colour.mix(self.opacity).stroke_width(dots(self.width) as u32)
    }
}
