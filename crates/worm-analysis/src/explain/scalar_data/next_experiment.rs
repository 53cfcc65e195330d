//! What to record, so that positions decide what advances cannot.
//!
//! Which tips slide and when is in the positions of any run. The slope is the one on which the candidates' advances also lie
//! farthest apart, so that one run does both.

use super::super::answer::{ExperimentChange, NextExperiment, Prediction, RunChange, Verdict};
use super::super::experiment_design::{MIN_ADVANCE, SLOPES_DEG};
use super::model_selection::Selected;
use super::table::Table;
use crate::explain::search::fit::Fit;
use worm_physics::Cycle;

/// Most candidates whose predictions are listed.
const MAX_PREDICTIONS: usize = 8;

/// The run to record; none where model and advances agree or one effect is named.
pub(super) fn propose(table: &Table<'_>, recalibrated: &Fit, selected: &Selected) -> Option<NextExperiment> {
    if matches!(selected.verdict, Verdict::Agrees | Verdict::Explained) {
        return None;
    }
    // Where the set is empty, the nearest effects predict; and always the model without any effect.
    let nearest = if selected.set.is_empty() {
        &selected.others
    } else {
        &selected.set
    };
    let mut rivals: Vec<(String, &Fit)> = nearest
        .iter()
        .take(MAX_PREDICTIONS)
        .map(|kind| (kind.name(), &kind.candidate.fit))
        .collect();
    rivals.push(("no effect".to_owned(), recalibrated));
    let (slope_deg, predicted) = SLOPES_DEG
        .into_iter()
        .filter_map(|slope_deg| Some((slope_deg, predict_all(table, slope_deg, &rivals)?)))
        .max_by(|a, b| spread_m(&a.1).total_cmp(&spread_m(&b.1)))?;
    let cells = table.worm.cells();
    let predictions = rivals
        .into_iter()
        .zip(&predicted)
        .map(|((effect, _), (cycle, advance_m))| Prediction {
            effect,
            advance_m: Some(*advance_m),
            description: format!(
                "tips of cells 1 to {cells} slide back {} mm in a cycle",
                slides(cycle, cells)
            ),
        });
    let slope = format!("{slope_deg}°").replace('-', "−");
    Some(NextExperiment {
        change: ExperimentChange::Run(RunChange::Slope),
        value: Some(slope_deg),
        unit: RunChange::Slope.unit().to_owned(),
        slope_deg: Some(slope_deg),
        description: format!(
            "Lay the canal at {slope}, let the worm crawl 12 cycles, and record the positions of all its cells, with the gait phase \
             if there is one: which cell slides, and when, separates effects that give the same advance. Record a slope of the table too."
        ),
        predictions: predictions.collect(),
        separation_sigma: None,
    })
}

/// Predictions of every rival for a slope; none where one of them hardly advances, for that is no experiment.
fn predict_all(table: &Table<'_>, slope_deg: f64, rivals: &[(String, &Fit)]) -> Option<Vec<(Cycle, f64)>> {
    let min_m = MIN_ADVANCE * table.worm.stroke_m();
    let predicted = rivals.iter().map(|(_, fit)| table.on_slope(slope_deg, fit));
    predicted
        .map(|predicted| predicted.filter(|(_, advance_m)| *advance_m > min_m))
        .collect()
}

/// Standard deviation of the advances, m.
fn spread_m(predicted: &[(Cycle, f64)]) -> f64 {
    let count = predicted.len() as f64;
    let mean_m = predicted.iter().map(|(_, advance_m)| advance_m).sum::<f64>() / count;
    let squares = predicted.iter().map(|(_, advance_m)| (advance_m - mean_m).powi(2));
    (squares.sum::<f64>() / count).sqrt()
}

fn slides(cycle: &Cycle, cells: usize) -> String {
    let slides = cycle.backward_slide_m[..cells].iter();
    slides
        .map(|slide_m| format!("{:.2}", slide_m * 1e3))
        .collect::<Vec<_>>()
        .join(" / ")
}
