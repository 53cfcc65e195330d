//! A picture without axes.

use super::error::DrawError;
use super::palette::Colour;
use super::stroke::Stroke;
use super::units::dots;
use maud::{Markup, PreEscaped, html};
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, IntoDrawingArea, PathElement, Polygon, SVGBackend, Text};
use plotters::style::{Color, TextStyle};

/// A finished picture: inline SVG.
pub type Svg = Markup;

/// A picture without axes, in units from its upper left corner.
pub(in crate::report) struct Raw<'b> {
    /// Where it is drawn.
    pub(super) area: DrawingArea<SVGBackend<'b>, Shift>,
}

impl Raw<'_> {
    /// Draws a picture of a size in units, as inline SVG.
    pub(in crate::report) fn picture(
        description: &str,
        width: f64,
        height: f64,
        paint: impl FnOnce(&Raw<'_>) -> Result<(), DrawError>,
    ) -> Result<Svg, DrawError> {
        let size = (dots(width) as u32, dots(height) as u32);
        let mut svg = String::new();
        let raw = Raw {
            area: SVGBackend::with_string(&mut svg, size).into_drawing_area(),
        };
        paint(&raw)?;
        raw.area.present()?;
        drop(raw);
        // The page sizes its pictures itself, so the outer tag with the backend's fixed size makes way for another.
        let inside = svg.split_once('>').map_or("", |(_, inside)| inside);
        let inside = inside.trim_end().trim_end_matches("</svg>");
        let view_box = format!("0 0 {} {}", size.0, size.1);
        // The backend has escaped its text: this is the one place where markup is taken as it is.
        Ok(html! {
            svg.plot viewBox=(view_box) role="img" aria-label=(description) { (PreEscaped(inside)) }
        })
    }

    /// A filled shape.
    pub(in crate::report) fn shape(
        &self,
        corners: &[(f64, f64)],
        colour: Colour,
        opacity: f64,
    ) -> Result<(), DrawError> {
        let corners = corners.iter().map(|&(x, y)| (dots(x), dots(y))).collect::<Vec<_>>();
        self.area.draw(&Polygon::new(corners, colour.mix(opacity).filled()))?;
        Ok(())
    }

    /// A line.
    pub(in crate::report) fn path(&self, points: &[(f64, f64)], stroke: Stroke) -> Result<(), DrawError> {
        let points = points.iter().map(|&(x, y)| (dots(x), dots(y))).collect::<Vec<_>>();
        self.area.draw(&PathElement::new(points, stroke.style()))?;
        Ok(())
    }

    /// Text at a place.
    pub(super) fn text(&self, place: (f64, f64), text: &str, style: TextStyle<'_>) -> Result<(), DrawError> {
        let place = (dots(place.0), dots(place.1));
        self.area.draw(&Text::new(text.to_owned(), place, style))?;
        Ok(())
    }
}
