//! Slopes that a campaign states wrongly.
//!
//! A stated slope is believed within its prior, and to see it as wrong by more is no effect of the worm. Of a slope that is far off, some effect
//! makes the best, and then it is sure. So the usual mistakes are tried in place of an effect: one run's slope is any, radians or per cent
//! in place of degrees, the sign, two runs exchanged. What leaves no more than the best effect is told.

use super::nuisance::Nuisance;
use super::recorded_worm::WormProblem;
use crate::explain::search::fit::Fit;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::plant::Plant;

/// A free slope: standard deviation and step of derivatives, degrees.
const FREE_DEG: (f64, f64) = (30.0, 0.1);
/// Furthest from the level that it may be, and where its fit may begin, degrees apart.
const STEEPEST_DEG: f64 = 85.0;
const APART_DEG: f64 = 3.4;
/// Errors below this are within what `slope-error` is for, degrees; and in standard errors.
const LEAST_DEG: f64 = 2.0;
const LEAST_SIGMAS: f64 = 5.0;
/// Share of what the best effect improves the fit by that a mistake must reach; and the least improvement.
const AS_GOOD: f64 = 0.9;
const LEAST_IMPROVEMENT: f64 = 60.0;
/// Mistakes that are fitted, of those that look best before.
const FITTED: usize = 3;

/// What was done wrong, of runs counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mistake {
    OneRun(usize),
    Radians,
    PerCent,
    Sign,
    Exchanged(usize, usize),
}

impl Mistake {
    fn all(runs: usize) -> Vec<Self> {
        let exchanged = (0..runs).flat_map(|one| (one + 1..runs).map(move |other| Self::Exchanged(one, other)));
        let single = (0..runs).map(Self::OneRun);
        let of_all = [Self::Radians, Self::PerCent, Self::Sign];
        of_all.into_iter().chain(exchanged).chain(single).collect()
    }

    /// The slope that was meant, degrees, of the slopes as they are stated.
    fn meant_deg(self, stated_deg: &[f64], run: usize) -> f64 {
        let stated = stated_deg[run];
        match self {
            Self::Radians => stated.to_degrees(),
            Self::PerCent => (stated / 100.0).atan().to_degrees(),
            Self::Sign => -stated,
            Self::Exchanged(one, other) if run == one => stated_deg[other],
            Self::Exchanged(one, other) if run == other => stated_deg[one],
            Self::OneRun(_) | Self::Exchanged(..) => stated,
        }
    }
}

/// A mistake that explains what an effect was to explain, in words; none where no mistake does. `best` is the best hypothesis with effects.
pub(in crate::explain) fn misstated(problem: &WormProblem<'_, '_>, recalibrated: &Fit, best: &Fit) -> Option<String> {
    let observed = &problem.plant.scene.observed;
    let stated_deg: Vec<f64> = observed.iter().map(|observed| observed.run.slope_deg).collect();
    if stated_deg.len() < 2 {
        return None;
    }
    let base = &recalibrated.hypothesis;
    let mut starts: Vec<(Mistake, Fit)> = Mistake::all(stated_deg.len())
        .into_iter()
        .map(|mistake| {
            let hypothesis = under(base, mistake, &stated_deg);
            let at = match mistake {
                Mistake::OneRun(run) => nearest(problem, &hypothesis, run),
                _ => hypothesis.neutral(),
            };
            (mistake, problem.evaluate(&hypothesis, at))
        })
        .filter(|(_, fit)| fit.chi_squared.is_finite())
        .collect();
    starts.sort_by(|a, b| a.1.chi_squared.total_cmp(&b.1.chi_squared));
    starts.truncate(FITTED);
    let needed = LEAST_IMPROVEMENT.max(AS_GOOD * (recalibrated.chi_squared - best.chi_squared));
    let (mistake, mut fit) = starts
        .into_iter()
        .map(|(mistake, start)| (mistake, problem.fit(&start.hypothesis, start.at, None)))
        .filter(|(_, fit)| recalibrated.chi_squared - fit.chi_squared >= needed)
        .min_by(|a, b| a.1.chi_squared.total_cmp(&b.1.chi_squared))?;
    problem.compute_jacobian(&mut fit);
    let name = |run: usize| observed[run].run.recording.source.display().to_string();
    in_words(mistake, &fit, &stated_deg, name)
}

/// The recalibrated model with the slopes that were meant.
fn under(base: &Hypothesis, mistake: Mistake, stated_deg: &[f64]) -> Hypothesis {
    let mut hypothesis = base.clone();
    for free in &mut hypothesis.free {
        let Some(Nuisance::SlopeOf(run)) = Nuisance::of(free.what) else {
            continue;
        };
        let (quantity, stated) = (&mut free.quantity, stated_deg[run]);
        if mistake == Mistake::OneRun(run) {
            (quantity.sigma, quantity.step) = FREE_DEG;
            (quantity.min, quantity.max) = (-STEEPEST_DEG - stated, STEEPEST_DEG - stated);
        } else {
            let shift = mistake.meant_deg(stated_deg, run) - stated;
            quantity.centre += shift;
            quantity.min += shift;
            quantity.max += shift;
        }
    }
    hypothesis
}

/// The nominal values but for a run's slope, which is what comes nearest to this run.
fn nearest(problem: &WormProblem<'_, '_>, hypothesis: &Hypothesis, run: usize) -> Vec<f64> {
    let neutral = hypothesis.neutral();
    let slope = Nuisance::SlopeOf(run).what();
    let Some(at) = hypothesis.free.iter().position(|free| free.what == slope) else {
        return neutral;
    };
    let quantity = &hypothesis.free[at].quantity;
    let trials = ((quantity.max - quantity.min) / APART_DEG) as usize;
    (0..=trials)
        .map(|trial| {
            let mut values = neutral.clone();
            values[at] = quantity.min + APART_DEG * trial as f64;
            let residuals = problem.plant.predict(run, hypothesis, &values).residuals;
            (
                residuals.iter().map(|residual| residual * residual).sum::<f64>(),
                values,
            )
        })
        .filter(|(squares, _)| squares.is_finite())
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(neutral, |(_, values)| values)
}

fn in_words(mistake: Mistake, fit: &Fit, stated_deg: &[f64], name: impl Fn(usize) -> String) -> Option<String> {
    let as_well = "would explain these data as well: check slope_deg before you believe anything else";
    Some(match mistake {
        Mistake::OneRun(run) => {
            let slope = Nuisance::SlopeOf(run).what();
            let at = fit.hypothesis.free.iter().position(|free| free.what == slope)?;
            let (off_deg, sigma_deg) = (fit.at[at], fit.sigmas()[at]);
            if off_deg.abs() < LEAST_DEG.max(LEAST_SIGMAS * sigma_deg) {
                return None;
            }
            format!(
                "a slope of {:.1} ± {:.1}° of {}, in place of the {}° that are stated, {as_well}",
                stated_deg[run] + off_deg,
                sigma_deg.max(0.1),
                name(run),
                stated_deg[run]
            )
        }
        Mistake::Radians => format!("slopes in radians {as_well}"),
        Mistake::PerCent => format!("slopes in per cent {as_well}"),
        Mistake::Sign => format!("slopes of the other sign {as_well}"),
        Mistake::Exchanged(one, other) => {
            format!("the slopes of {} and {} exchanged {as_well}", name(one), name(other))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::misstated;
    use crate::explain::fixture::{Campaign, Truth, record};
    use crate::explain::search::find::Evidence;
    use crate::explain::search::hypothesis::Hypothesis;
    use crate::explain::search::parameter::Hypothesised;
    use crate::explain::search::plant::Plant;
    use crate::explain::search::recalibrate::{measure_noise, recalibrate};
    use crate::explain::worm::prepare::prepare;
    use crate::explain::worm::recorded_worm::RecordedWorm;
    use crate::explain::{Options, RecordedRun};
    use worm_estimator::config::Config;
    use worm_physics::effect::named;

    /// What is said of a campaign that states other slopes than it has, beside the right effect where there is one.
    fn said(truth_deg: &[f64], stated_deg: &[f64], effect: Truth<'_>) -> Option<String> {
        let campaign = Campaign {
            slopes_deg: truth_deg.to_vec(),
            ..Campaign::default()
        };
        let recordings = record(&campaign, effect, 7);
        let with_slopes = recordings.iter().zip(stated_deg);
        let runs: Vec<RecordedRun<'_>> = with_slopes
            .map(|(recording, &slope_deg)| RecordedRun::at_slope(recording, slope_deg))
            .collect();
        let scene = prepare(&runs, &Config::default(), Evidence::Positions).expect("a worm");
        let mut worm = RecordedWorm::new(scene);
        let base = Hypothesis::new(&worm.nuisances(), &[]);
        let at = measure_noise(&mut worm, &base).expect("a worm");
        let (problem, _, recalibrated) = recalibrate(&worm, &base, at, Options::default().discrepancy);
        let best = effect.map(|(name, cell, values)| {
            let effect = named(name).expect("of the library");
            let hypothesis = Hypothesis::new(&worm.nuisances(), &[Hypothesised::throughout(effect, cell)]);
            let mut at = hypothesis.neutral();
            let first = at.len() - values.len();
            at[first..].copy_from_slice(values);
            problem.fit(&hypothesis, at, None)
        });
        misstated(&problem, &recalibrated, best.as_ref().unwrap_or(&recalibrated))
    }

    #[test]
    fn a_wrong_slope_is_suspected_and_a_right_one_is_not() {
        let per_cent = |slope_deg: f64| 100.0 * slope_deg.to_radians().tan();
        for (truth_deg, stated_deg, words) in [
            (
                [0.0, 30.0, 40.0],
                [0.0, 30_f64.to_radians(), 40_f64.to_radians()],
                "radians",
            ),
            ([0.0, 10.0, 20.0], [0.0, per_cent(10.0), per_cent(20.0)], "per cent"),
            ([0.0, 30.0, 20.0], [0.0, -30.0, -20.0], "sign"),
            ([0.0, 30.0, 20.0], [0.0, 24.0, 20.0], "a slope of 30."),
            ([0.0, 20.0, 35.0], [20.0, 0.0, 35.0], "exchanged"),
        ] {
            let said = said(&truth_deg, &stated_deg, None);
            assert!(
                said.as_ref().is_some_and(|text| text.contains(words)),
                "{words}: {said:?}"
            );
        }
        let clamped = Some(("unequal-clamping", Some(1), &[0.7][..]));
        assert_eq!(said(&[0.0, 20.0, 35.0], &[0.0, 20.0, 35.0], clamped), None);
    }
}
