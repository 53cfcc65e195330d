//! What the page about all worms says of robots and worms that nobody reaches, and that names which are taken stay taken.

use super::http::{Reply, request};
use super::process::{Process, wait_for};
use super::{Laptop, PATIENCE, Robot, bridge_toml, free_port, make_keys, path};
use nix::sys::signal::Signal;
use serde_json::Value;
use std::net::SocketAddr;
use std::path::PathBuf;

/// A laptop with a dashboard, which is to know two robots.
struct Desk<'a> {
    robot: &'a Robot<'a>,
    laptop: Laptop,
    /// The configuration of a worm of this laptop.
    config: PathBuf,
    address: SocketAddr,
    _dashboard: Process,
}

impl<'a> Desk<'a> {
    fn new(robot: &'a Robot<'a>, second_port: u16) -> Self {
        let second = format!("[[robots]]\nname = 'robot2'\nconnect = 'tls/127.0.0.1:{second_port}'\n");
        let laptop = robot.laptop_with("keys", "anna", &second, &[]);
        let root = laptop.root.path();
        let config = robot.files.path().join("laptop.toml");
        std::fs::write(&config, format!("[topics]\nroot = '{}'\n", root.display())).expect("can be written");
        let address = SocketAddr::from(([127, 0, 0, 1], free_port()));
        let listen = address.to_string();
        let arguments = ["dashboard", "--config", path(&config), "--listen", &listen];
        let dashboard = robot.worm.wormd(&arguments).start();
        Self {
            robot,
            config,
            address,
            _dashboard: dashboard,
            laptop,
        }
    }

    /// HOLD ALL: the status, and what became of each.
    fn hold(&self) -> (u16, Vec<Held>) {
        let reply = request(self.address, "POST", "/api/fleet/hold", &[], "");
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let held = worms(&reply).into_iter().map(|held| Held {
            name: text(&held["name"]).expect("a name"),
            robot: text(&held["robot"]),
            is_answered: held["verdict"] != "no-answer",
            why: text(&held["refusal"]).unwrap_or_default(),
        });
        (reply.status, held.collect())
    }

    /// Waits until the page shows this many entries, and one of this robot for this reason.
    fn wait_for(&self, entries: usize, robot: &str, why: &str) {
        wait_for(why, PATIENCE, || {
            let shown = worms(&request(self.address, "GET", "/api/fleet", &[], ""));
            let is_it = |worm: &Value| {
                let problem = worm["problem"].as_str().unwrap_or_default();
                worm["robot"] == robot && problem.contains(why)
            };
            shown.len() == entries && shown.iter().any(is_it)
        });
    }

    fn wormd_fails(&self, arguments: &[&str]) -> String {
        let arguments = [arguments, &["--config", path(&self.config)]].concat();
        let output = self.robot.worm.wormd(&arguments).output();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{said}");
        said
    }
}

/// What became of one.
#[derive(Debug)]
struct Held {
    name: String,
    /// Of what is not reached.
    robot: Option<String>,
    is_answered: bool,
    why: String,
}

/// Robot and outcome of each, where they are about this worm.
fn outcomes<'a>(held: &'a [Held], name: &str) -> Vec<(Option<&'a str>, bool)> {
    let held = held.iter().filter(|it| it.name == name);
    held.map(|it| (it.robot.as_deref(), it.is_answered)).collect()
}

fn worms(reply: &Reply) -> Vec<Value> {
    reply.json()["worms"].as_array().cloned().expect("a list")
}

#[test]
fn two_computers_with_one_certificate_are_not_taken_for_one_robot() {
    let robot = Robot::start("b-same", None);
    let name = robot.worm.name();
    let desk = Desk::new(&robot, free_port());
    wait_for("the worm is offered", PATIENCE, || desk.laptop.socket.exists());
    desk.wait_for(2, "robot2", "never reached");
    let write = |file: &str, text: &str| {
        let file = robot.files.path().join(file);
        std::fs::write(&file, text).expect("can be written");
        file
    };
    let first = std::fs::read_to_string(robot.files.path().join("keys-anna.toml")).expect("the laptop has it");
    let (first, _) = first.split_once("[[robots]]\nname = 'robot2'").expect("two robots");

    // A second fleet process that hears the same bridge changes nothing of that.
    let same = write("same.toml", first);
    let again = robot.worm.plain_wormd(&["fleet", "--config", path(&same)]).start();
    let its_list = format!("fleet-{}-", again.id());
    wait_for("it has heard the robot", PATIENCE, || {
        let mut entries = std::fs::read_dir(desk.laptop.root.path()).expect("is there").flatten();
        let list = entries.find(|entry| entry.file_name().to_string_lossy().starts_with(&its_list));
        list.and_then(|list| std::fs::read_to_string(list.path()).ok())
            .is_some_and(|text| text.contains("offers"))
    });
    desk.wait_for(2, "robot2", "never reached");
    again.end();

    // Another computer with a copy of the keys, and a worm of the same name.
    let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
    let rooted = write("rooted.toml", &format!("[topics]\nroot = '{}'\n", path(root.path())));
    let port = free_port();
    let toml = bridge_toml(name, "127.0.0.1", port) + &format!("config = '{}'\n", path(&rooted));
    let bridge = write("copy.toml", &toml);
    let _bridge = robot.worm.plain_wormd(&["bridge", "--config", path(&bridge)]).start();
    let to_copy = first.replace(&robot.port.to_string(), &port.to_string());
    let to_copy = write("to-copy.toml", &to_copy);
    let _fleet = robot.worm.plain_wormd(&["fleet", "--config", path(&to_copy)]).start();
    desk.wait_for(3, "robot1", "by the same certificate");
    let (status, held) = desk.hold();
    assert_eq!(status, 503, "{held:?}");
    assert_eq!(outcomes(&held, name), [(None, true), (Some("robot1"), false)]);
}

#[test]
fn what_is_not_reached_is_shown_and_named_and_never_counts_as_held() {
    let robot = Robot::start("b-page", None);
    make_keys(robot.files.path(), "keys robot robot2 127.0.0.1");
    let second_port = free_port();
    let desk = Desk::new(&robot, second_port);
    let name = robot.worm.name();
    wait_for("the worm is offered", PATIENCE, || desk.laptop.socket.exists());

    wait_for("its relay is heard", PATIENCE, || {
        let shown = worms(&request(desk.address, "GET", "/api/fleet", &[], ""));
        shown
            .iter()
            .any(|worm| worm["name"] == name && worm["mode"] == "disarmed" && worm["robot"] == "robot1")
    });

    // A robot that is switched off.
    desk.wait_for(2, "robot2", "never reached");
    let (status, held) = desk.hold();
    assert_eq!(status, 503, "{held:?}");
    assert_eq!(outcomes(&held, name), [(None, true)]);
    assert_eq!(outcomes(&held, "robot2"), [(Some("robot2"), false)]);
    let whys = held.iter().map(|it| it.why.as_str()).collect::<String>();
    assert!(
        whys.contains("never reached") && whys.contains("cannot be held"),
        "{whys}"
    );

    // It comes, with a worm of the same name: another computer has other folders. (A longer root is refused.)
    let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
    let elsewhere = robot.files.path().join("elsewhere.toml");
    std::fs::write(&elsewhere, format!("[topics]\nroot = '{}'\n", path(root.path()))).expect("can be written");
    let config = robot.files.path().join("second.toml");
    let toml = bridge_toml(name, "127.0.0.1", second_port).replace("robot1", "robot2");
    std::fs::write(&config, toml + &format!("config = '{}'\n", path(&elsewhere))).expect("can be written");
    let second = robot.worm.plain_wormd(&["bridge", "--config", path(&config)]).start();
    desk.wait_for(2, "robot2", "robot1 has a worm");
    let (status, held) = desk.hold();
    assert_eq!(status, 503, "{held:?}");
    assert_eq!(outcomes(&held, name), [(None, true), (Some("robot2"), false)]);

    // A worm of the laptop under the name that is taken, and what finds nothing but the offer.
    for arguments in [&["control", "--port", "/nonexistent"][..], &["estimate"], &["up"]] {
        let said = desk.wormd_fails(arguments);
        assert!(
            said.contains("robot1") && said.contains("--name"),
            "{arguments:?}: {said}"
        );
    }
    let said = desk.wormd_fails(&["command", "hold"]);
    assert!(
        said.contains("is a worm of robot1") && said.contains("wormd watch"),
        "{said}"
    );
    let offered = std::fs::symlink_metadata(&desk.laptop.socket).expect("it is still there");

    // Somebody removes it.
    std::fs::remove_file(&desk.laptop.socket).expect("can be removed");
    let inode = |metadata: &std::fs::Metadata| std::os::unix::fs::MetadataExt::ino(metadata);
    wait_for("it is there again", PATIENCE, || {
        desk.laptop
            .socket
            .symlink_metadata()
            .is_ok_and(|it| inode(&it) != inode(&offered))
    });
    let mut watcher = desk.laptop.watch("anna");
    watcher.hello(PATIENCE);
    watcher.ask("hold", PATIENCE);

    // Nothing vanishes with a fleet process that is killed.
    second.end();
    desk.laptop.process.signal(Signal::SIGKILL);
    desk.wait_for(2, "robot1", "was killed");
    let (status, held) = desk.hold();
    assert_eq!(status, 503, "{held:?}");
    assert_eq!(
        outcomes(&held, name),
        [(Some("robot1"), false), (Some("robot2"), false)]
    );
    // Neither does the page of that worm: it may be crawling.
    let held = request(desk.address, "POST", "/api/command/hold", &[], "");
    assert_eq!(held.status, 503, "{held:?}");
    assert!(held.body.contains("cannot be held from here"), "{held:?}");
}
