//! The probability of the data under a hypothesis, everything that is free in it integrated over.
//!
//! Laplace's method at the fit: with residuals r, derivatives J and prior precision P at the values x,
//!
//! ```text
//! ln Z(κ) = −½ χ² − ½ ln det A + ½ ln det P + Σ ln π(θ) + ½ ln 2π − ½ ln det(1 + κ² Λ),   A = Jᵀ W J + P
//! ```
//! where the nuisances have normal priors P and each effect's parameters the density π at their values, W whitens by the discrepancy
//! at κ a₀, and χ² is that after one Gauss-Newton step with this W. All κ follow from the same products. At κ = 1 there is no step, for
//! that is where the fit ended: what a step still promises there is a bend of the model, and is taken off at every κ. Z is the mean
//! over κ: near one for a hypothesis that is meant to be right, and many times a₀ for one beside which something else is wrong.
//!
//! A nuisance with a limit is integrated up to it: near the limit part of its bell is missing, and on the limit what is left falls from
//! there. Both with everything else free, so that nothing is gained or lost where a nuisance comes off its limit.

use super::super::discrepancy::Discrepancy;
use super::super::fit::Fit;
use super::super::normal_probability::normal_probability;
use super::super::plant::{BodyMotion, Recorded};
use super::beside::Fitted;
use super::ln_sum::{ln_mean, ln_sum};
use super::repetition::Repetitions;
use super::structural_change::{Change, StructuralChanges};
use crate::least_squares::{cross, dot, prior_chi_squared, submatrix};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Scales of the discrepancy over a₀ with the widths that they stand for: half-normal of standard deviation 1, cut at 2. None is below
/// a half: no campaign shows that the model is right where it was not tried.
pub(in crate::explain) const USUAL: [(f64, f64); 4] = [(0.5, 0.75), (1.0, 0.5), (1.5, 0.5), (2.0, 0.25)];
/// The place of a₀ itself among them.
const UNIT: usize = 1;
/// Scales where something else is wrong.
const LARGE: [f64; 4] = [3.0, 6.0, 12.0, 25.0];

/// Weights of the usual scales, 1 in all.
pub(in crate::explain) fn usual_weights() -> [f64; 4] {
    let weights = USUAL.map(|(kappa, width)| width * (-0.5 * kappa * kappa).exp());
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// Logarithms of the probability of the data.
#[derive(Debug, Clone, Copy)]
pub(in crate::explain) struct Evidence {
    /// With a discrepancy of the usual size.
    pub usual: f64,
    /// With a large one: something else is wrong.
    pub large: f64,
    /// With each of the usual sizes, weighted.
    pub of_usual: [f64; 4],
    /// With a discrepancy of a₀ and something that changes in the middle of a run, and where that is most probable; none where it was not asked.
    pub changing: Option<(f64, Change)>,
    /// With a discrepancy of a₀ and something that repeats after some cycles, or of a₀ at most and a rhythm of the body; none where it was not
    /// asked.
    pub repeating: Option<f64>,
    /// With a discrepancy of a₀ at most and something irregular that moves the body; none where it was not asked.
    pub irregular: Option<f64>,
    /// With a law that nobody listed, and a discrepancy of the usual size; none where none was weighed.
    pub of_law: Option<f64>,
}

/// What may be in the data beside any hypothesis, and shows in time.
pub(in crate::explain) struct InTime {
    pub changes: StructuralChanges,
    pub repetitions: Repetitions,
}

impl InTime {
    /// Of a campaign.
    pub fn new(plant: &impl Recorded, discrepancy: &Discrepancy) -> Self {
        Self {
            changes: StructuralChanges::new(plant, discrepancy),
            repetitions: Repetitions::new(plant, discrepancy),
        }
    }
}

impl Evidence {
    /// With something else wrong: a large discrepancy, a change in the middle of a run or a law, a rhythm, or something irregular, each as
    /// probable before. Laws are weighed where nothing is asked about the time.
    pub fn other(&self) -> f64 {
        let changing = self.changing.map(|(ln, _)| ln);
        let kinds = [Some(self.large), changing, self.repeating, self.irregular, self.of_law];
        ln_sum(kinds.into_iter().flatten()) - 4.0_f64.ln()
    }

    /// The same with a law that nobody listed.
    pub fn with_law(self, of_law: Option<f64>) -> Self {
        Self { of_law, ..self }
    }

    /// The same with what the body does beside its gait: a rhythm from cycle to cycle or within the cycles, of which as much is expected, or
    /// something irregular.
    ///
    /// From cycle to cycle a canal that is not quite even makes small waves, which a discrepancy of a₀ has to be too small for. What the
    /// body does within the cycles is held against its own scatter alone, so only a discrepancy above a₀ might take its place.
    pub fn with_body_motion(self, motion: BodyMotion) -> Self {
        let at_most_unit = at_most_unit(&self.of_usual);
        let of_body: Vec<f64> = [
            motion
                .from_cycle_to_cycle
                .map(|ln_bayes| at_unit(&self.of_usual) + ln_bayes),
            motion.within_cycles.map(|ln_bayes| at_most_unit + ln_bayes),
        ]
        .into_iter()
        .flatten()
        .collect();
        let both: Vec<f64> = [self.repeating, ln_mean(&of_body)].into_iter().flatten().collect();
        Self {
            repeating: ln_mean(&both),
            irregular: motion.irregular.map(|ln_bayes| at_most_unit + ln_bayes),
            ..self
        }
    }

    /// The same where all data have become less probable by a factor e^`excess`.
    pub fn less(self, excess: f64) -> Self {
        Self {
            usual: self.usual - excess,
            large: self.large - excess,
            of_usual: self.of_usual.map(|of_scale| of_scale - excess),
            changing: self.changing.map(|(ln, change)| (ln - excess, change)),
            repeating: self.repeating.map(|ln| ln - excess),
            irregular: self.irregular.map(|ln| ln - excess),
            of_law: self.of_law.map(|ln| ln - excess),
        }
    }

    /// Posterior probabilities of the usual scales.
    pub fn scales(&self) -> [f64; 4] {
        self.of_usual.map(|of_scale| (of_scale - self.usual).exp())
    }

    /// The probability of the data with a discrepancy of a₀.
    pub fn at_unit_scale(&self) -> f64 {
        self.of_usual[UNIT]
    }

    /// Logarithm of the Bayes factor of a change in the middle of a run, with a discrepancy of a₀; none where it was not asked.
    pub fn ln_bayes_of_change(&self) -> Option<f64> {
        self.changing.map(|(changing, _)| changing - at_unit(&self.of_usual))
    }

    /// Whether something else wrong is more probable than a discrepancy of the usual size.
    pub fn is_open(&self) -> bool {
        self.other() >= self.usual
    }
}

/// The probability of the data with a discrepancy of a₀, of those with each usual size.
fn at_unit(of_usual: &[f64; 4]) -> f64 {
    of_usual[UNIT] - usual_weights()[UNIT].ln()
}

/// The same with one of a₀ at most.
fn at_most_unit(of_usual: &[f64; 4]) -> f64 {
    let weights = usual_weights();
    ln_sum(of_usual[..=UNIT].iter().copied()) - weights[..=UNIT].iter().sum::<f64>().ln()
}

/// The prior of an effect's parameter at its value: logarithm of the density, and its width.
pub(in crate::explain) type AtValue = (f64, f64);

/// The evidence of a fit with derivatives. `of_effect` gives the prior of each quantity that belongs to an effect.
pub(in crate::explain) fn evidence(
    discrepancy: &Discrepancy,
    in_time: Option<&InTime>,
    fit: &Fit,
    of_effect: &dyn Fn(usize) -> Option<AtValue>,
) -> Evidence {
    let quantities = fit.hypothesis.quantities();
    let open: Vec<usize> = (0..fit.at.len()).filter(|&quantity| !fit.at_limit(quantity)).collect();
    let count = open.len();
    let rows = fit.residual.len();
    let jacobian = DMatrix::from_iterator(
        rows,
        count,
        open.iter().flat_map(|&at| fit.jacobian[at].iter().copied()),
    );
    let along = discrepancy.products(&fit.residual);
    let along_jacobian = discrepancy.products_of(&jacobian);
    let mut unlimited = quantities.clone();
    let mut ln_priors = 0.0;
    for (quantity, here) in unlimited.iter_mut().enumerate() {
        match of_effect(quantity) {
            Some((ln_density, width)) => {
                // Its own value is the centre: only the width counts.
                (here.centre, here.sigma) = (fit.at[quantity], width);
                ln_priors += ln_density + 0.5 * TAU.ln();
            }
            None => ln_priors -= here.sigma.ln(),
        }
    }
    let square = dot(&fit.residual, &fit.residual, None) + prior_chi_squared(&unlimited, &fit.at);
    let whole = crate::least_squares::normal_matrix(&unlimited, &fit.jacobian, None);
    let normal = submatrix(&whole, &open);
    let slope = |at: usize| {
        let quantity = &unlimited[at];
        dot(&fit.jacobian[at], &fit.residual, None) + (fit.at[at] - quantity.centre) * quantity.sigma.powi(-2)
    };
    let factor = normal.clone().cholesky();
    if let Some(factor) = &factor {
        for at in (0..fit.at.len()).filter(|at| !open.contains(at)) {
            let shared = DVector::from_iterator(count, open.iter().map(|&other| whole[(other, at)]));
            let curvature = (whole[(at, at)] - shared.dot(&factor.solve(&shared))).max(1e-9 * whole[(at, at)]);
            ln_priors += ln_beyond_limit(slope(at).abs(), curvature) - 0.5 * TAU.ln();
        }
        let variance = factor.inverse();
        for (place, &at) in open.iter().enumerate().filter(|(_, at)| of_effect(**at).is_none()) {
            let (quantity, sigma) = (&unlimited[at], variance[(place, place)].sqrt());
            let above = normal_probability((quantity.max - fit.at[at]) / sigma);
            let below = normal_probability((fit.at[at] - quantity.min) / sigma);
            ln_priors += (above + below - 1.0).ln();
        }
    }
    let gradient = DVector::from_iterator(count, open.iter().map(|&at| slope(at)));
    let step_and_rest = |kappa: f64| {
        let change = DVector::from_iterator(
            along.len(),
            discrepancy.factors(kappa).into_iter().map(|factor| factor - 1.0),
        );
        let mut scaled = along_jacobian.clone();
        for (mut row, change) in scaled.row_iter_mut().zip(change.iter()) {
            row *= *change;
        }
        let normal = &normal + cross(&along_jacobian, &scaled);
        let gradient = &gradient + scaled.tr_mul(&along);
        let square = square
            + along
                .iter()
                .zip(change.iter())
                .map(|(along, change)| along * along * change)
                .sum::<f64>();
        let factor = normal.cholesky()?;
        let step = gradient.dot(&factor.solve(&gradient));
        let rest = -0.5 * square - 0.5 * factor.ln_determinant() + ln_priors - 0.5 * discrepancy.ln_det(kappa);
        Some((step, rest))
    };
    let bend = step_and_rest(1.0).map_or(0.0, |(step, _)| step);
    let at_scale =
        |kappa: f64| step_and_rest(kappa).map_or(f64::NEG_INFINITY, |(step, rest)| rest + 0.5 * (step - bend).max(0.0));
    let (changing, repeating) = in_time.zip(factor).map_or((None, None), |(in_time, normal)| {
        let fitted = Fitted {
            residual: &fit.residual,
            jacobian: &jacobian,
            normal: &normal,
            gradient: &gradient,
        };
        (in_time.changes.beside(&fitted), in_time.repetitions.beside(&fitted))
    });
    let weights = usual_weights();
    let of_usual: [f64; 4] = std::array::from_fn(|at| at_scale(USUAL[at].0) + weights[at].ln());
    let usual = ln_sum(of_usual);
    let at_unit = at_unit(&of_usual);
    Evidence {
        usual,
        changing: changing.map(|(ln_bayes, change)| (at_unit + ln_bayes, change)),
        repeating: repeating.map(|ln_bayes| at_unit + ln_bayes),
        large: ln_sum(LARGE.map(at_scale)) - (LARGE.len() as f64).ln(),
        of_usual,
        irregular: None,
        of_law: None,
    }
}

/// Logarithm of the integral of e^(−slope x − ½ curvature x²) over x > 0, within 6 %: Mills' ratio after Sampford.
fn ln_beyond_limit(slope: f64, curvature: f64) -> f64 {
    (2.0 / (slope + (slope * slope + 4.0 * curvature / FRAC_PI_2).sqrt())).ln()
}

#[cfg(test)]
mod tests {
    use super::super::super::hypothesis::Hypothesis;
    use super::super::super::parameter::{Free, What};
    use super::*;
    use crate::least_squares::{Estimate, Quantity};

    #[test]
    fn the_usual_scales_have_weights_of_one_in_all() {
        assert!((usual_weights().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    /// A nuisance x with prior N(0, s²) whose derivative is d, seen as y with noise 1: y is normal with covariance 1 + s² d dᵀ.
    #[test]
    fn of_a_linear_model_it_is_exact() {
        let (y, d, sigma) = ([1.2, -0.4, 0.7], [1.0, 0.5, -2.0], 0.8);
        let [yy, dd, dy] =
            [(&y, &y), (&d, &d), (&d, &y)].map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>());
        let variance = sigma * sigma;
        let expected = -0.5 * (yy - variance * dy * dy / (1.0 + variance * dd)) - 0.5 * (variance * dd).ln_1p();
        let free = Free {
            what: What::Nuisance(0),
            quantity: Quantity {
                sigma,
                ..Quantity::unlimited(1e-3)
            },
        };
        let x = dy / (dd + 1.0 / variance);
        let residual: Vec<f64> = y.iter().zip(&d).map(|(y, d)| d * x - y).collect();
        let estimate = Estimate {
            at: vec![x],
            residual,
            jacobian: vec![d.to_vec()],
            chi_squared: 0.0,
            converged: true,
        };
        let fit = Fit::new(&Hypothesis::new(&[free], &[]), estimate);
        let found = evidence(&Discrepancy::none(3), None, &fit, &|_| None);
        assert!((found.usual - expected).abs() < 1e-9, "{} for {expected}", found.usual);
        assert!(
            (found.large - expected).abs() < 1e-9,
            "no discrepancy, so no scale of it"
        );
    }

    /// A nuisance that cannot be negative, and another that does nearly the same: on the limit and near it the evidence is the integral
    /// over what is left of both.
    #[test]
    fn at_a_limit_it_is_the_integral_over_what_is_left() {
        let (along, limited, sigma) = ([4.0, 3.0, 1.0], [3.0, 4.0, -0.5], 0.5);
        let free = |number: usize, (min, max): (f64, f64)| Free {
            what: What::Nuisance(number),
            quantity: Quantity {
                sigma,
                min,
                max,
                ..Quantity::unlimited(1e-3)
            },
        };
        let hypothesis = Hypothesis::new(&[free(0, (-10.0, 10.0)), free(1, (0.0, 10.0))], &[]);
        for push in [-2.0, -0.5, 0.0, 0.3, 1.0, 3.0] {
            let y: Vec<f64> = along
                .iter()
                .zip(limited)
                .map(|(along, limited)| 0.3 * along + push * limited)
                .collect();
            let chi_squared = |at: [f64; 2]| {
                let rows = y.iter().zip(along.iter().zip(limited));
                let of_data: f64 = rows
                    .map(|(y, (along, limited))| (along * at[0] + limited * at[1] - y).powi(2))
                    .sum();
                of_data + (at[0] / sigma).powi(2) + (at[1] / sigma).powi(2)
            };
            // The best of the first for each of the second, and the best of those.
            let [aa, ay, al] = [&along[..], &y[..], &limited[..]].map(|other| dot(&along, other, None));
            let first = |second: f64| (ay - al * second) / (aa + sigma.powi(-2));
            let (nodes, to) = (20_000, 4.0);
            let width = to / f64::from(nodes);
            let seconds = || (0..=nodes).map(|node| f64::from(node) * width);
            let second = seconds()
                .min_by(|a, b| chi_squared([first(*a), *a]).total_cmp(&chi_squared([first(*b), *b])))
                .expect("some");
            // Over the first exactly, over the second by the trapezoidal rule.
            let of_first = (TAU / (aa + sigma.powi(-2))).sqrt();
            let density = |second: f64| (-0.5 * chi_squared([first(second), second])).exp() * of_first;
            let sum: f64 = seconds().map(density).sum::<f64>() - 0.5 * (density(0.0) + density(to));
            let expected = (sum * width / (TAU * sigma * sigma)).ln();
            let at = [first(second), second];
            let residual = y
                .iter()
                .zip(along.iter().zip(limited))
                .map(|(y, (along, limited))| along * at[0] + limited * at[1] - y);
            let estimate = Estimate {
                at: at.to_vec(),
                residual: residual.collect(),
                jacobian: vec![along.to_vec(), limited.to_vec()],
                chi_squared: 0.0,
                converged: true,
            };
            let found = evidence(&Discrepancy::none(3), None, &Fit::new(&hypothesis, estimate), &|_| None);
            assert!(
                (found.usual - expected).abs() < 0.06,
                "{push}: {} for {expected}",
                found.usual
            );
        }
    }
}
