//! Pictures for a page: inline SVG in one style, drawn by `plotters`.
//!
//! A picture is a [`Sheet`] with one or more [`Row`]s, drawn by [`draw`] through a [`Plot`], which knows lines, dots, bands,
//! bars and marks. Data may have gaps: `NaN` breaks a line and draws nothing, so no picture holds a coordinate that is not
//! finite. Lines are thinned to what the picture can show.

mod axis;
mod canvas;
mod decimate;
mod error;
mod palette;
mod raw;
mod stroke;
#[cfg(test)]
mod tests;
mod units;

pub use axis::Axis;
pub use canvas::{Plot, Row, Sheet, draw};
pub use error::DrawError;
pub use palette::{
    ACCENT, BLUE, Colour, GOOD, GRID, INK, LIGHT, MID, MUTED, PAPER, SHADE, VERMILION, cell_colours, css, diverging,
};

pub(super) use raw::Raw;
pub use raw::Svg;
pub use stroke::Stroke;
