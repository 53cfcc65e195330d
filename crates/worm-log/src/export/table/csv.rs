//! Rows as comma-separated values, numbers with as many digits as read back to the same bits.

use super::{Column, Entry, Output, Problem};

pub(super) struct CsvRows(csv::Writer<Output>);

impl CsvRows {
    pub(super) fn begin(output: Output, columns: &[Column]) -> Result<Self, Problem> {
        let mut writer = csv::Writer::from_writer(output);
        writer.write_record(columns.iter().map(|column| &column.name))?;
        Ok(Self(writer))
    }

    pub(super) fn add(&mut self, row: &[Entry]) -> Result<(), Problem> {
        for entry in row {
            let text = match entry {
                Entry::Whole(value) => value.map(|value| value.to_string()),
                Entry::Number(value) => value.map(|value| format!("{value:?}")),
                Entry::Text(value) => value.map(str::to_owned),
                Entry::ShortText(text) => Some(text.to_string()),
                Entry::Code(code) => Some(code.to_string()),
            };
            self.0.write_field(text.unwrap_or_default())?;
        }
        self.0.write_record(None::<&[u8]>)?;
        Ok(())
    }

    pub(super) fn finish(self) -> Result<Output, Problem> {
        Ok(self.0.into_inner().map_err(|error| error.into_error())?)
    }
}
