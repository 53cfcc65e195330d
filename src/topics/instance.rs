//! One worm's namespace on this computer.

use super::error::InstanceError;
use super::folder::{WormFolder, auto_root};
use iceoryx2::prelude::{Config as IoxConfig, FileName, Path as IoxPath, SemanticString};
use std::borrow::Cow;
use std::fs;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::Duration;
use worm_estimator::config::{Config, Topics};

/// Name of the file in which a controller leaves its configuration.
pub(super) const CONFIGURATION: &str = "configuration.json";

/// Longest path of a unix socket, bytes, without the closing zero.
const SOCKET_PATH_MAX: usize = 107;
/// What iceoryx2 adds to folder and prefix in a listener's socket: a slash, 39 digits and `.event`.
const SOCKET_NAME: usize = 1 + 39 + 6;
/// How long iceoryx2 itself waits for a half-made service to be finished by its maker.
const CREATION_TIMEOUT: Duration = Duration::from_millis(500);

/// One worm's namespace: everything that its processes share lies in one folder and under one prefix in `/dev/shm`.
///
/// The folder is `<topics.root>/<name>`. The prefix is `wormd_<name>_<hash>_`, where the hash is the CRC-16/XMODEM of
/// `topics.root` (symbolic links resolved) as four hexadecimal digits, so that worms of one name under two roots do not
/// meet either.
#[derive(Debug, Clone)]
pub struct Instance {
    worm: String,
    worm_folder: WormFolder,
    folder: PathBuf,
    prefix: String,
    iceoryx: IoxConfig,
}

impl Instance {
    /// The namespace of the configured worm.
    ///
    /// # Errors
    /// As [`Instance::new`].
    pub fn of(config: &Config) -> Result<Self, InstanceError> {
        Self::new(&root_of(config), &config.worm.name)
    }

    /// The namespace of the worm `name` under `root`; creates the folders where they are missing: the worm's for its user
    /// alone (0700), the root for every user if its own parent allows that (1777 in `/dev/shm`), else 0755. The root must be this
    /// user's or root's, and sticky if others may write in it.
    ///
    /// # Errors
    /// [`InstanceError`] when a folder cannot be used; its text says why and what to do.
    pub fn new(root: &Path, name: &str) -> Result<Self, InstanceError> {
        let worm_folder = WormFolder::new(root, name)?;
        let root = worm_folder.root().to_path_buf();
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
            worm_folder,
            folder,
            prefix,
            iceoryx,
        };
        instance.open_folder()?;
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

    /// The folder of all worms, symbolic links resolved.
    pub fn root(&self) -> &Path {
        self.worm_folder.root()
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

    /// The file in which the controller leaves its configuration.
    pub(super) fn configuration_path(&self) -> PathBuf {
        self.folder().join(CONFIGURATION)
    }

    pub(super) fn lock_path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.lock"))
    }

    /// Where the relay of the worm's watchers listens.
    pub(crate) fn relay_socket(&self) -> PathBuf {
        self.folder.join("relay.sock")
    }

    /// Where the trip of the worm listens.
    pub(crate) fn trip_socket(&self) -> PathBuf {
        self.folder.join("trip.sock")
    }

    /// Removes the folder when nothing is in it any more: for the last process of a worm, and for who only looked whether it runs.
    pub(crate) fn remove_folder_if_empty(&self) {
        if let Err(error) = fs::remove_dir(&self.folder) {
            tracing::trace!("{}: {error}", self.folder.display());
        }
    }

    /// Opens the folder, verified as this user's, and creates it where it is missing: the last process of a worm removes it, so a
    /// start must expect it gone.
    pub(super) fn open_folder(&self) -> Result<OwnedFd, InstanceError> {
        self.worm_folder.open()
    }
}

/// The folder of all worms that a configuration selects.
fn root_of(config: &Config) -> Cow<'_, Path> {
    match config.topics.root.as_str() {
        Topics::AUTO => Cow::Owned(auto_root(&config.worm.name)),
        root => Cow::Borrowed(Path::new(root)),
    }
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
