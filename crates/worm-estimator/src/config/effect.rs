//! Effects beyond the paper's theory: `[[effect]]`.

use super::check::Checker;
use super::effect_table::TableFields;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::str::FromStr;
use worm_physics::MAX_CELLS;
use worm_physics::effect::{Setting, SettingError};

/// An effect that is switched on, as in the file.
///
/// `simulate`, `study`, the virtual worm, the theory in `analyze` and the predictions of the estimator's cycles use it. What follows the
/// tips in measured positions, in the estimator and in the identification, uses the paper's contact law alone.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Effect {
    /// Its name in the library.
    pub name: String,
    /// The cell concerned, from 1, if it is a single one.
    #[serde(default)]
    pub cell: Option<usize>,
    /// Its law, where it is a table.
    #[serde(flatten)]
    pub table: TableFields,
    /// Its parameters by name.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}

/// Why a text is not an effect.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectTextError {
    /// Something is not NAME:PARAM=VALUE.
    #[error(
        "'{part}' is no part of an effect: give NAME:PARAM=VALUE[,PARAM=VALUE][,cell=K], such as constant-drag:force_n=0.2"
    )]
    Form {
        /// What is wrong.
        part: String,
    },
    /// A value that is not a number.
    #[error("{parameter} = '{value}' is no number")]
    Number {
        /// The parameter.
        parameter: String,
        /// What was given.
        value: String,
    },
    /// A cell that is not a whole number.
    #[error("cell = '{0}' is no cell: cells count from 1")]
    Cell(String),
    /// Something is given twice.
    #[error("{0} is given twice: give each parameter once")]
    Twice(String),
    /// There is no such effect, or it is not valid.
    #[error(transparent)]
    Setting(#[from] SettingError),
}

impl FromStr for Effect {
    type Err = EffectTextError;

    /// An effect from the command line: `NAME:PARAM=VALUE[,PARAM=VALUE][,cell=K]`.
    fn from_str(text: &str) -> Result<Self, EffectTextError> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let form = |part: &str| EffectTextError::Form { part: part.to_owned() };
        if name.trim().is_empty() {
            return Err(form(text));
        }
        let mut effect = Self {
            name: name.trim().to_owned(),
            cell: None,
            table: TableFields::default(),
            parameters: BTreeMap::new(),
        };
        for part in rest.split(',').filter(|_| !rest.trim().is_empty()) {
            let (parameter, value) = part.split_once('=').ok_or_else(|| form(part))?;
            let (parameter, value) = (parameter.trim(), value.trim());
            let is_new = if parameter == "cell" {
                let cell = value.parse().map_err(|_| EffectTextError::Cell(value.to_owned()))?;
                effect.cell.replace(cell).is_none()
            } else {
                let number = value.parse().map_err(|_| EffectTextError::Number {
                    parameter: parameter.to_owned(),
                    value: value.to_owned(),
                })?;
                effect.parameters.insert(parameter.to_owned(), number).is_none()
            };
            if !is_new {
                return Err(EffectTextError::Twice(parameter.to_owned()));
            }
        }
        if effect.is_table() {
            // Refused: its lists have no place in such a text.
            Setting::by_names(&effect.name, None, &effect.parameters, MAX_CELLS)?;
        }
        // The number of cells is not known yet; a cell that no worm can have is refused here.
        effect.setting(MAX_CELLS)?;
        Ok(effect)
    }
}

impl Effect {
    /// The effect as a setting of the physics.
    ///
    /// # Errors
    /// [`SettingError`] for an unknown name or parameter, and for a value or a cell out of range.
    pub fn setting(&self, cells: usize) -> Result<Setting, SettingError> {
        // Cell 0 becomes one beyond the last, which is refused.
        let cell = self.cell.map(|cell| cell.wrapping_sub(1));
        if TableFields::is_of(&self.name) {
            TableFields::refuse_parameters(
                &self.parameters,
                "acts_on, axis, grid, value, period, memory_s and cell",
            )?;
            return Setting::of_table(self.table.table()?, cell, cells);
        }
        self.table.refuse_in(&self.name)?;
        Setting::by_names(&self.name, cell, &self.parameters, cells)
    }

    /// Whether it is a law at the points of a grid.
    pub(super) fn is_table(&self) -> bool {
        TableFields::is_of(&self.name)
    }

    pub(super) fn check(&self, cells: usize, checker: &mut Checker) {
        if let Err(error) = self.setting(cells) {
            checker.require(false, "effect", format!("\"{}\"", self.name), error);
        }
    }
}
