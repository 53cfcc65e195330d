//! Conditions that a campaign states wrongly: one run's slope is any, radians or per cent in place of degrees, the sign, two runs exchanged;
//! or friction that was another in one run, where it is taken to be the same in all.

use super::nuisance::Nuisance;
use super::recorded_worm::RecordedWorm;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::misstated::Misstated;
use crate::explain::search::misstatement::{Misstatement, Sort};
use crate::explain::search::parameter::Free;
use crate::explain::search::plant::Plant;
use rayon::prelude::*;

/// A free slope: standard deviation and step of derivatives, degrees.
const FREE_DEG: (f64, f64) = (30.0, 0.1);
/// Furthest from the level that it may be, and where its fit may begin, degrees apart.
const STEEPEST_DEG: f64 = 85.0;
const APART_DEG: f64 = 3.4;
/// Errors below this are within what `slope-error` is for, degrees.
const LEAST_DEG: f64 = 2.0;
/// No slope is known better by a crawl, degrees.
const LEAST_SIGMA_DEG: f64 = 0.1;
/// Logarithm of a factor on the friction in one run: standard deviation, distance of the limits, step of derivatives; and how far apart
/// its fit may begin. A canal that was wiped or has got wet changes friction by some tens of per cent.
const FRICTION_IN: (f64, f64, f64) = (0.25, 1.0, 2e-3);
const FRICTION_APART: f64 = 0.1;
/// Differences below this are everywhere, and no factor is known better by a crawl.
const LEAST_FRICTION: f64 = 0.05;
const LEAST_SIGMA_FRICTION: f64 = 0.005;

const CHECK_SLOPES: &str = "check slope_deg before you believe anything else";
const RECORD_AGAIN: &str = "record each slope twice, in turn, before you believe anything else";

/// What was done wrong, of runs counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mistake {
    OneRun(usize),
    Radians,
    PerCent,
    Sign,
    Exchanged(usize, usize),
    OtherFriction(usize),
}

impl Mistake {
    fn all(runs: usize) -> Vec<Self> {
        let exchanged = (0..runs).flat_map(|one| (one + 1..runs).map(move |other| Self::Exchanged(one, other)));
        let single = (0..runs).map(Self::OneRun);
        let friction = (0..runs).map(Self::OtherFriction);
        let of_all = [Self::Radians, Self::PerCent, Self::Sign];
        of_all
            .into_iter()
            .chain(exchanged)
            .chain(single)
            .chain(friction)
            .collect()
    }

    fn sort(self) -> Sort {
        match self {
            Self::Radians | Self::PerCent | Self::Sign | Self::Exchanged(..) => Sort::Written,
            Self::OneRun(_) => Sort::OfOneRun,
            Self::OtherFriction(_) => Sort::UnlikeOthers,
        }
    }

    /// The run and the nuisance of which it says that it is any, and the least change that makes it a mistake.
    fn any(self) -> Option<(usize, Nuisance, f64)> {
        match self {
            Self::OneRun(run) => Some((run, Nuisance::SlopeOf(run), LEAST_DEG)),
            Self::OtherFriction(run) => Some((run, Nuisance::FrictionIn(run), LEAST_FRICTION)),
            _ => None,
        }
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
            Self::OneRun(_) | Self::OtherFriction(_) | Self::Exchanged(..) => stated,
        }
    }
}

/// Slopes of the runs as they are stated, degrees.
fn stated_deg(worm: &RecordedWorm<'_>) -> Vec<f64> {
    worm.scene
        .observed
        .iter()
        .map(|observed| observed.run.slope_deg)
        .collect()
}

/// Every mistake as a hypothesis with the nuisances of `base`; none of a single run, of which every slope would explain something.
pub(super) fn misstatements(worm: &RecordedWorm<'_>, base: &Hypothesis) -> Vec<Misstatement> {
    let stated_deg = stated_deg(worm);
    if stated_deg.len() < 2 {
        return Vec::new();
    }
    let all = Mistake::all(stated_deg.len()).into_iter().enumerate();
    all.map(|(what, mistake)| {
        let hypothesis = under(base, mistake, &stated_deg);
        let any = mistake
            .any()
            .and_then(|(run, nuisance, least)| Some((run, hypothesis.place_of(nuisance.what())?, least)));
        let (start, must_differ) = match any {
            Some((run, place, least)) => (nearest(worm, &hypothesis, run, place), Some((place, least))),
            None => (hypothesis.neutral(), None),
        };
        Misstatement {
            sort: mistake.sort(),
            what,
            hypothesis,
            start,
            must_differ,
        }
    })
    .collect()
}

/// The recalibrated model under the conditions that were meant.
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
    if let Mistake::OtherFriction(run) = mistake {
        hypothesis.free.push(Nuisance::FrictionIn(run).free(FRICTION_IN));
    }
    hypothesis
}

/// The nominal values but for what may be any in a run, which is what comes nearest to this run.
fn nearest(worm: &RecordedWorm<'_>, hypothesis: &Hypothesis, run: usize, place: usize) -> Vec<f64> {
    let neutral = hypothesis.neutral();
    let Free { what, quantity } = &hypothesis.free[place];
    let apart = match Nuisance::of(*what) {
        Some(Nuisance::SlopeOf(_)) => APART_DEG,
        _ => FRICTION_APART,
    };
    let trials = ((quantity.max - quantity.min) / apart) as usize;
    let all: Vec<(f64, Vec<f64>)> = (0..=trials)
        .into_par_iter()
        .map(|trial| {
            let mut values = neutral.clone();
            values[place] = quantity.min + apart * trial as f64;
            let residuals = worm.predict(run, hypothesis, &values).residuals;
            (
                residuals.iter().map(|residual| residual * residual).sum::<f64>(),
                values,
            )
        })
        .filter(|(squares, _)| squares.is_finite())
        .collect();
    let best = all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(neutral, |(_, values)| values)
}

/// What was meant, in words, and what to do about it.
pub(in crate::explain) fn in_words(worm: &RecordedWorm<'_>, misstated: &Misstated) -> (String, &'static str) {
    let stated_deg = stated_deg(worm);
    let name = |run: usize| worm.scene.observed[run].run.recording.source.display().to_string();
    let fit = &misstated.fit;
    let mistake = Mistake::all(stated_deg.len())[misstated.what];
    let fitted = mistake
        .any()
        .and_then(|(_, nuisance, _)| fit.hypothesis.place_of(nuisance.what()));
    let (value, sigma) = fitted.map_or((f64::NAN, f64::NAN), |place| (fit.at[place], fit.sigmas()[place]));
    let what = match mistake {
        Mistake::OneRun(run) => {
            format!(
                "a slope of {:.1} ± {:.1}° of {}, in place of the {}° that are stated",
                stated_deg[run] + value,
                sigma.max(LEAST_SIGMA_DEG),
                name(run),
                stated_deg[run]
            )
        }
        Mistake::Radians => "slopes that are stated in radians".to_owned(),
        Mistake::PerCent => "slopes that are stated in per cent".to_owned(),
        Mistake::Sign => "slopes of the other sign".to_owned(),
        Mistake::Exchanged(one, other) => format!("the slopes of {} and {} exchanged", name(one), name(other)),
        Mistake::OtherFriction(run) => format!(
            "a friction in {} that is {:.2} ± {:.2} times that in the other recordings",
            name(run),
            value.exp(),
            (value.exp() * sigma).max(LEAST_SIGMA_FRICTION)
        ),
    };
    let what_to_do = match mistake {
        Mistake::OtherFriction(_) => RECORD_AGAIN,
        _ => CHECK_SLOPES,
    };
    (what, what_to_do)
}

#[cfg(test)]
mod tests {
    use super::{FRICTION_IN, Nuisance, in_words};
    use crate::experiment::Simulation;
    use crate::explain::answer::Calibrated;
    use crate::explain::fixture::{Campaign, hypothesis, record_under};
    use crate::explain::search::find::Evidence;
    use crate::explain::search::hypothesis::Hypothesis;
    use crate::explain::search::judge::evidence::evidence;
    use crate::explain::search::judge::prior;
    use crate::explain::search::judgement::Judge;
    use crate::explain::search::misstated::misstated;
    use crate::explain::search::plant::Plant;
    use crate::explain::search::recalibrate::{measure_noise, recalibrate};
    use crate::explain::worm::prepare::prepare;
    use crate::explain::worm::recorded_worm::RecordedWorm;
    use crate::explain::{Options, RecordedRun, explain};
    use worm_estimator::config::Config;

    /// What is most probably misstated in a campaign that states other slopes than it has, in words, and by how many nats that explains the
    /// data better than nothing and than the right effects; none where no mistake explains anything.
    fn found(truth_deg: &[f64], stated_deg: &[f64], truth: &(Hypothesis, Vec<f64>)) -> Option<(String, f64, f64)> {
        let campaign = Campaign {
            slopes_deg: truth_deg.to_vec(),
            ..Campaign::default()
        };
        let recordings = record_under(&campaign, truth, 7);
        let with_slopes = recordings.iter().zip(stated_deg);
        let runs: Vec<RecordedRun<'_>> = with_slopes
            .map(|(recording, &slope_deg)| RecordedRun::at_slope(recording, slope_deg))
            .collect();
        let scene = prepare(&runs, &Config::default(), Evidence::Positions).expect("a worm");
        let mut worm = RecordedWorm::new(scene);
        let base = Hypothesis::new(&worm.nuisances(), &[]);
        let at = measure_noise(&mut worm, &base).expect("a worm");
        let (problem, discrepancy, recalibrated) = recalibrate(&worm, &base, at, Options::default().discrepancy);
        let judge = Judge {
            problem: &problem,
            discrepancy: &discrepancy,
            in_time: None,
            recalibrated: &recalibrated,
            none: evidence(&discrepancy, None, &recalibrated, &|_| None),
            campaign: prior::Campaign {
                channels: 4,
                runs: truth_deg.len(),
                cycles: 10.0,
                families: 20.0,
            },
            limit: 0.02,
            expected_impact: 0.06,
            scatter: 0.01,
        };
        let (effects, values) = (&truth.0.hypothesised, &truth.1);
        let best = (!effects.is_empty()).then(|| {
            let hypothesis = Hypothesis::new(&worm.nuisances(), effects);
            let mut at = hypothesis.neutral();
            let first = at.len() - values.len();
            at[first..].copy_from_slice(values);
            problem.with_derivatives(&hypothesis, problem.fit(&hypothesis, at, None).at)
        });
        let all = misstated(&judge, f64::INFINITY);
        let first = all.first()?;
        let of_effect = best.map_or(f64::NAN, |best| judge.evidence_of(&best, &|_| None).usual);
        Some((
            in_words(&worm, first).0,
            first.ln_weight - judge.none.usual,
            first.ln_weight - of_effect,
        ))
    }

    #[test]
    fn a_wrong_condition_explains_the_data_and_none_does_so_in_place_of_an_effect() {
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
            assert_found(words, &found(&truth_deg, &stated_deg, &hypothesis(None)));
        }
        let slopes_deg = [0.0, 20.0, 35.0];
        for effect in [
            ("unequal-clamping", Some(1), &[0.7][..]),
            ("slope-clamping", None, &[0.3]),
        ] {
            let found = found(&slopes_deg, &slopes_deg, &hypothesis(Some(effect)));
            let is_worse = found
                .as_ref()
                .is_none_or(|(_, _, beyond_effect)| *beyond_effect < -10.0);
            assert!(is_worse, "{effect:?}: {found:?}");
        }
    }

    #[test]
    fn friction_that_was_another_in_one_run_is_the_answer_and_spares_the_model() {
        let campaign = Campaign {
            slopes_deg: vec![0.0, 20.0, 35.0],
            simulation: Simulation {
                cycles: 5.0,
                ..Campaign::default().simulation
            },
        };
        let slick = Hypothesis::new(&[Nuisance::FrictionIn(1).free(FRICTION_IN)], &[]);
        let recordings = record_under(&campaign, &(slick, vec![0.75_f64.ln()]), 7);
        let with_slopes = recordings.iter().zip(&campaign.slopes_deg);
        let runs: Vec<RecordedRun<'_>> = with_slopes
            .map(|(recording, &slope_deg)| RecordedRun::at_slope(recording, slope_deg))
            .collect();
        let answer =
            explain(&runs, &Config::default(), &Options::default(), &mut |_| {}).expect("recordings of a worm");
        assert!(
            answer.is_misstated() && answer.effects.is_empty(),
            "{}",
            answer.sentence
        );
        let said = "times that in the other recordings";
        assert!(answer.sentence.contains(said), "{}", answer.sentence);
        for (name, truth) in [("friction in run 2", 0.75), ("friction", 1.0), ("stiffness", 1.0)] {
            let found = |all: &[Calibrated]| {
                let found = all.iter().find(|one| one.name == name);
                found.map_or(f64::NAN, |one| one.found)
            };
            let [shown, written] = [&answer.calibration, &answer.written_back].map(|all| found(all));
            assert!(
                (shown - truth).abs() < 0.03 && (written - truth).abs() < 0.03,
                "{name}: {shown} and {written}, {truth} is true"
            );
        }
    }

    fn assert_found(words: &str, found: &Option<(String, f64, f64)>) {
        let Some((said, beyond_none, _)) = found else {
            panic!("{words}: nothing found");
        };
        assert!(said.contains(words) && *beyond_none > 20.0, "{words}: {found:?}");
    }
}
