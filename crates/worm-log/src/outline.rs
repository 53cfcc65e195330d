//! What a log holds, without unpacking it: for lists of many logs, and to finish one that was cut off.
//!
//! [`outline`] goes from record to record and reads little more than their heads. [`complete`] does the same, cuts off what is
//! not whole at the end, and adds the index that the log's own writer would have added; no message is written anew.

use crate::shape::{is_whole, records};
use crate::unpack::unpacked;
use mcap::MAGIC;
use mcap::records::{AttachmentIndex, ChunkHeader, Record, op};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;

/// Bytes of a record before its content: its opcode and its length.
const RECORD_HEAD: u64 = 9;
/// Longest metadata record or attachment that is read, bytes.
const LARGEST_READ: u64 = 4 << 20;
/// Longest name of a compression, bytes.
pub(crate) const LONGEST_NAME: u32 = 16;
/// Bytes from the beginning of a chunk's content to its records, but for the name of its compression.
pub(crate) const CHUNK_HEAD: usize = 8 + 8 + 8 + 4 + 4 + 8;
/// Largest first chunk that is unpacked for its schemas and channels, bytes.
const LARGEST_UNPACKED: u64 = 1 << 26;
/// Chunks that are unpacked in search of them.
const CHUNKS_UNPACKED: usize = 4;

/// What a log holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outline {
    /// The metadata records by their names; of several with one name, the last.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// Time of the earliest message, ns of `CLOCK_MONOTONIC`; 0 without messages.
    pub first_ns: u64,
    /// Time of the latest message, ns of `CLOCK_MONOTONIC`; 0 without messages.
    pub last_ns: u64,
    /// Messages, where the log has an index of them.
    pub messages: u64,
    /// Whether its writer finished it.
    pub is_complete: bool,
    /// Where its last whole record ends, bytes.
    whole_bytes: u64,
    /// Whether it ends within the index of its last chunk.
    is_cut_in_index: bool,
    index: Index,
}

/// What stands where.
#[derive(Debug, Clone, Default, PartialEq)]
struct Index {
    chunks: Vec<ChunkEntry>,
    attachments: Vec<AttachmentIndex>,
    /// Offset, length and name of each metadata record.
    metadata: Vec<(u64, u64, String)>,
}

#[derive(Debug, Clone, PartialEq)]
struct ChunkEntry {
    offset: u64,
    length: u64,
    header: ChunkHeader,
    /// Offset of the index of each channel, and the number of messages in it.
    messages: BTreeMap<u16, (u64, u64)>,
    /// Bytes of these indexes.
    index_bytes: u64,
}

/// Reads what a log holds, from its beginning to where it ends or is cut off.
///
/// # Errors
/// When it cannot be read, or is no MCAP file.
pub fn outline(input: &mut (impl Read + Seek)) -> io::Result<Outline> {
    let length = input.seek(SeekFrom::End(0))?;
    input.rewind()?;
    let mut reader = BufReader::with_capacity(512, input);
    let mut magic = [0; MAGIC.len()];
    let read = reader.read_exact(&mut magic);
    if read.is_err() || magic != MAGIC {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "it is no MCAP file"));
    }
    let mut outline = Outline {
        whole_bytes: MAGIC.len() as u64,
        ..Outline::default()
    };
    let mut head = [0; RECORD_HEAD as usize];
    loop {
        if length - outline.whole_bytes < RECORD_HEAD {
            // The opcode alone says what was cut off.
            outline.is_cut_in_index =
                outline.whole_bytes < length && read_array::<1>(&mut reader)?[0] == op::MESSAGE_INDEX;
            break;
        }
        let at = outline.whole_bytes;
        reader.read_exact(&mut head)?;
        let (opcode, content_len) = split(head);
        let Some(end) = at
            .checked_add(RECORD_HEAD)
            .and_then(|start| start.checked_add(content_len))
        else {
            break;
        };
        // What was allocated and never written is zeros.
        if opcode == 0 || end > length {
            outline.is_cut_in_index = opcode == op::MESSAGE_INDEX;
            break;
        }
        if opcode == op::DATA_END {
            outline.is_complete = true;
            break;
        }
        if outline.take(opcode, at, content_len, &mut reader)?.is_break() {
            break;
        }
        let here = reader.stream_position()?;
        reader.seek_relative(end as i64 - here as i64)?;
        outline.whole_bytes = end;
    }
    Ok(outline)
}

fn split(head: [u8; RECORD_HEAD as usize]) -> (u8, u64) {
    let [opcode, length @ ..] = head;
    (opcode, u64::from_le_bytes(length))
}

impl Outline {
    /// Takes a record, reading from its content what is wanted; breaks at one that is damaged.
    fn take(
        &mut self,
        opcode: u8,
        at: u64,
        content_len: u64,
        reader: &mut (impl Read + Seek),
    ) -> io::Result<ControlFlow<()>> {
        let length = RECORD_HEAD + content_len;
        match opcode {
            op::CHUNK => {
                let Some(header) = chunk_header(reader, content_len)? else {
                    return Ok(ControlFlow::Break(()));
                };
                self.index.chunks.push(ChunkEntry {
                    offset: at,
                    length,
                    header,
                    messages: BTreeMap::new(),
                    index_bytes: 0,
                });
            }
            op::MESSAGE_INDEX if content_len >= 6 => {
                let [a, b, c, d, e, f] = read_array::<6>(reader)?;
                let count = u64::from(u32::from_le_bytes([c, d, e, f])) / 16;
                let Some(chunk) = self.index.chunks.last_mut() else {
                    return Ok(ControlFlow::Continue(()));
                };
                chunk.messages.insert(u16::from_le_bytes([a, b]), (at, count));
                chunk.index_bytes += length;
                if count > 0 {
                    let (first_ns, last_ns) = (chunk.header.message_start_time, chunk.header.message_end_time);
                    self.first_ns = if self.messages == 0 {
                        first_ns
                    } else {
                        self.first_ns.min(first_ns)
                    };
                    self.last_ns = self.last_ns.max(last_ns);
                    self.messages += count;
                }
            }
            op::METADATA | op::ATTACHMENT if content_len <= LARGEST_READ => {
                let mut content = vec![0; content_len as usize];
                reader.read_exact(&mut content)?;
                if !is_whole(opcode, &content) {
                    return Ok(ControlFlow::Break(()));
                }
                match mcap::parse_record(opcode, &content) {
                    Ok(Record::Metadata(metadata)) => {
                        self.index.metadata.push((at, length, metadata.name.clone()));
                        self.metadata.insert(metadata.name, metadata.metadata);
                    }
                    Ok(Record::Attachment { header, data, .. }) => self.index.attachments.push(AttachmentIndex {
                        offset: at,
                        length,
                        log_time: header.log_time,
                        create_time: header.create_time,
                        data_size: data.len() as u64,
                        name: header.name,
                        media_type: header.media_type,
                    }),
                    _ => return Ok(ControlFlow::Break(())),
                }
            }
            _ => {}
        }
        Ok(ControlFlow::Continue(()))
    }
}

impl Outline {
    /// A chunk whose index was cut off would be found by some readers and not by others.
    fn leave_out_last_chunk_without_index(&mut self) {
        let Some(last) = self.index.chunks.last() else { return };
        let is_at_the_end = last.offset + last.length + last.index_bytes == self.whole_bytes;
        // The first chunk holds schemas and no message, and so has no time.
        let has_messages = last.header.message_end_time != 0;
        if !is_at_the_end || !has_messages || !(self.is_cut_in_index || last.messages.is_empty()) {
            return;
        }
        self.whole_bytes = last.offset;
        self.messages -= last.messages.values().map(|(_, count)| count).sum::<u64>();
        self.index.chunks.pop();
        let with_messages = self.index.chunks.iter().filter(|chunk| !chunk.messages.is_empty());
        let ends_ns = with_messages.map(|chunk| chunk.header.message_end_time);
        self.last_ns = ends_ns.max().unwrap_or(0);
        self.first_ns = self.first_ns.min(self.last_ns);
    }
}

/// The head of a chunk; none where it contradicts itself.
pub(crate) fn chunk_header(reader: &mut impl Read, content_len: u64) -> io::Result<Option<ChunkHeader>> {
    let message_start_time = u64::from_le_bytes(read_array(reader)?);
    let message_end_time = u64::from_le_bytes(read_array(reader)?);
    let uncompressed_size = u64::from_le_bytes(read_array(reader)?);
    let uncompressed_crc = u32::from_le_bytes(read_array(reader)?);
    let name_len = u32::from_le_bytes(read_array(reader)?);
    if name_len > LONGEST_NAME {
        return Ok(None);
    }
    let mut name = vec![0; name_len as usize];
    reader.read_exact(&mut name)?;
    let compressed_size = u64::from_le_bytes(read_array(reader)?);
    let head_len = CHUNK_HEAD as u64 + u64::from(name_len);
    let Ok(compression) = String::from_utf8(name) else {
        return Ok(None);
    };
    Ok(
        (head_len.checked_add(compressed_size) == Some(content_len)).then_some(ChunkHeader {
            message_start_time,
            message_end_time,
            uncompressed_size,
            uncompressed_crc,
            compression,
            compressed_size,
        }),
    )
}

fn read_array<const N: usize>(reader: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// Finishes a log: cuts off what is not whole at its end, and adds index and statistics. One that is complete stays as it is.
///
/// # Errors
/// When it cannot be read or written, or is no MCAP file. What was whole before is whole after.
pub fn complete(file: &mut File) -> io::Result<Outline> {
    let mut outline = outline(file)?;
    if outline.is_complete {
        return Ok(outline);
    }
    outline.leave_out_last_chunk_without_index();
    let (schemas, channels) = schemas_and_channels(file, &outline)?;
    let summary = Summary {
        outline: &outline,
        schemas: &schemas,
        channels: &channels,
    }
    .bytes(outline.whole_bytes);
    file.set_len(outline.whole_bytes)?;
    file.seek(SeekFrom::End(0))?;
    file.write_all(&summary)?;
    outline.is_complete = true;
    Ok(outline)
}

/// The contents of records of one kind.
type Records = Vec<Vec<u8>>;

/// The records of schemas and channels, which stand in the first chunks.
fn schemas_and_channels(file: &mut File, outline: &Outline) -> io::Result<(Records, Records)> {
    let (mut schemas, mut channels) = (Records::new(), Records::new());
    for chunk in outline.index.chunks.iter().take(CHUNKS_UNPACKED) {
        if chunk.header.uncompressed_size > LARGEST_UNPACKED || chunk.header.compressed_size > LARGEST_UNPACKED {
            continue;
        }
        file.seek(SeekFrom::Start(
            chunk.offset + chunk.length - chunk.header.compressed_size,
        ))?;
        let mut data = vec![0; chunk.header.compressed_size as usize];
        file.read_exact(&mut data)?;
        let damaged = |error: mcap::McapError| io::Error::new(io::ErrorKind::InvalidData, error.to_string());
        let unpacked = unpacked(&chunk.header.compression, &data, chunk.header.uncompressed_size).map_err(damaged)?;
        for record in records(&unpacked) {
            let (opcode, content) = record.ok_or_else(|| damaged(mcap::McapError::UnexpectedEof))?;
            match mcap::parse_record(opcode, content).map_err(damaged)? {
                Record::Schema { header, data } => {
                    let mut content = header.id.to_le_bytes().to_vec();
                    push_text(&mut content, &header.name);
                    push_text(&mut content, &header.encoding);
                    content.extend((data.len() as u32).to_le_bytes());
                    content.extend_from_slice(&data);
                    schemas.push(content);
                }
                Record::Channel(channel) => {
                    let mut content = channel.id.to_le_bytes().to_vec();
                    content.extend(channel.schema_id.to_le_bytes());
                    push_text(&mut content, &channel.topic);
                    push_text(&mut content, &channel.message_encoding);
                    let mut entries = Vec::new();
                    for (key, value) in &channel.metadata {
                        push_text(&mut entries, key);
                        push_text(&mut entries, value);
                    }
                    content.extend((entries.len() as u32).to_le_bytes());
                    content.extend(entries);
                    channels.push(content);
                }
                // The schemas come first.
                Record::Message { .. } => break,
                _ => {}
            }
        }
        if !channels.is_empty() {
            break;
        }
    }
    Ok((schemas, channels))
}

fn push_text(bytes: &mut Vec<u8>, text: &str) {
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend_from_slice(text.as_bytes());
}

/// All that comes after the data.
struct Summary<'a> {
    outline: &'a Outline,
    schemas: &'a [Vec<u8>],
    channels: &'a [Vec<u8>],
}

impl Summary<'_> {
    /// The bytes, for the place `at` in the file: <https://mcap.dev/spec#summary-section>.
    fn bytes(&self, at: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        // Zero: the data has no checksum over all of it. Each chunk has its own.
        push_record(&mut bytes, op::DATA_END, &0_u32.to_le_bytes());
        let summary_start = at + bytes.len() as u64;
        let mut groups = Vec::new();
        let contents = [
            (op::SCHEMA, self.schemas.to_vec()),
            (op::CHANNEL, self.channels.to_vec()),
            (op::STATISTICS, vec![self.statistics()]),
            (op::CHUNK_INDEX, self.chunks()),
            (op::ATTACHMENT_INDEX, self.attachments()),
            (op::METADATA_INDEX, self.metadata()),
        ];
        for (opcode, records) in contents {
            let start = at + bytes.len() as u64;
            for record in &records {
                push_record(&mut bytes, opcode, record);
            }
            if !records.is_empty() {
                groups.push((opcode, start, at + bytes.len() as u64 - start));
            }
        }
        let offsets_start = at + bytes.len() as u64;
        for (opcode, start, length) in groups {
            let mut content = vec![opcode];
            content.extend(start.to_le_bytes());
            content.extend(length.to_le_bytes());
            push_record(&mut bytes, op::SUMMARY_OFFSET, &content);
        }
        let mut footer = summary_start.to_le_bytes().to_vec();
        footer.extend(offsets_start.to_le_bytes());
        // Zero: no checksum.
        footer.extend(0_u32.to_le_bytes());
        push_record(&mut bytes, op::FOOTER, &footer);
        bytes.extend_from_slice(MAGIC);
        bytes
    }

    fn statistics(&self) -> Vec<u8> {
        let Outline {
            first_ns,
            last_ns,
            messages,
            index,
            ..
        } = self.outline;
        let mut content = messages.to_le_bytes().to_vec();
        content.extend((self.schemas.len() as u16).to_le_bytes());
        for count in [
            self.channels.len(),
            index.attachments.len(),
            index.metadata.len(),
            index.chunks.len(),
        ] {
            content.extend((count as u32).to_le_bytes());
        }
        content.extend(first_ns.to_le_bytes());
        content.extend(last_ns.to_le_bytes());
        let mut counts: BTreeMap<u16, u64> = BTreeMap::new();
        for (channel, (_, count)) in index.chunks.iter().flat_map(|chunk| &chunk.messages) {
            *counts.entry(*channel).or_default() += count;
        }
        push_numbers(&mut content, counts);
        content
    }

    fn chunks(&self) -> Vec<Vec<u8>> {
        let content = |chunk: &ChunkEntry| {
            let mut content = Vec::new();
            for number in [
                chunk.header.message_start_time,
                chunk.header.message_end_time,
                chunk.offset,
                chunk.length,
            ] {
                content.extend(number.to_le_bytes());
            }
            let offsets = chunk.messages.iter().map(|(&channel, &(offset, _))| (channel, offset));
            push_numbers(&mut content, offsets);
            content.extend(chunk.index_bytes.to_le_bytes());
            push_text(&mut content, &chunk.header.compression);
            content.extend(chunk.header.compressed_size.to_le_bytes());
            content.extend(chunk.header.uncompressed_size.to_le_bytes());
            content
        };
        self.outline.index.chunks.iter().map(content).collect()
    }

    fn attachments(&self) -> Vec<Vec<u8>> {
        let content = |entry: &AttachmentIndex| {
            let mut content = Vec::new();
            for number in [
                entry.offset,
                entry.length,
                entry.log_time,
                entry.create_time,
                entry.data_size,
            ] {
                content.extend(number.to_le_bytes());
            }
            push_text(&mut content, &entry.name);
            push_text(&mut content, &entry.media_type);
            content
        };
        self.outline.index.attachments.iter().map(content).collect()
    }

    fn metadata(&self) -> Vec<Vec<u8>> {
        let content = |(offset, length, name): &(u64, u64, String)| {
            let mut content = offset.to_le_bytes().to_vec();
            content.extend(length.to_le_bytes());
            push_text(&mut content, name);
            content
        };
        self.outline.index.metadata.iter().map(content).collect()
    }
}

fn push_record(bytes: &mut Vec<u8>, opcode: u8, content: &[u8]) {
    bytes.push(opcode);
    bytes.extend((content.len() as u64).to_le_bytes());
    bytes.extend_from_slice(content);
}

/// A map of numbers, preceded by its length in bytes.
fn push_numbers(bytes: &mut Vec<u8>, numbers: impl IntoIterator<Item = (u16, u64)>) {
    let mut entries = Vec::new();
    for (key, value) in numbers {
        entries.extend(key.to_le_bytes());
        entries.extend(value.to_le_bytes());
    }
    bytes.extend((entries.len() as u32).to_le_bytes());
    bytes.extend(entries);
}
