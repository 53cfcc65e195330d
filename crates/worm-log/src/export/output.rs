//! A file that bears its name only once it is complete.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Why a file cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// There is one of this name.
    #[error("{} exists already: choose another name, or overwrite it with --force", .0.display())]
    Exists(PathBuf),
    /// There can be no file in this place, whatever room there is.
    #[error("{}: {problem}: choose another place", file.display())]
    Place {
        /// The file or folder.
        file: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The file cannot be written.
    #[error("{}: cannot be written: {problem}: make room or choose another place", file.display())]
    Refused {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        problem: String,
    },
}

impl OutputError {
    pub(super) fn of(file: &Path, problem: impl ToString) -> Self {
        Self::Refused {
            file: file.to_owned(),
            problem: problem.to_string(),
        }
    }

    /// A folder or file could not be made, of which nothing was there before.
    pub(super) fn of_making(file: &Path, error: &io::Error) -> Self {
        use io::ErrorKind::{AlreadyExists, QuotaExceeded, StorageFull};
        let problem = match error.kind() {
            StorageFull | QuotaExceeded => return Self::of(file, error),
            AlreadyExists => "it is no folder".to_owned(),
            _ => format!("cannot be written: {error}"),
        };
        Self::Place {
            file: file.to_owned(),
            problem,
        }
    }
}

/// A file under construction: removed unless it is kept.
#[derive(Debug)]
pub(super) struct Output {
    file: BufWriter<File>,
    /// Its name for now.
    part: PathBuf,
    target: PathBuf,
    is_kept: bool,
}

impl Output {
    /// Begins a file that is to be called `target`.
    ///
    /// # Errors
    /// [`OutputError`] when there is one already and `overwrite` is not set, or it cannot be made.
    pub(super) fn create(target: &Path, overwrite: bool) -> Result<Self, OutputError> {
        // A folder, and a device such as /dev/null, are never replaced.
        if target.metadata().is_ok_and(|found| !found.is_file()) {
            return Err(OutputError::Place {
                file: target.to_owned(),
                problem: "it is no file that can be replaced".to_owned(),
            });
        }
        if !overwrite && target.symlink_metadata().is_ok() {
            return Err(OutputError::Exists(target.to_owned()));
        }
        let (file, part) = create_part(target).map_err(|error| OutputError::of_making(target, &error))?;
        Ok(Self {
            file: BufWriter::new(file),
            part,
            target: target.to_owned(),
            is_kept: false,
        })
    }

    /// Waits until the file is safe on the disk: then only its name can fail.
    ///
    /// # Errors
    /// [`OutputError`] when the operating system refuses.
    pub(super) fn sync(&mut self) -> Result<(), OutputError> {
        let synced = self.file.flush().and_then(|()| self.file.get_ref().sync_all());
        synced.map_err(|error| OutputError::of(&self.target, error))
    }

    /// Gives the file its name, once it is safe on the disk.
    ///
    /// # Errors
    /// [`OutputError`] when the operating system refuses.
    pub(super) fn keep(mut self) -> Result<(), OutputError> {
        self.sync()?;
        let kept = std::fs::rename(&self.part, &self.target);
        self.is_kept = kept.is_ok();
        kept.map_err(|error| OutputError::of(&self.target, error))
    }
}

/// Creates a file beside `target`, of a name that no other has.
fn create_part(target: &Path) -> io::Result<(File, PathBuf)> {
    let mut number = 0_u32;
    loop {
        let mut part = OsString::from(target);
        part.push(format!(".{}-{number}.part", std::process::id()));
        let part = PathBuf::from(part);
        match File::create_new(&part) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number < MOST_PARTS => number += 1,
            created => return created.map(|file| (file, part)),
        }
    }
}

/// So many unfinished files of one name may be there.
const MOST_PARTS: u32 = 1000;

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        if !self.is_kept {
            // If it cannot be removed, it is still no file of the wanted name.
            let _ = std::fs::remove_file(&self.part);
        }
    }
}
