//! Whether a record is as long as the length fields in it say.
//!
//! `mcap` trusts these fields: it reserves what they claim before it looks at how much there is, up to 4 GB each, or counts below zero. So
//! a record is checked here before it is handed on.

use mcap::records::op;

/// Whether every length in a record of a kind that a log is read from fits into it.
pub(super) fn is_whole(opcode: u8, content: &[u8]) -> bool {
    let rest = match opcode {
        op::SCHEMA => fixed(content, 2).and_then(text).and_then(text),
        op::CHANNEL => fixed(content, 4).and_then(text).and_then(text).and_then(text_map),
        op::METADATA => text(content).and_then(text_map),
        // Times; name and media type; the length of the data, which `mcap` checks, and a checksum behind them.
        op::ATTACHMENT => fixed(content, 16)
            .and_then(text)
            .and_then(text)
            .and_then(|rest| fixed(rest, 12)),
        op::MESSAGE => fixed(content, 22),
        _ => Some(content),
    };
    rest.is_some()
}

/// The records of a chunk that is not compressed; nothing if it is compressed, or shorter than its head.
pub(super) fn uncompressed_records(chunk: &[u8]) -> Option<&[u8]> {
    let (compression, rest) = fixed(chunk, 28)?.split_first_chunk::<4>()?;
    let (length, records) = rest.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    (*compression == [0; 4]).then_some(records.get(..length).unwrap_or(records))
}

/// Whether these bytes are whole records, one behind the other.
pub(super) fn are_whole_records(mut bytes: &[u8]) -> bool {
    while !bytes.is_empty() {
        let Some((_, rest)) = bytes.split_first() else {
            return false;
        };
        let Some((length, rest)) = rest.split_first_chunk::<8>() else {
            return false;
        };
        let Some(rest) = usize::try_from(u64::from_le_bytes(*length))
            .ok()
            .and_then(|length| rest.get(length..))
        else {
            return false;
        };
        bytes = rest;
    }
    true
}

fn fixed(bytes: &[u8], length: usize) -> Option<&[u8]> {
    bytes.get(length..)
}

/// A length in four bytes, and as many bytes: what comes behind.
fn text(bytes: &[u8]) -> Option<&[u8]> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.get(u32::from_le_bytes(*length) as usize..)
}

/// Pairs of texts, their length together before them.
fn text_map(bytes: &[u8]) -> Option<&[u8]> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (mut pairs, behind) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    while !pairs.is_empty() {
        pairs = text(pairs).and_then(text)?;
    }
    Some(behind)
}
