//! A worm under a name of its own, whose real processes a test starts. All of them pause together now and then, as on a computer that is
//! busy or whose host is.

use super::process::{Invocation, Process, wait_for};
use dynamixel_bus::packet::DeviceId;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use testkit::process_pauses::{HostPauses, Pause};
use worm_estimator::config::Config;
use worm_estimator::message::{Command as Order, CommandKind, CommandOutcome, Mode, State};
use wormd::link::{Tty, WormBus};
use wormd::topics::{CommandClient, Hub, Instance, Subscriber};

/// One worm on this computer, with a folder for its files.
pub struct Worm {
    name: String,
    folder: tempfile::TempDir,
    /// The configuration file of all its processes, where it has one.
    config: Option<String>,
    receiver: Mutex<Option<TelemetryReceiver>>,
    pauses: Option<Arc<HostPauses>>,
}

/// How long pauses are, and how far apart, ms.
const PAUSE_MS: std::ops::Range<u64> = 20..300;
const BETWEEN_PAUSES_MS: std::ops::Range<u64> = 400..1500;

/// Ports of the test itself. They belong to one thread; a test is one.
struct TelemetryReceiver {
    client: CommandClient,
    states: Subscriber<State>,
    newest: Option<State>,
}

impl Worm {
    /// A worm whose name no other test, nor another run of this test, has.
    pub fn new(name: &str) -> Self {
        Self::with_pauses(name, Pause::Together(PAUSE_MS))
    }

    /// The same with other pauses than those of the whole computer.
    pub fn with_pauses(name: &str, kind: Pause) -> Self {
        let seed = name.bytes().map(u64::from).sum();
        println!("{name}: pauses with seed {seed}");
        Self {
            pauses: Some(Arc::new(HostPauses::start(vec![kind], BETWEEN_PAUSES_MS, seed))),
            ..Self::on_a_steady_computer(name)
        }
    }

    /// The same without pauses, for what measures the computer.
    pub fn on_a_steady_computer(name: &str) -> Self {
        let name = format!("{name}-{}", std::process::id() % 100_000);
        let folder = tempfile::tempdir().expect("a temporary folder");
        Self {
            name,
            folder,
            config: None,
            receiver: Mutex::new(None),
            pauses: None,
        }
    }

    /// A worm whose processes all have this configuration, on a steady computer.
    #[allow(dead_code, reason = "the tests of the dashboard, which share this harness, need it")]
    pub fn configured(name: &str, text: &str) -> Self {
        let mut worm = Self::on_a_steady_computer(name);
        worm.config = Some(worm.config(text));
        worm
    }

    /// Where its topics are.
    pub fn instance(&self) -> Instance {
        let mut config = match &self.config {
            Some(file) => Config::load(Path::new(file)).expect("a configuration"),
            None => Config::default(),
        };
        config.worm.name.clone_from(&self.name);
        Instance::of(&config).expect("the topics' root can be used")
    }

    /// The virtual worm's port.
    pub fn port(&self) -> String {
        self.folder.path().join("port").to_string_lossy().into_owned()
    }

    /// A configuration file with this text.
    pub fn config(&self, text: &str) -> String {
        let path = self.folder.path().join("worm.toml");
        std::fs::write(&path, text).expect("a temporary file can be written");
        path.to_string_lossy().into_owned()
    }

    /// `wormd` with these arguments alone.
    #[allow(
        dead_code,
        reason = "the tests of dashboard and bridge, which share this harness, need it"
    )]
    pub fn plain_wormd(&self, arguments: &[&str]) -> Invocation {
        Invocation::new(arguments, self.pauses.clone())
    }

    /// `wormd` with these arguments and this worm's name.
    pub fn wormd(&self, arguments: &[&str]) -> Invocation {
        let mut named = [arguments, &["--name", &self.name]].concat();
        if let Some(config) = &self.config {
            named.extend(["--config", config]);
        }
        Invocation::new(&named, self.pauses.clone())
    }

    /// The output of `wormd replay --json` for a log.
    pub fn replay(&self, log: &str) -> Output {
        Invocation::new(&["replay", "--json", log], None).output()
    }

    /// The virtual worm, ready.
    pub fn virtual_worm(&self, more: &[&str]) -> Process {
        let port = self.port();
        let mut arguments = vec!["virtual-worm", "--link", &port];
        arguments.extend(more);
        if let Some(config) = &self.config {
            arguments.extend(["--config", config]);
        }
        Invocation::new(&arguments, self.pauses.clone()).start()
    }

    /// The bus of the virtual worm, for other clients than the controller.
    pub fn bus(&self) -> (WormBus<Tty>, DeviceId) {
        let (port, _) = Tty::open(&PathBuf::from(self.port()), 1_000_000).expect("the port is free");
        (WormBus::new(port), DeviceId::new(1).expect("1 is an ID"))
    }

    fn with_ears<T>(&self, act: impl FnOnce(&mut TelemetryReceiver) -> T) -> T {
        let mut guard = self.receiver.lock().expect("no test thread has panicked");
        let receiver = guard.get_or_insert_with(|| {
            let hub = Hub::open(&self.instance()).expect("the topics open");
            TelemetryReceiver {
                client: hub.command_client().expect("a client"),
                states: hub.subscriber().expect("a subscriber"),
                newest: None,
            }
        });
        act(receiver)
    }

    /// Commands the controller.
    pub fn order(&self, kind: CommandKind) -> CommandOutcome {
        let order = Order::new(kind);
        let reply = self
            .with_ears(|receiver| receiver.client.call(order, Duration::from_secs(5)))
            .expect("an answer");
        CommandOutcome::try_from(reply.verdict).expect("a known verdict")
    }

    /// The newest state.
    pub fn state(&self) -> Option<State> {
        self.with_ears(|receiver| {
            if let Some(state) = receiver.states.latest().expect("states can be read") {
                receiver.newest = Some(*state);
            }
            receiver.newest
        })
    }

    /// The worm does not crawl for a while.
    pub fn assert_does_not_crawl(&self) {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_millis(1_500) {
            let mode = self.state().map(|state| state.mode);
            assert_ne!(mode, Some(Mode::Crawling.code()));
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// The folder of its topics.
    pub fn folder(&self) -> PathBuf {
        self.instance().folder().to_path_buf()
    }

    /// Closes the test's own ports, so that it does not count as one who uses the topics.
    pub fn forget_topics(&self) {
        *self.receiver.lock().expect("no test thread has panicked") = None;
    }

    /// Pauses that were made so far.
    pub fn pauses(&self) -> u64 {
        self.pauses.as_ref().map_or(0, |pauses| pauses.made())
    }

    /// The name that no other worm has.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Processes of this worm on this computer, by their command lines: started by this test, or by those that it started.
    pub fn processes(&self) -> Vec<String> {
        let processes = std::fs::read_dir("/proc").expect("/proc").flatten();
        let lines = processes.filter_map(|process| {
            let line = std::fs::read(process.path().join("cmdline")).ok()?;
            Some(String::from_utf8_lossy(&line).replace('\0', " "))
        });
        lines
            .filter(|line| line.contains(&self.name) && line.contains("wormd"))
            .collect()
    }

    /// Waits until nothing of this worm is left: no process, and no file.
    pub fn wait_until_nothing_is_left(&self) {
        wait_for("nothing is left of the worm", Duration::from_secs(20), || {
            self.processes().is_empty()
        });
        assert_eq!(self.stale_resources(), Vec::<String>::new());
    }

    /// Files of this worm that are left in shared memory.
    pub fn stale_resources(&self) -> Vec<String> {
        let mut left: Vec<String> = ["/dev/shm", "/dev/shm/wormd"]
            .iter()
            .filter_map(|folder| std::fs::read_dir(folder).ok())
            .flatten()
            .filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()))
            .filter(|file| file.contains(&self.name))
            .collect();
        left.sort();
        left
    }
}

/// A deadline for one answer on the bus.
pub fn soon() -> Instant {
    Instant::now() + Duration::from_millis(100)
}

/// Late ticks in a table of culprits.
pub fn late_ticks(culprits: &serde_json::Value) -> f64 {
    let counts = culprits.as_object().expect("a table of culprits").values();
    counts.map(|count| count.as_f64().expect("a count")).sum()
}
