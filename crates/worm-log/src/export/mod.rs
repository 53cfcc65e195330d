//! Logs in other forms: a whole log of one that was cut off, is damaged or is old; and, with the feature `tables`, a table for each topic.
//!
//! What cannot be read of a log is missing in what is made of it, and the reader's warnings say so.

mod output;
#[cfg(feature = "tables")]
mod table;

pub use output::OutputError;
#[cfg(feature = "tables")]
pub use table::{Table, TableFormat, tables};

use super::channel::{Channel, Logged};
use super::payload::{Payload, PayloadError};
use super::scan::scan;
use super::writer::{Index, WriteError, Writer};
use crate::ReadError;
use output::Output;
use std::path::Path;
use worm_estimator::message::{Alarm, CommandRecord, Cycle, Estimate, Inferred, Range, State, Timing, TripStatus};

/// Why a log cannot be exported.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub enum ExportError {
    /// It cannot be read.
    Read(#[from] ReadError),
    /// A file cannot be made.
    Output(#[from] OutputError),
}

impl From<WriteError> for ExportError {
    /// Unlike a recording, a copy that is not whole is removed.
    fn from(WriteError { file, problem }: WriteError) -> Self {
        OutputError::of(&file, problem).into()
    }
}

/// Writes the messages of a log into a new one, in their order, with its configuration and metadata: complete, indexed, and in the encoding
/// of this version. Returns how many messages there are, and the remarks of the reader.
///
/// # Errors
/// [`ExportError`] when the log cannot be read, or the new one cannot be written; there is no new one then.
pub fn copy(log: &Path, to: &Path, overwrite: bool) -> Result<(u64, Vec<String>), ExportError> {
    let contents = scan(log, |_, _| Ok(()))?;
    let output = Output::create(to, overwrite)?;
    let mut writer = Writer::with_contents(output, to, &contents, Index::Messages)?;
    let mut refused = None;
    let mut count = 0;
    let contents = scan(log, |channel, payload| {
        if refused.is_none() {
            count += 1;
            refused = match channel {
                Channel::State => write::<State>(&mut writer, payload),
                Channel::Timing => write::<Timing>(&mut writer, payload),
                Channel::Estimate => write::<Estimate>(&mut writer, payload),
                Channel::Cycle => write::<Cycle>(&mut writer, payload),
                Channel::Alarm => write::<Alarm>(&mut writer, payload),
                Channel::Range => write::<Range>(&mut writer, payload),
                Channel::CommandRecord => write::<CommandRecord>(&mut writer, payload),
                Channel::TripStatus => write::<TripStatus>(&mut writer, payload),
                Channel::Inferred => write::<Inferred>(&mut writer, payload),
            }?;
        }
        Ok(())
    })?;
    match refused {
        Some(error) => Err(error.into()),
        None => {
            writer.finish()?.keep()?;
            Ok((count, contents.warnings))
        }
    }
}

/// Writes one message; returns why the output refused it, if it did.
fn write<T: Logged>(writer: &mut Writer<Output>, payload: Payload<'_>) -> Result<Option<WriteError>, PayloadError> {
    Ok(writer.write(&payload.read::<T>()?).err())
}
