//! The head of the report: what was analysed, and the most important values.

use super::figure::{rigid_ratio, schematic};
use super::page::{Page, Tile, TileRow};
use super::plot::{DrawError, cell_colours};
use super::runs::Runs;
use crate::experiment::{Analysis, CycleValues};
use worm_estimator::number::{count, fixed, with_error};

pub(super) fn add(page: &mut Page, runs: Runs<'_>) -> Result<(), DrawError> {
    page.tiles(&tile_rows(runs)?);
    page.paragraph_of(
        "note",
        "± of advance and energy is the standard deviation over the settled cycles of the path fitted to the positions: how much \
         the cycles differ, without the noise of the tracker.",
    );
    page.warnings(&warnings(runs));
    Ok(())
}

/// All warnings, with the name of the run where there are several.
fn warnings(runs: Runs<'_>) -> Vec<String> {
    let several = runs.0.len() > 1;
    let named = runs.named().flat_map(|(name, run)| {
        let warnings = run.warnings.iter();
        warnings.map(move |warning| match several {
            true => format!("{name}: {warning}"),
            false => warning.clone(),
        })
    });
    named.collect()
}

/// What was analysed, in two sentences.
pub(super) fn lead(runs: Runs<'_>) -> String {
    let what = match runs.0.len() {
        1 => "One recording".to_owned(),
        many => count(many, "recording"),
    };
    let lengths = runs.describe(|run| {
        Some(format!(
            "{} of {} s",
            count(run.cycles.len(), "whole cycle"),
            fixed(run.cycle_s, 2)
        ))
    });
    format!(
        "{what} of a worm of {} cells: {lengths}. From positions alone: where each tip touches the canal, how far it slides, and \
         what a cycle of the gait costs.",
        runs.cells()
    )
}

/// The tips once where all runs share them, then each run.
fn tile_rows(runs: Runs<'_>) -> Result<Vec<TileRow>, DrawError> {
    let shared = runs
        .0
        .first()
        .filter(|first| runs.0.iter().all(|run| has_tips_of(run, first)));
    let mut rows = Vec::new();
    if let Some(run) = shared {
        rows.push(TileRow {
            name: "Largest tip deformation".to_owned(),
            note: match runs.0.len() {
                1 => "± one standard error".to_owned(),
                many => format!("common to {}; ± one standard error", count(many, "recording")),
            },
            tiles: tips(run),
            ..TileRow::default()
        });
    }
    for (name, run) in runs.named() {
        let mut tiles = if shared.is_some() { Vec::new() } else { tips(run) };
        tiles.extend(cycle(run));
        rows.push(TileRow {
            picture: Some(schematic(run)?),
            name,
            note: run.recording.clone(),
            tiles,
            ..TileRow::default()
        });
    }
    Ok(rows)
}

/// Whether two runs have the same tips, as those do that were identified together.
fn has_tips_of(run: &Analysis, other: &Analysis) -> bool {
    let same = |one: &[f64], other: &[f64]| one.iter().map(|m| m.to_bits()).eq(other.iter().map(|m| m.to_bits()));
    same(&run.max_deformation_m, &other.max_deformation_m)
        && same(&run.max_deformation_sigma_m, &other.max_deformation_sigma_m)
}

fn tips(run: &Analysis) -> Vec<Tile> {
    let colours = cell_colours(run.cells).into_iter().enumerate();
    let tile = |(cell, colour)| {
        let mm = |list: &[f64]| list.get(cell).map_or(f64::NAN, |m| m * 1e3);
        let value = with_error(mm(&run.max_deformation_m), mm(&run.max_deformation_sigma_m), 2);
        Tile {
            dot: Some(colour),
            ..Tile::new(format!("cell {}", cell + 1), value, "mm", "")
        }
    };
    colours.map(tile).collect()
}

fn cycle(run: &Analysis) -> Vec<Tile> {
    let of_cycle = |name, decimals, unit, how, of: fn(&CycleValues) -> f64| {
        let value = with_error(of(&run.mean) * 1e3, of(&run.std) * 1e3, decimals);
        Tile::new(name, value, unit, how)
    };
    let energy = |how, of| of_cycle("energy per cycle", 1, "mJ", how, of);
    vec![
        of_cycle(
            "advance per cycle",
            2,
            "mm",
            "net displacement, mean of the cells",
            |values| values.advance_m,
        ),
        energy("losses and weight (11)", |values| values.energy_loss_j),
        energy("net actuator work (13)", |values| values.energy_actuator_net_j),
        energy("positive actuator work", |values| values.energy_actuator_positive_j),
        Tile::new(
            "against rigid contacts",
            fixed(rigid_ratio(run).unwrap_or(f64::NAN), 2),
            "×",
            "energy (11) for the same advance",
        ),
    ]
}
