//! Messages in, files out: the black box without its process.
//!
//! Time is an argument. A second of messages becomes one chunk, which goes to the ring and, while there is a box under way, to that box;
//! an event ends the chunk at once, so that its moment is on the disk as soon as possible.

use super::events::{Event, EventWatch};
use super::folder::{BoxEvent, FileKind, OwnFolder, box_record, events_text};
use super::part_file::PartFile;
use super::ring::{Held, Ring};
use super::{BOX_RECORD, END_RECORD};
use crate::recorder::{Batch, Finding, Thinner, problem_of};
use std::collections::BTreeMap;
use std::io;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use worm_estimator::config::BlackBox as Settings;
use worm_estimator::message::RecordingProblem;
use worm_log::{Chunk, ChunkWriter, Logged, Note, Origin, WriteError, head, metadata_record};

/// Length of a chunk: a killed black box loses at most this.
const CHUNK_NS: u64 = 1_000_000_000;
/// Length of a chunk of the thin log. It compresses badly in short ones.
const THIN_CHUNK_NS: u64 = 10_000_000_000;
/// How often what could not be written is tried again.
const RETRY_NS: u64 = 5_000_000_000;
/// A part of the thin log is followed by the next at this fraction of the quota …
const THIN_PART: f64 = 0.02;
/// … but not before it has this many bytes.
const SMALLEST_THIN_PART: u64 = 500_000;
/// Most boxes that wait for room on the disk; the oldest of more is given up.
const MAX_WAITING: usize = 4;

/// The present moment on both clocks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now {
    /// ns of `CLOCK_MONOTONIC`: everything is judged by it.
    pub monotonic_ns: u64,
    /// For names and metadata.
    pub wall: SystemTime,
}

/// How the black box is doing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Figures {
    pub memory_bytes: u64,
    pub written_bytes: u64,
    pub boxes: u64,
    /// Why it cannot write at present.
    pub problem: Option<RecordingProblem>,
}

/// A box under way.
struct OpenBox {
    part: PartFile,
    events: Vec<Event>,
    /// When it is over, and when at the latest, ns.
    end_ns: u64,
    latest_end_ns: u64,
}

/// The thin log.
struct ThinLog {
    thinner: Thinner,
    writer: ChunkWriter,
    part: Option<PartFile>,
    chunk_began_ns: u64,
    largest_part: u64,
}

/// The black box.
pub(super) struct Keeper {
    folder: OwnFolder,
    origin: Origin,
    /// What each file says of the worm's configuration.
    notes: Vec<Note>,
    after_ns: u64,
    before_ns: u64,
    longest_ns: u64,
    quota: u64,
    /// Most bytes that the ring, and each file that waits for room, may take.
    max_bytes: usize,
    watch: EventWatch,
    writer: ChunkWriter,
    ring: Ring,
    chunk_began_ns: u64,
    current: Option<OpenBox>,
    /// Boxes that are over and could not be completed yet.
    waiting: Vec<PartFile>,
    thin: ThinLog,
    retry_ns: u64,
    figures: Figures,
}

impl Keeper {
    /// A black box that begins now.
    ///
    /// # Errors
    /// [`WriteError`] when the compressor cannot be set up.
    pub(super) fn new(folder: OwnFolder, settings: &Settings, origin: Origin, now: Now) -> Result<Self, WriteError> {
        let ns = |seconds: f64| (seconds * 1e9) as u64;
        let quota = (settings.quota_mb * 1e6) as u64;
        let max_bytes = (settings.memory_mb * 1e6) as usize / 2;
        let keeper = Self {
            origin,
            notes: Vec::new(),
            after_ns: ns(settings.after_s),
            before_ns: ns(settings.before_s),
            longest_ns: ns(settings.longest_s),
            quota,
            max_bytes,
            watch: EventWatch::new(now.monotonic_ns),
            writer: ChunkWriter::new(now.monotonic_ns)?,
            ring: Ring::new(ns(settings.before_s) + CHUNK_NS, max_bytes),
            chunk_began_ns: now.monotonic_ns,
            current: None,
            waiting: Vec::new(),
            thin: ThinLog {
                thinner: Thinner::new(settings.thin_rate_hz),
                writer: ChunkWriter::new(now.monotonic_ns)?,
                part: None,
                chunk_began_ns: now.monotonic_ns,
                largest_part: ((quota as f64 * THIN_PART) as u64).max(SMALLEST_THIN_PART),
            },
            retry_ns: 0,
            figures: Figures::default(),
            folder,
        };
        keeper.folder.keep_within(keeper.quota);
        Ok(keeper)
    }

    /// How it is doing.
    pub(super) fn figures(&self) -> Figures {
        let waiting: usize = self.waiting.iter().map(PartFile::queued_bytes).sum();
        let current = self.current.as_ref().map_or(0, |current| current.part.queued_bytes());
        Figures {
            memory_bytes: (self.ring.bytes() + waiting + current) as u64,
            ..self.figures
        }
    }

    /// Takes in what was found out about the worm's configuration, for the files that begin from now on.
    pub(super) fn take_in(&mut self, finding: &Finding) {
        finding.note_in(&mut self.origin, &mut self.notes);
    }

    /// Takes the messages that came since the last call, `looked` ago; writes what is due.
    ///
    /// # Errors
    /// [`WriteError`] when the compressor fails. A disk that fails is no error: see [`Figures::problem`].
    pub(super) fn take(&mut self, batch: &Batch, looked: Duration, now: Now) -> Result<(), WriteError> {
        write_all(&mut self.writer, batch)?;
        write_all(&mut self.thin.writer, &self.thin.thinner.thin(batch))?;
        let events = self.watch.update(batch, looked, now.monotonic_ns);
        let is_due = now.monotonic_ns.saturating_sub(self.chunk_began_ns) >= CHUNK_NS;
        let is_over = self
            .current
            .as_ref()
            .is_some_and(|current| now.monotonic_ns >= current.end_ns);
        if is_due || is_over || !events.is_empty() {
            self.end_chunk(now)?;
        }
        if is_over {
            self.end_box()?;
        }
        for event in &events {
            self.take_event(event, now)?;
        }
        if !events.is_empty() || now.monotonic_ns.saturating_sub(self.thin.chunk_began_ns) >= THIN_CHUNK_NS {
            self.end_thin_chunk(now)?;
        }
        self.write(now);
        Ok(())
    }

    /// Ends everything in order: the box under way is complete as far as it came.
    ///
    /// # Errors
    /// As [`take`](Self::take); the problem of a disk that cannot be written to.
    pub(super) fn close(mut self, now: Now) -> Result<Figures, WriteError> {
        self.end_chunk(now)?;
        self.end_box()?;
        self.end_thin_chunk(now)?;
        self.retry_ns = 0;
        self.write(now);
        if let Some(mut thin) = self.thin.part.take() {
            let end = metadata_record(END_RECORD, BTreeMap::new())?;
            thin.push(&end);
            let mut outcome = Outcome::default();
            outcome.add(thin.finish());
            self.note(outcome, now);
        }
        Ok(self.figures())
    }

    fn end_chunk(&mut self, now: Now) -> Result<(), WriteError> {
        self.chunk_began_ns = now.monotonic_ns;
        let Some(chunk) = self.writer.take()? else {
            return Ok(());
        };
        if let Some(current) = &mut self.current {
            current.part.push(chunk.bytes());
        }
        self.ring.push(Held {
            chunk,
            taken_ns: now.monotonic_ns,
        });
        Ok(())
    }

    fn take_event(&mut self, event: &Event, now: Now) -> Result<(), WriteError> {
        // By when it was heard of: what came after it comes after that.
        let end_ns = now.monotonic_ns + self.after_ns;
        if let Some(current) = &mut self.current {
            current.events.push(*event);
            current.end_ns = end_ns.min(current.latest_end_ns);
            return Ok(());
        }
        let part = self.begin_box(event, now)?;
        tracing::warn!("{}: a box of {}", part.path().display(), event.cause);
        self.figures.boxes += 1;
        self.current = Some(OpenBox {
            part,
            events: vec![*event],
            end_ns,
            latest_end_ns: now.monotonic_ns + self.longest_ns.saturating_sub(self.before_ns),
        });
        Ok(())
    }

    /// A file with what was before the event.
    fn begin_box(&mut self, event: &Event, now: Now) -> Result<PartFile, WriteError> {
        self.folder.keep_within(self.quota);
        let since_ns = event.time_ns.saturating_sub(self.before_ns);
        let ago_ns = now.monotonic_ns.saturating_sub(event.time_ns);
        let unix = now.wall.duration_since(UNIX_EPOCH).unwrap_or_default();
        let event_unix_ns = unix.as_nanos().saturating_sub(u128::from(ago_ns));
        let about = box_record(&event.cause.to_string(), event.time_ns, event_unix_ns);
        let head = self.head(now, Some((BOX_RECORD, about)))?;
        let path = self.folder.next_path(FileKind::Box, event.cause.short_name(), now.wall);
        // The ring fits in once, and as much again of what comes after.
        let mut part = PartFile::new(path, head, 2 * self.max_bytes);
        for held in self.ring.since(since_ns) {
            part.push(held.chunk.bytes());
        }
        Ok(part)
    }

    /// What each file begins with.
    fn head(&self, now: Now, about: Option<(&'static str, BTreeMap<String, String>)>) -> Result<Vec<u8>, WriteError> {
        let records: Vec<_> = about.into_iter().chain(self.notes.iter().map(Note::record)).collect();
        head(&self.origin_at(now), &records)
    }

    /// The clocks as they stand now: the wall clock may have been set since the start.
    fn origin_at(&self, now: Now) -> Origin {
        Origin {
            begun: now.wall,
            begun_ns: now.monotonic_ns,
            ..self.origin.clone()
        }
    }

    fn end_box(&mut self) -> Result<(), WriteError> {
        let Some(mut current) = self.current.take() else {
            return Ok(());
        };
        let events = current.events.iter().map(|event| BoxEvent {
            event: event.cause.to_string(),
            time_ns: event.time_ns,
        });
        let gap = if current.part.has_gap() { "true" } else { "false" };
        let entries = [("events", events_text(events)), ("gap", gap.to_owned())];
        let end = entries.map(|(key, value)| (key.to_owned(), value));
        current.part.push(&metadata_record(END_RECORD, end.into())?);
        self.waiting.push(current.part);
        if self.waiting.len() > MAX_WAITING {
            let given_up = self.waiting.remove(0);
            tracing::error!("{}: given up: there is no room for it", given_up.path().display());
            given_up.discard();
        }
        self.retry_ns = 0;
        Ok(())
    }

    fn end_thin_chunk(&mut self, now: Now) -> Result<(), WriteError> {
        self.thin.chunk_began_ns = now.monotonic_ns;
        let Some(chunk) = self.thin.writer.take()? else {
            return Ok(());
        };
        self.thin_part(&chunk, now)
    }

    fn thin_part(&mut self, chunk: &Chunk, now: Now) -> Result<(), WriteError> {
        if let Some(mut part) = self.thin.part.take() {
            if part.bytes() < self.thin.largest_part {
                part.push(chunk.bytes());
                self.thin.part = Some(part);
                return Ok(());
            }
            part.push(&metadata_record(END_RECORD, BTreeMap::new())?);
            self.waiting.push(part);
            self.retry_ns = 0;
        }
        self.folder.keep_within(self.quota);
        let head = self.head(now, None)?;
        let path = self.folder.next_path(FileKind::Thin, "", now.wall);
        let mut part = PartFile::new(path, head, SMALLEST_THIN_PART as usize);
        part.push(chunk.bytes());
        self.thin.part = Some(part);
        Ok(())
    }

    /// Writes what can be written. After a failure only now and then.
    fn write(&mut self, now: Now) {
        if now.monotonic_ns < self.retry_ns {
            return;
        }
        let mut outcome = Outcome::default();
        if let Some(current) = &mut self.current {
            outcome.add(current.part.write());
        }
        if let Some(part) = &mut self.thin.part
            && outcome.add(part.write()) == Some(io::ErrorKind::NotFound)
        {
            self.thin.part = None;
        }
        self.waiting.retain_mut(|part| match outcome.add(part.finish()) {
            None => {
                tracing::info!("{} is complete", part.path().display());
                false
            }
            // One that was removed has nothing more to complete.
            Some(kind) => kind != io::ErrorKind::NotFound,
        });
        self.note(outcome, now);
    }

    fn note(&mut self, outcome: Outcome, now: Now) {
        self.figures.written_bytes += outcome.bytes;
        let Some(error) = outcome.error else {
            if outcome.bytes > 0 && self.figures.problem.take().is_some() {
                tracing::warn!("the black box writes again");
            }
            return;
        };
        self.retry_ns = now.monotonic_ns + RETRY_NS;
        let problem = problem_of(&error);
        if self.figures.problem.replace(problem) != Some(problem) {
            tracing::error!(
                "{}: cannot be written: {error}: make room or permit writing; the black box goes on in memory",
                self.folder.folder().path().display()
            );
        }
    }
}

/// What came of several attempts to write.
#[derive(Debug, Default)]
struct Outcome {
    bytes: u64,
    /// The first error.
    error: Option<io::Error>,
}

impl Outcome {
    /// Adds one; returns the kind of its error.
    fn add(&mut self, written: io::Result<u64>) -> Option<io::ErrorKind> {
        match written {
            Ok(bytes) => {
                self.bytes += bytes;
                None
            }
            Err(error) => {
                let kind = error.kind();
                self.error.get_or_insert(error);
                Some(kind)
            }
        }
    }
}

fn write_all(writer: &mut ChunkWriter, batch: &Batch) -> Result<(), WriteError> {
    fn each<T: Logged>(writer: &mut ChunkWriter, messages: &[T]) -> Result<(), WriteError> {
        messages.iter().try_for_each(|message| writer.write(message))
    }
    each(writer, &batch.states)?;
    each(writer, &batch.timings)?;
    each(writer, &batch.estimates)?;
    each(writer, &batch.cycles)?;
    each(writer, &batch.alarms)?;
    each(writer, &batch.ranges)?;
    each(writer, &batch.commands)?;
    each(writer, &batch.trips)?;
    each(writer, &batch.inferred)
}
