//! Effects switched on, and added to a worm.

use super::definition::{Apply, Effect, MAX_PARAMETERS};
use super::error::SettingError;
use super::library::named;
use super::servo_library::named_of_servo;
use super::table::TABLE;
use crate::physics::Physics;
use crate::servo::ServoPhysics;
use crate::table::Table;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What a table is given by.
const TABLE_NEEDS: &str = "acts_on, axis, grid and value, in an [[effect]] of a configuration file";

/// An effect switched on.
#[derive(Debug, Clone)]
pub struct Setting {
    effect: &'static Effect,
    cell: Option<usize>,
    values: [f64; MAX_PARAMETERS], // the first `parameters.len()` count
    table: Option<Arc<Table>>,     // of a table alone
}

impl PartialEq for Setting {
    fn eq(&self, other: &Self) -> bool {
        self.effect.name == other.effect.name
            && self.cell == other.cell
            && self.values() == other.values()
            && self.table == other.table
    }
}

impl Setting {
    /// An effect with values in the order of its parameters, on one cell (from 0) of a worm of `cells` where it concerns a single one.
    ///
    /// # Errors
    /// [`SettingError`].
    ///
    /// # Panics
    /// When there is not one value for each parameter.
    pub fn new(
        effect: &'static Effect,
        cell: Option<usize>,
        values: &[f64],
        cells: usize,
    ) -> Result<Self, SettingError> {
        assert_eq!(values.len(), effect.parameters.len(), "one value for each parameter");
        effect.check_cell(cell, cells)?;
        for (parameter, &value) in effect.parameters.iter().zip(values) {
            if !(parameter.min..=parameter.max).contains(&value) {
                return Err(SettingError::OutOfRange {
                    effect: effect.name,
                    parameter: parameter.name,
                    value,
                    min: parameter.min,
                    max: parameter.max,
                    unit: parameter.unit,
                });
            }
        }
        Ok(Self::within(effect, cell, values))
    }

    /// An effect by names, as files and the command line give it; `cell` counts from 0.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn by_names(
        name: &str,
        cell: Option<usize>,
        parameters: &BTreeMap<String, f64>,
        cells: usize,
    ) -> Result<Self, SettingError> {
        if name == TABLE.name {
            return Err(SettingError::TableMissing(TABLE_NEEDS.to_owned()));
        }
        Self::of_values(named(name)?, cell, parameters, cells)
    }

    /// An effect of a servo by names, as a model's file gives it.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn of_servo_by_names(name: &str, parameters: &BTreeMap<String, f64>) -> Result<Self, SettingError> {
        Self::of_values(named_of_servo(name)?, None, parameters, 0)
    }

    fn of_values(
        effect: &'static Effect,
        cell: Option<usize>,
        parameters: &BTreeMap<String, f64>,
        cells: usize,
    ) -> Result<Self, SettingError> {
        let known = |given: &str| effect.parameters.iter().any(|parameter| parameter.name == given);
        if let Some(unknown) = parameters.keys().find(|given| !known(given)) {
            let names: Vec<&str> = effect.parameters.iter().map(|parameter| parameter.name).collect();
            return Err(SettingError::NoParameter {
                effect: effect.name,
                parameter: unknown.clone(),
                names: names.join(", "),
            });
        }
        let mut values = Vec::with_capacity(effect.parameters.len());
        for parameter in effect.parameters {
            let given = parameters.get(parameter.name).copied();
            let value = given.or_else(|| effect.usual(parameter)).ok_or(SettingError::Missing {
                effect: effect.name,
                parameter: parameter.name,
                about: parameter.about,
            })?;
            values.push(value);
        }
        Self::new(effect, cell, &values, cells)
    }

    /// An effect with its values clamped to their ranges; one that is not a number becomes the neutral one.
    pub fn within(effect: &'static Effect, cell: Option<usize>, values: &[f64]) -> Self {
        let mut kept = [0.0; MAX_PARAMETERS];
        for ((kept, parameter), value) in kept.iter_mut().zip(effect.parameters).zip(values) {
            let value = if value.is_nan() { parameter.neutral } else { *value };
            *kept = value.clamp(parameter.min, parameter.max);
        }
        Self {
            effect,
            cell,
            values: kept,
            table: None,
        }
    }

    /// A law at the points of a grid, on one cell (from 0) of a worm of `cells` or on all of them.
    ///
    /// # Errors
    /// [`SettingError::Cell`], and [`SettingError::Elsewhere`] for a law of the motor.
    pub fn of_table(table: Table, cell: Option<usize>, cells: usize) -> Result<Self, SettingError> {
        TABLE.check_cell(cell, cells)?;
        if table.acts_on().is_of_motor() {
            return Err(SettingError::Elsewhere {
                acts_on: table.acts_on().name(),
                belongs: "is a law of the servo: give it in [[virtual_worm.servo_effect]], or as an [[effect]] of a servo's model",
            });
        }
        Ok(Self::with_table(table, cell))
    }

    /// A law of a servo at the points of a grid.
    ///
    /// # Errors
    /// [`SettingError::Elsewhere`] for a law of a worm's cells.
    pub fn of_servo_table(table: Table) -> Result<Self, SettingError> {
        if !table.acts_on().is_of_motor() {
            return Err(SettingError::Elsewhere {
                acts_on: table.acts_on().name(),
                belongs: "is a law of the worm's cells: give it as an [[effect]] of the worm",
            });
        }
        Ok(Self::with_table(table, None))
    }

    fn with_table(table: Table, cell: Option<usize>) -> Self {
        Self {
            table: Some(Arc::new(table)),
            ..Self::within(&TABLE, cell, &[])
        }
    }

    /// Checks that a worm of `cells` has the cell it acts on.
    ///
    /// # Errors
    /// [`SettingError::Cell`].
    pub fn check_cells(&self, cells: usize) -> Result<(), SettingError> {
        self.effect.check_cell(self.cell, cells)
    }

    /// The effect.
    pub fn effect(&self) -> &'static Effect {
        self.effect
    }

    /// The cell it acts on, from 0, where it acts on one alone.
    pub fn cell(&self) -> Option<usize> {
        self.cell
    }

    /// The values, in the order of the effect's parameters.
    pub fn values(&self) -> &[f64] {
        &self.values[..self.effect.parameters.len()]
    }

    /// Its law, where it is a table.
    pub fn table(&self) -> Option<&Table> {
        self.table.as_deref()
    }

    fn apply(&self, physics: &mut Physics) {
        if let Some(table) = self.table.as_ref().filter(|table| !table.acts_on().is_of_motor()) {
            physics.tables.push(table, self.cell);
        }
        if let Apply::Worm(apply) = self.effect.apply {
            apply(physics, self.cell, self.values());
        }
    }

    fn apply_to_servo(&self, physics: &mut ServoPhysics) {
        if let Some(table) = self.table.as_ref().filter(|table| table.acts_on().is_of_motor()) {
            physics.laws.tables.push(Arc::clone(table));
        }
        if let Apply::Servo(apply) = self.effect.apply {
            apply(physics, self.values());
        }
    }
}

impl ServoPhysics {
    /// These physics with effects of a servo; their order does not matter.
    pub fn with<'a>(mut self, effects: impl IntoIterator<Item = &'a Setting>) -> Self {
        for effect in effects {
            effect.apply_to_servo(&mut self);
        }
        self
    }
}

impl Physics {
    /// These physics with effects; their order does not matter.
    pub fn with<'a>(mut self, effects: impl IntoIterator<Item = &'a Setting>) -> Self {
        for effect in effects {
            effect.apply(&mut self);
        }
        self
    }

    /// These physics with effects, on a worm whose bounds, mass and stroke were identified from positions. The identified values
    /// include what effects do to them, so effects leave them as they are.
    pub fn found_with<'a>(self, effects: impl IntoIterator<Item = &'a Setting>) -> Self {
        let identified = self.worm.clone();
        let mut physics = self.with(effects);
        physics.worm.keep_found(&identified);
        physics.slope_clamping = 0.0;
        physics.view.scale = 1.0;
        physics
    }
}
