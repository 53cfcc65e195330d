//! The law of an `[[effect]]` with `name = "table"`.

use serde::Deserialize;
use std::collections::BTreeMap;
use worm_physics::effect::{SettingError, TABLE};
use worm_physics::{ActsOn, Axis, Table, TableError};

/// A law at the points of a grid, as in the file; all fields are none for an effect of the library.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct TableFields {
    /// What it gives: a `contact-force` in N, a `friction-factor`, a `drive-displacement` in m, or, of a servo, a `motor-friction` or a
    /// `motor-torque` in N m.
    #[serde(default)]
    pub acts_on: Option<String>,
    /// What it depends on.
    #[serde(default)]
    pub axis: Option<OneOrTwo<String>>,
    /// The points of its grid, in ascending order.
    #[serde(default)]
    pub grid: Option<Rows>,
    /// The value at each.
    #[serde(default)]
    pub value: Option<Rows>,
    /// Width after which it repeats along its first axis, in the unit of that.
    #[serde(default)]
    pub period: Option<f64>,
    /// How far it remembers, s, where it depends on a `recent-deformation` or a `recent-slide`.
    #[serde(default)]
    pub memory_s: Option<f64>,
}

/// One thing, or a list of them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected one name, or a list of two")]
pub enum OneOrTwo<T> {
    /// One.
    One(T),
    /// A list.
    List(Vec<T>),
}

/// One list of numbers, or a list of such lists.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a list of numbers, or with two axes a list of such lists"
)]
pub enum Rows {
    /// One list.
    One(Vec<f64>),
    /// A list of lists.
    Several(Vec<Vec<f64>>),
}

impl TableFields {
    /// The first field that is given.
    fn first_given(&self) -> Option<&'static str> {
        let given = [
            ("acts_on", self.acts_on.is_some()),
            ("axis", self.axis.is_some()),
            ("grid", self.grid.is_some()),
            ("value", self.value.is_some()),
            ("period", self.period.is_some()),
            ("memory_s", self.memory_s.is_some()),
        ];
        given.into_iter().find(|(_, is_given)| *is_given).map(|(name, _)| name)
    }

    /// Refuses the fields of a table in an effect of the library.
    pub(super) fn refuse_in(&self, effect: &str) -> Result<(), SettingError> {
        let refuse = |field| SettingError::NoTable {
            effect: effect.to_owned(),
            field,
        };
        self.first_given().map_or(Ok(()), |field| Err(refuse(field)))
    }

    /// The law, whatever it acts on.
    pub(super) fn table(&self) -> Result<Table, SettingError> {
        let missing = |what: &str| SettingError::TableMissing(what.to_owned());
        let acts_on = self
            .acts_on
            .as_deref()
            .ok_or_else(|| SettingError::TableMissing(format!("`acts_on`: {}", ActsOn::names_with_units())))?;
        let axes = match self
            .axis
            .as_ref()
            .ok_or_else(|| missing("`axis`: what it depends on"))?
        {
            OneOrTwo::One(axis) => vec![axis.clone()],
            OneOrTwo::List(axes) => axes.clone(),
        };
        let grids = match self
            .grid
            .as_ref()
            .ok_or_else(|| missing("`grid`: points of the axis, in ascending order"))?
        {
            Rows::One(grid) => vec![grid.clone()],
            Rows::Several(grids) => grids.clone(),
        };
        let value = match self
            .value
            .as_ref()
            .ok_or_else(|| missing("`value`: one for each point of the grid"))?
        {
            Rows::One(value) => value.clone(),
            Rows::Several(rows) => {
                let width = grids.last().map_or(0, Vec::len);
                if let Some(row) = rows.iter().find(|row| row.len() != width) {
                    return Err(TableError::Count {
                        given: row.len(),
                        expected: width,
                        two_axes: true,
                    }
                    .into());
                }
                rows.concat()
            }
        };
        if grids.len() != axes.len() {
            let problem = format!(
                "{} lists of points for {} axes: give one for each axis",
                grids.len(),
                axes.len()
            );
            let axis = "the table";
            return Err(TableError::Grid { axis, problem }.into());
        }
        let axes: Result<Vec<Axis>, TableError> = axes.iter().map(|name| Axis::named(name)).collect();
        let with_grids: Vec<(Axis, Vec<f64>)> = axes?.into_iter().zip(grids).collect();
        let table = Table::new(ActsOn::named(acts_on)?, &with_grids, value, self.period)?;
        match self.memory_s {
            Some(memory_s) => Ok(table.with_memory(memory_s)?),
            None => Ok(table),
        }
    }

    /// Whether an effect is a table.
    pub(super) fn is_of(name: &str) -> bool {
        name == TABLE.name
    }

    /// Refuses parameters of an effect in a table.
    pub(super) fn refuse_parameters(parameters: &BTreeMap<String, f64>, names: &str) -> Result<(), SettingError> {
        parameters.keys().next().map_or(Ok(()), |parameter| {
            Err(SettingError::NoParameter {
                effect: TABLE.name,
                parameter: parameter.clone(),
                names: names.to_owned(),
            })
        })
    }
}
