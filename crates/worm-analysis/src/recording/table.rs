//! Recordings as CSV: one row for each sample, SI units named in the header.
//!
//! `time_s` and `x1_m` … `xn_m` must be there, `gait_phase` and the motor's columns may. Of a worm that nobody saw, the motor's
//! columns with `gait_phase` will do; the worm then says how many cells it has. Columns come in any order, unknown ones are
//! ignored with a warning, lines that begin with `#` are comments, and an empty field or `nan` means not seen.

use super::repair::stamps;
use super::series::{Motor, Recording};
use super::text::Text;
use csv::ByteRecord;
use std::io::Read;
use std::path::Path;
use worm_log::ReadError;
use worm_physics::MAX_CELLS;

/// Most characters of a file that are quoted in an error.
const MAX_QUOTED: usize = 32;
/// Most columns of a table: some for each cell and the motor, and room for those of other programs.
const MAX_COLUMNS: usize = 1000;
/// Most columns that are named because they are not known.
const MAX_UNKNOWN_NAMED: usize = 20;

const CELLS_REMEDY: &str = "name the cells' columns x1_m, x2_m, … without a hole, cell 1 leads";
const MOTOR_REMEDY: &str =
    "where nobody saw the worm, record gait_phase, motor_angle_rad, motor_velocity_rad_s and motor_current_a";

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Column {
    Time,
    /// A cell, counted from 0.
    Cell(usize),
    Phase,
    /// An index into [`Motor::COLUMNS`].
    Motor(usize),
    Unknown,
}

/// Columns of the motor without which a table that has no positions says nothing, as indices into [`Motor::COLUMNS`]: the angle, for the ripple of the torque,
/// the velocity and the current.
const NEEDED_OF_MOTOR: [usize; 3] = [0, 1, 2];

/// Reads all rows. Whether they can be of a worm is checked elsewhere (`sanity_check`). `unseen_cells` is how many cells a worm has of which only the
/// motor is wanted; none where positions are.
///
/// # Errors
/// [`ReadError`] with line and column for an invalid header or row.
pub(super) fn read<R: Read>(
    path: &Path,
    text: Text<'_, R>,
    unseen_cells: Option<usize>,
) -> Result<Recording, ReadError> {
    let mut rows = Rows {
        path,
        unseen_cells,
        reader: csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .from_reader(text),
        names: Vec::new(),
        columns: Vec::new(),
    };
    let mut record = ByteRecord::new();
    if !rows.next(&mut record)? {
        let remedy = "give a file with a header row and samples";
        return Err(ReadError::whole(path, "holds nothing but comments", remedy));
    }
    let mut recording = rows.read_header(&record)?;
    let mut values = vec![f64::NAN; rows.columns.len()];
    let (mut line, mut is_cut_off) = (0, false);
    let mut wrong_time = None;
    while rows.next(&mut record)? {
        line = rows.line();
        if let Err(error) = rows.parse(&record, &mut values) {
            let is_short = record.len() < rows.columns.len();
            let is_last = !rows.next(&mut record)?;
            if is_last && (is_short || rows.reader.get_ref().is_unterminated()) {
                is_cut_off = true;
                break;
            }
            return Err(wrong_time.unwrap_or(error));
        }
        if let Some(error) = rows.wrong_time(recording.time_s.last().copied(), &values) {
            wrong_time.get_or_insert(error);
        }
        for (column, value) in rows.columns.iter().zip(&values) {
            match (column, &mut recording) {
                (Column::Time, recording) => recording.time_s.push(*value),
                (Column::Cell(cell), recording) => recording.position_m[*cell].push(*value),
                (
                    Column::Phase,
                    Recording {
                        gait_phase: Some(phase),
                        ..
                    },
                ) => phase.push(*value),
                (Column::Motor(index), Recording { motor: Some(motor), .. }) => motor.series_mut()[*index].push(*value),
                _ => {}
            }
        }
    }
    for series in &mut recording.position_m {
        series.resize(recording.time_s.len(), f64::NAN);
    }
    let ends_back = matches!(recording.time_s[..], [.., before_s, last_s] if last_s <= before_s);
    let is_unterminated = line > 0 && rows.reader.get_ref().is_unterminated();
    if is_unterminated && ends_back && !is_cut_off {
        recording.keep(&vec![true; recording.samples() - 1]);
        is_cut_off = true;
    }
    if is_cut_off {
        let note = format!("line {line}: the file is cut off in this line; the whole samples before it are used");
        recording.warnings.push(note);
    } else if is_unterminated {
        let note =
            format!("line {line}: the file ends without a line end and may be cut off; this line is used as it is");
        recording.warnings.push(note);
    }
    if let Some(motor) = &mut recording.motor {
        let samples = recording.time_s.len();
        motor
            .series_mut()
            .into_iter()
            .for_each(|series| series.resize(samples, f64::NAN));
    }
    with_increasing_time(recording, wrong_time)
}

/// Leaves out single samples whose time does not grow; `wrong_time` is the error for the first of them, where there are too many.
fn with_increasing_time(mut recording: Recording, wrong_time: Option<ReadError>) -> Result<Recording, ReadError> {
    let Some(error) = wrong_time else {
        return Ok(recording);
    };
    let kept = stamps::increasing(&recording.time_s).ok_or(error)?;
    if kept.contains(&false) {
        recording.repairs.push(stamps::note(&recording.time_s, &kept));
        recording.keep(&kept);
    }
    Ok(recording)
}

struct Rows<'p, R> {
    path: &'p Path,
    unseen_cells: Option<usize>,
    reader: csv::Reader<R>,
    names: Vec<String>,
    columns: Vec<Column>,
}

impl<R: Read> Rows<'_, R> {
    fn next(&mut self, record: &mut ByteRecord) -> Result<bool, ReadError> {
        self.reader.read_byte_record(record).map_err(|error| {
            let remedy = "is the disk or the share still there?";
            ReadError::at(
                self.path,
                format!("line {}", self.line() + 1),
                error.to_string(),
                remedy,
            )
        })
    }

    /// The line that was read last, from 1. [`Text`] terminates every line, so the reader stands behind it.
    fn line(&self) -> u64 {
        self.reader.position().line().saturating_sub(1)
    }

    fn place(&self, index: usize) -> String {
        let name = self
            .names
            .get(index)
            .map(|name| format!(" ({name})"))
            .unwrap_or_default();
        format!("line {}, column {}{name}", self.line(), index + 1)
    }

    fn refuse<T>(&self, index: usize, problem: impl Into<String>, remedy: impl Into<String>) -> Result<T, ReadError> {
        Err(ReadError::at(self.path, self.place(index), problem, remedy))
    }

    fn refuse_line<T>(&self, problem: impl Into<String>, remedy: impl Into<String>) -> Result<T, ReadError> {
        Err(ReadError::at(
            self.path,
            format!("line {}", self.line()),
            problem,
            remedy,
        ))
    }

    /// Parses the header row; returns a recording with its series, all of them empty.
    fn read_header(&mut self, header: &ByteRecord) -> Result<Recording, ReadError> {
        if header.len() > MAX_COLUMNS {
            return self.refuse_line(
                format!("there are {} columns", header.len()),
                format!("leave out what is not a worm's: at most {MAX_COLUMNS} columns are read"),
            );
        }
        let names: Vec<String> = header
            .iter()
            .map(|name| String::from_utf8_lossy(name).trim().to_owned())
            .collect();
        if let [only] = names.as_slice()
            && only.contains([';', '\t'])
        {
            return self.refuse_line(
                "the columns are separated by semicolons or tabs",
                "separate them by commas, with a point in numbers",
            );
        }
        let mut warnings = Vec::new();
        let mut unknown = 0;
        for (index, name) in names.iter().enumerate() {
            let column = column_of(name);
            if let Some(unit) = unit_problem(name) {
                return self.refuse(
                    index,
                    format!("the column {} {unit}", quoted(name)),
                    "convert positions to metres and name the columns x1_m, x2_m, …",
                );
            }
            match self.columns.iter().position(|&other| other == column) {
                _ if column == Column::Unknown => {
                    unknown += 1;
                    if unknown <= MAX_UNKNOWN_NAMED {
                        let name = quoted(name);
                        warnings.push(format!("column {} ({name}) is not known and not used", index + 1));
                    }
                }
                Some(first) => {
                    return self.refuse(
                        index,
                        format!("{name} appears twice, first as column {}", first + 1),
                        "keep one of them",
                    );
                }
                None => {}
            }
            self.columns.push(column);
        }
        if unknown > MAX_UNKNOWN_NAMED {
            let more = unknown - MAX_UNKNOWN_NAMED;
            warnings.push(format!("{more} more columns are not known and not used"));
        }
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return self.refuse_line(
                "the header row is missing: the first row holds numbers",
                "name the columns: time_s,x1_m,x2_m,…",
            );
        }
        if !self.columns.contains(&Column::Time) {
            return self.refuse_line(
                format!(
                    "there is no column time_s; the columns are {}",
                    quoted(&names.join(", "))
                ),
                "name the column of times time_s, in seconds",
            );
        }
        let cells = self.count_cells(&names)?;
        self.names = names;
        Ok(Recording {
            source: self.path.to_path_buf(),
            cell_names: (1..=cells).map(|cell| format!("x{cell}_m")).collect(),
            time_s: Vec::new(),
            position_m: vec![Vec::new(); cells],
            gait_phase: self.columns.contains(&Column::Phase).then(Vec::new),
            motor: self
                .columns
                .iter()
                .any(|column| matches!(column, Column::Motor(_)))
                .then(Motor::default),
            warnings,
            repairs: Vec::new(),
        })
    }

    /// Number of cells, which must be numbered from 1 without a gap.
    fn count_cells(&self, names: &[String]) -> Result<usize, ReadError> {
        let mut numbers: Vec<usize> = self
            .columns
            .iter()
            .filter_map(|column| match column {
                Column::Cell(cell) => Some(cell + 1),
                _ => None,
            })
            .collect();
        numbers.sort_unstable();
        let missing = (1..).zip(&numbers).find(|(expected, number)| expected != *number);
        let remedy = CELLS_REMEDY;
        match (numbers.last(), missing) {
            (None, _) => self.count_unseen_cells(names),
            (Some(last), Some((expected, _))) => {
                self.refuse_line(format!("x{expected}_m is missing, but there is x{last}_m"), remedy)
            }
            (Some(1), None) => self.refuse_line("there is only one cell, x1_m", "a worm has at least 2 cells"),
            (Some(&last), None) if last > MAX_CELLS => self.refuse_line(
                format!("there are {last} cells"),
                format!("at most {MAX_CELLS} are handled"),
            ),
            (Some(&last), None) => Ok(last),
        }
    }

    /// Number of cells of a table without a column of positions, where the motor's will do.
    fn count_unseen_cells(&self, names: &[String]) -> Result<usize, ReadError> {
        let problem = format!("there is no column x1_m; the columns are {}", quoted(&names.join(", ")));
        let needed = NEEDED_OF_MOTOR.map(|index| (Column::Motor(index), Motor::COLUMNS[index]));
        let needed = [(Column::Phase, "gait_phase")].into_iter().chain(needed);
        let has = |column: &Column| self.columns.contains(column);
        let (present, missing): (Vec<_>, Vec<_>) = needed.partition(|(column, _)| has(column));
        match (self.unseen_cells, missing.first()) {
            (Some(cells), None) => Ok(cells),
            (Some(_), Some((_, name))) if present.iter().any(|(column, _)| *column != Column::Phase) => {
                self.refuse_line(format!("{problem}; and for the motor alone {name} is missing"), MOTOR_REMEDY)
            }
            (None, None) => self.refuse_line(
                format!("{problem}: it is of the motor alone, and positions are needed here"),
                "`wormd analyze` and `wormd explain --current` go by the motor's current; or name the cells' columns x1_m, x2_m, …",
            ),
            _ => self.refuse_line(problem, CELLS_REMEDY),
        }
    }

    /// Parses one row into `values`.
    fn parse(&self, record: &ByteRecord, values: &mut [f64]) -> Result<(), ReadError> {
        if record.len() < values.len() {
            return self.refuse(
                record.len(),
                format!("the row ends after {} of {} fields", record.len(), values.len()),
                "complete the row or take it out",
            );
        }
        if let Some((index, extra)) = record
            .iter()
            .enumerate()
            .skip(values.len())
            .find(|(_, extra)| !extra.trim_ascii().is_empty())
        {
            return self.refuse(
                index,
                format!(
                    "the row has more fields than the header, such as {}",
                    quoted(&String::from_utf8_lossy(extra))
                ),
                "separate fields by commas and write numbers with a point",
            );
        }
        for (index, (field, column)) in record.iter().zip(&self.columns).enumerate() {
            if *column == Column::Unknown {
                continue;
            }
            let value = match parse_field(field) {
                Some(value) if !value.is_infinite() => value,
                Some(value) => {
                    return self.refuse(
                        index,
                        format!("{value} is not a measurement"),
                        "leave the field empty where nothing was seen",
                    );
                }
                None => {
                    let text = quoted(&String::from_utf8_lossy(field));
                    return self.refuse(
                        index,
                        format!("{text} is not a number"),
                        "write a number with a point, or leave the field empty where nothing was seen",
                    );
                }
            };
            if *column == Column::Time && value.is_nan() {
                return self.refuse(index, "there is no time", "give each sample its time");
            }
            values[index] = value;
        }
        Ok(())
    }

    /// The problem with the time of a row that was parsed, after a sample at `last_s`.
    fn wrong_time(&self, last_s: Option<f64>, values: &[f64]) -> Option<ReadError> {
        let index = self.columns.iter().position(|column| *column == Column::Time)?;
        let (last_s, time_s) = (last_s?, values[index]);
        if time_s > last_s {
            return None;
        }
        let what = if time_s < last_s { "goes back" } else { "repeats" };
        let problem = format!("time {what}: {time_s} s after {last_s} s");
        let remedy = "sort the samples by time and keep one for each";
        Some(ReadError::at(self.path, self.place(index), problem, remedy))
    }
}

fn column_of(name: &str) -> Column {
    if name == "time_s" {
        return Column::Time;
    }
    if name == "gait_phase" {
        return Column::Phase;
    }
    if let Some(index) = Motor::COLUMNS.iter().position(|column| *column == name) {
        return Column::Motor(index);
    }
    match cell_number(name) {
        Some((cell, "_m")) => Column::Cell(cell - 1),
        _ => Column::Unknown,
    }
}

/// Splits `x12_m` into 12 and `_m`.
fn cell_number(name: &str) -> Option<(usize, &str)> {
    let rest = name.strip_prefix('x')?;
    let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
    let (number, unit) = rest.split_at(digits);
    let cell = number
        .parse()
        .ok()
        .filter(|&cell| cell > 0 && !number.starts_with('0'))?;
    Some((cell, unit))
}

/// The problem with a column that evidently holds a cell's positions, but not in metres.
fn unit_problem(name: &str) -> Option<&'static str> {
    match cell_number(&name.to_ascii_lowercase())?.1 {
        "_mm" | " (mm)" | " [mm]" | "mm" => Some("is in millimetres"),
        "_cm" | " (cm)" | " [cm]" | "cm" => Some("is in centimetres"),
        "_um" | "_µm" => Some("is in micrometres"),
        "" => Some("names no unit"),
        _ => None,
    }
}

/// A number, or `NaN` for an empty field; `None` for anything else.
fn parse_field(field: &[u8]) -> Option<f64> {
    match std::str::from_utf8(field).ok()?.trim() {
        "" => Some(f64::NAN),
        text => text.parse().ok(),
    }
}

/// A piece of a file in quotes, shortened, without control characters.
pub(super) fn quoted(text: &str) -> String {
    let mut piece: String = text.chars().filter(|c| !c.is_control()).take(MAX_QUOTED).collect();
    if piece.len() < text.len() {
        piece.push('…');
    }
    format!("\"{piece}\"")
}

#[cfg(test)]
mod tests;
