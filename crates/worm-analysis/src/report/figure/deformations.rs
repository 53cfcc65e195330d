//! Deformation of each tip, figure 6 of the paper: one strip for each cell, between its bounds.

use super::panel_per_run;
use super::window::{Window, of_cell};
use crate::experiment::Analysis;
use crate::report::page::{Figure, Key, Mark};
use crate::report::plot::{Axis, DrawError, MUTED, Row, Sheet, Stroke, Svg, cell_colours, draw};
use crate::report::runs::Runs;
use worm_estimator::number::list_or_range;

/// Cycles shown.
const CYCLES: usize = 2;
/// Height of all strips together, and the smallest and largest of one, units.
const ALL_STRIPS: f64 = 330.0;
const STRIP: [f64; 2] = [42.0, 100.0];

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let panels = panel_per_run(runs, "tip deformation, mm", picture)?;
    Ok(Figure {
        id: "deformations",
        title: "How far each tip is bent",
        keys: vec![
            Key::new(Mark::Line, MUTED, "thin: the tip sticks"),
            Key::new(Mark::Thick, MUTED, "thick: it slides"),
            Key::new(Mark::Dashed, MUTED, "largest deformation, ±δmax"),
            Key::new(Mark::Band, MUTED, "step of the cell of that colour"),
        ],
        panels,
        caption: caption(runs),
    })
}

fn picture(name: &str, run: &Analysis) -> Result<Svg, DrawError> {
    let window = Window::of_cycles(run, CYCLES);
    let colours = cell_colours(run.cells);
    let deformation = |cell| window.points(of_cell(&run.series.deformation_m, cell), 1e3);
    let bound_mm = |cell| {
        run.max_deformation_m
            .get(cell)
            .map_or(f64::NAN, |bound_m| bound_m * 1e3)
    };
    let heights = (0..run.cells).flat_map(|cell| {
        deformation(cell)
            .map(|(_, mm)| mm)
            .chain([bound_mm(cell), -bound_mm(cell)])
    });
    // One scale for all strips, so that a softer or weaker tip stands out.
    let y = Axis::around(heights, 4);
    let height = (ALL_STRIPS / run.cells.max(1) as f64).clamp(STRIP[0], STRIP[1]);
    let strip = |(cell, colour): (usize, &_)| Row {
        y: y.clone(),
        height,
        label: Some((format!("cell {}", cell + 1), *colour)),
    };
    let sheet = Sheet {
        description: format!("Deformation of each tip over {} at {name}", window.name()),
        x_label: Some("time, s".to_owned()),
        x: window.time_axis(),
        rows: colours.iter().enumerate().map(strip).collect(),
    };
    draw(&sheet, |cell, plot| {
        window.draw_steps(plot, &colours, cell == 0)?;
        plot.horizontal_line(0.0, Stroke::new(MUTED, 0.75))?;
        let colour = colours[cell];
        for bound_mm in [bound_mm(cell), -bound_mm(cell)] {
            plot.horizontal_line(bound_mm, Stroke::new(colour, 0.9).dashed())?;
        }
        plot.line(deformation(cell), Stroke::new(colour, 1.2))?;
        plot.line(window.where_sliding(cell, deformation(cell)), Stroke::new(colour, 3.6))
    })
}

fn caption(runs: Runs<'_>) -> String {
    let shown = runs.describe(|run| Some(Window::of_cycles(run, CYCLES).name()));
    let bounds = runs.describe(|run| {
        let list_mm: Vec<f64> = run.max_deformation_m.iter().map(|m| m * 1e3).collect();
        Some(list_or_range(&list_mm, 2, "mm"))
    });
    format!(
        "After figure 6 of the paper; shown: {shown}. A tip that sticks is bent by the motion of its cell; at a dashed line \
         friction can hold no more and the tip slides, forward at the upper one, backward at the lower one. Largest \
         deformations, cell 1 first: {bounds}."
    )
}
