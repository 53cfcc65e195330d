//! A worm with a dashboard, as all of these tests have one, and what the dashboard tells.

use super::http::{Reply, request};
use super::process::{Process, wait_for};
use super::worm::Worm;
use super::{BEARER, PATIENCE, TOKEN};
use nix::sys::signal::Signal;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A dashboard that ends with the test, however that ends.
pub struct Dashboard(pub Child);

impl Dashboard {
    /// Ends it; its exit status.
    pub fn end(&mut self) -> Option<i32> {
        let _ = nix::sys::signal::kill(nix::unistd::Pid::from_raw(self.0.id() as i32), Signal::SIGTERM);
        self.0.wait().ok()?.code()
    }
}

impl Drop for Dashboard {
    fn drop(&mut self) {
        self.end();
    }
}

/// Starts a dashboard, of whose output only the first line is read: it says where it listens.
pub fn start(mut command: Command) -> (Dashboard, SocketAddr) {
    let mut dashboard = command.stdout(Stdio::piped()).spawn().expect("the binary starts");
    let mut line = String::new();
    BufReader::new(dashboard.stdout.take().expect("is piped"))
        .read_line(&mut line)
        .expect("it says where it is");
    let address = line
        .split_once("http://")
        .and_then(|(_, rest)| rest.trim().trim_end_matches('/').parse().ok());
    (Dashboard(dashboard), address.unwrap_or_else(|| panic!("{line:?}")))
}

/// A worm, at rest and disarmed, with a dashboard.
pub struct Watched {
    pub dashboard: Dashboard,
    pub address: SocketAddr,
    pub controller: Process,
    _estimator: Process,
    _virtual_worm: Process,
    pub worm: Worm,
    _root: tempfile::TempDir,
}

/// A worm with this folder for its topics, slow enough for others and browsers beside it on a busy computer: the dashboard is what is tested.
pub fn slow_worm(name: &str, root: &Path) -> Worm {
    let text = format!("[control]\nrate_hz = 100.0\n[topics]\nroot = \"{}\"\n", root.display());
    Worm::configured(name, &text)
}

impl Watched {
    /// The dashboard is there before its worm.
    pub fn start(name: &str) -> Self {
        // What holds all worms must not reach those of other tests.
        let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let worm = slow_worm(name, root.path());
        let arguments = ["dashboard", "--listen", "127.0.0.1:0"];
        let (dashboard, address) = start(
            worm.wormd(&arguments)
                .with_environment("WORMD_DASHBOARD_TOKEN", TOKEN)
                .into_command(),
        );
        assert_eq!(request(address, "GET", "/api/health", &[], "").json()["worm"], "absent");
        let virtual_worm = worm.virtual_worm(&["--allow-faults"]);
        let estimator = worm.wormd(&["estimate"]).start();
        let port = worm.port();
        let controller = worm.wormd(&["control", "--port", &port]).start();
        let watched = Self {
            dashboard,
            address,
            controller,
            _estimator: estimator,
            _virtual_worm: virtual_worm,
            worm,
            _root: root,
        };
        watched.wait_for_health("live");
        watched
    }

    pub fn get(&self, path: &str) -> Reply {
        request(self.address, "GET", path, &[], "")
    }

    pub fn post(&self, command: &str, headers: &[&str]) -> Reply {
        request(self.address, "POST", &format!("/api/command/{command}"), headers, "")
    }

    pub fn wait_for_health(&self, worm: &str) {
        wait_for(worm, PATIENCE, || self.get("/api/health").json()["worm"] == worm);
    }

    pub fn mode(&self) -> String {
        self.get("/api/state").json()["state"]["mode"]
            .as_str()
            .unwrap_or_default()
            .to_owned()
    }

    pub fn wait_for_mode(&self, mode: &str) {
        let begun = Instant::now();
        while self.mode() != mode {
            assert!(
                begun.elapsed() < PATIENCE,
                "waited in vain: {mode}; it is {}, after {:?}",
                self.get("/api/state").body,
                events(self)
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    pub fn arm(&self, client: &str) {
        assert_eq!(self.post("arm", &[BEARER, client]).status, 200);
        self.wait_for_mode("armed");
    }
}

/// Everything that was done, in words.
pub fn events(state: &Watched) -> Vec<String> {
    let hello = first_event(state.address);
    let events = hello["events"].as_array().expect("a list");
    events
        .iter()
        .filter_map(|event| event["text"].as_str().map(str::to_owned))
        .collect()
}

/// The history, which comes first in the stream.
pub fn first_event(address: SocketAddr) -> Value {
    let data = first_hello(address).1;
    serde_json::from_str(&data).expect("JSON on one line")
}

/// The number of the first event of the stream: when it was made, ms of the computer's clock.
pub fn first_id(address: SocketAddr) -> u64 {
    first_hello(address).0
}

fn first_hello(address: SocketAddr) -> (u64, String) {
    let mut stream = TcpStream::connect(address).expect("listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("can be set");
    stream
        .write_all(format!("GET /api/events HTTP/1.1\r\nHost: {address}\r\n\r\n").as_bytes())
        .expect("reads");
    let mut bytes = Vec::new();
    let mut piece = [0; 65_536];
    loop {
        let count = stream.read(&mut piece).expect("events");
        assert!(count > 0, "the stream goes on");
        bytes.extend_from_slice(&piece[..count]);
        let text = String::from_utf8_lossy(&bytes);
        let Some((before, rest)) = text.split_once("\nevent: hello\ndata: ") else {
            continue;
        };
        // Each event is a chunk of its own.
        if let Some((data, _)) = rest.split_once("\n\n") {
            let id = before.rsplit_once("id: ").and_then(|(_, id)| id.parse().ok());
            return (id.expect("a number"), data.to_owned());
        }
    }
}
