//! Effects, parameters and cells in words, and quantities in the units that people read.

use crate::explain::Answer;
pub(super) use crate::explain::answer::with_cell;
use crate::explain::answer::{FoundParameter, NamedEffect};
use crate::report::number::{fixed, in_words, to_error};
use worm_physics::effect::{self, Parameter};

/// A unit of files as people read it: the factor to it, and its name.
pub(super) fn readable(unit: &str) -> (f64, &str) {
    match unit {
        "m" => (1e3, "mm"),
        "s" => (1e3, "ms"),
        "kg" => (1e3, "g"),
        "J" => (1e3, "mJ"),
        "deg" => (1.0, "°"),
        "m/N" => (1e3, "mm/N"),
        "1/N" => (100.0, "% per N"),
        other => (1.0, other),
    }
}

/// How a unit ends the names of parameters in files.
const ENDINGS: [(&str, &str); 9] = [
    ("m", "_m"),
    ("s", "_s"),
    ("kg", "_kg"),
    ("deg", "_deg"),
    ("N", "_n"),
    ("m/N", "_m_per_n"),
    ("N/m", "_n_per_m"),
    ("N s/m", "_n_s_per_m"),
    ("1/N", "_per_n"),
];

/// A parameter as people read it.
pub(super) struct Quantity {
    /// What it is called, without its unit.
    pub name: String,
    /// Its value, with its error behind ` ± ` where that is known.
    pub value: String,
    /// The unit of both.
    pub unit: String,
    /// What it is; empty where the library does not know it.
    pub about: &'static str,
}

impl Quantity {
    /// A parameter of an effect.
    pub fn of(effect: &str, found: &FoundParameter) -> Self {
        let known = in_library(effect, &found.name);
        let (factor, unit) = match (&*found.unit, known) {
            // What does nothing at 1 is a factor; what does nothing at 0 is a share.
            ("", Some(parameter)) if parameter.neutral == 0.0 => (100.0, "%"),
            ("", Some(_)) => (1.0, "×"),
            (unit, _) => readable(unit),
        };
        let ending = ENDINGS.iter().find(|(unit, _)| *unit == found.unit);
        let name = ending.and_then(|(_, ending)| found.name.strip_suffix(ending));
        Self {
            name: name.unwrap_or(&found.name).replace('_', " "),
            value: to_error(found.value * factor, found.sigma * factor),
            unit: unit.to_owned(),
            about: known.map_or("", |parameter| parameter.about),
        }
    }

    /// It in words: `friction factor 0.620 ± 0.018 ×`.
    pub fn in_words(&self) -> String {
        format!("{} {} {}", self.name, self.value, self.unit)
            .trim_end()
            .to_owned()
    }
}

fn in_library(effect: &str, parameter: &str) -> Option<&'static Parameter> {
    let effect = effect::named(effect).ok()?;
    effect.parameters.iter().find(|known| known.name == parameter)
}

/// What an effect is, in a sentence; empty where the library does not know it.
pub(super) fn sentence(name: &str) -> &'static str {
    effect::named(name).map_or("", |effect| effect.sentence)
}

/// What an effect does, as a formula; empty where the library does not know it.
pub(super) fn formula(name: &str) -> &'static str {
    effect::named(name).map_or("", |effect| effect.formula)
}

/// Several effects in words, in their order.
pub(super) fn names<'a>(effects: impl IntoIterator<Item = &'a NamedEffect>) -> String {
    let names: Vec<String> = effects.into_iter().map(NamedEffect::in_words).collect();
    in_words(&names)
}

/// The model with the named effects in it, in words; that of the best candidate where there are several.
pub(super) fn named_model(answer: &Answer) -> String {
    if answer.effects.is_empty() {
        "the named model".to_owned()
    } else {
        format!("with {}", names(&answer.effects))
    }
}

/// Cells of the worm, as far as the answer shows them.
pub(super) fn cells(answer: &Answer) -> usize {
    let maps = answer.figures.maps_before.iter().chain(&answer.figures.maps_after);
    let mapped = maps.map(|map| map.stepping_cell.iter().copied().fold(map.residual_m.len(), usize::max));
    let places = answer.r#where.iter().map(|place| place.cell.max(place.stepping_cell));
    let effects = answer.effects.iter().chain(&answer.rivals);
    let named = effects.filter_map(|effect| effect.cell);
    let cells = mapped.chain(places).chain(named).max().unwrap_or(1);
    cells.clamp(1, worm_physics::MAX_CELLS)
}

/// What the answer rests on, in words.
pub(super) fn evidence(answer: &Answer) -> &'static str {
    if answer.is_by_advances() {
        "advances"
    } else {
        "recordings"
    }
}

/// A length in mm with its unit.
pub(super) fn mm(length_m: f64) -> String {
    format!("{} mm", fixed(length_m * 1e3, 3))
}

/// A text as a clause within a sentence: without the full stop that it may end with.
pub(super) fn clause(text: &str) -> &str {
    text.trim().trim_end_matches('.')
}
