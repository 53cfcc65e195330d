//! The figures of a servo's page: the friction map, and the runs.

use crate::explain::servo::answer::{FrictionCell, RunSeries, ServoAnswer};
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{ACCENT, Axis, DrawError, INK, MID, MUTED, Row, SHADE, Sheet, Stroke, Svg, draw};

/// Heights of a row of the map and of a run, units.
const MAP_ROW: f64 = 120.0;
const RUN_ROW: f64 = 170.0;
/// Runs that are drawn.
const MOST_RUNS: usize = 16;

/// Friction by the torque balance over load, a row for each range of speed, before and after.
pub(super) fn friction_map(answer: &ServoAnswer) -> Result<Figure, DrawError> {
    let figures = &answer.figures;
    let mut panels = vec![Panel::new(
        "recalibrated model",
        "friction, mN m",
        picture(&figures.map_before)?,
    )];
    if !figures.map_after.is_empty() {
        panels.push(Panel::new(
            "with the answer",
            "friction, mN m",
            picture(&figures.map_after)?,
        ));
    }
    Ok(Figure {
        id: "friction",
        title: "Friction over speed and load: measured by the torque balance, and by the model",
        keys: vec![
            Key::new(Mark::Dot, INK, "by the torque balance, with its standard error"),
            Key::new(Mark::Line, ACCENT, "by the model"),
        ],
        panels,
        caption: "A row for each range of speed; across, the torque on the gears (the mean of both their ends). The torque balance takes the \
                  motor's constants from the model, so the dots move a little between the two pictures."
            .to_owned(),
    })
}

fn picture(cells: &[FrictionCell]) -> Result<Svg, DrawError> {
    let mut speeds: Vec<[f64; 2]> = cells.iter().map(|cell| cell.speed_rad_s).collect();
    speeds.sort_by(|a, b| a[0].total_cmp(&b[0]));
    speeds.dedup();
    let rows_of =
        |speed: &[f64; 2]| -> Vec<&FrictionCell> { cells.iter().filter(|cell| cell.speed_rad_s == *speed).collect() };
    let ends = |cell: &FrictionCell| {
        let (measured, sigma) = (1e3 * cell.measured_n_m, 1e3 * cell.sigma_n_m);
        [measured - sigma, measured + sigma, 1e3 * cell.model_n_m, 0.0]
    };
    let sheet = Sheet {
        description: format!("Friction over load in {} ranges of speed", speeds.len()),
        x_label: Some("torque on the gears, N m".to_owned()),
        x: Axis::between(
            0.0,
            cells.iter().map(|cell| cell.mean_load_n_m).fold(0.1, f64::max) * 1.08,
            5,
        ),
        rows: speeds
            .iter()
            .map(|speed| Row {
                label: Some((format!("{}–{}", speed[0], speed[1]), INK)),
                ..Row::new(Axis::around(rows_of(speed).into_iter().flat_map(ends), 4), MAP_ROW)
            })
            .collect(),
    };
    draw(&sheet, |number, plot| {
        let cells = rows_of(&speeds[number]);
        plot.line(
            cells.iter().map(|cell| (cell.mean_load_n_m, 1e3 * cell.model_n_m)),
            Stroke::new(ACCENT, 2.0),
        )?;
        for cell in &cells {
            let (measured, sigma) = (1e3 * cell.measured_n_m, 1e3 * cell.sigma_n_m);
            plot.whisker(cell.mean_load_n_m, measured - sigma, measured + sigma, 0.004)?;
        }
        plot.dots(
            cells.iter().map(|cell| (cell.mean_load_n_m, 1e3 * cell.measured_n_m)),
            INK,
            3.0,
        )
    })
}

/// Each run: goal, measured, and both models.
pub(super) fn runs(answer: &ServoAnswer) -> Result<Figure, DrawError> {
    let runs = answer.figures.runs.iter().take(MOST_RUNS);
    let panels: Result<Vec<Panel>, DrawError> = runs
        .map(|run| Ok(Panel::new(run.name.clone(), "angle, rad", run_picture(run)?)))
        .collect();
    Ok(Figure {
        id: "runs",
        title: "The runs: measured, and predicted from the first reading on",
        keys: vec![
            Key::new(Mark::Line, MUTED, "goal"),
            Key::new(Mark::Line, INK, "measured"),
            Key::new(Mark::Dashed, MID, "recalibrated model"),
            Key::new(Mark::Line, ACCENT, "with the answer"),
        ],
        panels: panels?,
        caption: "Nothing is reset on the way: an error at the start stays.".to_owned(),
    })
}

fn run_picture(run: &RunSeries) -> Result<Svg, DrawError> {
    let start_s = run.time_s.first().copied().unwrap_or(0.0);
    let time = || run.time_s.iter().map(move |time_s| time_s - start_s);
    let last_s = run.time_s.last().copied().unwrap_or(1.0) - start_s;
    let all = [&run.measured_rad, &run.recalibrated_rad, &run.named_rad];
    let sheet = Sheet {
        description: format!("{}: measured and predicted angle", run.name),
        x_label: Some("s".to_owned()),
        x: Axis::between(0.0, last_s, 6),
        rows: vec![Row::new(Axis::around(all.into_iter().flatten().copied(), 5), RUN_ROW)],
    };
    let (low, high) = (sheet.rows[0].y.low(), sheet.rows[0].y.high());
    draw(&sheet, |_, plot| {
        // The goal of a weak loop is far beyond the arm.
        let goal = run
            .goal_rad
            .iter()
            .map(|rad| if (low..=high).contains(rad) { *rad } else { f64::NAN });
        plot.line(time().zip(goal), Stroke::new(SHADE, 1.2))?;
        plot.line(time().zip(run.measured_rad.iter().copied()), Stroke::new(INK, 2.0))?;
        plot.line(
            time().zip(run.recalibrated_rad.iter().copied()),
            Stroke::new(MID, 1.4).dashed(),
        )?;
        plot.line(time().zip(run.named_rad.iter().copied()), Stroke::new(ACCENT, 1.6))
    })
}
