//! The momentum balance (5): the total force on the body over time.

use super::panel_per_run;
use super::window::Window;
use crate::experiment::Analysis;
use crate::report::page::{Figure, Key, Mark};
use crate::report::plot::{Axis, DrawError, INK, MID, MUTED, Row, Sheet, Stroke, Svg, draw};
use crate::report::runs::Runs;
use worm_estimator::number::{fixed, mean};

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let panels = panel_per_run(runs, "force on the body, N", picture)?;
    Ok(Figure {
        id: "balance",
        title: "Does the momentum balance hold?",
        keys: vec![
            Key::new(Mark::Line, MID, "contacts and weight together"),
            Key::new(Mark::Dashed, INK, "their mean over whole cycles"),
        ],
        panels,
        caption: caption(runs),
    })
}

fn picture(name: &str, run: &Analysis) -> Result<Svg, DrawError> {
    let window = Window::whole(run);
    let force = || window.points(&run.series.total_force_n, 1.0);
    let heights = force().map(|(_, newton)| newton).chain([0.0, run.momentum_violation_n]);
    let sheet = Sheet {
        description: format!("Total force on the body over time at {name}"),
        x_label: Some("time, s".to_owned()),
        x: window.time_axis(),
        rows: vec![Row::new(Axis::around(heights, 5), 200.0)],
    };
    draw(&sheet, |_, plot| {
        plot.horizontal_line(0.0, Stroke::new(MUTED, 0.75))?;
        plot.line(force(), Stroke::new(MID, 0.9))?;
        plot.horizontal_line(run.momentum_violation_n, Stroke::new(INK, 1.5).dashed())
    })
}

fn caption(runs: Runs<'_>) -> String {
    let balance = runs.describe(|run| Some(format!("{} N", fixed(run.momentum_violation_n, 3))));
    let worst = runs.describe(|run| {
        let force_n = run
            .series
            .total_force_n
            .iter()
            .copied()
            .filter(|force_n| force_n.is_finite());
        let mean_n = run.momentum_violation_n;
        let squares: Vec<f64> = force_n.map(|force_n| (force_n - mean_n).powi(2)).collect();
        Some(format!("{} N", fixed(mean(&squares).sqrt(), 3)))
    });
    format!(
        "kt Σδ + m g sin λ, the force whose mean vanishes by equation (5): a worm that rests between its steps gains \
         no momentum. Mean over whole cycles, with the configured mass: {balance}. About it the force scatters by {worst} (root \
         mean square), from noise in the positions and from what the model leaves out."
    )
}
