//! The updated model: the nominal `worm.toml` with the result of the search in it.
//!
//! Two things change in the file. Recalibrated values replace the nominal ones in `[worm]`, and every effect that was named is
//! appended as an `[[effect]]`, with a comment that lists its twins and the experiment that would separate them. Everything else stays as
//! it was, order and comments included, so that the difference between the two files is the answer.
//!
//! Quantities of a run or of the measurement (`slope of run 1`, `clock`) are no property of the worm and are not written, nor are those
//! that a model file cannot hold (damping, presliding, rounding, viscosity): the recalibration that is written is fitted without them.

mod diff;
mod entry;
mod figure;

use super::answer::{Answer, Calibrated};
pub(crate) use entry::table_fields;
use figure::Figure;
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, Table, TableLike, TomlError, Value};
use worm_estimator::config::{Config, ConfigError, PerCell};

/// Name of the new file, in errors and in the difference.
pub const FILE: &str = "model.toml";

/// Cells that differ by less than this fraction get one common value.
const ALIKE: f64 = 1e-3;

/// Why no model was written back.
#[derive(Debug, thiserror::Error)]
pub enum WriteBackError {
    /// The text of the nominal model is not TOML.
    #[error("the nominal model is not TOML: {0}: give the text that it was read from")]
    Syntax(#[from] TomlError),
    /// The answer speaks of a cell that the worm does not have.
    #[error(
        "`{name}` was recalibrated, but the worm has cells 1 to {cells}: give the configuration that was searched with"
    )]
    Cell {
        /// What was recalibrated.
        name: String,
        /// Cells of the worm.
        cells: usize,
    },
    /// The new file would not be accepted.
    #[error("the written-back model would be refused: {0}")]
    Refused(#[from] ConfigError),
}

/// The new file and its difference to the old one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelText {
    /// The new file.
    pub text: String,
    /// Its lines that differ and three around them, with `-`, `+` or ` ` before each; ` …` stands where lines are left out.
    pub diff: Vec<String>,
    /// The same as a unified difference, as `patch` takes it; empty where nothing is new.
    pub unified: String,
}

/// A new file with its difference to the old one.
pub(super) fn difference(old: &str, text: String) -> ModelText {
    ModelText {
        diff: diff::lines(old, &text),
        unified: diff::unified(old, &text),
        text,
    }
}

/// Writes the result into the nominal model: `config_text` is what `config` was read from, [`Config::COMMENTED`] where
/// there was no file.
///
/// # Errors
/// [`WriteBackError`] when the text is not that of a configuration, or the answer is not about its worm.
pub fn model(config_text: &str, config: &Config, answer: &Answer) -> Result<ModelText, WriteBackError> {
    let mut document: DocumentMut = config_text.parse()?;
    let factors = Factors::of(&answer.written_back, config.worm.cells)?;
    let worm = document.entry("worm").or_insert_with(|| Item::Table(Table::new()));
    if let Some(worm) = worm.as_table_like_mut() {
        factors.write(worm, config);
    }
    let entries = entry::entries(answer);
    if !entries.is_empty() {
        // `[[effect]]` cannot follow `effect = [{ … }]`.
        if let Some(effect) = document.get_mut("effect") {
            let inline = std::mem::take(effect);
            // In a valid configuration only an empty list is no list of tables.
            *effect = inline.into_array_of_tables().map_or(Item::None, Item::ArrayOfTables);
        }
    }
    let mut text = document.to_string();
    if !entries.is_empty() && !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    text += &entries;
    Config::from_toml(&text, Path::new(FILE))?;
    Ok(difference(config_text, text))
}

/// Factors on the worm's values, cell by cell, and the stroke.
struct Factors {
    friction: Vec<Factor>,
    stiffness: Vec<Factor>,
    stroke: Option<Figure>,
}

/// A factor with its relative variance.
#[derive(Clone, Copy)]
struct Factor {
    value: f64,
    variance: f64,
}

impl Factor {
    const ONE: Self = Self {
        value: 1.0,
        variance: 0.0,
    };

    fn take(&mut self, calibrated: &Calibrated) {
        self.value *= calibrated.found / calibrated.nominal;
        self.variance += (calibrated.sigma / calibrated.found).powi(2);
    }
}

impl Factors {
    fn of(calibration: &[Calibrated], cells: usize) -> Result<Self, WriteBackError> {
        let mut factors = Self {
            friction: vec![Factor::ONE; cells],
            stiffness: vec![Factor::ONE; cells],
            stroke: None,
        };
        for calibrated in calibration {
            let (quantity, cell) = match calibrated.name.split_once(" of cell ") {
                Some((quantity, cell)) => (quantity, Some(cell)),
                None => (calibrated.name.as_str(), None),
            };
            let of_cells = match (quantity, cell) {
                ("friction", _) => &mut factors.friction,
                ("stiffness", _) => &mut factors.stiffness,
                ("stroke", None) => {
                    factors.stroke = Some(Figure {
                        value: calibrated.found,
                        sigma: calibrated.sigma,
                    });
                    continue;
                }
                _ => continue,
            };
            match cell {
                None => of_cells.iter_mut().for_each(|factor| factor.take(calibrated)),
                Some(cell) => {
                    let index = cell.parse::<usize>().ok().and_then(|cell| cell.checked_sub(1));
                    let factor = index.and_then(|index| of_cells.get_mut(index));
                    factor
                        .ok_or_else(|| WriteBackError::Cell {
                            name: calibrated.name.clone(),
                            cells,
                        })?
                        .take(calibrated);
                }
            }
        }
        Ok(factors)
    }

    fn write(&self, worm: &mut dyn TableLike, config: &Config) {
        let body = &config.worm;
        let deformations = self.friction.iter().zip(&self.stiffness).enumerate();
        // A stiffer pad gives way less before the same friction force is reached.
        let deformations = deformations.map(|(cell, (friction, stiffness))| Figure {
            value: body.max_deformation_m.of(cell) * friction.value / stiffness.value,
            sigma: body.max_deformation_m.of(cell) * (friction.variance + stiffness.variance).sqrt(),
        });
        let stiffnesses = self.stiffness.iter().enumerate().map(|(cell, stiffness)| Figure {
            value: body.stiffness_n_per_m.of(cell) * stiffness.value,
            sigma: body.stiffness_n_per_m.of(cell) * stiffness.variance.sqrt(),
        });
        if let Some(stroke) = self.stroke.filter(|stroke| stroke.differs_from(body.stroke_m)) {
            set(worm, "stroke_m", stroke.to_value());
        }
        set_cells(
            worm,
            "stiffness_n_per_m",
            &body.stiffness_n_per_m,
            stiffnesses.collect(),
        );
        set_cells(
            worm,
            "max_deformation_m",
            &body.max_deformation_m,
            deformations.collect(),
        );
    }
}

/// Writes a value for each cell, as one where one does for all.
fn set_cells(worm: &mut dyn TableLike, key: &str, nominal: &PerCell, found: Vec<Figure>) {
    let is_new = found
        .iter()
        .enumerate()
        .any(|(cell, figure)| figure.differs_from(nominal.of(cell)));
    if !is_new {
        return;
    }
    let values = || found.iter().map(|figure| figure.value);
    let (min, max) = values().fold((f64::INFINITY, 0.0), |(min, max): (f64, f64), value| {
        (min.min(value), max.max(value))
    });
    let was_one = matches!(nominal, PerCell::Same(_));
    let value = match found.first() {
        Some(first) if was_one && max - min <= ALIKE * max => first.to_value(),
        _ => Value::Array(found.iter().map(|figure| figure.to_value()).collect::<Array>()),
    };
    set(worm, key, value);
}

/// Puts a value where the old one stood, or at the table's end.
fn set(table: &mut dyn TableLike, key: &str, new: Value) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => replace(old, new),
        None => {
            table.insert(key, Item::Value(new));
        }
    }
}

/// Puts a value in the place of another, comments around it and within it kept.
fn replace(old: &mut Value, mut new: Value) {
    if let (Value::Array(old), Value::Array(new)) = (&mut *old, &new)
        && old.len() == new.len()
    {
        for (old, new) in old.iter_mut().zip(new) {
            replace(old, new.clone());
        }
        return;
    }
    let decor = old.decor().clone();
    let suffix = decor.suffix().and_then(|suffix| suffix.as_str()).unwrap_or_default();
    let comment = suffix.trim_start();
    let old_length = old.to_string().len() - suffix.len();
    *new.decor_mut() = decor.clone();
    if comment.starts_with('#') {
        new.decor_mut().set_suffix("");
        // The comment stays in its column where there is room for that.
        let column = old_length + suffix.len() - comment.len();
        let spaces = column.saturating_sub(new.to_string().len()).max(1);
        new.decor_mut().set_suffix(" ".repeat(spaces) + comment);
    }
    *old = new;
}

#[cfg(test)]
mod tests;
