//! A law that nobody listed: what it says, and whether there is one.

use super::{Block, FigureKind};
use crate::explain::{Answer, Verdict};
use crate::report::law::paragraphs;

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
    let mut blocks: Vec<Block> = paragraphs(law).into_iter().map(Block::paragraph).collect();
    blocks.push(Block::Figure(FigureKind::Law));
    Some(blocks)
}
