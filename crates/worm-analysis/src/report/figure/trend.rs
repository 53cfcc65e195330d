//! Advance and energy over the cycles, to show any drift.

use super::energy::METHODS;
use super::panel_per_run;
use crate::experiment::{Analysis, CycleResult};
use crate::report::page::{Figure, Key, Mark};
use crate::report::plot::{Axis, Colour, DrawError, INK, MUTED, Plot, Row, Sheet, Stroke, Svg, draw};
use crate::report::runs::Runs;
use worm_estimator::number::{count, fixed};

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let panels = panel_per_run(runs, "above: advance, mm; below: energy, mJ", picture)?;
    let mut keys = vec![Key::new(Mark::Dot, INK, "advance")];
    keys.extend(
        METHODS
            .iter()
            .map(|method| Key::new(Mark::Dot, method.colour, method.name)),
    );
    keys.extend([
        Key::new(Mark::Ring, MUTED, "cycle not settled, left out of the mean"),
        Key::new(Mark::Dashed, MUTED, "mean"),
    ]);
    Ok(Figure {
        id: "trend",
        title: "Cycle after cycle",
        keys,
        panels,
        caption: caption(runs),
    })
}

fn picture(name: &str, run: &Analysis) -> Result<Svg, DrawError> {
    let cycle_numbers = run.cycles.iter().map(|cycle| cycle.index as f64 + 1.0);
    let advances = run.cycles.iter().map(|cycle| cycle.values.advance_m * 1e3);
    let energies = METHODS.iter().flat_map(|method| {
        let each = run.cycles.iter().map(|cycle| (method.of)(&cycle.values) * 1e3);
        each.chain([(method.of)(&run.mean) * 1e3])
    });
    let sheet = Sheet {
        description: format!("Advance and energy of every cycle at {name}"),
        x_label: Some("cycle".to_owned()),
        x: Axis::counting(cycle_numbers, 8),
        rows: vec![
            Row::new(Axis::around(advances.chain([run.mean.advance_m * 1e3]), 4), 120.0),
            Row::new(Axis::around(energies, 4), 150.0),
        ],
    };
    draw(&sheet, |row, plot| {
        if row == 0 {
            return draw_trend(plot, run, INK, run.mean.advance_m * 1e3, |cycle| {
                cycle.values.advance_m * 1e3
            });
        }
        for method in &METHODS {
            let mean_mj = (method.of)(&run.mean) * 1e3;
            draw_trend(plot, run, method.colour, mean_mj, |cycle| {
                (method.of)(&cycle.values) * 1e3
            })?;
        }
        Ok(())
    })
}

fn draw_trend(
    plot: &mut Plot<'_, '_, '_>,
    run: &Analysis,
    colour: Colour,
    mean: f64,
    of: impl Fn(&CycleResult) -> f64,
) -> Result<(), DrawError> {
    let points = || run.cycles.iter().map(|cycle| (cycle.index as f64 + 1.0, of(cycle)));
    plot.horizontal_line(mean, Stroke::new(colour, 1.2).dashed())?;
    plot.line(points(), Stroke::new(colour, 1.4))?;
    for (cycle, (x, y)) in run.cycles.iter().zip(points()) {
        if cycle.settled {
            plot.dots([(x, y)], colour, 3.2)?;
        } else {
            plot.ring(x, y, colour)?;
        }
    }
    Ok(())
}

fn caption(runs: Runs<'_>) -> String {
    let cycles = runs.describe(|run| {
        let settled = run.cycles.iter().filter(|cycle| cycle.settled).count();
        Some(format!(
            "{}, {settled} of them settled",
            count(run.cycles.len(), "cycle")
        ))
    });
    let scatter = runs.describe(|run| {
        let fraction = 100.0 * run.std.energy_loss_j / run.mean.energy_loss_j.abs();
        fraction.is_finite().then(|| {
            if fraction < 0.05 {
                "less than 0.1 %".to_owned()
            } else {
                format!("{} %", fixed(fraction, 1))
            }
        })
    });
    let scatter = if scatter.is_empty() {
        String::new()
    } else {
        format!(" The energy (11) scatters over the settled cycles by {scatter} of its mean.")
    };
    format!(
        "Every whole cycle: {cycles}. A cycle is settled when every tip's contact point was known from its start; only such \
         cycles enter the means.{scatter} A trend here would mean that the worm or the canal changes while it crawls."
    )
}
