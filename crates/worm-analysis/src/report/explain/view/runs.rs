//! What the answer is based on: recordings or advances.

use super::{Block, FigureKind};
use crate::explain::Answer;
use crate::explain::answer::RunSummary;
use crate::report::page::{QuantityRow, Table};
use crate::report::runs::names_by_slope;
use worm_estimator::number::fixed;

pub(super) fn cycle_blocks(answer: &Answer) -> Vec<Block> {
    let why = if answer.is_by_advances() {
        "There is no cycle to show, because no positions were recorded. The advances are at the end."
    } else if answer.is_by_current_alone() && !answer.figures.torque.is_empty() {
        return vec![Block::Figure(FigureKind::Torque)];
    } else if answer.figures.cycles.iter().all(|run| run.phase.is_empty()) {
        "There is no mean cycle to show: the answer holds none of any run."
    } else {
        let torque = (!answer.figures.torque.is_empty()).then_some(FigureKind::Torque);
        let figures = std::iter::once(FigureKind::Cycle).chain(torque);
        return figures.map(Block::Figure).collect();
    };
    vec![Block::paragraph(why)]
}

pub(super) fn blocks(answer: &Answer) -> Vec<Block> {
    vec![match (answer.runs.is_empty(), answer.is_by_advances()) {
        (true, _) => Block::paragraph("The answer lists no recordings."),
        (_, true) => Block::Table(advances(answer)),
        (_, false) => Block::Table(recordings(answer)),
    }]
}

fn mm(length_m: f64) -> String {
    fixed(length_m * 1e3, 3)
}

const PAYLOAD: QuantityRow<'_, RunSummary> = ("known extra mass, g", &|run| fixed(run.payload_kg * 1e3, 0));
const CYCLE: QuantityRow<'_, RunSummary> = ("time of a gait cycle, s", &|run| fixed(run.cycle_s, 3));
const MEASURED: QuantityRow<'_, RunSummary> = ("advance a cycle, mm: measured", &|run| mm(run.advance_m[0]));
const RECALIBRATED: QuantityRow<'_, RunSummary> = ("by the recalibrated model", &|run| mm(run.advance_m[1]));

fn advances(answer: &Answer) -> Table {
    let sigma: QuantityRow<'_, RunSummary> = ("its standard error", &|run| mm(run.advance_sigma_m.unwrap_or(f64::NAN)));
    let mut quantities = vec![PAYLOAD, CYCLE, MEASURED, sigma, RECALIBRATED];
    if !answer.effects.is_empty() {
        quantities.push(("by the first candidate", &|run| mm(run.advance_m[2])));
    }
    table("Advances", answer, &quantities)
}

fn recordings(answer: &Answer) -> Table {
    let yes = |is_so: bool, otherwise: &str| if is_so { "yes" } else { otherwise }.to_owned();
    let quantities: [QuantityRow<'_, RunSummary>; 9] = [
        ("recording", &|run| run.recording.clone()),
        PAYLOAD,
        ("whole gait cycles", &|run| run.cycles.to_string()),
        CYCLE,
        ("gait phase recorded", &|run| {
            yes(run.phase_recorded, "no, found from the positions")
        }),
        ("laid down where the recording begins", &|run| {
            yes(run.laid_down, "not seen")
        }),
        ("noise of one position, mm", &|run| mm(run.noise_m)),
        ("random walk of the body a cycle, mm", &|run| mm(run.drift_per_cycle_m)),
        MEASURED,
    ];
    let mut quantities = [&quantities[..], &[RECALIBRATED]].concat();
    if !answer.effects.is_empty() {
        quantities.push(("by the named model", &|run| mm(run.advance_m[2])));
    }
    if answer.runs.iter().any(|run| run.current.is_some()) {
        quantities.extend(CURRENT);
        if !answer.effects.is_empty() {
            quantities.extend(CURRENT_NAMED);
        }
    }
    table("Recordings", answer, &quantities)
}

/// What the motor's current shows, where it counts.
const CURRENT: [QuantityRow<'_, RunSummary>; 3] = [
    ("work of a cycle, mJ: by the motor's current", &|run| {
        milli(run.current.map(|current| current.work_j[0]))
    }),
    ("work by the recalibrated model", &|run| {
        milli(run.current.map(|current| current.work_j[1]))
    }),
    ("torque that it leaves, mN m", &|run| {
        milli(run.current.map(|current| current.torque_residual_n_m[0]))
    }),
];
const CURRENT_NAMED: [QuantityRow<'_, RunSummary>; 2] = [
    ("work by the named model, mJ", &|run| {
        milli(run.current.map(|current| current.work_j[2]))
    }),
    ("torque that it leaves, mN m", &|run| {
        milli(run.current.map(|current| current.torque_residual_n_m[1]))
    }),
];

/// In thousandths of its unit.
fn milli(value: Option<f64>) -> String {
    fixed(value.unwrap_or(f64::NAN) * 1e3, 2)
}

/// The table of all runs.
fn table(title: &str, answer: &Answer, quantities: &[QuantityRow<'_, RunSummary>]) -> Table {
    let names = names_by_slope(answer.runs.iter().map(|run| run.slope_deg));
    Table::of_items(title, names, &answer.runs, quantities)
}
