//! Whether the body moves more irregularly from cycle to cycle than tips make it.
//!
//! No tip holds quite the same in every cycle, so the body walks at random about its mean advance, and its noise is measured by that
//! ([`super::noise`]). What a corrugated canal does to it, a cable that tugs, or gravity that sways out of step with the gait would pass
//! for the same walk. But tips are known to differ from one cycle to the next by some hundredth of their friction. So the walk that a fit
//! leaves is stated as the scatter of the tips' friction that it would take, and the probability of that much under what tips do is
//! held against its probability where something irregular moves the body. Both are log-normal.

use super::noise::RunNoise;
use super::nuisance::Nuisance;
use super::predict::Scene;
use super::predicted::Predicted;
use super::recorded_worm::RecordedWorm;
use super::residual::Residual;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::parameter::Free;
use crate::least_squares::Quantity;

/// Standard deviation of the logarithm of what tips do: a factor of two.
const USUAL: f64 = std::f64::consts::LN_2;
/// The same where something irregular moves the body, and how much more that is than tips do: ten times, give or take a factor of three.
const IRREGULAR: f64 = 1.1;
const TIMES: f64 = 10.0;
/// Change of the logarithm of a tip's friction by which derivatives are taken.
const STEP: f64 = 0.01;
/// Least scatter that a walk is taken for, as a fraction of the usual one: below it nothing is measured but the noise of the camera.
const LEAST: f64 = 0.1;

/// Logarithm of the Bayes factor of something irregular that moves the body against tips that scatter as usual, by what a fit leaves; none
/// where nobody saw the body.
pub(in crate::explain) fn ln_bayes(
    worm: &RecordedWorm<'_>,
    predicted: &[Option<Predicted>],
    usual: f64,
) -> Option<f64> {
    friction_scatter(worm, predicted).map(|scatter| ln_bayes_of(scatter / usual))
}

/// By what is measured over what is usual.
fn ln_bayes_of(ratio: f64) -> f64 {
    let ln_density = |times: f64, sigma: f64| -0.5 * ((ratio.max(LEAST) / times).ln() / sigma).powi(2) - sigma.ln();
    ln_density(TIMES, IRREGULAR) - ln_density(1.0, USUAL)
}

/// By how much of its friction each tip would have to scatter from cycle to cycle to move the body as irregularly as a fit leaves it; the
/// geometric mean over the runs whose body was seen.
pub(in crate::explain) fn friction_scatter(worm: &RecordedWorm<'_>, predicted: &[Option<Predicted>]) -> Option<f64> {
    let of_run = |(run, predicted): (usize, &Option<Predicted>)| {
        let (observed, bins) = (&worm.scene.observed[run], &worm.bins[run]);
        let residual = Residual::binned(observed, bins, predicted.as_ref()?);
        let noise = RunNoise::measure(observed, bins, &residual);
        Some((noise.astray_per_cycle_m() / worm.advance_by_friction_m[run]).ln())
    };
    let all: Vec<f64> = predicted.iter().enumerate().filter_map(of_run).collect();
    (!all.is_empty()).then(|| (all.iter().sum::<f64>() / all.len() as f64).exp())
}

/// How far a cycle's advance in each run goes with the friction of the tips: the root of the sum over the tips of the squares of its
/// derivatives by the logarithm of their friction, m. No less than the largest deformation of a tip, `least_m`: on a slope on which one
/// hardly slides the derivative is small, and what a tip does that holds a little less is not.
pub(in crate::explain) fn advance_by_friction_m(
    scene: &Scene<'_>,
    least_m: f64,
    (hypothesis, at): (&Hypothesis, &[f64]),
) -> Vec<f64> {
    let of_run = |run: usize| {
        let observed = &scene.observed[run];
        let advance_m = |hypothesis: &Hypothesis, at: &[f64]| {
            let predicted = scene.predict(run, hypothesis, at);
            predicted.map(|predicted| predicted.advance_m(observed))
        };
        let here_m = advance_m(hypothesis, at);
        let of_tip = |tip: usize| {
            let mut changed = (hypothesis.clone(), at.to_vec());
            changed.0.free.push(Free {
                what: Nuisance::FrictionOf(tip).what(),
                quantity: Quantity::unlimited(STEP),
            });
            changed.1.push(STEP);
            Some((advance_m(&changed.0, &changed.1)? - here_m?) / STEP)
        };
        let square_m2: f64 = (0..observed.cells()).filter_map(of_tip).map(|m| m * m).sum();
        square_m2.sqrt().max(least_m)
    };
    (0..scene.observed.len()).map(of_run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::fixture::{Campaign, WALK_M, hypothesis, record, taken, worm};
    use crate::explain::search::plant::{Plant, Recorded};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// The scatter that the right model leaves of a worm whose body goes astray by so many metres a cycle, so many times in each, and how far
    /// the advance of each run goes with the friction.
    fn scatter(astray_m: f64, times: f64, seed: u64) -> (f64, Vec<f64>) {
        let campaign = Campaign::default();
        let mut recordings = record(&campaign, None, seed);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        for recording in &mut recordings {
            let (samples, pushes) = (recording.time_s.len(), campaign.simulation.cycles * times);
            let mut gone_m = vec![0.0; pushes as usize + 1];
            for push in 1..gone_m.len() {
                let of_one: f64 = StandardNormal.sample(&mut rng);
                gone_m[push] = gone_m[push - 1] + astray_m / times.sqrt() * of_one;
            }
            for cell_m in &mut recording.position_m {
                for (sample, at_m) in cell_m.iter_mut().enumerate() {
                    *at_m += gone_m[(sample as f64 / samples as f64 * pushes) as usize];
                }
            }
        }
        let worm = worm(&recordings, &campaign, &hypothesis(None));
        let found = friction_scatter(&worm, &worm.predictions(&taken(&worm, hypothesis(None))));
        (found.expect("the body is seen"), worm.advance_by_friction_m)
    }

    #[test]
    fn a_walk_is_stated_as_the_scatter_of_friction_that_it_takes() {
        for (astray_m, times) in [(0.0, 1.0), (1e-4, 1.0), (5e-4, 1.0), (1e-4, 23.0), (5e-4, 23.0)] {
            let of_seed = |seed: u64| {
                let (found, by_friction_m) = scatter(astray_m, times, seed);
                let of_run = |by_m: &f64| (WALK_M.hypot(astray_m) / by_m).ln();
                let expected = by_friction_m.iter().map(of_run).sum::<f64>() / by_friction_m.len() as f64;
                found.ln() - expected
            };
            let off = (0.125 * (0..8).map(of_seed).sum::<f64>()).exp();
            // The larger of two medians of the squares of few cycles.
            assert!(
                (0.67..1.5).contains(&off),
                "{astray_m} m, {times} times in a cycle: off by a factor of {off}"
            );
        }
    }

    /// On the level the advance of n equal cells is the stroke less 2 δmax n/(n−1) without any damping, so that it falls with every tip's
    /// friction by 2 δmax/(n−1).
    #[test]
    fn the_advance_goes_with_friction_as_in_closed_form() {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let worm = worm(&recordings, &campaign, &hypothesis(None));
        let (largest_m, cells) = (worm.discrepancy_unit(), worm.channels() as f64);
        let closed_form_m = 2.0 * largest_m / (cells - 1.0) * cells.sqrt();
        let ratio = worm.advance_by_friction_m[0] / closed_form_m;
        // The body of the recorded worm is damped.
        assert!((0.8..1.2).contains(&ratio), "{ratio}");
    }

    #[test]
    fn tips_that_scatter_as_usual_are_no_evidence_and_ten_times_as_much_is() {
        let evidence = [0.01, 1.0, 3.0, 8.0, 12.0, 30.0].map(ln_bayes_of);
        assert!(evidence.windows(2).all(|pair| pair[0] <= pair[1]), "{evidence:?}");
        assert!(evidence[1] < -1.0 && evidence[2] < 1.0, "{evidence:?}");
        assert!(evidence[3] > 3.0 && evidence[5] > 9.0, "{evidence:?}");
    }
}
