//! `wormd command stop` works when nothing else does.

use super::process::wait_for;
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use nix::sys::signal::Signal;
use std::os::unix::process::CommandExt;
use std::process::{Command, Output, Stdio};
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};

/// The user nobody.
const NOBODY: u32 = 65534;

fn stop(worm: &Worm) -> (Option<i32>, String) {
    said(&worm.wormd(&["command", "stop"]).output())
}

fn said(output: &Output) -> (Option<i32>, String) {
    let text = [&output.stdout[..], &output.stderr].concat();
    (output.status.code(), String::from_utf8_lossy(&text).into_owned())
}

/// Says that a test cannot run without root; true if so.
fn needs_root(what: &str) -> bool {
    let is_root = nix::unistd::geteuid().is_root();
    if !is_root {
        println!("SKIPPED: {what} needs root");
    }
    !is_root
}

#[test]
fn a_stop_is_accepted_in_every_mode() {
    let mut crawling = Crawling::start("modes");
    let accepted = |worm: &Worm, mode: &str| {
        let (code, said) = stop(worm);
        assert_eq!(
            (code, said.contains("stop accepted")),
            (Some(0), true),
            "{mode}: {said}"
        );
    };
    accepted(&crawling.worm, "crawling");
    accepted(&crawling.worm, "stopping");
    crawling.wait_for_mode(Mode::Disarmed);
    accepted(&crawling.worm, "disarmed");
    assert_eq!(crawling.worm.order(CommandKind::Arm), CommandOutcome::Accepted);
    crawling.wait_for_mode(Mode::Armed);
    accepted(&crawling.worm, "armed");
    crawling.wait_for_mode(Mode::Disarmed);
    crawling.make_crawl();
    assert_eq!(crawling.worm.order(CommandKind::Hold), CommandOutcome::Accepted);
    crawling.wait_for_mode(Mode::Holding);
    accepted(&crawling.worm, "holding");
    crawling.wait_for_mode(Mode::Disarmed);
    crawling.make_crawl();
    crawling.kill_virtual_worm();
    crawling.wait_for_mode(Mode::Fault);
    accepted(&crawling.worm, "fault");
}

#[test]
fn a_worm_whose_folder_was_removed_can_be_stopped_and_stops_by_itself() {
    let crawling = Crawling::start_again(Worm::on_a_steady_computer("folder"));
    let folder = crawling.worm.folder();
    std::fs::remove_dir_all(&folder).expect("it is there");
    let (code, said) = stop(&crawling.worm);
    assert_eq!(code, Some(0), "{said}");
    let Crawling {
        controller,
        estimator,
        virtual_worm,
        worm,
    } = crawling;
    assert_eq!(
        controller.ends_by_itself().code(),
        Some(1),
        "it says that its lock is gone"
    );
    estimator.end();
    virtual_worm.end();
    worm.forget_topics();
    worm.wait_until_nothing_is_left();

    // Nobody stops this one.
    let crawling = Crawling::start_again(worm);
    std::fs::remove_dir_all(&folder).expect("it is there");
    crawling.wait_for_mode(Mode::Disarmed);
    assert_eq!(crawling.controller.ends_by_itself().code(), Some(1));
}

/// In a mount namespace of its own, where `/dev/shm` is another one without the worm's folder, and full.
#[test]
fn a_worm_can_be_stopped_when_shared_memory_is_full() {
    if needs_root("a /dev/shm that is full") {
        return;
    }
    let crawling = Crawling::start("full-shm");
    let script = format!(
        "mount -t tmpfs -o size=16k,nr_inodes=8 none /dev/shm || exit 77; \
         cat /dev/zero > /dev/shm/full 2> /dev/null; exec {} command stop --name {}",
        env!("CARGO_BIN_EXE_wormd"),
        crawling.worm.name()
    );
    let output = Command::new("unshare")
        .args(["--mount", "sh", "-c", &script])
        .stdin(Stdio::null())
        .output();
    match output {
        Ok(output) if output.status.code() != Some(77) => {
            let (code, said) = said(&output);
            assert_eq!(code, Some(0), "{said}");
            crawling.wait_for_mode(Mode::Disarmed);
        }
        _ => println!("SKIPPED: no mount namespace can be had here"),
    }
}

#[test]
fn only_its_user_may_command_a_worm() {
    if needs_root("another user") {
        return;
    }
    let crawling = Crawling::start("foreign");
    for order in ["stop", "hold", "crawl"] {
        let mut command = crawling.worm.wormd(&["command", order]).into_command();
        let output = command.uid(NOBODY).gid(NOBODY).output().expect("the binary starts");
        let (code, said) = said(&output);
        assert_eq!(code, Some(1), "{said}");
        assert!(
            said.contains(crawling.worm.name()) && said.contains("worm of user 0"),
            "{order}: {said}"
        );
    }
    let mode = crawling.worm.state().map(|state| state.mode);
    assert_eq!(mode, Some(Mode::Crawling.code()));
}

#[test]
fn an_alarm_can_be_acknowledged_by_name() {
    let crawling = Crawling::start("ack");
    let acknowledge = |alarm: &str| said(&crawling.worm.wormd(&["command", "acknowledge", alarm]).output());
    let (code, said) = acknowledge("motor-stall");
    assert_eq!(code, Some(0), "{said}");
    let (code, said) = acknowledge("hunger");
    assert_eq!((code, said.contains("motor-stall")), (Some(2), true), "{said}");
    wait_for("it goes on crawling", PATIENCE, || {
        crawling
            .worm
            .state()
            .is_some_and(|state| state.mode == Mode::Crawling.code())
    });
}

#[test]
fn who_stops_a_suspended_controller_is_told_how() {
    let crawling = Crawling::start_again(Worm::on_a_steady_computer("asleep"));
    crawling.controller.signal(Signal::SIGSTOP);
    let (code, said) = stop(&crawling.worm);
    crawling.controller.signal(Signal::SIGCONT);
    let pid = crawling.controller.id();
    assert_eq!(code, Some(1), "{said}");
    for part in [
        "is suspended",
        &format!("kill -CONT {pid}"),
        &format!("kill -KILL {pid}"),
    ] {
        assert!(said.contains(part), "{part} is not in {said}");
    }
}
