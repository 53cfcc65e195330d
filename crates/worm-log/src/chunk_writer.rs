//! Chunks of a log without a file: what a black box keeps in memory, compressed, until it knows whether it is worth a file.
//!
//! [`head`] and the [`Chunk`]s of one [`ChunkWriter`], one after the other, are a log that was not finished; [`complete`](crate::complete)
//! finishes it. So a box is put together from what is compressed already, and its file costs next to no processor time.

use super::channel::Logged;
use super::scan::Contents;
use super::writer::{BEGUN_NS, Index, Origin, WriteError, Writer};
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Chunks after which the writer below is made anew: it remembers where each chunk was, for an index that nobody writes.
const CHUNKS_OF_A_WRITER: usize = 512;

/// Some seconds of messages, compressed, with their index. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Chunk {
    bytes: Arc<[u8]>,
    /// Time of the earliest message in it, ns of `CLOCK_MONOTONIC`.
    pub first_ns: u64,
    /// Time of the latest message in it, ns of `CLOCK_MONOTONIC`.
    pub last_ns: u64,
}

impl Chunk {
    /// What stands in the file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Makes chunks of messages.
pub struct ChunkWriter {
    writer: Writer<Buffer>,
    buffer: Buffer,
    span_ns: Option<[u64; 2]>,
    latest_ns: u64,
    chunks: usize,
}

impl ChunkWriter {
    /// A writer without messages, begun at this time, ns of `CLOCK_MONOTONIC`: that of messages that have none of their own.
    ///
    /// # Errors
    /// [`WriteError`] when the compressor cannot be set up.
    pub fn new(begun_ns: u64) -> Result<Self, WriteError> {
        let (writer, buffer) = begin(begun_ns)?;
        Ok(Self {
            writer,
            buffer,
            span_ns: None,
            latest_ns: begun_ns,
            chunks: 0,
        })
    }

    /// Adds a message to the chunk under way.
    ///
    /// # Errors
    /// [`WriteError`] when it cannot be compressed.
    pub fn write<T: Logged>(&mut self, message: &T) -> Result<(), WriteError> {
        let made_ns = message.made_ns();
        // One before the first state has no time of its own.
        if made_ns != 0 {
            let [first_ns, last_ns] = self.span_ns.unwrap_or([made_ns; 2]);
            self.span_ns = Some([first_ns.min(made_ns), last_ns.max(made_ns)]);
        }
        self.writer.write(message)
    }

    /// Ends the chunk under way; `None` when there is no message in it.
    ///
    /// # Errors
    /// [`WriteError`] when it cannot be compressed.
    pub fn take(&mut self) -> Result<Option<Chunk>, WriteError> {
        self.writer.flush()?;
        let bytes = self.buffer.take();
        let [first_ns, last_ns] = self.span_ns.take().unwrap_or([self.latest_ns; 2]);
        self.latest_ns = last_ns;
        self.chunks += 1;
        if self.chunks >= CHUNKS_OF_A_WRITER {
            (self.writer, self.buffer) = begin(self.latest_ns)?;
            self.chunks = 0;
        }
        Ok((!bytes.is_empty()).then(|| Chunk {
            bytes: bytes.into(),
            first_ns,
            last_ns,
        }))
    }
}

/// What comes before the chunks in a file: whose log it is, further metadata records by their names, and the topics.
///
/// # Errors
/// [`WriteError`] when it cannot be compressed.
pub fn head(origin: &Origin, records: &[(&str, BTreeMap<String, String>)]) -> Result<Vec<u8>, WriteError> {
    let buffer = Buffer::default();
    let mut writer = Writer::with_contents(
        buffer.clone(),
        Path::new(IN_MEMORY),
        &origin.contents(),
        Index::Messages,
    )?;
    for (name, entries) in records {
        writer.write_metadata(name, entries.clone())?;
    }
    writer.flush()?;
    Ok(buffer.take())
}

/// A metadata record, for between chunks or after the last one.
///
/// # Errors
/// [`WriteError`] never, as far as known.
pub fn metadata_record(name: &str, entries: BTreeMap<String, String>) -> Result<Vec<u8>, WriteError> {
    let (mut writer, buffer) = begin(0)?;
    writer.write_metadata(name, entries)?;
    writer.flush()?;
    Ok(buffer.take())
}

/// How errors call what is no file yet.
const IN_MEMORY: &str = "the log in memory";

/// A writer whose head was written already, and thrown away.
fn begin(begun_ns: u64) -> Result<(Writer<Buffer>, Buffer), WriteError> {
    let contents = Contents {
        metadata: [(BEGUN_NS.to_owned(), begun_ns.to_string())].into(),
        ..Contents::default()
    };
    let buffer = Buffer::default();
    let writer = Writer::with_contents(buffer.clone(), Path::new(IN_MEMORY), &contents, Index::Messages)?;
    buffer.take();
    Ok((writer, buffer))
}

/// Bytes that the writer has written and nobody has taken yet.
#[derive(Debug, Clone, Default)]
struct Buffer(Arc<Mutex<Vec<u8>>>);

impl Buffer {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Write for Buffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut buffer = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        buffer.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
