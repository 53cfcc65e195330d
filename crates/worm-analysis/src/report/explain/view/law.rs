//! A law that nobody listed: what it says, and whether there is one.

use super::{Block, FigureKind};
use crate::explain::{Answer, Verdict};
use worm_estimator::number::percent;

/// What there is to say of a law; nothing where the library explains the data or no recording was searched.
pub(super) fn blocks(answer: &Answer) -> Option<Vec<Block>> {
    if answer.verdict != Verdict::OutsideLibrary || answer.is_by_advances() {
        return None;
    }
    let Some(law) = &answer.law else {
        return Some(vec![Block::paragraph(
            "There is no law to report: nothing smooth over deformation, its rate, speed, load, place, phase, slope or time predicts cycles \
             that it was not fitted to.",
        )]);
    };
    let [low, high] = law.closure_interval.map(percent);
    let mut blocks = vec![
        Block::paragraph(law.sentence.clone()),
        Block::paragraph(format!(
            "The closure lies between {low} and {high} (90 %). The law stands in the model as an effect named table, which every \
             simulation and prediction obeys. It is no cause: what lies beyond the data that carry it is not known."
        )),
    ];
    blocks.extend(
        law.formula
            .as_ref()
            .map(|formula| Block::paragraph(format!("A formula predicts as well: {formula}."))),
    );
    blocks.push(Block::Figure(FigureKind::Law));
    Some(blocks)
}
