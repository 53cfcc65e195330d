//! The answer, put together from what was found.

use super::answer::{
    Answer, Calibrated, Figures, FoundParameter, NamedEffect, Remainder, ResidualMap, RunSummary, Screened,
    ScreeningOutcome, Stage, StageKind, Verdict, with_cell,
};
use super::cross_validation::HeldOut;
use super::experiment_design::propose;
use super::fit::{Fit, FitProblem};
use super::gap::{Measured, cycles};
use super::model_selection::{Candidate, Judged};
use super::observed::Observed;
use super::parameter::{Hypothesised, Nuisance, What};
use super::period::period;
use super::residual_map::{map, places};
use super::score_test::Screening;
use super::speed_droop::SpeedDroop;
use super::words;
use worm_estimator::config::Config;
use worm_physics::effect::{Effect, LIBRARY, MOTOR_DROOP};

/// Places listed at most.
const PLACES: usize = 12;
/// Share of the held-out gap that the best effect must close to be named.
const CLOSES: f64 = 0.15;
/// Improvement from which a motor that droops is named: chance reaches 4 one time in twenty, and there is one such quantity.
const DROOPS: f64 = 16.0;

/// Everything that the answer is made of.
pub(super) struct Parts {
    pub nominal: Fit,
    pub recalibrated: Fit,
    pub recalibrated_held_out: HeldOut,
    pub screened: Vec<Screening>,
    pub judged: Judged,
    pub speed_droop: Option<SpeedDroop>,
    pub threshold: f64,
}

/// Puts the answer together.
pub(super) fn assemble(problem: &FitProblem<'_, '_>, config: &Config, parts: &Parts) -> Answer {
    let judged = &parts.judged;
    let speed_droop = parts
        .speed_droop
        .as_ref()
        .filter(|speed_droop| speed_droop.improvement > DROOPS);
    let mut named: &[Candidate] = match judged.verdict {
        Verdict::Explained | Verdict::Ambiguous => &judged.candidates,
        Verdict::Agrees | Verdict::OutsideLibrary => &[],
    };
    let mut gap = Gap::measure(problem, parts, named);
    let mut of_positions = judged.verdict;
    let refused = gap.closure.first().copied().filter(|closure| *closure < CLOSES);
    if refused.is_some() {
        named = &[];
        gap = Gap::measure(problem, parts, named);
        of_positions = if judged.nothing_open {
            Verdict::Agrees
        } else {
            Verdict::OutsideLibrary
        };
    }
    let verdict = match (of_positions, speed_droop) {
        (Verdict::Agrees, Some(_)) => Verdict::Explained,
        (verdict, _) => verdict,
    };
    let mut effects = Vec::new();
    let mut rivals = Vec::new();
    for (place, find) in named.iter().enumerate() {
        let found = named_effects(find, judged.probability[place], gap.closure[place], gap.margin(place));
        if place == 0 {
            effects = found;
        } else {
            // What the first answer names already is no rival of it.
            let is_new = |effect: &NamedEffect| {
                !effects
                    .iter()
                    .any(|named: &NamedEffect| named.in_words() == effect.in_words())
            };
            rivals.extend(found.into_iter().filter(is_new));
        }
    }
    effects.extend(speed_droop.map(droop_effect));
    let final_fit = named.first().map_or(&parts.recalibrated, |find| &find.fit);
    let maps_before = maps(problem, &parts.recalibrated);
    let best = judged.candidates.first().map(|find| &find.fit);
    let maps_after = match verdict {
        Verdict::Agrees => Vec::new(),
        _ => best.map_or_else(Vec::new, |fit| maps(problem, fit)),
    };
    let remainder = (verdict == Verdict::OutsideLibrary).then(|| {
        let places = places(&maps_after, PLACES);
        let period = period(problem, best.unwrap_or(&parts.recalibrated));
        Remainder {
            description: words::remainder(judged, &places),
            open_share: judged.open_share,
            period_cycles: period.cycles,
            period_m: period.displacement_m,
            places,
        }
    });
    let cycle_s = config.gait.cycle_s;
    let next_experiment = match verdict {
        Verdict::Ambiguous => {
            let fits: Vec<&Fit> = named.iter().map(|find| &find.fit).collect();
            propose(problem, &fits, cycle_s)
        }
        _ => None,
    };
    let runs = runs(problem, parts, named.first());
    Answer {
        verdict,
        sentence: words::sentence(verdict, &effects, &rivals, judged, refused, parts.threshold),
        r#where: places(&maps_before, PLACES),
        effects,
        rivals,
        stages: gap.stages,
        remainder,
        next_experiment,
        calibration: calibration(final_fit, config),
        screening: screening(&parts.screened, judged, speed_droop.is_some()),
        threshold: parts.threshold,
        warnings: words::warnings(problem, final_fit),
        runs,
        figures: Figures {
            maps_before,
            maps_after,
            cycles: cycles(
                problem,
                &parts.nominal,
                &parts.recalibrated,
                named.first().map(|find| &find.fit),
            ),
            model_diff: Vec::new(),
        },
    }
}

/// The gap, stage by stage, and what share of it each candidate closes.
struct Gap {
    stages: Vec<Stage>,
    closure: Vec<f64>,
    best_wrong: f64,
}

impl Gap {
    fn measure(problem: &FitProblem<'_, '_>, parts: &Parts, named: &[Candidate]) -> Self {
        let judged = &parts.judged;
        let best = judged.candidates.first().map_or(&parts.recalibrated, |find| &find.fit);
        let measured = Measured::new(problem, best);
        let recalibrated = measured.stage(
            StageKind::Recalibrated,
            None,
            &parts.recalibrated,
            &parts.recalibrated_held_out.fits,
        );
        let floor = measured.floor_stage();
        let stage = |kind: StageKind, find: &Candidate| {
            let folds = find.held_out.as_ref().map_or(&[][..], |held_out| &held_out.fits);
            let names: Vec<&str> = find
                .hypothesised
                .iter()
                .map(|hypothesised| hypothesised.effect.name)
                .collect();
            measured.stage(kind, Some(names.join(" + ")), &find.fit, folds)
        };
        let gap_m = recalibrated.held_out_rms_m - floor.held_out_rms_m;
        let closure = |stage: &Stage| (recalibrated.held_out_rms_m - stage.held_out_rms_m) / gap_m;
        let of_named: Vec<Stage> = named.iter().map(|find| stage(StageKind::Named, find)).collect();
        let wrong = judged.best_wrong.as_ref().map(|find| stage(StageKind::BestWrong, find));
        let closures = of_named.iter().map(closure).collect();
        let best_wrong = wrong.as_ref().map_or(0.0, closure);
        let mut stages = vec![
            measured.stage(StageKind::Baseline, None, &parts.nominal, &[]),
            recalibrated,
        ];
        stages.extend(wrong);
        stages.extend(of_named.into_iter().next());
        stages.push(measured.free_form_stage(&parts.recalibrated));
        stages.push(floor);
        Self {
            stages,
            closure: closures,
            best_wrong,
        }
    }

    /// A candidate's closure less that of the best other one, candidate or not.
    fn margin(&self, place: usize) -> f64 {
        let others = self.closure.iter().enumerate().filter(|(other, _)| *other != place);
        self.closure[place] - others.map(|(_, closure)| *closure).fold(self.best_wrong, f64::max)
    }
}

fn maps(problem: &FitProblem<'_, '_>, fit: &Fit) -> Vec<ResidualMap> {
    (0..problem.scene.observed.len())
        .map(|run| map(problem, run, fit))
        .collect()
}

fn droop_effect(speed_droop: &SpeedDroop) -> NamedEffect {
    let effect = MOTOR_DROOP;
    let parameter = effect.severity();
    NamedEffect {
        name: effect.name.to_owned(),
        twins: Vec::new(),
        together_with: Vec::new(),
        parameters: vec![FoundParameter {
            name: parameter.name.to_owned(),
            value: speed_droop.slowdown_per_n,
            sigma: speed_droop.sigma,
            unit: parameter.unit.to_owned(),
            cell: None,
        }],
        cell: None,
        // It shows in time: the gap in positions neither opens nor closes by it.
        closure: f64::NAN,
        margin: f64::NAN,
        probability: 1.0 / (1.0 + (-0.5 * speed_droop.improvement).exp()),
        improvement: speed_droop.improvement,
        separated_by: effect.separated_by.to_owned(),
    }
}

/// What the recordings are, and how far the worm got in them.
fn runs(problem: &FitProblem<'_, '_>, parts: &Parts, named: Option<&Candidate>) -> Vec<RunSummary> {
    let of = |(run, observed): (usize, &Observed<'_>)| {
        let predicted_m = |fit: &Fit| {
            let predicted = problem.scene.predict(run, &fit.hypothesis, &fit.at);
            predicted.map_or(f64::NAN, |predicted| {
                let cells = observed.cells();
                advance_m(observed, |sample, cell| predicted.position_m[sample * cells + cell])
            })
        };
        RunSummary {
            recording: observed.run.recording.source.display().to_string(),
            slope_deg: observed.run.slope_deg,
            payload_kg: observed.run.payload_kg,
            cycles: (observed.phase[observed.samples() - 1] - observed.phase[0]).floor() as usize,
            cycle_s: observed.cycle_s,
            phase_recorded: observed.phase_recorded,
            laid_down: observed.laid_down,
            noise_m: observed.noise_m,
            drift_per_cycle_m: problem.noise[run].drift_per_cycle_m(),
            advance_m: [
                advance_m(observed, |sample, cell| observed.position_m[cell][sample]),
                predicted_m(&parts.recalibrated),
                named.map_or(f64::NAN, |find| predicted_m(&find.fit)),
            ],
            advance_sigma_m: None,
        }
    };
    problem.scene.observed.iter().enumerate().map(of).collect()
}

/// Advance per cycle, m: mean over the settled samples, each against the one a cycle later in which every cell was seen too.
fn advance_m(observed: &Observed<'_>, position_m: impl Fn(usize, usize) -> f64) -> f64 {
    let cells = observed.cells();
    let mean_m = |sample: usize| (0..cells).map(|cell| position_m(sample, cell)).sum::<f64>() / cells as f64;
    let (mut sum_m, mut count) = (0.0, 0.0);
    let mut after = observed.settled_from();
    for sample in observed.settled_from()..observed.samples() {
        while after < observed.samples() && observed.phase[after] < observed.phase[sample] + 1.0 {
            after += 1;
        }
        if after == observed.samples() {
            break;
        }
        // Both samples of a pair must show every cell; what the later one is past the cycle is taken off in proportion.
        let displacement_m = mean_m(after) - mean_m(sample);
        if displacement_m.is_finite() {
            sum_m += displacement_m / (observed.phase[after] - observed.phase[sample]);
            count += 1.0;
        }
    }
    sum_m / count
}

/// The effects of a find, as people read them.
pub(super) fn named_effects(find: &Candidate, probability: f64, closure: f64, margin: f64) -> Vec<NamedEffect> {
    let sigmas = find.sigmas();
    let name =
        |hypothesised: &Hypothesised| with_cell(hypothesised.effect.name, hypothesised.cell.map(|cell| cell + 1));
    let of = |(place, hypothesised): (usize, &Hypothesised)| {
        let quantities = find.fit.hypothesis.free.iter().enumerate();
        let parameters = quantities.filter_map(|(at, free)| match free.what {
            What::Effect { place: mine, parameter } if mine == place => {
                let parameter = &hypothesised.effect.parameters[parameter];
                Some(FoundParameter {
                    name: parameter.name.to_owned(),
                    value: find.fit.at[at],
                    sigma: sigmas[at],
                    unit: parameter.unit.to_owned(),
                    cell: hypothesised.cell.map(|cell| cell + 1),
                })
            }
            _ => None,
        });
        NamedEffect {
            name: hypothesised.effect.name.to_owned(),
            twins: hypothesised
                .effect
                .all_twins(hypothesised.cell)
                .into_iter()
                .map(str::to_owned)
                .collect(),
            parameters: parameters.collect(),
            cell: hypothesised.cell.map(|cell| cell + 1),
            together_with: find
                .hypothesised
                .iter()
                .filter(|other| *other != hypothesised)
                .map(name)
                .collect(),
            closure,
            margin,
            probability,
            improvement: find.improvement,
            separated_by: hypothesised.effect.separated_by.to_owned(),
        }
    };
    find.hypothesised.iter().enumerate().map(of).collect()
}

/// The library's scores, and what became of each effect.
fn screening(screened: &[Screening], judged: &Judged, droops: bool) -> Vec<Screened> {
    let mut rows: Vec<Screened> = screened
        .iter()
        .map(|screening| {
            let find = judged
                .all
                .iter()
                .find(|find| find.hypothesised == [screening.hypothesised]);
            Screened {
                name: screening.hypothesised.effect.name.to_owned(),
                cell: screening.hypothesised.cell.map(|cell| cell + 1),
                score: screening.score,
                improvement: find.filter(|find| find.fit.converged).map(|find| find.improvement),
                outcome: match find {
                    None => ScreeningOutcome::ScreenedOut,
                    Some(find) if find.fit.converged => ScreeningOutcome::Refitted,
                    Some(_) => ScreeningOutcome::DidNotConverge,
                },
            }
        })
        .collect();
    add_unscreened(&mut rows, |effect| match (effect.shows_in_time_alone(), droops) {
        (true, true) => ScreeningOutcome::Refitted,
        (true, false) => ScreeningOutcome::ScreenedOut,
        (false, _) => ScreeningOutcome::NotVisible,
    });
    rows
}

/// Adds every effect of the library that has no row yet, with what became of it.
pub(super) fn add_unscreened(rows: &mut Vec<Screened>, outcome: impl Fn(&Effect) -> ScreeningOutcome) {
    for effect in LIBRARY {
        if !rows.iter().any(|row| row.name == effect.name) {
            rows.push(Screened {
                name: effect.name.to_owned(),
                cell: None,
                score: 0.0,
                improvement: None,
                outcome: outcome(effect),
            });
        }
    }
}

/// What was recalibrated, as people read it.
pub(super) fn calibration(fit: &Fit, config: &Config) -> Vec<Calibrated> {
    let sigmas = fit.sigmas();
    let quantities = fit.hypothesis.free.iter().enumerate();
    quantities
        .filter_map(|(at, free)| {
            let What::Nuisance(nuisance) = free.what else {
                return None;
            };
            let (value, sigma) = (fit.at[at], sigmas[at]);
            let factor = |name: String| (name, 1.0, value.exp(), value.exp() * sigma, "");
            let (name, nominal, found, sigma, unit) = match nuisance {
                Nuisance::Friction => factor("friction".to_owned()),
                Nuisance::Stiffness => factor("stiffness".to_owned()),
                Nuisance::Stroke => {
                    let stroke_m = config.worm.stroke_m;
                    let found_m = stroke_m * value.exp();
                    ("stroke".to_owned(), stroke_m, found_m, found_m * sigma, "m")
                }
                Nuisance::FrictionOf(cell) => factor(format!("friction of cell {}", cell + 1)),
                Nuisance::StiffnessOf(cell) => factor(format!("stiffness of cell {}", cell + 1)),
                Nuisance::StrokeOf(cell) => factor(format!("stroke of cell {}", cell + 1)),
                Nuisance::SlopeOf(run) => (format!("slope of run {}", run + 1), 0.0, value, sigma, "deg"),
                Nuisance::Clock => ("clock".to_owned(), 0.0, value, sigma, "s"),
                Nuisance::Damping => {
                    let (name, _, found, sigma, unit) = factor("damping".to_owned());
                    (name, free.quantity.centre.exp(), found, sigma, unit)
                }
                Nuisance::Presliding => ("presliding".to_owned(), free.quantity.centre, value, sigma, ""),
                Nuisance::Rounding => ("rounding".to_owned(), free.quantity.centre, value, sigma, ""),
                Nuisance::Viscosity => ("viscosity".to_owned(), free.quantity.centre, value, sigma, "N s/m"),
            };
            Some(Calibrated {
                name,
                nominal,
                found,
                sigma,
                unit,
                at_limit: fit.at_limit(at),
            })
        })
        .collect()
}
