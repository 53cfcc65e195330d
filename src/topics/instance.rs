//! One worm's namespace on this computer.

use iceoryx2::prelude::{Config as IoxConfig, FileName, Path as IoxPath, SemanticString};
use std::fs::{DirBuilder, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;
use worm_estimator::config::Config;

/// Longest path of a unix socket, bytes, without the closing zero.
const SOCKET_PATH_MAX: usize = 107;
/// What iceoryx2 adds to folder and prefix in a listener's socket: a slash, 39 digits and `.event`.
const SOCKET_NAME: usize = 1 + 39 + 6;
/// How long iceoryx2 itself waits for a half-made service to be finished by its maker.
const CREATION_TIMEOUT: Duration = Duration::from_millis(500);

/// An instance that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum InstanceError {
    /// The folder cannot be created or entered.
    #[error(
        "topics.root: {}: {source}: give a folder on a tmpfs that this user may write, such as /dev/shm/wormd-{}",
        folder.display(), nix::unistd::geteuid()
    )]
    Unusable {
        /// The folder.
        folder: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The folder belongs to someone else.
    #[error(
        "topics.root: {} belongs to user {owner}, this process runs as user {user}: run all processes of a worm as \
         one user, or give this user's worm another name (worm.name, --name)",
        folder.display()
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// The folder's owner.
        owner: u32,
        /// The user of this process.
        user: u32,
    },
    /// Socket paths in it would be too long, or have characters that iceoryx2 does not take.
    #[error(
        "topics.root: {} and the name {worm} do not make a usable path: letters, digits and '/-_.' only, and the \
         length of the folder plus twice that of the name must be at most {limit} characters, not {length}",
        root.display()
    )]
    BadPath {
        /// `topics.root`, symbolic links resolved.
        root: PathBuf,
        /// The worm.
        worm: String,
        /// Length of folder plus twice the name.
        length: usize,
        /// Longest allowed.
        limit: usize,
    },
}

/// One worm's namespace: everything that its processes share lies in one folder and under one prefix in `/dev/shm`.
///
/// The folder is `<topics.root>/<name>`. The prefix is `wormd_<name>_<hash>_`, where the hash is the CRC-16/XMODEM of
/// `topics.root` (symbolic links resolved) as four hexadecimal digits, so that worms of one name under two roots do not
/// meet either.
#[derive(Debug, Clone)]
pub struct Instance {
    worm: String,
    folder: PathBuf,
    prefix: String,
    iceoryx: IoxConfig,
}

/// Mode of a worm's folder: its user's alone.
const PRIVATE: u32 = 0o700;

impl Instance {
    /// The namespace of the configured worm.
    ///
    /// # Errors
    /// As [`Instance::new`].
    pub fn of(config: &Config) -> Result<Self, InstanceError> {
        Self::new(Path::new(&config.topics.root), &config.worm.name)
    }

    /// The namespace of the worm `name` under `root`; creates the folders where they are missing: the worm's for its user
    /// alone (0700), the root for every user if its own parent allows that (1777 in `/dev/shm`), else 0755.
    ///
    /// # Errors
    /// [`InstanceError`] when a folder cannot be used; its text says why and what to do.
    pub fn new(root: &Path, name: &str) -> Result<Self, InstanceError> {
        let unusable = |source| InstanceError::Unusable {
            folder: root.to_path_buf(),
            source,
        };
        create_root(root).map_err(unusable)?;
        let root = root.canonicalize().map_err(unusable)?;
        let hash = crc::Crc::<u16>::new(&crc::CRC_16_XMODEM).checksum(root.as_os_str().as_encoded_bytes());
        let prefix = format!("wormd_{name}_{hash:04x}_");
        let folder = root.join(name);
        let iceoryx = iceoryx_config(&folder, &prefix).ok_or_else(|| InstanceError::BadPath {
            worm: name.to_owned(),
            length: root.as_os_str().len() + 2 * name.len(),
            limit: SOCKET_PATH_MAX - SOCKET_NAME - "/wormd__0000_".len(),
            root,
        })?;
        let instance = Self {
            worm: name.to_owned(),
            folder,
            prefix,
            iceoryx,
        };
        instance.create_folder()?;
        Ok(instance)
    }

    /// The worm's name.
    pub fn worm(&self) -> &str {
        &self.worm
    }

    /// The folder that holds locks and iceoryx2's files: the root path that a peer's iceoryx2 must be given.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The prefix that a peer's iceoryx2 must be given; every shared-memory segment of this worm begins with it.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Name of the service that carries `topic`.
    pub(super) fn service(&self, topic: &str) -> String {
        format!("worm/{}/{topic}", self.worm)
    }

    pub(crate) fn iceoryx(&self) -> &IoxConfig {
        &self.iceoryx
    }

    pub(super) fn lock_path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.lock"))
    }

    /// Creates the folder, for its user alone; the last process of a worm removes it, so a start must expect it gone.
    fn create_folder(&self) -> Result<(), InstanceError> {
        let unusable = |source| InstanceError::Unusable {
            folder: self.folder.clone(),
            source,
        };
        DirBuilder::new()
            .recursive(true)
            .mode(PRIVATE)
            .create(&self.folder)
            .map_err(unusable)?;
        let (owner, mode) = match self.folder.symlink_metadata() {
            Ok(metadata) => (metadata.uid(), metadata.mode() & 0o777),
            // A leaving process has just removed it; the next lock creates it again.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(unusable(error)),
        };
        let user = nix::unistd::geteuid().as_raw();
        if owner != user {
            return Err(InstanceError::Foreign {
                folder: self.folder.clone(),
                owner,
                user,
            });
        }
        if mode == PRIVATE {
            return Ok(());
        }
        // Made under another umask, which iceoryx2 changes for moments in its own threads.
        match std::fs::set_permissions(&self.folder, Permissions::from_mode(PRIVATE)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(unusable(error)),
            _ => Ok(()),
        }
    }
}

/// Creates the folder of all worms. Where everybody may create folders, and remove only their own, everybody may do so in it
/// as well: the first user's worm must not keep out the worms of the others.
fn create_root(root: &Path) -> io::Result<()> {
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

/// iceoryx2's settings for one instance, or `None` when the paths do not fit.
fn iceoryx_config(folder: &Path, prefix: &str) -> Option<IoxConfig> {
    let bytes = folder.as_os_str().as_encoded_bytes();
    if bytes.len() + prefix.len() + SOCKET_NAME > SOCKET_PATH_MAX {
        return None;
    }
    let plain = |byte: &u8| byte.is_ascii_alphanumeric() || b"/-_.".contains(byte);
    if !bytes.iter().all(plain) {
        return None;
    }
    let mut config = IoxConfig::default();
    config.global.set_root_path(&IoxPath::new(bytes).ok()?);
    config.global.prefix = FileName::new(prefix.as_bytes()).ok()?;
    config.global.creation_timeout = CREATION_TIMEOUT;
    // Cleaning up after the dead can hang: the start does it itself, under its time limit.
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.global.service.cleanup_dead_nodes_on_open = false;
    Some(config)
}
