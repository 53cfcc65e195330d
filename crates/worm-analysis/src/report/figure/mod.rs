//! The figures, one file for each family; their numbers are those of the paper.
//!
//! All share one style: a cell has one colour, a thin line sticks and a thick one slides, bars are measured values,
//! a diamond is theory with the worm identified here and a ring theory with the worm as configured.

mod balance;
mod bar;
mod closeup;
mod contacts;
mod deformations;
mod energy;
mod positions;
mod schematic;
mod slides;
mod torque;
mod trend;
mod window;

use super::page::{Figure, Key, Mark, Panel};
use super::plot::{DrawError, Svg, cell_colours};
use super::runs::Runs;
use crate::experiment::{Analysis, CycleValues};
use worm_estimator::number::{fixed, mean};

pub(super) use energy::rigid_ratio;
pub(super) use schematic::schematic;
pub(super) use torque::{Felt, torque_figure};

/// Every figure of a report, in reading order.
pub(super) fn all(runs: Runs<'_>) -> Result<Vec<Figure>, DrawError> {
    let mut figures = vec![
        positions::figure(runs)?,
        closeup::figure(runs)?,
        contacts::figure(runs)?,
        deformations::figure(runs)?,
        balance::figure(runs)?,
        slides::figure(runs)?,
        energy::figure(runs)?,
    ];
    figures.extend(torque::figure(runs)?);
    figures.push(trend::figure(runs)?);
    Ok(figures)
}

/// One panel for each run, drawn by `picture` from the run's name and analysis.
fn panel_per_run(
    runs: Runs<'_>,
    quantity: &str,
    picture: impl Fn(&str, &Analysis) -> Result<Svg, DrawError>,
) -> Result<Vec<Panel>, DrawError> {
    runs.named()
        .map(|(name, run)| {
            let svg = picture(&name, run)?;
            Ok(Panel::new(name, quantity, svg))
        })
        .collect()
}

/// Legend entries of the cells.
fn cell_keys(cells: usize, mark: Mark) -> Vec<Key> {
    cell_colours(cells)
        .into_iter()
        .enumerate()
        .map(|(cell, colour)| Key::new(mark, colour, format!("cell {}", cell + 1)))
        .collect()
}

/// The slides of a tip in a cycle, averaged over the cells.
fn slides_in_words(values: &CycleValues) -> String {
    let mm = |list_m: &[f64]| fixed(mean(list_m) * 1e3, 2);
    format!(
        "{} mm forward and {} mm backward",
        mm(&values.forward_slide_m),
        mm(&values.backward_slide_m)
    )
}
