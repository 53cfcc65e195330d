//! Instances that cannot be used, and ports that could not be created.

use std::fmt::Debug;
use std::io;
use std::path::PathBuf;

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
    /// The folder of all worms belongs to another user than root, who could exchange what is in it.
    #[error(
        "topics.root: {} belongs to user {owner}, who could exchange the files of this user's worms: give a folder of user \
         {user} or of root, such as /dev/shm/wormd-{user}, or leave topics.root = \"auto\"",
        root.display()
    )]
    ForeignRoot {
        /// The folder.
        root: PathBuf,
        /// The folder's owner.
        owner: u32,
        /// The user of this process.
        user: u32,
    },
    /// In the folder of all worms anybody may exchange anything.
    #[error(
        "topics.root: in {} (mode {mode:o}) others may remove and replace what this user creates: chmod +t it, or give \
         another folder",
        root.display()
    )]
    OpenRoot {
        /// The folder.
        root: PathBuf,
        /// Its mode.
        mode: u32,
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

/// A port that could not be created.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// Every place is taken.
    #[error("{service}: all {places} places for a {port} are taken: stop a process that has one")]
    Full {
        /// The service.
        service: String,
        /// What was to be created.
        port: &'static str,
        /// How many there can be.
        places: usize,
    },
    /// The role is that of another worm.
    #[error("{service}: the role that was taken is that of {worm}: take the role on the hub's own instance")]
    OtherWorm {
        /// The service.
        service: String,
        /// Whose role it is.
        worm: String,
    },
    /// iceoryx2 refused.
    #[error(
        "{service}: no {port} could be created ({reason}): is there room in /dev/shm, and in the limit of open files?"
    )]
    Refused {
        /// The service.
        service: String,
        /// What was to be created.
        port: &'static str,
        /// iceoryx2's reason.
        reason: String,
    },
}

impl PortError {
    /// Turns iceoryx2's error into ours; `full` is its error for "no place left".
    pub(super) fn from_iceoryx<E: Debug + PartialEq>(
        service: String,
        port: &'static str,
        places: usize,
        full: E,
    ) -> impl FnOnce(E) -> Self {
        move |error| {
            if error == full {
                Self::Full { service, port, places }
            } else {
                let reason = format!("{error:?}");
                Self::Refused { service, port, reason }
            }
        }
    }
}
