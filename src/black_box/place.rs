//! Which folder is a worm's black box, for whoever looks for boxes and was not told.
//!
//! A black box may write elsewhere than the configuration says, as with `wormd up --black-box DIR`. So each leaves a line for its user, in
//! the folder of XDG for what programs remember (`$XDG_STATE_HOME/wormd`, or `~/.local/state/wormd`), and there it is looked for later.

use super::folder::Folder;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use worm_estimator::config::Config;

/// Where boxes are looked for.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    /// The folder that was given, or that of the configuration, or where the installed service keeps it.
    usual: Folder,
    /// Where it is remembered which folder another one was; none where one was given, and for a user without a home.
    memory: Option<PathBuf>,
}

impl Place {
    /// That of a worm; a folder that is given counts alone.
    pub(crate) fn of(config: &Config, given: Option<&Path>) -> Self {
        match given {
            Some(path) => Self {
                usual: Folder::new(path),
                memory: None,
            },
            None => Self {
                usual: Folder::configured(config),
                memory: memory(&config.worm.name),
            },
        }
    }

    /// The folder: the usual one, unless this user's black box of the worm began elsewhere after everything there.
    pub(crate) fn folder(&self) -> Folder {
        let remembered = self.memory.as_ref().and_then(|memory| recall(memory, &self.usual));
        remembered.unwrap_or_else(|| self.usual.clone())
    }
}

/// Notes that the black box of a worm begins to write to a folder. Where that cannot be noted, the folder is to be named later.
pub(super) fn remember(config: &Config, folder: &Path) {
    let Some(memory) = memory(&config.worm.name) else {
        return;
    };
    if let Err(error) = note(&memory, folder) {
        tracing::debug!("{}: {error}", memory.display());
    }
}

fn note(memory: &Path, folder: &Path) -> io::Result<()> {
    let folder = std::path::absolute(folder)?;
    if let Some(home) = memory.parent() {
        fs::create_dir_all(home)?;
    }
    // At once: who reads it meanwhile finds the old one or the new one.
    let draft = memory.with_extension(std::process::id().to_string());
    fs::write(&draft, folder.as_os_str().as_encoded_bytes())?;
    fs::rename(&draft, memory)
}

/// The folder that was noted, where it is there and was begun with later than anything in the usual one.
fn recall(memory: &Path, usual: &Folder) -> Option<Folder> {
    let begun = fs::metadata(memory).and_then(|about| about.modified()).ok()?;
    let noted = fs::read_to_string(memory).ok()?;
    let path = Path::new(&noted);
    let is_newer = newest_change(usual.path()).is_none_or(|changed| changed < begun);
    (is_newer && path.is_dir()).then(|| Folder::new(path))
}

/// When the newest file of a folder was changed last; none where none is there, or nobody may look.
fn newest_change(folder: &Path) -> Option<SystemTime> {
    let files = fs::read_dir(folder).ok()?.flatten();
    files.filter_map(|file| file.metadata().ok()?.modified().ok()).max()
}

/// Where the folder of a worm's black box is remembered. Worms of a user are told apart by their names.
fn memory(worm: &str) -> Option<PathBuf> {
    let variable = |name| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let state = variable("XDG_STATE_HOME").or_else(|| Some(variable("HOME")?.join(".local/state")))?;
    Some(state.join("wormd").join(format!("{worm}.black-box")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn the_folder_that_was_written_to_last_is_meant() {
        let home = tempfile::tempdir().expect("a folder");
        let [configured, elsewhere] = ["configured", "elsewhere"].map(|name| home.path().join(name));
        let memory = home.path().join("state/w.black-box");
        let place = Place {
            usual: Folder::new(&configured),
            memory: Some(memory.clone()),
        };
        let meant = || place.folder().path().to_owned();
        assert_eq!(meant(), configured, "nothing is remembered");
        note(&memory, &elsewhere).expect("can be written");
        assert_eq!(meant(), configured, "there is no such folder");
        fs::create_dir(&elsewhere).expect("can be made");
        assert_eq!(meant(), elsewhere, "nothing is in the configured one");
        fs::create_dir(&configured).expect("can be made");
        let file =
            fs::File::create(configured.join("box-000001-20261129T080000Z-motor-stall.mcap")).expect("can be made");
        let begun = fs::metadata(&memory)
            .and_then(|about| about.modified())
            .expect("is there");
        for (seconds, wanted) in [(-60, &elsewhere), (60, &configured)] {
            let changed = begun.checked_add(Duration::from_secs(120)).expect("a time")
                - Duration::from_secs((120 - seconds) as u64);
            file.set_modified(changed).expect("can be set");
            assert_eq!(&meant(), wanted, "a file of {seconds} s later");
        }
    }
}
