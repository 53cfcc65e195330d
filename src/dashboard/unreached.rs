//! Robots and worms that a fleet process of this computer is there for, and that nobody can hold from here.

use crate::topics::fleet_list::{FleetList, FoundList, ListedRobot, read_all_and_damaged};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A worm of a robot that is not to be reached from this computer, or a robot of which no worm is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Unreached {
    /// The worm; the robot where none of its worms is known.
    pub(super) name: String,
    /// The robot.
    pub(super) robot: String,
    /// Why, and what to do.
    pub(super) problem: String,
}

/// What the lists in the folder of all worms name, and nobody reaches: `is_reached` says whether a process offers a worm here.
pub(super) fn find(root: &Path, is_reached: impl Fn(&str, u32) -> bool) -> Vec<Unreached> {
    let (lists, damaged) = read_all_and_damaged(root);
    let (alive, dead): (Vec<_>, Vec<_>) = lists.into_iter().partition(FoundList::is_alive);
    let standings = || {
        let lists = alive.iter().map(|found| &found.list);
        lists.flat_map(|list| list.robots.iter().map(move |(robot, standing)| (list, robot, standing)))
    };
    // Two fleet processes may be there for one robot, by whichever bridge proves itself as it.
    let mut heard = BTreeSet::new();
    let mut reached = BTreeMap::new();
    for (list, robot, standing) in standings() {
        if standing.was_heard {
            heard.insert(robot);
        }
        let worms = standing.worms.iter();
        let offered = worms.filter(|(worm, problem)| problem.is_none() && is_reached(worm, list.pid));
        reached.extend(offered.map(|(worm, _)| ((robot, worm), standing.bridge.as_deref())));
    }
    let mut found = BTreeMap::new();
    for (list, robot, standing) in standings() {
        if !heard.contains(robot) {
            found.insert((robot, robot), never_reached(list, robot, standing));
        }
        for (worm, problem) in &standing.worms {
            let why = match reached.get(&(robot, worm)) {
                Some(bridge) if is_same_bridge(*bridge, standing.bridge.as_deref()) => continue,
                Some(_) => {
                    "another computer, or another bridge of it, proves itself by the same certificate, and its worm of this name is \
                            the one that is offered here: give each robot keys of its own (make-keys)"
                }
                None => problem
                    .as_deref()
                    .unwrap_or("`wormd fleet` offers it in another folder, or takes nobody at its socket"),
            };
            let why = format!("{worm} of {robot} cannot be held from here: {why}");
            found.insert((robot, worm), why);
        }
    }
    // What a process that is there says of a robot counts, and not what a killed one has left.
    let known: BTreeSet<_> = standings().map(|(_, robot, _)| robot).collect();
    for left in &dead {
        for (robot, standing) in left.list.robots.iter().filter(|(robot, _)| !known.contains(robot)) {
            let is_unknown = standing.worms.is_empty();
            for name in standing.worms.keys().chain(is_unknown.then_some(robot)) {
                found.insert((robot, name), was_killed(left, robot, name));
            }
        }
    }
    let unreached = found.into_iter().map(|((robot, name), problem)| Unreached {
        name: name.clone(),
        robot: robot.clone(),
        problem,
    });
    unreached.chain(damaged.iter().map(|file| of_damaged(file))).collect()
}

/// Robots of which nobody knows which they are.
fn of_damaged(file: &Path) -> Unreached {
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Unreached {
        robot: name.clone(),
        name,
        problem: format!(
            "{} should be the list of a `wormd fleet` process and is damaged, or of another version: its robots are not known, and cannot be \
             held from here. Start that process again with this version, and remove the file",
            file.display()
        ),
    }
}

/// Whether two processes hear the same bridge, as far as that is known.
fn is_same_bridge(one: Option<&str>, other: Option<&str>) -> bool {
    one.zip(other).is_none_or(|(one, other)| one == other)
}

fn never_reached(list: &FleetList, robot: &str, standing: &ListedRobot) -> String {
    let why = standing.problem.as_deref().unwrap_or("nothing was heard of it yet");
    format!(
        "{robot} was never reached since `wormd fleet` (process {}) began, and cannot be held from here: {why}",
        list.pid
    )
}

fn was_killed(left: &FoundList, robot: &str, name: &str) -> String {
    let whose = if name == robot {
        String::new()
    } else {
        format!(" of {robot}")
    };
    format!(
        "{name}{whose} cannot be held from here: `wormd fleet` (process {}) was killed. Start it again (`wormd fleet --config {}`), or \
         remove {} where nobody needs its robots any more",
        left.list.pid,
        left.list.config.display(),
        left.file.display()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::PublishedList;
    use crate::topics::fleet_list::read_all;

    fn standing(worms: &[(&str, Option<&str>)]) -> ListedRobot {
        let worms = worms
            .iter()
            .map(|(worm, problem)| ((*worm).to_owned(), problem.map(str::to_owned)));
        ListedRobot {
            was_heard: true,
            worms: worms.collect(),
            ..ListedRobot::default()
        }
    }

    /// As a killed process leaves it: nobody has it open.
    fn leave(root: &Path, name: &str, robots: &[(&str, ListedRobot)]) {
        let robots = robots
            .iter()
            .map(|(robot, standing)| ((*robot).to_owned(), standing.clone()));
        let list = FleetList {
            pid: std::process::id(),
            config: "/etc/fleet.toml".into(),
            robots: robots.collect(),
        };
        let text = serde_json::to_vec(&list).expect("JSON");
        std::fs::write(root.join(name), text).expect("can be written");
    }

    #[test]
    fn what_nobody_reaches_is_named_with_the_reason() {
        let folder = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let root = folder.path();
        let find_all = || {
            let found = find(root, |worm, pid| worm == "w" && pid == std::process::id());
            found
                .into_iter()
                .map(|it| ((it.robot, it.name), it.problem))
                .collect::<Vec<_>>()
        };
        let key = |robot: &str, name: &str| (robot.to_owned(), name.to_owned());
        assert!(find_all().is_empty());

        let text = root.to_str().expect("is text");
        let robots = ["robot1", "robot2", "robot3"].map(str::to_owned);
        let list = PublishedList::publish(text, Path::new("/etc/fleet.toml"), robots).expect("can be written");
        assert_eq!(find_all().len(), 3, "none was heard");
        list.tell("robot1", standing(&[("w", None)])).expect("can be written");
        list.tell("robot2", standing(&[("w", Some("robot1 has a worm w, too"))]))
            .expect("can be written");
        let silent = ListedRobot {
            problem: Some("it may be switched off".to_owned()),
            ..ListedRobot::default()
        };
        list.tell("robot3", silent).expect("can be written");
        let found = find_all();
        let keys: Vec<_> = found.iter().map(|(key, _)| key.clone()).collect();
        assert_eq!(keys, [key("robot2", "w"), key("robot3", "robot3")]);
        assert!(found[0].1.contains("robot1 has a worm w, too"), "{found:?}");
        assert!(
            found[1].1.contains("never reached") && found[1].1.contains("switched off"),
            "{found:?}"
        );

        // What a killed process has left: of a robot that another one is there for, only that one speaks.
        leave(
            root,
            "fleet-7-1.json",
            &[
                ("robot1", standing(&[("old", None)])),
                ("robot4", standing(&[("v", None)])),
            ],
        );
        leave(root, "fleet-7-2.json", &[("robot5", ListedRobot::default())]);
        let keys: Vec<_> = find_all().into_iter().map(|(key, _)| key).collect();
        let killed = [key("robot4", "v"), key("robot5", "robot5")];
        assert_eq!(keys[2..], killed);
        // What is no file is no list; one that is damaged may be about any robot.
        std::fs::create_dir(root.join("fleet-y.json")).expect("can be made");
        drop(list);
        assert_eq!(find_all().len(), 3, "{:?}", find_all());
        std::fs::write(root.join("fleet-x.json"), "{").expect("can be written");
        let found = find_all();
        assert_eq!(found.len(), 4, "{found:?}");
        let (damaged, problem) = &found[3];
        assert_eq!(damaged, &key("fleet-x.json", "fleet-x.json"));
        assert!(problem.contains("is damaged"), "{problem}");
    }

    #[test]
    fn a_fleet_process_takes_away_what_a_killed_one_left_when_it_is_there_for_the_same_robots() {
        let folder = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let root = folder.path();
        leave(root, "fleet-7-1.json", &[("robot1", ListedRobot::default())]);
        leave(
            root,
            "fleet-7-2.json",
            &[("robot1", ListedRobot::default()), ("robot2", ListedRobot::default())],
        );
        let text = root.to_str().expect("is text");
        let list =
            PublishedList::publish(text, Path::new("fleet.toml"), ["robot1".to_owned()]).expect("can be written");
        assert!(!root.join("fleet-7-1.json").exists() && root.join("fleet-7-2.json").exists());
        drop(list);
        assert_eq!(read_all(root).len(), 1, "its own is gone");
    }
}
