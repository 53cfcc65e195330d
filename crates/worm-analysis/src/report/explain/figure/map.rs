//! Where model and data disagree: a map for each run, cell by phase, before and after.

use super::super::view::{best_model, cells};
use crate::explain::Answer;
use crate::explain::answer::ResidualMap;
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{
    Axis, Colour, DrawError, INK, LIGHT, MUTED, PAPER, Plot, Row, Sheet, Stroke, Svg, cell_colours, diverging, draw,
};
use crate::report::runs::names_by_slope;
use worm_estimator::number::{count, fixed};

/// Standard errors from which a bin is marked, and from which it is marked strongly.
const SIGNIFICANT: f64 = 3.0;
const VERY_SIGNIFICANT: f64 = 5.0;
/// Height of a cell's row, units, and the smallest of a map.
const ROW: f64 = 30.0;
const MIN_HEIGHT: f64 = 80.0;
/// Fraction of the scale from which a mark must be white to be visible.
const DARK: f64 = 0.7;

pub(super) fn figure(answer: &Answer) -> Result<Figure, DrawError> {
    let figures = &answer.figures;
    let maps = figures.maps_before.iter().chain(&figures.maps_after);
    let values_m = maps.flat_map(|map| map.residual_m.iter().flatten().copied());
    let known_m = values_m.map(f64::abs).filter(|value_m| Axis::is_drawable(*value_m));
    let largest_m = known_m.fold(0.0, f64::max);
    let colours = cell_colours(cells(answer));
    let names = names_by_slope(figures.maps_before.iter().map(|map| map.slope_deg));
    let mut panels = Vec::new();
    for (number, (name, before)) in names.into_iter().zip(&figures.maps_before).enumerate() {
        let model = best_model(answer);
        let after = figures.maps_after.get(number).map(|map| (map, &model[..]));
        let quantity = match after {
            Some(_) => format!("above: recalibrated; below: {model}"),
            None => "recalibrated model".to_owned(),
        };
        let svg = picture(&name, before, after, largest_m, &colours)?;
        panels.push(Panel::new(name, quantity, svg));
    }
    Ok(Figure {
        id: "map",
        title: "Which cell is not where the model has it, and when",
        keys: keys(largest_m),
        panels,
        caption: caption(answer),
    })
}

fn keys(largest_m: f64) -> Vec<Key> {
    let step = |fraction: f64, text: String| Key::new(Mark::Box, diverging(fraction), text);
    let mm = |fraction: f64| fixed(fraction * largest_m * 1e3, 3);
    vec![
        step(-1.0, format!("{} mm: behind the model", mm(-1.0))),
        step(-0.5, mm(-0.5)),
        step(0.0, "0".to_owned()),
        step(0.5, format!("+{}", mm(0.5))),
        step(1.0, format!("+{} mm: ahead of the model", mm(1.0))),
        Key::new(Mark::Dot, MUTED, format!("from {SIGNIFICANT} standard errors")),
        Key::new(Mark::Diamond, INK, format!("from {VERY_SIGNIFICANT} standard errors")),
    ]
}

fn picture(
    name: &str,
    before: &ResidualMap,
    after: Option<(&ResidualMap, &str)>,
    largest_m: f64,
    colours: &[Colour],
) -> Result<Svg, DrawError> {
    let maps: Vec<&ResidualMap> = std::iter::once(before).chain(after.map(|(map, _)| map)).collect();
    let cells = maps.iter().map(|map| map.residual_m.len()).max().unwrap_or(0).max(1);
    let height = (ROW * cells as f64).max(MIN_HEIGHT);
    let row = |label: &str| Row {
        label: (maps.len() > 1).then(|| (label.to_owned(), INK)),
        ..Row::new(
            Axis::listed((1..=cells).map(|cell| format!("cell {cell}")).collect()),
            height,
        )
    };
    let sheet = Sheet {
        description: description(name, before, after),
        x_label: Some("gait phase, fraction of a cycle".to_owned()),
        x: Axis::between(0.0, 1.0, 5),
        rows: ["old", "new"][..maps.len()].iter().map(|label| row(label)).collect(),
    };
    draw(&sheet, |number, plot| {
        let map = maps[number];
        paint(plot, map, cells, largest_m)?;
        name_steps(plot, map, cells, colours, number == 0)
    })
}

/// Colours every bin and marks the significant ones.
fn paint(plot: &mut Plot<'_, '_, '_>, map: &ResidualMap, cells: usize, largest_m: f64) -> Result<(), DrawError> {
    for (cell, residual_m) in map.residual_m.iter().enumerate() {
        let row = (cells - 1 - cell.min(cells - 1)) as f64;
        let significance = map.significance.get(cell).map_or(&[][..], |list| list);
        for (bin, ends) in edges(&map.phase).into_iter().enumerate() {
            let residual_m = residual_m.get(bin).copied().unwrap_or(f64::NAN);
            let fraction = if largest_m > 0.0 {
                residual_m / largest_m
            } else {
                residual_m
            };
            let fraction = if Axis::is_drawable(residual_m) {
                fraction
            } else {
                f64::NAN
            };
            let colour = if fraction.is_nan() { LIGHT } else { diverging(fraction) };
            plot.fill(ends, [row - 0.5, row + 0.5], colour, 1.0)?;
            let sigma = significance.get(bin).map_or(0.0, |sigma| sigma.abs());
            let mark = if fraction.abs() > DARK { PAPER } else { INK };
            let middle = 0.5 * (ends[0] + ends[1]);
            if sigma >= VERY_SIGNIFICANT {
                plot.diamond(middle, row, INK)?;
            } else if sigma >= SIGNIFICANT {
                plot.dots([(middle, row)], mark, 2.2)?;
            }
        }
    }
    Ok(())
}

/// Separates the steps by vertical lines and names above each the cell that steps.
fn name_steps(
    plot: &mut Plot<'_, '_, '_>,
    map: &ResidualMap,
    cells: usize,
    colours: &[Colour],
    named: bool,
) -> Result<(), DrawError> {
    let steps = steps(map);
    let narrowest = steps
        .iter()
        .map(|(_, ends)| ends[1] - ends[0])
        .fold(f64::INFINITY, f64::min);
    let long = |cell: usize| format!("cell {cell} steps");
    let is_long = plot.has_room(narrowest, long(cells).chars().count());
    for (cell, ends) in steps {
        plot.vertical_line(ends[1], -0.5, cells as f64 - 0.5, Stroke::new(INK, 1.0))?;
        if named {
            let colour = cell
                .checked_sub(1)
                .and_then(|cell| colours.get(cell))
                .copied()
                .unwrap_or(INK);
            let name = if is_long { long(cell) } else { cell.to_string() };
            plot.label_above(0.5 * (ends[0] + ends[1]), colour, &name)?;
        }
    }
    Ok(())
}

/// The steps of a map: the cell that steps, from 1, and the phases between which it does.
pub(super) fn steps(map: &ResidualMap) -> Vec<(usize, [f64; 2])> {
    let mut steps: Vec<(usize, [f64; 2])> = Vec::new();
    for (ends, &cell) in edges(&map.phase).into_iter().zip(&map.stepping_cell) {
        match steps.last_mut() {
            Some((same, step)) if *same == cell => step[1] = ends[1],
            _ => steps.push((cell, ends)),
        }
    }
    steps
}

/// The ends of bins with these middles: they touch, and fill the cycle.
fn edges(middles: &[f64]) -> Vec<[f64; 2]> {
    let between: Vec<f64> = middles.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    let starts = std::iter::once(0.0).chain(between.iter().copied());
    let ends = between.iter().copied().chain([1.0]);
    starts
        .zip(ends)
        .take(middles.len())
        .map(|(start, end)| [start, end])
        .collect()
}

fn description(name: &str, before: &ResidualMap, after: Option<(&ResidualMap, &str)>) -> String {
    let standing_out = |map: &ResidualMap| {
        let sigmas = map.significance.iter().flatten();
        count(sigmas.filter(|sigma| sigma.abs() >= SIGNIFICANT).count(), "bin")
    };
    let after = after.map_or_else(String::new, |(map, model)| format!(", {model} {}", standing_out(map)));
    format!(
        "Map of the residual by cell and gait phase at {name}: with the recalibrated model {} beyond {SIGNIFICANT} standard errors{after}",
        standing_out(before)
    )
}

fn caption(answer: &Answer) -> String {
    let after = if answer.figures.maps_after.is_empty() {
        " There is no map below, for no effect is named.".to_owned()
    } else {
        format!(
            " Below, on the same scale, what the model leaves {}: the paler and the less marked, the better it explains the data.",
            best_model(answer)
        )
    };
    format!(
        "How much further each cell moves than the model predicts in a part of the gait cycle, mean over the cycles. Columns are \
         grouped by the cell that steps. With normal errors, chance reaches {SIGNIFICANT} standard errors in about one bin of 370, and {VERY_SIGNIFICANT} in one \
         of nearly two million.{after}"
    )
}
