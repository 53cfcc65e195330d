//! Rows as Apache Parquet, column by column.

use super::{Column, ColumnKind, Contents, Entry, Output, Problem};
use crate::channel::Channel;
use parquet::basic::{Compression, Encoding, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{ColumnPath, Type};
use std::sync::Arc;

/// Rows that are in memory at a time: a minute at 1 kHz, so some tens of MB.
const GROUP_ROWS: usize = 1 << 16;

/// How hard zstd tries.
const COMPRESSION_LEVEL: i32 = 6;

/// What goes into the file besides the rows: the log's metadata and configuration, and the JSON Schema of the topic with the meaning and
/// unit of every field.
pub(super) fn facts(channel: Channel, contents: &Contents) -> Vec<KeyValue> {
    let mut facts = vec![KeyValue::new("schema".to_owned(), channel.schema().to_string())];
    let config = contents
        .config
        .iter()
        .map(|text| ("worm.toml".to_owned(), text.clone()));
    let all = contents.metadata.clone().into_iter().chain(config);
    facts.extend(all.map(|(key, value)| KeyValue::new(key, value)));
    facts
}

/// The entries of a column, and for each row whether it has one.
enum Values {
    Whole(Vec<i64>),
    Number(Vec<f64>),
    Text(Vec<ByteArray>),
}

struct ColumnBuffer {
    values: Values,
    is_there: Vec<i16>,
}

pub(super) struct ParquetRows {
    writer: SerializedFileWriter<Output>,
    buffers: Vec<ColumnBuffer>,
    rows: usize,
}

impl ParquetRows {
    pub(super) fn begin(output: Output, name: &str, columns: &[Column], facts: Vec<KeyValue>) -> Result<Self, Problem> {
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::try_new(COMPRESSION_LEVEL)?))
            .set_key_value_metadata(Some(facts));
        let mut fields = Vec::new();
        for column in columns {
            let (physical, logical, encoding) = match column.kind {
                ColumnKind::WallTime => (
                    Physical::INT64,
                    Some(LogicalType::timestamp(true, TimeUnit::NANOS)),
                    Some(Encoding::DELTA_BINARY_PACKED),
                ),
                ColumnKind::Whole => (Physical::INT64, None, Some(Encoding::DELTA_BINARY_PACKED)),
                ColumnKind::Number => (Physical::DOUBLE, None, Some(Encoding::BYTE_STREAM_SPLIT)),
                ColumnKind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String), None),
            };
            let field = Type::primitive_type_builder(&column.name, physical)
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(logical);
            fields.push(Arc::new(field.build()?));
            let path = ColumnPath::from(column.name.as_str());
            // What changes with every row does not repeat, and what repeats the compression finds.
            properties = properties.set_column_dictionary_enabled(path.clone(), encoding.is_none());
            if let Some(encoding) = encoding {
                properties = properties.set_column_encoding(path, encoding);
            }
        }
        let schema = Type::group_type_builder(name).with_fields(fields).build()?;
        let buffer = |column: &Column| ColumnBuffer {
            values: match column.kind {
                ColumnKind::WallTime | ColumnKind::Whole => Values::Whole(Vec::new()),
                ColumnKind::Number => Values::Number(Vec::new()),
                ColumnKind::Text => Values::Text(Vec::new()),
            },
            is_there: Vec::new(),
        };
        Ok(Self {
            writer: SerializedFileWriter::new(output, Arc::new(schema), Arc::new(properties.build()))?,
            buffers: columns.iter().map(buffer).collect(),
            rows: 0,
        })
    }

    pub(super) fn add(&mut self, row: &[Entry]) -> Result<(), Problem> {
        for (buffer, entry) in self.buffers.iter_mut().zip(row) {
            let before = buffer.values.len();
            match (&mut buffer.values, *entry) {
                (Values::Whole(values), Entry::Whole(value)) => values.extend(value),
                (Values::Number(values), Entry::Number(value)) => values.extend(value),
                (Values::Text(values), Entry::Text(value)) => values.extend(value.map(ByteArray::from)),
                (Values::Text(values), Entry::ShortText(text)) => values.push(ByteArray::from(text.as_str())),
                (Values::Text(values), Entry::Code(code)) => {
                    values.push(ByteArray::from(code.to_string().into_bytes()));
                }
                // A column without an entry of its kind.
                _ => {}
            }
            buffer.is_there.push(i16::from(buffer.values.len() > before));
        }
        self.rows += 1;
        if self.rows == GROUP_ROWS {
            self.write_group()
        } else {
            Ok(())
        }
    }

    pub(super) fn finish(mut self) -> Result<Output, Problem> {
        if self.rows > 0 {
            self.write_group()?;
        }
        Ok(self.writer.into_inner()?)
    }

    fn write_group(&mut self) -> Result<(), Problem> {
        let mut group = self.writer.next_row_group()?;
        for ColumnBuffer { values, is_there } in &mut self.buffers {
            match values {
                Values::Whole(values) => write_column::<Int64Type>(&mut group, values, is_there),
                Values::Number(values) => write_column::<DoubleType>(&mut group, values, is_there),
                Values::Text(values) => write_column::<ByteArrayType>(&mut group, values, is_there),
            }?;
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Self::Whole(values) => values.len(),
            Self::Number(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }
}

/// Writes the next column of a group, and empties its buffer.
fn write_column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, Output>,
    values: &mut Vec<T::T>,
    is_there: &mut Vec<i16>,
) -> Result<(), Problem> {
    let mut column = group.next_column()?.ok_or("a column is missing")?;
    column.typed::<T>().write_batch(values, Some(is_there), None)?;
    column.close()?;
    values.clear();
    is_there.clear();
    Ok(())
}
