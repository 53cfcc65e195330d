//! Writing a log.

use super::channel::{CHANNELS, CONFIG_ATTACHMENT, Channel, Logged, METADATA, PROTOBUF};
use super::note::{NOTE, Note};
use super::scan::Contents;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// A chunk is finished when it has this many bytes of messages.
const LARGEST_CHUNK: usize = 1 << 20;

/// Bytes that a message takes besides its own.
const RECORD_HEAD: usize = 31;

/// How hard zstd tries. Beyond it, a log shrinks by 2 % and takes two to five times as long.
const COMPRESSION_LEVEL: u32 = 3;

/// Whether a log gets an index of its messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Index {
    /// With its end, a log gets an index of each message: viewers need it to jump in time, and some to read at all. 16 bytes a message.
    #[default]
    Messages,
    /// It has none, and is read from the front: 30 % smaller.
    None,
}

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
    pub(super) fn contents(&self) -> Contents {
        // A clock before 1970 is not set.
        let unix = self.begun.duration_since(UNIX_EPOCH).unwrap_or_default();
        let entries = [
            ("worm", self.worm.clone()),
            ("cells", self.cells.to_string()),
            ("wormd_version", env!("CARGO_PKG_VERSION").to_owned()),
            ("begun_unix_ns", unix.as_nanos().to_string()),
            (BEGUN_NS, self.begun_ns.to_string()),
        ];
        Contents {
            config: self.config.clone(),
            metadata: entries.map(|(key, value)| (key.to_owned(), value)).into(),
            ..Contents::default()
        }
    }
}

/// The metadata with the time on `CLOCK_MONOTONIC` at which a log was begun.
pub(super) const BEGUN_NS: &str = "begun_monotonic_ns";

/// Writes one log. [`Writer::finish`] adds the index; without it, the log is readable up to the last [`Writer::flush`].
pub struct Writer<W: Write> {
    mcap: ::mcap::Writer<NoSeek<W>>,
    file: PathBuf,
    /// For each channel its ID in the file, and its number of messages.
    channels: Vec<(u16, u64)>,
    message: Vec<u8>,
    chunk_bytes: usize,
    latest_ns: u64,
}

impl<W: Write> Writer<W> {
    /// Begins a log of all channels, with an index; errors call it `file`.
    ///
    /// # Errors
    /// [`WriteError`] when `out` refuses.
    pub fn new(out: W, file: &Path, origin: &Origin) -> Result<Self, WriteError> {
        Self::with_index(out, file, origin, Index::Messages)
    }

    /// As [`Writer::new`], with or without an index.
    ///
    /// # Errors
    /// As [`Writer::new`].
    pub fn with_index(out: W, file: &Path, origin: &Origin, index: Index) -> Result<Self, WriteError> {
        Self::with_contents(out, file, &origin.contents(), index)
    }

    /// Begins a log with the configuration, the metadata and the notes of another.
    ///
    /// # Errors
    /// As [`Writer::new`].
    pub fn with_contents(out: W, file: &Path, contents: &Contents, index: Index) -> Result<Self, WriteError> {
        let begun_ns = contents.metadata.get(BEGUN_NS);
        let begun_ns = begun_ns.and_then(|text| text.parse().ok()).unwrap_or(0);
        let begin = || {
            let is_indexed = index == Index::Messages;
            // Without seeking, a chunk is assembled in memory, and a partial one is never written.
            let mut mcap = WriteOptions::new()
                .compression(Some(Compression::Zstd))
                .compression_level(COMPRESSION_LEVEL)
                .compression_threads(0)
                .chunk_size(None)
                .disable_seeking(true)
                .emit_message_indexes(is_indexed)
                // An index of chunks without messages makes viewers believe that they are empty.
                .emit_chunk_indexes(is_indexed)
                .library(concat!("wormd ", env!("CARGO_PKG_VERSION")))
                .create(NoSeek::new(out))?;
            mcap.write_metadata(&metadata(METADATA, contents.metadata.clone()))?;
            for note in &contents.notes {
                mcap.write_metadata(&metadata(NOTE, note.entries()))?;
            }
            if let Some(config) = &contents.config {
                mcap.attach(&attachment(config, begun_ns))?;
            }
            let numbered = || (1_u16..).zip(Channel::ALL);
            // Before the chunk, which may be damaged so that nothing is found for a while after it.
            let in_words = |(id, channel): (u16, &Channel)| {
                let words = format!("{} {PROTOBUF} {}", channel.topic(), channel.type_name());
                (id.to_string(), words)
            };
            mcap.write_metadata(&metadata(CHANNELS, numbered().map(in_words).collect()))?;
            let mut channels = Vec::new();
            for (id, channel) in numbered() {
                let schema = mcap.add_schema(channel.type_name(), PROTOBUF, &channel.descriptor_set())?;
                let id = mcap.add_channel_with_id(id, schema, &channel.topic(), PROTOBUF, &BTreeMap::new())?;
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
            message: Vec::new(),
            chunk_bytes: 0,
            latest_ns: begun_ns,
        })
    }

    /// Appends a message.
    ///
    /// # Errors
    /// [`WriteError`] when the output refuses.
    pub fn write<T: Logged>(&mut self, message: &T) -> Result<(), WriteError> {
        self.message.clear();
        message.write_protobuf(&mut self.message);
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
            // Optional, and in the message: it would take two bytes more.
            sequence: 0,
            log_time: time_ns,
            publish_time: time_ns,
        };
        *count += 1;
        let written = self.mcap.write_to_known_channel(&header, &self.message);
        written.map_err(|error| refused(&self.file, error))?;
        self.chunk_bytes += RECORD_HEAD + self.message.len();
        if self.chunk_bytes > LARGEST_CHUNK {
            self.flush()
        } else {
            Ok(())
        }
    }

    /// Appends a metadata record.
    ///
    /// # Errors
    /// [`WriteError`] when the output refuses.
    pub(super) fn write_metadata(&mut self, name: &str, entries: BTreeMap<String, String>) -> Result<(), WriteError> {
        let written = self.mcap.write_metadata(&metadata(name, entries));
        written.map_err(|error| refused(&self.file, error))
    }

    /// Appends a note.
    ///
    /// # Errors
    /// [`WriteError`] when the output refuses.
    pub fn write_note(&mut self, note: &Note) -> Result<(), WriteError> {
        self.write_metadata(NOTE, note.entries())
    }

    /// Appends what the log has at its beginning as well, where it was found out later; readers take the later.
    ///
    /// # Errors
    /// [`WriteError`] when the output refuses.
    pub fn write_origin(&mut self, origin: &Origin) -> Result<(), WriteError> {
        let contents = origin.contents();
        self.write_metadata(METADATA, contents.metadata)?;
        let Some(config) = &contents.config else { return Ok(()) };
        let attached = self.mcap.attach(&attachment(config, origin.begun_ns));
        attached.map_err(|error| refused(&self.file, error))
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

fn attachment(config: &str, begun_ns: u64) -> Attachment<'_> {
    Attachment {
        log_time: begun_ns,
        create_time: begun_ns,
        name: CONFIG_ATTACHMENT.to_owned(),
        media_type: "application/toml".to_owned(),
        data: config.as_bytes().into(),
    }
}

fn metadata(name: &str, metadata: BTreeMap<String, String>) -> Metadata {
    let name = name.to_owned();
    Metadata { name, metadata }
}

fn refused(file: &Path, error: McapError) -> WriteError {
    let problem = match error {
        McapError::Io(error) => error.to_string(),
        error => error.to_string(),
    };
    let file = file.to_owned();
    WriteError { file, problem }
}
