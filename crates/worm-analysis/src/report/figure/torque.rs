//! Torque at the cam over the phase of a cycle, by the motor's current, beside the model's.

use crate::experiment::TorqueProfile;
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{Axis, DrawError, INK, MUTED, Row, Sheet, Stroke, Svg, VERMILION, cell_colours, draw};
use crate::report::runs::{Runs, describe_each};
use worm_estimator::number::fixed;

/// Opacity of the bands that mark steps.
const BAND: f64 = 0.09;

/// What the motor felt in one run.
pub(in crate::report) struct Felt<'a> {
    /// The run's short name.
    pub name: String,
    /// Number of cells of its worm.
    pub cells: usize,
    /// The cells in the order in which they step, counted from 1.
    pub step_order: &'a [usize],
    /// The torque.
    pub profile: &'a TorqueProfile,
}

/// The figure; none where no recording has the motor's current.
pub(super) fn figure(runs: Runs<'_>) -> Result<Option<Figure>, DrawError> {
    let felt: Vec<Felt<'_>> = runs
        .named()
        .filter_map(|(name, run)| {
            Some(Felt {
                name,
                cells: run.cells,
                step_order: &run.step_order,
                profile: run.torque_profile.as_ref()?,
            })
        })
        .collect();
    torque_figure(&felt)
}

/// The figure of these runs; none where there are none.
pub(in crate::report) fn torque_figure(felt: &[Felt<'_>]) -> Result<Option<Figure>, DrawError> {
    if felt.is_empty() {
        return Ok(None);
    }
    let panels = felt
        .iter()
        .map(|run| {
            let svg = picture(run)?;
            Ok(Panel::new(
                run.name.clone(),
                "above: torque, mN m; below: what the model leaves",
                svg,
            ))
        })
        .collect::<Result<Vec<_>, DrawError>>()?;
    Ok(Some(Figure {
        id: "torque",
        title: "What the motor feels",
        keys: vec![
            Key::new(Mark::Line, INK, "by the motor's current"),
            Key::new(Mark::Dashed, VERMILION, "the model that explains it best"),
            Key::new(Mark::Band, MUTED, "step of the cell of that colour"),
        ],
        panels,
        caption: caption(felt),
    }))
}

fn picture(run: &Felt<'_>) -> Result<Svg, DrawError> {
    let profile = run.profile;
    let points = |values: &[f64]| -> Vec<(f64, f64)> {
        let scaled = values.iter().map(|n_m| n_m * 1e3);
        profile.phase.iter().copied().zip(scaled).collect()
    };
    let left: Vec<f64> = profile
        .measured_n_m
        .iter()
        .zip(&profile.model_n_m)
        .map(|(measured, model)| measured - model)
        .collect();
    let (measured, model, left) = (points(&profile.measured_n_m), points(&profile.model_n_m), points(&left));
    let heights = |points: &[(f64, f64)]| points.iter().map(|(_, mn_m)| *mn_m).collect::<Vec<_>>();
    let sheet = Sheet {
        description: format!("Torque at the cam over the phase of a cycle at {}", run.name),
        x_label: Some("phase of the cycle".to_owned()),
        x: Axis::between(0.0, 1.0, 5),
        rows: vec![
            Row::new(
                Axis::around(heights(&measured).into_iter().chain(heights(&model)).chain([0.0]), 5),
                200.0,
            ),
            Row::new(Axis::around(heights(&left).into_iter().chain([0.0]), 3), 90.0),
        ],
    };
    let colours = cell_colours(run.cells);
    draw(&sheet, |row, plot| {
        let steps = run.step_order.len() as f64;
        for (place, cell) in run.step_order.iter().enumerate() {
            let Some(&colour) = colours.get(cell - 1) else { continue };
            let ends = [place as f64 / steps, (place + 1) as f64 / steps];
            let label = if row == 0 { cell.to_string() } else { String::new() };
            plot.band(ends, colour, BAND, &label)?;
        }
        plot.horizontal_line(0.0, Stroke::new(MUTED, 0.75))?;
        if row == 1 {
            return plot.line(left.iter().copied(), Stroke::new(INK, 1.0));
        }
        plot.line(measured.iter().copied(), Stroke::new(INK, 1.4))?;
        plot.line(model.iter().copied(), Stroke::new(VERMILION, 1.4).dashed())
    })
}

fn caption(felt: &[Felt<'_>]) -> String {
    let names: Vec<String> = felt.iter().map(|run| run.name.clone()).collect();
    let of_profile = |describe: &dyn Fn(&TorqueProfile) -> String| {
        describe_each(&names, felt.iter().map(|run| Some(describe(run.profile))))
    };
    let left = of_profile(&|profile| format!("{} mN m", fixed(profile.residual_n_m * 1e3, 1)));
    let cycles = of_profile(&|profile| fixed(profile.cycles, 0));
    format!(
        "The torque that the cam takes, from the motor's current, less the friction of the gears and the inertia; mean over {cycles} cycles \
         of the whole log, of which older ones count less. Positions play no part in it. Within a step the torque rises as the pad of the stepping cell is \
         bent from one bound to the other: how far says its friction, how steeply its stiffness. Left by the model, root mean square: {left}."
    )
}
