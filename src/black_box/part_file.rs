//! A file under way: `NAME.part`, renamed to `NAME` once it is complete and on the disk.
//!
//! What cannot be written now stays in memory, within bounds, and is written later: a full disk may get room again.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use worm_log::complete;

/// What the name of a file under way ends with.
pub(super) const PART: &str = "part";

/// A log under way.
#[derive(Debug)]
pub(super) struct PartFile {
    path: PathBuf,
    file: Option<File>,
    /// Bytes that stand in the file as a whole.
    written: u64,
    queue: VecDeque<Vec<u8>>,
    queued_bytes: usize,
    max_queued: usize,
    /// Whether something was left out, because there was no room for it in memory either.
    has_gap: bool,
}

impl PartFile {
    /// A file that will get this name. Nothing is written yet.
    pub(super) fn new(path: PathBuf, head: Vec<u8>, max_queued: usize) -> Self {
        let mut part = Self {
            path,
            file: None,
            written: 0,
            queue: VecDeque::new(),
            queued_bytes: 0,
            max_queued,
            has_gap: false,
        };
        part.push(&head);
        part
    }

    /// Its name once it is complete.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes in the file and on their way there.
    pub(super) const fn bytes(&self) -> u64 {
        self.written + self.queued_bytes as u64
    }

    /// Bytes that are not in the file yet.
    pub(super) const fn queued_bytes(&self) -> usize {
        self.queued_bytes
    }

    /// Whether something had to be left out.
    pub(super) const fn has_gap(&self) -> bool {
        self.has_gap
    }

    /// Appends whole records; what would be too much for the memory is left out.
    pub(super) fn push(&mut self, records: &[u8]) {
        if self.queued_bytes + records.len() > self.max_queued && !self.queue.is_empty() {
            self.has_gap = true;
            return;
        }
        self.queued_bytes += records.len();
        self.queue.push_back(records.to_vec());
    }

    /// Writes what is queued and waits until it is on the disk; returns how many bytes that were.
    ///
    /// # Errors
    /// From the operating system; what was not written stays queued. [`io::ErrorKind::NotFound`] when the file was removed:
    /// what was in it is lost.
    pub(super) fn write(&mut self) -> io::Result<u64> {
        if self.queue.is_empty() {
            return Ok(0);
        }
        let begun = self.written;
        let written = self.try_to_write();
        if written.is_err()
            && let Some(file) = &mut self.file
        {
            // The next attempt goes on after the last whole record.
            let _ = file.set_len(self.written);
            let _ = file.seek(SeekFrom::Start(self.written));
        }
        written?;
        Ok(self.written - begun)
    }

    fn try_to_write(&mut self) -> io::Result<()> {
        if self.file.is_none() {
            self.file = Some(create(&part_path(&self.path))?);
        }
        let Some(file) = &mut self.file else { return Ok(()) };
        while let Some(records) = self.queue.front() {
            file.write_all(records)?;
            self.written += records.len() as u64;
            self.queued_bytes -= records.len();
            self.queue.pop_front();
        }
        file.sync_data()?;
        if file.metadata()?.nlink() == 0 {
            return Err(io::Error::new(
                io::ErrorKind::NotFound,
                "the file was removed while it was written",
            ));
        }
        Ok(())
    }

    /// Completes the file, and gives it its name.
    ///
    /// # Errors
    /// As [`write`](Self::write); it can be tried again.
    pub(super) fn finish(&mut self) -> io::Result<u64> {
        let written = self.write()?;
        let Some(file) = &mut self.file else { return Ok(written) };
        finish(file, &part_path(&self.path), &self.path)?;
        Ok(written)
    }

    /// Forgets the file, and removes what there is of it.
    pub(super) fn discard(self) {
        if self.file.is_some() {
            let _ = std::fs::remove_file(part_path(&self.path));
        }
    }
}

fn create(path: &Path) -> io::Result<File> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    OpenOptions::new().read(true).write(true).create_new(true).open(path)
}

/// The name of a file while it is under way.
pub(super) fn part_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(PART);
    PathBuf::from(name)
}

/// Completes a log, renames it, and waits until the disk has both.
///
/// # Errors
/// From the operating system; the file then has its old name.
pub(super) fn finish(file: &mut File, from: &Path, to: &Path) -> io::Result<()> {
    complete(file)?;
    file.sync_all()?;
    std::fs::rename(from, to)?;
    if let Some(folder) = to.parent() {
        // Where a folder cannot be synchronised, the name is on the disk a little later.
        let _ = File::open(folder).and_then(|folder| folder.sync_all());
    }
    Ok(())
}
