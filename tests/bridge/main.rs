//! `wormd bridge` and `wormd fleet` from outside: real processes, real certificates, and a network between them that loses and delays.

mod fleet_page;
#[path = "../dashboard/http.rs"]
#[allow(dead_code, reason = "of another test binary, without its browser")]
mod http;
mod network;
#[path = "../processes/process.rs"]
#[allow(
    dead_code,
    reason = "the harness of another test binary, of which this one uses a part"
)]
mod process;
mod record;
mod refusals;
mod second_bridge;
mod unusable;
mod watcher;
#[path = "../processes/worm.rs"]
#[allow(
    dead_code,
    reason = "the harness of another test binary, of which this one uses a part"
)]
mod worm;

use network::{ROBOT, TwoComputers};
use process::{Invocation, Process, wait_for};
use serde_json::{Value, json};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};
use watcher::Watcher;
use worm::Worm;
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};
use zenoh::Wait;

const PATIENCE: Duration = Duration::from_secs(40);

/// Slow enough for a busy computer: what is tested is the network.
const WORM_CONFIG: &str = "[control]\nrate_hz = 100.0\n";

/// A robot with a worm at rest, and the files of all who may or may not watch it.
struct Robot<'a> {
    worm: Worm,
    files: tempfile::TempDir,
    network: Option<&'a TwoComputers>,
    port: u16,
    processes: Vec<Process>,
}

impl<'a> Robot<'a> {
    fn start(name: &str, network: Option<&'a TwoComputers>) -> Self {
        let worm = Worm::on_a_steady_computer(name);
        let files = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        for arguments in [
            "keys authority",
            "keys robot robot1 10.77.0.1 127.0.0.1",
            "keys laptop anna",
            "keys laptop hall",
            "keys laptop nobody",
            "foreign authority",
            "foreign laptop anna",
        ] {
            make_keys(files.path(), arguments);
        }
        // A stranger trusts both, or would refuse its own certificate.
        let authorities = ["keys", "foreign"].map(|folder| std::fs::read(files.path().join(folder).join("ca.pem")));
        let authorities = authorities.map(|text| text.expect("was made")).concat();
        std::fs::write(files.path().join("foreign/both.pem"), authorities).expect("can be written");
        let port = free_port();
        let host = if network.is_some() { ROBOT } else { "127.0.0.1" };
        let config = files.path().join("bridge.toml");
        let worm_config = worm.config(WORM_CONFIG);
        let text = bridge_toml(worm.name(), host, port) + &format!("config = '{worm_config}'\n");
        std::fs::write(&config, text).expect("can be written");
        let within = |invocation: Invocation| match network {
            Some(network) => invocation.in_network(&network.robot),
            None => invocation,
        };
        let virtual_worm =
            within(worm.plain_wormd(&["virtual-worm", "--config", &worm_config, "--link", &worm.port()])).start();
        let estimator = within(worm.wormd(&["estimate", "--config", &worm_config])).start();
        let controller = within(worm.wormd(&["control", "--config", &worm_config, "--port", &worm.port()])).start();
        let bridge = within(worm.plain_wormd(&["-v", "bridge", "--config", path(&config)])).start();
        Self {
            worm,
            files,
            network,
            port,
            // The bridge ends first.
            processes: vec![bridge, controller, estimator, virtual_worm],
        }
    }

    /// A laptop with these files, whose worms are in a folder of its own.
    fn laptop(&self, keys: &str, certificate: &str) -> Laptop {
        self.laptop_with(keys, certificate, "", &[])
    }

    fn laptop_with(&self, keys: &str, certificate: &str, more: &str, environment: &[(&str, &str)]) -> Laptop {
        let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let host = if self.network.is_some() { ROBOT } else { "127.0.0.1" };
        let config = self.files.path().join(format!("{keys}-{certificate}.toml"));
        let authority = if keys == "keys" {
            "keys/ca.pem"
        } else {
            "foreign/both.pem"
        };
        let text = format!(
            "certificate = '{keys}/{certificate}.pem'\nkey = '{keys}/{certificate}.key'\nauthority = '{authority}'\nroot = '{}'\n\
             [[robots]]\nname = 'robot1'\nconnect = 'tls/{host}:{}'\n{more}",
            root.path().display(),
            self.port
        );
        std::fs::write(&config, text).expect("can be written");
        let mut fleet = self.worm.plain_wormd(&["-v", "fleet", "--config", path(&config)]);
        if let Some(network) = self.network {
            fleet = fleet.in_network(&network.laptop);
        }
        for (name, value) in environment {
            fleet = fleet.with_environment(name, value);
        }
        Laptop {
            socket: root.path().join(self.worm.name()).join("relay.sock"),
            process: fleet.start(),
            root,
        }
    }

    fn bridge(&mut self) -> &mut Process {
        &mut self.processes[0]
    }

    fn mode(&self) -> Option<Mode> {
        self.worm.state().and_then(|state| Mode::try_from(state.mode).ok())
    }

    fn wait_for_mode(&self, mode: Mode) {
        wait_for(mode.name(), PATIENCE, || self.mode() == Some(mode));
    }
}

/// A laptop, by its fleet process.
struct Laptop {
    socket: PathBuf,
    process: Process,
    root: tempfile::TempDir,
}

impl Laptop {
    /// Why it does not hear the robot, as it leaves that for the page about all worms.
    fn problem(&self) -> Option<String> {
        let mut entries = std::fs::read_dir(self.root.path()).ok()?.flatten();
        let list = entries.find(|entry| entry.file_name().as_encoded_bytes().ends_with(b".json"))?;
        let list: Value = serde_json::from_slice(&std::fs::read(list.path()).ok()?).ok()?;
        list["robots"]["robot1"]["problem"].as_str().map(str::to_owned)
    }

    fn watch(&self, name: &str) -> Watcher {
        wait_for("the worm is offered", PATIENCE, || self.socket.exists());
        Watcher::connect(&self.socket, name)
    }
}

fn free_port() -> u16 {
    let free = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    free.local_addr().expect("is bound").port()
}

fn path(path: &Path) -> &str {
    path.to_str().expect("is text")
}

/// By the script that users have.
fn make_keys(folder: &Path, arguments: &str) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/bridge/make-keys");
    let output = Command::new(script)
        .args(arguments.split(' '))
        .current_dir(folder)
        .output()
        .expect("the script runs");
    assert!(output.status.success(), "{arguments}: {output:?}");
}

fn bridge_toml(worm: &str, host: &str, port: u16) -> String {
    format!(
        "certificate = 'keys/robot1.pem'\nkey = 'keys/robot1.key'\nauthority = 'keys/ca.pem'\nlisten = ['tls/{host}:{port}']\n\
         [access]\ndrive = ['anna']\nwatch = ['hall']\n[[worms]]\nname = '{worm}'\n"
    )
}

fn state_mode(frame: &Value) -> &str {
    frame["state"]["mode"].as_str().unwrap_or_default()
}

#[test]
fn over_a_link_that_loses_and_delays_a_worm_is_seen_driven_and_halted() {
    let Some(network) = TwoComputers::new(Duration::from_millis(60), 0.01, 7) else {
        return;
    };
    let robot = Robot::start("b-link", Some(&network));
    let anna = robot.laptop("keys", "anna");
    let hall = robot.laptop("keys", "hall");
    let mut driver = anna.watch("at the desk");
    let mut passer_by = hall.watch("at the door");
    let hello = driver.hello(PATIENCE);
    assert_eq!(hello["worm"]["name"], robot.worm.name());
    let frame = driver.frame(PATIENCE, |frame| {
        frame["network"]["round_trip_ms"].as_u64() >= Some(120)
    });
    let status = &frame["network"];
    assert_eq!(
        (&status["robot"], &status["may_drive"]),
        (&json!("robot1"), &json!(true))
    );
    assert_eq!(status["boot_id"], hello["boot_id"]);
    passer_by.frame(PATIENCE, |frame| frame["network"]["may_drive"] == json!(false));

    // Who may only watch may halt, and nothing else.
    for command in ["arm", "crawl", "take_over", "stop", "reset"] {
        let answer = passer_by.ask(command, PATIENCE);
        assert_eq!(answer["verdict"], "not-permitted", "{answer}");
    }
    assert_eq!(driver.ask("arm", PATIENCE)["verdict"], "accepted");
    robot.wait_for_mode(Mode::Armed);
    // For longer than any single permission. Packets that are lost one after another may cost a driver the wheel now and then.
    let crawls = |driver: &mut Watcher| {
        assert_eq!(driver.ask("crawl", PATIENCE)["verdict"], "accepted");
        let crawling = driver.frame(PATIENCE, |frame| state_mode(frame) == "crawling");
        // Its own name, and that of the certificate, which cannot be another's.
        assert_eq!(crawling["driver"]["name"], "anna at the desk");
        driver.listen(Duration::from_secs(3));
        robot.mode() == Some(Mode::Crawling)
    };
    assert!((0..5).any(|_| crawls(&mut driver)), "it crawls for three seconds");
    let second = passer_by.ask("hold", PATIENCE);
    assert_eq!(second["verdict"], "accepted", "{second}");
    robot.wait_for_mode(Mode::Holding);
    driver.frame(PATIENCE, |frame| {
        let events = frame["events"].as_array().cloned().unwrap_or_default();
        events.iter().any(|event| {
            event["text"]
                .as_str()
                .is_some_and(|text| text.contains("hall at the door"))
        })
    });

    // A watcher that goes leaves a worm that holds.
    assert_eq!(driver.ask("crawl", PATIENCE)["verdict"], "accepted");
    drop(driver);
    robot.wait_for_mode(Mode::Holding);
    assert!(network.dropped() > 0, "the link has lost something");
}

#[test]
fn without_a_network_the_worm_holds_and_what_was_asked_meanwhile_is_never_done() {
    let Some(network) = TwoComputers::new(Duration::from_millis(20), 0.0, 11) else {
        return;
    };
    let robot = Robot::start("b-cut", Some(&network));
    let anna = robot.laptop("keys", "anna");
    let mut driver = anna.watch("anna");
    driver.hello(PATIENCE);
    assert_eq!(driver.ask("arm", PATIENCE)["verdict"], "accepted");
    for (outage, begins_anew) in [(Duration::from_secs(2), false), (Duration::from_secs(9), true)] {
        let asked = driver.ask("crawl", PATIENCE);
        assert_eq!(asked["verdict"], "accepted", "{asked}");
        robot.wait_for_mode(Mode::Crawling);
        let last = driver.frame(PATIENCE, |frame| state_mode(frame) == "crawling");
        let lost_before = last["network"]["frames_lost"].as_u64().expect("is counted");
        let cut = Instant::now();
        network.cut(true);
        robot.wait_for_mode(Mode::Holding);
        println!("held {:?} after the network had gone", cut.elapsed());
        assert!(cut.elapsed() < Duration::from_secs(4), "{:?}", cut.elapsed());
        // Pressed while nothing comes.
        driver.send("crawl");
        driver.listen(outage.saturating_sub(cut.elapsed()));
        network.cut(false);
        let joined = Instant::now();
        let back = driver.frame(PATIENCE, |frame| frame["number"].as_u64() > last["number"].as_u64());
        println!("seen again {:?} after the network was back", joined.elapsed());
        // The newest, and not what was waiting.
        assert!(back["age_ms"]["state"].as_u64() < Some(1000), "{back}");
        let fresh = driver.frame(PATIENCE, |frame| state_mode(frame) == "holding");
        let lost = fresh["network"]["frames_lost"].as_u64().expect("is counted");
        assert!(lost > lost_before, "{lost_before} and {lost} lost: {begins_anew}");
        assert!(driver.lost() > 0, "watchers are told how many frames were lost");
        driver.listen(Duration::from_secs(3));
        assert_eq!(robot.mode(), Some(Mode::Holding), "nothing moves by itself");
    }
    // And it can be driven again.
    assert_eq!(driver.ask("crawl", PATIENCE)["verdict"], "accepted");
    robot.wait_for_mode(Mode::Crawling);
    // A laptop whose process is killed.
    anna.process.signal(nix::sys::signal::Signal::SIGKILL);
    robot.wait_for_mode(Mode::Holding);
}

#[test]
fn strangers_get_nothing() {
    let robot = Robot::start("b-rogue", None);
    // One who may, so that it is not for want of a network.
    let anna = robot.laptop("keys", "anna");
    anna.watch("anna").hello(PATIENCE);
    // Connections that say nothing.
    let connect = |_| TcpStream::connect(("127.0.0.1", robot.port)).expect("the bridge listens");
    let silent: Vec<_> = (0..200).map(connect).collect();
    // Of another authority, and of the right one but with no rule.
    let strangers = [robot.laptop("foreign", "anna"), robot.laptop("keys", "nobody")];
    // By Zenoh itself, with a certificate that has no rule, and with one that may only watch.
    let keys = robot.files.path().join("keys");
    let heard = |certificate: &str| {
        let session = zenoh::open(rogue(&keys, certificate, robot.port))
            .wait()
            .expect("opens");
        let heard = session.declare_subscriber("**").wait().expect("a subscriber");
        let up = json!({
            "version": 1,
            "echo": null,
            "requests": [{"worm": robot.worm.name(), "watcher": 1, "name": certificate, "line": {"id": 1, "command": "hold"}}],
        });
        (session, heard, up.to_string())
    };
    let rogues = [heard("nobody"), heard("hall")];
    assert_eq!(robot.worm.order(CommandKind::Arm), CommandOutcome::Accepted);
    assert_eq!(robot.worm.order(CommandKind::Crawl), CommandOutcome::Accepted);
    robot.wait_for_mode(Mode::Crawling);
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(5) {
        for (session, heard, up) in &rogues {
            // As somebody who may.
            session
                .put("wormd/1/up/anna/rogue", up.clone())
                .wait()
                .expect("is sent");
            session
                .put("wormd/1/down/anna/rogue", up.clone())
                .wait()
                .expect("is sent");
            while let Some(got) = heard.try_recv().expect("is open") {
                // Zenoh gives a session what it sends itself.
                assert_eq!(got.payload().to_bytes(), up.as_bytes(), "{got:?}");
            }
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    assert_eq!(
        robot.mode(),
        Some(Mode::Crawling),
        "no stranger's hold has come through"
    );
    for (stranger, why) in strangers.iter().zip(["refuses the certificate", "[access]"]) {
        assert!(!stranger.socket.exists());
        wait_for(why, PATIENCE, || {
            stranger.problem().is_some_and(|problem| problem.contains(why))
        });
    }
    // Without any certificate the handshake fails. In TLS 1.3 the server says so only after the
    // client's side of the handshake is done: the client must stay to hear it, and it stays as
    // long as its input is open.
    let mut openssl = Command::new("timeout")
        .args(["20", "openssl", "s_client", "-connect"])
        .args([&format!("127.0.0.1:{}", robot.port), "-CAfile"])
        .arg(keys.join("ca.pem"))
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("openssl runs");
    let input = openssl.stdin.take();
    let output = openssl.wait_with_output().expect("openssl ends");
    drop(input);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("certificate required"), "{said}");
    // By now each of the silent ones has waited for longer than Zenoh itself would let it.
    let begun = Instant::now();
    robot.laptop("keys", "hall").watch("hall").hello(PATIENCE);
    assert!(begun.elapsed() < Duration::from_secs(8), "{:?}", begun.elapsed());
    drop(silent);
}

/// A peer of Zenoh's own, at the bridge.
fn rogue(keys: &Path, certificate: &str, port: u16) -> zenoh::Config {
    let text = json!({
        "mode": "peer",
        "connect": { "endpoints": [format!("tls/127.0.0.1:{port}")], "timeout_ms": 5000 },
        "listen": { "endpoints": [] },
        "scouting": { "multicast": { "enabled": false } },
        "transport": { "link": { "tls": {
            "root_ca_certificate": keys.join("ca.pem"),
            "enable_mtls": true,
            "connect_private_key": keys.join(format!("{certificate}.key")),
            "connect_certificate": keys.join(format!("{certificate}.pem")),
        } } },
    });
    zenoh::Config::from_json5(&text.to_string()).expect("a configuration")
}

#[test]
fn a_laptop_whose_clock_is_a_month_off_watches_and_drives() {
    let library = ["x86_64", "aarch64"]
        .map(|machine| PathBuf::from(format!("/usr/lib/{machine}-linux-gnu/faketime/libfaketime.so.1")))
        .into_iter()
        .find(|library| library.exists());
    let Some(library) = library else {
        println!("SKIPPED: no libfaketime (Debian: libfaketime)");
        return;
    };
    let robot = Robot::start("b-clock", None);
    for offset in ["+30d", "-30d"] {
        let environment = [
            ("LD_PRELOAD", path(&library)),
            ("FAKETIME", offset),
            ("FAKETIME_DONT_FAKE_MONOTONIC", "1"),
        ];
        let laptop = robot.laptop_with("keys", "anna", "", &environment);
        let mut driver = laptop.watch("anna");
        driver.hello(PATIENCE);
        let frame = driver.frame(PATIENCE, |_| true);
        assert!(frame["age_ms"]["state"].as_u64() < Some(1000), "{frame}");
        // Whoever drove before has just gone.
        assert_eq!(driver.ask("take_over", PATIENCE)["verdict"], "accepted");
        assert_eq!(driver.ask("arm", PATIENCE)["verdict"], "accepted");
        assert_eq!(driver.ask("crawl", PATIENCE)["verdict"], "accepted", "{offset}");
        robot.wait_for_mode(Mode::Crawling);
        driver.listen(Duration::from_secs(2));
        assert_eq!(robot.mode(), Some(Mode::Crawling), "{offset}");
        assert_eq!(driver.ask("stop", PATIENCE)["verdict"], "accepted");
        robot.wait_for_mode(Mode::Disarmed);
    }
}
