//! Positions of the cells over time, figure 3 of the paper.

use super::window::{Window, of_cell};
use super::{cell_keys, panel_per_run};
use crate::experiment::Analysis;
use crate::report::page::{Figure, Key, Mark};
use crate::report::plot::{Axis, DrawError, GRID, Row, Sheet, Stroke, Svg, cell_colours, draw};
use crate::report::runs::Runs;
use worm_estimator::number::{fixed, with_error};

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let panels = panel_per_run(runs, "position along the canal, mm", picture)?;
    let mut keys = cell_keys(runs.cells(), Mark::Line);
    keys.push(Key::new(Mark::Thick, GRID, "pale and wide: as measured"));
    Ok(Figure {
        id: "positions",
        title: "The worm crawls: position of every cell",
        keys,
        panels,
        caption: caption(runs),
    })
}

fn picture(name: &str, run: &Analysis) -> Result<Svg, DrawError> {
    let window = Window::whole(run);
    let series = &run.series;
    let origin_m = origin_m(run);
    let from_origin = |points: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        let shifted = points.into_iter().map(|(time_s, mm)| (time_s, mm - origin_m * 1e3));
        shifted.collect()
    };
    let line = |list: &[Vec<f64>], cell| from_origin(window.points(of_cell(list, cell), 1e3).collect());
    let measured: Vec<_> = (0..run.cells).map(|cell| line(&series.measured_m, cell)).collect();
    let smooth: Vec<_> = (0..run.cells).map(|cell| line(&series.position_m, cell)).collect();
    let heights = measured.iter().chain(&smooth).flatten().map(|(_, mm)| *mm);
    let sheet = Sheet {
        description: format!("Positions of the cells over time at {name}"),
        x_label: Some("time, s".to_owned()),
        x: window.time_axis(),
        rows: vec![Row::new(Axis::around(heights, 5), 300.0)],
    };
    draw(&sheet, |_, plot| {
        for (colour, points) in cell_colours(run.cells).into_iter().zip(measured.iter().cloned()) {
            plot.line(points, Stroke::new(colour, 4.5).faint(0.22))?;
        }
        for (colour, points) in cell_colours(run.cells).into_iter().zip(smooth.iter().cloned()) {
            plot.line(points, Stroke::new(colour, 1.5))?;
        }
        Ok(())
    })
}

/// Where the hindmost cell is first seen: the figure counts from there, because the zero of a tracker is arbitrary.
fn origin_m(run: &Analysis) -> f64 {
    let window = Window::whole(run);
    let firsts = (0..run.cells).map(|cell| window.origin(of_cell(&run.series.position_m, cell)));
    let hindmost_m = firsts.fold(f64::INFINITY, f64::min);
    if hindmost_m.is_finite() { hindmost_m } else { 0.0 }
}

fn caption(runs: Runs<'_>) -> String {
    let advance = runs.describe(|run| {
        Some(format!(
            "{} mm",
            with_error(run.mean.advance_m * 1e3, run.std.advance_m * 1e3, 2)
        ))
    });
    let noise = runs.describe(|run| Some(format!("{} mm", fixed(run.noise_m * 1e3, 3))));
    let seen = runs.describe(|run| {
        let all = run.series.measured_m.iter().flatten().count();
        let missing = run
            .series
            .measured_m
            .iter()
            .flatten()
            .filter(|x| !x.is_finite())
            .count();
        (all > 0).then(|| format!("{} %", fixed(100.0 * missing as f64 / all as f64, 1)))
    });
    let gaps = if seen.is_empty() {
        String::new()
    } else {
        format!(" The tracker missed {seen} of the positions; there the pale trace breaks.")
    };
    format!(
        "After figure 3 of the paper. Once in a cycle each cell steps forward relative to the others; in their steps it is pushed \
         back. Mean advance per cycle (± standard deviation over the settled cycles): {advance}. The thin line is the \
         position freed of noise, the pale trace beneath it the measured one, whose noise is {noise}.{gaps} Positions count \
         from the first place of the hindmost cell."
    )
}
