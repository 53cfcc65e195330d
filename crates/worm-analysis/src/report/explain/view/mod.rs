//! The answer in words: everything that the page and the terminal say of it, as data.

mod changes;
mod distance;
mod effects;
mod gap;
mod law;
mod next_experiment;
mod place;
mod quantity;
mod runs;
mod verdict;

pub(super) use distance::Distance;
pub(in crate::report) use effects::outcome;
pub(super) use effects::{best_model, best_of_each, is_tried, reached};
pub(super) use gap::{StageView, stage_of, stages};
pub(super) use quantity::{cells, mm};

use crate::explain::Answer;
use crate::report::page::{Table, TileRow};

/// Sections before that of a law: it follows the effects.
const AFTER_EFFECTS: usize = 2;

/// The whole answer in words.
#[derive(Debug, Clone)]
pub struct View {
    /// What the search looked at.
    pub lead: String,
    /// CSS class of the verdict.
    pub class: &'static str,
    /// The verdict in a word or two.
    pub badge: &'static str,
    /// The verdict in a sentence.
    pub headline: String,
    /// The answer's own sentence.
    pub sentence: String,
    /// The named effects with their values, and the gap.
    pub rows: Vec<TileRow>,
    /// How to read the values.
    pub note: String,
    /// Everything else, in reading order.
    pub sections: Vec<Section>,
}

/// A part of the answer under a heading.
#[derive(Debug, Clone)]
pub struct Section {
    /// The heading.
    pub heading: &'static str,
    /// What is below it.
    pub blocks: Vec<Block>,
}

/// A part of a section.
#[derive(Debug, Clone)]
pub enum Block {
    /// A paragraph.
    Paragraph(String),
    /// A table.
    Table(Table),
    /// A table too long for the terminal.
    LongTable(Table),
    /// A figure.
    Figure(FigureKind),
    /// Lines of the model's file before and after.
    Difference(Vec<DifferenceLine>),
}

impl Block {
    fn paragraph(text: impl Into<String>) -> Self {
        Self::Paragraph(text.into())
    }
}

/// The figures of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FigureKind {
    /// Residual by cell and phase.
    Map,
    /// Improvement by each effect of the library.
    Screening,
    /// The mean cycle, measured and by each model.
    Cycle,
    /// The mean torque on the cam, by the motor's current and by each model.
    Torque,
    /// The gap, stage by stage.
    Gap,
    /// A law that nobody listed, over the data that carry it.
    Law,
}

/// A line of a unified difference.
#[derive(Debug, Clone)]
pub struct DifferenceLine {
    /// What becomes of it.
    pub kind: LineKind,
    /// The line with its leading mark.
    pub text: String,
}

/// What becomes of a line of the model's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineKind {
    /// Names of files, or line numbers.
    Heading,
    /// Only the new file has it.
    Added,
    /// Only the old file has it.
    Removed,
    /// Both files have it.
    Kept,
}

impl View {
    /// The answer in words.
    pub fn of(answer: &Answer) -> Self {
        let (class, badge) = verdict::badge(answer.verdict);
        let section = |heading, blocks| Section { heading, blocks };
        let mut view = Self {
            lead: verdict::lead(answer),
            class,
            badge,
            headline: verdict::headline(answer),
            sentence: answer.sentence.clone(),
            rows: verdict::rows(answer),
            note: verdict::note(answer),
            sections: vec![
                section("Where is the gap?", place::blocks(answer)),
                section("Which effect is it, and why not another?", effects::blocks(answer)),
                section(
                    "The model before and after, against the data",
                    runs::cycle_blocks(answer),
                ),
                section("How the gap shrinks", gap::blocks(answer)),
                section("What was recalibrated first", changes::calibration_blocks(answer)),
                section("What changes in the model", changes::difference_blocks(answer)),
                section("What to try next", next_experiment::blocks(answer)),
                section("What the answer is based on", runs::blocks(answer)),
            ],
        };
        if let Some(blocks) = law::blocks(answer) {
            view.sections
                .insert(AFTER_EFFECTS, section("A law that nobody listed", blocks));
        }
        view
    }
}
