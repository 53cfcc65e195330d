//! The figures of the page on an answer.

mod cycle;
mod gap;
mod map;
mod screening;
mod torque;

use super::view::FigureKind;
use crate::explain::Answer;
use crate::report::law;
use crate::report::page::Figure;
use crate::report::plot::DrawError;

/// A figure; none where the answer has nothing to draw.
pub(super) fn draw(kind: FigureKind, answer: &Answer) -> Result<Option<Figure>, DrawError> {
    let drawn = match kind {
        FigureKind::Map => map::figure(answer),
        FigureKind::Screening => screening::figure(answer),
        FigureKind::Cycle => cycle::figure(answer),
        FigureKind::Torque => torque::figure(answer),
        FigureKind::Gap => gap::figure(answer),
        FigureKind::Law => return answer.law.as_ref().map(law::figure).transpose(),
    };
    drawn.map(Some)
}
