//! The figures of the page on an answer.

mod cycle;
mod gap;
mod law;
mod map;
mod screening;
mod torque;

use super::view::FigureKind;
use crate::explain::Answer;
use crate::report::page::Figure;
use crate::report::plot::DrawError;

pub(super) fn draw(kind: FigureKind, answer: &Answer) -> Result<Figure, DrawError> {
    match kind {
        FigureKind::Map => map::figure(answer),
        FigureKind::Screening => screening::figure(answer),
        FigureKind::Cycle => cycle::figure(answer),
        FigureKind::Torque => torque::figure(answer),
        FigureKind::Gap => gap::figure(answer),
        FigureKind::Law => law::figure(answer),
    }
}
