//! A worm has one bridge, and who starts another one hears which it is.

use super::process::Process;
use super::{PATIENCE, Robot, bridge_toml, free_port, path};

#[test]
fn a_second_bridge_of_a_worm_is_refused_and_the_first_goes_on() {
    let mut robot = Robot::start("b-two", None);
    let name = robot.worm.name().to_owned();
    let anna = robot.laptop("keys", "anna");
    let mut watcher = anna.watch("anna");
    let before = watcher.frame(PATIENCE, |_| true);

    let folder = robot.files.path().to_owned();
    let write = |file: &str, text: String| {
        let file = folder.join(file);
        std::fs::write(&file, text).expect("can be written");
        file
    };
    let other_port = free_port();
    let second = write("second.toml", bridge_toml(&name, "127.0.0.1", other_port));
    // As one of two worms, the other of which is free.
    let both = bridge_toml("another-worm", "127.0.0.1", free_port()) + &format!("[[worms]]\nname = '{name}'\n");
    let both = write("both.toml", both);
    let first_pid = robot.bridge().id();
    for config in [&second, &both] {
        let output = robot.worm.plain_wormd(&["bridge", "--config", path(config)]).output();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        for part in [
            format!("(process {first_pid}, listening at tls/127.0.0.1:{})", robot.port),
            format!("serves {name} already"),
            format!("kill {first_pid}"),
        ] {
            assert!(said.contains(&part), "{part}: {said}");
        }
    }
    // A check may be made beside it, and says so.
    let check = ["bridge", "--check", "--config", path(&second)];
    let output = robot.worm.plain_wormd(&check).output();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        said.contains(&format!("note: another `wormd bridge` (process {first_pid}, ")),
        "{said}"
    );
    watcher.frame(PATIENCE, |frame| {
        frame["number"].as_u64() > before["number"].as_u64().map(|number| number + 20)
    });
    assert_eq!(watcher.lost(), 0, "the first has gone on");

    // Neither another worm, which the refused bridge has let go, nor another root is the same.
    let start =
        |config: &std::path::Path| -> Process { robot.worm.plain_wormd(&["bridge", "--config", path(config)]).start() };
    let another_worm = write("another.toml", bridge_toml("another-worm", "127.0.0.1", free_port()));
    let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
    let rooted = write("rooted.toml", format!("[topics]\nroot = '{}'\n", path(root.path())));
    let another_root = bridge_toml(&name, "127.0.0.1", free_port()) + &format!("config = '{}'\n", path(&rooted));
    let another_root = write("root.toml", another_root);
    for free in [start(&another_worm), start(&another_root)] {
        free.end();
    }

    // What a killed one held is free at once.
    robot.bridge().kill();
    let begun = std::time::Instant::now();
    let next = robot.worm.plain_wormd(&["bridge", "--config", path(&second)]).start();
    println!("the next one was ready after {:?}", begun.elapsed());
    next.end();
}
