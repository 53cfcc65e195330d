//! Starting after kill -9, beside the living, and beside readers that know nothing of our locks.

use super::home::{Home, segments};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fs::{self, File, Permissions};
use std::io::{BufRead, BufReader};
use std::num::NonZeroUsize;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use worm_estimator::message::State;
use wormd::topics::{Controller, Hub, Instance, RoleError, RoleLock, StartError, Subscriber};

/// How long a start may take after a kill: a hang would reach the hub's own limit of three seconds.
const BOUND: Duration = Duration::from_secs(2);
/// Kills happen this long after the start began.
const WINDOW: Duration = Duration::from_millis(15);
const KILLS: usize = 80;
/// Tells a test binary that was started again what to be: a mode, the root, the worm.
const ROLE: &str = "WORMD_TEST_CHILD";

/// What this binary is when a test starts it again; otherwise nothing.
#[test]
fn child() {
    let Ok(role) = std::env::var(ROLE) else { return };
    let [mode, root, worm] = role.split(' ').collect::<Vec<_>>()[..] else {
        panic!("{ROLE}={role}");
    };
    // The mode mask is inherited, and iceoryx2 changes that of the parent process for moments in other tests.
    nix::sys::stat::umask(nix::sys::stat::Mode::from_bits_truncate(0o022));
    println!("ready");
    if mode == "reader" {
        let name = fs::read_dir("/dev/shm")
            .expect("/dev/shm")
            .flatten()
            .find(|entry| entry.file_name().to_string_lossy().contains(worm))
            .expect("the planted segment");
        let file = File::open(name.path()).expect("open");
        let length = NonZeroUsize::new(4096).expect("not zero");
        let (protection, flags) = (
            nix::sys::mman::ProtFlags::PROT_READ,
            nix::sys::mman::MapFlags::MAP_SHARED,
        );
        // SAFETY: a new mapping, which nothing reads.
        unsafe { nix::sys::mman::mmap(None, length, protection, flags, file, 0) }.expect("mmap");
        println!("done");
        thread::sleep(Duration::from_secs(60));
        return;
    }
    let instance = Instance::new(Path::new(root), worm).expect("instance");
    if mode == "folders" {
        println!("done");
        return;
    }
    let controller = RoleLock::<Controller>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    let publisher = hub.publisher::<State>(&controller).expect("publisher");
    let _subscriber = hub.subscriber::<State>().expect("subscriber");
    let _listener = hub.listener::<State>().expect("listener");
    let notifier = hub.notifier::<State>(&controller).expect("notifier");
    let _server = hub.command_server(&controller).expect("server");
    println!("done");
    for sequence in 0.. {
        publisher
            .publish(&State {
                sequence,
                ..State::unknown(4)
            })
            .expect("publish");
        notifier.notify().expect("notify");
        thread::sleep(Duration::from_millis(1));
    }
}

/// A process that is killed when dropped.
struct Process {
    child: Child,
    output: BufReader<std::process::ChildStdout>,
}

impl Process {
    fn start(mode: &str, root: &Path, worm: &str) -> Self {
        let mut child = Command::new(std::env::current_exe().expect("this binary"))
            .args(["--exact", "start::child", "--nocapture", "--test-threads=1"])
            .env(ROLE, format!("{mode} {} {worm}", root.display()))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("a child process");
        let output = BufReader::new(child.stdout.take().expect("its output"));
        Self { child, output }
    }

    fn wait_for(&mut self, word: &str) {
        let mut line = String::new();
        while !line.trim_end().ends_with(word) {
            line.clear();
            assert!(
                self.output.read_line(&mut line).expect("its output") > 0,
                "it ended before {word}"
            );
        }
    }

    fn pid(&self) -> u32 {
        self.child.id()
    }

    fn kill(mut self) {
        self.child.kill().expect("kill");
        self.child.wait().expect("wait");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have been killed and waited for already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Starts a controller and kills it somewhere in its first milliseconds.
fn kill_a_start(home: &Home, random: &mut Xoshiro256PlusPlus) {
    let mut process = Process::start("controller", home.root(), "worm1");
    process.wait_for("ready");
    let wait = random.random_range(Duration::ZERO..WINDOW);
    let begun = Instant::now();
    while begun.elapsed() < wait {
        std::hint::spin_loop();
    }
    process.kill();
}

/// Starts a controller in this process, checks that it is received, by `watcher` too; returns how long the start took.
fn start_and_be_heard(instance: &Instance, watcher: Option<&mut Subscriber<State>>) -> Duration {
    let begun = Instant::now();
    let controller = RoleLock::<Controller>::take(instance).expect("the role is free");
    let hub = Hub::open(instance).expect("a start after a kill");
    let publisher = hub.publisher::<State>(&controller).expect("publisher");
    let mut subscriber = hub.subscriber::<State>().expect("subscriber");
    hub.listener::<State>().expect("listener");
    hub.command_server(&controller).expect("server");
    let took = begun.elapsed();
    publisher.publish(&State::unknown(4)).expect("publish");
    for subscriber in [Some(&mut subscriber), watcher].into_iter().flatten() {
        assert!(subscriber.latest().expect("receive").is_some());
    }
    took
}

#[test]
fn a_start_succeeds_after_every_kill_during_a_start() {
    let home = Home::new();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let (mut wiped, mut slowest) = (0, Duration::ZERO);
    for _ in 0..KILLS {
        kill_a_start(&home, &mut random);
        let instance = home.instance("worm1");
        wiped += usize::from(!segments(&instance).is_empty());
        slowest = slowest.max(start_and_be_heard(&instance, None));
        assert!(segments(&instance).is_empty(), "{:?}", segments(&instance));
    }
    println!("{KILLS} kills alone: {wiped} left something to wipe, slowest start {slowest:?}");
    assert!(slowest < BOUND, "{slowest:?}");
}

#[test]
fn a_start_succeeds_after_every_kill_beside_a_living_peer() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let watcher = Hub::open(&instance).expect("hub");
    let mut states = watcher.subscriber::<State>().expect("subscriber");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut slowest = Duration::ZERO;
    for _ in 0..KILLS {
        kill_a_start(&home, &mut random);
        while states.next().expect("receive").is_some() {}
        slowest = slowest.max(start_and_be_heard(&instance, Some(&mut states)));
    }
    println!(
        "{KILLS} kills beside a peer: slowest start {slowest:?}, {} segments",
        segments(&instance).len()
    );
    assert!(slowest < BOUND, "{slowest:?}");
    drop((watcher, states));
    assert!(segments(&instance).is_empty(), "{:?}", segments(&instance));
}

#[test]
fn nothing_is_wiped_while_a_peer_lives_and_the_error_names_it() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let mut peer = Process::start("controller", home.root(), "worm1");
    peer.wait_for("done");
    let RoleError::AlreadyRunning(refusal) = RoleLock::<Controller>::take(&instance).expect_err("taken") else {
        panic!("another error");
    };
    assert_eq!(
        (refusal.pid, refusal.role, refusal.worm.as_str()),
        (peer.pid(), "controller", "worm1")
    );
    Hub::open(&instance).expect("a second process");

    // What a start cannot repair: services without their shared part.
    let is_dynamic = |path: &&std::path::PathBuf| path.extension().is_some_and(|extension| extension == "dynamic");
    for file in segments(&instance).iter().filter(is_dynamic) {
        fs::remove_file(file).expect("remove");
    }
    let before = segments(&instance);
    let error = Hub::open_within(&instance, Duration::from_secs(2)).expect_err("it cannot be opened");
    println!("{error}");
    assert!(
        matches!(&error, StartError::Blocked { peers, .. } if peers.iter().any(|p| p.pid == peer.pid())),
        "{error:?}"
    );
    assert!(error.to_string().contains(&peer.pid().to_string()), "{error}");
    for file in before {
        assert!(file.exists(), "{} is gone", file.display());
    }

    peer.kill();
    start_and_be_heard(&instance, None);
    assert!(segments(&instance).is_empty());
}

#[test]
fn a_reader_without_a_lock_counts_as_a_peer() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let planted = Path::new("/dev/shm").join(format!("{}planted", instance.prefix()));
    fs::write(&planted, vec![0; 4096]).expect("write");
    let mut reader = Process::start("reader", home.root(), &format!("{}planted", instance.prefix()));
    reader.wait_for("done");
    start_and_be_heard(&instance, None);
    assert!(planted.exists(), "it is in use");
    reader.kill();
    start_and_be_heard(&instance, None);
    assert!(!planted.exists(), "nobody uses it any more");
}

#[test]
fn a_segment_that_never_got_its_size_is_removed_beside_a_living_peer() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let _peer = Hub::open(&instance).expect("hub");
    let [stillborn, in_the_making] =
        ["stillborn", "making"].map(|name| Path::new("/dev/shm").join(format!("{}{name}", instance.prefix())));
    File::create(&stillborn).expect("create");
    let _maker = File::create(&in_the_making).expect("create");
    Hub::open(&instance).expect("hub");
    assert!(!stillborn.exists());
    assert!(in_the_making.exists(), "somebody has it open");
}

#[test]
fn starts_at_the_same_time_all_succeed() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let starts: Vec<_> = (0..8)
        .map(|_| {
            let instance = instance.clone();
            thread::spawn(move || {
                for _ in 0..5 {
                    Hub::open(&instance)
                        .expect("hub")
                        .subscriber::<State>()
                        .expect("subscriber");
                }
            })
        })
        .collect();
    for start in starts {
        start.join().expect("a start");
    }
    assert!(segments(&instance).is_empty() && !instance.folder().exists());
}

#[test]
fn a_start_that_is_held_up_by_another_says_so() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let file = File::create(instance.folder().join("start.lock")).expect("create");
    let held = nix::fcntl::Flock::lock(file, nix::fcntl::FlockArg::LockExclusive).expect("lock");
    let error = Hub::open_within(&instance, Duration::from_millis(50)).expect_err("held up");
    assert!(
        matches!(error, StartError::Busy { .. }) && error.to_string().contains("worm1"),
        "{error}"
    );
    drop(held);
    Hub::open(&instance).expect("hub");
}

/// The first user's worm must not keep out those of the others, where all may create folders; a folder of its user's own stays so.
#[test]
fn the_root_is_as_open_as_where_it_lies() {
    for (parent_mode, root_mode) in [(0o1777, 0o1777), (0o755, 0o755), (0o777, 0o755)] {
        let parent = tempfile::tempdir_in("/dev/shm").expect("a temporary folder");
        fs::set_permissions(parent.path(), Permissions::from_mode(parent_mode)).expect("is ours");
        let root = parent.path().join("w");
        // In a process of its own, because the mode mask belongs to the whole process.
        Process::start("folders", &root, "open").wait_for("done");
        let mode_of = |path: &Path| path.metadata().expect("is there").permissions().mode() & 0o7777;
        assert_eq!(mode_of(&root), root_mode, "in a folder of mode {parent_mode:o}");
        assert_eq!(mode_of(&root.join("open")), 0o700);
    }
}
