//! Where the chunks of an unfinished log are whose records do not follow one another any more: a damaged length leads anywhere.
//!
//! From record to record as long as that makes sense; then on to the next place where a chunk begins that agrees with itself.

use super::RECORD_HEAD;
use crate::outline::{CHUNK_HEAD, LONGEST_NAME, chunk_header};
use crate::shape::{is_data_end, is_of_data};
use crate::summary::Summary;
use mcap::MAGIC;
use mcap::records::op;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;

/// How much is searched at a time, bytes.
const BLOCK: usize = 1 << 16;
/// Most bytes from a chunk's opcode to its records.
const WHOLE_HEAD: usize = RECORD_HEAD as usize + CHUNK_HEAD + LONGEST_NAME as usize;
/// What a chunk may be compressed by.
const COMPRESSIONS: [&str; 3] = ["", "lz4", "zstd"];

/// The chunks before the last place where the log's records stop following one another and a chunk is found further on; none where that
/// does not happen. From [`Summary::begin`] on they follow one another, to the end or to where the log was cut off.
pub(super) fn damaged_beginning(input: &mut (impl Read + Seek), length: u64) -> io::Result<Option<Summary>> {
    let mut chunks: Vec<Range<u64>> = Vec::new();
    let mut damaged = None;
    let mut at = MAGIC.len() as u64;
    // Where the record begins that led here, unless it is a chunk: those say their length twice.
    let mut led_from = at;
    let mut reader = BufReader::with_capacity(WHOLE_HEAD, input);
    loop {
        let found = record_at(&mut reader, at, length)?;
        if let Some((opcode, end)) = found {
            led_from = at;
            match opcode {
                op::DATA_END => break,
                op::CHUNK => {
                    chunks.push(at..end);
                    led_from = end;
                }
                _ => {}
            }
            at = end;
            continue;
        }
        if at >= length {
            break;
        }
        let Some(next) = next_chunk(&mut reader, led_from + 1, length)? else {
            break;
        };
        damaged = Some((chunks.len(), next));
        (at, led_from) = (next, next);
    }
    Ok(damaged.map(|(before, begin)| {
        chunks.truncate(before);
        Summary {
            chunks,
            begin,
            ..Summary::default()
        }
    }))
}

/// Opcode and end of the record at this place; none where there is none.
fn record_at(reader: &mut (impl Read + Seek), at: u64, length: u64) -> io::Result<Option<(u8, u64)>> {
    if length.saturating_sub(at) < RECORD_HEAD {
        return Ok(None);
    }
    reader.seek(SeekFrom::Start(at))?;
    let mut head = [0; RECORD_HEAD as usize];
    reader.read_exact(&mut head)?;
    let [opcode, content_len @ ..] = head;
    let content_len = u64::from_le_bytes(content_len);
    let end = (at + RECORD_HEAD).checked_add(content_len).filter(|end| *end <= length);
    let is_known = is_of_data(opcode) || is_data_end(opcode, content_len);
    let Some(end) = end.filter(|_| is_known) else {
        return Ok(None);
    };
    let agrees = opcode != op::CHUNK || agrees_with_itself(reader, content_len)?;
    Ok(agrees.then_some((opcode, end)))
}

/// The next place from here on where a chunk begins that fits into the log.
fn next_chunk(reader: &mut (impl Read + Seek), from: u64, length: u64) -> io::Result<Option<u64>> {
    let mut block = Vec::new();
    let mut begin = from;
    while begin < length {
        block.clear();
        reader.seek(SeekFrom::Start(begin))?;
        reader
            .by_ref()
            .take((BLOCK + WHOLE_HEAD) as u64)
            .read_to_end(&mut block)?;
        let bytes = block.iter().take(BLOCK).enumerate();
        for (offset, _) in bytes.filter(|(_, byte)| **byte == op::CHUNK) {
            let at = begin + offset as u64;
            if begins_chunk(&block[offset..], length.saturating_sub(at))? {
                return Ok(Some(at));
            }
        }
        begin += BLOCK as u64;
    }
    Ok(None)
}

/// Whether a chunk that agrees with itself begins with these bytes, `room` bytes before the end of the log.
fn begins_chunk(bytes: &[u8], room: u64) -> io::Result<bool> {
    let Some((head, mut rest)) = bytes.split_first_chunk::<{ RECORD_HEAD as usize }>() else {
        return Ok(false);
    };
    let [_, content_len @ ..] = *head;
    let content_len = u64::from_le_bytes(content_len);
    Ok(content_len <= room.saturating_sub(RECORD_HEAD) && agrees_with_itself(&mut rest, content_len)?)
}

/// Whether the head of a chunk with so many bytes of content follows: it says its length once more, and how it is compressed.
fn agrees_with_itself(reader: &mut impl Read, content_len: u64) -> io::Result<bool> {
    match chunk_header(reader, content_len) {
        Ok(head) => Ok(head.is_some_and(|head| COMPRESSIONS.contains(&head.compression.as_str()))),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}
