//! The mean torque on the cam in each run, by the motor's current and as each model has the current show it.

use super::super::view::{best_model, cells};
use super::cycle::shade_steps;
use crate::explain::Answer;
use crate::explain::answer::{ResidualMap, TorqueSeries};
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{
    ACCENT, Axis, Colour, DrawError, INK, LIGHT, Row, SHADE, Sheet, Stroke, Svg, cell_colours, draw,
};
use crate::report::runs::names_by_slope;

const HEIGHT: f64 = 200.0;
const RESIDUAL_HEIGHT: f64 = 110.0;
/// The measurement lies pale and thick under the models.
const MEASURED: Colour = LIGHT;
const MEASURED_WIDTH: f64 = 6.0;

pub(super) fn figure(answer: &Answer) -> Result<Figure, DrawError> {
    let runs = &answer.figures.torque;
    let colours = cell_colours(cells(answer));
    let names = names_by_slope(runs.iter().map(|run| run.slope_deg));
    let map_of = |run: &TorqueSeries| {
        let mut maps = answer.figures.maps_before.iter();
        maps.find(|map| map.slope_deg == run.slope_deg)
    };
    let panels = names.iter().zip(runs).map(|(name, run)| {
        let svg = picture(name, run, map_of(run), &colours)?;
        let quantity = "above: torque, mN m; below: models − measured, mN m";
        Ok(Panel::new(name, quantity, svg))
    });
    let mut keys = vec![
        Key::new(Mark::Thick, MEASURED, "by the motor's current, mean of the cycles"),
        Key::new(Mark::Line, SHADE, "recalibrated model"),
    ];
    if runs.iter().any(|run| !run.named_n_m.is_empty()) {
        keys.push(Key::new(Mark::Line, ACCENT, best_model(answer)));
    }
    Ok(Figure {
        id: "torque",
        title: "What the motor feels",
        keys,
        panels: panels.collect::<Result<_, DrawError>>()?,
        caption: "The torque that the cam takes, by the motor's current, less the friction of the gears as it is believed to be, and the inertia. The models are \
                  drawn as the current would show them, with what each recalibrated of the gears: an offset, a factor, and friction by the load are part of their \
                  fit. In its step a cell's torque rises as its pad is bent: how far says its friction, how steeply its stiffness. Phases beside the jump from \
                  one step to the next do not count."
            .to_owned(),
    })
}

fn picture(name: &str, run: &TorqueSeries, map: Option<&ResidualMap>, colours: &[Colour]) -> Result<Svg, DrawError> {
    let measured_mn_m = in_mn_m(&run.measured_n_m);
    let models = [
        (&run.recalibrated_n_m, Stroke::new(SHADE, 1.6)),
        (&run.named_n_m, Stroke::new(ACCENT, 1.8)),
    ]
    .map(|(model_n_m, stroke)| (in_mn_m(model_n_m), stroke));
    let errors = models.each_ref().map(|(model_mn_m, _)| {
        let pairs = model_mn_m.iter().zip(&measured_mn_m);
        pairs.map(|(model, measured)| model - measured).collect::<Vec<f64>>()
    });
    let all = models
        .iter()
        .flat_map(|(model_mn_m, _)| model_mn_m)
        .chain(&measured_mn_m);
    let sheet = Sheet {
        description: format!("Torque on the cam over the phase at {name}, by the current and by each model"),
        x_label: Some("gait phase, fraction of a cycle".to_owned()),
        x: Axis::between(0.0, 1.0, 5),
        rows: vec![
            Row::new(Axis::around(all.copied(), 5), HEIGHT),
            Row::new(
                Axis::around(errors.iter().flatten().copied().chain([0.0]), 4),
                RESIDUAL_HEIGHT,
            ),
        ],
    };
    draw(&sheet, |row, plot| {
        if let Some(map) = map {
            shade_steps(plot, map, colours, row == 0)?;
        }
        let at_phases = |values: &[f64]| run.phase.iter().copied().zip(values.to_vec()).collect::<Vec<_>>();
        if row == 1 {
            plot.horizontal_line(0.0, Stroke::new(INK, 1.2))?;
        } else {
            plot.line(at_phases(&measured_mn_m), Stroke::new(MEASURED, MEASURED_WIDTH))?;
        }
        for ((model_mn_m, stroke), error_mn_m) in models.iter().zip(&errors) {
            let values = if row == 1 { error_mn_m } else { model_mn_m };
            plot.line(at_phases(values), *stroke)?;
        }
        Ok(())
    })
}

fn in_mn_m(torque_n_m: &[f64]) -> Vec<f64> {
    torque_n_m.iter().map(|n_m| n_m * 1e3).collect()
}
