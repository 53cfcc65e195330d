//! Where model and data disagree.

use super::quantity::mm;
use super::{Block, FigureKind};
use crate::explain::Answer;
use crate::explain::answer::Place;
use crate::report::page::Table;
use crate::report::runs::slope;
use worm_estimator::number::{count, fixed};

/// Most places that the table lists.
const MAX_PLACES: usize = 24;

pub(super) fn blocks(answer: &Answer) -> Vec<Block> {
    if answer.is_by_advances() {
        let why = "Advances show that there is a gap, and on which slopes. In which cell and when, only recorded positions show.";
        return vec![Block::paragraph(why)];
    }
    if answer.is_by_current_alone() {
        let why = "Nobody saw the cells. Where in the gait cycle the torque on the cam is not as the model has it shows below.";
        return vec![Block::paragraph(why)];
    }
    let mut blocks = vec![Block::Paragraph(largest(answer))];
    let has_map = answer.figures.maps_before.iter().any(|map| !map.phase.is_empty());
    blocks.push(if has_map {
        Block::Figure(FigureKind::Map)
    } else {
        Block::paragraph("There is no map: the answer holds no residual by cell and phase.")
    });
    if !answer.r#where.is_empty() {
        let title = "Where model and data disagree, the clearest first";
        blocks.push(Block::Table(table(title, &answer.r#where)));
    }
    blocks
}

/// The largest disagreement in words.
fn largest(answer: &Answer) -> String {
    let Some(first) = answer.r#where.first() else {
        return no_place(answer);
    };
    let slope = match first.slope_deg {
        0.0 => "the level".to_owned(),
        slope_deg => format!("the slope of {}", slope(slope_deg)),
    };
    let direction = if first.residual_m < 0.0 { "less" } else { "more" };
    format!(
        "Most clearly on {slope}: while cell {} steps, at phase {} of the gait cycle, cell {} moves {} {direction} than the model \
         predicts, averaged over the cycles. That is {} times the standard error.",
        first.stepping_cell,
        fixed(first.phase, 2),
        first.cell,
        mm(first.residual_m.abs()),
        fixed(first.significance.abs(), 0)
    )
}

/// Why no place is listed: with some hundred bins, each of a few cycles, chance makes one that is far off.
fn no_place(answer: &Answer) -> String {
    let none = "No place is listed where the recalibrated model and the data disagree by more than chance";
    let all = answer
        .figures
        .maps_before
        .iter()
        .flat_map(|map| map.significance.iter().flatten());
    let known: Vec<f64> = all
        .map(|sigmas| sigmas.abs())
        .filter(|sigmas| sigmas.is_finite())
        .collect();
    match known.iter().copied().reduce(f64::max) {
        Some(largest) => format!(
            "{none}: the clearest of {} is {} standard errors off, and of so many over so few cycles chance makes one as far off.",
            count(known.len(), "bin"),
            fixed(largest, 1)
        ),
        None => format!("{none}."),
    }
}

/// Places of disagreement.
pub(super) fn table(title: &str, places: &[Place]) -> Table {
    let head = [
        "cell",
        "while this cell steps",
        "gait phase",
        "slope",
        "beyond the model, mm a cycle",
        "in standard errors",
    ];
    let row = |place: &Place| {
        vec![
            format!("cell {}", place.cell),
            format!("cell {}", place.stepping_cell),
            fixed(place.phase, 2),
            slope(place.slope_deg),
            fixed(place.residual_m * 1e3, 3),
            fixed(place.significance, 1),
        ]
    };
    let mut table = Table::new(title, head).with_word_columns(2);
    table.rows = places.iter().take(MAX_PLACES).map(row).collect();
    table.note = (places.len() > MAX_PLACES)
        .then(|| format!("{} more in report.json.", count(places.len() - MAX_PLACES, "place")));
    table
}
