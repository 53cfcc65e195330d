//! Which effect, and why not another: the candidates beside each other, and the screening of the whole library.

use super::distance::Distance;
use super::quantity::{ParameterView, clause};
use super::{Block, FigureKind, place, stage_of};
use crate::explain::answer::{NamedEffect, Remainder, Screened, ScreeningOutcome, StageKind, with_cell};
use crate::explain::{Answer, Verdict};
use crate::report::page::Table;
use std::collections::HashSet;
use worm_estimator::number::{count, fixed, in_words, percent, significant};

/// Most lines that the table of the screening has.
const MAX_SCREENED: usize = 60;

pub(super) fn blocks(answer: &Answer) -> Vec<Block> {
    let mut blocks = vec![Block::Paragraph(why(answer))];
    if let Some(remainder) = &answer.remainder {
        blocks.extend(remainder_blocks(remainder));
    }
    blocks.push(match answer.screening.is_empty() {
        true => Block::paragraph("There is no figure of the library: the answer holds no screening of it."),
        false => Block::Figure(FigureKind::Screening),
    });
    blocks.push(match answer.effects.is_empty() && answer.rivals.is_empty() {
        true => Block::paragraph("No effect is listed as a candidate, so there are none to compare."),
        false => Block::Table(candidates(answer)),
    });
    if !answer.screening.is_empty() {
        blocks.push(Block::LongTable(library(answer)));
    }
    blocks
}

fn remainder_blocks(remainder: &Remainder) -> Vec<Block> {
    let description = clause(&remainder.description);
    let mut text = format!("What is left: {description}.");
    // That of recordings begins with it.
    if !description.contains("of the gap") {
        let open = percent(remainder.open_share);
        text += &format!(" {open} of the gap stays open after the best effect.");
    }
    if let Some(onset) = &remainder.onset {
        text += &format!(" Something is different {}.", onset.in_words());
    }
    if let Some(cycles) = remainder.period_cycles {
        text += &format!(" It comes back every {} cycles.", significant(cycles, 3));
    }
    if let Some(period_m) = remainder.period_m {
        text += &format!(
            " It comes back every {} mm of the canal.",
            significant(1e3 * period_m, 3)
        );
    }
    let mut blocks = vec![Block::Paragraph(text)];
    if !remainder.places.is_empty() {
        blocks.push(Block::Table(place::table("Where it is largest", &remainder.places)));
    }
    blocks
}

fn why(answer: &Answer) -> String {
    let chance = if answer.threshold.is_finite() && answer.is_by_advances() {
        format!(
            "A right model leaves a chi-squared above {} one time in twenty.",
            fixed(answer.threshold, 1)
        )
    } else if answer.threshold.is_finite() {
        format!(
            "On this campaign with nothing missing, the best of the whole library would improve the fit by more than {} one time in \
             a hundred: an effect below that proves nothing.",
            fixed(answer.threshold, 1)
        )
    } else {
        "How far chance alone would improve the fit is not known.".to_owned()
    };
    let best = best_of_each(answer).into_iter().next();
    let best = best.map(|best| (with_cell(&best.name, best.cell), reached(best)));
    let verdict = match (answer.verdict, &answer.effects[..], best) {
        (Verdict::Agrees, _, Some((best, reached))) => format!(
            "No effect is needed: the best of the library, {best}, improves the fit by {}.",
            fixed(reached, 1)
        ),
        (Verdict::Agrees, _, None) => "No effect is needed.".to_owned(),
        (Verdict::Explained, [effect], _) => format!(
            "With {} the fit improves by {}{}{}.",
            effect.in_words(),
            fixed(effect.improvement, 0),
            closed(effect),
            against_best_rival(answer)
        ),
        (Verdict::Explained, effects, _) => format!(
            "No single effect explains the data; {} together {}{}.",
            names(effects),
            match effects.first().map(|effect| effect.closure) {
                Some(closure) if closure.is_finite() => format!("close {} of the gap", percent(closure)),
                _ => "do".to_owned(),
            },
            against_best_rival(answer)
        ),
        (Verdict::Ambiguous, effects, _) if answer.is_by_advances() => format!(
            "Each of these alone brings the model within chance of the advances: {}. To name one would be a guess.",
            names(effects.iter().chain(&answer.rivals))
        ),
        (Verdict::Ambiguous, effects, _) => {
            let candidates = effects.iter().chain(&answer.rivals);
            let weighed = candidates.map(|effect| format!("{} {}", effect.in_words(), percent(effect.probability)));
            format!(
                "Several effects are about as probable: {}. To name one would be a guess.",
                in_words(&weighed.collect::<Vec<_>>())
            )
        }
        (Verdict::OutsideLibrary, _, Some((best, reached))) => format!(
            "The best of the library, {best}, improves the fit by {}, yet what it leaves is not noise. Naming it would hide the \
             real cause.",
            fixed(reached, 0)
        ),
        (Verdict::OutsideLibrary, _, None) => "No effect of the library leaves only noise.".to_owned(),
    };
    format!("{verdict} {chance}")
}

/// How much of the gap an effect closes, as a clause; empty where the gap is within its error.
fn closed(effect: &NamedEffect) -> String {
    if effect.closure.is_finite() {
        format!(", and {} of the gap closes", percent(effect.closure))
    } else {
        String::new()
    }
}

/// What the named effect and the best of another kind leave, as a clause; empty where there was none.
fn against_best_rival(answer: &Answer) -> String {
    let (Some(rival), Some(named)) = (
        stage_of(answer, StageKind::BestWrong),
        stage_of(answer, StageKind::Named),
    ) else {
        return String::new();
    };
    let distance = Distance::of(answer);
    let other = rival.effect.as_deref().unwrap_or("the best effect of another kind");
    format!(
        ", down to {}; the best of another kind, {other}, leaves {}",
        distance.held_out_in_words(named),
        distance.held_out_in_words(rival)
    )
}

/// Several effects in words, in their order.
pub(super) fn names<'a>(effects: impl IntoIterator<Item = &'a NamedEffect>) -> String {
    in_words(&effects.into_iter().map(NamedEffect::in_words).collect::<Vec<_>>())
}

/// The model with the named effects in it, in words; that of the best candidate where there are several, of the nearest where none is named.
pub(in crate::report::explain) fn best_model(answer: &Answer) -> String {
    match &answer.effects[..] {
        [] => {
            let nearest = stage_of(answer, StageKind::BestWrong).and_then(|stage| stage.effect.as_deref());
            format!("with the nearest effect, {}", nearest.unwrap_or("none"))
        }
        effects => format!("with {}", names(effects)),
    }
}

/// How far an effect improved the fit: as refitted, else as expected.
pub(in crate::report::explain) fn reached(entry: &Screened) -> f64 {
    entry.improvement.unwrap_or(entry.score)
}

/// Whether an effect can be seen in the data, and was looked for.
pub(in crate::report::explain) fn is_tried(entry: &Screened) -> bool {
    !matches!(entry.outcome, ScreeningOutcome::NotVisible | ScreeningOutcome::LeftOut)
}

/// What became of an effect, in words.
pub(in crate::report) const fn outcome(entry: &Screened) -> &'static str {
    match entry.outcome {
        ScreeningOutcome::ScreenedOut => "not refitted, others promised more",
        ScreeningOutcome::Refitted => "refitted",
        ScreeningOutcome::DidNotConverge => "the fit did not converge",
        ScreeningOutcome::NotVisible => "not visible in these data",
        ScreeningOutcome::LeftOut => "left out of the search",
    }
}

/// The best entry of each effect, best first; those not tried last.
pub(in crate::report::explain) fn best_of_each(answer: &Answer) -> Vec<&Screened> {
    let mut sorted: Vec<&Screened> = answer.screening.iter().collect();
    let rank = |entry: &Screened| match reached(entry) {
        reached if reached.is_nan() => f64::NEG_INFINITY,
        reached => reached,
    };
    sorted.sort_by(|one, other| {
        let tried = is_tried(other).cmp(&is_tried(one));
        tried.then(rank(other).total_cmp(&rank(one)))
    });
    let mut names = HashSet::new();
    sorted.retain(|entry| names.insert(&entry.name));
    sorted
}

/// The effects named and their rivals beside each other.
fn candidates(answer: &Answer) -> Table {
    let is_held_out = !answer.is_by_advances();
    let mut head = vec!["effect", "", "values"];
    head.extend(
        is_held_out
            .then_some(["gap closed", "ahead of the others"])
            .into_iter()
            .flatten(),
    );
    head.extend(["probability", "improvement"]);
    let (named, rival) = match answer.verdict {
        Verdict::Explained => ("named", "rival"),
        Verdict::Ambiguous => ("candidate", "candidate"),
        _ => ("candidate", "rival"),
    };
    let row = |(effect, role): (&NamedEffect, &str)| {
        let parameters = effect.parameters.iter();
        let values = parameters.map(|found| ParameterView::of(&effect.name, found).in_words());
        let role = match &effect.together_with[..] {
            [] => role.to_owned(),
            others => format!("{role}, with {}", in_words(others)),
        };
        let mut row = vec![effect.in_words(), role, values.collect::<Vec<_>>().join("; ")];
        if is_held_out {
            row.extend([percent(effect.closure), percent(effect.margin)]);
        }
        row.extend([percent(effect.probability), fixed(effect.improvement, 1)]);
        row
    };
    let effects = answer.effects.iter().map(|effect| (effect, named));
    let rivals = answer.rivals.iter().map(|effect| (effect, rival));
    let held_out = if is_held_out {
        "Gap closed: fraction of what the recalibrated model leaves open, down to the noise, on cycles that the effect was not \
         fitted to. Ahead of the others: how much less of it the best effect of another kind closes. "
    } else {
        ""
    };
    Table {
        rows: effects.chain(rivals).map(row).collect(),
        note: Some(format!("{held_out}± is one standard error.")),
        ..Table::new("The candidates", head).with_word_columns(3)
    }
}

/// Every entry of the screening.
fn library(answer: &Answer) -> Table {
    let head = ["effect", "outcome", "expected", "improvement"];
    let row = |entry: &Screened| {
        vec![
            with_cell(&entry.name, entry.cell),
            outcome(entry).to_owned(),
            fixed(entry.score, 1),
            fixed(entry.improvement.unwrap_or(f64::NAN), 1),
        ]
    };
    let more = match answer.screening.len().saturating_sub(MAX_SCREENED) {
        0 => String::new(),
        more => format!(" {} more in report.json.", count(more, "line")),
    };
    Table {
        rows: answer.screening.iter().take(MAX_SCREENED).map(row).collect(),
        note: Some(format!(
            "Expected: the improvement predicted to first order, before any refit. Threshold: {}.{more}",
            fixed(answer.threshold, 1)
        )),
        ..Table::new("The whole library, screened", head).with_word_columns(2)
    }
}
