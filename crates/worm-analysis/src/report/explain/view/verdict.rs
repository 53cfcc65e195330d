//! The verdict: what is missing, its values, and how far the gap shrinks.

use super::distance::Distance;
use super::effects::names;
use super::gap::{FLOOR, StageView, stage_of, stages};
use super::quantity::{ParameterView, cells, clause, formula, library_sentence};
use crate::explain::answer::{NamedEffect, RunSummary, Stage, StageKind, answers_in_words};
use crate::explain::{Answer, Verdict};
use crate::report::page::{Text, Tile, TileRow};
use crate::report::plot::cell_colours;
use crate::report::runs::{describe_each, names_by_slope};
use worm_estimator::number::{NONE, count, fixed, in_words, percent};

/// CSS class and name of a verdict.
pub(super) fn badge(verdict: Verdict) -> (&'static str, &'static str) {
    match verdict {
        Verdict::Agrees => ("agrees", "Model and data agree"),
        Verdict::Explained => ("explained", "Explained"),
        Verdict::Ambiguous => ("ambiguous", "Ambiguous"),
        Verdict::OutsideLibrary => ("outside-library", "Outside the library"),
    }
}

/// What the search looked at.
pub(super) fn lead(answer: &Answer) -> String {
    let warned = match answer.warnings.len() {
        0 => String::new(),
        warnings => format!(" With {}.", count(warnings, "warning")),
    };
    let names = names_by_slope(answer.runs.iter().map(|run| run.slope_deg));
    if answer.is_by_advances() {
        let advances = count(answer.runs.len(), "advance");
        return format!(
            "What the model of the worm misses, by {advances} a cycle, at {}, without a recording.{warned}",
            in_words(&names)
        );
    }
    let length = |run: &RunSummary| {
        let cycles = count(run.cycles, "whole cycle");
        Some(format!("{cycles} of {} s", fixed(run.cycle_s, 2)))
    };
    let lengths = match describe_each(&names, answer.runs.iter().map(length)) {
        none if none.is_empty() => "the answer lists none".to_owned(),
        same if answer.runs.len() > 1 && !same.contains('°') => format!("{same} each, at {}", in_words(&names)),
        lengths => lengths,
    };
    let recordings = count(answer.runs.len(), "recording");
    let by = match answer.is_by_current_alone() {
        true => format!("by the motor's current alone in {recordings}"),
        false => format!("by {recordings}"),
    };
    format!("What the model of the worm misses, {by}: {lengths}.{warned}")
}

/// What the answer is based on, in a word.
fn evidence(answer: &Answer) -> &'static str {
    if answer.is_by_advances() {
        "advances"
    } else {
        "recordings"
    }
}

/// The verdict in a sentence.
pub(super) fn headline(answer: &Answer) -> String {
    let evidence = evidence(answer);
    match (answer.verdict, &answer.effects[..]) {
        (Verdict::Agrees, _) => format!("Nothing is missing from the model that these {evidence} show for sure."),
        (Verdict::Explained, [effect]) => {
            let missing = match &effect.onset {
                Some(onset) => format!("Missing from the model: {}, {}.", effect.in_words(), onset.in_words()),
                None => format!("Missing from the model: {}.", effect.in_words()),
            };
            match library_sentence(&effect.name) {
                "" => missing,
                sentence => format!("{missing} {sentence}"),
            }
        }
        (Verdict::Explained, effects) => format!("Missing from the model: {}, which act together.", names(effects)),
        (Verdict::Ambiguous, effects) => format!(
            "Something is missing from the model, and these {evidence} cannot tell whether it is {}.",
            alternatives(effects, &answer.rivals)
        ),
        (Verdict::OutsideLibrary, _) if answer.is_misstated() => {
            "The recordings seem to have been made under other conditions than stated: nothing needs to be missing from the model.".to_owned()
        }
        (Verdict::OutsideLibrary, _) => {
            let alone = if answer.is_by_advances() { " alone" } else { "" };
            format!("Something is missing from the model, and no known effect{alone} explains it.")
        }
    }
}

/// Candidates as a choice: `a, b or c`; a pair counts as one.
fn alternatives(effects: &[NamedEffect], rivals: &[NamedEffect]) -> String {
    let first = (!effects.is_empty()).then(|| names(effects));
    let candidates: Vec<String> = first.into_iter().chain(answers_in_words(rivals)).collect();
    match &candidates[..] {
        [] => "one effect or another".to_owned(),
        [only] => format!("{only} or something else"),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// The effects with their values, then the gap.
pub(super) fn rows(answer: &Answer) -> Vec<TileRow> {
    let rivals = match answer.verdict {
        Verdict::Ambiguous => &answer.rivals[..],
        _ => &[],
    };
    let effects = answer.effects.iter().chain(rivals);
    effects
        .map(|effect| effect_row(answer, effect))
        .chain(gap(answer))
        .collect()
}

fn effect_row(answer: &Answer, effect: &NamedEffect) -> TileRow {
    let colours = cell_colours(cells(answer));
    let is_of_one_cell = effect.parameters.iter().any(|found| found.cell.is_some());
    TileRow {
        name: effect.name.clone(),
        dot: effect.cell.and_then(|cell| colours.get(cell.checked_sub(1)?).copied()),
        note: {
            let which = match effect.cell {
                Some(cell) => format!("cell {cell}"),
                None if is_of_one_cell => "one cell, unknown which".to_owned(),
                None => "the whole worm".to_owned(),
            };
            match &effect.onset {
                Some(onset) => format!("{which}, {}", onset.in_words()),
                None => which,
            }
        },
        tiles: effect_tiles(effect),
        foot: foot(answer, effect),
        ..TileRow::default()
    }
}

fn effect_tiles(effect: &NamedEffect) -> Vec<Tile> {
    let parameters = effect.parameters.iter().map(|found| {
        let view = ParameterView::of(&effect.name, found);
        let name = match found.cell.filter(|cell| Some(*cell) != effect.cell) {
            Some(cell) => format!("{}, cell {cell}", view.name),
            None => view.name,
        };
        Tile::new(name, view.value, view.unit, view.about)
    });
    let scores = [
        ("gap closed", effect.closure, "of what recalibration leaves open"),
        (
            "ahead of the others",
            effect.margin,
            "points of the gap, before the best of another kind",
        ),
        (
            "probability",
            effect.probability,
            "nothing and something else missing counted",
        ),
    ];
    let scores = scores.map(|(name, fraction, how)| {
        let value = percent(fraction);
        let (value, unit) = value.strip_suffix(" %").map_or((&*value, ""), |value| (value, "%"));
        Tile::new(name, value, unit, how)
    });
    // A score that could not be computed from the data is left out.
    parameters
        .chain(scores.into_iter().filter(|tile| tile.value != NONE))
        .collect()
}

/// What the effect does, unless the headline says so, what cannot be told apart from it, and what would separate them.
fn foot(answer: &Answer, effect: &NamedEffect) -> Vec<Vec<Text>> {
    let is_in_headline = answer.verdict == Verdict::Explained && answer.effects.len() == 1;
    let mut foot = Vec::new();
    match formula(&effect.name) {
        "" => {}
        formula => {
            let sentence = match is_in_headline {
                true => "In a formula:",
                false => library_sentence(&effect.name),
            };
            foot.push(vec![
                Text::Plain(format!("{sentence} ")),
                Text::Formula(formula.to_owned()),
            ]);
        }
    }
    let mut twins = match &effect.twins[..] {
        [] => vec![Text::Plain("No exact twin of it is known.".to_owned())],
        twins => vec![
            Text::Strong("No positions can tell it from".to_owned()),
            Text::Plain(format!(" {}.", in_words(twins))),
        ],
    };
    match clause(&effect.separated_by) {
        "" => {}
        by if effect.twins.is_empty() => {
            twins.push(Text::Plain(format!(" To separate it from its neighbours: {by}.")));
        }
        by => twins.extend([
            Text::Plain(" ".to_owned()),
            Text::Strong("What would:".to_owned()),
            Text::Plain(format!(" {by}.")),
        ]),
    }
    foot.push(twins);
    foot
}

fn gap(answer: &Answer) -> Option<TileRow> {
    let floor = stage_of(answer, FLOOR.key).map(|stage| (FLOOR, stage));
    let shown = stages(answer).into_iter().chain(floor).filter(|(view, stage)| {
        let is_shown = matches!(
            view.key,
            StageKind::Baseline | StageKind::Recalibrated | StageKind::Named | StageKind::Law | StageKind::Floor
        );
        is_shown && (!answer.is_by_advances() || stage.held_out_rms_m.is_finite())
    });
    let distance = Distance::of(answer);
    let tile = |(view, stage): (StageView, &Stage)| {
        let how = match view.key {
            StageKind::Recalibrated => "within the priors",
            StageKind::Floor => view.meaning,
            _ => "",
        };
        Tile::new(view.name, fixed(distance.held_out(stage), 3), distance.unit(), how)
    };
    let tiles: Vec<Tile> = shown.map(tile).collect();
    (!tiles.is_empty()).then(|| TileRow {
        name: "The gap".to_owned(),
        note: format!("{}, on held-out cycles", distance.in_words()),
        tiles,
        ..TileRow::default()
    })
}

/// How to read the values.
pub(super) fn note(answer: &Answer) -> String {
    match (answer.verdict, answer.effects.is_empty()) {
        (Verdict::Agrees, _) => format!(
            "An effect too weak to stand out from the noise of these {} may still be there; longer recordings and more slopes show \
             weaker ones.",
            evidence(answer)
        ),
        (_, true) => match &answer.law {
            Some(law) => format!("No effect is named, but there is a law. {}", law.sentence),
            None => "No value is given, for no effect is named.".to_owned(),
        },
        (_, false) if answer.is_by_advances() => {
            "± is one standard error. So few scalars leave much open: each value is what this effect would need if it alone were \
             missing."
                .to_owned()
        }
        (_, false) => "± is one standard error. The gap closed is counted from the recalibrated model down to the noise floor, on \
                       cycles that the effect was not fitted to: 100 % leaves only noise."
            .to_owned(),
    }
}
