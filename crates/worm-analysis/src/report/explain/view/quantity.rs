//! Parameters in the units that people read, and what the library says of an effect.

use crate::explain::Answer;
use crate::explain::answer::FoundParameter;
use worm_estimator::number::{fixed, to_error};
use worm_physics::effect::{self, Parameter};

/// The unit that people read for a unit of the files: the factor to it, and its name.
pub(super) fn readable(unit: &str) -> (f64, &str) {
    match unit {
        "m" => (1e3, "mm"),
        "s" => (1e3, "ms"),
        "kg" => (1e3, "g"),
        "J" => (1e3, "mJ"),
        "s/s" => (1e6, "ppm"),
        "deg" => (1.0, "°"),
        "m/N" => (1e3, "mm/N"),
        "1/N" => (100.0, "% per N"),
        other => (1.0, other),
    }
}

/// Suffixes of parameter names in the files, by unit.
const SUFFIXES: [(&str, &str); 9] = [
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
pub(super) struct ParameterView {
    /// Its name, without its unit.
    pub name: String,
    /// Its value, with its error behind ` ± ` where that is known.
    pub value: String,
    /// The unit of both.
    pub unit: String,
    /// What it is; empty where the library does not have it.
    pub about: &'static str,
}

impl ParameterView {
    /// A parameter of an effect.
    pub fn of(effect: &str, found: &FoundParameter) -> Self {
        let known = in_library(effect, &found.name);
        let (factor, unit) = match (&*found.unit, known) {
            // Neutral at 1, it is a factor; neutral at 0, a fraction.
            ("", Some(parameter)) if parameter.neutral == 0.0 => (100.0, "%"),
            ("", Some(_)) => (1.0, "×"),
            (unit, _) => readable(unit),
        };
        let suffix = SUFFIXES.iter().find(|(unit, _)| *unit == found.unit);
        let name = suffix.and_then(|(_, suffix)| found.name.strip_suffix(suffix));
        Self {
            name: name.unwrap_or(&found.name).replace('_', " "),
            value: to_error(found.value * factor, found.sigma * factor),
            unit: unit.to_owned(),
            about: known.map_or("", |parameter| parameter.about),
        }
    }

    /// As text: `friction factor 0.620 ± 0.018 ×`.
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

/// What an effect is, in a sentence; empty where the library does not have it.
pub(super) fn library_sentence(name: &str) -> &'static str {
    effect::named(name).map_or("", |effect| effect.sentence)
}

/// What an effect does, as a formula; empty where the library does not have it.
pub(super) fn formula(name: &str) -> &'static str {
    effect::named(name).map_or("", |effect| effect.formula)
}

/// Cells of the worm, as far as the answer shows them.
pub(in crate::report::explain) fn cells(answer: &Answer) -> usize {
    let maps = answer.figures.maps_before.iter().chain(&answer.figures.maps_after);
    let mapped = maps.map(|map| map.stepping_cell.iter().copied().fold(map.residual_m.len(), usize::max));
    let places = answer.r#where.iter().map(|place| place.cell.max(place.stepping_cell));
    let effects = answer.effects.iter().chain(&answer.rivals);
    let named = effects.filter_map(|effect| effect.cell);
    let cells = mapped.chain(places).chain(named).max().unwrap_or(1);
    cells.clamp(1, worm_physics::MAX_CELLS)
}

/// A length in mm with its unit.
pub(in crate::report::explain) fn mm(length_m: f64) -> String {
    format!("{} mm", fixed(length_m * 1e3, 3))
}

/// A text for use within a sentence: without the full stop at its end.
pub(super) fn clause(text: &str) -> &str {
    text.trim().trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_estimator::number::NONE;

    #[test]
    fn parameters_are_in_the_units_that_people_read() {
        for (value, sigma, unit, text) in [
            (0.000_42, 0.000_013, "m", "0.420 ± 0.013 mm"),
            (0.0152, 0.0021, "s", "15.2 ± 2.1 ms"),
            (0.05, 0.012, "kg", "50 ± 12 g"),
            (-1.25, 0.31, "deg", "−1.25 ± 0.31 °"),
            (0.0115, f64::NAN, "m", "11.5 mm"),
            (0.2034, 0.012, "N", "0.203 ± 0.012 N"),
            (3e-5, 2e-6, "m/N", "0.0300 ± 0.0020 mm/N"),
            (1.0, f64::NAN, "", "1.00"),
            (f64::NAN, 0.1, "", NONE),
        ] {
            let found = FoundParameter {
                name: "play".to_owned(),
                value,
                sigma,
                unit: unit.to_owned(),
                cell: None,
            };
            let view = ParameterView::of("no-such-effect", &found);
            assert_eq!(view.in_words(), format!("play {text}"));
        }
    }
}
