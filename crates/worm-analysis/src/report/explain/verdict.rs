//! The head of the page: the answer in a sentence, then its values, before any figure.

use super::words::{self, Quantity, clause, with_cell};
use crate::explain::answer::{NamedEffect, RunSummary, Stage, StageKind, answers_in_words};
use crate::explain::{Answer, Verdict};
use crate::report::number::{NONE, count, fixed, in_words, percent};
use crate::report::page::{Page, escaped};
use crate::report::plot::{cell_colours, css};
use crate::report::runs::{names_by_slope, told};
use crate::report::tile::{Tile, push_row};

pub(super) fn add(page: &mut Page, title: &str, answer: &Answer) {
    page.html(&format!("<h1>{}</h1>", escaped(title)));
    page.html(&format!("<p class=\"lead\">{}</p>", escaped(&lead(answer))));
    let (class, badge) = match answer.verdict {
        Verdict::Agrees => ("agrees", "Model and data agree"),
        Verdict::Explained => ("explained", "Explained"),
        Verdict::Ambiguous => ("ambiguous", "Ambiguous"),
        Verdict::OutsideLibrary => ("outside-library", "Outside the library"),
    };
    page.html(&format!(
        "<section class=\"verdict {class}\"><p class=\"badge\">{badge}</p><p class=\"headline\">{}</p><p>{}</p></section>",
        escaped(&headline(answer)),
        escaped(&answer.sentence)
    ));
    page.html(&values(answer));
    page.html(&format!("<p class=\"note\">{}</p>", escaped(&note(answer))));
}

fn lead(answer: &Answer) -> String {
    let warned = match answer.warnings.len() {
        0 => String::new(),
        warnings => format!(" {} at the end of this page.", count(warnings, "warning")),
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
    let lengths = match told(&names, answer.runs.iter().map(length)) {
        none if none.is_empty() => "the answer lists none".to_owned(),
        same if answer.runs.len() > 1 && !same.contains('°') => format!("{same} each, at {}", in_words(&names)),
        told => told,
    };
    format!(
        "What the model of the worm misses, by {}: {lengths}.{warned}",
        count(answer.runs.len(), "recording")
    )
}

fn headline(answer: &Answer) -> String {
    match (answer.verdict, &answer.effects[..]) {
        (Verdict::Agrees, _) => {
            format!(
                "Nothing is missing from the model that these {} could show.",
                words::evidence(answer)
            )
        }
        (Verdict::Explained, [effect]) => {
            let about = words::sentence(&effect.name);
            format!(
                "Missing from the model: {}. {about}",
                with_cell(&effect.name, effect.cell)
            )
        }
        (Verdict::Explained, effects) => {
            format!("Missing from the model: {}, which act together.", words::names(effects))
        }
        (Verdict::Ambiguous, effects) => format!(
            "Something is missing from the model, and these {} cannot tell whether it is {}.",
            words::evidence(answer),
            either(effects, &answer.rivals)
        ),
        (Verdict::OutsideLibrary, _) if answer.is_by_advances() => {
            "Something is missing from the model, and no known effect alone explains it.".to_owned()
        }
        (Verdict::OutsideLibrary, _) => {
            "Something is missing from the model, and no known effect explains it.".to_owned()
        }
    }
}

/// Candidates as a choice: `a, b or c`; a pair counts as one.
fn either(effects: &[NamedEffect], rivals: &[NamedEffect]) -> String {
    let mut candidates = Vec::new();
    if !effects.is_empty() {
        candidates.push(words::names(effects));
    }
    candidates.extend(answers_in_words(rivals));
    match &candidates[..] {
        [] => "one effect or another".to_owned(),
        [only] => format!("{only} or another effect"),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

fn values(answer: &Answer) -> String {
    let mut html = "<section class=\"answer\">".to_owned();
    let rivals = match answer.verdict {
        Verdict::Ambiguous => &answer.rivals[..],
        _ => &[],
    };
    let colours = cell_colours(words::cells(answer));
    let is_told = answer.verdict == Verdict::Explained && answer.effects.len() == 1;
    for effect in answer.effects.iter().chain(rivals) {
        let dot = effect.cell.and_then(|cell| {
            let colour = colours.get(cell.checked_sub(1)?)?;
            Some(format!("<i style=\"--c:{}\"></i>", css(*colour)))
        });
        let of_one_cell = effect.parameters.iter().any(|found| found.cell.is_some());
        let cell = match effect.cell {
            None if of_one_cell => "<small>one cell, not told which</small>".to_owned(),
            Some(cell) => format!("<small>{}cell {cell}</small>", dot.unwrap_or_default()),
            None => "<small>the whole worm</small>".to_owned(),
        };
        let place = format!("<b>{}</b>{cell}", escaped(&effect.name));
        push_row(&mut html, &place, &tiles(effect), &foot(effect, is_told));
    }
    let gap = gap_tiles(answer);
    if !gap.is_empty() {
        let place = "<b>The gap</b><small>root mean square distance of model and data within a cycle, on held-out cycles</small>";
        push_row(&mut html, place, &gap, "");
    }
    if answer.effects.is_empty() && gap.is_empty() {
        return String::new();
    }
    html.push_str("</section>");
    html
}

fn tiles(effect: &NamedEffect) -> Vec<Tile> {
    let parameters = effect.parameters.iter().map(|found| {
        let quantity = Quantity::of(&effect.name, found);
        let name = match found.cell.filter(|cell| Some(*cell) != effect.cell) {
            Some(cell) => format!("{}, cell {cell}", quantity.name),
            None => quantity.name,
        };
        Tile {
            name: escaped(&name),
            value: quantity.value,
            unit: quantity.unit,
            how: quantity.about.to_owned(),
        }
    });
    let fraction = |name: &str, fraction: f64, how: &str| {
        let value = percent(fraction);
        let (value, unit) = value.strip_suffix(" %").map_or((&*value, ""), |value| (value, "%"));
        Tile {
            name: name.to_owned(),
            value: value.to_owned(),
            unit: unit.to_owned(),
            how: how.to_owned(),
        }
    };
    let judged = [
        fraction("gap closed", effect.closure, "of what recalibration leaves open"),
        fraction(
            "ahead of the others",
            effect.margin,
            "points of the gap, before the best of another kind",
        ),
        fraction("probability", effect.probability, "among the effects of the library"),
    ];
    // What was not held against anything is not told as a dash.
    let told = judged.into_iter().filter(|tile| tile.value != NONE);
    parameters.chain(told).collect()
}

/// What the effect does, unless the headline told it, what cannot be told from it, and what would tell: HTML.
fn foot(effect: &NamedEffect, is_told: bool) -> String {
    let formula = match words::formula(&effect.name) {
        "" => String::new(),
        formula => {
            let sentence = if is_told {
                "In a formula:"
            } else {
                words::sentence(&effect.name)
            };
            let formula = escaped(formula);
            format!("<p>{} <span class=\"formula\">{formula}</span></p>", escaped(sentence))
        }
    };
    let twins = if effect.twins.is_empty() {
        "No exact twin of it is known.".to_owned()
    } else {
        let twins: Vec<String> = effect.twins.iter().map(|twin| escaped(twin)).collect();
        format!("<b>No positions can tell it from</b> {}.", in_words(&twins))
    };
    let separated = match clause(&effect.separated_by) {
        "" => String::new(),
        by if effect.twins.is_empty() => format!(" What tells it from its neighbours: {}.", escaped(by)),
        by => format!(" <b>What would:</b> {}.", escaped(by)),
    };
    format!("<div class=\"foot\">{formula}<p>{twins}{separated}</p></div>")
}

fn gap_tiles(answer: &Answer) -> Vec<Tile> {
    let held_out = answer
        .stages
        .iter()
        .filter(|stage| !answer.is_by_advances() || stage.held_out_rms_m.is_finite());
    let stages = held_out.filter_map(|stage| {
        let (name, how) = match stage.stage {
            StageKind::Baseline => ("as believed", ""),
            StageKind::Recalibrated => ("recalibrated", "within what was allowed"),
            StageKind::Named if answer.verdict == Verdict::Ambiguous => ("with the first candidate", ""),
            StageKind::Named if answer.effects.len() > 1 => ("with the effects named", ""),
            StageKind::Named => ("with the effect named", ""),
            StageKind::Floor => ("noise floor", "no model can do better"),
            StageKind::BestWrong | StageKind::FreeForm => return None,
        };
        Some(gap_tile(stage, name, how))
    });
    stages.collect()
}

fn gap_tile(stage: &Stage, name: &str, how: &str) -> Tile {
    Tile {
        name: name.to_owned(),
        value: fixed(stage.held_out_rms_m * 1e3, 3),
        unit: "mm".to_owned(),
        how: how.to_owned(),
    }
}

fn note(answer: &Answer) -> String {
    match (answer.verdict, answer.effects.is_empty()) {
        (Verdict::Agrees, _) => {
            format!(
                "An effect too weak to stand out of the noise of these {} may still be there; longer recordings and more slopes \
                 show weaker ones.",
                words::evidence(answer)
            )
        }
        (_, false) if answer.is_by_advances() => {
            "± is one standard error. So few scalars leave much open: each value is what this effect would need if it alone were \
             missing."
                .to_owned()
        }
        (_, true) => "No value is given, for no effect is named.".to_owned(),
        (_, false) => {
            "± is one standard error. The gap closed is counted from the recalibrated model down to the noise floor, on cycles that \
             the effect was not fitted to: 100 % leaves nothing but noise."
                .to_owned()
        }
    }
}
