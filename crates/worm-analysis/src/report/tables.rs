//! The tables: identification, Tables 3 and 4 of the paper, every cycle, and what the analysis rested on.

use super::number::{NONE, count, fixed, with_error};
use super::runs::Runs;
use super::table::Table;
use crate::experiment::{Analysis, CycleValues, PhaseSource, TheoryCycle};
use worm_physics::worm::GRAVITY_M_PER_S2;

/// Largest tip deformations by each method.
pub(super) fn identification(runs: Runs<'_>) -> Table {
    let head = ["slope", "method"]
        .map(str::to_owned)
        .into_iter()
        .chain((1..=runs.cells()).map(|cell| format!("cell {cell}")));
    let mut table = Table::new("Identification: largest tip deformations, mm", head);
    table.word_columns = 2;
    for (name, run) in runs.named() {
        let mut name = Some(name); // Stands in the first of the run's rows only.
        let mut add = |method: &str, values: Vec<String>| {
            let mut row = vec![name.take().unwrap_or_default(), method.to_owned()];
            row.extend(values);
            table.rows.push(row);
        };
        let listed = |list: &[f64]| list.iter().map(|m| fixed(m * 1e3, 2)).collect::<Vec<_>>();
        add("first estimate", listed(&run.first_estimate.max_deformation_m));
        let search = run.paper_search.as_ref();
        add(
            "the paper's search",
            search.map_or_else(
                || vec![NONE.to_owned(); run.cells],
                |search| listed(&search.max_deformation_m),
            ),
        );
        let found = run.max_deformation_m.iter().zip(&run.max_deformation_sigma_m);
        add(
            "continuous estimator",
            found
                .map(|(m, sigma_m)| with_error(m * 1e3, sigma_m * 1e3, 2))
                .collect(),
        );
    }
    let searches = runs.tell(|run| {
        let search = run.paper_search.as_ref()?;
        Some(format!(
            "{} candidates, mean force {} N, its scatter {} N",
            search.candidates,
            fixed(search.mean_force_n, 3),
            fixed(search.force_std_n, 3)
        ))
    });
    let searches = if searches.is_empty() {
        "The paper's search was not made: so many cells give more candidates than can be tried.".to_owned()
    } else {
        format!("The paper's search (section 3.2.3) tried and left: {searches}.")
    };
    table.note = Some(format!(
        "± is one standard error of the continuous estimator. {searches}"
    ));
    table
}

/// Table 3 of the paper: what the deformations say of the mass.
pub(super) fn mean_deformation(runs: Runs<'_>) -> Table {
    let head = [
        "slope",
        "mean deformation, mm",
        "estimated mass, g",
        "configured mass, g",
        "error, %",
        "mean force (5), N",
    ];
    let mut table = Table::new("Mean deformation (8) and mass (9), as in Table 3 of the paper", head);
    for (name, run) in runs.named() {
        let estimate_kg = run.mass_estimate_kg.unwrap_or(f64::NAN);
        let sigma_kg = run.mass_sigma_kg.unwrap_or(f64::NAN);
        let configured_kg = configured_mass_kg(run).unwrap_or(f64::NAN);
        table.rows.push(vec![
            name,
            fixed(run.mean_deformation_m * 1e3, 3),
            with_error(estimate_kg * 1e3, sigma_kg * 1e3, 0),
            fixed(configured_kg * 1e3, 0),
            fixed(100.0 * (estimate_kg / configured_kg - 1.0), 1),
            fixed(run.momentum_violation_n, 3),
        ]);
    }
    table.note = Some(
        "On the level nothing pulls and the mass cannot be known. The mean force is what is missing to the balance with the \
         configured mass."
            .to_owned(),
    );
    table
}

/// The mass that the analysis was told, kg: the estimate (9) misses it by the unbalanced force (5) over g sin λ. None where
/// nothing pulls.
fn configured_mass_kg(run: &Analysis) -> Option<f64> {
    let pull_m_per_s2 = GRAVITY_M_PER_S2 * run.slope_deg.to_radians().sin();
    run.mass_estimate_kg
        .map(|estimate_kg| estimate_kg + run.momentum_violation_n / pull_m_per_s2)
}

/// Table 4 of the paper: theory against what was measured.
pub(super) fn against_theory(runs: Runs<'_>) -> Table {
    let head = [
        "",
        "slope",
        "measured",
        "theory, identified worm",
        "theory, configured worm",
    ];
    let mut table = Table::new(
        "A cycle, measured and in theory; the advance as in Table 4 of the paper",
        head,
    );
    table.word_columns = 2;
    for (quantity, of, decimals) in FIGURES {
        add_against(&mut table, runs, quantity, decimals, |run| {
            let measured = with_error(of(&run.mean) * 1e3, of(&run.std) * 1e3, decimals);
            (measured, |theory| of(&theory.values))
        });
    }
    add_against(&mut table, runs, "rigid contacts, same advance, mJ", 1, |run| {
        (fixed(run.rigid_energy_j * 1e3, 1), |theory| theory.rigid_energy_j)
    });
    table.note = Some(format!(
        "± is the standard deviation over the settled cycles. {NONE} in theory means that the worm slides down there."
    ));
    table
}

/// Takes one figure out of those of a cycle.
type Pick = fn(&CycleValues) -> f64;

/// The figures of a cycle that are one number, in thousandths of their unit, with the decimals to show.
const FIGURES: [(&str, Pick, usize); 4] = [
    ("advance, mm", |values| values.advance_m, 2),
    ("energy (11), mJ", |values| values.energy_loss_j, 1),
    ("actuator work (13), net, mJ", |values| values.energy_actuator_net_j, 1),
    (
        "actuator work (13), positive, mJ",
        |values| values.energy_actuator_positive_j,
        1,
    ),
];

/// Adds a quantity for every run: what was measured, and how to take it from theory.
fn add_against<T: Fn(&TheoryCycle) -> f64>(
    table: &mut Table,
    runs: Runs<'_>,
    quantity: &str,
    decimals: usize,
    of: impl Fn(&Analysis) -> (String, T),
) {
    for (number, (name, run)) in runs.named().enumerate() {
        let (measured, in_theory) = of(run);
        let theory = |theory: &Option<TheoryCycle>| {
            let value = theory.as_ref().map_or(f64::NAN, &in_theory);
            fixed(value * 1e3, decimals)
        };
        table.rows.push(vec![
            if number == 0 {
                quantity.to_owned()
            } else {
                String::new()
            },
            name,
            measured,
            theory(&run.theory.identified),
            theory(&run.theory.nominal),
        ]);
    }
}

/// Most cycles that a table lists: an hour holds more than anyone reads.
const MAX_CYCLES: usize = 60;

/// Every cycle of a run.
pub(super) fn cycles(name: &str, run: &Analysis) -> Table {
    let head = [
        "cycle",
        "start, s",
        "duration, s",
        "advance, mm",
        "slide forward, mm",
        "slide backward, mm",
        "(11), mJ",
        "(13) net, mJ",
        "(13) positive, mJ",
    ];
    let mut table = Table::new(format!("The cycles at {name}; slides are means over the cells"), head);
    let (shown, left_out) = run.cycles.split_at(run.cycles.len().min(MAX_CYCLES));
    for cycle in shown {
        let settled = if cycle.settled { "" } else { " (settling)" };
        let mut row = vec![
            format!("{}{settled}", cycle.index + 1),
            fixed(cycle.start_s, 2),
            fixed(cycle.duration_s, 3),
        ];
        row.extend(figures(&cycle.values));
        table.rows.push(row);
    }
    if !left_out.is_empty() {
        table.note = Some(format!(
            "{} more in cycles.csv; mean and standard deviation are over all that are settled.",
            count(left_out.len(), "cycle")
        ));
    }
    for (title, values) in [("mean", &run.mean), ("standard deviation", &run.std)] {
        let mut row = vec![title.to_owned(), String::new(), String::new()];
        row.extend(figures(values));
        table.rows.push(row);
    }
    table
}

fn figures(values: &CycleValues) -> [String; 6] {
    let mean = |list: &[f64]| fixed(super::number::mean(list) * 1e3, 2);
    [
        fixed(values.advance_m * 1e3, 2),
        mean(&values.forward_slide_m),
        mean(&values.backward_slide_m),
        fixed(values.energy_loss_j * 1e3, 1),
        fixed(values.energy_actuator_net_j * 1e3, 1),
        fixed(values.energy_actuator_positive_j * 1e3, 1),
    ]
}

/// What was recorded, and what the analysis found out about it first.
pub(super) fn recordings(runs: Runs<'_>) -> Table {
    let head = std::iter::once(String::new()).chain(runs.names());
    let mut table = Table::new("Recordings", head);
    let mut add = |quantity: &str, of: &dyn Fn(&Analysis) -> String| {
        let mut row = vec![quantity.to_owned()];
        row.extend(runs.0.iter().map(of));
        table.rows.push(row);
    };
    add("recording", &|run| run.recording.clone());
    add("samples", &|run| run.samples.to_string());
    add("duration, s", &|run| fixed(run.duration_s, 2));
    add("whole cycles", &|run| {
        let settled = run.cycles.iter().filter(|cycle| cycle.settled).count();
        format!("{}, {settled} settled", count(run.cycles.len(), "cycle"))
    });
    add("mean cycle time, s", &|run| fixed(run.cycle_s, 3));
    add("order of the steps", &|run| {
        let cells: Vec<String> = run.step_order.iter().map(usize::to_string).collect();
        cells.join(" ")
    });
    add("gait phase", &|run| {
        let source = match run.phase_source {
            PhaseSource::Recorded => "recorded",
            PhaseSource::Positions => "found from the positions",
        };
        source.to_owned()
    });
    add("stroke, mm", &|run| fixed(run.stroke_m * 1e3, 2));
    add("noise of one position, mm", &|run| fixed(run.noise_m * 1e3, 3));
    add("variance over that of noise and drift", &|run| {
        fixed(run.misfit_ratio, 2)
    });
    add("damping ratio of the body", &|run| fixed(run.damping_ratio, 1));
    add("tips laid down unloaded", &|run| {
        if run.laid_down { "yes" } else { "not seen" }.to_owned()
    });
    table
}
