//! One file of a recording.

use super::progress::Progress;
use crate::failure::Failure;
use std::fs::{File, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use worm_estimator::message::RecordingProblem;

/// A file that is written from its beginning. It counts its bytes, and takes nothing more after the first error: what follows a gap would
/// not be readable. Clones are the same file: one is for the [`worm_log::Writer`], which keeps it, one for who watches over it.
#[derive(Debug, Clone)]
pub(super) struct LogFile(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    file: File,
    bytes: AtomicU64,
    has_failed: AtomicBool,
    progress: Arc<Progress>,
}

/// A file that this process wrote, as the file system knows it: another may have its name by now.
#[derive(Debug)]
pub(super) struct WrittenFile {
    path: PathBuf,
    device: u64,
    inode: u64,
}

impl LogFile {
    /// Creates the file. With `overwrite` an existing one is emptied, unless another process records to it.
    ///
    /// # Errors
    /// From the operating system; [`io::ErrorKind::AlreadyExists`] without `overwrite`.
    pub(super) fn create(path: &Path, overwrite: bool, progress: &Arc<Progress>) -> io::Result<Self> {
        let mut options = File::options();
        // Emptied only once it is locked.
        options.write(true).create(true).truncate(false).create_new(!overwrite);
        let file = options.open(path)?;
        // Where the file system knows no locks, nothing protects from a second recorder.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(io::Error::new(
                io::ErrorKind::ResourceBusy,
                "another process records to it",
            ));
        }
        if file.metadata()?.is_file() {
            file.set_len(0)?;
        }
        progress.count_file();
        Ok(Self(Arc::new(Inner {
            file,
            bytes: AtomicU64::new(0),
            has_failed: AtomicBool::new(false),
            progress: Arc::clone(progress),
        })))
    }

    /// Bytes written.
    pub(super) fn bytes(&self) -> u64 {
        self.0.bytes.load(Ordering::Relaxed)
    }

    /// Whether it is an ordinary file, which can be followed by another.
    pub(super) fn is_regular(&self) -> bool {
        self.0.file.metadata().is_ok_and(|metadata| metadata.is_file())
    }

    /// The file as the file system knows it; `None` when that cannot be read.
    pub(super) fn identity(&self, path: &Path) -> Option<WrittenFile> {
        let metadata = self.0.file.metadata().ok()?;
        Some(WrittenFile {
            path: path.to_owned(),
            device: metadata.dev(),
            inode: metadata.ino(),
        })
    }

    /// Waits until the disk has what was written.
    ///
    /// # Errors
    /// From the operating system; [`io::ErrorKind::NotFound`] when the file was removed: what is written then is lost.
    pub(super) fn sync(&self) -> io::Result<()> {
        let synced = match self.0.file.sync_data() {
            // A device or pipe has nothing to synchronise.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
            synced => synced,
        };
        let outcome = synced.and_then(|()| match self.0.file.metadata()?.nlink() {
            0 => Err(io::Error::new(
                io::ErrorKind::NotFound,
                "the file was removed while it was recorded",
            )),
            _ => Ok(()),
        });
        self.note_failure(outcome)
    }

    fn note_failure<T>(&self, outcome: io::Result<T>) -> io::Result<T> {
        if let Err(error) = &outcome {
            self.0.has_failed.store(true, Ordering::Relaxed);
            self.0.progress.note_problem(problem_of(error));
        }
        outcome
    }
}

impl Write for LogFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.has_failed.load(Ordering::Relaxed) {
            return Err(io::Error::other("the recording has stopped"));
        }
        match (&self.0.file).write(bytes) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Err(error),
            outcome => {
                let written = self.note_failure(outcome)?;
                self.0.bytes.fetch_add(written as u64, Ordering::Relaxed);
                self.0.progress.count_bytes(written as u64);
                Ok(written)
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl WrittenFile {
    /// Removes the file, unless another has its name by now.
    pub(super) fn remove(&self) -> io::Result<()> {
        let found = match std::fs::symlink_metadata(&self.path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            found => found?,
        };
        if (found.dev(), found.ino()) == (self.device, self.inode) {
            std::fs::remove_file(&self.path)?;
        }
        Ok(())
    }

    /// Its name.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

/// Why a file cannot be created, for the operator.
pub(super) fn creation_failure(path: &Path, error: &io::Error) -> Failure {
    let name = path.display();
    Failure::unusable(match error.kind() {
        io::ErrorKind::AlreadyExists => {
            format!("{name} exists already: choose another name, or overwrite it with `wormd record --force`")
        }
        _ => format!("{name} cannot be written: {error}: choose another place"),
    })
}

/// What kind of problem an error of the file system is.
pub(crate) fn problem_of(error: &io::Error) -> RecordingProblem {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            RecordingProblem::DiskFull
        }
        io::ErrorKind::ReadOnlyFilesystem | io::ErrorKind::PermissionDenied => RecordingProblem::ReadOnly,
        io::ErrorKind::NotFound => RecordingProblem::FileRemoved,
        _ => RecordingProblem::WriteError,
    }
}
