//! The mean cycle of each run, measured and by each model.

use super::super::view::{best_model, cells, mm};
use super::map::steps;
use crate::explain::Answer;
use crate::explain::answer::{CycleSeries, ResidualMap};
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{
    ACCENT, Axis, Colour, DrawError, INK, LIGHT, MID, MUTED, Plot, Row, SHADE, Sheet, Stroke, Svg, cell_colours, draw,
};
use crate::report::runs::names_by_slope;

const HEIGHT: f64 = 220.0;
const RESIDUAL_HEIGHT: f64 = 130.0;
/// Opacity of the bands that mark steps, and of the scatter.
const STEP: f64 = 0.09;
const SCATTER: f64 = 0.3;
/// The measurement lies pale and thick under the models.
const MEASURED: Colour = LIGHT;
const MEASURED_WIDTH: f64 = 6.0;

pub(super) fn figure(answer: &Answer) -> Result<Figure, DrawError> {
    let cycles = &answer.figures.cycles;
    let colours = cell_colours(cells(answer));
    let names = names_by_slope(cycles.iter().map(|run| run.slope_deg));
    let mut panels = Vec::new();
    for (number, (name, run)) in names.iter().zip(cycles).enumerate() {
        let svg = picture(name, run, answer.figures.maps_before.get(number), &colours)?;
        let quantity = "above: body displacement, mm; below: models − measured, mm";
        panels.push(Panel::new(name, quantity, svg));
    }
    let mut keys = vec![
        Key::new(Mark::Thick, MEASURED, "measured, mean of the settled cycles"),
        Key::new(
            Mark::Band,
            MUTED,
            "its scatter from cycle to cycle, one standard deviation",
        ),
        Key::new(Mark::Dashed, MID, "nominal model"),
        Key::new(Mark::Line, SHADE, "recalibrated model"),
    ];
    let is_named = cycles.iter().any(|run| !run.named_m.is_empty());
    if is_named {
        keys.push(Key::new(Mark::Line, ACCENT, best_model(answer)));
    }
    Ok(Figure {
        id: "cycle",
        title: "The mean cycle",
        keys,
        panels,
        caption: caption(&names, cycles, is_named),
    })
}

/// A model's line in one run.
struct Line<'a> {
    values_m: &'a [f64],
    stroke: Stroke,
}

fn lines(run: &CycleSeries) -> [Line<'_>; 3] {
    let line = |values_m, stroke| Line { values_m, stroke };
    [
        line(&run.baseline_m, Stroke::new(MID, 1.6).dashed()),
        line(&run.recalibrated_m, Stroke::new(SHADE, 1.6)),
        line(&run.named_m, Stroke::new(ACCENT, 1.8)),
    ]
}

fn picture(name: &str, run: &CycleSeries, map: Option<&ResidualMap>, colours: &[Colour]) -> Result<Svg, DrawError> {
    let residuals = lines(run).map(|line| minus_measured_mm(run, line.values_m));
    let ribbon = |centre: f64, scatter_m: f64| [centre - scatter_m * 1e3, centre + scatter_m * 1e3];
    let scatter = run.scatter_m.iter().map(|scatter_m| scatter_m * 1e3);
    let displacements = [&run.measured_m, &run.baseline_m, &run.recalibrated_m, &run.named_m];
    let displacements_mm = displacements
        .into_iter()
        .flatten()
        .map(|displacement_m| displacement_m * 1e3);
    let below_mm = residuals.iter().flatten().copied();
    let sheet = Sheet {
        description: format!("The mean cycle at {name}, measured and by each model, and the error of each"),
        x_label: Some("gait phase, fraction of a cycle".to_owned()),
        x: Axis::between(0.0, 1.0, 5),
        rows: vec![
            Row::new(Axis::around(displacements_mm, 5), HEIGHT),
            Row::new(
                Axis::around(below_mm.chain(scatter.clone()).chain(scatter.map(|mm| -mm)), 4),
                RESIDUAL_HEIGHT,
            ),
        ],
    };
    draw(&sheet, |row, plot| {
        if let Some(map) = map {
            shade_steps(plot, map, colours, row == 0)?;
        }
        let at_phases = |values: Vec<f64>| run.phase.iter().copied().zip(values);
        let scattered = run.phase.iter().zip(&run.measured_m).zip(&run.scatter_m);
        if row == 1 {
            plot.ribbon(
                scattered.map(|((phase, _), scatter_m)| (*phase, ribbon(0.0, *scatter_m))),
                MUTED,
                SCATTER,
            )?;
            plot.horizontal_line(0.0, Stroke::new(INK, 1.2))?;
            for (line, residual) in lines(run).into_iter().zip(&residuals) {
                plot.line(at_phases(residual.clone()), line.stroke)?;
            }
            return Ok(());
        }
        let scattered =
            scattered.map(|((phase, displacement_m), scatter_m)| (*phase, ribbon(displacement_m * 1e3, *scatter_m)));
        plot.ribbon(scattered, MUTED, SCATTER)?;
        let in_mm = |displacement_m: &[f64]| {
            at_phases(
                displacement_m
                    .iter()
                    .map(|displacement_m| displacement_m * 1e3)
                    .collect(),
            )
        };
        plot.line(in_mm(&run.measured_m), Stroke::new(MEASURED, MEASURED_WIDTH))?;
        for line in lines(run) {
            plot.line(in_mm(line.values_m), line.stroke)?;
        }
        Ok(())
    })
}

/// Marks the steps with a pale band in the colour of the cell that makes it.
pub(super) fn shade_steps(
    plot: &mut Plot<'_, '_, '_>,
    map: &ResidualMap,
    colours: &[Colour],
    named: bool,
) -> Result<(), DrawError> {
    for (cell, ends) in steps(map) {
        let colour = cell
            .checked_sub(1)
            .and_then(|cell| colours.get(cell))
            .copied()
            .unwrap_or(MUTED);
        let name = if named { cell.to_string() } else { String::new() };
        plot.band(ends, colour, STEP, &name)?;
    }
    Ok(())
}

fn minus_measured_mm(run: &CycleSeries, model_m: &[f64]) -> Vec<f64> {
    let pairs = model_m.iter().zip(&run.measured_m);
    pairs
        .map(|(model_m, measured_m)| (model_m - measured_m) * 1e3)
        .collect()
}

fn caption(names: &[String], cycles: &[CycleSeries], is_named: bool) -> String {
    let worst = names.iter().zip(cycles).filter_map(|(name, run)| {
        let [_, recalibrated, named] = lines(run).map(|line| worst_m(run, line.values_m));
        let after = named.filter(|_| is_named);
        let after = after.map_or_else(String::new, |named_m| format!(", the named one {}", mm(named_m)));
        Some(format!("at {name} the recalibrated model {}{after}", mm(recalibrated?)))
    });
    let worst = match worst.collect::<Vec<_>>() {
        none if none.is_empty() => String::new(),
        worst => format!(" Largest errors: {}.", worst.join("; ")),
    };
    format!(
        "Mean position of the cells since the start of the cycle, less what the stroke alone would make: it falls where tips slip \
         back. Bands and numbers above mark the step of each cell. Below, enlarged, the error of each model; a model that \
         explains the data stays within the grey scatter.{worst}"
    )
}

/// The largest difference from the measurement, m; none where nothing can be compared.
fn worst_m(run: &CycleSeries, model_m: &[f64]) -> Option<f64> {
    let off_mm = minus_measured_mm(run, model_m).into_iter().map(f64::abs);
    let known_m = off_mm
        .map(|off_mm| off_mm * 1e-3)
        .filter(|off_m| Axis::is_drawable(*off_m));
    known_m.reduce(f64::max)
}
