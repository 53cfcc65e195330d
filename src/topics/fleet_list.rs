//! The robots that a `wormd fleet` process is there for, and how it stands with each: a list beside the folders of the worms.
//!
//! For who shows or holds all worms: of a robot that was never reached there is no folder, and what a killed fleet process offered looks
//! like nothing at all. So the list stays behind when its process is killed, and goes when that ends in order. And for who wants to run a
//! worm under a name that is taken.

use super::instance::Instance;
use super::lock_holder::has_open;
use nix::fcntl::OFlag;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// What the file's name begins and ends with.
pub(super) const PREFIX: &str = "fleet-";
pub(super) const SUFFIX: &str = ".json";
/// Longest list that is read, bytes.
const MAX_LENGTH: u64 = 4 << 20;

/// What stands in the file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct FleetList {
    /// The fleet process.
    pub(crate) pid: u32,
    /// Its configuration.
    pub(crate) config: PathBuf,
    /// The robots that are configured, by name.
    pub(crate) robots: BTreeMap<String, ListedRobot>,
}

/// How it stands with a robot.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ListedRobot {
    /// Whether it was heard since the process began.
    pub(crate) was_heard: bool,
    /// Why it is not heard, as far as that is known.
    pub(crate) problem: Option<String>,
    /// The run of its bridge that was heard last; none before, and of an older one.
    #[serde(default)]
    pub(crate) bridge: Option<String>,
    /// Its worms, each with the reason why it is not offered here, if it is not.
    pub(crate) worms: BTreeMap<String, Option<String>>,
}

/// A list that was found.
#[derive(Debug)]
pub(crate) struct FoundList {
    pub(crate) list: FleetList,
    pub(crate) file: PathBuf,
}

impl FoundList {
    /// Whether its process is there.
    pub(crate) fn is_alive(&self) -> bool {
        has_open(self.list.pid, &self.file)
    }
}

/// The worm of a robot that is offered on this computer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the name {worm} is in use on this computer: `wormd fleet` (process {pid}) offers {worm} of {robot} here. Give this worm another \
     name (--name, or worm.name), or let the fleet offer its worms elsewhere (root in fleet.toml)"
)]
pub struct OfferedFrom {
    /// The worm.
    pub worm: String,
    /// The robot.
    pub robot: String,
    /// The fleet process.
    pub pid: u32,
}

/// The lists in a folder of worms, those of killed processes among them.
pub(crate) fn read_all(root: &Path) -> Vec<FoundList> {
    let (lists, _) = read_all_and_damaged(root);
    lists
}

/// As [`read_all`], and the files of this user that should be lists and are none.
pub(crate) fn read_all_and_damaged(root: &Path) -> (Vec<FoundList>, Vec<PathBuf>) {
    let (mut lists, mut damaged) = (Vec::new(), Vec::new());
    let entries = fs::read_dir(root).into_iter().flatten().flatten();
    let is_one = |name: &str| name.starts_with(PREFIX) && name.ends_with(SUFFIX);
    for entry in entries.filter(|entry| entry.file_name().to_str().is_some_and(is_one)) {
        let file = entry.path();
        match text(&file).map(|text| serde_json::from_slice(&text)) {
            Some(Ok(list)) => lists.push(FoundList { list, file }),
            Some(Err(_)) => damaged.push(file),
            None => {}
        }
    }
    (lists, damaged)
}

/// What stands in a file of this user; none where there is no such file.
fn text(file: &Path) -> Option<Vec<u8>> {
    let flags = OFlag::O_NOFOLLOW | OFlag::O_NONBLOCK;
    let open = File::options().read(true).custom_flags(flags.bits()).open(file).ok()?;
    let metadata = open.metadata().ok()?;
    // In a folder where everybody may leave files, that of another user is none of this user's.
    if !metadata.is_file() || metadata.uid() != nix::unistd::geteuid().as_raw() {
        return None;
    }
    let mut text = Vec::new();
    open.take(MAX_LENGTH).read_to_end(&mut text).ok()?;
    Some(text)
}

/// The worm of a robot that a fleet process offers under the name of this instance, whose watchers process `holder` serves.
pub(crate) fn offered_by(holder: u32, instance: &Instance) -> Option<OfferedFrom> {
    let mut lists = read_all(instance.root()).into_iter();
    let FoundList { list, .. } = lists.find(|found| found.list.pid == holder && found.is_alive())?;
    let is_offered = |robot: &ListedRobot| robot.worms.get(instance.worm()).is_some_and(Option::is_none);
    let (robot, _) = list.robots.into_iter().find(|(_, robot)| is_offered(robot))?;
    Some(OfferedFrom {
        worm: instance.worm().to_owned(),
        robot,
        pid: holder,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::{Controller, Hub, PublishedList, Recorder, Relay, RoleError, RoleLock};
    use std::os::unix::net::UnixListener;

    #[test]
    fn no_worm_begins_under_the_name_of_an_offered_one_and_no_process_removes_its_socket() {
        let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let text = root.path().to_str().expect("is text");
        let list =
            PublishedList::publish(text, Path::new("fleet.toml"), ["robot1".to_owned()]).expect("can be written");
        let instance = Instance::new(root.path(), "w").expect("an instance");
        let offer = RoleLock::<Relay>::take(&instance).expect("nobody else has it");
        let _socket = UnixListener::bind(instance.relay_socket()).expect("can be bound");
        let mut standing = ListedRobot {
            was_heard: true,
            problem: None,
            bridge: None,
            worms: BTreeMap::from([("w".to_owned(), Some("it runs here".to_owned()))]),
        };
        list.tell("robot1", standing.clone()).expect("can be written");
        assert_eq!(
            offered_by(std::process::id(), &instance),
            None,
            "that relay is one of this computer"
        );
        standing.worms.insert("w".to_owned(), None);
        list.tell("robot1", standing).expect("can be written");

        let Err(RoleError::Offered(offered)) = RoleLock::<Controller>::take(&instance) else {
            panic!("it must be refused")
        };
        assert_eq!((offered.robot.as_str(), offered.pid), ("robot1", std::process::id()));
        assert!(offered.to_string().contains("--name"), "{offered}");
        RoleLock::<Recorder>::take(&instance).expect("what is offered may be recorded");
        let another = Instance::new(root.path(), "v").expect("an instance");
        RoleLock::<Controller>::take(&another).expect("the name is free");

        // As `wormd command` would, which finds no worm.
        drop(Hub::open(&instance).expect("opens"));
        assert!(instance.relay_socket().exists(), "its watchers still find it");
        drop(offer);
        drop(RoleLock::<Controller>::take(&instance).expect("it is not offered any more"));
        drop(Hub::open(&instance).expect("opens"));
        assert!(!instance.relay_socket().exists(), "nobody listens there");
    }
}
