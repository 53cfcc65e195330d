//! How the gap shrinks, stage by stage, on cycles that nothing was fitted to.

use super::distance::Distance;
use super::quantity::mm;
use super::{Block, FigureKind};
use crate::explain::answer::{Stage, StageKind};
use crate::explain::{Answer, Verdict};
use crate::report::page::Table;
use worm_estimator::number::{fixed, percent};

/// A model of the shrinking gap, in words.
#[derive(Debug, Clone, Copy)]
pub(in crate::report::explain) struct StageView {
    /// Its name in the answer.
    pub key: StageKind,
    /// Its name for people.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
}

const fn stage_view(key: StageKind, name: &'static str, meaning: &'static str) -> StageView {
    StageView { key, name, meaning }
}

/// The name of the noise floor, which is no model.
pub(super) const FLOOR: StageView = stage_view(StageKind::Floor, "noise floor", "no model can do better");

/// The models in reading order, as far as the answer has them.
pub(in crate::report::explain) fn stages(answer: &Answer) -> Vec<(StageView, &Stage)> {
    let named = match (answer.verdict, answer.effects.len()) {
        (Verdict::Ambiguous, _) => ("with the first candidate", "the model with the first of the candidates"),
        (_, 2..) => ("with the named effects", "the model with the effects named"),
        _ => ("with the named effect", "the model with the effect named"),
    };
    let wrong = match answer.effects.is_empty() {
        true => ("nearest effect", "the effect that comes nearest, which is not named"),
        false => ("best rival", "the best effect of another kind"),
    };
    let all = [
        stage_view(StageKind::Baseline, "nominal model", "the model as configured"),
        stage_view(
            StageKind::Recalibrated,
            "recalibrated model",
            "its known quantities adjusted within their priors; what it leaves is the gap that counts",
        ),
        stage_view(StageKind::BestWrong, wrong.0, wrong.1),
        stage_view(StageKind::Named, named.0, named.1),
        stage_view(
            StageKind::Law,
            "with the law",
            "the model with the law, which no effect describes",
        ),
        stage_view(
            StageKind::FreeForm,
            "free-form correction",
            "a correction of any form, fitted freely: about as much as can be closed",
        ),
    ];
    let known = all
        .into_iter()
        .filter_map(|view| Some((view, stage_of(answer, view.key)?)));
    known.collect()
}

/// A stage of the answer.
pub(in crate::report::explain) fn stage_of(answer: &Answer, key: StageKind) -> Option<&Stage> {
    answer.stages.iter().find(|stage| stage.stage == key)
}

impl StageView {
    /// Its name with its effect: `best rival: payload`.
    pub fn with_effect(&self, stage: &Stage) -> String {
        match &stage.effect {
            Some(effect) => format!("{}: {effect}", self.name),
            None => self.name.to_owned(),
        }
    }
}

pub(super) fn blocks(answer: &Answer) -> Vec<Block> {
    let stages = stages(answer);
    if stages.is_empty() {
        let why = "There are no stages to compare: the answer holds no model judged on held-out cycles.";
        return vec![Block::paragraph(why)];
    }
    let first = if answer.is_by_advances() {
        Block::paragraph("Nothing was held out of so few advances. What shrinks is the error of the model's advance.")
    } else {
        Block::Figure(FigureKind::Gap)
    };
    let doubt = doubt(answer);
    let doubt = (!doubt.is_empty()).then(|| Block::paragraph(&doubt));
    [Some(first), Some(Block::Table(table(answer, &stages))), doubt]
        .into_iter()
        .flatten()
        .collect()
}

/// What the judgement allows the model to be wrong by, how probable it is that the answer is none of the library, and how far the
/// advances agree; empty where none of it is known.
fn doubt(answer: &Answer) -> String {
    let doubt = &answer.doubt;
    let mut parts = Vec::new();
    if doubt.discrepancy_m.is_finite() && !answer.is_by_current_alone() {
        parts.push(format!(
            "The model is taken to be wrong by {} everywhere, smoothly over the step: an effect must explain more than that.",
            mm(doubt.discrepancy_m)
        ));
    }
    if doubt.null_probability.is_finite() && doubt.other_probability.is_finite() {
        parts.push(format!(
            "Nothing that matters is missing with a probability of {}, something outside the library with one of {}.",
            percent(doubt.null_probability),
            percent(doubt.other_probability)
        ));
    }
    if doubt.agrees_within_m.is_finite() {
        parts.push(format!(
            "The advance of a cycle is known and predicted to within {} on every run, with a probability of 95 %.",
            mm(doubt.agrees_within_m)
        ));
    }
    if let Some(within_j) = doubt.agrees_within_j.filter(|within_j| within_j.is_finite()) {
        parts.push(format!(
            "The work of a cycle by the motor's current, with the gears of this answer, and by its model agree to within {} mJ on every \
             run, with a probability of 95 %.",
            fixed(within_j * 1e3, 2)
        ));
    }
    if let Some(scatter) = doubt.friction_scatter.filter(|scatter| scatter.is_finite()) {
        parts.push(format!(
            "From one cycle to the next the body moves as irregularly as if the friction of every tip differed by {}.",
            percent(scatter)
        ));
    }
    parts.join(" ")
}

fn table(answer: &Answer, stages: &[(StageView, &Stage)]) -> Table {
    let floor = stage_of(answer, FLOOR.key).map(|stage| (FLOOR, stage));
    let stages = stages.iter().copied().chain(floor);
    let distance = Distance::of(answer);
    let advance_head = "error of advance, mm";
    let advance = |stage: &Stage| fixed(stage.advance_error_m * 1e3, 3);
    let title = "The gap, stage by stage";
    let (head, rows, note): (&[&str], Vec<_>, _) = if answer.is_by_advances() {
        (
            &["model", advance_head],
            stages
                .map(|(view, stage)| vec![view.with_effect(stage), advance(stage)])
                .collect(),
            "The error of the advance in a cycle is the mean over the slopes.",
        )
    } else if distance == Distance::Torque {
        let row = |(view, stage): (StageView, &Stage)| {
            let [fitted, held_out] = distance.of_stage(stage);
            let energy = fixed(stage.energy_error_j * 1e3, 2);
            vec![view.with_effect(stage), fixed(fitted, 3), fixed(held_out, 3), energy]
        };
        (
            &[
                "model",
                "torque left, fitted cycles, mN m",
                "torque left, held-out cycles, mN m",
                "error of work, mJ",
            ],
            stages.map(row).collect(),
            "Held-out cycles were kept out of every fit, so a model that merely bends to the data gains nothing there. The work of a \
             cycle is what the motor's current shows the cam take, by the gears of the best model.",
        )
    } else {
        let row = |(view, stage): (StageView, &Stage)| {
            let [fitted, held_out] = distance.of_stage(stage);
            vec![
                view.with_effect(stage),
                fixed(fitted, 3),
                fixed(held_out, 3),
                advance(stage),
                fixed(stage.energy_error_j * 1e3, 2),
            ]
        };
        (
            &[
                "model",
                "rms, fitted cycles, mm",
                "rms, held-out cycles, mm",
                advance_head,
                "error of energy (11), mJ",
            ],
            stages.map(row).collect(),
            "Held-out cycles were kept out of every fit, so a model that merely bends to the data gains nothing there. Errors \
             of advance and energy are per cycle, means over the runs. Nobody measured the energy: it is compared with what the \
             contacts of the best model take along the measured path.",
        )
    };
    Table {
        rows,
        note: Some(note.to_owned()),
        ..Table::new(title, head.iter().copied())
    }
}
