//! What the model of the torque may be wrong by everywhere, whatever is missing from it.
//!
//! As of the positions (see [`crate::explain::search::discrepancy`]): a smooth unknown function that repeats with the phase, in part common
//! to all cells while they step, in part of each cell, with a slow part over the run. Its scale is a share of the torque with which a tip
//! slides. It is larger than that of the positions: between motor and cam are gears, whose friction no model knows to a per cent. Beside
//! it stands the ripple of the motor and its gears, which returns with the angle on every run: known waves of it as such, and others as
//! whatever each place in the cycle has of its own.

use super::recorded_worm::RecordedWorm;
use crate::explain::search::discrepancy::{SHARED, SLOW, WAVES, over_conditions, weights};
use crate::explain::search::plant::Recorded;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Its standard deviation over the torque with which a tip slides.
const SHARE: f64 = 0.03;
/// Cosines in a step.
const COSINES: usize = 6;

/// Standard deviation of that over what is known of each wave.
const UNKNOWN_WAVES: f64 = 0.5;

/// A function of run and bin.
enum Column {
    /// Whatever cell steps: cosine, function of the condition.
    All(usize, usize),
    /// While one cell steps.
    Own(usize, usize, usize),
    /// As of all, times a wave over the run.
    Slow(usize, usize, usize),
    /// At one place in the cycle, on every run, N m.
    Place(usize, f64),
    /// Sine, or cosine, of so many waves in a turn of the cam, of this amplitude, N m.
    Ripple(f64, bool, f64),
}

/// Columns of the torque, whitened by the noise; none where no current counts.
pub(super) fn columns(worm: &RecordedWorm<'_>) -> Option<DMatrix<f64>> {
    let gear = worm
        .scene
        .observed
        .iter()
        .find_map(|observed| observed.torque.as_ref())?
        .gear;
    let scale_n_m = SHARE * sliding_n_m(worm);
    let (over_conditions, weights) = (over_conditions(worm), weights(COSINES));
    let mut kinds = Vec::new();
    for function in 0..over_conditions.first().map_or(0, Vec::len) {
        for cosine in 0..COSINES {
            kinds.push(Column::All(cosine, function));
            kinds.extend((0..worm.channels()).map(|cell| Column::Own(cell, cosine, function)));
            kinds.extend((0..WAVES.len()).map(|wave| Column::Slow(cosine, function, wave)));
        }
    }
    for ripple in gear.ripple.iter().filter(|ripple| ripple.waves != 0.0) {
        kinds.extend([true, false].map(|sine| Column::Ripple(ripple.waves, sine, gear.ripple_sigma_n_m)));
    }
    let places = (0..worm.runs())
        .map(|run| worm.bins(run).per_cycle())
        .max()
        .unwrap_or(0) as usize;
    kinds.extend((0..places).map(|place| Column::Place(place, UNKNOWN_WAVES * gear.ripple_sigma_n_m)));
    let place_of = |phase: f64| (phase.rem_euclid(1.0) * places as f64) as usize;
    let columns: Vec<Vec<f64>> = kinds
        .par_iter()
        .map(|kind| {
            let of_run = |run: usize| {
                let bins = worm.bins(run);
                let first = bins.bins.first().map_or(0.0, |bin| bin.phase);
                let last = bins.bins.last().map_or(1.0, |bin| bin.phase);
                let of_bin = bins.bins.iter().map(|bin| {
                    let cosine = |m: usize| scale_n_m * weights[m] * (PI * m as f64 * bin.of_step).cos();
                    match *kind {
                        Column::All(m, function) => SHARED.sqrt() * cosine(m) * over_conditions[run][function],
                        Column::Own(cell, m, function) if bin.leading == cell => {
                            (1.0 - SHARED).sqrt() * cosine(m) * over_conditions[run][function]
                        }
                        Column::Own(..) => 0.0,
                        Column::Slow(m, function, wave) => {
                            let of_run = (bin.phase - first) / (last - first).max(1.0);
                            let wave_here = WAVES[wave] * (PI * (wave + 1) as f64 * of_run).cos();
                            SLOW * cosine(m) * wave_here * over_conditions[run][function]
                        }
                        Column::Place(place, amplitude) if place_of(bin.phase) == place => amplitude,
                        Column::Place(..) => 0.0,
                        Column::Ripple(waves, true, amplitude) => amplitude * (TAU * waves * bin.phase).sin(),
                        Column::Ripple(waves, false, amplitude) => amplitude * (TAU * waves * bin.phase).cos(),
                    }
                });
                worm.rows_of_torque(run, &of_bin.collect::<Vec<f64>>())
            };
            (0..worm.runs()).flat_map(of_run).collect()
        })
        .collect();
    let rows = columns.first().map_or(0, Vec::len);
    Some(DMatrix::from_iterator(
        rows,
        columns.len(),
        columns.into_iter().flatten(),
    ))
}

/// Torque on the cam while a tip slides, N m: its friction over the stroke, which a step makes in its part of a turn.
fn sliding_n_m(worm: &RecordedWorm<'_>) -> f64 {
    let nominal = &worm.scene.nominal;
    let of_worm = |physics: &worm_physics::Physics| {
        let contacts = physics.worm.contacts();
        let friction_n: f64 = contacts
            .iter()
            .map(|contact| contact.stiffness_n_per_m * contact.forward_bound_m)
            .sum();
        friction_n * physics.worm.stroke_m() / TAU // the mean over the cells times their number
    };
    nominal.iter().map(of_worm).sum::<f64>() / nominal.len() as f64
}
