//! Files that are replaced whole or not at all.

use super::ReportError;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Makes a directory with all above it.
pub fn make_directory(path: &Path) -> Result<(), ReportError> {
    fs::create_dir_all(path).map_err(|source| ReportError::File {
        path: path.to_owned(),
        problem: "the directory cannot be made",
        source,
        remedy: "name a directory that exists or can be made, or correct its permissions",
    })
}

/// Checks that a directory can be written, and leaves it as it was.
pub fn try_directory(path: &Path) -> Result<(), ReportError> {
    let trial = path.join(format!(".{}.part", std::process::id()));
    let made = File::create(&trial).and_then(|_| fs::remove_file(&trial));
    made.map_err(|source| ReportError::File {
        path: path.to_owned(),
        problem: "the directory cannot be written in",
        source,
        remedy: "correct its permissions, or name another directory",
    })
}

/// Writes a file under another name and renames it: a reader sees the old file or the new one, never a part.
pub fn replace(path: PathBuf, content: &[u8]) -> Result<PathBuf, ReportError> {
    let mut beside = path.clone().into_os_string();
    beside.push(format!(".{}.part", std::process::id()));
    let beside = PathBuf::from(beside);
    let written = write_synced(&beside, content).and_then(|()| fs::rename(&beside, &path));
    if let Err(source) = written {
        // The first error is the one to report; a file that cannot be written often cannot be removed either.
        let _ = fs::remove_file(&beside);
        return Err(ReportError::File {
            path,
            problem: "the file cannot be written",
            source,
            remedy: "free some space, correct the permissions of its directory, or name another directory",
        });
    }
    Ok(path)
}

fn write_synced(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(content)?;
    file.sync_all()
}
