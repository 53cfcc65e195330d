//! Which effect, and why not another: the candidates beside each other, and the screening of the whole library.

use super::map;
use super::words::{self, Quantity, clause, mm, with_cell};
use crate::explain::answer::{NamedEffect, Screened, ScreeningOutcome, StageKind};
use crate::explain::{Answer, Verdict};
use crate::report::number::{count, fixed, in_words, percent, significant};
use crate::report::page::{Figure, Key, Mark, Page, Panel};
use crate::report::plot::{ACCENT, Axis, DrawError, INK, LIGHT, MID, MUTED, PAPER, Row, SHADE, Sheet, Stroke, draw};
use crate::report::table::Table;
use std::collections::HashSet;

/// Height of a bar's row, units.
const ROW: f64 = 21.0;
const HALF_BAR: f64 = 0.32;
/// Below this an improvement is nothing, and its bar has no length.
const LEAST: f64 = 1.0;
/// Most lines that the table of the screening has.
const MAX_SCREENED: usize = 60;

pub(super) fn add(page: &mut Page, answer: &Answer) -> Result<(), DrawError> {
    page.paragraph(&why(answer));
    if let Some(remainder) = &answer.remainder {
        page.paragraph(&format!(
            "What is left: {}. {} of the gap stays open after the best effect.",
            clause(&remainder.description),
            percent(remainder.open_share)
        ));
        if let Some(period) = remainder.period_cycles {
            page.paragraph(&format!("It comes back every {} cycles.", significant(period, 3)));
        }
        if let Some(period_m) = remainder.period_m {
            page.paragraph(&format!(
                "It comes back every {} mm of the canal.",
                significant(1e3 * period_m, 3)
            ));
        }
        if !remainder.places.is_empty() {
            let mut table = map::table(&remainder.places);
            table.title = "Where it is largest".to_owned();
            page.table(&table);
        }
    }
    if answer.screening.is_empty() {
        page.paragraph("There is no figure of the library: the answer holds no screening of it.");
    } else {
        page.figure(&figure(answer)?);
    }
    if answer.effects.is_empty() && answer.rivals.is_empty() {
        page.paragraph("No effect is listed as a candidate, so there are none to compare.");
    } else {
        page.table(&candidates(answer));
    }
    if !answer.screening.is_empty() {
        page.table(&library(answer));
    }
    Ok(())
}

fn why(answer: &Answer) -> String {
    let chance = if answer.threshold.is_finite() {
        format!(
            "Chance alone lets the best of the whole library improve the fit by {} one time in twenty: what stays below that \
             proves nothing.",
            fixed(answer.threshold, 1)
        )
    } else {
        "How far chance alone would improve the fit is not known.".to_owned()
    };
    let best = best_of_each(answer).into_iter().next();
    let verdict = match (answer.verdict, &answer.effects[..]) {
        (Verdict::Agrees, _) => match best {
            Some(best) => format!(
                "No effect is needed: the best of the library, {}, improves the fit by {}.",
                with_cell(&best.name, best.cell),
                fixed(best.reached(), 1)
            ),
            None => "No effect is needed.".to_owned(),
        },
        (Verdict::Explained, [effect]) => format!(
            "With {} the fit improves by {}, and {} of the gap closes{}.",
            with_cell(&effect.name, effect.cell),
            fixed(effect.improvement, 0),
            percent(effect.closure),
            best_wrong(answer)
        ),
        (Verdict::Explained, effects) => format!(
            "No single effect explains the data; {} together close {} of the gap{}.",
            words::names(effects),
            percent(effects.first().map_or(f64::NAN, |effect| effect.closure)),
            best_wrong(answer)
        ),
        (Verdict::Ambiguous, effects) if answer.is_by_advances() => format!(
            "Each of these alone brings the model within chance of the advances: {}. To name one would be a guess.",
            words::names(effects.iter().chain(&answer.rivals))
        ),
        (Verdict::Ambiguous, effects) => {
            let candidates = effects.iter().chain(&answer.rivals);
            let closed: Vec<String> = candidates
                .map(|effect| format!("{} {}", with_cell(&effect.name, effect.cell), percent(effect.closure)))
                .collect();
            format!(
                "Several effects close about as much of the gap: {}. To name one would be a guess.",
                in_words(&closed)
            )
        }
        (Verdict::OutsideLibrary, _) => match best {
            Some(best) => format!(
                "The best of the library, {}, improves the fit by {}, yet what it leaves is not noise. Naming it would hide what is \
                 really there.",
                with_cell(&best.name, best.cell),
                fixed(best.reached(), 0)
            ),
            None => "No effect of the library leaves only noise.".to_owned(),
        },
    };
    format!("{verdict} {chance}")
}

/// What the best effect of another kind leaves, as a clause; empty where there was none.
fn best_wrong(answer: &Answer) -> String {
    let stage = |kind: StageKind| answer.stages.iter().find(|stage| stage.stage == kind);
    let (Some(wrong), Some(named)) = (stage(StageKind::BestWrong), stage(StageKind::Named)) else {
        return String::new();
    };
    let other = wrong.effect.as_deref().unwrap_or("the best effect of another kind");
    format!(
        ", down to {}; the best of another kind, {other}, leaves {}",
        mm(named.held_out_rms_m),
        mm(wrong.held_out_rms_m)
    )
}

impl Screened {
    /// How far it raised the fit: as refitted, else as expected.
    fn reached(&self) -> f64 {
        self.improvement.unwrap_or(self.score)
    }

    /// What became of it, in words.
    fn outcome_in_words(&self) -> &'static str {
        match self.outcome {
            ScreeningOutcome::ScreenedOut => "not refitted, others promised more",
            ScreeningOutcome::Refitted => "refitted",
            ScreeningOutcome::DidNotConverge => "the fit did not converge",
            ScreeningOutcome::NotVisible => "not visible in these data",
        }
    }

    fn is_visible(&self) -> bool {
        self.outcome != ScreeningOutcome::NotVisible
    }
}

/// The best entry of each effect, best first; those not visible last.
fn best_of_each(answer: &Answer) -> Vec<&Screened> {
    let mut sorted: Vec<&Screened> = answer.screening.iter().collect();
    let rank = |entry: &Screened| {
        if entry.reached().is_nan() {
            f64::NEG_INFINITY
        } else {
            entry.reached()
        }
    };
    sorted.sort_by(|one, other| {
        let visible = other.is_visible().cmp(&one.is_visible());
        visible.then(rank(other).total_cmp(&rank(one)))
    });
    let mut seen = HashSet::new();
    sorted.retain(|entry| seen.insert(&entry.name));
    sorted
}

fn is_named(answer: &Answer, entry: &Screened) -> bool {
    answer.effects.iter().any(|effect| effect.name == entry.name)
}

fn figure(answer: &Answer) -> Result<Figure, DrawError> {
    Ok(Figure {
        id: "screening",
        title: "How much each effect of the library improves the fit".to_owned(),
        keys: keys(answer),
        panels: vec![Panel {
            title: "improvement".to_owned(),
            quantity: "rise of twice the log likelihood, logarithmic".to_owned(),
            svg: picture(answer)?,
        }],
        caption: "Each effect at its best cell. The further a bar reaches beyond the dashed line, the surer it is that \
                  something like that effect is there. Effects of the same look rise together: only the one that leaves no gap is \
                  the answer."
            .to_owned(),
    })
}

fn keys(answer: &Answer) -> Vec<Key> {
    let mut keys = Vec::new();
    if answer.screening.iter().any(|entry| is_named(answer, entry)) {
        let role = match answer.verdict {
            Verdict::Ambiguous => "first candidate",
            _ => "named",
        };
        keys.push(Key::new(Mark::Box, ACCENT, role));
    }
    keys.extend([
        Key::new(Mark::Box, SHADE, "refitted"),
        Key::new(Mark::Box, LIGHT, "as expected from its first trace; not refitted"),
        Key::new(Mark::Frame, MUTED, "as expected; the refit did not converge"),
        Key::new(Mark::Dashed, INK, "what chance reaches one time in twenty"),
    ]);
    keys
}

fn picture(answer: &Answer) -> Result<String, DrawError> {
    let bars = best_of_each(answer);
    let names = bars.iter().map(|bar| match bar.cell {
        Some(cell) => format!("{}, cell {cell}", bar.name),
        None => bar.name.clone(),
    });
    let values = bars.iter().map(|bar| bar.reached()).chain([answer.threshold]);
    let over = bars.iter().filter(|bar| bar.reached() > answer.threshold).count();
    let sheet = Sheet {
        description: format!(
            "Improvement by each effect of the library: {over} of {} beyond the threshold of {}",
            bars.len(),
            fixed(answer.threshold, 1)
        ),
        x_label: Some("improvement".to_owned()),
        x: Axis::powers_of_ten(LEAST, values),
        rows: vec![Row::new(Axis::listed(names.collect()), ROW * bars.len() as f64)],
    };
    draw(&sheet, |_, plot| {
        let top = bars.len() as f64 - 0.5;
        for (number, bar) in bars.iter().enumerate() {
            let row = (bars.len() - 1 - number) as f64;
            if !bar.is_visible() {
                plot.words_behind(LEAST, row, MUTED, bar.outcome_in_words())?;
                continue;
            }
            let reached = bar.reached();
            let colour = match bar.improvement {
                Some(_) if is_named(answer, bar) => ACCENT,
                Some(_) => SHADE,
                None => LIGHT,
            };
            let end = reached.max(LEAST);
            let (along, across) = ([LEAST, end], [row - HALF_BAR, row + HALF_BAR]);
            if bar.outcome == ScreeningOutcome::DidNotConverge {
                plot.edge(along, across, Stroke::new(MUTED, 1.5))?;
            } else {
                plot.fill(along, across, colour, 1.0)?;
            }
            plot.words_behind(end, row, INK, &significant(reached, 2))?;
        }
        let invisible = bars.iter().filter(|bar| !bar.is_visible()).count() as f64;
        // Pale under the dashes, so that they are seen on a dark bar.
        plot.upright(answer.threshold, invisible - 0.5, top, Stroke::new(PAPER, 3.0))?;
        plot.upright(answer.threshold, invisible - 0.5, top, Stroke::new(INK, 1.5).dashed())?;
        plot.name_above(
            answer.threshold,
            MID,
            &format!("chance: {}", fixed(answer.threshold, 1)),
        )
    })
}

/// The effects named and their rivals beside each other.
fn candidates(answer: &Answer) -> Table {
    let is_held_out = !answer.is_by_advances();
    let judged: &[&str] = if is_held_out {
        &["gap closed", "ahead of the others"]
    } else {
        &[]
    };
    let head = [&["effect", "", "values"], judged, &["probability", "improvement"]].concat();
    let mut table = Table::new("The candidates", head);
    table.word_columns = 3;
    let named = match answer.verdict {
        Verdict::Explained => "named",
        _ => "candidate",
    };
    let mut add = |effect: &NamedEffect, role: &str| {
        let quantities = effect
            .parameters
            .iter()
            .map(|found| Quantity::of(&effect.name, found).in_words());
        let mut row = vec![
            with_cell(&effect.name, effect.cell),
            role.to_owned(),
            quantities.collect::<Vec<_>>().join("; "),
        ];
        if is_held_out {
            row.extend([percent(effect.closure), percent(effect.margin)]);
        }
        row.extend([percent(effect.probability), fixed(effect.improvement, 1)]);
        table.rows.push(row);
    };
    answer.effects.iter().for_each(|effect| add(effect, named));
    let rival = match answer.verdict {
        Verdict::Ambiguous => "candidate",
        _ => "rival",
    };
    for effect in &answer.rivals {
        match &effect.together_with[..] {
            [] => add(effect, rival),
            others => add(effect, &format!("{rival}, with {}", in_words(others))),
        }
    }
    let held_out = if is_held_out {
        "Gap closed: share of what the recalibrated model leaves open, down to the noise, on cycles that the effect was not \
         fitted to. Ahead of the others: how much less of it the best effect of another kind closes. "
    } else {
        ""
    };
    table.note = Some(format!("{held_out}± is one standard error."));
    table
}

/// Every entry of the screening.
fn library(answer: &Answer) -> Table {
    let head = ["effect", "what became of it", "expected", "improvement"];
    let mut table = Table::new("The whole library, screened", head);
    table.word_columns = 2;
    for entry in answer.screening.iter().take(MAX_SCREENED) {
        table.rows.push(vec![
            with_cell(&entry.name, entry.cell),
            entry.outcome_in_words().to_owned(),
            fixed(entry.score, 1),
            fixed(entry.improvement.unwrap_or(f64::NAN), 1),
        ]);
    }
    let more = match answer.screening.len().saturating_sub(MAX_SCREENED) {
        0 => String::new(),
        more => format!(" {} more in report.json.", count(more, "line")),
    };
    table.note = Some(format!(
        "Expected: the improvement that its first small trace promises. Threshold: {}.{more}",
        fixed(answer.threshold, 1)
    ));
    table
}
