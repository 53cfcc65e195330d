//! The curves as a picture: one panel for each, several sets of answers in each panel, so that settings of the search or test beds can be
//! compared.

use super::assessment::Assessment;
use super::curves::Curves;
use super::statistics::Proportion;
use plotters::coord::Shift;
use plotters::prelude::{
    ChartBuilder, Circle, Color, DrawingArea, IntoDrawingArea, IntoFont, PathElement, RGBColor, SVGBackend, Text, WHITE,
};
use std::path::Path;

/// A set of assessments with the name that stands in the legend.
pub struct Series<'a> {
    pub name: String,
    pub assessments: &'a [Assessment],
}

/// Okabe and Ito's colours, which the colour-blind can tell apart.
const COLOURS: [RGBColor; 5] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0x56, 0xb4, 0xe9),
];
const INK: RGBColor = RGBColor(0x22, 0x2b, 0x36);
const MUTED: RGBColor = RGBColor(0x6a, 0x75, 0x82);
/// Width and height of the picture, and height of its legend, pixels.
const SIZE: (u32, u32) = (960, 620);
const LEGEND: u32 = 30;
/// What lies between two series in one bin, so that their intervals do not cover each other, in widths of a bin.
const BESIDE: f64 = 0.11;

/// A panel: its title, the names of its bins, and the curve of a set.
struct Panel {
    title: &'static str,
    x_label: &'static str,
    scale: f64,
    curve: fn(&Curves<'_>) -> Vec<(f64, Proportion)>,
    /// What should be right in each bin; none where nothing is known of it.
    expected: fn(&Curves<'_>) -> Option<Vec<Option<f64>>>,
}

const PANELS: [Panel; 6] = [
    Panel {
        title: "Answers that are right",
        x_label: "stated probability from, %; dashes: stated on average",
        scale: 100.0,
        curve: |curves| curves.calibration(),
        expected: |curves| Some(curves.mean_stated()),
    },
    Panel {
        title: "Single effects: class right",
        x_label: "significance from, standard deviations",
        scale: 1.0,
        curve: |curves| curves.class_by_sigma(),
        expected: |_| None,
    },
    Panel {
        title: "Single effects: class right",
        x_label: "change of advance or energy from, %",
        scale: 100.0,
        curve: |curves| curves.class_by_impact(),
        expected: |_| None,
    },
    Panel {
        title: "Strangers: reported as outside",
        x_label: "significance from, standard deviations",
        scale: 1.0,
        curve: |curves| curves.strangers_by_sigma(),
        expected: |_| None,
    },
    Panel {
        title: "Clean worms: an effect named",
        x_label: "discrepancy put in from, \u{b5}m",
        scale: 1e6,
        curve: |curves| curves.clean_by_discrepancy(),
        expected: |_| None,
    },
    Panel {
        title: "Clean worms: outside the library",
        x_label: "discrepancy put in from, \u{b5}m",
        scale: 1e6,
        curve: |curves| curves.clean_outside_by_discrepancy(),
        expected: |_| None,
    },
];

/// Draws all curves of some sets of assessments, with exact 95 % intervals and the number of cases, as an SVG file.
///
/// # Errors
/// In words, where the file cannot be written.
pub fn draw(series: &[Series<'_>], file: &Path) -> Result<(), String> {
    let root = SVGBackend::new(file, SIZE).into_drawing_area();
    draw_on(&root, series).map_err(|error| format!("{}: {error}: name a file in an existing folder", file.display()))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw_on(root: &Area<'_>, series: &[Series<'_>]) -> Result<(), Box<dyn std::error::Error>> {
    root.fill(&WHITE)?;
    let (panels, legend) = root.split_vertically(SIZE.1 - LEGEND);
    for (panel, area) in PANELS.iter().zip(panels.split_evenly((2, 3))) {
        panel.draw(&area, series)?;
    }
    let mut left = 12;
    for (one, colour) in series.iter().zip(COLOURS.iter().cycle()) {
        let text = format!("{} ({})", one.name, one.assessments.len());
        legend.draw(&Circle::new((left, 12), 4, colour.filled()))?;
        legend.draw(&Text::new(
            text.clone(),
            (left + 10, 6),
            ("sans-serif", 13).into_font().color(&INK),
        ))?;
        left += 40 + 7 * i32::try_from(text.chars().count())?;
    }
    root.present()?;
    Ok(())
}

impl Panel {
    fn draw(&self, area: &Area<'_>, series: &[Series<'_>]) -> Result<(), Box<dyn std::error::Error>> {
        let curves: Vec<_> = series.iter().map(|one| Curves(one.assessments)).collect();
        let ends: Vec<f64> = curves
            .first()
            .map(self.curve)
            .unwrap_or_default()
            .iter()
            .map(|bin| bin.0)
            .collect();
        let mut chart = ChartBuilder::on(area)
            .caption(self.title, ("sans-serif", 14).into_font().color(&INK))
            .margin(8)
            .x_label_area_size(36)
            .y_label_area_size(36)
            .build_cartesian_2d(-0.6..ends.len() as f64 - 0.4, -4.0..109.0)?;
        let name = |at: &f64| {
            let bin = at.round();
            let end = ends.get(bin as usize).filter(|_| (at - bin).abs() < 0.01 && bin >= 0.0);
            end.map_or(String::new(), |end| format!("{:.0}", self.scale * end))
        };
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(0xe6, 0xea, 0xee))
            .axis_style(MUTED)
            .x_labels(4 * ends.len())
            .x_label_formatter(&name)
            .y_labels(6)
            .y_label_formatter(&|percent| format!("{percent:.0} %"))
            .x_desc(self.x_label)
            .label_style(("sans-serif", 11).into_font().color(&MUTED))
            .draw()?;
        for (number, (curve, colour)) in curves.iter().zip(COLOURS.iter().cycle()).enumerate() {
            let aside = BESIDE * (number as f64 - 0.5 * (series.len() as f64 - 1.0));
            let expected = (self.expected)(curve);
            for (bin, (_, proportion)) in (self.curve)(curve).into_iter().enumerate().filter(|bin| bin.1.1.of > 0) {
                let x = bin as f64 + aside;
                let [low, high] = proportion.interval().map(|end| 100.0 * end);
                let y = 100.0 * proportion.hits as f64 / proportion.of as f64;
                let count = proportion.of.to_string();
                chart.draw_series([PathElement::new(vec![(x, low), (x, high)], colour.stroke_width(2))])?;
                chart.draw_series([Circle::new((x, y), 4, colour.filled())])?;
                if series.len() == 1 {
                    let place = (x + 0.08, y + 3.0);
                    chart.draw_series([Text::new(count, place, ("sans-serif", 10).into_font().color(&MUTED))])?;
                }
                if let Some(stated) = expected.as_ref().and_then(|each| each.get(bin).copied().flatten()) {
                    let ends = vec![(x - 0.2, 100.0 * stated), (x + 0.2, 100.0 * stated)];
                    chart.draw_series([PathElement::new(ends, INK.stroke_width(2))])?;
                }
            }
        }
        Ok(())
    }
}
