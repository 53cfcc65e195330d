//! The search on recordings of a worm.

use super::answer::{Answer, Verdict};
use super::assemble::{Parts, assemble};
use super::error::ExplainError;
use super::search::find::{Options, find};
use super::search::hypothesis::Hypothesis;
use super::search::law::fit::LawSearch;
use super::search::plant::{Plant, Recorded};
use super::search::recalibrate::{measure_noise, recalibrate};
use super::worm::misstated_slope::misstated;
use super::worm::prepare::prepare;
use super::worm::recorded_worm::RecordedWorm;
use super::worm::speed_droop::speed_droop;
use crate::experiment::{Progress, RecordedRun};
use worm_estimator::config::Config;

/// Searches for the effect that the model lacks.
///
/// # Errors
/// [`ExplainError`] names the recording and the remedy.
pub fn explain(
    runs: &[RecordedRun<'_>],
    config: &Config,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Answer, ExplainError> {
    let mut report = |stage: &'static str, fraction: f64| progress(Progress { stage, fraction });
    report("gait", 0.0);
    let mut worm = RecordedWorm::new(prepare(runs, config, options.evidence)?);
    report("recalibration", 0.03);
    let base = Hypothesis::new(&worm.nuisances(), &[]);
    let at = measure_noise(&mut worm, &base)?;
    let (problem, discrepancy, recalibrated) = recalibrate(&worm, &base, at, options.discrepancy);
    let found = find(&problem, &discrepancy, &recalibrated, options, &mut report);
    let law = (found.selected.verdict == Verdict::OutsideLibrary).then(|| {
        let search = LawSearch {
            problem: &problem,
            discrepancy: &discrepancy,
            recalibrated: &recalibrated,
            without: &found.recalibrated_held_out,
            folds: &worm.folds(),
        };
        let laws = search.fit(&mut |fraction| report("law", 0.92 + 0.03 * fraction));
        search.best(laws, &mut |fraction| report("law", 0.95 + 0.02 * fraction))
    });
    let cycles_s: Vec<f64> = runs
        .iter()
        .map(|run| run.cycle_s.unwrap_or(config.gait.cycle_s))
        .collect();
    let best = found.selected.candidates.first();
    let best = best.map_or(&recalibrated, |candidate| &candidate.fit);
    let speed_droop = speed_droop(&worm.scene, best, &cycles_s);
    report("localisation", 0.97);
    let parts = Parts {
        recalibrated,
        found,
        speed_droop,
        discrepancy_m: discrepancy.scale_m,
        law: law.flatten(),
    };
    let mut answer = assemble(&problem, config, &parts);
    if answer.verdict != Verdict::Agrees {
        let best = parts.found.selected.candidates.first();
        let best = best.map_or(&parts.recalibrated, |candidate| &candidate.fit);
        if let Some(suspicion) = misstated(&problem, &parts.recalibrated, best) {
            answer.sentence += &format!(" But {suspicion}.");
            answer.warnings.insert(0, suspicion);
        }
    }
    answer.warnings.extend(left_out(options));
    Ok(answer)
}

/// What the search was not to know, in words.
pub(super) fn left_out(options: &Options) -> Option<String> {
    let names = options.without.join(", ");
    (!names.is_empty()).then(|| format!("left out of the search: {names}"))
}
