//! Recordings as CSV, for other programs and for reading back.

use super::series::{Motor, Recording};
use std::io::{self, Write};

/// Writes a recording as CSV. Numbers are as short as possible without loss, so that reading it back gives the same values;
/// what was not seen is empty; optional columns are written where they are known.
///
/// # Errors
/// When `out` cannot be written.
pub fn write_csv(recording: &Recording, out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "# Written by wormd {}; source: {}",
        env!("CARGO_PKG_VERSION"),
        one_line(&recording.source.to_string_lossy())
    )?;
    writeln!(
        out,
        "# SI units; positions grow up the canal, cell 1 leads; empty = not seen"
    )?;
    let columns: Vec<String> = (1..=recording.cells()).map(|cell| format!("x{cell}_m")).collect();
    if recording.cell_names != columns {
        let names: Vec<String> = recording.cell_names.iter().map(|name| one_line(name)).collect();
        writeln!(out, "# Cells: {}", names.join(", "))?;
    }
    write!(out, "time_s,{}", columns.join(","))?;
    if recording.gait_phase.is_some() {
        write!(out, ",gait_phase")?;
    }
    let of_motor = recording
        .motor
        .iter()
        .flat_map(|motor| Motor::COLUMNS.iter().zip(motor.series()));
    let known: Vec<_> = of_motor
        .filter(|(_, series)| series.iter().any(|value| !value.is_nan()))
        .collect();
    for (name, _) in &known {
        write!(out, ",{name}")?;
    }
    writeln!(out)?;
    let optional = recording
        .gait_phase
        .iter()
        .chain(known.into_iter().map(|(_, series)| series));
    let series: Vec<&Vec<f64>> = recording.position_m.iter().chain(optional).collect();
    for (sample, time_s) in recording.time_s.iter().enumerate() {
        write!(out, "{time_s:?}")?;
        for values in &series {
            let value = values[sample];
            if value.is_nan() {
                write!(out, ",")?;
            } else {
                // Unlike `{}`, `{:?}` writes 1e-300 in this short form.
                write!(out, ",{value:?}")?;
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// A name without line ends, so that it stays within its comment.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}
