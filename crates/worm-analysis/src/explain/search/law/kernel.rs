//! Gaussian processes over an axis: how smooth a law is, and whether it repeats.
//!
//! k = σ² (c + (1 − c) exp(−d²/2ℓ²)), where it does not repeat, and σ² (c + (1 − c) exp(−2 sin²(πd/p)/ℓ²)), where it does: a part c of the
//! variance is a value that is the same everywhere. Of two axes the kernels are multiplied.

use super::offer::Offer;
use nalgebra::DMatrix;
use std::f64::consts::PI;

/// Smoothness of a law that does not repeat, on a scale where the axis is about 1 wide, and of one that does.
const LENGTHS: [f64; 4] = [0.08, 0.2, 0.5, 1.2];
const LENGTHS_OF_PERIOD: [f64; 2] = [0.6, 1.2];
/// Points within a period, and periods tried from one to the next as a fraction of what the axis can tell apart.
pub(super) const POINTS_OF_PERIOD: usize = 16;
const APART: f64 = 0.35;
/// Least variance of a direction of a process, as a fraction of the largest.
const NEGLIGIBLE: f64 = 1e-9;

/// A form of a law before the data are seen.
#[derive(Debug, Clone)]
pub(super) struct Prior {
    /// The period with the points within one, in the axis's unit; none for the offered grid.
    pub period: Option<(f64, Vec<f64>)>,
    /// Root of the covariance of the values: `[point of its own grid][direction]`.
    pub root: DMatrix<f64>,
    /// The same at the points of the offered grid.
    pub on_grid: DMatrix<f64>,
}

/// All forms that a law may have: those that do not repeat, and those that do.
pub(super) fn priors(offer: &Offer) -> [Vec<Prior>; 2] {
    let mut steady = Vec::new();
    for sigma in offer.sigmas {
        for length in LENGTHS {
            if offer.period.is_some() && length < 0.15 {
                continue;
            }
            let root = root(&covariance(offer, sigma, length));
            steady.push(Prior {
                period: None,
                on_grid: root.clone(),
                root,
            });
        }
    }
    let Some([shortest, longest]) = offer.periods else {
        return [steady, Vec::new()];
    };
    let grid = &offer.shape.axes[0].1;
    let (first, width) = (grid[0], grid[grid.len() - 1] - grid[0]);
    let mut repeating = Vec::new();
    let mut frequency = longest.recip();
    while frequency <= shortest.recip() {
        let period = frequency.recip();
        repeating.extend(of_period(offer, first, period));
        frequency += APART / width;
    }
    [steady, repeating]
}

/// Every form with one period.
fn of_period(offer: &Offer, first: f64, period: f64) -> Vec<Prior> {
    let within: Vec<f64> = (0..POINTS_OF_PERIOD)
        .map(|point| first + period * point as f64 / POINTS_OF_PERIOD as f64)
        .collect();
    let spread = spread(&offer.shape.axes[0].1, &within, period);
    let mut all = Vec::new();
    for sigma in offer.sigmas {
        for length in LENGTHS_OF_PERIOD {
            let covariance = DMatrix::from_fn(POINTS_OF_PERIOD, POINTS_OF_PERIOD, |row, column| {
                let sine = (PI * (row as f64 - column as f64) / POINTS_OF_PERIOD as f64).sin();
                variance(offer, sigma, (-2.0 * (sine / length).powi(2)).exp())
            });
            let root = root(&covariance);
            all.push(Prior {
                period: Some((period, within.clone())),
                on_grid: &spread * &root,
                root,
            });
        }
    }
    all
}

/// The values at the points of a grid by those at points within a period, linear between them.
fn spread(grid: &[f64], within: &[f64], period: f64) -> DMatrix<f64> {
    let count = within.len();
    let mut spread = DMatrix::zeros(grid.len(), count);
    for (row, at) in grid.iter().enumerate() {
        let place = (at - within[0]).rem_euclid(period) / period * count as f64;
        let low = (place as usize).min(count - 1);
        let part = place - low as f64;
        spread[(row, low)] += 1.0 - part;
        spread[(row, (low + 1) % count)] += part;
    }
    spread
}

/// Covariance of the values at the points of the offered grid.
fn covariance(offer: &Offer, sigma: f64, length: f64) -> DMatrix<f64> {
    let widths: Vec<usize> = offer.scaled.iter().map(Vec::len).collect();
    let points = offer.shape.centre.len();
    let along = |axis: usize, one: usize, other: usize| {
        let apart = offer.scaled[axis][one] - offer.scaled[axis][other];
        match offer.period.filter(|_| axis == 0) {
            Some(period) => (-2.0 * ((PI * apart / period).sin() / (2.0 * length)).powi(2)).exp(),
            None => (-0.5 * (apart / length).powi(2)).exp(),
        }
    };
    DMatrix::from_fn(points, points, |row, column| {
        let second = widths.get(1).copied().unwrap_or(1);
        let mut product = along(0, row / second, column / second);
        if widths.len() > 1 {
            product *= along(1, row % second, column % second);
        }
        variance(offer, sigma, product)
    })
}

/// Covariance of two values with a scale and a likeness in what changes along the axis.
fn variance(offer: &Offer, sigma: f64, alike: f64) -> f64 {
    sigma * sigma * (offer.constant + (1.0 - offer.constant) * alike)
}

/// A root of a covariance: its product with its transpose is the covariance.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = covariance.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let kept: Vec<usize> = (0..eigen.eigenvalues.len())
        .filter(|&at| eigen.eigenvalues[at] > NEGLIGIBLE * largest)
        .collect();
    DMatrix::from_fn(covariance.nrows(), kept.len(), |row, column| {
        eigen.eigenvectors[(row, kept[column])] * eigen.eigenvalues[kept[column]].sqrt()
    })
}
