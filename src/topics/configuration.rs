//! The configuration of a running worm, as its controller leaves it in the worm's folder for others: a recorder that knows only the worm's
//! name writes it into its log.

use super::instance::{CONFIGURATION, Instance};
use super::role::{Controller, RoleLock};
use nix::fcntl::{OFlag, openat};
use nix::sys::stat::Mode;
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::PathBuf;

/// What stands in the file.
#[derive(Debug, Serialize, Deserialize)]
struct Content {
    /// The controller: what a killed one left behind is of another.
    pid: u32,
    /// The text of its configuration file; none for the worm of the paper.
    text: Option<String>,
}

/// The file of this process's worm; removed when it is dropped.
#[derive(Debug)]
pub(crate) struct SharedConfiguration {
    path: PathBuf,
}

impl SharedConfiguration {
    /// Leaves the text of the controller's configuration file for others; none for the worm of the paper.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(crate) fn leave(role: &RoleLock<Controller>, text: Option<&str>) -> io::Result<Self> {
        let content = Content {
            pid: std::process::id(),
            text: text.map(str::to_owned),
        };
        let folder = role.instance().open_folder().map_err(io::Error::other)?;
        let flags = OFlag::O_WRONLY | OFlag::O_CREAT | OFlag::O_TRUNC | OFlag::O_NOFOLLOW | OFlag::O_CLOEXEC;
        let file = openat(&folder, CONFIGURATION, flags, Mode::from_bits_truncate(0o600))?;
        let shared = Self {
            path: role.instance().configuration_path(),
        };
        File::from(file).write_all(&serde_json::to_vec(&content)?)?;
        Ok(shared)
    }
}

impl Drop for SharedConfiguration {
    fn drop(&mut self) {
        if let Err(error) = fs::remove_file(&self.path) {
            tracing::debug!("{}: {error}", self.path.display());
        }
    }
}

/// The configuration that a worm runs with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum RunningConfiguration {
    /// That of the paper, without a file.
    Paper,
    /// The text of its file.
    Text(String),
}

impl RunningConfiguration {
    /// That of the worm which runs now; `None` where none runs, or its controller does not say.
    pub(crate) fn of(instance: &Instance) -> Option<Self> {
        let controller = RoleLock::<Controller>::holder(instance)?;
        let text = fs::read_to_string(instance.configuration_path()).ok()?;
        let content: Content = serde_json::from_str(&text).ok()?;
        (content.pid == controller).then(|| content.text.map_or(Self::Paper, Self::Text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::role;

    #[test]
    fn the_configuration_is_there_while_the_controller_is_and_no_longer() {
        let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let instance = Instance::new(root.path(), "shared").expect("an instance");
        let running = || RunningConfiguration::of(&instance);
        assert_eq!(running(), None);

        let controller = RoleLock::<Controller>::take(&instance).expect("nobody else has it");
        assert_eq!(running(), None, "an older controller leaves none");
        let text = "[worm]\ncells = 5\n";
        let shared = SharedConfiguration::leave(&controller, Some(text)).expect("it can be written");
        assert_eq!(running(), Some(RunningConfiguration::Text(text.to_owned())));
        drop(shared);
        let shared = SharedConfiguration::leave(&controller, None).expect("it can be written");
        assert_eq!(running(), Some(RunningConfiguration::Paper));
        drop(shared);
        drop(controller);
        assert!(!instance.folder().exists(), "nothing is left");

        // What a killed controller leaves behind is nobody's.
        instance.open_folder().expect("it is made again");
        let left = instance.configuration_path();
        let content = Content { pid: 1, text: None };
        fs::write(&left, serde_json::to_vec(&content).expect("JSON")).expect("can be written");
        fs::write(instance.lock_path("controller"), "1\n").expect("can be written");
        assert_eq!(running(), None);
        let controller = RoleLock::<Controller>::take(&instance).expect("nobody else has it");
        assert_eq!(running(), None, "it is of another process");
        drop(controller);
        fs::write(instance.lock_path("controller"), "1\n").expect("can be written");
        role::remove_abandoned(&instance);
        assert!(!left.exists());
    }
}
