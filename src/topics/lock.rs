//! A lock file that may be removed while others wait for it.

use nix::errno::Errno;
use nix::fcntl::{Flock, FlockArg};
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// A lock file that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}: the lock file must be writable, on a file system with flock: set another topics.root", file.display())]
pub struct LockError {
    /// The lock file.
    pub file: PathBuf,
    /// Why.
    pub source: io::Error,
}

/// How a lock file is locked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LockKind {
    /// Together with others that ask for the same.
    Shared,
    /// Alone.
    Exclusive,
}

impl LockKind {
    fn without_waiting(self) -> FlockArg {
        match self {
            Self::Shared => FlockArg::LockSharedNonblock,
            Self::Exclusive => FlockArg::LockExclusiveNonblock,
        }
    }
}

/// A locked lock file. The kernel releases it when the process ends, however it ends.
#[derive(Debug)]
pub(super) struct LockFile {
    flock: Flock<File>,
    path: PathBuf,
}

impl LockFile {
    /// Locks the file at `path`, without waiting; `None` when someone else has it.
    pub(super) fn try_lock(path: &Path, kind: LockKind) -> Result<Option<Self>, LockError> {
        let failed = |source| LockError {
            file: path.to_path_buf(),
            source,
        };
        loop {
            let file = match open(path) {
                Ok(file) => file,
                // The folder was removed between its creation and the opening of the file, by a process that left.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(failed(error)),
            };
            let flock = match Flock::lock(file, kind.without_waiting()) {
                Ok(flock) => flock,
                Err((_, Errno::EWOULDBLOCK)) => return Ok(None),
                Err((_, Errno::EINTR)) => continue,
                Err((_, errno)) => return Err(failed(errno.into())),
            };
            // The last holder may have removed the file meanwhile; a lock on a file without a name locks nothing.
            if is_still_at(&flock, path) {
                return Ok(Some(Self {
                    flock,
                    path: path.to_path_buf(),
                }));
            }
        }
    }

    /// Changes the kind of the lock without waiting; after `false` the lock may be lost.
    pub(super) fn try_change(&mut self, kind: LockKind) -> bool {
        self.flock.relock(kind.without_waiting()).is_ok()
    }

    /// Writes `text` as the file's whole content.
    pub(super) fn write(&mut self, text: &str) -> Result<(), LockError> {
        let result = self
            .flock
            .set_len(0)
            .and_then(|()| (&*self.flock).write_all(text.as_bytes()));
        result.map_err(|source| LockError {
            file: self.path.clone(),
            source,
        })
    }

    /// Removes the file's name. Only an exclusive holder may do that: it then is the last to have used it.
    pub(super) fn remove(&self) {
        if let Err(error) = std::fs::remove_file(&self.path) {
            tracing::debug!("{}: {error}", self.path.display());
        }
    }
}

fn open(path: &Path) -> io::Result<File> {
    if let Some(folder) = path.parent() {
        DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    }
    OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(path)
}

fn is_still_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), path.metadata()) {
        (Ok(ours), Ok(there)) => ours.ino() == there.ino() && ours.dev() == there.dev(),
        _ => false,
    }
}
