//! What the model of the torque may be wrong by everywhere, whatever is missing from it.
//!
//! As of the positions (see [`crate::explain::search::discrepancy`]): a smooth unknown function that repeats with the phase, in part common
//! to all cells while they step, in part of each cell, with a slow part over the run. Its scale is a share of the torque with which a tip
//! slides. It is larger than that of the positions: between motor and cam are gears, whose friction no model knows to a per cent. Beside
//! it stands the ripple of the motor and its gears, which returns with the angle on every run: known waves of it as such, and others as
//! whatever each place in the cycle has of its own.

use crate::explain::search::bins::Bins;
use crate::explain::search::discrepancy::{SHARED, SLOW, WAVES, over_conditions, weights};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use worm_estimator::self_sensing::GearModel;
use worm_physics::Physics;

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

/// Columns of the torque at a scale, N m. `bins` and `conditions` are those of every run; `rows_of` makes rows of a run, whitened by the
/// noise, of the torque in each bin, N m.
pub(super) fn columns(
    (scale_n_m, gear): (f64, &GearModel),
    cells: usize,
    bins: &[&Bins],
    conditions: &[f64],
    rows_of: impl Fn(usize, &[f64]) -> Vec<f64> + Sync,
) -> DMatrix<f64> {
    let (over_conditions, weights) = (over_conditions(conditions), weights(COSINES));
    let mut kinds = Vec::new();
    for function in 0..over_conditions.first().map_or(0, Vec::len) {
        for cosine in 0..COSINES {
            kinds.push(Column::All(cosine, function));
            kinds.extend((0..cells).map(|cell| Column::Own(cell, cosine, function)));
            kinds.extend((0..WAVES.len()).map(|wave| Column::Slow(cosine, function, wave)));
        }
    }
    for ripple in gear.ripple.iter().filter(|ripple| ripple.waves != 0.0) {
        kinds.extend([true, false].map(|sine| Column::Ripple(ripple.waves, sine, gear.ripple_sigma_n_m)));
    }
    let places = bins.iter().map(|bins| bins.per_cycle()).max().unwrap_or(0) as usize;
    kinds.extend((0..places).map(|place| Column::Place(place, UNKNOWN_WAVES * gear.ripple_sigma_n_m)));
    let place_of = |phase: f64| (phase.rem_euclid(1.0) * places as f64) as usize;
    let columns: Vec<Vec<f64>> = kinds
        .par_iter()
        .map(|kind| {
            let of_run = |(run, bins): (usize, &&Bins)| {
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
                rows_of(run, &of_bin.collect::<Vec<f64>>())
            };
            bins.iter().enumerate().flat_map(of_run).collect()
        })
        .collect();
    let rows = columns.first().map_or(0, Vec::len);
    DMatrix::from_iterator(rows, columns.len(), columns.into_iter().flatten())
}

/// Its scale, N m, by the torque on the cam while a tip slides: its friction over the stroke, which a step makes in its part of a turn.
pub(super) fn scale_n_m(nominal: &[Physics]) -> f64 {
    let of_worm = |physics: &Physics| {
        let contacts = physics.worm.contacts();
        let friction_n: f64 = contacts
            .iter()
            .map(|contact| contact.stiffness_n_per_m * contact.forward_bound_m)
            .sum();
        friction_n * physics.worm.stroke_m() / TAU // the mean over the cells times their number
    };
    SHARE * (nominal.iter().map(of_worm).sum::<f64>() / nominal.len() as f64)
}

/// Root mean square of all of it, N m: what no effect has to close.
pub(super) fn rms_n_m(nominal: &[Physics], gear: &GearModel) -> f64 {
    let waves = gear.ripple.iter().filter(|ripple| ripple.waves != 0.0).count() as f64;
    let of_ripple_n_m = (waves + UNKNOWN_WAVES * UNKNOWN_WAVES).sqrt() * gear.ripple_sigma_n_m;
    scale_n_m(nominal).hypot(of_ripple_n_m)
}

/// Torque on the cam by the deformation of the stepping cell's pad, N m for each metre: by the mean stiffness, over the way of the cell for
/// each turn of the cam.
pub(super) fn of_deformation_n_m_per_m(nominal: &Physics) -> f64 {
    let contacts = nominal.worm.contacts().iter();
    let stiffness_n_per_m: f64 = contacts.map(|contact| contact.stiffness_n_per_m).sum();
    stiffness_n_per_m * nominal.worm.stroke_m() / TAU // the mean over the cells times their number
}
