//! How the gap shrinks, stage by stage, on cycles that nothing was fitted to.

use super::words::mm;
use crate::explain::answer::{Stage, StageKind};
use crate::explain::{Answer, Verdict};
use crate::report::number::fixed;
use crate::report::page::{Figure, Key, Mark, Page, Panel};
use crate::report::plot::{
    ACCENT, Axis, Colour, DrawError, INK, LIGHT, MID, MUTED, PAPER, Row, SHADE, Sheet, Stroke, draw,
};
use crate::report::table::Table;

const ROW: f64 = 54.0;
const HALF_BAR: f64 = 0.24;
/// How far below its bar the effect of a stage stands, in rows, and the most characters that fit there.
const BELOW: f64 = 0.4;
const MAX_CHARACTERS: usize = 60;
/// Room behind the longest bar for its value, as a share of its length.
const BEHIND: f64 = 0.2;

/// A stage as the page tells it.
struct Told {
    key: StageKind,
    name: &'static str,
    mark: Mark,
    colour: Colour,
    meaning: &'static str,
}

/// The stages in the order in which they are told; the noise floor is a line, not a bar.
const STAGES: [Told; 5] = [
    Told {
        key: StageKind::Baseline,
        name: "believed model",
        mark: Mark::Box,
        colour: MID,
        meaning: "the model as it was believed",
    },
    Told {
        key: StageKind::Recalibrated,
        name: "recalibrated",
        mark: Mark::Box,
        colour: SHADE,
        meaning: "its known quantities adjusted within what is believable: the gap that counts is what is left here",
    },
    Told {
        key: StageKind::BestWrong,
        name: "best rival",
        mark: Mark::Box,
        colour: LIGHT,
        meaning: "the best effect of another kind",
    },
    Told {
        key: StageKind::Named,
        name: "named",
        mark: Mark::Box,
        colour: ACCENT,
        meaning: "the model with the effect named",
    },
    Told {
        key: StageKind::FreeForm,
        name: "free form",
        mark: Mark::Frame,
        colour: MUTED,
        meaning: "a correction of any form, fitted freely: about as much as can be closed",
    },
];

/// The same where none is named and the first of several candidates stands for them.
const CANDIDATE_STAGES: [Told; 5] = {
    let mut stages = STAGES;
    stages[3].name = "first candidate";
    stages[3].meaning = "the model with the first of the candidates";
    stages
};

fn stages(verdict: Verdict) -> &'static [Told] {
    match verdict {
        Verdict::Ambiguous => &CANDIDATE_STAGES,
        _ => &STAGES,
    }
}

pub(super) fn add(page: &mut Page, answer: &Answer) -> Result<(), DrawError> {
    let bars: Vec<(&Told, &Stage)> = stages(answer.verdict)
        .iter()
        .filter_map(|told| Some((told, stage(answer, told.key)?)))
        .collect();
    if bars.is_empty() {
        page.paragraph("There are no stages to compare: the answer holds no model judged on held-out cycles.");
        return Ok(());
    }
    if answer.is_by_advances() {
        page.paragraph("Nothing was held out of so few advances: what shrinks is how far the model is off them.");
    } else {
        page.figure(&figure(answer, &bars)?);
    }
    page.table(&table(answer));
    Ok(())
}

fn stage<'a>(answer: &'a Answer, key: StageKind) -> Option<&'a Stage> {
    answer.stages.iter().find(|stage| stage.stage == key)
}

/// A stage with its effect: `named: payload`.
fn name(told: &Told, stage: &Stage) -> String {
    match &stage.effect {
        Some(effect) => format!("{}: {effect}", told.name),
        None => told.name.to_owned(),
    }
}

fn figure(answer: &Answer, bars: &[(&Told, &Stage)]) -> Result<Figure, DrawError> {
    let floor = stage(answer, StageKind::Floor);
    let mut keys: Vec<Key> = bars
        .iter()
        .map(|(told, _)| Key::new(told.mark, told.colour, told.name))
        .collect();
    if floor.is_some() {
        keys.push(Key::new(Mark::Dashed, INK, "noise floor: no model can do better"));
    }
    let meanings: Vec<String> = bars
        .iter()
        .map(|(told, _)| format!("{}: {}", told.name, told.meaning))
        .collect();
    let missing = match (stage(answer, StageKind::Named), floor) {
        (None, _) => " No bar for a named effect, for none is named.",
        (_, None) => " The noise floor is not known.",
        _ => "",
    };
    Ok(Figure {
        id: "gap",
        title: "From the believed model down to the noise".to_owned(),
        keys,
        panels: vec![Panel {
            title: "distance of model and data".to_owned(),
            quantity: "root mean square within a cycle, held-out cycles, mm".to_owned(),
            svg: picture(bars, floor)?,
        }],
        caption: format!("{}.{missing}", sentence_case(&meanings.join("; "))),
    })
}

fn sentence_case(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => String::new(),
    }
}

fn picture(bars: &[(&Told, &Stage)], floor: Option<&Stage>) -> Result<String, DrawError> {
    let floor_mm = floor.map_or(f64::NAN, |floor| floor.held_out_rms_m * 1e3);
    let values_mm = bars
        .iter()
        .map(|(_, stage)| stage.held_out_rms_m * 1e3)
        .chain([floor_mm]);
    let longest_mm = values_mm.filter(|mm| Axis::can_show(*mm)).fold(0.0, f64::max);
    let said = bars
        .iter()
        .map(|(told, stage)| format!("{} {}", name(told, stage), mm(stage.held_out_rms_m)));
    let sheet = Sheet {
        description: format!("The gap stage by stage: {}", said.collect::<Vec<_>>().join(", ")),
        x_label: Some("mm".to_owned()),
        x: Axis::between(0.0, (1.0 + BEHIND) * longest_mm, 5),
        rows: vec![Row::new(
            Axis::listed(bars.iter().map(|(told, _)| told.name.to_owned()).collect()),
            ROW * bars.len() as f64,
        )],
    };
    // The floor's line is not to run through the names of effects, if there is room beside it.
    let beside_floor_mm = if floor_mm < 0.5 * longest_mm { floor_mm } else { 0.0 };
    draw(&sheet, |_, plot| {
        for (number, (told, stage)) in bars.iter().enumerate() {
            let row = (bars.len() - 1 - number) as f64;
            let value_mm = stage.held_out_rms_m * 1e3;
            if let Some(effect) = &stage.effect {
                plot.words_behind(beside_floor_mm, row - BELOW, MUTED, &shortened(effect))?;
            }
            if !Axis::can_show(value_mm) {
                plot.words_behind(0.0, row, MUTED, "not known")?;
                continue;
            }
            let (along, across) = ([0.0, value_mm], [row - HALF_BAR, row + HALF_BAR]);
            match told.mark {
                Mark::Frame => plot.edge(along, across, Stroke::new(told.colour, 1.5))?,
                _ => plot.fill(along, across, told.colour, 1.0)?,
            }
            plot.words_behind(value_mm, row, INK, &format!("{} mm", fixed(value_mm, 3)))?;
        }
        // Pale under the dashes, so that they are seen on a dark bar.
        let top = bars.len() as f64 - 0.5;
        plot.upright(floor_mm, -0.5, top, Stroke::new(PAPER, 3.0))?;
        plot.upright(floor_mm, -0.5, top, Stroke::new(INK, 1.5).dashed())?;
        plot.name_above(floor_mm, INK, &format!("floor {}", fixed(floor_mm, 3)))
    })
}

fn shortened(text: &str) -> String {
    if text.chars().count() <= MAX_CHARACTERS {
        return text.to_owned();
    }
    text.chars().take(MAX_CHARACTERS - 1).chain(['…']).collect()
}

fn table(answer: &Answer) -> Table {
    let is_by_advances = answer.is_by_advances();
    let off = "advance off by, mm a cycle";
    let head: &[&str] = if is_by_advances {
        &["model", off]
    } else {
        &[
            "model",
            "rms, fitted cycles, mm",
            "rms, held-out cycles, mm",
            off,
            "energy (11) off by, mJ a cycle",
        ]
    };
    let mut table = Table::new("The gap, stage by stage", head.iter().copied());
    let told = stages(answer.verdict).iter().filter_map(|told| {
        let stage = stage(answer, told.key)?;
        Some((name(told, stage), stage))
    });
    let floor = stage(answer, StageKind::Floor).map(|stage| ("noise floor".to_owned(), stage));
    for (name, stage) in told.chain(floor) {
        let off_mm = fixed(stage.advance_error_m * 1e3, 3);
        table.rows.push(if is_by_advances {
            vec![name, off_mm]
        } else {
            vec![
                name,
                fixed(stage.fit_rms_m * 1e3, 3),
                fixed(stage.held_out_rms_m * 1e3, 3),
                off_mm,
                fixed(stage.energy_error_j * 1e3, 2),
            ]
        });
    }
    let note = if is_by_advances {
        "Mean over the slopes of how far the advance is off."
    } else {
        "Held-out cycles were kept from every fit, so a model that merely bends to the data gains nothing there. Advance and \
         energy: mean over the runs of how far they are off."
    };
    table.note = Some(note.to_owned());
    table
}
