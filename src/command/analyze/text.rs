//! What a person reads in the terminal: the tips, then a cycle in figures, one column for each recording.

use crate::command::columns::{Row, aligned};
use worm_analysis::experiment::{Analysis, CycleValues, TheoryCycle};
use worm_estimator::number::{NONE, count, fixed, mean, with_error};

/// Everything found, in millimetres and millijoules.
pub(super) fn text(analyses: &[Analysis]) -> String {
    let heads: Vec<String> = analyses.iter().map(head).collect();
    [heads.join("\n"), aligned(&tips(analyses)), aligned(&cycle(analyses))].join("\n\n")
}

/// What was recorded, on one line.
fn head(run: &Analysis) -> String {
    let settled = run.cycles.iter().filter(|cycle| cycle.settled).count();
    let order: Vec<String> = run.step_order.iter().map(usize::to_string).collect();
    format!(
        "{} at {}°: {} of {} s ({settled} settled), cells step {}, stroke {} mm, noise {} mm",
        run.recording,
        run.slope_deg,
        count(run.cycles.len(), "cycle"),
        fixed(run.cycle_s, 2),
        order.join(" "),
        fixed(run.stroke_m * 1e3, 2),
        fixed(run.noise_m * 1e3, 3)
    )
}

/// Largest tip deformations by each method. Recordings of one campaign are identified together, so the first speaks for all.
fn tips(analyses: &[Analysis]) -> Vec<Row> {
    let Some(first) = analyses.first() else {
        return Vec::new();
    };
    let row = |name: String, values: Vec<String>| -> Row { std::iter::once(name).chain(values).collect() };
    let plain = |list_m: &[f64]| list_m.iter().map(|m| fixed(m * 1e3, 2)).collect::<Vec<_>>();
    let cells = (1..=first.cells).map(|cell| format!("cell {cell}")).collect();
    let found = first.max_deformation_m.iter().zip(&first.max_deformation_sigma_m);
    let mut rows = vec![
        row("largest tip deformation, mm".to_owned(), cells),
        row(
            "  identified".to_owned(),
            found
                .map(|(m, sigma_m)| with_error(m * 1e3, sigma_m * 1e3, 2))
                .collect(),
        ),
    ];
    for run in analyses {
        let at = if analyses.len() > 1 {
            format!(", {}°", run.slope_deg)
        } else {
            String::new()
        };
        rows.push(row(
            format!("  first estimate{at}"),
            plain(&run.first_estimate.max_deformation_m),
        ));
        if let Some(search) = &run.paper_search {
            rows.push(row(
                format!("  the paper's search{at}"),
                plain(&search.max_deformation_m),
            ));
        }
    }
    rows
}

/// A cycle in figures: what was measured, and theory below it.
fn cycle(analyses: &[Analysis]) -> Vec<Row> {
    let row = |name: &str, of: &dyn Fn(&Analysis) -> String| -> Row {
        std::iter::once(name.to_owned())
            .chain(analyses.iter().map(of))
            .collect()
    };
    type Figure = (&'static str, usize, fn(&CycleValues) -> f64);
    let figures: [Figure; 6] = [
        ("  advance, mm", 2, |values| values.advance_m),
        ("  slide forward, mean of the cells, mm", 2, |values| {
            mean(&values.forward_slide_m)
        }),
        ("  slide backward, mean of the cells, mm", 2, |values| {
            mean(&values.backward_slide_m)
        }),
        ("  energy by losses and weight (11), mJ", 1, |values| {
            values.energy_loss_j
        }),
        ("  net actuator work (13), mJ", 1, |values| values.energy_actuator_net_j),
        ("  positive actuator work (13), mJ", 1, |values| {
            values.energy_actuator_positive_j
        }),
    ];
    let mut rows = vec![row("per cycle", &|run| format!("{}°", run.slope_deg))];
    for (name, decimals, of) in figures {
        let theory = |theory: &Option<TheoryCycle>| match theory {
            Some(theory) => fixed(of(&theory.values) * 1e3, decimals),
            None => "slides down".to_owned(),
        };
        // The cells' slides depend on each other, so no deviation of their mean follows from those of the cells.
        let is_mean_of_cells = name.contains("mean of the cells");
        rows.push(row(name, &|run| {
            let std = if is_mean_of_cells { f64::NAN } else { of(&run.std) };
            with_error(of(&run.mean) * 1e3, std * 1e3, decimals)
        }));
        rows.push(row("    theory, identified worm", &|run| {
            theory(&run.theory.identified)
        }));
        rows.push(row("    theory, configured worm", &|run| theory(&run.theory.nominal)));
    }
    rows.push(row("  rigid contacts, same advance, mJ", &|run| {
        fixed(run.rigid_energy_j * 1e3, 1)
    }));
    rows.push(row("mean deformation (8), mm", &|run| {
        fixed(run.mean_deformation_m * 1e3, 3)
    }));
    rows.push(row("mass by it (9), g", &|run| match run.mass_estimate_kg {
        Some(mass_kg) => with_error(mass_kg * 1e3, run.mass_sigma_kg.unwrap_or(f64::NAN) * 1e3, 0),
        None => NONE.to_owned(),
    }));
    rows.push(row("misfit of theory, 1 where only noise is left", &|run| {
        fixed(run.misfit_ratio, 2)
    }));
    rows
}
