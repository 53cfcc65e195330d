//! Units of a sheet, and the style of its text.

use super::palette::Colour;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, IntoFont, TextStyle};

/// Dots of the drawing per unit of a sheet: the backend knows whole dots only.
const DOTS: f64 = 4.0;
/// Height of text, units.
pub(super) const TEXT: f64 = 14.0;
/// What `plotters` divides text sizes by when it writes SVG.
const TEXT_FACTOR: f64 = 1.24;

/// Units as dots.
pub(super) fn dots(units: f64) -> i32 {
    (units * DOTS).round() as i32
}

/// Height of text for `plotters`.
pub(super) fn text_size() -> f64 {
    TEXT * DOTS * TEXT_FACTOR
}

/// The style of text, and its alignment to its place.
pub(super) fn text_style(colour: Colour, horizontal: HPos, vertical: VPos, bold: bool) -> TextStyle<'static> {
    let style = if bold { FontStyle::Bold } else { FontStyle::Normal };
    ("sans-serif", text_size(), style)
        .into_font()
        .color(&colour)
        .pos(Pos::new(horizontal, vertical))
}
