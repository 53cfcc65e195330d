//! Pictures for a page: inline SVG in one style, drawn by `plotters`.
//!
//! A picture is a [`Sheet`] with one or more [`Row`]s, drawn by [`draw`] through a [`Plot`], which knows lines, dots, bands,
//! bars and marks. Data may have gaps: `NaN` breaks a line and draws nothing, so no picture holds a coordinate that is not
//! finite. Lines are thinned to what the picture can show.

mod axis;
mod canvas;
mod decimate;
mod palette;
mod raw;
#[cfg(test)]
mod tests;

pub use axis::Axis;
pub use canvas::{DrawError, Plot, Row, Sheet, Stroke, draw};
pub use palette::{
    ACCENT, BLUE, Colour, GOOD, GRID, INK, LIGHT, MID, MUTED, PAPER, SHADE, VERMILION, cell_colours, css, diverging,
};

pub(super) use raw::Raw;
pub use raw::Svg;
