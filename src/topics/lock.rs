//! A lock file that may be removed while others wait for it.

use super::instance::Instance;
use nix::errno::Errno;
use nix::fcntl::{AtFlags, Flock, FlockArg, OFlag, openat};
use nix::sys::stat::{FileStat, Mode, SFlag, fstat, fstatat};
use nix::unistd::{UnlinkatFlags, unlinkat};
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt;
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
    /// The folder that it was opened in.
    folder: OwnedFd,
    /// Its name in there.
    name: String,
    path: PathBuf,
}

impl LockFile {
    /// Locks the worm's lock file `<name>.lock`, without waiting; `None` when someone else has it.
    pub(super) fn try_lock(instance: &Instance, name: &str, kind: LockKind) -> Result<Option<Self>, LockError> {
        let path = instance.lock_path(name);
        let name = format!("{name}.lock");
        let failed = |source| LockError {
            file: path.clone(),
            source,
        };
        loop {
            let folder = instance
                .open_folder()
                .map_err(|error| failed(io::Error::other(error)))?;
            let file = match open(&folder, &name) {
                Ok(file) => file,
                // The folder was removed between its opening and that of the file, by a process that left.
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
            if is_at(&path, &flock) {
                return Ok(Some(Self {
                    flock,
                    folder,
                    name,
                    path,
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
        // If somebody has removed the file, another one may be there by now, locked by another process.
        let is_ours = fstat(&*self.flock).is_ok_and(|ours| {
            fstatat(&self.folder, self.name.as_str(), AtFlags::AT_SYMLINK_NOFOLLOW)
                .is_ok_and(|there| (there.st_dev, there.st_ino) == (ours.st_dev, ours.st_ino))
        });
        if is_ours && let Err(error) = unlinkat(&self.folder, self.name.as_str(), UnlinkatFlags::NoRemoveDir) {
            tracing::debug!("{}: {error}", self.path.display());
        }
    }

    /// Where the file is, as long as nobody removes it.
    pub(super) fn place(&self) -> io::Result<LockPlace> {
        let metadata = self.flock.metadata()?;
        Ok(LockPlace {
            path: self.path.clone(),
            identity: (metadata.dev(), metadata.ino()),
        })
    }
}

/// A lock file's name and identity, by which its removal can be noticed.
#[derive(Debug, Clone)]
pub(crate) struct LockPlace {
    path: PathBuf,
    identity: (u64, u64),
}

impl LockPlace {
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file still has its name.
    pub(crate) fn is_kept(&self) -> bool {
        self.path
            .symlink_metadata()
            .is_ok_and(|there| (there.dev(), there.ino()) == self.identity)
    }
}

/// Opens a lock file in a folder that is known to be this user's; never through a link, and never somebody else's file.
fn open(folder: &OwnedFd, name: &str) -> io::Result<File> {
    let flags = OFlag::O_RDWR | OFlag::O_CREAT | OFlag::O_NOFOLLOW | OFlag::O_CLOEXEC | OFlag::O_NONBLOCK;
    let file = openat(folder, name, flags, Mode::from_bits_truncate(0o600))?;
    let status = fstat(&file)?;
    let user = nix::unistd::geteuid().as_raw();
    if status.st_uid != user {
        return Err(io::Error::other(format!(
            "it belongs to user {}, not {user}",
            status.st_uid
        )));
    }
    if !is_regular(&status) {
        return Err(io::Error::other("it is not a regular file"));
    }
    Ok(File::from(file))
}

fn is_regular(status: &FileStat) -> bool {
    SFlag::from_bits_truncate(status.st_mode) & SFlag::S_IFMT == SFlag::S_IFREG
}

fn is_at(path: &Path, file: &File) -> bool {
    match (file.metadata(), path.symlink_metadata()) {
        (Ok(ours), Ok(there)) => ours.ino() == there.ino() && ours.dev() == there.dev(),
        _ => false,
    }
}
