//! One cycle in close-up, figure 4 of the paper: where each tip sticks, where it slides, and how the first estimate is read
//! off.

use super::window::{Window, of_cell};
use super::{cell_keys, panel_per_run};
use crate::experiment::Analysis;
use crate::report::page::{Figure, Key, Mark};
use crate::report::plot::{Axis, Colour, DrawError, INK, MUTED, Plot, Row, Sheet, Stroke, Svg, cell_colours, draw};
use crate::report::runs::Runs;
use worm_estimator::number::{fixed, list_or_range, mean};

/// Most dots drawn for one cell.
const DOTS: usize = 150;

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let panels = panel_per_run(runs, "displacement since the cycle began, mm", picture)?;
    let mut keys = cell_keys(runs.cells(), Mark::Thick);
    keys.extend([
        Key::new(Mark::Line, MUTED, "thin: the tip sticks"),
        Key::new(Mark::Thick, MUTED, "thick: it slides"),
        Key::new(Mark::Dot, MUTED, "measured"),
        Key::new(Mark::Dashed, INK, "theory, identified worm"),
        Key::new(Mark::Ring, INK, "onset of sliding by the first estimate"),
        Key::new(Mark::Band, MUTED, "step of the cell of that colour"),
    ]);
    Ok(Figure {
        id: "closeup",
        title: "One cycle in close-up: sticking and sliding",
        keys,
        panels,
        caption: caption(runs),
    })
}

fn picture(name: &str, run: &Analysis) -> Result<Svg, DrawError> {
    let window = Window::of_cycles(run, 1);
    let series = &run.series;
    let from_start = |list, cell| window.points_from_start(of_cell(list, cell), 1e3);
    // The dots belong to the smooth line, so they count from its start, not from their own first, noisy one.
    let measured = |cell| {
        let origin_mm = window.origin(of_cell(&series.position_m, cell)) * 1e3;
        let points = window.points(of_cell(&series.measured_m, cell), 1e3);
        points.map(move |(time_s, mm)| (time_s, mm - origin_mm))
    };
    let heights = (0..run.cells).flat_map(|cell| {
        let lines = from_start(&series.position_m, cell).chain(from_start(&series.theory_m, cell));
        lines.chain(measured(cell)).map(|(_, mm)| mm)
    });
    let sheet = Sheet {
        description: format!("Displacement of each cell over {} at {name}", window.name()),
        x_label: Some("time since the cycle began, s".to_owned()),
        x: window.time_axis(),
        rows: vec![Row::new(Axis::around(heights, 6), 330.0)],
    };
    let colours = cell_colours(run.cells);
    draw(&sheet, |_, plot| {
        window.draw_steps(plot, &colours, true)?;
        plot.horizontal_line(0.0, Stroke::new(MUTED, 0.75))?;
        for (cell, &colour) in colours.iter().enumerate() {
            let every = window.samples.len().div_ceil(DOTS).max(1);
            plot.dots(
                measured(cell).step_by(every).filter(|(_, mm)| mm.is_finite()),
                colour,
                1.0,
            )?;
        }
        for (cell, &colour) in colours.iter().enumerate() {
            plot.line(from_start(&series.position_m, cell), Stroke::new(colour, 1.2))?;
            let sliding = window.where_sliding(cell, from_start(&series.position_m, cell));
            plot.line(sliding, Stroke::new(colour, 3.6))?;
        }
        for cell in 0..run.cells {
            plot.line(from_start(&series.theory_m, cell), Stroke::new(INK, 1.0).dashed())?;
        }
        draw_onsets(plot, &window, run, &colours)
    })
}

/// Marks where each stepping cell has moved by twice its first estimate: it loads from −δmax to δmax before it slides.
fn draw_onsets(
    plot: &mut Plot<'_, '_, '_>,
    window: &Window<'_>,
    run: &Analysis,
    colours: &[Colour],
) -> Result<(), DrawError> {
    for (cell, samples) in window.steps() {
        let position_m = of_cell(&run.series.position_m, cell);
        let (Some(position_m), Some(colour)) = (position_m.get(samples.clone()), colours.get(cell)) else {
            continue;
        };
        let (Some(start_m), Some(estimate_m)) = (position_m.first(), run.first_estimate.max_deformation_m.get(cell))
        else {
            continue;
        };
        let onset = position_m.iter().position(|at_m| at_m - start_m >= 2.0 * estimate_m);
        if let Some(offset) = onset {
            let time_s = run.series.time_s[samples.start + offset] - window.start_s;
            let origin_m = window.origin(of_cell(&run.series.position_m, cell));
            plot.ring(time_s, (position_m[offset] - origin_m) * 1e3, *colour)?;
        }
    }
    Ok(())
}

fn caption(runs: Runs<'_>) -> String {
    let shown = runs.describe(|run| Some(Window::of_cycles(run, 1).name()));
    let first = runs.describe(|run| {
        let list_mm: Vec<f64> = run.first_estimate.max_deformation_m.iter().map(|m| m * 1e3).collect();
        Some(list_or_range(&list_mm, 2, "mm"))
    });
    let apart = runs.describe(|run| {
        distance_to_path_m(run).map(|m| format!("{} mm (noise: {} mm)", fixed(m * 1e3, 3), fixed(run.noise_m * 1e3, 3)))
    });
    let apart = if apart.is_empty() {
        String::new()
    } else {
        format!(" Root mean square distance of the dots from the lines: {apart}.")
    };
    let without = runs.without_theory();
    format!(
        "After figure 4 of the paper; shown: {shown}. While a cell steps, the others are pushed back; as a rule they rest as \
         soon as it slides forward. The ring marks where the stepping cell has moved by twice its first estimate, from −δmax \
         to δmax (first estimates, cell 1 first: {first}). The lines are theory's path, fitted to the positions, plus the drift of worm \
         and canal from it; the dots show how well it fits{without}.{apart}"
    )
}

/// Root mean square distance of the measured positions from the smooth ones in the cycle shown.
fn distance_to_path_m(run: &Analysis) -> Option<f64> {
    let window = Window::of_cycles(run, 1);
    let squares: Vec<f64> = (0..run.cells)
        .flat_map(|cell| {
            let smooth = window.points(of_cell(&run.series.position_m, cell), 1.0);
            let measured = window.points(of_cell(&run.series.measured_m, cell), 1.0);
            smooth
                .zip(measured)
                .map(|((_, smooth_m), (_, measured_m))| (smooth_m - measured_m).powi(2))
        })
        .collect();
    Some(mean(&squares).sqrt()).filter(|distance_m| distance_m.is_finite())
}
