//! Real processes of a worm, under a name of their own, ended when a test ends. All of them pause together now and then, as on a
//! computer that is busy or whose host is.

use dynamixel_bus::packet::DeviceId;
use nix::sys::resource::{Resource, setrlimit};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::io::{BufRead, BufReader, Read};
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::RecvTimeoutError;
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

/// A call of `wormd` that is not made yet.
pub struct Invocation {
    command: Command,
    what: String,
    pauses: Option<Arc<HostPauses>>,
}

impl Invocation {
    fn new(arguments: &[&str], pauses: Option<Arc<HostPauses>>) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wormd"));
        // What it remembers is not for the user who tests.
        let state = concat!(env!("CARGO_TARGET_TMPDIR"), "/state");
        command
            .args(arguments)
            .stdin(Stdio::null())
            .env("XDG_STATE_HOME", state);
        Self {
            command,
            what: arguments.join(" "),
            pauses,
        }
    }

    /// Allows it files of at most this size: as on a full disk, but for it alone.
    pub fn with_file_size_limit(mut self, bytes: u64) -> Self {
        // SAFETY: setrlimit is async-signal-safe, and nothing is allocated between fork and exec.
        unsafe {
            self.command
                .pre_exec(move || setrlimit(Resource::RLIMIT_FSIZE, bytes, bytes).map_err(std::io::Error::from));
        }
        self
    }

    /// Gives it a variable of the environment.
    pub fn with_environment(mut self, name: &str, value: &str) -> Self {
        self.command.env(name, value);
        self
    }

    /// Runs it in a network of its own.
    #[allow(
        dead_code,
        reason = "the tests of dashboard and bridge, which share this harness, need it"
    )]
    pub fn in_network(mut self, namespace: &std::fs::File) -> Self {
        let namespace = namespace.try_clone().expect("a descriptor is free");
        // SAFETY: setns is async-signal-safe, and nothing is allocated between fork and exec.
        unsafe {
            self.command.pre_exec(move || {
                nix::sched::setns(&namespace, nix::sched::CloneFlags::CLONE_NEWNET).map_err(std::io::Error::from)
            });
        }
        self
    }

    /// Runs it to its end, which must come within three minutes: it hangs otherwise, however busy the computer is.
    pub fn output(mut self) -> Output {
        self.command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut process = self.spawn();
        let child = &mut process.child;
        let pid = Pid::from_raw(child.id() as i32);
        let (ended, watch) = std::sync::mpsc::channel::<()>();
        let guard = std::thread::spawn(move || {
            let hangs = watch.recv_timeout(Duration::from_secs(180)) == Err(RecvTimeoutError::Timeout);
            if hangs {
                // The process group is the test's own child alone.
                let _ = kill(pid, Signal::SIGTERM);
            }
            hangs
        });
        let mut stdout = child.stdout.take().expect("is piped");
        let reader = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            stdout.read_to_end(&mut bytes).expect("can be read");
            bytes
        });
        let mut stderr = Vec::new();
        child
            .stderr
            .take()
            .expect("is piped")
            .read_to_end(&mut stderr)
            .expect("can be read");
        let status = process.wait();
        drop(ended);
        let hung = guard.join().expect("the guard does not panic");
        assert!(
            !hung,
            "`{}` did not end within three minutes:\n{}",
            self.what,
            String::from_utf8_lossy(&stderr)
        );
        Output {
            status,
            stdout: reader.join().expect("the reader does not panic"),
            stderr,
        }
    }

    /// As [`start`](Self::start), and keeps its log for [`Process::log_at_its_end`].
    pub fn start_with_log(mut self) -> Process {
        self.command.stderr(Stdio::piped());
        self.start()
    }

    /// Starts it and waits until it says on standard output that it is ready.
    pub fn start(mut self) -> Process {
        self.command.stdout(Stdio::piped());
        let mut process = self.spawn();
        let stdout = process.child.stdout.take().expect("is piped");
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line).expect("can be read");
        assert!(
            !line.is_empty(),
            "`{}` ended before it was ready: {:?}",
            self.what,
            process.wait()
        );
        process
    }

    fn spawn(&mut self) -> Process {
        let child = self.command.spawn().expect("the binary starts");
        if let Some(pauses) = &self.pauses {
            pauses.processes().push(Pid::from_raw(child.id() as i32));
        }
        Process {
            child,
            pauses: self.pauses.clone(),
        }
    }

    /// The call itself, for what is not done here.
    pub fn into_command(self) -> Command {
        self.command
    }

    /// Starts it, and discards its output.
    pub fn start_silent(mut self) -> Process {
        self.command.stdout(Stdio::null()).stderr(Stdio::null());
        self.spawn()
    }

    /// Starts it, and discards its standard output.
    pub fn start_without_reader(mut self) -> Process {
        self.command.stdout(Stdio::null());
        self.spawn()
    }

    /// Starts it with a terminal of its own.
    pub fn start_in(mut self, terminal: OwnedFd) -> Process {
        let copy = || terminal.try_clone().expect("a descriptor is free");
        self.command.stdin(copy()).stdout(copy()).stderr(copy());
        self.spawn()
    }
}

/// A running process; dropping it ends it.
pub struct Process {
    child: Child,
    pauses: Option<Arc<HostPauses>>,
}

impl Process {
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal.
    pub fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.child.id() as i32), signal).expect("is alive");
    }

    /// Suspends it for this long.
    pub fn pause(&self, pause: Duration) {
        let pid = Pid::from_raw(self.child.id() as i32);
        kill(pid, Signal::SIGSTOP).expect("is alive");
        std::thread::sleep(pause);
        kill(pid, Signal::SIGCONT).expect("is alive");
    }

    /// kill -9.
    pub fn kill(&mut self) {
        self.child.kill().expect("is alive");
        self.wait();
    }

    /// How it ended, once it has. Nobody may signal its number any more when the system gives it to another process.
    pub fn exit_status(&mut self) -> Option<ExitStatus> {
        let mut paused = self.pauses.as_ref().map(|pauses| pauses.processes());
        let status = self.child.try_wait().expect("can be waited for");
        if let (Some(paused), Some(_)) = (&mut paused, status) {
            let id = self.child.id() as i32;
            paused.retain(|pid| pid.as_raw() != id);
        }
        status
    }

    fn wait(&mut self) -> ExitStatus {
        loop {
            if let Some(status) = self.exit_status() {
                return status;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Waits until it has ended without being asked to.
    pub fn ends_by_itself(self) -> ExitStatus {
        self.ends_within(Duration::from_secs(20))
    }

    /// Waits no longer than this until it has ended.
    pub fn ends_within(mut self, timeout: Duration) -> ExitStatus {
        let mut status = None;
        wait_for("an end without being asked", timeout, || {
            status = self.exit_status();
            status.is_some()
        });
        status.expect("has ended")
    }

    /// Waits until it has ended without being asked to; gives its log, which must be short.
    pub fn log_at_its_end(mut self) -> (ExitStatus, String) {
        let mut stderr = self.child.stderr.take().expect("is piped");
        let status = self.ends_by_itself();
        let mut log = String::new();
        stderr.read_to_string(&mut log).expect("is text");
        (status, log)
    }

    /// Asks it to end and waits for that.
    pub fn end(mut self) {
        self.ask_to_end();
        wait_for("an orderly end", Duration::from_secs(20), || {
            self.exit_status().is_some()
        });
    }

    fn ask_to_end(&self) {
        // It may have been killed by the test.
        let _ = kill(Pid::from_raw(self.child.id() as i32), Signal::SIGTERM);
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if self.exit_status().is_some() {
            return;
        }
        self.ask_to_end();
        let deadline = Instant::now() + Duration::from_secs(5);
        while Instant::now() < deadline {
            if self.exit_status().is_some() {
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        let _ = self.child.kill();
        self.wait();
    }
}

/// Waits until a condition holds; a test that waits in vain says for what.
pub fn wait_for(what: &str, timeout: Duration, mut condition: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < timeout, "waited {timeout:?} in vain: {what}");
        std::thread::sleep(Duration::from_millis(5));
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
