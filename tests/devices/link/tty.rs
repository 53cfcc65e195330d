//! The operating system's port, on a pseudo-terminal.

use std::io::{Read, Write};
use std::os::fd::{FromRawFd, IntoRawFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};
use testkit::pseudo_terminal::PseudoTerminal;
use wormd::link::{OpenError, Port, PortError, Tty, WormBus, prepare};

use super::startup::settings;
use super::worm::Worm;

fn soon() -> Instant {
    Instant::now() + Duration::from_millis(100)
}

/// The other end, and this one, which keeps the line open while nobody else has it.
fn pseudo_terminal() -> (TTYPort, OwnedFd, PathBuf) {
    let PseudoTerminal { far, near, path } = PseudoTerminal::open();
    // SAFETY: the descriptor is open, and belongs to the port alone from now on.
    let far = unsafe { TTYPort::from_raw_fd(far.into_raw_fd()) };
    (far, near, path)
}

#[test]
fn bytes_pass_both_ways() {
    let (mut far, _near, path) = pseudo_terminal();
    let (mut tty, findings) = Tty::open(&path, 1_000_000).expect("open");
    assert_eq!(findings, []);
    tty.send(&[0xFF, 0x0A, 0x0D, 0x11, 0x00], soon()).expect("sent");
    let mut sent = [0; 5];
    far.read_exact(&mut sent).expect("received there");
    assert_eq!(
        sent,
        [0xFF, 0x0A, 0x0D, 0x11, 0x00],
        "raw: nothing is translated or swallowed"
    );
    far.write_all(&[1, 3, 0x7F, 4]).expect("sent there");
    let mut received = [0; 16];
    assert_eq!(tty.receive(&mut received, soon()), Ok(4));
    assert_eq!(received[..4], [1, 3, 0x7F, 4]);
    tty.set_baud_rate(57_600).expect("any rate");
}

#[test]
fn wait_ends_at_the_deadline() {
    let (_far, _near, path) = pseudo_terminal();
    let (mut tty, _) = Tty::open(&path, 1_000_000).expect("open");
    let waited = shortest_of_a_few(|| {
        let start = Instant::now();
        assert_eq!(tty.receive(&mut [0; 16], start + Duration::from_millis(20)), Ok(0));
        let waited = start.elapsed();
        assert!(waited >= Duration::from_millis(20), "{waited:?}");
        waited
    });
    assert!(waited < Duration::from_millis(100), "{waited:?}");
}

/// What something takes on a computer that does not pause just then.
fn shortest_of_a_few(attempt: impl FnMut() -> Duration) -> Duration {
    std::iter::repeat_with(attempt).take(5).min().unwrap_or_default()
}

#[test]
fn input_is_discarded_and_counted() {
    let (mut far, _near, path) = pseudo_terminal();
    let (mut tty, _) = Tty::open(&path, 1_000_000).expect("open");
    far.write_all(&[7; 700]).expect("sent there");
    assert_eq!(tty.discard_input(), Ok(700));
    assert_eq!(tty.discard_input(), Ok(0));
}

#[test]
fn second_controller_is_refused_and_the_first_goes_on() {
    let (mut far, _near, path) = pseudo_terminal();
    let (mut first, _) = Tty::open(&path, 1_000_000).expect("open");
    let second = Tty::open(&path, 1_000_000);
    assert!(matches!(second, Err(OpenError::AlreadyInUse { .. })), "{second:?}");
    first.send(&[1], soon()).expect("sent");
    far.read_exact(&mut [0]).expect("received there");
    drop(first);
    Tty::open(&path, 1_000_000).expect("open again");
}

#[test]
fn far_end_that_closes_is_told_from_silence() {
    let (far, near, path) = pseudo_terminal();
    let (mut tty, _) = Tty::open(&path, 1_000_000).expect("open");
    drop((far, near));
    assert_eq!(tty.receive(&mut [0; 16], soon()), Err(PortError::Disconnected));
    assert_eq!(tty.send(&[1], soon()), Err(PortError::Disconnected));
    assert_eq!(tty.discard_input(), Err(PortError::Disconnected));
}

#[test]
fn port_that_takes_no_bytes_does_not_hold_the_loop() {
    let (_far, _near, path) = pseudo_terminal();
    let (mut tty, _) = Tty::open(&path, 1_000_000).expect("open");
    let held = shortest_of_a_few(|| {
        let start = Instant::now();
        let sent = tty.send(&vec![0; 1 << 20], start + Duration::from_millis(30));
        assert_eq!(sent, Err(PortError::SendTimeout));
        start.elapsed()
    });
    assert!(held < Duration::from_millis(100), "{held:?}");
}

#[test]
fn errors_name_the_port() {
    let missing = Tty::open(Path::new("/dev/no-such-port"), 1_000_000).expect_err("no such port");
    assert!(matches!(missing, OpenError::NotFound { .. }) && missing.to_string().contains("/dev/no-such-port"));
    let file = tempfile::NamedTempFile::new().expect("a file");
    let no_terminal = Tty::open(file.path(), 1_000_000).expect_err("no terminal");
    assert!(matches!(no_terminal, OpenError::Setup { .. }), "{no_terminal}");
}

/// Answers on the far end of a pseudo-terminal with the worm, until `exchanges` requests of a tick have come.
fn serve(mut far: TTYPort, mut worm: Worm, ticks: usize) {
    far.set_timeout(Duration::from_secs(2)).expect("a timeout");
    let mut bytes = [0; 512];
    let mut ticks_left = ticks;
    while ticks_left > 0 {
        let received = far.read(&mut bytes).expect("a request within 2 s");
        // The request of a tick is 36 bytes; others are shorter.
        ticks_left -= usize::from(received == 36);
        worm.send(&bytes[..received], soon()).expect("sent");
        let answered = worm.receive(&mut bytes, soon()).expect("received");
        far.write_all(&bytes[..answered]).expect("answered");
    }
    // The answer is taken out before the terminal goes, which would throw it away.
    std::thread::sleep(Duration::from_millis(50));
}

#[test]
fn worm_behind_a_pseudo_terminal_is_prepared_and_ticks_until_it_is_unplugged() {
    let (far, near, path) = pseudo_terminal();
    let ticks = 500;
    // One tick's request is that of start-up, which tries the read mode.
    let worm = std::thread::spawn(move || serve(far, Worm::new(5), 1 + ticks));
    let (tty, mut findings) = Tty::open(&path, 1_000_000).expect("open");
    drop(near);
    let mut bus = WormBus::new(tty);
    let prepared = prepare(&mut bus, &settings(), &mut findings).expect("prepared");
    bus.set_torque(prepared.plan.servo, true).expect("torque on");
    let (at_start, exchanges_at_start) = (bus.counters(), bus.exchange_counters().exchanges);
    for _ in 0..ticks {
        let deadline = Instant::now() + Duration::from_millis(500);
        assert!(bus.exchange(&prepared.plan, 2.5, deadline).is_complete());
    }
    let counters = bus.counters();
    assert_eq!(bus.exchange_counters().exchanges - exchanges_at_start, ticks as u64);
    // A busy computer may have cost start-up an answer, which it asked for again.
    assert_eq!((counters.timeouts, counters.garbage_bytes), (at_start.timeouts, 0));
    worm.join().expect("served");
    // A process that another test is just starting holds a copy of the far end until it runs its own program.
    let limit = Instant::now() + Duration::from_secs(5);
    while !bus.exchange(&prepared.plan, 2.5, soon()).is_disconnected() {
        assert!(Instant::now() < limit, "the terminal is gone, and nobody says so");
    }
}
