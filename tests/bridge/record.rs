//! `wormd record` on a laptop, of a worm that is on a robot, with the network gone in the middle.

use super::network::TwoComputers;
use super::{Laptop, PATIENCE, Robot, WORM_CONFIG, path};
use nix::sys::signal::Signal;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;
use worm_estimator::message::{CommandKind, CommandOutcome, JsonMessage, Mode};
use worm_log::{Log, messages};

/// The network is gone for so long that the bridge begins anew.
const OUTAGE: Duration = Duration::from_secs(9);

#[test]
fn a_worm_over_a_network_is_recorded_and_an_outage_costs_states_and_no_cycle() {
    let Some(network) = TwoComputers::new(Duration::from_millis(20), 0.0, 17) else {
        return;
    };
    let robot = Robot::start("b-record", Some(&network));
    let anna = robot.laptop("keys", "anna");
    let mut watcher = anna.watch("anna");
    let hello = watcher.hello(PATIENCE);
    assert_eq!(
        (hello["robot"].as_str(), hello["config"].as_str()),
        (Some("robot1"), Some(WORM_CONFIG))
    );
    let config = laptop_config(&anna);
    let arguments = ["record", "--config", path(&config)];
    black_boxes_belong_on_the_robot(&robot, &arguments, &anna);

    // Every tick on the robot, to hold against it.
    let (whole, run) = (anna.root.path().join("whole.mcap"), anna.root.path().join("run.mcap"));
    let on_robot = robot.worm.wormd(&["record", "--out", path(&whole)]).start();
    // The laptop's recording must not begin before it.
    let frame = watcher.frame(PATIENCE, |_| whole.metadata().is_ok_and(|file| file.len() > 0));
    let begun_ns = frame["time_ns"].as_u64().expect("when it was made");
    watcher.frame(PATIENCE, |frame| {
        frame["time_ns"].as_u64() > Some(begun_ns + 1_000_000_000)
    });
    let out = [&arguments[..], &["--out", path(&run)]].concat();
    let on_laptop = robot.worm.wormd(&out).start_with_log();
    watcher.frame(PATIENCE, |frame| frame["watchers"].as_u64() >= Some(1) && run.exists());
    assert_eq!(robot.worm.order(CommandKind::Arm), CommandOutcome::Accepted);
    assert_eq!(robot.worm.order(CommandKind::Crawl), CommandOutcome::Accepted);
    robot.wait_for_mode(Mode::Crawling);
    let has_cycle = |index: u64| {
        move |frame: &serde_json::Value| {
            let cycles = frame["cycles"].as_array().into_iter().flatten();
            cycles.filter_map(|cycle| cycle["index"].as_u64()).any(|at| at >= index)
        }
    };
    watcher.frame(PATIENCE, has_cycle(2));
    network.cut(true);
    watcher.listen(OUTAGE);
    network.cut(false);
    watcher.frame(PATIENCE, |frame| frame["network"]["frames_lost"].as_u64() > Some(0));
    watcher.frame(PATIENCE, has_cycle(8));
    on_laptop.signal(Signal::SIGTERM);
    let (status, said) = on_laptop.log_at_its_end();
    assert!(status.success(), "{said}");
    on_robot.end();

    for part in [
        "recording from robot1 over the network",
        "20 ticks a second",
        "wormd black-box get",
        "nothing came over the network from t = ",
        "cycle ",
        "frames lost",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let (log, whole) = (messages(&run).expect("a log"), messages(&whole).expect("a log"));
    the_log_is_that_of_the_robot(&log, &whole);
    let gap = format!("{:?}", log.warnings);
    assert!(
        gap.contains("recorded over a network from robot1: at most 20 of 100 ticks a second")
            && gap.contains("nothing came over the network from")
            && gap.contains("no cycle and no change of an alarm of it is missing"),
        "{gap}"
    );
    let outage = log
        .states
        .windows(2)
        .max_by_key(|pair| pair[1].time_ns.saturating_sub(pair[0].time_ns))
        .expect("states");
    other_commands_say_what_is_missing(&robot, &run, outage[0].sample_time_s);
}

/// A configuration that says where the fleet offers its worms, and nothing of the worm.
fn laptop_config(laptop: &Laptop) -> PathBuf {
    let root = laptop.root.path();
    let config = root.join("laptop.toml");
    std::fs::write(&config, format!("[topics]\nroot = '{}'\n", root.display())).expect("can be written");
    config
}

fn black_boxes_belong_on_the_robot(robot: &Robot<'_>, arguments: &[&str], laptop: &Laptop) {
    let boxes = laptop.root.path().join("boxes");
    let output = robot
        .worm
        .wormd(&[arguments, &["--black-box", path(&boxes)]].concat())
        .output();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("robot1") && said.contains("wormd black-box get"),
        "{said}"
    );
    assert!(!boxes.exists(), "nothing is begun");
}

/// Every message is one that was recorded on the robot, none is there twice, and no cycle, alarm or command is missing.
fn the_log_is_that_of_the_robot(log: &Log, whole: &Log) {
    assert_eq!(log.config.as_deref(), Some(WORM_CONFIG), "that of the robot");
    let (Some(first), Some(last)) = (log.states.first(), log.states.last()) else {
        panic!("no state")
    };
    let seconds = (last.time_ns - first.time_ns) as f64 * 1e-9;
    let outage_s = OUTAGE.as_secs_f64();
    assert!(seconds > outage_s + 10.0, "{seconds} s");
    // A network takes some time until it believes that it is there again.
    let most = 20.0 * (seconds - outage_s) + 20.0;
    let states = log.states.len() as f64;
    assert!(states > 0.3 * most && states <= most, "{states} states in {seconds} s");
    let longest = log
        .states
        .windows(2)
        .map(|pair| pair[1].time_ns.saturating_sub(pair[0].time_ns));
    assert!(longest.max() >= Some(8_000_000_000), "the outage is a gap");
    are_those_of(&log.states, &whole.states);
    are_those_of(&log.timings, &whole.timings);
    are_those_of(&log.inferred, &whole.inferred);

    // What happened just before the end was perhaps not under way yet.
    let span = first.time_ns..=last.time_ns - 500_000_000;
    are_all_of(&log.cycles, &whole.cycles, &span);
    are_all_of(&log.alarms, &whole.alarms, &span);
    assert!(log.cycles.len() >= 8, "{} cycles", log.cycles.len());
    // What only prolongs a crawl is not passed on.
    let told: Vec<_> = whole
        .commands
        .iter()
        .filter(|told| !told.is_mere_renewal())
        .copied()
        .collect();
    are_all_of(&log.commands, &told, &span);
    assert!(log.commands.len() >= 2, "arm and crawl");
}

fn texts<T: JsonMessage>(messages: &[T]) -> Vec<String> {
    let text = |message: &T| {
        let mut text = Vec::new();
        message.write_json(&mut text).expect("every message can be written");
        String::from_utf8(text).expect("JSON is text")
    };
    messages.iter().map(text).collect()
}

/// Each is there once, in the same order, to the last bit.
fn are_those_of<T: JsonMessage>(some: &[T], all: &[T]) {
    let places: BTreeMap<String, usize> = texts(all).into_iter().zip(0..).collect();
    let found: Vec<_> = texts(some).iter().map(|text| places.get(text).copied()).collect();
    let foreign: Vec<_> = found
        .iter()
        .zip(0..)
        .filter(|(place, _)| place.is_none())
        .map(|(_, index)| index)
        .collect();
    assert!(
        foreign.is_empty(),
        "{}: not the robot's are those at {foreign:?} of {}; it begins at {:?}",
        T::TYPE_NAME,
        found.len(),
        found.iter().take(3).collect::<Vec<_>>()
    );
    assert!(found.is_sorted_by(|a, b| a < b), "{}: {found:?}", T::TYPE_NAME);
}

fn are_all_of<T: JsonMessage + Copy>(some: &[T], all: &[T], span: &std::ops::RangeInclusive<u64>) {
    let expected: Vec<T> = all
        .iter()
        .filter(|message| span.contains(&message.made_ns()))
        .copied()
        .collect();
    let found: Vec<T> = some
        .iter()
        .filter(|message| span.contains(&message.made_ns()))
        .copied()
        .collect();
    assert_eq!(texts(&found), texts(&expected), "{}", T::TYPE_NAME);
}

/// `until_s` is when the tracker's last sample before the outage was taken: what an outage left out, nobody analyses.
fn other_commands_say_what_is_missing(robot: &Robot<'_>, run: &Path, until_s: f64) {
    let (run, until) = (path(run), until_s.to_string());
    let copy = run.replace("run.mcap", "copy.mcap");
    for arguments in [
        &["analyze", "--slope", "0", "--to", &until, run][..],
        &["infer", run],
        &["export", "--mcap", &copy, run],
        &["replay", run],
    ] {
        let output = robot.worm.plain_wormd(arguments).output();
        let said = [&output.stdout[..], &output.stderr[..]].concat();
        let said = String::from_utf8_lossy(&said);
        assert!(output.status.success(), "{arguments:?}: {said}");
        assert!(
            said.contains("note: nothing came over the network from"),
            "{arguments:?}: {said}"
        );
        println!("{arguments:?}\n{said}");
    }
    // Notes are not lost with a copy.
    let copied = messages(Path::new(&copy)).expect("a log");
    assert!(
        copied
            .warnings
            .iter()
            .any(|note| note.starts_with("recorded over a network from robot1"))
    );
}
