//! Reading a complete log by the places of its chunks.

use super::{LARGEST_RECORD, MAX_DAMAGED_NAMED, MAX_NAME_LEN, RECORD_HEAD, Scanner, Trouble, at_most, each_record};
use crate::channel::Channel;
use crate::payload::{Payload, PayloadError};
use crate::shape::is_data_end;
use crate::summary::Summary;
use mcap::records::op;
use mcap::sans_io::LinearReaderOptions;
use mcap::{MAGIC, McapError};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::{ControlFlow, Range};
use worm_estimator::abridged::abridged;

impl<F: FnMut(Channel, Payload<'_>) -> Result<(), PayloadError>> Scanner<'_, F> {
    /// Reads the data of a file, in which the summary knows the chunks.
    pub(super) fn take_between(&mut self, input: &mut (impl Read + Seek), summary: Summary) -> Result<(), Trouble> {
        let Summary {
            chunks,
            begin: end,
            has_attachment,
            ..
        } = summary;
        let mut at = MAGIC.len() as u64;
        for chunk in chunks {
            if !is_there(input, &chunk).map_err(Trouble::Unreadable)? {
                // The index is damaged: what is there is found on the way to the next chunk.
                continue;
            }
            self.take_gap(input, at..chunk.start)?;
            let content = chunk.start + RECORD_HEAD;
            input.seek(SeekFrom::Start(content)).map_err(Trouble::Unreadable)?;
            let mut bytes = Vec::new();
            let read = input.by_ref().take(chunk.end - content).read_to_end(&mut bytes);
            read.map_err(Trouble::Unreadable)?;
            match self.take_record(chunk.start, op::CHUNK, &bytes) {
                Err(Trouble::Broken(error)) => self.warn_of_bytes(chunk.start, chunk.end, &error),
                taken => taken?,
            }
            at = chunk.end;
        }
        self.take_gap(input, at..end)?;
        if has_attachment && self.contents.config.is_none() {
            self.contents.warnings.push(
                "the configuration in the log is damaged: the worm of the paper is assumed where --config names no other".to_owned(),
            );
        }
        Ok(())
    }

    /// Reads the records between two known chunks. What cannot be read of them is left out, with a warning.
    fn take_gap(&mut self, input: &mut (impl Read + Seek), gap: Range<u64>) -> Result<(), Trouble> {
        input.seek(SeekFrom::Start(gap.start)).map_err(Trouble::Unreadable)?;
        let framing = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_record_length_limit(at_most(gap.end - gap.start));
        let mut at = gap.start;
        let records = BufReader::new(input.by_ref().take(gap.end - gap.start));
        let taken = each_record(records, framing, |opcode, content| {
            match opcode {
                _ if is_data_end(opcode, content.len() as u64) => return Ok(ControlFlow::Break(())),
                // What was never written, or lost, is zeros; and behind a footer nothing more is read.
                0 | op::FOOTER => return Err(McapError::UnexpectedEof.into()),
                _ => {}
            }
            match self.take_record(at, opcode, content) {
                // It costs no other.
                Err(Trouble::Broken(error)) => self.warn_of_bytes(at, at + RECORD_HEAD + content.len() as u64, &error),
                taken => taken?,
            }
            at += RECORD_HEAD + content.len() as u64;
            Ok(ControlFlow::Continue(()))
        });
        let Err(Trouble::Broken(error)) = taken else {
            return taken;
        };
        self.warn_of_bytes(at, gap.end, &error);
        self.take_definitions()
    }

    pub(super) fn warn_of_bytes(&mut self, from: u64, to: u64, error: &str) {
        self.damaged_chunks += 1;
        if self.damaged_chunks <= MAX_DAMAGED_NAMED {
            let warning = format!("bytes {from} to {to} are damaged ({error}): what stood there is left out");
            self.contents.warnings.push(abridged(warning, MAX_NAME_LEN));
        }
    }
}

/// Whether a chunk stands where an index says: one of its opcode and its length does, for either may be damaged.
fn is_there(input: &mut (impl Read + Seek), chunk: &Range<u64>) -> io::Result<bool> {
    let Some(length) = (chunk.end - chunk.start).checked_sub(RECORD_HEAD) else {
        return Ok(false);
    };
    input.seek(SeekFrom::Start(chunk.start))?;
    let mut opcode = [0];
    input.read_exact(&mut opcode)?;
    let mut says = [0; 8];
    input.read_exact(&mut says)?;
    Ok(length <= LARGEST_RECORD as u64 && (opcode == [op::CHUNK] || says == length.to_le_bytes()))
}
