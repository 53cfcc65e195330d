//! The series and the cycles of a run as CSV.
//!
//! `series.csv` names time, positions and gait phase as recordings do, so that it can be read as one. Numbers have all their
//! digits; an unknown value is an empty field.

use crate::experiment::{Analysis, AnalysisByCurrent, CycleValues};

/// A cell without a value.
const UNKNOWN: &str = "";

/// Every sample of every series.
pub(super) fn series(run: &Analysis) -> Result<Vec<u8>, csv::Error> {
    let series = &run.series;
    let mut columns: Vec<(String, Column<'_>)> = vec![
        ("time_s".to_owned(), Column::Values(&series.time_s)),
        ("gait_phase".to_owned(), Column::Values(&series.phase)),
        ("stepping_cell".to_owned(), Column::Cell(&series.stepping_cell)),
    ];
    type Over<'a> = (&'static str, &'static str, &'a [Vec<f64>]);
    let over_cells: [Over<'_>; 5] = [
        ("x", "m", &series.measured_m),
        ("smooth", "m", &series.position_m),
        ("contact", "m", &series.contact_m),
        ("deformation", "m", &series.deformation_m),
        ("theory", "m", &series.theory_m),
    ];
    for (name, unit, list) in over_cells {
        for (cell, values) in list.iter().enumerate() {
            columns.push((format!("{name}{}_{unit}", cell + 1), Column::Values(values)));
        }
    }
    for (cell, values) in series.sliding.iter().enumerate() {
        columns.push((format!("sliding{}", cell + 1), Column::Sign(values)));
    }
    for (name, values) in [
        ("total_force_n", &series.total_force_n),
        ("extension_m", &series.extension_m),
        ("actuator_force_n", &series.actuator_force_n),
        ("energy_loss_j", &series.energy_loss_j),
        ("energy_actuator_net_j", &series.energy_actuator_net_j),
    ] {
        columns.push((name.to_owned(), Column::Values(values)));
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.iter().map(|(name, _)| name))?;
    for sample in 0..series.time_s.len() {
        writer.write_record(columns.iter().map(|(_, column)| column.field(sample)))?;
    }
    finished(writer)
}

/// Every cycle.
pub(super) fn cycles(run: &Analysis) -> Result<Vec<u8>, csv::Error> {
    let mut head = ["cycle", "start_s", "duration_s", "settled", "advance_m"]
        .map(str::to_owned)
        .to_vec();
    for name in ["forward_slide", "backward_slide"] {
        head.extend((1..=run.cells).map(|cell| format!("{name}{cell}_m")));
    }
    head.extend(["energy_loss_j", "energy_actuator_net_j", "energy_actuator_positive_j"].map(str::to_owned));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&head)?;
    for cycle in &run.cycles {
        let mut row = vec![
            cycle.index.to_string(),
            field(cycle.start_s),
            field(cycle.duration_s),
            u8::from(cycle.settled).to_string(),
        ];
        row.extend(figures(&cycle.values, run.cells));
        writer.write_record(&row)?;
    }
    finished(writer)
}

/// Every cycle of a worm that nobody saw.
pub(super) fn cycles_by_current(run: &AnalysisByCurrent) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "end_phase",
        "end_s",
        "is_odd",
        "advance_m",
        "advance_sigma_m",
        "energy_loss_j",
        "energy_loss_sigma_j",
        "energy_electrical_j",
    ])?;
    for cycle in &run.cycles {
        writer.write_record([
            field(cycle.end_phase),
            field(cycle.end_s),
            u8::from(cycle.is_odd).to_string(),
            field(cycle.advance_m),
            field(cycle.advance_sigma_m),
            field(cycle.energy_loss_j),
            field(cycle.energy_loss_sigma_j),
            field(cycle.energy_electrical_j),
        ])?;
    }
    finished(writer)
}

fn figures(values: &CycleValues, cells: usize) -> Vec<String> {
    let mut fields = vec![field(values.advance_m)];
    for slides_m in [&values.forward_slide_m, &values.backward_slide_m] {
        fields.extend((0..cells).map(|cell| slides_m.get(cell).map_or(UNKNOWN.to_owned(), |slide_m| field(*slide_m))));
    }
    let energies_j = [
        values.energy_loss_j,
        values.energy_actuator_net_j,
        values.energy_actuator_positive_j,
    ];
    fields.extend(energies_j.map(field));
    fields
}

fn finished(writer: csv::Writer<Vec<u8>>) -> Result<Vec<u8>, csv::Error> {
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// A column of one value for each sample.
enum Column<'a> {
    Values(&'a [f64]),
    Cell(&'a [usize]),
    Sign(&'a [i8]),
}

impl Column<'_> {
    fn field(&self, sample: usize) -> String {
        let text = match self {
            Self::Values(values) => values.get(sample).map(|value| field(*value)),
            Self::Cell(cells) => cells.get(sample).map(|cell| (cell + 1).to_string()),
            Self::Sign(signs) => signs.get(sample).map(i8::to_string),
        };
        text.unwrap_or_default()
    }
}

/// The shortest text that reads back as the same number.
fn field(value: f64) -> String {
    if value.is_finite() {
        value.to_string()
    } else {
        UNKNOWN.to_owned()
    }
}
