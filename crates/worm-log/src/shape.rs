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
        op::MESSAGE_INDEX => fixed(content, 2).and_then(text),
        _ => Some(content),
    };
    rest.is_some()
}

/// Whether a record of this kind may stand in the data of a log, before their end.
pub(super) fn is_of_data(opcode: u8) -> bool {
    matches!(
        opcode,
        op::HEADER
            | op::SCHEMA
            | op::CHANNEL
            | op::MESSAGE
            | op::CHUNK
            | op::MESSAGE_INDEX
            | op::ATTACHMENT
            | op::METADATA
    )
}

/// Whether a record is the end of the data: nothing but a checksum.
pub(super) fn is_data_end(opcode: u8, length: u64) -> bool {
    opcode == op::DATA_END && length == 4
}

/// How many bytes stand in a record behind what belongs to it: with a damaged length it takes in what comes after it. Zero where that cannot
/// be known.
pub(super) fn surplus(opcode: u8, content: &[u8]) -> usize {
    let behind = match opcode {
        op::HEADER => text(content).and_then(text),
        op::MESSAGE_INDEX => fixed(content, 2).and_then(text),
        op::METADATA => text(content).and_then(text_map),
        op::ATTACHMENT => fixed(content, 16)
            .and_then(text)
            .and_then(text)
            .and_then(long)
            .and_then(|rest| fixed(rest, 4)),
        op::CHUNK => fixed(content, 28).and_then(text).and_then(long),
        _ => None,
    };
    behind.map_or(0, <[u8]>::len)
}

/// The records of a chunk that is not compressed; nothing if it is compressed, or shorter than its head.
pub(super) fn uncompressed_records(chunk: &[u8]) -> Option<&[u8]> {
    let (compression, rest) = fixed(chunk, 28)?.split_first_chunk::<4>()?;
    let (length, records) = rest.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    (*compression == [0; 4]).then_some(records.get(..length).unwrap_or(records))
}

/// Whether these bytes are whole records, one behind the other.
pub(super) fn are_whole_records(bytes: &[u8]) -> bool {
    heads(bytes).all(|record| record.is_some())
}

/// The records of these bytes, opcode and content, each as long as it says in all its parts; `None`, and no more, where one is not.
pub(super) fn records(bytes: &[u8]) -> impl Iterator<Item = Option<(u8, &[u8])>> {
    heads(bytes).map(|record| record.filter(|(opcode, content)| is_whole(*opcode, content)))
}

/// Opcodes and contents, without a look into them.
fn heads(mut bytes: &[u8]) -> impl Iterator<Item = Option<(u8, &[u8])>> {
    std::iter::from_fn(move || {
        let (&opcode, rest) = std::mem::take(&mut bytes).split_first()?;
        let record = rest.split_first_chunk::<8>().and_then(|(length, rest)| {
            let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
            rest.split_at_checked(length)
        });
        Some(record.map(|(content, behind)| {
            bytes = behind;
            (opcode, content)
        }))
    })
}

fn fixed(bytes: &[u8], length: usize) -> Option<&[u8]> {
    bytes.get(length..)
}

/// A length in four bytes, and as many bytes: what comes behind.
fn text(bytes: &[u8]) -> Option<&[u8]> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.get(u32::from_le_bytes(*length) as usize..)
}

/// A length in eight bytes, and as many bytes: what comes behind.
fn long(bytes: &[u8]) -> Option<&[u8]> {
    let (length, rest) = bytes.split_first_chunk::<8>()?;
    rest.get(usize::try_from(u64::from_le_bytes(*length)).ok()?..)
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
