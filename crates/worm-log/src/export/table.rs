//! A table for each topic: a row for each message, a column for each field.
//!
//! - Columns are named as the fields are; a list over cells has a column for each cell, from 1: `position_m_1`, `position_m_2`, …
//! - `wall_time` comes first: the message's time as wall-clock time, by the moment at which the log was begun. It is missing in logs
//!   without that moment.
//! - Whole numbers are signed 64-bit ones, so that differences of times come out right. Codes are names.
//! - A value that is not known has no entry, neither zero nor `NaN`; nor has the time of an estimate before the first state.

mod csv;
mod parquet;

use super::super::channel::{Channel, Logged};
use super::super::payload::{Payload, PayloadError};
use super::super::scan::{Contents, scan};
use super::ExportError;
use super::output::{Output, OutputError};
use std::path::{Path, PathBuf};
use worm_estimator::message::{
    Alarm, CommandRecord, Cycle, Estimate, FieldKind, FieldValue, Inferred, Range, ShortText, State, Timing, TripStatus,
};

/// Name of the column with the wall-clock time.
const WALL_TIME: &str = "wall_time";

/// What a table is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// Apache Parquet: typed columns, compressed.
    Parquet,
    /// Comma-separated values. `wall_time` is in ns since 1970 (UTC).
    Csv,
}

impl TableFormat {
    const fn extension(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Csv => "csv",
        }
    }
}

/// A table that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// The file.
    pub file: PathBuf,
    /// How many rows it has.
    pub rows: u64,
}

/// Writes a table for each of these topics that has messages into a folder, which is made if it is not there. Returns the tables and the
/// remarks of the reader.
///
/// # Errors
/// [`ExportError`] when the log cannot be read, or a table cannot be written: there is no table then.
pub fn tables(
    log: &Path,
    folder: &Path,
    format: TableFormat,
    topics: &[Channel],
    overwrite: bool,
) -> Result<(Vec<Table>, Vec<String>), ExportError> {
    // How many columns there are follows from the messages, so they are read twice.
    let mut sizes = vec![Size::default(); Channel::ALL.len()];
    let contents = scan(log, |channel, payload| {
        let size = &mut sizes[channel as usize];
        size.rows += 1;
        size.cells = size.cells.max(cells(channel, payload)?);
        Ok(())
    })?;
    std::fs::create_dir_all(folder).map_err(|error| OutputError::of_making(folder, &error))?;
    let clock = WallClock::of(&contents);
    let mut open: Vec<Option<OpenTable>> = Vec::new();
    for (&channel, size) in Channel::ALL.iter().zip(&sizes) {
        let is_wanted = topics.contains(&channel) && size.rows > 0;
        open.push(if is_wanted {
            let file = folder.join(format!("{}.{}", channel.name(), format.extension()));
            Some(OpenTable::begin(
                channel, file, format, size.cells, &contents, overwrite,
            )?)
        } else {
            None
        });
    }
    let mut refused = None;
    let contents = scan(log, |channel, payload| {
        if let (Some(table), None) = (&mut open[channel as usize], &refused) {
            refused = match channel {
                Channel::State => table.add::<State>(payload, clock),
                Channel::Timing => table.add::<Timing>(payload, clock),
                Channel::Estimate => table.add::<Estimate>(payload, clock),
                Channel::Cycle => table.add::<Cycle>(payload, clock),
                Channel::Alarm => table.add::<Alarm>(payload, clock),
                Channel::Range => table.add::<Range>(payload, clock),
                Channel::CommandRecord => table.add::<CommandRecord>(payload, clock),
                Channel::TripStatus => table.add::<TripStatus>(payload, clock),
                Channel::Inferred => table.add::<Inferred>(payload, clock),
            }?;
        }
        Ok(())
    })?;
    if let Some(error) = refused {
        return Err(error.into());
    }
    // All of them first, so that a disk that is full leaves no tables of two logs in one folder.
    let finished = open.into_iter().flatten().map(OpenTable::finish);
    let finished: Vec<_> = finished.collect::<Result<_, _>>()?;
    let mut tables = Vec::new();
    for (output, table) in finished {
        output.keep()?;
        tables.push(table);
    }
    Ok((tables, contents.warnings))
}

/// How large a table becomes.
#[derive(Debug, Clone, Copy, Default)]
struct Size {
    rows: u64,
    cells: usize,
}

fn cells(channel: Channel, payload: Payload<'_>) -> Result<usize, PayloadError> {
    fn of<T: Logged>(payload: Payload<'_>) -> Result<usize, PayloadError> {
        Ok(payload.read::<T>()?.cells())
    }
    match channel {
        Channel::State => of::<State>(payload),
        Channel::Timing => of::<Timing>(payload),
        Channel::Estimate => of::<Estimate>(payload),
        Channel::Cycle => of::<Cycle>(payload),
        Channel::Alarm => of::<Alarm>(payload),
        Channel::Range => of::<Range>(payload),
        Channel::CommandRecord => of::<CommandRecord>(payload),
        Channel::TripStatus => of::<TripStatus>(payload),
        Channel::Inferred => of::<Inferred>(payload),
    }
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ColumnKind {
    /// Wall-clock time, ns since 1970 (UTC).
    WallTime,
    Whole,
    Number,
    Text,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Column {
    name: String,
    kind: ColumnKind,
}

/// One entry of a table; none where the value is not known.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Entry {
    Whole(Option<i64>),
    Number(Option<f64>),
    Text(Option<&'static str>),
    ShortText(ShortText),
    /// A code without a name.
    Code(u32),
}

/// The columns of a topic's table.
fn columns<T: Logged>(cells: usize) -> Vec<Column> {
    let mut columns = vec![Column {
        name: WALL_TIME.to_owned(),
        kind: ColumnKind::WallTime,
    }];
    for field in T::FIELDS {
        let (kind, of_cells) = match field.kind {
            FieldKind::Number => (ColumnKind::Number, None),
            FieldKind::PerCell => (ColumnKind::Number, Some(cells)),
            FieldKind::U64 | FieldKind::U32 | FieldKind::I32 => (ColumnKind::Whole, None),
            FieldKind::Code(_) | FieldKind::Text => (ColumnKind::Text, None),
        };
        let names = match of_cells {
            None => vec![field.name.to_owned()],
            Some(cells) => (1..=cells).map(|cell| format!("{}_{cell}", field.name)).collect(),
        };
        columns.extend(names.into_iter().map(|name| Column { name, kind }));
    }
    columns
}

/// The entries of a message's row, one for each column.
fn entries<T: Logged>(message: &T, cells: usize, clock: Option<WallClock>, row: &mut Vec<Entry>) {
    row.clear();
    let made_ns = Some(message.made_ns()).filter(|&made_ns| made_ns != 0);
    let wall_ns = clock.and_then(|clock| clock.wall_ns(made_ns?));
    row.push(Entry::Whole(wall_ns));
    let known = |value: f64| Entry::Number(Some(value).filter(|value| !value.is_nan()));
    for (place, field) in T::FIELDS.iter().enumerate() {
        match (field.kind, message.field(place)) {
            (FieldKind::PerCell, Some(FieldValue::PerCell(values))) => {
                row.extend((0..cells).map(|cell| known(values.get(cell).copied().unwrap_or(f64::NAN))));
            }
            (FieldKind::Code(codes), Some(FieldValue::Code(code))) => row.push(match codes.name_of(code) {
                Some(name) => Entry::Text(Some(name)),
                None => Entry::Code(code),
            }),
            (FieldKind::Code(_), _) => row.push(Entry::Text(None)),
            (FieldKind::Text, Some(FieldValue::Text(text))) if !text.is_empty() => {
                row.push(Entry::ShortText(ShortText::new(text)));
            }
            (FieldKind::Text, _) => row.push(Entry::Text(None)),
            (FieldKind::Number, Some(FieldValue::Number(value))) => row.push(known(value)),
            // The time of an estimate that rests on no state.
            (_, Some(FieldValue::U64(0))) if made_ns.is_none() && field.name == "time_ns" => {
                row.push(Entry::Whole(None))
            }
            (_, value) => row.push(Entry::Whole(match value {
                // No count or time of a worm comes near.
                Some(FieldValue::U64(value)) => i64::try_from(value).ok(),
                Some(FieldValue::U32(value)) => Some(value.into()),
                Some(FieldValue::I32(value)) => Some(value.into()),
                _ => None,
            })),
        }
    }
}

/// Wall-clock time by the moment at which the log was begun.
#[derive(Debug, Clone, Copy)]
struct WallClock {
    begun_unix_ns: i128,
    begun_monotonic_ns: i128,
}

impl WallClock {
    fn of(contents: &Contents) -> Option<Self> {
        let number = |key| contents.metadata.get(key)?.parse().ok();
        Some(Self {
            begun_unix_ns: number("begun_unix_ns")?,
            begun_monotonic_ns: number("begun_monotonic_ns")?,
        })
    }

    fn wall_ns(self, monotonic_ns: u64) -> Option<i64> {
        let since_ns = i128::from(monotonic_ns).checked_sub(self.begun_monotonic_ns)?;
        i64::try_from(self.begun_unix_ns.checked_add(since_ns)?).ok()
    }
}

/// What writes rows in one format.
enum Rows {
    Parquet(parquet::ParquetRows),
    Csv(csv::CsvRows),
}

/// A table that is being written.
struct OpenTable {
    file: PathBuf,
    cells: usize,
    row: Vec<Entry>,
    count: u64,
    rows: Rows,
}

impl OpenTable {
    fn begin(
        channel: Channel,
        file: PathBuf,
        format: TableFormat,
        cells: usize,
        contents: &Contents,
        overwrite: bool,
    ) -> Result<Self, OutputError> {
        let columns = match channel {
            Channel::State => columns::<State>(cells),
            Channel::Timing => columns::<Timing>(cells),
            Channel::Estimate => columns::<Estimate>(cells),
            Channel::Cycle => columns::<Cycle>(cells),
            Channel::Alarm => columns::<Alarm>(cells),
            Channel::Range => columns::<Range>(cells),
            Channel::CommandRecord => columns::<CommandRecord>(cells),
            Channel::TripStatus => columns::<TripStatus>(cells),
            Channel::Inferred => columns::<Inferred>(cells),
        };
        let output = Output::create(&file, overwrite)?;
        let rows = match format {
            TableFormat::Parquet => {
                let facts = parquet::facts(channel, contents);
                parquet::ParquetRows::begin(output, channel.name(), &columns, facts).map(Rows::Parquet)
            }
            TableFormat::Csv => csv::CsvRows::begin(output, &columns).map(Rows::Csv),
        };
        Ok(Self {
            rows: rows.map_err(|problem| OutputError::of(&file, problem))?,
            file,
            cells,
            row: Vec::new(),
            count: 0,
        })
    }

    /// Adds a message; returns why the output refused it, if it did.
    fn add<T: Logged>(
        &mut self,
        payload: Payload<'_>,
        clock: Option<WallClock>,
    ) -> Result<Option<OutputError>, PayloadError> {
        let message: T = payload.read()?;
        entries(&message, self.cells, clock, &mut self.row);
        let added = match &mut self.rows {
            Rows::Parquet(rows) => rows.add(&self.row),
            Rows::Csv(rows) => rows.add(&self.row),
        };
        self.count += 1;
        Ok(added.err().map(|problem| OutputError::of(&self.file, problem)))
    }

    /// The whole table on the disk, which has no name yet.
    fn finish(self) -> Result<(Output, Table), OutputError> {
        let finished = match self.rows {
            Rows::Parquet(rows) => rows.finish(),
            Rows::Csv(rows) => rows.finish(),
        };
        let mut output = finished.map_err(|problem| OutputError::of(&self.file, problem))?;
        output.sync()?;
        let table = Table {
            file: self.file,
            rows: self.count,
        };
        Ok((output, table))
    }
}

/// Why a format's library refuses, for people.
type Problem = Box<dyn std::error::Error>;
