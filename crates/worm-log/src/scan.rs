//! Reading a log from the front, to wherever it ends.
//!
//! A complete log says at its end where each chunk stands: then damage costs no more than the chunk that it is in. A file that was not
//! finished says nothing of it, and is read record by record. The checksum of each chunk is verified before its
//! messages are used. The beginning of one more chunk may follow the last whole record: what can be unpacked of it (zstd works in blocks
//! of 128 kB, lz4 of 64) is read, too, up to the last whole message, and a warning says so.

mod by_index;
mod definitions;
mod search;

use super::channel::{CHANNELS, CONFIG_ATTACHMENT, Channel, METADATA};
use super::note::{NOTE, Note};
use super::payload::{Encoding, Payload, PayloadError};
use super::shape::{are_whole_records, is_data_end, is_of_data, is_whole, surplus, uncompressed_records};
use super::summary::{behind_the_footer, summary};
use super::unpack::{BoundedZstd, MAX_RATIO};
use crate::ReadError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::Path;
use worm_estimator::abridged::{abridged, first_of};

/// Largest size of an unpacked record, bytes; a greater length is damaged.
const LARGEST_RECORD: usize = 1 << 28;
/// More bytes than a chunk has before its records, with the name of any compression that is known.
const MAX_CHUNK_HEAD: usize = 64;
/// Bytes of a record before its content: its opcode and its length.
const RECORD_HEAD: u64 = 9;

/// Most damaged chunks that are named.
const MAX_DAMAGED_NAMED: usize = 20;
/// Most foreign channels that are named.
const MAX_FOREIGN_NAMED: usize = 20;
/// Longest name from the file that is quoted, bytes.
const MAX_NAME_LEN: usize = 200;
/// Most notes that are repeated among the warnings, and how much of each, bytes.
const MAX_NOTES_NAMED: usize = 20;
const MAX_NOTE_LEN: usize = 400;

/// The contents of a log besides its messages, and remarks on it.
#[derive(Debug, Clone, Default)]
pub struct Contents {
    /// Text of the configuration that the worm ran with.
    pub config: Option<String>,
    /// The metadata record `wormd`: worm, version, wall-clock time.
    pub metadata: BTreeMap<String, String>,
    /// What whoever wrote the log noted in it.
    pub notes: Vec<Note>,
    /// Remarks of the reader: a truncated end, messages of an older version; and the notes.
    pub warnings: Vec<String>,
}

/// Reads a log and hands each of its messages, still as it stands there, to `take`, in the order of the file.
///
/// # Errors
/// [`ReadError`] when the file cannot be read, is not MCAP, has no channel of a worm, or has one whose messages this
/// version cannot read; with channel and number if `take` refuses a message.
pub fn scan(
    path: &Path,
    take: impl FnMut(Channel, Payload<'_>) -> Result<(), PayloadError>,
) -> Result<Contents, ReadError> {
    let file = File::open(path).map_err(|error| unreadable(path, &error))?;
    scan_from(file, path, take)
}

/// As [`scan`], from anything that can be read and rewound; errors call it `path`.
///
/// # Errors
/// As [`scan`].
pub fn scan_from(
    mut input: impl Read + Seek,
    path: &Path,
    take: impl FnMut(Channel, Payload<'_>) -> Result<(), PayloadError>,
) -> Result<Contents, ReadError> {
    let length = skip_magic(&mut input, path)?;
    let mut scanner = Scanner::new(path, take);
    let summary = summary(&mut input, length).map_err(|error| unreadable(path, &error))?;
    if let Some(mut summary) = summary {
        scanner.definitions = std::mem::take(&mut summary.definitions);
        if !summary.chunks.is_empty() {
            return match scanner.take_between(&mut input, summary) {
                Err(Trouble::Refused(error)) => Err(error),
                Err(Trouble::Unreadable(error)) => Err(unreadable(path, &error)),
                Ok(()) | Err(Trouble::Broken(_)) => scanner.into_contents(),
            };
        }
    }
    // Where the last whole record ends.
    let mut at = MAGIC.len() as u64;
    let damaged = search::damaged_beginning(&mut input, length).map_err(|error| unreadable(path, &error))?;
    if let Some(chunks) = damaged {
        at = chunks.begin;
        match scanner.take_between(&mut input, chunks) {
            Err(Trouble::Refused(error)) => return Err(error),
            Err(Trouble::Unreadable(error)) => return Err(unreadable(path, &error)),
            Ok(()) | Err(Trouble::Broken(_)) => {}
        }
    }
    input
        .seek(SeekFrom::Start(at))
        .map_err(|error| unreadable(path, &error))?;
    let framing = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_record_length_limit(at_most(length));
    let mut is_whole = false;
    let end = each_record(BufReader::new(&mut input), framing, |opcode, content| {
        if is_data_end(opcode, content.len() as u64) {
            // What follows is the index.
            is_whole = true;
            return Ok(ControlFlow::Break(()));
        }
        let end = at + RECORD_HEAD + content.len() as u64;
        match scanner.take_record(at, opcode, content) {
            // It costs no other.
            Err(Trouble::Broken(error)) => scanner.warn_of_bytes(at, end, &error),
            taken => taken?,
        }
        at = end;
        Ok(ControlFlow::Continue(()))
    });
    let problem = match end {
        Ok(()) if is_whole => {
            let behind = behind_the_footer(&mut input, at, length).map_err(|error| unreadable(path, &error))?;
            scanner.warn_of_more(behind, length);
            return scanner.into_contents();
        }
        Ok(()) => "it was not finished".to_owned(),
        Err(Trouble::Broken(error)) => error,
        Err(Trouble::Unreadable(error)) => return Err(unreadable(path, &error)),
        Err(Trouble::Refused(error)) => return Err(error),
    };
    let sure = scanner.count;
    input
        .seek(SeekFrom::Start(at))
        .map_err(|error| unreadable(path, &error))?;
    let mut head = Vec::with_capacity(MAX_CHUNK_HEAD);
    let head_read = input.by_ref().take(MAX_CHUNK_HEAD as u64).read_to_end(&mut head);
    head_read.map_err(|error| unreadable(path, &error))?;
    let begun = match head.split_first() {
        // Its records stand as they are.
        Some((&op::CHUNK, rest)) => rest.get(RECORD_HEAD as usize - 1..).and_then(uncompressed_records),
        _ => None,
    };
    let most = unpacked_at_most(length.saturating_sub(at));
    let rest = LinearReaderOptions::default().with_record_length_limit(most);
    let mut unpacked = 0;
    let salvaged = each_record(
        begun.unwrap_or(&head).chain(BufReader::new(&mut input)),
        rest,
        |opcode, content| {
            unpacked += content.len();
            if unpacked > most {
                return Err(McapError::DecompressionError("too much for its size".to_owned()).into());
            }
            scanner.take_plain(opcode, content)?;
            Ok(ControlFlow::Continue(()))
        },
    );
    if let Err(Trouble::Unreadable(error)) = salvaged {
        return Err(unreadable(path, &error));
    }
    scanner.warn_of_the_end(at, length, &problem, scanner.count - sure);
    scanner.into_contents()
}

/// Goes to behind the magic bytes and returns the length of all.
fn skip_magic(input: &mut (impl Read + Seek), path: &Path) -> Result<u64, ReadError> {
    let length = input.seek(SeekFrom::End(0)).and_then(|length| {
        input.rewind()?;
        Ok(length)
    });
    let length = length.map_err(|error| unreadable(path, &error))?;
    let mut magic = [0; MAGIC.len()];
    match input.read_exact(&mut magic) {
        Ok(()) if magic == MAGIC => Ok(length),
        Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => Err(unreadable(path, &error)),
        Err(_) if MAGIC.starts_with(&magic[..magic.len().min(length as usize)]) => Err(refusal(
            path,
            None,
            format!("is cut off after {length} bytes, before the first message"),
            "record it again",
        )),
        _ => Err(refusal(
            path,
            None,
            "is no MCAP file, whatever its name says".to_owned(),
            "give it the extension of what it is",
        )),
    }
}

/// The largest record that fits into so many bytes: the reader reserves what a length field says before it reads.
fn at_most(length: u64) -> usize {
    usize::try_from(length).unwrap_or(LARGEST_RECORD).min(LARGEST_RECORD)
}

/// The largest record that so many compressed bytes can hold.
fn unpacked_at_most(length: u64) -> usize {
    at_most(length.saturating_mul(MAX_RATIO))
}

/// Why reading ends.
enum Trouble {
    Unreadable(io::Error),
    Broken(String),
    Refused(ReadError),
}

impl From<McapError> for Trouble {
    fn from(error: McapError) -> Self {
        Self::Broken(error.to_string())
    }
}

/// Hands each whole record of `input` on.
fn each_record(
    mut input: impl Read,
    options: LinearReaderOptions,
    mut take: impl FnMut(u8, &[u8]) -> Result<ControlFlow<()>, Trouble>,
) -> Result<(), Trouble> {
    let options = options.with_skip_start_magic(true).with_skip_end_magic(true);
    let mut reader = LinearReader::new_with_options(options);
    reader.add_decompressor(BoundedZstd::new()?)?;
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(wanted) => {
                let read = loop {
                    match input.read(reader.insert(wanted)) {
                        Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                        read => break read.map_err(Trouble::Unreadable)?,
                    }
                };
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => {
                if take(opcode, data)?.is_break() {
                    break;
                }
            }
        }
    }
    Ok(())
}

/// An error where a record has taken in what comes after it.
fn without_surplus(opcode: u8, content: &[u8]) -> Result<(), Trouble> {
    match surplus(opcode, content) {
        0 => Ok(()),
        surplus => Err(Trouble::Broken(format!(
            "its last {surplus} bytes do not belong to the record that claims them"
        ))),
    }
}

struct Scanner<'a, F> {
    path: &'a Path,
    take: F,
    schemas: HashMap<u16, String>,
    /// The channels of the file by their IDs, with the encoding of their messages; none for unknown channels.
    channels: HashMap<u16, Option<(Channel, Encoding)>>,
    foreign: Vec<String>,
    /// Schemas and channels as the summary repeats them, for when those in the first chunk are damaged.
    definitions: Vec<(u8, Vec<u8>)>,
    /// The channels in words, for when there is no summary either.
    channel_names: BTreeMap<String, String>,
    damaged_chunks: usize,
    contents: Contents,
    count: u64,
    latest_ns: u64,
}

impl<'a, F: FnMut(Channel, Payload<'_>) -> Result<(), PayloadError>> Scanner<'a, F> {
    fn new(path: &'a Path, take: F) -> Self {
        Self {
            path,
            take,
            schemas: HashMap::new(),
            channels: HashMap::new(),
            foreign: Vec::new(),
            definitions: Vec::new(),
            channel_names: BTreeMap::new(),
            damaged_chunks: 0,
            contents: Contents::default(),
            count: 0,
            latest_ns: 0,
        }
    }

    /// Processes a whole record at byte `at` of the file. A damaged chunk is left out, with a warning; where another record
    /// is damaged, that is the error.
    fn take_record(&mut self, at: u64, opcode: u8, content: &[u8]) -> Result<(), Trouble> {
        if !is_of_data(opcode) {
            let problem = format!("there is no such kind of record in a log, {opcode:#04x}");
            return Err(Trouble::Broken(problem));
        }
        match opcode {
            op::CHUNK => return self.take_chunk(at, content),
            // No checksum covers it: one that cannot be read is no reason to refuse the others.
            op::MESSAGE => self.take_plain(opcode, content).map_err(|trouble| match trouble {
                Trouble::Refused(error) => Trouble::Broken(error.problem),
                trouble => trouble,
            })?,
            _ => self.take_plain(opcode, content)?,
        }
        without_surplus(opcode, content)
    }

    /// Processes a chunk. A damaged one is left out, with a warning.
    fn take_chunk(&mut self, at: u64, content: &[u8]) -> Result<(), Trouble> {
        if self.channels.is_empty() {
            // Should their chunk be damaged so that it is not even known for one.
            self.take_definitions()?;
        }
        if uncompressed_records(content).is_some_and(|records| !are_whole_records(records)) {
            self.warn_of_a_chunk(at, &McapError::UnexpectedEoc.to_string());
            return self.take_definitions();
        }
        let mut head = [op::CHUNK; RECORD_HEAD as usize];
        head[1..].copy_from_slice(&(content.len() as u64).to_le_bytes());
        let checked = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(unpacked_at_most(content.len() as u64));
        let taken = each_record(head.as_slice().chain(content), checked, |opcode, content| {
            self.take_plain(opcode, content)?;
            Ok(ControlFlow::Continue(()))
        });
        match taken {
            Err(Trouble::Broken(error)) => {
                self.warn_of_a_chunk(at, &error);
                self.take_definitions()
            }
            Ok(()) => without_surplus(op::CHUNK, content),
            taken => taken,
        }
    }

    fn warn_of_a_chunk(&mut self, at: u64, error: &str) {
        self.damaged_chunks += 1;
        if self.damaged_chunks <= MAX_DAMAGED_NAMED {
            let warning = format!("the chunk at byte {at} is damaged ({error}): its messages are left out");
            self.contents.warnings.push(abridged(warning, MAX_NAME_LEN));
        }
    }

    /// Processes a record that is not a chunk.
    fn take_plain(&mut self, opcode: u8, content: &[u8]) -> Result<(), Trouble> {
        if !matches!(
            opcode,
            op::SCHEMA | op::CHANNEL | op::MESSAGE | op::MESSAGE_INDEX | op::METADATA | op::ATTACHMENT
        ) {
            return Ok(());
        }
        if !is_whole(opcode, content) {
            return Err(McapError::UnexpectedEof.into());
        }
        if opcode == op::MESSAGE_INDEX {
            return Ok(());
        }
        match ::mcap::parse_record(opcode, content)? {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                self.take_channel(channel, &schema).map_err(Trouble::Refused)?;
            }
            Record::Message { header, data } => {
                let channel = self
                    .channels
                    .get(&header.channel_id)
                    .ok_or(McapError::UnknownChannel(header.sequence, header.channel_id))?;
                let Some((channel, encoding)) = *channel else {
                    return Ok(());
                };
                let payload = Payload { encoding, data: &data };
                (self.take)(channel, payload).map_err(|error| {
                    let place = format!("channel {}, message {} of the file", channel.topic(), self.count + 1);
                    let remedy = "the file was not written by wormd, or was changed: record it again";
                    Trouble::Refused(refusal(
                        self.path,
                        Some(place),
                        format!("cannot be read: {error}"),
                        remedy,
                    ))
                })?;
                self.count += 1;
                self.latest_ns = self.latest_ns.max(header.log_time);
            }
            Record::Metadata(metadata) if metadata.name == METADATA => self.contents.metadata = metadata.metadata,
            Record::Metadata(metadata) if metadata.name == CHANNELS => self.channel_names = metadata.metadata,
            Record::Metadata(metadata) if metadata.name == NOTE => {
                self.contents.notes.push(Note::from_entries(metadata.metadata));
            }
            Record::Attachment { header, data, .. } if header.name == CONFIG_ATTACHMENT => {
                let text = String::from_utf8(data.into_owned()).map_err(|_| {
                    let place = Some(format!("attachment {CONFIG_ATTACHMENT}"));
                    Trouble::Refused(refusal(self.path, place, "is no text".to_owned(), "record it again"))
                })?;
                self.contents.config = Some(text);
            }
            _ => {}
        }
        Ok(())
    }

    /// Where a log ends before its file does, says so: what follows is another one.
    fn warn_of_more(&mut self, behind: Option<u64>, length: u64) {
        if let Some(end) = behind.filter(|end| *end < length) {
            self.contents.warnings.push(format!(
                "the log ends at byte {end} of {length}: what follows is left out. If a log was appended to it, `tail -c +{}` takes that out",
                end + 1
            ));
        }
    }

    fn warn_of_the_end(&mut self, at: u64, length: u64, problem: &str, salvaged: u64) {
        let when = if self.count == 0 {
            String::new()
        } else {
            format!(" at t = {:.3} s", self.latest_ns as f64 * 1e-9)
        };
        let unfinished = if salvaged == 0 {
            String::new()
        } else {
            format!("; the last {salvaged} of them stand in a chunk that was not finished")
        };
        self.contents.warnings.push(format!(
            "cut off after {} messages{when}: whole up to byte {at} of {length} ({problem}){unfinished}",
            self.count
        ));
    }

    fn repeat_notes(&mut self) {
        let Contents { notes, warnings, .. } = &mut self.contents;
        let texts = notes.iter().take(MAX_NOTES_NAMED);
        warnings.extend(texts.map(|note| abridged(note.text.clone(), MAX_NOTE_LEN)));
        if notes.len() > MAX_NOTES_NAMED {
            warnings.push(format!("the log has {} notes more", notes.len() - MAX_NOTES_NAMED));
        }
    }

    fn into_contents(mut self) -> Result<Contents, ReadError> {
        if self.damaged_chunks > MAX_DAMAGED_NAMED {
            let more = self.damaged_chunks - MAX_DAMAGED_NAMED;
            let warning = format!("{more} more chunks are damaged: their messages are left out");
            self.contents.warnings.push(warning);
        }
        let foreign = first_of(&self.foreign, MAX_FOREIGN_NAMED, MAX_NAME_LEN);
        if self.channels.values().any(Option::is_some) {
            if !self.foreign.is_empty() {
                self.contents
                    .warnings
                    .push(format!("channels that are not a worm's are ignored: {foreign}"));
            }
            self.repeat_notes();
            return Ok(self.contents);
        }
        let problem = match self.contents.warnings.last() {
            Some(warning) if self.foreign.is_empty() => format!("has no channel at all; {warning}"),
            _ if self.foreign.is_empty() => "has no channel at all".to_owned(),
            _ => format!("has no channel of a worm, only {foreign}"),
        };
        let remedy = "give a file that `wormd record` or `wormd up --record` wrote";
        Err(refusal(self.path, Some("channel /state".to_owned()), problem, remedy))
    }
}

/// An error that names the file and, where there is one, the place in it.
pub(super) fn refusal(path: &Path, place: Option<String>, problem: String, remedy: &str) -> ReadError {
    ReadError {
        file: path.to_owned(),
        place,
        problem,
        remedy: remedy.to_owned(),
    }
}

fn unreadable(path: &Path, error: &io::Error) -> ReadError {
    let remedy = "check that the file is there and may be read";
    refusal(path, None, format!("cannot be read: {error}"), remedy)
}
