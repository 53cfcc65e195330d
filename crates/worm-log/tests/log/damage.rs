//! Truncated and damaged files.

use std::fs::{self, File};
use std::io::Cursor;
use std::path::PathBuf;
use testkit::log_sample::{Sink, crawl, origin};
use worm_log::{Log, ReadError, Writer, messages, messages_from};

/// A log of 40 states, 10 in each chunk: its bytes, and for each chunk where it ends and how many states there are then.
fn small_log() -> (Vec<u8>, Vec<(usize, usize)>) {
    let sink = Sink::default();
    let mut writer = Writer::new(sink.clone(), "small".as_ref(), &origin()).expect("memory takes all");
    let mut chunks = vec![(sink.bytes().len(), 0)];
    for (index, state) in crawl(0.04).states.iter().enumerate() {
        writer.write(state).expect("memory takes all");
        if index % 10 == 9 {
            writer.flush().expect("memory takes all");
            chunks.push((sink.bytes().len(), index + 1));
        }
    }
    writer.finish().expect("memory takes all");
    (sink.bytes(), chunks)
}

/// A file that changes, and what is read from it.
struct Patient {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl Patient {
    fn new(bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("worm.mcap");
        fs::write(&path, bytes).expect("can be written");
        Self { path, _folder: folder }
    }

    fn cut(&self, length: usize) -> Result<Log, ReadError> {
        let file = File::options().write(true).open(&self.path).expect("is there");
        file.set_len(length as u64).expect("can be cut");
        messages(&self.path)
    }
}

#[test]
fn a_log_cut_anywhere_gives_all_whole_chunks() {
    let (bytes, chunks) = small_log();
    let (data_end, _) = chunks[chunks.len() - 1];
    let patient = Patient::new(&bytes);
    for length in (0..bytes.len()).rev() {
        let whole = chunks.iter().rfind(|(end, _)| *end <= length).map(|&(_, count)| count);
        let log = patient.cut(length);
        let count = log.as_ref().map_or(0, |log| log.states.len());
        assert!(
            count >= whole.unwrap_or(0),
            "{count} states of {whole:?} at {length} bytes"
        );
        assert!(whole.is_none() || log.is_ok(), "cut at {length}: {log:?}");
        if let Ok(log) = log {
            // With 13 bytes after the data only the index is missing.
            let is_cut = length < data_end + 13;
            assert_eq!(
                log.warnings.len(),
                usize::from(is_cut),
                "at {length}: {:?}",
                log.warnings
            );
            let is_reported = log
                .warnings
                .iter()
                .all(|warning| warning.starts_with(&format!("cut off after {count} messages")));
            assert!(is_reported, "{:?}", log.warnings);
        }
    }
}

#[test]
fn a_log_to_which_another_was_appended_says_where_it_ends() {
    let (bytes, _) = small_log();
    let read = |appended: &[u8]| {
        let file = [&bytes, appended].concat();
        messages_from(Cursor::new(file), "appended".as_ref()).expect("a log")
    };
    assert_eq!(read(&[]).warnings, Vec::<String>::new());
    for appended in [&bytes[..], &bytes[..1000], b"\n"] {
        let log = read(appended);
        assert_eq!(log.states.len(), 40);
        let whole = format!("ends at byte {} of {}", bytes.len(), bytes.len() + appended.len());
        let said = log.warnings.iter().any(|warning| warning.contains(&whole));
        assert!(said, "{} bytes appended: {:?}", appended.len(), log.warnings);
        let remedy = format!("`tail -c +{}`", bytes.len() + 1);
        assert!(log.warnings[0].contains(&remedy), "{:?}", log.warnings);
    }
}

#[test]
fn what_can_be_unpacked_of_the_last_chunk_is_taken() {
    let sink = Sink::default();
    let mut writer = Writer::new(sink.clone(), "large".as_ref(), &origin()).expect("memory takes all");
    let begin = sink.bytes().len();
    for state in &crawl(1.0).states {
        writer.write(state).expect("memory takes all");
    }
    writer.flush().expect("memory takes all");
    let end = sink.bytes().len();
    let patient = Patient::new(&sink.bytes());
    let log = patient.cut(begin + (end - begin) / 2).expect("a log");
    assert!(
        (300..900).contains(&log.states.len()),
        "{} of 1000 states",
        log.states.len()
    );
    let sequences: Vec<_> = log.states.iter().map(|state| state.sequence).collect();
    assert!(
        sequences.iter().copied().eq(1..=sequences.len() as u64),
        "in their order"
    );
    assert!(
        log.warnings[0].contains("stand in a chunk that was not finished"),
        "{:?}",
        log.warnings
    );
}

#[test]
fn a_damaged_byte_costs_its_chunk_and_no_value_is_wrong() {
    let (bytes, chunks) = small_log();
    let truth = crawl(0.04).states;
    for at in (0..bytes.len()).step_by(13) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x15;
        let patient = Patient::new(&damaged);
        // Refused or read, but never wrong: each state that is read was written.
        if let Ok(log) = messages(&patient.path) {
            for state in &log.states {
                let written = truth.iter().find(|written| written.sequence == state.sequence);
                let written = written.unwrap_or_else(|| panic!("byte {at}: tick {} was never written", state.sequence));
                assert_eq!(format!("{state:?}"), format!("{written:?}"), "byte {at}");
            }
        }
    }
    // What is complete says at its end what stands where: one bit in the data costs one chunk, be it in the schemas or in a length.
    for at in (8..chunks[4].0).step_by(7) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 4;
        let log = messages(&Patient::new(&damaged).path).expect("the rest is there");
        assert!(log.states.len() >= 30, "byte {at}: {:?}", log.warnings);
    }
    let mut zeroed = bytes.clone();
    zeroed[chunks[1].0 - 50..chunks[2].0 - 50].fill(0);
    let log = messages(&Patient::new(&zeroed).path).expect("the rest is there");
    assert_eq!(log.states.len(), 30, "{:?}", log.warnings);
    assert!(log.warnings[0].contains("damaged"), "{:?}", log.warnings);
    // In the middle of the second chunk's compressed data.
    let mut damaged = bytes.clone();
    damaged[(chunks[1].0 + chunks[2].0) / 2] ^= 0x15;
    let log = messages(&Patient::new(&damaged).path).expect("the rest is there");
    assert_eq!(log.states.len(), 30);
    assert!(log.warnings[0].contains("is damaged"), "{:?}", log.warnings);
}

#[test]
fn a_damaged_byte_in_a_log_that_was_not_finished_costs_its_chunk_too_be_it_the_first() {
    let sink = Sink::default();
    let mut writer = Writer::new(sink.clone(), "open".as_ref(), &origin()).expect("memory takes all");
    let first_end = sink.bytes().len();
    let mut ends = Vec::new();
    for (index, state) in crawl(0.04).states.iter().enumerate() {
        writer.write(state).expect("memory takes all");
        if index % 10 == 9 {
            writer.flush().expect("memory takes all");
            ends.push(sink.bytes().len());
        }
    }
    let bytes = sink.bytes();
    let [second_end, third_end] = [ends[0], ends[1]];
    let mut lost_in_first = 0;
    for at in (8..bytes.len()).step_by(3) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 4;
        let log = messages(&Patient::new(&damaged).path).unwrap_or_else(|error| panic!("byte {at}: {error}"));
        // What is a chunk's own costs the chunk; what stands before all chunks costs none.
        let least = if at < first_end { 40 } else { 30 };
        assert!(
            log.states.len() >= least,
            "byte {at} of {first_end}, {second_end}, {third_end}: {:?}",
            log.warnings
        );
        lost_in_first += usize::from(at < first_end && log.warnings.iter().any(|it| it.contains("damaged")));
    }
    assert!(
        lost_in_first > 100,
        "the definitions were damaged {lost_in_first} times, and that was said"
    );
}

/// Reads the log with each of these bits flipped, and calls what lost states, or did so without a word.
fn flip(bytes: &[u8], bits: impl Iterator<Item = usize>) {
    let usual = messages_from(Cursor::new(bytes), "whole".as_ref())
        .expect("is whole")
        .warnings;
    let mut damaged = bytes.to_vec();
    for bit in bits {
        let (at, mask) = (bit / 8, 1 << (bit % 8));
        damaged[at] ^= mask;
        let place = format!("bit {} of byte {at} of {}", bit % 8, bytes.len());
        let log = messages_from(Cursor::new(&damaged), "damaged".as_ref());
        let log = log.unwrap_or_else(|error| panic!("{place}: {error}"));
        assert!(
            log.states.len() >= 30,
            "{place}: more than a chunk is lost: {:?}",
            log.warnings
        );
        // Of a log that was not finished it is always said that its end is missing.
        let is_told = log
            .warnings
            .iter()
            .any(|it| !usual.contains(it) && !it.contains("it was not finished"));
        assert!(
            log.states.len() == 40 || is_told,
            "{place}: not a word of what is lost: {:?}",
            log.warnings
        );
        damaged[at] ^= mask;
    }
}

#[test]
fn no_damaged_bit_costs_more_than_a_chunk_nor_does_so_without_a_word() {
    let (bytes, chunks) = small_log();
    let (first, data_end) = (chunks[0].0, chunks[4].0);
    // Of the definitions, which are many, a few.
    let few = |bit: &usize| bit / 8 >= first || bit.is_multiple_of(7);
    flip(&bytes[..data_end], (8 * 8..8 * data_end).filter(few));
    flip(&bytes, (8 * 8..8 * data_end).filter(few));
}

#[test]
fn a_full_disk_is_told_and_what_was_written_can_be_read() {
    let (whole, chunks) = small_log();
    let sink = Sink::with_capacity(chunks[2].0 + 100);
    let mut writer = Writer::new(sink.clone(), "full.mcap".as_ref(), &origin()).expect("there is room yet");
    let mut outcome = Ok(());
    for state in &crawl(0.04).states {
        outcome = outcome.and_then(|()| writer.write(state));
        if state.sequence % 10 == 0 {
            outcome = outcome.and_then(|()| writer.flush());
        }
    }
    let error = outcome.expect_err("there is no room").to_string();
    assert!(
        error.starts_with("full.mcap: cannot be written: no storage space: make room"),
        "{error}"
    );
    drop(writer);
    assert_eq!(sink.bytes(), whole[..chunks[2].0 + 100]);
    let log = messages(&Patient::new(&sink.bytes()).path).expect("a log");
    assert_eq!(log.states.len(), 20);
}
