//! Writing a log.

use super::channel::{CONFIG_ATTACHMENT, Channel, Logged, MESSAGE_ENCODING, METADATA, SCHEMA_ENCODING};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// A chunk is finished when it has this many bytes of JSON.
const LARGEST_CHUNK: usize = 1 << 20;

/// Why a log cannot be written.
#[derive(Debug, thiserror::Error)]
#[error(
    "{file}: cannot be written: {problem}: make room or choose another place; what was written until then can be read",
    file = file.display()
)]
pub struct WriteError {
    /// The file.
    pub file: PathBuf,
    /// The message of the operating system.
    pub problem: String,
}

/// The worm that a log is of, and when it starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// Name of the worm.
    pub worm: String,
    /// Number of cells.
    pub cells: usize,
    /// The configuration file's text; none if the worm runs on defaults.
    pub config: Option<String>,
    /// When the log was begun, wall-clock time.
    pub begun: SystemTime,
    /// The same moment, ns of `CLOCK_MONOTONIC`.
    pub begun_ns: u64,
}

impl Origin {
    fn metadata(&self) -> Metadata {
        // A clock before 1970 is not set.
        let unix = self.begun.duration_since(UNIX_EPOCH).unwrap_or_default();
        let entries = [
            ("worm", self.worm.clone()),
            ("cells", self.cells.to_string()),
            ("wormd_version", env!("CARGO_PKG_VERSION").to_owned()),
            ("begun_unix_ns", unix.as_nanos().to_string()),
            ("begun_monotonic_ns", self.begun_ns.to_string()),
        ];
        Metadata {
            name: METADATA.to_owned(),
            metadata: entries.map(|(key, value)| (key.to_owned(), value)).into(),
        }
    }
}

/// Writes one log. [`Writer::finish`] adds the index; without it, the log is readable up to the last [`Writer::flush`].
pub struct Writer<W: Write> {
    mcap: ::mcap::Writer<NoSeek<W>>,
    file: PathBuf,
    /// For each channel its ID in the file, and its number of messages.
    channels: Vec<(u16, u64)>,
    text: Vec<u8>,
    chunk_bytes: usize,
    latest_ns: u64,
}

impl<W: Write> Writer<W> {
    /// Begins a log of all channels; errors call it `file`.
    ///
    /// # Errors
    /// [`WriteError`] when `out` refuses.
    pub fn new(out: W, file: &Path, origin: &Origin) -> Result<Self, WriteError> {
        let begin = || {
            // Without seeking, a chunk is assembled in memory, and a partial one is never written.
            let mut mcap = WriteOptions::new()
                .compression(Some(Compression::Lz4))
                .chunk_size(None)
                .disable_seeking(true)
                .library(concat!("wormd ", env!("CARGO_PKG_VERSION")))
                .create(NoSeek::new(out))?;
            mcap.write_metadata(&origin.metadata())?;
            if let Some(config) = &origin.config {
                mcap.attach(&Attachment {
                    log_time: origin.begun_ns,
                    create_time: origin.begun_ns,
                    name: CONFIG_ATTACHMENT.to_owned(),
                    media_type: "application/toml".to_owned(),
                    data: config.as_bytes().into(),
                })?;
            }
            let mut channels = Vec::new();
            for channel in Channel::ALL {
                let schema = channel.schema().to_string();
                let schema = mcap.add_schema(channel.type_name(), SCHEMA_ENCODING, schema.as_bytes())?;
                let id = mcap.add_channel(schema, &channel.topic(), MESSAGE_ENCODING, &BTreeMap::new())?;
                channels.push((id, 0));
            }
            mcap.flush()?;
            Ok((mcap, channels))
        };
        let (mcap, channels) = begin().map_err(|error| refused(file, error))?;
        Ok(Self {
            mcap,
            file: file.to_owned(),
            channels,
            text: Vec::new(),
            chunk_bytes: 0,
            latest_ns: origin.begun_ns,
        })
    }

    /// Appends a message.
    ///
    /// # Errors
    /// [`WriteError`] when the output refuses.
    pub fn write<T: Logged>(&mut self, message: &T) -> Result<(), WriteError> {
        self.text.clear();
        let written = message.write_json(&mut self.text).map_err(std::io::Error::from);
        written.map_err(|error| refused(&self.file, error.into()))?;
        // An estimate before the first state has no time of its own.
        let time_ns = if message.made_ns() == 0 {
            self.latest_ns
        } else {
            message.made_ns()
        };
        self.latest_ns = self.latest_ns.max(time_ns);
        let (channel_id, count) = &mut self.channels[T::CHANNEL as usize];
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *count as u32,
            log_time: time_ns,
            publish_time: time_ns,
        };
        *count += 1;
        let written = self.mcap.write_to_known_channel(&header, &self.text);
        written.map_err(|error| refused(&self.file, error))?;
        self.chunk_bytes += self.text.len();
        if self.chunk_bytes > LARGEST_CHUNK {
            self.flush()
        } else {
            Ok(())
        }
    }

    /// Finishes the chunk and writes it: everything so far can then be read, whatever happens later.
    ///
    /// # Errors
    /// [`WriteError`] when the output refuses.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.chunk_bytes = 0;
        self.mcap.flush().map_err(|error| refused(&self.file, error))
    }

    /// The number of messages of a channel.
    pub fn count(&self, channel: Channel) -> u64 {
        self.channels[channel as usize].1
    }

    /// Ends the log with its index and returns the output.
    ///
    /// # Errors
    /// [`WriteError`] when the output refuses.
    pub fn finish(mut self) -> Result<W, WriteError> {
        let finished = self.mcap.finish();
        finished.map_err(|error| refused(&self.file, error))?;
        Ok(self.mcap.into_inner().into_inner())
    }
}

fn refused(file: &Path, error: McapError) -> WriteError {
    let problem = match error {
        McapError::Io(error) => error.to_string(),
        error => error.to_string(),
    };
    let file = file.to_owned();
    WriteError { file, problem }
}
