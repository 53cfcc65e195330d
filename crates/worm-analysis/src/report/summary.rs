//! The head of the page: what was recorded, and the answer, before any figure.

use super::figure::{rigid_ratio, schematic};
use super::number::{count, fixed, with_error};
use super::page::{Page, escaped};
use super::plot::{DrawError, cell_colours, css};
use super::runs::Runs;
use super::tile::{Tile, push_row};
use crate::experiment::{Analysis, CycleValues};

pub(super) fn add(page: &mut Page, title: &str, runs: Runs<'_>) -> Result<(), DrawError> {
    page.html(&format!("<h1>{}</h1>", escaped(title)));
    page.html(&format!("<p class=\"lead\">{}</p>", escaped(&lead(runs))));
    page.html(&answer(runs)?);
    let several = runs.0.len() > 1;
    let warnings: Vec<String> = runs
        .named()
        .flat_map(|(name, run)| {
            let named = move |warning: &String| {
                if several {
                    format!("{name}: {warning}")
                } else {
                    warning.clone()
                }
            };
            run.warnings.iter().map(named)
        })
        .collect();
    page.warnings(&warnings);
    Ok(())
}

fn lead(runs: Runs<'_>) -> String {
    let what = if runs.0.len() == 1 {
        "One recording".to_owned()
    } else {
        count(runs.0.len(), "recording")
    };
    let lengths = runs.tell(|run| {
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

/// What was found, large: the tips once where all runs share them, then each run.
fn answer(runs: Runs<'_>) -> Result<String, DrawError> {
    let shared = runs
        .0
        .first()
        .filter(|first| runs.0.iter().all(|run| has_tips_of(run, first)));
    let mut html = "<section class=\"answer\">".to_owned();
    if let Some(run) = shared {
        let found = match runs.0.len() {
            1 => "± one standard error".to_owned(),
            many => format!("common to {}; ± one standard error", count(many, "recording")),
        };
        push_row(
            &mut html,
            &format!("<b>Largest tip deformation</b><small>{found}</small>"),
            &tips(run),
            "",
        );
    }
    for (name, run) in runs.named() {
        let picture = schematic(run)?;
        let (name, recording) = (escaped(&name), escaped(&run.recording));
        let place = format!("{picture}<b>{name}</b><small>{recording}</small>");
        let mut tiles = if shared.is_some() { Vec::new() } else { tips(run) };
        tiles.extend(cycle(run));
        push_row(&mut html, &place, &tiles, "");
    }
    html.push_str("</section>");
    html.push_str(
        "<p class=\"note\">± of advance and energy is the standard deviation over the settled cycles of the path fitted to the \
         positions: how much the cycles differ, without the noise of the tracker.</p>",
    );
    Ok(html)
}

/// Whether two runs tell the same of the tips, as those do that were identified together.
fn has_tips_of(run: &Analysis, other: &Analysis) -> bool {
    let same = |one: &[f64], other: &[f64]| one.iter().map(|m| m.to_bits()).eq(other.iter().map(|m| m.to_bits()));
    same(&run.max_deformation_m, &other.max_deformation_m)
        && same(&run.max_deformation_sigma_m, &other.max_deformation_sigma_m)
}

fn tips(run: &Analysis) -> Vec<Tile> {
    let colours = cell_colours(run.cells).into_iter().enumerate();
    colours
        .map(|(cell, colour)| {
            let mm = |list: &[f64]| list.get(cell).map_or(f64::NAN, |m| m * 1e3);
            Tile {
                name: format!("<i style=\"--c:{}\"></i>cell {}", css(colour), cell + 1),
                value: with_error(mm(&run.max_deformation_m), mm(&run.max_deformation_sigma_m), 2),
                unit: "mm".to_owned(),
                how: String::new(),
            }
        })
        .collect()
}

fn cycle(run: &Analysis) -> Vec<Tile> {
    let energy = |how, of: fn(&CycleValues) -> f64| Tile {
        name: "energy per cycle".to_owned(),
        value: with_error(of(&run.mean) * 1e3, of(&run.std) * 1e3, 1),
        unit: "mJ".to_owned(),
        how: str::to_owned(how),
    };
    vec![
        Tile {
            name: "advance per cycle".to_owned(),
            value: with_error(run.mean.advance_m * 1e3, run.std.advance_m * 1e3, 2),
            unit: "mm".to_owned(),
            how: "net displacement, mean of the cells".to_owned(),
        },
        energy("losses and weight (11)", |values| values.energy_loss_j),
        energy("net actuator work (13)", |values| values.energy_actuator_net_j),
        energy("positive actuator work", |values| values.energy_actuator_positive_j),
        Tile {
            name: "against rigid contacts".to_owned(),
            value: fixed(rigid_ratio(run).unwrap_or(f64::NAN), 2),
            unit: "×".to_owned(),
            how: "energy (11) for the same advance".to_owned(),
        },
    ]
}
