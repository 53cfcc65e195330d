//! The summary at the end of a complete log: its schemas and channels once more, and where each chunk stands.
//!
//! With it a damaged byte costs no more than the chunk that it is in, whatever it says about the length of a record or the channels.

use super::shape::records;
use mcap::MAGIC;
use mcap::records::op;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;

/// Bytes of the footer's record and of the magic bytes behind it.
const FOOTER: usize = 9 + 20 + MAGIC.len();
/// Longest summary that is read, bytes: of a log of months.
const LONGEST_SUMMARY: u64 = 1 << 26;

/// What the summary of a log says.
#[derive(Debug, Default)]
pub(super) struct Summary {
    /// Opcodes and contents of the records of schemas and channels.
    pub(super) definitions: Vec<(u8, Vec<u8>)>,
    /// Where chunks stand: in their order, none within another.
    pub(super) chunks: Vec<Range<u64>>,
    /// Whether the log has an attachment: its configuration.
    pub(super) has_attachment: bool,
    /// Where it begins, which is where the data end.
    pub(super) begin: u64,
}

/// Reads the summary of a file of this length; `None` where there is none, or it is not whole.
///
/// # Errors
/// When the file cannot be read.
pub(super) fn summary(input: &mut (impl Read + Seek), length: u64) -> io::Result<Option<Summary>> {
    let Some(end) = length.checked_sub(FOOTER as u64) else {
        return Ok(None);
    };
    input.seek(SeekFrom::Start(end))?;
    let mut footer = [0; FOOTER];
    input.read_exact(&mut footer)?;
    let [opcode, rest @ ..] = footer;
    let number = |at: usize| rest[at..].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
    let is_whole = opcode == op::FOOTER && number(0) == 20 && rest.ends_with(MAGIC);
    let begin = number(8);
    let has_room = (MAGIC.len() as u64..=end).contains(&begin) && end - begin <= LONGEST_SUMMARY;
    if !is_whole || !has_room {
        return Ok(None);
    }
    input.seek(SeekFrom::Start(begin))?;
    let mut bytes = Vec::new();
    input.by_ref().take(end - begin).read_to_end(&mut bytes)?;
    let mut summary = Summary {
        begin,
        ..Summary::default()
    };
    for record in records(&bytes) {
        match record {
            Some((opcode @ (op::SCHEMA | op::CHANNEL), content)) => {
                summary.definitions.push((opcode, content.to_vec()));
            }
            Some((op::CHUNK_INDEX, content)) => summary.chunks.extend(place(content)),
            Some((op::ATTACHMENT_INDEX, _)) => summary.has_attachment = true,
            Some(_) => {}
            None => return Ok(None),
        }
    }
    summary.chunks.sort_by_key(|chunk| chunk.start);
    let within = summary
        .chunks
        .iter()
        .all(|chunk| chunk.start >= MAGIC.len() as u64 && chunk.end <= begin);
    if !within || summary.chunks.windows(2).any(|pair| pair[0].end > pair[1].start) {
        summary.chunks.clear();
    }
    Ok(Some(summary))
}

/// Where the file of a log ends whose data end at byte `at`: behind its footer and the magic bytes; `None` where its summary is cut off or damaged.
///
/// # Errors
/// When the file cannot be read.
pub(super) fn behind_the_footer(input: &mut (impl Read + Seek), at: u64, length: u64) -> io::Result<Option<u64>> {
    let mut reader = BufReader::new(input);
    let mut here = reader.seek(SeekFrom::Start(at))?;
    loop {
        let mut head = [0; 9];
        if length.saturating_sub(here) < head.len() as u64 {
            return Ok(None);
        }
        reader.read_exact(&mut head)?;
        let [opcode, content_len @ ..] = head;
        let end = here
            .checked_add(head.len() as u64)
            .and_then(|content| content.checked_add(u64::from_le_bytes(content_len)));
        let Some(end) = end.filter(|end| *end <= length) else {
            return Ok(None);
        };
        here = reader.seek(SeekFrom::Start(end))?;
        if opcode == op::FOOTER {
            let mut magic = [0; MAGIC.len()];
            let is_whole = length - here >= magic.len() as u64 && {
                reader.read_exact(&mut magic)?;
                magic == MAGIC
            };
            return Ok(is_whole.then(|| here + magic.len() as u64));
        }
    }
}

/// Where the chunk of this index stands.
fn place(index: &[u8]) -> Option<Range<u64>> {
    // Behind the times of its messages.
    let (start, rest) = index.get(16..)?.split_first_chunk()?;
    let start = u64::from_le_bytes(*start);
    let length = u64::from_le_bytes(*rest.first_chunk()?);
    Some(start..start.checked_add(length)?)
}
