//! The list of robots that this process leaves for others ([`super::fleet_list`]).

use super::fleet_list::{FleetList, ListedRobot, PREFIX, SUFFIX, read_all};
use super::folder::{self, open_root};
use crate::realtime::monotonic_ns;
use nix::fcntl::{Flock, FlockArg, OFlag, openat, renameat};
use nix::sys::stat::Mode;
use nix::unistd::{UnlinkatFlags, unlinkat};
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The list of this process; its files are removed when it is dropped.
#[derive(Debug)]
pub(crate) struct PublishedList {
    roots: Vec<PathBuf>,
    name: String,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    list: FleetList,
    /// Open and locked for as long as they are there: by that others know that this process is alive.
    files: Vec<Flock<File>>,
    /// Whether the list is what stands in them.
    is_written: bool,
}

impl PublishedList {
    /// Leaves a list for others, in each folder that `topics_root` may mean, and removes those of killed processes that had no other robots.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn publish(
        topics_root: &str,
        config: &Path,
        robots: impl IntoIterator<Item = String>,
    ) -> io::Result<Self> {
        let list = FleetList {
            pid: std::process::id(),
            config: std::path::absolute(config)?,
            robots: robots.into_iter().map(|name| (name, ListedRobot::default())).collect(),
        };
        let mut roots = Vec::new();
        let mut refused = None;
        for root in folder::all_roots(topics_root) {
            match usable(&root) {
                Ok(root) => roots.push(root),
                Err(error) => refused = Some(error),
            }
        }
        // Of two that may be meant, one may be somebody else's: then no worm of this user is there.
        if let (true, Some(error)) = (roots.is_empty(), refused) {
            return Err(error);
        }
        let published = Self {
            roots,
            name: format!("{PREFIX}{}-{:x}{SUFFIX}", list.pid, monotonic_ns()),
            state: Mutex::new(State {
                list,
                files: Vec::new(),
                is_written: false,
            }),
        };
        let mut state = published.state();
        published.write(&mut state)?;
        for root in &published.roots {
            for dead in read_all(root).into_iter().filter(|found| !found.is_alive()) {
                let mut robots = dead.list.robots.keys();
                if robots.all(|robot| state.list.robots.contains_key(robot))
                    && let Err(error) = fs::remove_file(&dead.file)
                {
                    // Another fleet process may have done so. What stays is shown, and says what to do.
                    tracing::debug!("{}: {error}", dead.file.display());
                }
            }
        }
        drop(state);
        Ok(published)
    }

    /// Says how it stands with a robot. Also writes what others have removed.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn tell(&self, robot: &str, standing: ListedRobot) -> io::Result<()> {
        let mut state = self.state();
        let is_known = state.list.robots.get(robot) == Some(&standing);
        if is_known && state.is_written && self.is_in_place(&state) {
            return Ok(());
        }
        state.list.robots.insert(robot.to_owned(), standing);
        self.write(&mut state)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Each change of it is one assignment.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether nobody has removed the files.
    fn is_in_place(&self, state: &State) -> bool {
        self.roots.iter().zip(&state.files).all(|(root, file)| {
            let there = root.join(&self.name).symlink_metadata();
            let own = file.metadata();
            there.is_ok_and(|there| own.is_ok_and(|own| (own.dev(), own.ino()) == (there.dev(), there.ino())))
        })
    }

    /// Each file is the old one or the new one, at any time.
    fn write(&self, state: &mut State) -> io::Result<()> {
        state.is_written = false;
        let text = serde_json::to_vec(&state.list)?;
        let draft = format!("{}.new", self.name);
        let mut files = Vec::new();
        for root in &self.roots {
            let folder = open_root(root).map_err(io::Error::other)?;
            let flags = OFlag::O_WRONLY | OFlag::O_CREAT | OFlag::O_TRUNC | OFlag::O_NOFOLLOW | OFlag::O_CLOEXEC;
            let file = File::from(openat(&folder, draft.as_str(), flags, Mode::from_bits_truncate(0o600))?);
            let mut file = Flock::lock(file, FlockArg::LockExclusiveNonblock).map_err(|(_, errno)| errno)?;
            file.write_all(&text)?;
            renameat(&folder, draft.as_str(), &folder, self.name.as_str())?;
            files.push(file);
        }
        state.files = files;
        state.is_written = true;
        Ok(())
    }
}

/// A folder of all worms that is there and this user's to use, symbolic links resolved.
fn usable(root: &Path) -> io::Result<PathBuf> {
    folder::create_root(root)?;
    let root = root.canonicalize()?;
    open_root(&root).map_err(io::Error::other)?;
    Ok(root)
}

impl Drop for PublishedList {
    fn drop(&mut self) {
        for root in &self.roots {
            let removed = open_root(root).map_err(io::Error::other).and_then(|folder| {
                unlinkat(&folder, self.name.as_str(), UnlinkatFlags::NoRemoveDir).map_err(io::Error::from)
            });
            if let Err(error) = removed {
                tracing::debug!("{}: {error}", root.join(&self.name).display());
            }
        }
    }
}
