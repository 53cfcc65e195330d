//! Contact points of the tips, figure 5 of the paper.

use super::window::{Window, of_cell};
use super::{cell_keys, panel_per_run, slides_in_words};
use crate::experiment::Analysis;
use crate::report::page::{Figure, Key, Mark};
use crate::report::plot::{Axis, DrawError, MUTED, Row, Sheet, Stroke, Svg, cell_colours, draw};
use crate::report::runs::Runs;

/// Cycles shown.
const CYCLES: usize = 3;

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let panels = panel_per_run(runs, "contact point, from its start, mm", picture)?;
    let mut keys = cell_keys(runs.cells(), Mark::Line);
    keys.push(Key::new(Mark::Band, MUTED, "step of the cell of that colour"));
    Ok(Figure {
        id: "contacts",
        title: "Where the tips touch the canal",
        keys,
        panels,
        caption: caption(runs),
    })
}

fn picture(name: &str, run: &Analysis) -> Result<Svg, DrawError> {
    let window = Window::of_cycles(run, CYCLES);
    let contact = |cell| window.points_from_start(of_cell(&run.series.contact_m, cell), 1e3);
    let heights = (0..run.cells).flat_map(|cell| contact(cell).map(|(_, mm)| mm));
    let sheet = Sheet {
        description: format!("Contact points of the tips over {} at {name}", window.name()),
        x_label: Some("time, s".to_owned()),
        x: window.time_axis(),
        rows: vec![Row::new(Axis::around(heights, 6), 300.0)],
    };
    let colours = cell_colours(run.cells);
    draw(&sheet, |_, plot| {
        window.draw_steps(plot, &colours, true)?;
        for (cell, &colour) in colours.iter().enumerate() {
            plot.line(contact(cell), Stroke::new(colour, 2.0))?;
        }
        Ok(())
    })
}

fn caption(runs: Runs<'_>) -> String {
    let shown = runs.describe(|run| Some(Window::of_cycles(run, CYCLES).name()));
    let slides = runs.describe(|run| Some(slides_in_words(&run.mean)));
    format!(
        "After figure 5 of the paper; shown: {shown}. A level line is a tip that sticks; a rise is a tip that slides forward \
         in its own step; a fall is one that is pushed or pulled back over the canal. Slides of a tip per cycle, averaged over \
         the cells: {slides}."
    )
}
