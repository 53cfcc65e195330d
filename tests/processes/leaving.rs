//! The terminal of `wormd up` may vanish; the worm must not crawl on unattended.

use super::PATIENCE;
use super::process::wait_for;
use super::worm::Worm;
use nix::fcntl::{FcntlArg, FdFlag, fcntl};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::{Winsize, openpty};
use std::fs::File;
use std::io::Read;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use worm_estimator::message::Mode;

#[test]
fn a_reader_that_leaves_stops_the_worm() {
    let worm = Worm::new("reader");
    // Its output is closed after the first line.
    let up = worm.wormd(&["up", "--plain"]).start();
    assert_eq!(up.ends_by_itself().code(), Some(1));
    assert_eq!(worm.stale_resources(), Vec::<String>::new());
}

#[test]
fn a_terminal_that_goes_stops_the_worm() {
    let worm = Worm::new("hangup");
    let size = Winsize {
        ws_row: 24,
        ws_col: 80,
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    let pty = openpty(Some(&size), None).expect("a pseudo-terminal");
    // Whoever inherits the other end keeps the terminal alive.
    fcntl(&pty.master, FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC)).expect("the flag can be set");
    let up = worm.wormd(&["up"]).start_in(pty.slave);
    let eyes = Eyes::on(pty.master);
    wait_for("a crawling worm", PATIENCE, || {
        worm.state().is_some_and(|state| state.mode == Mode::Crawling.code())
    });
    eyes.close();
    // Whether reading or painting finds it first decides between a wish to stop and a failure.
    let code = up.ends_by_itself().code();
    assert!(matches!(code, Some(0 | 1)), "{code:?}");
}

/// Reads a terminal, which otherwise fills up and blocks who paints, until it is closed.
struct Eyes {
    closing: Arc<AtomicBool>,
    reader: JoinHandle<()>,
}

impl Eyes {
    fn on(master: OwnedFd) -> Self {
        let closing = Arc::new(AtomicBool::new(false));
        let closes = Arc::clone(&closing);
        let reader = std::thread::spawn(move || {
            let mut master = File::from(master);
            let mut bytes = [0; 4096];
            while !closes.load(Ordering::Relaxed) {
                let mut readable = [PollFd::new(master.as_fd(), PollFlags::POLLIN)];
                if poll(&mut readable, PollTimeout::from(20u8)).is_ok_and(|count| count > 0) {
                    let _ = master.read(&mut bytes).expect("the terminal can be read");
                }
            }
        });
        Self { closing, reader }
    }

    fn close(self) {
        self.closing.store(true, Ordering::Relaxed);
        self.reader.join().expect("the reader does not panic");
    }
}
