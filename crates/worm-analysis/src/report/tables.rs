//! The tables: identification, Tables 3 and 4 of the paper, every cycle, and what was recorded.

use super::page::{QuantityRow, Table};
use super::runs::Runs;
use crate::experiment::{Analysis, CycleValues, PhaseSource, TheoryCycle};
use worm_estimator::number::{NONE, count, fixed, mean, with_error};
use worm_physics::worm::GRAVITY_M_PER_S2;

/// The tables that the terminal shows, too; the page adds every cycle.
pub(super) fn main(runs: Runs<'_>) -> [Table; 4] {
    [
        identification(runs),
        mean_deformation(runs),
        against_theory(runs),
        recordings(runs),
    ]
}

/// Largest tip deformations by each method.
fn identification(runs: Runs<'_>) -> Table {
    let cells = (1..=runs.cells()).map(|cell| format!("cell {cell}"));
    let head = ["slope", "method"].map(str::to_owned).into_iter().chain(cells);
    let mut table = Table::new("Identification: largest tip deformations, mm", head).with_word_columns(2);
    let listed = |list_m: &[f64]| list_m.iter().map(|m| fixed(m * 1e3, 2)).collect();
    for (name, run) in runs.named() {
        let search = run.paper_search.as_ref();
        let found = run.max_deformation_m.iter().zip(&run.max_deformation_sigma_m);
        let methods: [(&str, Vec<String>); 3] = [
            ("first estimate", listed(&run.first_estimate.max_deformation_m)),
            (
                "the paper's search",
                search.map_or_else(
                    || vec![NONE.to_owned(); run.cells],
                    |search| listed(&search.max_deformation_m),
                ),
            ),
            (
                "continuous estimator",
                found
                    .map(|(m, sigma_m)| with_error(m * 1e3, sigma_m * 1e3, 2))
                    .collect(),
            ),
        ];
        for (number, (method, values)) in methods.into_iter().enumerate() {
            let name = if number == 0 { name.clone() } else { String::new() };
            table.rows.push([vec![name, method.to_owned()], values].concat());
        }
    }
    let searches = runs.describe(|run| {
        let search = run.paper_search.as_ref()?;
        Some(format!(
            "{} candidates, mean force {} N, its scatter {} N",
            search.candidates,
            fixed(search.mean_force_n, 3),
            fixed(search.force_std_n, 3)
        ))
    });
    let searches = match &*searches {
        "" => "The paper's search was left out: so many cells give more candidates than can be tried.".to_owned(),
        searches => format!("The paper's search (section 3.2.3) tried and left: {searches}."),
    };
    table.note = Some(format!(
        "± is one standard error of the continuous estimator. {searches}"
    ));
    table
}

/// Table 3 of the paper: the mass that the deformations imply.
fn mean_deformation(runs: Runs<'_>) -> Table {
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
        "On the level gravity pulls nowhere along the canal, so the mass cannot be known. The mean force is what the balance \
         lacks with the configured mass."
            .to_owned(),
    );
    table
}

/// The mass that the analysis was given, kg: the estimate (9) differs from it by the unbalanced force (5) over g sin λ. None on
/// the level.
fn configured_mass_kg(run: &Analysis) -> Option<f64> {
    let pull_m_per_s2 = GRAVITY_M_PER_S2 * run.slope_deg.to_radians().sin();
    run.mass_estimate_kg
        .map(|estimate_kg| estimate_kg + run.momentum_violation_n / pull_m_per_s2)
}

/// A quantity of a cycle that is one number, in thousandths of its unit.
struct CycleQuantity {
    name: &'static str,
    decimals: usize,
    of: fn(&CycleValues) -> f64,
    /// The slides of the cells depend on each other, so the deviation of their mean does not follow from theirs.
    has_std: bool,
}

const fn quantity(name: &'static str, decimals: usize, of: fn(&CycleValues) -> f64) -> CycleQuantity {
    CycleQuantity {
        name,
        decimals,
        of,
        has_std: true,
    }
}

const fn mean_of_cells(name: &'static str, of: fn(&CycleValues) -> f64) -> CycleQuantity {
    CycleQuantity {
        has_std: false,
        ..quantity(name, 2, of)
    }
}

const QUANTITIES: [CycleQuantity; 6] = [
    quantity("advance, mm", 2, |values| values.advance_m),
    mean_of_cells("slide forward, mm", |values| mean(&values.forward_slide_m)),
    mean_of_cells("slide backward, mm", |values| mean(&values.backward_slide_m)),
    quantity("energy (11), mJ", 1, |values| values.energy_loss_j),
    quantity("work (13) net, mJ", 1, |values| values.energy_actuator_net_j),
    quantity("work (13) positive, mJ", 1, |values| values.energy_actuator_positive_j),
];

/// Table 4 of the paper: theory against measurement.
fn against_theory(runs: Runs<'_>) -> Table {
    let head = [
        "",
        "slope",
        "measured",
        "theory, identified worm",
        "theory, configured worm",
    ];
    let title = "Measured and in theory, per cycle; the advance as in Table 4 of the paper";
    let mut table = Table::new(title, head).with_word_columns(2);
    for quantity in QUANTITIES {
        let std = |run: &Analysis| {
            if quantity.has_std {
                (quantity.of)(&run.std)
            } else {
                f64::NAN
            }
        };
        let measured = |run: &Analysis| with_error((quantity.of)(&run.mean) * 1e3, std(run) * 1e3, quantity.decimals);
        let theory = |theory: &TheoryCycle| fixed((quantity.of)(&theory.values) * 1e3, quantity.decimals);
        add_against_theory(&mut table, runs, quantity.name, measured, theory);
    }
    let mj = |energy_j: f64| fixed(energy_j * 1e3, 1);
    let rigid = "rigid contacts, same advance, mJ";
    add_against_theory(
        &mut table,
        runs,
        rigid,
        |run| mj(run.rigid_energy_j),
        |theory| mj(theory.rigid_energy_j),
    );
    table.note = Some(format!(
        "± is the standard deviation over the settled cycles; slides are means over the cells. {NONE} in theory means that the \
         worm slides down there."
    ));
    table
}

/// Adds a quantity for every run, as measured and in theory.
fn add_against_theory(
    table: &mut Table,
    runs: Runs<'_>,
    quantity: &str,
    measured: impl Fn(&Analysis) -> String,
    in_theory: impl Fn(&TheoryCycle) -> String,
) {
    let theory = |cycle: &Option<TheoryCycle>| cycle.as_ref().map_or(NONE.to_owned(), &in_theory);
    for (number, (slope, run)) in runs.named().enumerate() {
        table.rows.push(vec![
            if number == 0 { quantity } else { "" }.to_owned(),
            slope,
            measured(run),
            theory(&run.theory.identified),
            theory(&run.theory.nominal),
        ]);
    }
}

/// Most cycles that a table lists: an hour holds more than anyone reads.
const MAX_CYCLES: usize = 60;

/// Every cycle of a run.
pub(super) fn cycles(name: &str, run: &Analysis) -> Table {
    let quantities = QUANTITIES.iter().map(|quantity| quantity.name);
    let head = ["cycle", "start, s", "duration, s"].into_iter().chain(quantities);
    let mut table = Table::new(format!("The cycles at {name}; slides are means over the cells"), head);
    let mut add = |first: [String; 3], values: &CycleValues| {
        let quantities = QUANTITIES.iter();
        let values = quantities.map(|quantity| fixed((quantity.of)(values) * 1e3, quantity.decimals));
        table.rows.push(first.into_iter().chain(values).collect());
    };
    let (shown, left_out) = run.cycles.split_at(run.cycles.len().min(MAX_CYCLES));
    for cycle in shown {
        let settled = if cycle.settled { "" } else { " (settling)" };
        let number = format!("{}{settled}", cycle.index + 1);
        add(
            [number, fixed(cycle.start_s, 2), fixed(cycle.duration_s, 3)],
            &cycle.values,
        );
    }
    for (title, values) in [("mean", &run.mean), ("standard deviation", &run.std)] {
        add([title.to_owned(), String::new(), String::new()], values);
    }
    table.note = (!left_out.is_empty()).then(|| {
        let more = count(left_out.len(), "cycle");
        format!("{more} more in cycles.csv; mean and standard deviation are over all that are settled.")
    });
    table
}

/// What was recorded, and what the analysis found out about it first.
fn recordings(runs: Runs<'_>) -> Table {
    let cycles = |run: &Analysis| {
        let settled = run.cycles.iter().filter(|cycle| cycle.settled).count();
        format!("{}, {settled} settled", count(run.cycles.len(), "cycle"))
    };
    let step_order = |run: &Analysis| {
        run.step_order
            .iter()
            .map(usize::to_string)
            .collect::<Vec<_>>()
            .join(" ")
    };
    let phase = |run: &Analysis| match run.phase_source {
        PhaseSource::Recorded => "recorded".to_owned(),
        PhaseSource::Positions => "found from the positions".to_owned(),
    };
    let laid_down = |run: &Analysis| if run.laid_down { "yes" } else { "not seen" }.to_owned();
    let quantities: &[QuantityRow<'_, Analysis>] = &[
        ("recording", &|run| run.recording.clone()),
        ("samples", &|run| run.samples.to_string()),
        ("duration, s", &|run| fixed(run.duration_s, 2)),
        ("whole cycles", &cycles),
        ("mean cycle time, s", &|run| fixed(run.cycle_s, 3)),
        ("order of the steps", &step_order),
        ("gait phase", &phase),
        ("stroke, mm", &|run| fixed(run.stroke_m * 1e3, 2)),
        ("noise of one position, mm", &|run| fixed(run.noise_m * 1e3, 3)),
        ("variance over that of noise and drift", &|run| {
            fixed(run.misfit_ratio, 2)
        }),
        ("damping ratio of the body", &|run| fixed(run.damping_ratio, 1)),
        ("tips laid down unloaded", &laid_down),
    ];
    Table::of_items("Recordings", runs.names(), runs.0, quantities)
}
