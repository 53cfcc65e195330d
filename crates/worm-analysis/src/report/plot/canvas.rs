//! What draws: sheets, rows, and the marks that a plot knows.

use super::axis::Axis;
use super::decimate;
use super::error::DrawError;
use super::palette::{Colour, GRID, INK, MUTED, PAPER};
use super::raw::{Raw, Svg};
use super::stroke::Stroke;
use super::units::{TEXT, dots, text_size, text_style};
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, Circle, EmptyElement, LabelAreaPosition, PathElement, Polygon, Rectangle,
    SVGBackend, Text,
};
use plotters::series::DashedLineSeries;
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, IntoFont};

/// Width of a sheet, in units; text and lines are sized for about that many CSS pixels.
const WIDTH: f64 = 600.0;
const LEFT: f64 = 50.0;
/// Width of a character of a name to the left, and of the space beside it.
const NAME_CHARACTER: f64 = 0.53 * TEXT;
const BESIDE_NAME: f64 = 14.0;
const RIGHT: f64 = 10.0;
const ROW_LABEL: f64 = 44.0;
const BOLD_CHARACTER: f64 = 0.65 * TEXT;
const TOP: f64 = 20.0;
const TICK_LABELS: f64 = 24.0;
const X_LABEL: f64 = 20.0;
const BETWEEN_ROWS: f64 = 16.0;

/// A picture: rows above each other over one horizontal axis.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// What it shows, for readers who cannot see it.
    pub description: String,
    /// Label of the horizontal axis; none for named places.
    pub x_label: Option<String>,
    /// The horizontal axis.
    pub x: Axis,
    /// The rows, topmost first.
    pub rows: Vec<Row>,
}

/// One row of a picture.
#[derive(Debug, Clone)]
pub struct Row {
    /// Its vertical axis.
    pub y: Axis,
    /// Height of its plot, units.
    pub height: f64,
    /// Its label, to its right, and the label's colour.
    pub label: Option<(String, Colour)>,
}

impl Row {
    /// A row without a label.
    pub fn new(y: Axis, height: f64) -> Self {
        Self { y, height, label: None }
    }
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;

/// One row while it is being drawn. Places are in the units of its axes; what has no finite place is left out.
pub struct Plot<'p, 'a, 'b> {
    chart: &'p mut Chart<'a, 'b>,
    x: &'p Axis,
    y: &'p Axis,
    width: f64, // units, without the axis
}

impl Plot<'_, '_, '_> {
    /// A line through points that grow in x, broken where a point is not finite.
    ///
    /// # Errors
    /// [`DrawError`], as all that draws.
    pub fn line(&mut self, points: impl IntoIterator<Item = (f64, f64)>, stroke: Stroke) -> Result<(), DrawError> {
        let columns = (WIDTH - LEFT - RIGHT) as usize;
        for piece in decimate::pieces(points) {
            let mut piece = decimate::thinned(&piece, self.x, columns);
            if let [alone] = piece[..] {
                piece.push(alone); // A line from a point to itself has round ends and shows as a dot.
            }
            self.draw_piece(piece, stroke)?;
        }
        Ok(())
    }

    fn draw_piece(&mut self, piece: Vec<(f64, f64)>, stroke: Stroke) -> Result<(), DrawError> {
        if stroke.dashed {
            let (dash, gap) = (dots(5.0), dots(5.0));
            self.chart
                .draw_series(DashedLineSeries::new(piece, dash, gap, stroke.style()))?;
        } else {
            self.chart
                .draw_series(std::iter::once(PathElement::new(piece, stroke.style())))?;
        }
        Ok(())
    }

    /// A horizontal line over the whole width.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn horizontal_line(&mut self, y: f64, stroke: Stroke) -> Result<(), DrawError> {
        self.line([(self.x.low(), y), (self.x.high(), y)], stroke)
    }

    /// A vertical line at a place, from one height to another.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn vertical_line(&mut self, x: f64, from: f64, to: f64, stroke: Stroke) -> Result<(), DrawError> {
        if [x, from, to].into_iter().all(Axis::is_drawable) {
            self.draw_piece(vec![(x, from), (x, to)], stroke)?;
        }
        Ok(())
    }

    /// A named threshold: a dashed vertical line at a place, from one height to another.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn threshold(&mut self, x: f64, y: [f64; 2], colour: Colour, name: &str) -> Result<(), DrawError> {
        // Pale under the dashes, so that they show on a dark bar.
        self.vertical_line(x, y[0], y[1], Stroke::new(PAPER, 3.0))?;
        self.vertical_line(x, y[0], y[1], Stroke::new(INK, 1.5).dashed())?;
        self.label_above(x, colour, name)
    }

    /// Dots, of a radius in units.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn dots(
        &mut self,
        points: impl IntoIterator<Item = (f64, f64)>,
        colour: Colour,
        radius: f64,
    ) -> Result<(), DrawError> {
        let pieces = decimate::pieces(points);
        let circles = pieces
            .into_iter()
            .flatten()
            .map(|point| Circle::new(point, dots(radius), colour.filled()));
        self.chart.draw_series(circles)?;
        Ok(())
    }

    /// A ring: white with a coloured edge.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn ring(&mut self, x: f64, y: f64, colour: Colour) -> Result<(), DrawError> {
        if Axis::is_drawable(x) && Axis::is_drawable(y) {
            let edge = Circle::new((x, y), dots(3.8), Stroke::new(colour, 1.5).style());
            let ground = Circle::new((x, y), dots(3.8), PAPER.filled());
            self.chart.draw_series([ground, edge])?;
        }
        Ok(())
    }

    /// A filled diamond with a white edge.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn diamond(&mut self, x: f64, y: f64, colour: Colour) -> Result<(), DrawError> {
        if Axis::is_drawable(x) && Axis::is_drawable(y) {
            for (reach, colour) in [(6.0, PAPER), (4.6, colour)] {
                let r = dots(reach);
                let corners = Polygon::new(vec![(0, -r), (r, 0), (0, r), (-r, 0)], colour.filled());
                self.chart
                    .draw_series(std::iter::once(EmptyElement::at((x, y)) + corners))?;
            }
        }
        Ok(())
    }

    /// A filled box between two places and two heights.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn fill(&mut self, x: [f64; 2], y: [f64; 2], colour: Colour, opacity: f64) -> Result<(), DrawError> {
        if x.into_iter().chain(y).all(Axis::is_drawable) {
            let corners = [(x[0].min(x[1]), y[0].max(y[1])), (x[0].max(x[1]), y[0].min(y[1]))];
            let rectangle = Rectangle::new(corners, colour.mix(opacity).filled());
            self.chart.draw_series(std::iter::once(rectangle))?;
        }
        Ok(())
    }

    /// The edge of such a box.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn edge(&mut self, x: [f64; 2], y: [f64; 2], stroke: Stroke) -> Result<(), DrawError> {
        if x.into_iter().chain(y).all(Axis::is_drawable) {
            let corners = vec![(x[0], y[0]), (x[0], y[1]), (x[1], y[1]), (x[1], y[0]), (x[0], y[0])];
            let path = PathElement::new(corners, stroke.style());
            self.chart.draw_series(std::iter::once(path))?;
        }
        Ok(())
    }

    /// Whether a label of this many characters fits above a band of this width.
    pub fn has_room(&self, width: f64, characters: usize) -> bool {
        let units = width / (self.x.high() - self.x.low()) * self.width;
        units > 0.6 * TEXT * characters as f64 + 4.0
    }

    /// A band over the whole height between two places, with a label above it.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn band(&mut self, x: [f64; 2], colour: Colour, opacity: f64, name: &str) -> Result<(), DrawError> {
        self.fill(x, [self.y.low(), self.y.high()], colour, opacity)?;
        self.label_above(0.5 * (x[0] + x[1]), colour, name)
    }

    /// A label above the plot.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn label_above(&mut self, centre: f64, colour: Colour, name: &str) -> Result<(), DrawError> {
        if Axis::is_drawable(centre) && !name.is_empty() {
            let style = text_style(colour, HPos::Center, VPos::Bottom, true);
            let text = Text::new(name.to_owned(), (0, -dots(2.0)), style);
            self.chart
                .draw_series(std::iter::once(EmptyElement::at((centre, self.y.high())) + text))?;
        }
        Ok(())
    }

    /// Text that begins just right of a place.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn text_beside(&mut self, x: f64, y: f64, colour: Colour, text: &str) -> Result<(), DrawError> {
        if Axis::is_drawable(x) && Axis::is_drawable(y) {
            let style = text_style(colour, HPos::Left, VPos::Center, false);
            let text = Text::new(text.to_owned(), (dots(5.0), 0), style);
            self.chart
                .draw_series(std::iter::once(EmptyElement::at((x, y)) + text))?;
        }
        Ok(())
    }

    /// A ribbon between two lines, from points of a place and two heights that grow in x; broken where one is not finite.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn ribbon(
        &mut self,
        points: impl IntoIterator<Item = (f64, [f64; 2])>,
        colour: Colour,
        opacity: f64,
    ) -> Result<(), DrawError> {
        let points: Vec<(f64, [f64; 2])> = points.into_iter().collect();
        let is_drawable = |(x, y): &(f64, [f64; 2])| [*x, y[0], y[1]].into_iter().all(Axis::is_drawable);
        for piece in points.split(|point| !is_drawable(point)) {
            if piece.len() < 2 {
                continue; // It has no width.
            }
            let there = piece.iter().map(|(x, y)| (*x, y[0]));
            let back = piece.iter().rev().map(|(x, y)| (*x, y[1]));
            let ribbon = Polygon::new(there.chain(back).collect::<Vec<_>>(), colour.mix(opacity).filled());
            self.chart.draw_series(std::iter::once(ribbon))?;
        }
        Ok(())
    }

    /// A whisker: a vertical line from one height to another with feet.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn whisker(&mut self, x: f64, from: f64, to: f64, foot: f64) -> Result<(), DrawError> {
        let stroke = Stroke::new(INK, 1.2);
        self.vertical_line(x, from, to, stroke)?;
        for y in [from, to] {
            self.line([(x - foot, y), (x + foot, y)], stroke)?;
        }
        Ok(())
    }
}

/// Draws a sheet as inline SVG: `paint` is called for each row with its number, topmost first.
///
/// # Errors
/// [`DrawError`].
pub fn draw(
    sheet: &Sheet,
    mut paint: impl FnMut(usize, &mut Plot<'_, '_, '_>) -> Result<(), DrawError>,
) -> Result<Svg, DrawError> {
    let rows_height: f64 = sheet.rows.iter().map(|row| row.height + BETWEEN_ROWS).sum();
    let longest_name = sheet.rows.iter().map(|row| row.y.longest_name()).max().unwrap_or(0);
    let left = (NAME_CHARACTER * longest_name as f64 + BESIDE_NAME).clamp(LEFT, 0.5 * WIDTH);
    let foot = TICK_LABELS + if sheet.x_label.is_some() { X_LABEL } else { 0.0 };
    let height = TOP + rows_height - BETWEEN_ROWS + foot;
    let labels = sheet.rows.iter().filter_map(|row| row.label.as_ref());
    let right = labels
        .map(|(label, _)| ROW_LABEL.max(BOLD_CHARACTER * label.chars().count() as f64 + BESIDE_NAME))
        .fold(RIGHT, f64::max);
    Raw::picture(&sheet.description, WIDTH, height, |raw| {
        let mut top = TOP;
        for (number, row) in sheet.rows.iter().enumerate() {
            let is_last = number + 1 == sheet.rows.len();
            let tick_labels = if is_last { TICK_LABELS } else { 0.0 };
            let whole = raw
                .area
                .clone()
                .shrink((0, dots(top)), (dots(WIDTH - right), dots(row.height + tick_labels)));
            let mut chart = ChartBuilder::on(&whole)
                .set_label_area_size(LabelAreaPosition::Left, dots(left))
                .set_label_area_size(LabelAreaPosition::Bottom, dots(tick_labels))
                .build_cartesian_2d(sheet.x.clone(), row.y.clone())?;
            // Between named rows a grid means nothing.
            draw_axes(&mut chart, is_last, row.y.longest_name() == 0)?;
            let mut plot = Plot {
                chart: &mut chart,
                x: &sheet.x,
                y: &row.y,
                width: WIDTH - left - right,
            };
            paint(number, &mut plot)?;
            if let Some((label, colour)) = &row.label {
                let place = (WIDTH - right + 4.0, top + 0.5 * row.height);
                raw.text(place, label, text_style(*colour, HPos::Left, VPos::Center, true))?;
            }
            top += row.height + BETWEEN_ROWS;
        }
        if let Some(x_label) = &sheet.x_label {
            let place = (0.5 * (left + WIDTH - right), height - 2.0);
            raw.text(place, x_label, text_style(MUTED, HPos::Center, VPos::Bottom, false))?;
        }
        Ok(())
    })
}

fn draw_axes(chart: &mut Chart<'_, '_>, with_x_labels: bool, with_y_grid: bool) -> Result<(), DrawError> {
    let grid = Stroke::new(GRID, 1.0).style();
    let mut mesh = chart.configure_mesh();
    mesh.disable_x_mesh()
        .bold_line_style(grid)
        .light_line_style(PAPER.mix(0.0))
        .axis_style(Stroke::new(MUTED, 0.75).style())
        .set_all_tick_mark_size(dots(3.0))
        .label_style(("sans-serif", text_size()).into_font().color(&MUTED));
    if !with_y_grid {
        mesh.disable_y_mesh();
    }
    if !with_x_labels {
        mesh.disable_x_axis();
    }
    mesh.draw()?;
    Ok(())
}
