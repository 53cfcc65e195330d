//! The files of a black box, and what others may do with them: list, read, and, for the black box itself, bound.
//!
//! `box-000012-20261124T201533Z-motor-stall.mcap` is a box, `thin-000013-20261124T201540Z.mcap` a part of the thin log. The number grows by one
//! with each file, over restarts and whatever the clock does: the smaller is the older. Files under way end with `.part`.

use super::part_file::{PART, finish};
use super::{BOX_RECORD, END_RECORD, utc};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use worm_estimator::config::Config;
use worm_log::{Outline, outline};

/// The lock of whoever writes to a folder.
const LOCK: &str = ".lock";
/// What the names of all complete files end with.
const EXTENSION: &str = ".mcap";
/// The part of the quota that the thin log may take.
const THIN_SHARE: f64 = 0.25;

/// The kinds of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum FileKind {
    /// The moments around events.
    Box,
    /// The thin log.
    Thin,
}

/// A file of a black box, by its name.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Named {
    number: u64,
    kind: FileKind,
    is_part: bool,
    path: PathBuf,
    bytes: u64,
}

/// A file of a black box. Its field names are a contract of the JSON output.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Entry {
    /// Its name in the folder.
    pub name: String,
    /// A box or a part of the thin log.
    pub kind: FileKind,
    /// Its number: the smaller is the older.
    pub number: u64,
    /// The first event, as `alarm motor-stall`; null in the thin log.
    pub reason: Option<String>,
    /// All events of a box with their times, s since its first message; only those that are known of one that was interrupted.
    pub events: Vec<BoxEvent>,
    /// When the first event was, ns since 1970 by the wall clock of that moment; of the thin log, when it was begun.
    pub unix_ns: Option<u64>,
    /// From the first message to the last, s.
    pub duration_s: f64,
    /// Messages in it.
    pub messages: u64,
    /// Bytes.
    pub bytes: u64,
    /// Whether it has everything that it was to have: false where the black box was killed meanwhile, or writes still.
    pub complete: bool,
    /// Whether it is written still, or was left so by a black box that was killed.
    pub under_way: bool,
    /// Which boot of the computer it is of: times of different ones cannot be compared.
    pub boot_id: Option<String>,
}

/// An event of a box.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct BoxEvent {
    /// What happened, as `fault link-lost`.
    pub event: String,
    /// When, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
}

/// Why a folder or a file of it cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FolderError {
    /// The folder.
    #[error("{}: cannot be used: {source}: give the folder of a black box, which its user may read and write", path.display())]
    Folder { path: PathBuf, source: io::Error },
    /// Another black box writes to it.
    #[error("{}: another black box writes to it: give each its own folder", .0.display())]
    InUse(PathBuf),
    /// There is no such file.
    #[error("{}: there is no {name}: `wormd black-box list` names what there is", folder.display())]
    NotThere { folder: PathBuf, name: String },
}

/// The folder of a black box.
#[derive(Debug, Clone)]
pub(crate) struct Folder {
    path: PathBuf,
}

/// A folder that this process alone writes to.
#[derive(Debug)]
pub(super) struct OwnFolder {
    folder: Folder,
    /// The number of the newest file, which may not be on the disk yet.
    newest: u64,
    _lock: File,
}

impl Folder {
    /// A folder; it need not be there.
    pub(crate) fn new(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// The one that the configuration names, or else the place where the installed service keeps it.
    pub(crate) fn configured(config: &Config) -> Self {
        let configured = config
            .black_box
            .as_ref()
            .and_then(|black_box| black_box.folder.as_ref());
        let path = configured.map_or_else(
            || PathBuf::from(format!("/var/lib/wormd/{}/black-box", config.worm.name)),
            PathBuf::from,
        );
        Self { path }
    }

    /// Its path.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Everything in it, the oldest first. A file that cannot be read is left out, with a warning in the log, but for one under way; a box of which nothing
    /// could be written yet is among the [`unwritten`](Self::unwritten).
    ///
    /// # Errors
    /// [`FolderError::Folder`] when the folder cannot be read.
    pub(crate) fn list(&self) -> Result<Vec<Entry>, FolderError> {
        Ok(self.entries(&self.files()?))
    }

    /// The boxes in it, the oldest first; otherwise as [`list`](Self::list).
    ///
    /// # Errors
    /// As [`list`](Self::list).
    pub(crate) fn boxes(&self) -> Result<Vec<Entry>, FolderError> {
        let mut files = self.files()?;
        files.retain(|file| file.kind == FileKind::Box);
        Ok(self.entries(&files))
    }

    fn entries(&self, files: &[Named]) -> Vec<Entry> {
        let entry = |named: &Named| match self.entry(named) {
            Ok(entry) => Some(entry),
            Err(_) if named.is_part => None,
            Err(error) => {
                tracing::warn!("{}: cannot be read: {error}", named.path.display());
                None
            }
        };
        files.iter().filter_map(entry).collect()
    }

    /// The names of the boxes under way of which nothing is in the file: what they hold waits in the memory of the black box, or is lost with it.
    pub(crate) fn unwritten(&self) -> Vec<String> {
        let files = self.files().unwrap_or_default();
        let parts = files.iter().filter(|file| file.is_part && file.kind == FileKind::Box);
        let unwritten = parts.filter(|file| self.entry(file).is_err());
        let names = unwritten.filter_map(|file| Some(file.path.file_name()?.to_string_lossy().into_owned()));
        names.collect()
    }

    /// The newest box that is complete, or else the newest there is.
    ///
    /// # Errors
    /// As [`list`](Self::list).
    pub(crate) fn newest_box(&self) -> Result<Option<Entry>, FolderError> {
        let mut boxes = self.boxes()?;
        Ok(match boxes.iter().rposition(|entry| !entry.under_way) {
            Some(place) => Some(boxes.swap_remove(place)),
            None => boxes.pop(),
        })
    }

    /// The path of a file, by its whole name or its number.
    ///
    /// # Errors
    /// [`FolderError::NotThere`]; [`FolderError::Folder`] when the folder cannot be read.
    pub(crate) fn find(&self, name: &str) -> Result<PathBuf, FolderError> {
        let number = name.parse::<u64>().ok();
        let found = self
            .files()?
            .into_iter()
            .find(|file| file.path.file_name().is_some_and(|found| found == name) || Some(file.number) == number);
        found.map(|file| file.path).ok_or_else(|| FolderError::NotThere {
            folder: self.path.clone(),
            name: name.to_owned(),
        })
    }

    fn files(&self) -> Result<Vec<Named>, FolderError> {
        let unreadable = |source| FolderError::Folder {
            path: self.path.clone(),
            source,
        };
        let mut files = Vec::new();
        for found in std::fs::read_dir(&self.path).map_err(unreadable)? {
            let found = found.map_err(unreadable)?;
            let name = found.file_name();
            let Some((kind, number, is_part)) = name.to_str().and_then(parse) else {
                continue;
            };
            // One that is removed meanwhile is not there. Links are no files of a black box: what they lead to may be anything.
            if let Ok(metadata) = found.metadata()
                && metadata.is_file()
            {
                files.push(Named {
                    number,
                    kind,
                    is_part,
                    path: found.path(),
                    bytes: metadata.len(),
                });
            }
        }
        files.sort_by_key(|file| file.number);
        Ok(files)
    }

    fn entry(&self, named: &Named) -> io::Result<Entry> {
        let name = named
            .path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let held = outline(&mut File::open(&named.path)?)?;
        let about = |record: &str, key: &str| held.metadata.get(record).and_then(|entries| entries.get(key)).cloned();
        let unix_ns = match named.kind {
            FileKind::Box => about(BOX_RECORD, "event_unix_ns"),
            FileKind::Thin => about("wormd", "begun_unix_ns"),
        };
        Ok(Entry {
            reason: about(BOX_RECORD, "reason").filter(|_| named.kind == FileKind::Box),
            events: events(&held),
            unix_ns: unix_ns.and_then(|text| text.parse().ok()),
            duration_s: held.last_ns.saturating_sub(held.first_ns) as f64 * 1e-9,
            messages: held.messages,
            bytes: named.bytes,
            complete: held.is_complete && held.metadata.contains_key(END_RECORD),
            under_way: named.is_part,
            boot_id: about(BOX_RECORD, "boot_id"),
            kind: named.kind,
            number: named.number,
            name,
        })
    }
}

/// Part of a box's record of events: `TIME_NS EVENT`, one a line.
pub(super) fn events_text(events: impl Iterator<Item = BoxEvent>) -> String {
    events
        .map(|event| format!("{} {}\n", event.time_ns, event.event))
        .collect()
}

/// The events of a box.
pub(crate) fn events(held: &Outline) -> Vec<BoxEvent> {
    let parse = |line: &str| {
        let (time_ns, event) = line.split_once(' ')?;
        Some(BoxEvent {
            event: event.to_owned(),
            time_ns: time_ns.parse().ok()?,
        })
    };
    if let Some(text) = held.metadata.get(END_RECORD).and_then(|end| end.get("events")) {
        return text.lines().filter_map(parse).collect();
    }
    let begun = held.metadata.get(BOX_RECORD);
    let first = begun.and_then(|begun| Some(format!("{} {}", begun.get("event_ns")?, begun.get("reason")?)));
    first.iter().filter_map(|line| parse(line)).collect()
}

impl OwnFolder {
    /// Takes a folder, which is made if necessary. What a killed black box left behind is completed.
    ///
    /// # Errors
    /// [`FolderError`] when it cannot be written to, or another black box does.
    pub(super) fn take(path: &Path) -> Result<Self, FolderError> {
        let unusable = |source| FolderError::Folder {
            path: path.to_owned(),
            source,
        };
        std::fs::create_dir_all(path).map_err(unusable)?;
        let mut options = File::options();
        let lock = options.write(true).create(true).truncate(false).open(path.join(LOCK));
        let lock = lock.map_err(unusable)?;
        // Where the file system knows no locks, nothing protects from a second one.
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            return Err(FolderError::InUse(path.to_owned()));
        }
        let own = Self {
            folder: Folder::new(path),
            newest: 0,
            _lock: lock,
        };
        own.recover();
        Ok(own)
    }

    /// Completes what was left under way, as far as it was written.
    fn recover(&self) {
        for file in self
            .folder
            .files()
            .unwrap_or_default()
            .iter()
            .filter(|file| file.is_part)
        {
            let whole = file.path.with_extension("");
            let recovered = File::options().read(true).write(true).open(&file.path);
            match recovered.and_then(|mut part| finish(&mut part, &file.path, &whole)) {
                Ok(()) => tracing::warn!("{}: completed, as far as it was written", whole.display()),
                Err(error) => tracing::warn!(
                    "{}: cannot be completed: {error}: `wormd export` reads what is in it",
                    file.path.display()
                ),
            }
        }
    }

    /// The folder.
    pub(super) const fn folder(&self) -> &Folder {
        &self.folder
    }

    /// A name for a new file.
    pub(super) fn next_path(&mut self, kind: FileKind, reason: &str, now: SystemTime) -> PathBuf {
        let files = self.folder.files().unwrap_or_default();
        let number = files.last().map_or(0, |file| file.number).max(self.newest) + 1;
        self.newest = number;
        let time = utc::compact(now);
        self.folder.path.join(match kind {
            FileKind::Box => format!("box-{number:06}-{time}-{reason}{EXTENSION}"),
            FileKind::Thin => format!("thin-{number:06}-{time}{EXTENSION}"),
        })
    }

    /// Removes the oldest until all is within the quota: parts of the thin log where that has more than its share, else boxes, but
    /// never the last complete one, and nothing that is under way.
    pub(super) fn keep_within(&self, quota: u64) {
        let files = match self.folder.files() {
            Ok(files) => files,
            Err(error) => return tracing::warn!("{error}"),
        };
        for path in surplus(&files, quota) {
            match std::fs::remove_file(&path) {
                Ok(()) => tracing::info!("removed {}, the oldest", path.display()),
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => tracing::warn!("{} cannot be removed: {error}", path.display()),
            }
        }
    }
}

/// What must go.
fn surplus(files: &[Named], quota: u64) -> Vec<PathBuf> {
    let of_kind = |kind: FileKind| files.iter().filter(move |file| file.kind == kind);
    let sum = |kind: FileKind| of_kind(kind).map(|file| file.bytes).sum::<u64>();
    let (mut boxes, mut thin) = (sum(FileKind::Box), sum(FileKind::Thin));
    let mut gone = Vec::new();
    let mut old_boxes = of_kind(FileKind::Box).filter(|file| !file.is_part).collect::<Vec<_>>();
    // The last one stays.
    old_boxes.pop();
    let mut old_boxes = old_boxes.into_iter();
    let mut old_thin = of_kind(FileKind::Thin).filter(|file| !file.is_part);
    let thin_share = (quota as f64 * THIN_SHARE) as u64;
    while boxes + thin > quota {
        let first_thin = thin > thin_share;
        let oldest = if first_thin {
            old_thin.next().or_else(|| old_boxes.next())
        } else {
            old_boxes.next().or_else(|| old_thin.next())
        };
        let Some(oldest) = oldest else { break };
        match oldest.kind {
            FileKind::Box => boxes -= oldest.bytes,
            FileKind::Thin => thin -= oldest.bytes,
        }
        gone.push(oldest.path.clone());
    }
    gone
}

/// Kind and number in the name of a file, and whether it is under way.
fn parse(name: &str) -> Option<(FileKind, u64, bool)> {
    let whole = name.strip_suffix(PART).and_then(|name| name.strip_suffix('.'));
    let stem = whole.unwrap_or(name).strip_suffix(EXTENSION)?;
    let (kind, rest) = match stem.split_once('-')? {
        ("box", rest) => (FileKind::Box, rest),
        ("thin", rest) => (FileKind::Thin, rest),
        _ => return None,
    };
    let (number, _) = rest.split_once('-')?;
    Some((kind, number.parse().ok()?, whole.is_some()))
}

/// A file from one of its bytes on: what a copy that was broken off still needs.
///
/// # Errors
/// From the operating system, and when it has fewer bytes.
pub(crate) fn open_from(path: &Path, offset: u64) -> io::Result<impl Read> {
    let mut file = File::open(path)?;
    let length = file.seek(SeekFrom::End(0))?;
    if offset > length {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            format!("it has {length} bytes, and the copy {offset}: it is a copy of another file"),
        ));
    }
    file.seek(SeekFrom::Start(offset))?;
    Ok(file)
}

/// The metadata record of a box with this first event.
pub(super) fn box_record(reason: &str, event_ns: u64, event_unix_ns: u128) -> BTreeMap<String, String> {
    // Times of one boot only are on one clock.
    let boot_id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    let entries = [
        ("reason", reason.to_owned()),
        ("event_ns", event_ns.to_string()),
        ("event_unix_ns", event_unix_ns.to_string()),
        ("boot_id", boot_id.trim().to_owned()),
    ];
    entries.map(|(key, value)| (key.to_owned(), value)).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(number: u64, kind: FileKind, bytes: u64) -> Named {
        Named {
            number,
            kind,
            is_part: false,
            path: PathBuf::from(number.to_string()),
            bytes,
        }
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut own = OwnFolder::take(folder.path()).expect("nobody else has it");
        assert!(matches!(OwnFolder::take(folder.path()), Err(FolderError::InUse(_))));
        let path = own.next_path(FileKind::Box, "motor-stall", SystemTime::UNIX_EPOCH);
        let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
        assert_eq!(name, "box-000001-19700101T000000Z-motor-stall.mcap");
        assert_eq!(parse(name), Some((FileKind::Box, 1, false)));
        assert_eq!(parse(&format!("{name}.part")), Some((FileKind::Box, 1, true)));
        for other in ["box-x-y.mcap", "run.mcap", ".lock", "box-000001-a-b.csv", "thin.part"] {
            assert_eq!(parse(other), None, "{other}");
        }
    }

    #[test]
    fn the_oldest_goes_first_and_the_last_box_never() {
        use FileKind::{Box, Thin};
        let files = [
            file(1, Box, 40),
            file(2, Thin, 30),
            file(3, Box, 40),
            file(4, Thin, 10),
            file(5, Box, 40),
        ];
        let gone = |quota| {
            surplus(&files, quota)
                .iter()
                .map(|path| path.display().to_string())
                .collect::<Vec<_>>()
        };
        assert_eq!(gone(160), Vec::<String>::new());
        // The thin log has more than its quarter.
        assert_eq!(gone(150), ["2"]);
        assert_eq!(gone(100), ["2", "1"]);
        assert_eq!(gone(10), ["2", "4", "1", "3"]);
        let mut under_way = files.to_vec();
        under_way[4].is_part = true;
        // Box 3 is the last that is complete.
        assert!(!surplus(&under_way, 10).contains(&PathBuf::from("3")));
    }
}
