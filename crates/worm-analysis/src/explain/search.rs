//! The search itself, step by step.

use super::answer::Answer;
use super::assemble;
use super::cross_validation;
use super::error::ExplainError;
use super::fit::{Fit, FitProblem};
use super::hypothesis::Hypothesis;
use super::local_restart::restart_locally;
use super::model_selection::{self, Candidate, Open};
use super::noise::RunNoise;
use super::observed::Observed;
use super::parameter::{Hypothesised, Nuisance, What};
use super::predict::{Scene, nominal, predict};
use super::residual::Residual;
use super::score_test::{self, Screening};
use super::speed_droop::speed_droop;
use crate::experiment::{Progress, RecordedRun};
use worm_estimator::config::Config;
use worm_physics::effect::Setting;
use worm_physics::{Physics, Worm};

/// Times that noise and recalibration are found from one another.
const NOISE_ROUNDS: usize = 2;
/// Effects that are refitted, and cells of one effect, where the next one's score comes near the best one's.
const REFITTED: usize = 8;
const CELLS_REFITTED: usize = 2;
const NEXT_CELL: f64 = 0.5;
/// Single effects from which pairs are tried where the best leaves a gap (from the best alone where it leaves none), effects that
/// are refitted on top of each, and how many that screened best are tried roughly before.
const PAIR_SEEDS: usize = 2;
const PAIRED: usize = 3;
const SCREENED_FOR_PAIRS: usize = 8;
/// Improvement from which it is worth looking for a better valley.
const MIN_TO_LEAP: f64 = 10.0;
/// How much larger an improvement must be than what chance reaches one time in twenty, and how large at least: real pads, cams and
/// tips leave a little of their own. Chosen on the development split.
const SAFETY: f64 = 2.5;
const MIN_IMPROVEMENT: f64 = 26.0;

/// What may be chosen of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Seed of everything drawn: the same input and seed give the same answer.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 1 }
    }
}

/// Prepares the runs of a campaign.
pub(super) fn prepare<'a>(runs: &[RecordedRun<'a>], config: &Config) -> Result<Scene<'a>, ExplainError> {
    if runs.is_empty() {
        return Err(ExplainError::NoRun);
    }
    if config.worm.cells < 3 {
        return Err(ExplainError::TwoCells);
    }
    let settings: Vec<Setting> = config
        .effect
        .iter()
        .map(|effect| effect.setting(config.worm.cells))
        .collect::<Result<_, _>>()?;
    let mut scene = Scene {
        observed: Vec::with_capacity(runs.len()),
        nominal: Vec::with_capacity(runs.len()),
    };
    for run in runs {
        let mut observed = Observed::new(*run, config)?;
        if let Some(first) = scene.observed.first() {
            same_order(first, &observed)?;
        }
        let worm = Worm::try_from(config)?.with_slope_rad(run.slope_deg.to_radians())?;
        let physics = Physics::of(nominal(&observed, worm, run.payload_kg)).with(&settings);
        if physics.clamped_worm().check_hold().is_err() {
            return Err(ExplainError::SlidesDown {
                recording: run.recording.source.display().to_string(),
                slope_deg: run.slope_deg,
            });
        }
        if observed.may_be_laid_down {
            judge_start(&mut observed, &physics);
        }
        scene.observed.push(observed);
        scene.nominal.push(physics);
    }
    Ok(scene)
}

fn same_order(first: &Observed<'_>, other: &Observed<'_>) -> Result<(), ExplainError> {
    if first.step_order == other.step_order {
        return Ok(());
    }
    let people = |order: &[usize]| order.iter().map(|cell| cell + 1).collect();
    Err(ExplainError::StepOrder {
        recording: other.run.recording.source.display().to_string(),
        found: people(&other.step_order),
        first: first.run.recording.source.display().to_string(),
        expected: people(&first.step_order),
    })
}

/// Takes the worm for one laid down where its first cycle looks more like it.
fn judge_start(observed: &mut Observed<'_>, physics: &Physics) {
    let first_cycle = |observed: &Observed<'_>| {
        let predicted = predict(observed, physics, 0.4, physics.is_periodic())?;
        let residual = Residual::new(observed, &predicted);
        let until = observed.phase.partition_point(|&phase| phase < observed.phase[0] + 1.0);
        let body: Vec<f64> = residual.body_m[..until]
            .iter()
            .copied()
            .filter(|at_m| at_m.is_finite())
            .collect();
        let mean = body.iter().sum::<f64>() / body.len() as f64;
        Some(body.iter().map(|at_m| (at_m - mean).powi(2)).sum::<f64>())
    };
    observed.assume_laid_down(true);
    let laid_down = first_cycle(observed);
    observed.assume_laid_down(false);
    let under_way = first_cycle(observed);
    let is_laid_down = match (laid_down, under_way) {
        (Some(laid_down), Some(under_way)) => laid_down < under_way,
        (Some(_), None) => true,
        _ => false,
    };
    observed.assume_laid_down(is_laid_down);
}

/// Finds the effect that the model misses.
///
/// # Errors
/// [`ExplainError`] names the recording and the remedy.
pub fn explain(
    runs: &[RecordedRun<'_>],
    config: &Config,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Answer, ExplainError> {
    let mut tell = |stage: &'static str, fraction: f64| progress(Progress { stage, fraction });
    tell("gait", 0.0);
    let scene = prepare(runs, config)?;
    let phase_recorded = scene.observed.iter().any(|observed| observed.phase_recorded);
    tell("recalibration", 0.03);
    let nuisances = Nuisance::all(config.worm.cells, runs.len(), phase_recorded);
    let (problem, recalibrated) = recalibrate(&scene, &Hypothesis::new(&nuisances, &[]))?;
    tell("screening", 0.15);
    let hypothesised = score_test::hypotheses(config.worm.cells, phase_recorded);
    let (screened, chance) = score_test::screen(&problem, &recalibrated, &hypothesised, options.seed);
    tell("refit", 0.3);
    let nominal = problem.with_derivatives(&recalibrated.hypothesis, recalibrated.hypothesis.neutral());
    let mut finds = refit(
        &problem,
        &recalibrated,
        &nominal,
        &screened,
        REFITTED,
        &mut |fraction| tell("refit", 0.3 + 0.35 * fraction),
    );
    let threshold = (SAFETY * chance).max(MIN_IMPROVEMENT);
    tell("held-out selection", 0.65);
    let folds = cross_validation::folds(&problem);
    let recalibrated_held_out = cross_validation::hold_out(&problem, &recalibrated, &folds);
    model_selection::hold_out(&problem, &recalibrated, &mut finds, &folds);
    tell("pairs", 0.75);
    let open = Open::of(&problem, &recalibrated);
    let mut pairs = Vec::new();
    if let Some(best) = finds.first().filter(|best| best.improvement > threshold) {
        let seeds = if open.is_closed(&problem, &best.fit) {
            1
        } else {
            PAIR_SEEDS
        };
        let seeds = model_selection::kinds(&finds).into_iter().take(seeds);
        pairs = pair_up(&problem, &recalibrated, seeds, &hypothesised, threshold, options.seed);
        model_selection::hold_out(&problem, &recalibrated, &mut pairs, &folds);
        if let Some(alone) = pairs
            .first()
            .and_then(|pair| alone(&problem, &recalibrated, &finds[0], pair))
        {
            finds[0] = alone;
            model_selection::hold_out(&problem, &recalibrated, &mut finds[..1], &folds);
        }
    }
    tell("judgement", 0.9);
    let judged = model_selection::judge(
        &problem,
        &open,
        finds,
        pairs,
        threshold,
        recalibrated_held_out.chi_squared,
    );
    let cycles_s: Vec<f64> = runs
        .iter()
        .map(|run| run.cycle_s.unwrap_or(config.gait.cycle_s))
        .collect();
    let speed_droop = speed_droop(
        &scene,
        judged.candidates.first().map_or(&recalibrated, |find| &find.fit),
        &cycles_s,
    );
    tell("localisation", 0.93);
    let parts = assemble::Parts {
        nominal,
        recalibrated,
        recalibrated_held_out,
        screened,
        judged,
        speed_droop,
        threshold,
    };
    Ok(assemble::assemble(&problem, config, &parts))
}

/// Noise and recalibrated model, from one another.
fn recalibrate<'s, 'a>(scene: &'s Scene<'a>, base: &Hypothesis) -> Result<(FitProblem<'s, 'a>, Fit), ExplainError> {
    let mut at = base.neutral();
    let mut round = 0;
    loop {
        let mut noise = Vec::with_capacity(scene.observed.len());
        for (run, observed) in scene.observed.iter().enumerate() {
            let predicted = scene.predict(run, base, &at).ok_or_else(|| ExplainError::SlidesDown {
                recording: observed.run.recording.source.display().to_string(),
                slope_deg: observed.run.slope_deg,
            })?;
            noise.push(RunNoise::measure(observed, &Residual::new(observed, &predicted)));
        }
        let problem = FitProblem {
            scene,
            noise,
            repeating_excess: 0.0,
        };
        let mut fit = problem.fit(base, at, None);
        round += 1;
        if round == NOISE_ROUNDS {
            problem.compute_jacobian(&mut fit);
            let repeating_excess = problem.repeating_excess(&fit);
            let problem = FitProblem {
                repeating_excess,
                ..problem
            };
            return Ok((problem, fit));
        }
        at = fit.at;
    }
}

/// Refits every effect, roughly from several starts, and the best of them to the end; best first.
///
/// The starts are what the screening found about the recalibrated model, and strong effects about the believed one: a strong
/// effect drives the recalibration into a corner from which it cannot be seen.
fn refit(
    problem: &FitProblem<'_, '_>,
    base: &Fit,
    nominal: &Fit,
    screened: &[Screening],
    max: usize,
    progress: &mut dyn FnMut(f64),
) -> Vec<Candidate> {
    let effects_from = base.at.len() - score_test::effect_quantities(&base.hypothesis);
    let hypothesis_of = |hypothesised: Hypothesised| {
        let mut all = base.hypothesis.hypothesised.clone();
        all.push(hypothesised);
        Hypothesis::new(&base.hypothesis.free[..effects_from], &all)
    };
    let mut rough: Vec<Fit> = Vec::with_capacity(screened.len());
    for (done, screening) in screened.iter().enumerate() {
        progress(0.5 * done as f64 / screened.len() as f64);
        let hypothesis = hypothesis_of(screening.hypothesised);
        let about_base = screening.starts.iter().map(|start| (base, start.clone()));
        let strong = score_test::strong(screening.hypothesised.effect);
        let about_nominal = strong.into_iter().map(|start| (nominal, start));
        let fits = about_base.chain(about_nominal).map(|(from, start)| {
            let mut at = from.at.clone();
            at.extend(start);
            problem.fit_roughly(&hypothesis, at, from)
        });
        rough.extend(fits.min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared)));
    }
    rough.sort_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
    let chosen = choose(rough, base, max);
    let mut finds: Vec<Candidate> = Vec::with_capacity(chosen.len());
    for (done, rough) in chosen.iter().enumerate() {
        progress(0.5 + 0.5 * done as f64 / chosen.len() as f64);
        let mut fit = problem.fit(&rough.hypothesis, rough.at.clone(), Some(rough));
        if base.chi_squared - fit.chi_squared > MIN_TO_LEAP {
            fit = restart_locally(problem, fit);
        }
        finds.push(Candidate::of(problem, base, fit));
    }
    finds.sort_by(|a, b| b.improvement.total_cmp(&a.improvement));
    finds
}

/// The best effects, each with its best cell and, where they come close, the next.
fn choose(rough: Vec<Fit>, base: &Fit, max: usize) -> Vec<Fit> {
    let mut chosen: Vec<Fit> = Vec::new();
    let name = |fit: &Fit| {
        fit.hypothesis
            .hypothesised
            .last()
            .map_or("", |hypothesised| hypothesised.effect.name)
    };
    for fit in rough {
        let same: Vec<&Fit> = chosen.iter().filter(|other| name(other) == name(&fit)).collect();
        let names: std::collections::BTreeSet<&str> = chosen.iter().map(name).collect();
        let gain = |fit: &Fit| base.chi_squared - fit.chi_squared;
        let is_wanted = match same.first() {
            None => names.len() < max,
            Some(best) => same.len() < CELLS_REFITTED && gain(&fit) > NEXT_CELL * gain(best),
        };
        if is_wanted {
            chosen.push(fit);
        }
    }
    chosen
}

/// A single effect fitted anew from where it lies in a pair, where that is a better fit: what a pair gains may be owed to a better
/// valley of its first effect, and not to the second.
fn alone(problem: &FitProblem<'_, '_>, recalibrated: &Fit, single: &Candidate, pair: &Candidate) -> Option<Candidate> {
    let hypothesis = &single.fit.hypothesis;
    let place_in_pair = pair.hypothesised.iter().position(|one| single.hypothesised == [*one])?;
    let from_pair = |what: What| {
        let what = match what {
            What::Effect { parameter, .. } => What::Effect {
                place: place_in_pair,
                parameter,
            },
            nuisance => nuisance,
        };
        let place = pair.fit.hypothesis.free.iter().position(|free| free.what == what)?;
        Some(pair.fit.at[place])
    };
    let at: Option<Vec<f64>> = hypothesis.free.iter().map(|free| from_pair(free.what)).collect();
    let find = Candidate::of(problem, recalibrated, problem.fit(hypothesis, at?, None));
    (find.improvement > single.improvement).then_some(find)
}

/// Pairs of effects: each of the best single ones with what screens best, and above the threshold, on top of it.
fn pair_up<'f>(
    problem: &FitProblem<'_, '_>,
    recalibrated: &Fit,
    seeds: impl Iterator<Item = &'f Candidate>,
    hypothesised: &[Hypothesised],
    threshold: f64,
    seed: u64,
) -> Vec<Candidate> {
    let mut pairs: Vec<Candidate> = Vec::new();
    for first in seeds {
        let others: Vec<Hypothesised> = hypothesised
            .iter()
            .filter(|other| {
                !first.hypothesised.contains(other) && !model_selection::are_twins(other, &first.hypothesised[0])
            })
            .copied()
            .collect();
        let base = problem.with_derivatives(&first.fit.hypothesis, first.fit.at.clone());
        let mut at = first.fit.hypothesis.neutral();
        let effects_from = at.len() - score_test::effect_quantities(&first.fit.hypothesis);
        at[effects_from..].copy_from_slice(&first.fit.at[effects_from..]);
        let about = problem.with_derivatives(&first.fit.hypothesis, at);
        let (mut promising, _) = score_test::screen(problem, &base, &others, seed);
        promising.retain(|screening| screening.score > threshold);
        promising.truncate(SCREENED_FOR_PAIRS);
        for find in refit(problem, &base, &about, &promising, PAIRED, &mut |_| ()) {
            let find = Candidate::of(problem, recalibrated, find.fit);
            let is_new = !pairs
                .iter()
                .any(|pair| pair.hypothesised.iter().all(|one| find.hypothesised.contains(one)));
            if is_new {
                pairs.push(find);
            }
        }
    }
    pairs.sort_by(|a, b| b.improvement.total_cmp(&a.improvement));
    pairs
}
