//! How the gap shrinks, stage by stage, on cycles that nothing was fitted to.

use super::super::view::{Distance, StageView, stage_of, stages};
use crate::explain::Answer;
use crate::explain::answer::Stage;
use crate::explain::answer::StageKind;
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{
    ACCENT, Axis, Colour, DrawError, INK, LIGHT, MID, MUTED, Row, SHADE, Sheet, Stroke, Svg, draw,
};
use worm_estimator::number::fixed;

const ROW: f64 = 54.0;
const HALF_BAR: f64 = 0.24;
/// How far below its bar the effect of a stage is written, in rows, and the most characters that fit there.
const BELOW: f64 = 0.4;
const MAX_CHARACTERS: usize = 60;
/// Room beside the longest bar for its value, as a fraction of its length.
const BESIDE: f64 = 0.28;

/// How a stage's bar looks.
fn style(stage: &StageView) -> (Mark, Colour) {
    match stage.key {
        StageKind::Baseline => (Mark::Box, MID),
        StageKind::Recalibrated => (Mark::Box, SHADE),
        StageKind::BestWrong => (Mark::Box, LIGHT),
        StageKind::Named | StageKind::Law => (Mark::Box, ACCENT),
        _ => (Mark::Frame, MUTED),
    }
}

pub(super) fn figure(answer: &Answer) -> Result<Figure, DrawError> {
    let distance = Distance::of(answer);
    let bars = stages(answer);
    let floor = stage_of(answer, StageKind::Floor);
    let key = |(stage, _): &(StageView, &Stage)| {
        let (mark, colour) = style(stage);
        Key::new(mark, colour, stage.name)
    };
    let mut keys: Vec<Key> = bars.iter().map(key).collect();
    if floor.is_some() {
        keys.push(Key::new(Mark::Dashed, INK, "noise floor: no model can do better"));
    }
    let meanings = bars
        .iter()
        .map(|(stage, _)| format!("{}: {}", stage.name, stage.meaning));
    let missing = match (stage_of(answer, StageKind::Named), floor) {
        (None, _) => " No bar for a named effect, for none is named.",
        (_, None) => " The noise floor is not known.",
        _ => "",
    };
    Ok(Figure {
        id: "gap",
        title: "From the nominal model down to the noise",
        keys,
        panels: vec![Panel::new(
            "distance of model and data",
            format!("{}, held-out cycles, {}", distance.in_words(), distance.unit()),
            picture(&bars, floor, distance)?,
        )],
        caption: format!("{}.{missing}", sentence_case(&meanings.collect::<Vec<_>>().join("; "))),
    })
}

fn sentence_case(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => String::new(),
    }
}

fn picture(bars: &[(StageView, &Stage)], floor: Option<&Stage>, distance: Distance) -> Result<Svg, DrawError> {
    let at_floor = floor.map_or(f64::NAN, |floor| distance.held_out(floor));
    let values = bars.iter().map(|(_, stage)| distance.held_out(stage)).chain([at_floor]);
    let longest = values.filter(|value| Axis::is_drawable(*value)).fold(0.0, f64::max);
    let values = bars
        .iter()
        .map(|(view, stage)| format!("{} {}", view.with_effect(stage), distance.held_out_in_words(stage)));
    let sheet = Sheet {
        description: format!("The gap stage by stage: {}", values.collect::<Vec<_>>().join(", ")),
        x_label: Some(distance.unit().to_owned()),
        x: Axis::between(0.0, (1.0 + BESIDE) * longest, 5),
        rows: vec![Row::new(
            Axis::listed(bars.iter().map(|(view, _)| view.name.to_owned()).collect()),
            ROW * bars.len() as f64,
        )],
    };
    // The floor's line must not run through the names of effects, if there is room beside it.
    let beside_floor = if at_floor < 0.5 * longest { at_floor } else { 0.0 };
    draw(&sheet, |_, plot| {
        for (number, (view, stage)) in bars.iter().enumerate() {
            let row = (bars.len() - 1 - number) as f64;
            let value = distance.held_out(stage);
            if let Some(effect) = &stage.effect {
                plot.text_beside(beside_floor, row - BELOW, MUTED, &shortened(effect))?;
            }
            if !Axis::is_drawable(value) {
                plot.text_beside(0.0, row, MUTED, "not known")?;
                continue;
            }
            let (along, across) = ([0.0, value], [row - HALF_BAR, row + HALF_BAR]);
            match style(view) {
                (Mark::Frame, colour) => plot.edge(along, across, Stroke::new(colour, 1.5))?,
                (_, colour) => plot.fill(along, across, colour, 1.0)?,
            }
            plot.text_beside(value, row, INK, &distance.held_out_in_words(stage))?;
        }
        let height = [-0.5, bars.len() as f64 - 0.5];
        plot.threshold(at_floor, height, INK, &format!("floor {}", fixed(at_floor, 3)))
    })
}

fn shortened(text: &str) -> String {
    if text.chars().count() <= MAX_CHARACTERS {
        return text.to_owned();
    }
    text.chars().take(MAX_CHARACTERS - 1).chain(['…']).collect()
}
