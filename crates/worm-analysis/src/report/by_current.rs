//! The report on recordings in which nobody saw the worm: what the motor's current says.

use super::figure::{Felt, torque_figure};
use super::page::{Page, Table, Tile, TileRow};
use super::plot::{DrawError, cell_colours};
use super::runs::{describe_each, names_by_slope};
use super::{ReportError, Written, file, folders, sheets};
use crate::experiment::{AnalysisByCurrent, CycleByCurrent, CycleValues};
use std::path::Path;
use worm_estimator::number::{NONE, count, fixed, mean, with_error};

/// Most cycles that a table lists.
const MAX_CYCLES: usize = 60;

/// Writes the report on the runs of one worm into a directory, which is made if necessary: `report.html`, and `cycles.csv` beside it or in
/// `run-1`, `run-2`, …
///
/// # Errors
/// [`ReportError`]; the page is written last.
pub fn write(dir: &Path, title: &str, runs: &[AnalysisByCurrent]) -> Result<Written, ReportError> {
    if runs.is_empty() {
        return Err(ReportError::NoRuns);
    }
    let page = compose(title, runs)?;
    let mut written = Vec::new();
    for (run, folder) in runs.iter().zip(folders(runs.len())) {
        let folder = dir.join(folder);
        file::make_directory(&folder)?;
        written.push(file::replace(
            folder.join("cycles.csv"),
            &sheets::cycles_by_current(run)?,
        )?);
    }
    Ok(Written {
        page: file::replace(dir.join("report.html"), page.as_bytes())?,
        sheets: written,
    })
}

/// The same for the terminal, without figures and single cycles.
pub fn text(runs: &[AnalysisByCurrent]) -> String {
    let tables = [tips(runs), against_theory(runs)].map(|table| table.to_string());
    [&[lead(runs)], &tables[..]].concat().join("\n\n")
}

fn compose(title: &str, runs: &[AnalysisByCurrent]) -> Result<String, DrawError> {
    let mut page = Page::new(title, &lead(runs));
    let rows: Vec<TileRow> = named(runs).map(|(name, run)| tiles(name, run)).collect();
    page.tiles(&rows);
    page.paragraph_of(
        "note",
        "± is one standard error of what is inferred. It holds as far as the model does: where a worm does what the model does not know, it is \
         further off than that.",
    );
    let several = runs.len() > 1;
    let warnings: Vec<String> = named(runs)
        .flat_map(|(name, run)| {
            run.warnings.iter().map(move |warning| match several {
                true => format!("{name}: {warning}"),
                false => warning.clone(),
            })
        })
        .collect();
    page.warnings(&warnings);
    let felt: Vec<Felt<'_>> = named(runs).filter_map(|(name, run)| felt(name, run)).collect();
    if let Some(figure) = torque_figure(&felt)? {
        page.heading("Figures");
        page.figure(&figure);
    }
    page.heading("Tables");
    page.add(tips(runs));
    page.add(against_theory(runs));
    for (name, run) in named(runs) {
        page.add(cycles(&name, run));
    }
    Ok(page.finish())
}

fn named(runs: &[AnalysisByCurrent]) -> impl Iterator<Item = (String, &AnalysisByCurrent)> {
    names_by_slope(runs.iter().map(|run| run.slope_deg))
        .into_iter()
        .zip(runs)
}

fn felt(name: String, run: &AnalysisByCurrent) -> Option<Felt<'_>> {
    Some(Felt {
        name,
        cells: run.cells,
        step_order: &run.step_order,
        profile: run.torque_profile.as_ref()?,
    })
}

fn lead(runs: &[AnalysisByCurrent]) -> String {
    let names = names_by_slope(runs.iter().map(|run| run.slope_deg));
    let lengths = runs.iter().map(|run| {
        let cycles = count(run.cycles.len(), "whole cycle");
        Some(format!("{cycles} of {} s", fixed(run.cycle_s, 2)))
    });
    format!(
        "{} of a worm of {} cells, whose positions nobody saw or looked at: {}. From the current of its motor alone: friction and stiffness of each cell, and by the exact \
         model how far the worm gets with them and what a cycle of the gait costs.",
        count(runs.len(), "recording"),
        runs.first().map_or(0, |run| run.cells),
        describe_each(&names, lengths),
    )
}

fn tiles(name: String, run: &AnalysisByCurrent) -> TileRow {
    let mut tiles: Vec<Tile> = cell_colours(run.cells)
        .into_iter()
        .enumerate()
        .map(|(cell, colour)| {
            let mm = with_error(
                run.max_deformation_m[cell] * 1e3,
                run.max_deformation_sigma_m[cell] * 1e3,
                2,
            );
            Tile {
                dot: Some(colour),
                ..Tile::new(format!("cell {}", cell + 1), mm, "mm", "largest deformation")
            }
        })
        .collect();
    let inferred = |name, how, of: fn(&CycleValues) -> f64, decimals, unit| {
        let value = with_error(of(&run.mean) * 1e3, of(&run.sigma) * 1e3, decimals);
        Tile::new(name, value, unit, how)
    };
    let electrical_mj = fixed(run.energy_electrical_j * 1e3, 0);
    tiles.extend([
        inferred(
            "advance per cycle",
            "inferred, by the model",
            |values| values.advance_m,
            2,
            "mm",
        ),
        inferred(
            "energy per cycle",
            "losses and weight (11), inferred",
            |values| values.energy_loss_j,
            1,
            "mJ",
        ),
        Tile::new("electrical energy", electrical_mj, "mJ", "per cycle, measured"),
        Tile::new(
            "against rigid contacts",
            fixed(run.mean.energy_loss_j / run.rigid_energy_j, 2),
            "×",
            "energy (11) for the same advance",
        ),
    ]);
    TileRow {
        name,
        note: run.recording.clone(),
        tiles,
        ..TileRow::default()
    }
}

/// What was found of each cell.
fn tips(runs: &[AnalysisByCurrent]) -> Table {
    let head = [
        "slope",
        "cell",
        "friction, N",
        "stiffness, N/m",
        "largest deformation, mm",
    ];
    let mut table = Table::new("Tips and pads, by the motor's current", head).with_word_columns(2);
    for (name, run) in named(runs) {
        for cell in 0..run.cells {
            table.rows.push(vec![
                if cell == 0 { name.clone() } else { String::new() },
                (cell + 1).to_string(),
                with_error(run.friction_n[cell], run.friction_sigma_n[cell], 2),
                with_error(run.stiffness_n_per_m[cell], run.stiffness_sigma_n_per_m[cell], 0),
                with_error(
                    run.max_deformation_m[cell] * 1e3,
                    run.max_deformation_sigma_m[cell] * 1e3,
                    2,
                ),
            ]);
        }
    }
    let pulls = runs
        .iter()
        .map(|run| Some(format!("{} N", with_error(run.pull_n, run.pull_sigma_n, 2))));
    let names = names_by_slope(runs.iter().map(|run| run.slope_deg));
    table.note = Some(format!(
        "The pull on the body, weight, payload and drag together: {}.",
        describe_each(&names, pulls)
    ));
    table
}

/// A quantity of a cycle, in thousandths of its unit.
type Quantity = (&'static str, usize, fn(&CycleValues) -> f64);

const QUANTITIES: [Quantity; 6] = [
    ("advance, mm", 2, |values| values.advance_m),
    ("slide forward, mm", 2, |values| mean(&values.forward_slide_m)),
    ("slide backward, mm", 2, |values| mean(&values.backward_slide_m)),
    ("energy (11), mJ", 1, |values| values.energy_loss_j),
    ("work (13) net, mJ", 1, |values| values.energy_actuator_net_j),
    ("work (13) positive, mJ", 1, |values| values.energy_actuator_positive_j),
];

fn against_theory(runs: &[AnalysisByCurrent]) -> Table {
    let head = ["", "slope", "by the motor's current", "theory, configured worm"];
    let mut table = Table::new("A cycle, inferred and in theory", head).with_word_columns(2);
    for (name, decimals, of) in QUANTITIES {
        for (number, (slope, run)) in named(runs).enumerate() {
            // The mean of the slides' errors is the most that the error of their mean can be.
            let sigma = of(&run.sigma);
            let theory = run.theory.nominal.as_ref();
            table.rows.push(vec![
                if number == 0 { name } else { "" }.to_owned(),
                slope,
                with_error(of(&run.mean) * 1e3, sigma * 1e3, decimals),
                theory.map_or(NONE.to_owned(), |cycle| fixed(of(&cycle.values) * 1e3, decimals)),
            ]);
        }
    }
    for (number, (slope, run)) in named(runs).enumerate() {
        table.rows.push(vec![
            if number == 0 { "electrical energy, mJ" } else { "" }.to_owned(),
            slope,
            if run.energy_electrical_j.is_finite() {
                format!("{} (measured)", fixed(run.energy_electrical_j * 1e3, 0))
            } else {
                "not recorded".to_owned()
            },
            NONE.to_owned(),
        ]);
    }
    table.note = Some(format!(
        "± is one standard error; slides are means over the cells, whose errors are at most that. {NONE} in theory means that there is none: the worm slides down, or the motor is \
         not part of it."
    ));
    table
}

fn cycles(name: &str, run: &AnalysisByCurrent) -> Table {
    let head = [
        "cycle ends at, s",
        "advance, mm",
        "energy (11), mJ",
        "electrical energy, mJ",
    ];
    let mut table = Table::new(format!("The cycles at {name}, as the worm was known after each"), head);
    let row = |cycle: &CycleByCurrent| {
        let odd = if cycle.is_odd { " (set aside)" } else { "" };
        vec![
            format!("{}{odd}", fixed(cycle.end_s, 2)),
            with_error(cycle.advance_m * 1e3, cycle.advance_sigma_m * 1e3, 2),
            with_error(cycle.energy_loss_j * 1e3, cycle.energy_loss_sigma_j * 1e3, 1),
            fixed(cycle.energy_electrical_j * 1e3, 0),
        ]
    };
    let (shown, left_out) = run.cycles.split_at(run.cycles.len().min(MAX_CYCLES));
    table.rows = shown.iter().map(row).collect();
    table.note = (!left_out.is_empty()).then(|| format!("{} more in cycles.csv.", count(left_out.len(), "cycle")));
    table
}
