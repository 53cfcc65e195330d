//! Who watches over a crawl, and what the worm does when nobody does any more.

use super::any_order::make_crawl_again;
use super::process::{Process, wait_for};
use super::worm::Worm;
use super::{Crawling, PATIENCE};
use nix::pty::{OpenptyResult, Winsize, openpty};
use nix::sys::signal::Signal;
use std::num::NonZero;
use std::time::{Duration, Instant};
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};

/// Size of a terminal, characters.
pub const ROWS: NonZero<u16> = NonZero::new(50).expect("is not zero");
pub const COLUMNS: NonZero<u16> = NonZero::new(200).expect("is not zero");

/// A terminal that nobody reads: what is written to it is taken until its buffer is full, and then waits for ever.
pub fn stalled_terminal() -> OpenptyResult {
    let size = Winsize {
        ws_row: ROWS.get(),
        ws_col: COLUMNS.get(),
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    let pty = openpty(Some(&size), None).expect("a pseudo-terminal");
    nix::fcntl::fcntl(
        &pty.master,
        nix::fcntl::FcntlArg::F_SETFD(nix::fcntl::FdFlag::FD_CLOEXEC),
    )
    .expect("the flag can be set");
    pty
}

fn wait_for_mode(worm: &Worm, mode: Mode) {
    wait_for(mode.name(), PATIENCE, || is_in(worm, mode));
}

fn is_in(worm: &Worm, mode: Mode) -> bool {
    worm.state().is_some_and(|state| state.mode == mode.code())
}

/// A worm that crawled, whose parent is killed, and that holds. On a computer that is too busy for it, the worm stops with a fault;
/// then once more.
fn orphan(worm: &Worm, start: impl Fn() -> Process) {
    for _ in 0..5 {
        let mut up = start();
        wait_for("a worm that crawls, or has stopped", PATIENCE, || {
            is_in(worm, Mode::Crawling) || up.exit_status().is_some()
        });
        if up.exit_status().is_some() {
            continue;
        }
        up.kill();
        wait_for("a worm that holds, or has stopped", PATIENCE, || {
            [Mode::Holding, Mode::Fault, Mode::Disarmed]
                .iter()
                .any(|mode| is_in(worm, *mode))
        });
        if is_in(worm, Mode::Holding) {
            return;
        }
        println!("fault {:?}: once more", worm.state().map(|state| state.fault));
    }
    panic!("the worm never held after its parent was killed");
}

fn is_suspended(process: &Process) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.id())).expect("is alive");
    stat.rsplit_once(')')
        .is_some_and(|(_, rest)| rest.trim_start().starts_with('T'))
}

#[test]
fn with_a_terminal_that_nobody_reads_a_run_ends_in_time_and_heeds_signals() {
    let worm = Worm::new("stalled");
    let pty = stalled_terminal();
    let begun = Instant::now();
    let up = worm.wormd(&["up", "--duration", "4"]).start_in(pty.slave);
    // The summary found no reader either, and that is said by the exit status.
    assert_eq!(up.ends_within(Duration::from_secs(60)).code(), Some(1));
    println!("4 s of crawling took {:?}", begun.elapsed());
    worm.wait_until_nothing_is_left();

    let pty = stalled_terminal();
    let up = worm.wormd(&["up"]).start_in(pty.slave);
    wait_for_mode(&worm, Mode::Crawling);
    std::thread::sleep(Duration::from_secs(4));
    up.signal(Signal::SIGTERM);
    assert_eq!(up.ends_within(PATIENCE).code(), Some(1));
    assert!(
        is_in(&worm, Mode::Disarmed),
        "{:?}",
        worm.state().map(|state| state.mode)
    );
    drop(pty.master);
}

/// A terminal that nobody reads and that takes nothing more.
fn full_terminal() -> OpenptyResult {
    let pty = stalled_terminal();
    let flags = |flags| nix::fcntl::fcntl(&pty.slave, nix::fcntl::FcntlArg::F_SETFL(flags)).expect("flags can be set");
    flags(nix::fcntl::OFlag::O_NONBLOCK);
    while nix::unistd::write(&pty.slave, &[b'x'; 100]).is_ok() {}
    flags(nix::fcntl::OFlag::empty());
    pty
}

#[test]
fn a_controller_whose_log_nobody_reads_crawls_and_heeds_commands_and_signals() {
    let mut crawling = Crawling::at_rest(Worm::new("unread"), &[]);
    crawling.controller.kill();
    let port = crawling.worm.port();
    let pty = full_terminal();
    let control = crawling.worm.wormd(&["control", "--port", &port, "-vv"]);
    // Neither the log nor the line "ready" finds a reader.
    crawling.controller = control.start_in(pty.slave);
    make_crawl_again(&crawling.worm);
    for order in [CommandKind::Hold, CommandKind::Crawl, CommandKind::Stop] {
        assert_eq!(crawling.worm.order(order), CommandOutcome::Accepted, "{order}");
        std::thread::sleep(Duration::from_millis(300));
    }
    wait_for_mode(&crawling.worm, Mode::Disarmed);
    let Crawling { controller, worm, .. } = crawling;
    controller.signal(Signal::SIGTERM);
    controller.ends_within(PATIENCE);
    drop((pty.master, worm));
}

#[test]
fn a_worm_whose_parent_was_killed_holds_and_the_next_parent_takes_over() {
    let worm = Worm::new("orphan");
    let log = tempfile::tempdir().expect("a temporary folder");
    let file = log.path().join("run.mcap").to_string_lossy().into_owned();
    orphan(&worm, || {
        // The log of an earlier attempt is in the way.
        let _ = std::fs::remove_file(&file);
        worm.wormd(&["up", "--json", "--record", &file]).start_silent()
    });

    let run = || worm.wormd(&["up", "--json", "--duration", "1"]).output();
    let output = run();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("was killed"), "it says what it found: {error}");
    // A computer that is too busy for the worm may stop it with a fault.
    let is_well = output.status.success() || run().status.success() || run().status.success();
    assert!(is_well, "{error}");
    worm.forget_topics();
    worm.wait_until_nothing_is_left();
}

#[test]
fn a_worm_that_is_held_on_a_slope_is_not_taken_over_but_stopped_by_command() {
    let worm = Worm::new("slope");
    let config = worm.config("[canal]\nslope_deg = 20.0\n");
    orphan(&worm, || {
        worm.wormd(&["up", "--json", "--config", &config]).start_silent()
    });

    let output = worm
        .wormd(&["up", "--json", "--duration", "1", "--config", &config])
        .output();
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(
        error.contains("wormd command stop") && error.contains("20 degrees"),
        "{error}"
    );
    assert!(is_in(&worm, Mode::Holding));
    assert!(
        worm.wormd(&["command", "stop", "--config", &config])
            .output()
            .status
            .success()
    );
    worm.forget_topics();
    worm.wait_until_nothing_is_left();
}

#[test]
fn a_suspended_parent_leaves_a_worm_that_holds() {
    let worm = Worm::on_a_steady_computer("suspended");
    let up = worm
        .wormd(&["up", "--plain", "--duration", "12"])
        .start_without_reader();
    wait_for_mode(&worm, Mode::Crawling);
    // Ctrl-Z.
    up.signal(Signal::SIGTSTP);
    wait_for("the parent is suspended", PATIENCE, || is_suspended(&up));
    assert!(is_in(&worm, Mode::Holding), "before it was suspended");
    up.signal(Signal::SIGCONT);
    wait_for("a crawl is accepted", PATIENCE, || {
        worm.order(CommandKind::Crawl) == CommandOutcome::Accepted
    });
    wait_for_mode(&worm, Mode::Crawling);
    // Without asking; the lease lapses.
    up.signal(Signal::SIGSTOP);
    wait_for_mode(&worm, Mode::Holding);
    up.signal(Signal::SIGCONT);
    assert_eq!(up.ends_within(Duration::from_secs(40)).code(), Some(0));
}

#[test]
fn a_crawl_by_command_has_an_end() {
    let crawling = Crawling::start("limit");
    let command = |arguments: &[&str]| {
        // A busy computer may have stopped it with a fault.
        make_crawl_again(&crawling.worm);
        let output = crawling
            .worm
            .wormd(&[&["command", "crawl"], arguments].concat())
            .output();
        (
            output.status.success(),
            String::from_utf8_lossy(&output.stdout).into_owned(),
        )
    };
    let (accepted, said) = command(&[]);
    assert!(accepted && said.contains("for 600 s at most"), "{said}");
    let (accepted, said) = command(&["--for", "1"]);
    assert!(accepted && said.contains("for 1 s"), "{said}");
    crawling.wait_for_mode(Mode::Holding);

    let mut attendant = crawling.worm.wormd(&["command", "crawl", "--attend"]).start();
    crawling.wait_for_mode(Mode::Crawling);
    std::thread::sleep(Duration::from_millis(2500));
    assert!(is_in(&crawling.worm, Mode::Crawling), "it is renewed");
    attendant.kill();
    crawling.wait_for_mode(Mode::Holding);

    let attendant = crawling.worm.wormd(&["command", "crawl", "--attend"]).start();
    crawling.wait_for_mode(Mode::Crawling);
    attendant.signal(Signal::SIGINT);
    assert_eq!(attendant.ends_by_itself().code(), Some(0));
    crawling.wait_for_mode(Mode::Holding);

    // A stop is not overruled by the attendant.
    let attendant = crawling.worm.wormd(&["command", "crawl", "--attend"]).start();
    crawling.wait_for_mode(Mode::Crawling);
    assert_eq!(crawling.worm.order(CommandKind::Stop), CommandOutcome::Accepted);
    assert_eq!(attendant.ends_by_itself().code(), Some(1));
    crawling.wait_for_mode(Mode::Disarmed);
}
