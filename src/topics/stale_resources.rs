//! What killed processes leave behind, and who is alive to mind its removal.

use super::instance::Instance;
use super::lock_holder::has_open;
use super::role::{Relay, RoleLock};
use std::fmt;
use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::thread;
use std::time::Duration;

/// Where POSIX shared memory has its names on Linux.
const SHARED_MEMORY: &str = "/dev/shm";
/// The folders that iceoryx2 creates in its root path.
const ICEORYX_FOLDERS: [&str; 2] = ["nodes", "services"];

/// How long a forked child may take to become another program.
const FORK_PATIENCE: Duration = Duration::from_millis(5);

/// A process that takes part in a worm's topics.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Peer {
    /// The process.
    pub pid: u32,
    /// Its name, as the kernel knows it.
    pub name: String,
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (process {})", self.name, self.pid)
    }
}

/// Every other process that has something of this worm open or mapped: `wormd` processes, and readers in any other
/// language that know nothing of our locks.
pub(super) fn peers(instance: &Instance) -> Vec<Peer> {
    let presence = instance.lock_path("presence");
    let segments = format!("{SHARED_MEMORY}/{}", instance.prefix());
    let scan = || {
        others(|pid, process| {
            let maps = fs::read_to_string(process.join("maps")).unwrap_or_default();
            maps.contains(&segments) || has_open(pid, &presence)
        })
    };
    let mut found = scan();
    if !found.is_empty() {
        // A child that this process is just starting looks like a peer until it runs its own program.
        thread::sleep(FORK_PATIENCE);
        let again = scan();
        found.retain(|peer| again.iter().any(|other| other.pid == peer.pid));
    }
    found
}

/// Every other process that has the file open.
pub(super) fn who_has_open(file: &Path) -> Vec<Peer> {
    others(|pid, _| has_open(pid, file))
}

/// The other processes for which `takes_part` holds; it is given the process and its folder in `/proc`.
fn others(takes_part: impl Fn(u32, &Path) -> bool) -> Vec<Peer> {
    let Ok(processes) = fs::read_dir("/proc") else {
        return Vec::new();
    };
    // Other users cannot take part in this user's topics; what they open under such a name is theirs.
    let user = nix::unistd::geteuid().as_raw();
    let may_take_part = |path: &Path| path.metadata().is_ok_and(|it| it.uid() == user || it.uid() == 0);
    let pid_of = |entry: &fs::DirEntry| entry.file_name().to_str()?.parse::<u32>().ok();
    let mut found: Vec<Peer> = processes
        .flatten()
        .filter_map(|entry| Some((pid_of(&entry)?, entry.path())))
        .filter(|(pid, path)| *pid != std::process::id() && may_take_part(path) && takes_part(*pid, path))
        .map(|(pid, path)| Peer {
            pid,
            name: fs::read_to_string(path.join("comm"))
                .unwrap_or_default()
                .trim()
                .to_owned(),
        })
        .collect();
    found.sort_by_key(|peer| peer.pid);
    found
}

/// Files of this worm: shared-memory segments, and what iceoryx2 put into the folder. Locks are not among them, nor files of other
/// users in `/dev/shm`, where everybody may give a file any name.
fn files(instance: &Instance) -> io::Result<Vec<PathBuf>> {
    static WARNED: Once = Once::new();
    let user = nix::unistd::geteuid().as_raw();
    let mut found = Vec::new();
    for folder in [Path::new(SHARED_MEMORY), instance.folder()] {
        for entry in or_empty(fs::read_dir(folder))?.into_iter().flatten().flatten() {
            if entry
                .file_name()
                .as_encoded_bytes()
                .starts_with(instance.prefix().as_bytes())
            {
                let path = entry.path();
                match path.symlink_metadata().map(|it| it.uid()) {
                    Ok(owner) if owner != user => WARNED.call_once(|| {
                        tracing::warn!(
                            "{} is named like a file of this worm, but belongs to user {owner}: it is left alone",
                            path.display()
                        );
                    }),
                    // One that has just gone is not there.
                    _ => found.push(path),
                }
            }
        }
    }
    Ok(found)
}

fn or_empty<T>(result: io::Result<T>) -> io::Result<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Whether anything of an earlier life of this worm is there.
pub(super) fn is_there(instance: &Instance) -> bool {
    ICEORYX_FOLDERS.iter().any(|name| instance.folder().join(name).exists())
        || (instance.relay_socket().exists() && !is_served(instance))
        || instance.trip_socket().exists()
        || files(instance).is_ok_and(|files| !files.is_empty())
}

/// Whether a process listens at the relay's socket: a fleet process does so for a robot's worm, and has no part in the topics.
fn is_served(instance: &Instance) -> bool {
    RoleLock::<Relay>::holder(instance).is_some()
}

/// Removes everything of this worm but the locks, and the socket of one who serves watchers. Only for one who is sure to be alone.
pub(super) fn wipe(instance: &Instance) -> io::Result<()> {
    for file in files(instance)? {
        or_empty(fs::remove_file(file))?;
    }
    for name in ICEORYX_FOLDERS {
        or_empty(fs::remove_dir_all(instance.folder().join(name)))?;
    }
    if !is_served(instance) {
        or_empty(fs::remove_file(instance.relay_socket()))?;
    }
    or_empty(fs::remove_file(instance.trip_socket()))?;
    Ok(())
}

/// Removes segments of size zero that no process has open: their maker was killed between creating and sizing them.
/// iceoryx2 0.10 waits for ever for such a segment to grow. Safe while peers live.
pub(super) fn remove_stillborn(instance: &Instance) -> io::Result<usize> {
    let is_empty = |path: &PathBuf| {
        path.metadata()
            .is_ok_and(|metadata| metadata.is_file() && metadata.len() == 0)
    };
    let mut removed = 0;
    for file in files(instance)?.into_iter().filter(is_empty) {
        // In this order: a maker that is alive keeps it open until it has a size.
        if who_has_open(&file).is_empty() && !has_open(std::process::id(), &file) && is_empty(&file) {
            or_empty(fs::remove_file(&file))?;
            removed += 1;
        }
    }
    Ok(removed)
}
