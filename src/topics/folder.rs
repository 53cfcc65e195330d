//! The folders of a worm, opened so that nobody else's can take their place.
//!
//! Everything goes through directory descriptors that were verified after they were opened: between a check and a use by path,
//! another user could exchange what lies there.

use super::error::InstanceError;
use super::lock_holder;
use nix::errno::Errno;
use nix::fcntl::{OFlag, open, openat};
use nix::sys::stat::{FileStat, Mode, fchmod, fstat, mkdirat};
use std::fs::{DirBuilder, Permissions};
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
#[cfg(any(test, feature = "bridge"))]
use worm_estimator::config::Topics;

/// Mode of a worm's folder: its user's alone.
const PRIVATE: u32 = 0o700;
/// Others may write.
const WRITABLE: u32 = 0o022;
/// Only its owner may remove a file.
const STICKY: u32 = 0o1000;

/// The folder of one worm in the folder of all.
#[derive(Debug, Clone)]
pub(super) struct WormFolder {
    /// `topics.root`, symbolic links resolved.
    root: PathBuf,
    worm: String,
}

impl WormFolder {
    /// The folder of `worm` under `root`; creates the root where it is missing.
    pub(super) fn new(root: &Path, worm: &str) -> Result<Self, InstanceError> {
        let unusable = |source| InstanceError::Unusable {
            folder: root.to_path_buf(),
            source,
        };
        create_root(root).map_err(unusable)?;
        Ok(Self {
            root: root.canonicalize().map_err(unusable)?,
            worm: worm.to_owned(),
        })
    }

    pub(super) fn root(&self) -> &Path {
        &self.root
    }

    pub(super) fn path(&self) -> PathBuf {
        self.root.join(&self.worm)
    }

    /// Opens the folder, and creates it where it is missing; the last process of a worm removes it, so it may be gone at any time.
    ///
    /// # Errors
    /// [`InstanceError`] when the folder, or that of all worms, is somebody else's.
    pub(super) fn open(&self) -> Result<OwnedFd, InstanceError> {
        let root = open_root(&self.root)?;
        let unusable = |errno: Errno| InstanceError::Unusable {
            folder: self.path(),
            source: errno.into(),
        };
        let folder = loop {
            match mkdirat(&root, self.worm.as_str(), Mode::from_bits_truncate(PRIVATE)) {
                Ok(()) | Err(Errno::EEXIST) => {}
                Err(errno) => return Err(unusable(errno)),
            }
            match openat(&root, self.worm.as_str(), folder_flags() | OFlag::O_PATH, Mode::empty()) {
                Ok(folder) => break folder,
                // A leaving process has just removed it.
                Err(Errno::ENOENT) => {}
                Err(errno) => return Err(unusable(errno)),
            }
        };
        let status = fstat(&folder).map_err(unusable)?;
        let user = nix::unistd::geteuid().as_raw();
        if status.st_uid != user {
            return Err(InstanceError::Foreign {
                folder: self.path(),
                owner: status.st_uid,
                user,
            });
        }
        // The same folder once more, as one that can be changed.
        let folder = openat(&folder, ".", folder_flags(), Mode::empty()).map_err(unusable)?;
        if mode_of(&status) & 0o777 != PRIVATE {
            // Made under another umask, which iceoryx2 changes for moments in its own threads.
            fchmod(&folder, Mode::from_bits_truncate(PRIVATE)).map_err(unusable)?;
        }
        Ok(folder)
    }
}

/// Opens the folder of all worms, and makes sure that nobody else can exchange what lies in it.
pub(super) fn open_root(root: &Path) -> Result<OwnedFd, InstanceError> {
    let unusable = |source| InstanceError::Unusable {
        folder: root.to_path_buf(),
        source,
    };
    let folder = loop {
        match open(root, folder_flags() | OFlag::O_PATH, Mode::empty()) {
            Ok(folder) => break folder,
            // Somebody has removed it.
            Err(Errno::ENOENT) => create_root(root).map_err(unusable)?,
            Err(errno) => return Err(unusable(errno.into())),
        }
    };
    let status = fstat(&folder).map_err(|errno| unusable(errno.into()))?;
    let user = nix::unistd::geteuid().as_raw();
    if status.st_uid != user && status.st_uid != 0 {
        return Err(InstanceError::ForeignRoot {
            root: root.to_path_buf(),
            owner: status.st_uid,
            user,
        });
    }
    let mode = mode_of(&status);
    if mode & WRITABLE != 0 && mode & STICKY == 0 {
        return Err(InstanceError::OpenRoot {
            root: root.to_path_buf(),
            mode: mode & 0o7777,
        });
    }
    Ok(folder)
}

fn folder_flags() -> OFlag {
    OFlag::O_DIRECTORY | OFlag::O_NOFOLLOW | OFlag::O_CLOEXEC
}

fn mode_of(status: &FileStat) -> u32 {
    status.st_mode
}

/// Creates the folder of all worms. Where everybody may create folders, and remove only their own, everybody may do so in it
/// as well: root's worm must not keep out the worms of the others.
pub(super) fn create_root(root: &Path) -> io::Result<()> {
    const SHARED: u32 = 0o1002;
    if let Some(parent) = root.parent() {
        DirBuilder::new().recursive(true).mode(0o755).create(parent)?;
    }
    match DirBuilder::new().mode(0o755).create(root) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists && root.is_dir() => return Ok(()),
        Err(error) => return Err(error),
    }
    let parent_mode = root
        .parent()
        .map_or(Ok(0), |parent| parent.metadata().map(|it| it.mode()))?;
    if parent_mode & SHARED == SHARED {
        std::fs::set_permissions(root, Permissions::from_mode(0o1777))?;
    }
    Ok(())
}

/// Where `topics.root = "auto"` puts the topics of a worm: `/dev/shm/wormd` for root. For another user `/run/user/UID/wormd`, which
/// nobody else can enter; where there is no such folder, or the name is too long for a socket in it, `/dev/shm/wormd-UID`.
///
/// `/run/user/UID` comes and goes with the user's sessions, so a worm that runs decides: its processes are found, and joined, in
/// whichever of the two folders they are.
pub(super) fn auto_root(worm: &str) -> PathBuf {
    running_or_first(auto_roots(worm), worm)
}

/// The folders of all worms that `topics.root` may mean.
#[cfg(any(test, feature = "bridge"))]
pub(super) fn all_roots(topics_root: &str) -> Vec<PathBuf> {
    match topics_root {
        Topics::AUTO => auto_roots(""),
        root => vec![PathBuf::from(root)],
    }
}

/// The folders that `topics.root = "auto"` may mean, the one for a new worm first.
fn auto_roots(worm: &str) -> Vec<PathBuf> {
    /// Longest root with twice the worm's name; as `topics.root` is checked.
    const LIMIT: usize = 48;
    let user = nix::unistd::geteuid();
    if user.is_root() {
        return vec![PathBuf::from("/dev/shm/wormd")];
    }
    let runtime = PathBuf::from(format!("/run/user/{user}"));
    let is_own = runtime
        .metadata()
        .is_ok_and(|it| it.is_dir() && it.uid() == user.as_raw());
    let root = runtime.join("wormd");
    let everywhere = PathBuf::from(format!("/dev/shm/wormd-{user}"));
    if is_own && root.as_os_str().len() + 2 * worm.len() <= LIMIT {
        vec![root, everywhere]
    } else {
        vec![everywhere]
    }
}

/// The root under which a process of `worm` runs, else the first.
fn running_or_first(mut roots: Vec<PathBuf>, worm: &str) -> PathBuf {
    let user = nix::unistd::geteuid().as_raw();
    let runs_in = |root: &PathBuf| {
        let folder = root.join(worm);
        // Nobody else can pretend that this user's worm runs.
        let is_own = folder
            .symlink_metadata()
            .is_ok_and(|it| it.is_dir() && it.uid() == user);
        is_own && lock_holder::is_any_held(&folder)
    };
    let chosen = roots.iter().position(runs_in).unwrap_or_default();
    roots.swap_remove(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::{Controller, Instance, RoleLock, Supervisor};

    #[test]
    fn a_worm_that_runs_is_found_though_another_root_is_preferred_by_now() {
        let folder = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let (preferred, other) = (folder.path().join("run"), folder.path().join("shm"));
        let chosen = || running_or_first(vec![preferred.clone(), other.clone()], "w");
        assert_eq!(chosen(), preferred, "nothing runs");

        let instance = Instance::new(&other, "w").expect("an instance");
        assert_eq!(chosen(), preferred, "a folder alone is no worm");
        let controller = RoleLock::<Controller>::take(&instance).expect("nobody else has it");
        assert_eq!(chosen(), other);
        // A second controller of that name is refused, wherever it would have begun.
        let second = Instance::new(&chosen(), "w").expect("an instance");
        RoleLock::<Controller>::take(&second).expect_err("one runs already");
        assert_eq!(
            running_or_first(vec![preferred.clone(), other.clone()], "another"),
            preferred
        );

        drop(controller);
        assert_eq!(chosen(), preferred, "it has ended");
        let supervisor = RoleLock::<Supervisor>::take(&instance).expect("nobody else has it");
        assert_eq!(chosen(), other, "its supervisor is about to start it again");
        drop(supervisor);
        assert_eq!(chosen(), preferred);
    }
}
