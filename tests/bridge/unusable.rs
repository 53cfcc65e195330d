//! What a bridge or a fleet cannot work with is refused at once, with the reason.

use super::{PATIENCE, Robot, bridge_toml, path};

#[test]
fn what_is_open_or_unusable_ends_with_exit_status_2() {
    let robot = Robot::start("b-args", None);
    let good = bridge_toml(robot.worm.name(), "127.0.0.1", robot.port);
    let folder = robot.files.path();
    std::fs::write(folder.join("empty.pem"), "").expect("can be written");
    std::fs::copy(folder.join("keys/robot1.key"), folder.join("open.key")).expect("can be copied");
    let open = std::os::unix::fs::PermissionsExt::from_mode(0o644);
    std::fs::set_permissions(folder.join("open.key"), open).expect("can be set");
    for (from, to, part) in [
        ("authority = 'keys/ca.pem'", "", "authority is missing"),
        ("certificate = 'keys/robot1.pem'", "", "certificate is missing"),
        ("key = 'keys/robot1.key'", "", "key is missing"),
        ("keys/ca.pem", "keys/none.pem", "No such file"),
        ("keys/ca.pem", "empty.pem", "no certificate in PEM"),
        ("keys/robot1.key", "keys/robot1.pem", "no private key"),
        ("keys/robot1.key", "open.key", "chmod 600"),
        ("keys/robot1.key", "keys/none.key", "give its path"),
        (
            "keys/robot1.key",
            "keys/anna.key",
            "keys/anna.key does not belong to certificate ",
        ),
        ("keys/robot1", "keys/anna", "needs a robot's"),
        ("keys/ca.pem", "foreign/ca.pem", "is not signed by authority "),
        ("listen = [", "listen = [] #", "listen is missing"),
        ("tls/127", "tcp/127", "no address of TLS"),
        ("drive = ['anna']\nwatch = ['hall']", "", "nobody could connect"),
        ("'anna'", "'*'", "no usable name"),
        ("'anna'", "'robot1'", "own certificate"),
        ("'anna'", "'hall'", "twice"),
        ("[access]", "scouting = true\n[access]", "unknown field"),
        ("[[worms]]", "[[worms]] #", "in use"),
        (
            "[[worms]]",
            "[[worms]]\nconfig = 'none.toml'",
            "none.toml: No such file or directory (os error 2): name the file",
        ),
        (robot.worm.name(), "Not A Name", "worm.name"),
    ] {
        let text = match from {
            "keys/robot1" => good.replace(from, to),
            _ => good.replacen(from, to, 1),
        };
        let file = folder.join("wrong.toml");
        std::fs::write(&file, &text).expect("can be written");
        let output = robot.worm.plain_wormd(&["bridge", "--config", path(&file)]).output();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{to:?}: {said}");
        assert!(said.contains(part), "{to:?}: {said}");
        // What is wrong with the address shows only where it is listened at, and a worm's other bridge is no fault of the file.
        if part != "in use" {
            let output = robot
                .worm
                .plain_wormd(&["bridge", "--check", "--config", path(&file)])
                .output();
            assert_eq!(output.status.code(), Some(2), "--check, {to:?}: {output:?}");
        }
    }
    // The laptop's side, with everything of one kind exchanged.
    let fleet = "certificate = 'keys/anna.pem'\nkey = 'keys/anna.key'\nauthority = 'keys/ca.pem'\n[[robots]]\nname = 'robot1'\n\
                 connect = 'tls/127.0.0.1:1'\n";
    for (from, to, part) in [
        ("anna.key", "hall.key", "keys/hall.key does not belong to certificate "),
        ("keys/anna", "keys/robot1", "needs a laptop's"),
        ("keys/ca.pem", "foreign/ca.pem", "is not signed by authority "),
        ("keys/anna", "foreign/anna", "is not signed by authority "),
        ("keys/ca.pem", "foreign/both.pem", ""),
    ] {
        let file = folder.join("wrong-fleet.toml");
        std::fs::write(&file, fleet.replace(from, to)).expect("can be written");
        let output = robot
            .worm
            .plain_wormd(&["fleet", "--check", "--config", path(&file)])
            .output();
        let said = String::from_utf8_lossy(&output.stderr);
        let code = if part.is_empty() { 0 } else { 2 };
        assert_eq!(output.status.code(), Some(code), "{to:?}: {said}");
        assert!(said.contains(part), "{to:?}: {said}");
    }
    for (arguments, part) in [
        (["bridge", "--config", "/nonexistent.toml"], "/nonexistent.toml"),
        (["fleet", "--config", "/nonexistent.toml"], "/nonexistent.toml"),
    ] {
        let output = robot.worm.plain_wormd(&arguments).output();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(part), "{said}");
    }
    // And the bridge that was there has noticed nothing.
    let anna = robot.laptop("keys", "anna");
    anna.watch("anna").hello(PATIENCE);
}
