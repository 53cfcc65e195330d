//! The search on recordings of a worm.

use super::answer::{Answer, Verdict};
use super::assemble::{Parts, assemble};
use super::error::ExplainError;
use super::search::find::{Options, find};
use super::search::hypothesis::Hypothesis;
use super::search::law::fit::LawSearch;
use super::search::plant::{Plant, Recorded};
use super::search::recalibrate::{measure_noise, recalibrate};
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
    let mut found = find(&problem, &discrepancy, &recalibrated, options, &mut report);
    // Under wrong conditions a law would be one of theirs.
    let is_misstated = found.selected.is_misstated();
    let laws = found.laws.take();
    let law = (found.selected.verdict == Verdict::OutsideLibrary && !is_misstated).then(|| {
        let search = LawSearch {
            problem: &problem,
            discrepancy: &discrepancy,
            recalibrated: &recalibrated,
            without: &found.recalibrated_held_out,
            folds: &worm.folds(),
        };
        let laws = laws.unwrap_or_else(|| search.fit(&mut |fraction| report("law", 0.92 + 0.03 * fraction)));
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
    answer.warnings.extend(another_order(&worm, config));
    answer.warnings.extend(left_out(options));
    Ok(answer)
}

/// That the cells step in another order than the configured one: a phase that is off by part of a cycle makes that.
fn another_order(worm: &RecordedWorm<'_>, config: &Config) -> Option<String> {
    let first = &worm.scene.observed[0];
    let (seen, configured) = (&first.step_order, config.worm.step_order_from_zero());
    let from_one = |order: &[usize]| -> Vec<usize> { order.iter().map(|cell| cell + 1).collect() };
    (first.phase_recorded && *seen != configured).then(|| {
        format!(
            "from the beginning of each cycle the cells step in the order {:?}, and worm.step_order is {:?}: is the recorded phase off by part of a \
             cycle?",
            from_one(seen),
            from_one(&configured)
        )
    })
}

/// What the search was not to know, in words.
pub(super) fn left_out(options: &Options) -> Option<String> {
    let names = options.without.join(", ");
    (!names.is_empty()).then(|| format!("left out of the search: {names}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::fixture::{Campaign, record};
    use crate::explain::search::find::Evidence;

    #[test]
    fn a_phase_that_begins_in_another_cell_is_told() {
        let config = Config::default();
        let mut recordings = record(&Campaign::default(), None, 3);
        let said = |recordings: &[crate::recording::Recording]| {
            let runs: Vec<RecordedRun<'_>> = recordings
                .iter()
                .map(|recording| RecordedRun::at_slope(recording, 0.0))
                .collect();
            let worm = RecordedWorm::new(prepare(&runs[..1], &config, Evidence::Positions).expect("a worm"));
            another_order(&worm, &config)
        };
        assert_eq!(said(&recordings), None);
        for phase in recordings[0].gait_phase.iter_mut().flatten() {
            *phase += 0.3;
        }
        let warning = said(&recordings).expect("another order");
        assert!(
            warning.contains("[4, 1, 2, 3]") && warning.contains("off by part"),
            "{warning}"
        );
    }
}
