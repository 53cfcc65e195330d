//! A root for topics that is gone after the test.

use std::path::{Path, PathBuf};
use tempfile::TempDir;
use wormd::topics::Instance;

/// A folder on tmpfs, and whatever the worms in it leave in `/dev/shm`; removed when dropped.
pub struct Home {
    root: TempDir,
}

impl Home {
    pub fn new() -> Self {
        let root = tempfile::Builder::new()
            .prefix("wt")
            .tempdir_in("/dev/shm")
            .expect("a folder in /dev/shm");
        Self { root }
    }

    pub fn root(&self) -> &Path {
        self.root.path()
    }

    pub fn instance(&self, worm: &str) -> Instance {
        Instance::new(self.root(), worm).expect("an instance")
    }
}

/// The shared-memory segments of an instance.
pub fn segments(instance: &Instance) -> Vec<PathBuf> {
    let entries = std::fs::read_dir("/dev/shm").expect("/dev/shm");
    entries
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(instance.prefix()))
        .map(|entry| entry.path())
        .collect()
}
