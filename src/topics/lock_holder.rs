//! Who uses a file, and which process a lock file belongs to.

use super::kernel_locks;
use std::fs;
use std::io;
use std::path::Path;

/// Whether process `pid` has the file open, or, where the system does not show what it has open, has locked it.
pub(super) fn has_open(pid: u32, file: &Path) -> bool {
    shows_open(pid, file).unwrap_or_else(|_| kernel_locks::holds(pid, file))
}

/// Whether `/proc` shows that a process has the file open; an error where this user may not know.
fn shows_open(pid: u32, file: &Path) -> io::Result<bool> {
    let mut refused = None;
    for entry in fs::read_dir(format!("/proc/{pid}/fd"))?.flatten() {
        match fs::read_link(entry.path()) {
            Ok(open) if open == file => return Ok(true),
            // The list may be readable where the names are not.
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => refused = Some(error),
            _ => {}
        }
    }
    refused.map_or(Ok(false), Err)
}

/// The process that a lock file names, if it uses the file. Creates nothing and disturbs nobody.
pub(super) fn holder(file: &Path) -> Option<u32> {
    holder_by(file, has_open)
}

/// As [`holder`], where `uses` says whether a process uses a file.
pub(super) fn holder_by(file: &Path, uses: impl Fn(u32, &Path) -> bool) -> Option<u32> {
    named(file).filter(|&pid| uses(pid, file))
}

/// The process that a lock file names.
pub(super) fn named(file: &Path) -> Option<u32> {
    fs::read_to_string(file).ok()?.lines().next()?.trim().parse().ok()
}

/// What else stands in a lock file, in one line.
#[cfg(feature = "bridge")]
pub(super) fn note(file: &Path) -> Option<String> {
    fs::read_to_string(file).ok()?.lines().nth(1).map(str::to_owned)
}

/// Whether a process has a lock of the worm whose folder this is.
pub(super) fn is_any_held(worm_folder: &Path) -> bool {
    let Ok(entries) = fs::read_dir(worm_folder) else {
        return false;
    };
    let files = entries.flatten().map(|entry| entry.path());
    files
        .filter(|file| file.extension().is_some_and(|extension| extension == "lock"))
        .any(|lock| holder(&lock).is_some())
}
