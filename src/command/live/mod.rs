//! What a terminal shows of a worm while it runs: for `wormd up` and `wormd watch`.
//!
//! A thread of its own writes to the terminal: one that nobody reads takes nothing any more, and who writes to it waits for ever.
//! The thread that attends to the worm only looks at the keyboard, which never waits.

mod watch_screen;

pub(super) use watch_screen::WatchScreen;

use crate::command::Failure;
use crate::supervisor::crawl::{Display, Wish};
use crossbeam::channel::{Receiver, Sender, bounded};
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::io::IsTerminal;
use std::os::fd::AsFd;
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

/// How often the display is refreshed.
const FRAME: Duration = Duration::from_millis(50);

/// Keys that may wait for a terminal that takes nothing; later ones are dropped.
const KEYS: usize = 32;

/// How long the terminal may take to be entered, left or finished.
const PATIENCE: Duration = Duration::from_secs(1);

/// What writes to the terminal, in a thread of its own. It may wait for it.
pub(super) trait Painter {
    /// Takes a key that means nothing to the thread that attends.
    fn key(&mut self, key: char);

    /// Shows what is new.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the terminal or standard output is gone.
    fn show(&mut self) -> Result<(), Failure>;

    /// Leaves the terminal to others.
    fn leave(&mut self);

    /// Takes the terminal again.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the terminal is gone.
    fn enter(&mut self) -> Result<(), Failure>;

    /// Restores the terminal and prints what is left to say.
    fn close(&mut self);
}

/// Whether this process has a terminal to read keys from and to paint on.
pub(super) fn is_on_terminal() -> bool {
    std::io::stdout().is_terminal() && std::io::stdin().is_terminal()
}

/// What the thread is told.
enum Order {
    Suspend,
    Resume,
    Close,
}

/// The display, from the side of the thread that attends to the worm.
pub(super) struct Screen {
    /// Whether it takes the whole terminal, and keys.
    is_live: bool,
    orders: Sender<Order>,
    keys: Sender<char>,
    /// One message for each order that was carried out.
    done: Receiver<()>,
    problem: Arc<OnceLock<String>>,
    thread: JoinHandle<()>,
}

impl Screen {
    /// Starts the thread, and waits a little until it has the terminal. `open` makes the painter there; a live one takes the whole
    /// terminal and the keys.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the terminal cannot be used, or there is no thread to be had.
    pub(super) fn open<P: Painter>(
        is_live: bool,
        open: impl FnOnce() -> Result<P, Failure> + Send + 'static,
    ) -> Result<Self, Failure> {
        let (orders, receiver) = bounded(4);
        let (keys, pressed) = bounded(KEYS);
        let (tell, done) = bounded(8);
        let problem = Arc::new(OnceLock::new());
        let problem_there = Arc::clone(&problem);
        let (opened, is_open) = bounded(1);
        let work = move || {
            let mut painter = match open() {
                Ok(painter) => painter,
                Err(failure) => return drop(opened.send(failure)),
            };
            drop(opened);
            if let Err(failure) = paint(&mut painter, &receiver, &pressed, &tell) {
                painter.close();
                // Told once, by this thread alone.
                let _ = problem_there.set(failure.to_string());
            }
        };
        let thread = std::thread::Builder::new()
            .name("display".to_owned())
            .spawn(work)
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        // A terminal that does not take the picture is no reason to keep the worm waiting.
        match is_open.recv_timeout(PATIENCE) {
            Ok(failure) => Err(failure),
            Err(_) => Ok(Self {
                is_live,
                orders,
                keys,
                done,
                problem,
                thread,
            }),
        }
    }

    /// Restores the terminal and prints what the processes logged. Returns what went wrong.
    pub(super) fn close(mut self) -> Option<String> {
        let is_done = self.order(Order::Close);
        if !is_done && self.is_live {
            // The thread waits for a terminal that nobody reads; its keyboard at least can be restored.
            if let Err(error) = ratatui::crossterm::terminal::disable_raw_mode() {
                tracing::debug!("the terminal could not be restored: {error}");
            }
        }
        let stalled = || "the terminal took nothing any more, so the last lines were not shown".to_owned();
        self.problem.get().cloned().or_else(|| (!is_done).then(stalled))
    }

    /// Tells the thread, and waits a little until it has carried that out.
    fn order(&mut self, order: Order) -> bool {
        // The thread may have carried out an earlier order after the patience for it was over.
        while self.done.try_recv().is_ok() {}
        // A thread that has ended has no receiver any more, and nothing to carry out.
        self.orders.try_send(order).is_err() || self.done.recv_timeout(PATIENCE).is_ok()
    }
}

/// Shows what is new until it is told to close.
fn paint(
    painter: &mut impl Painter,
    orders: &Receiver<Order>,
    keys: &Receiver<char>,
    done: &Sender<()>,
) -> Result<(), Failure> {
    loop {
        crossbeam::channel::select! {
            recv(orders) -> order => {
                match order {
                    Ok(Order::Suspend) => painter.leave(),
                    Ok(Order::Resume) => painter.enter()?,
                    Ok(Order::Close) => {
                        let shown = painter.show();
                        painter.close();
                        // Whoever gave the order may have run out of patience.
                        let _ = done.try_send(());
                        return shown;
                    }
                    Err(_) => return Ok(()),
                }
                let _ = done.try_send(());
            }
            recv(keys) -> key => {
                if let Ok(key) = key {
                    painter.key(key);
                    painter.show()?;
                }
            }
            default(FRAME) => painter.show()?,
        }
    }
}

impl Display for Screen {
    fn wait_for_wish(&mut self, time: Duration) -> Wish {
        if !self.is_live {
            std::thread::sleep(time);
            return Wish::GoOn;
        }
        read_wish(time, |key| {
            // A terminal that takes nothing need not take keys.
            let _ = self.keys.try_send(key);
        })
    }

    fn problem(&self) -> Option<String> {
        let reported = self.problem.get().cloned();
        // It ends without a word only by a panic, which the log has.
        reported.or_else(|| self.thread.is_finished().then(|| "the display has failed".to_owned()))
    }

    fn suspend(&mut self) {
        self.order(Order::Suspend);
    }

    fn resume(&mut self) {
        self.order(Order::Resume);
    }
}

/// Waits for `time` or a key; hands on those that are no wish. When the terminal is gone, nobody could press one that stops the worm.
///
/// crossterm's own events do not serve here: once the terminal is gone they loop forever and ignore signals.
fn read_wish(time: Duration, hand_on: impl FnMut(char)) -> Wish {
    let stdin = std::io::stdin();
    let mut keyboard = [PollFd::new(stdin.as_fd(), PollFlags::POLLIN)];
    let timeout = PollTimeout::try_from(time).unwrap_or(PollTimeout::ZERO);
    match poll(&mut keyboard, timeout) {
        Ok(0) | Err(Errno::EINTR) => return Wish::GoOn,
        Ok(_) => {}
        Err(_) => return Wish::Stop,
    }
    let mut keys = [0; 64];
    match nix::unistd::read(stdin.as_fd(), &mut keys) {
        Ok(0) => Wish::Stop,
        Ok(count) => wish_of(&keys[..count], hand_on),
        Err(Errno::EINTR | Errno::EAGAIN) => Wish::GoOn,
        Err(_) => Wish::Stop,
    }
}

/// What this input of a terminal in raw mode means: Ctrl-C or q stops, Ctrl-Z suspends.
fn wish_of(keys: &[u8], hand_on: impl FnMut(char)) -> Wish {
    const CTRL_C: u8 = 3;
    const CTRL_Z: u8 = 26;
    // Ctrl-C counts wherever it stands: no sequence of any key contains it.
    if keys.contains(&CTRL_C) || without_sequences(keys).any(|key| key == b'q') {
        Wish::Stop
    } else if keys.contains(&CTRL_Z) {
        Wish::Suspend
    } else {
        let printed = without_sequences(keys).filter(|key| matches!(key, b' '..=b'~'));
        printed.map(char::from).for_each(hand_on);
        Wish::GoOn
    }
}

/// The keys that send one character. Others, such as the cursor keys, send escape and several more (ECMA-48, 5.4; and SS3).
fn without_sequences(keys: &[u8]) -> impl Iterator<Item = u8> + '_ {
    const ESCAPE: u8 = 27;
    let mut rest = keys.iter().copied();
    std::iter::from_fn(move || {
        loop {
            match rest.next()? {
                ESCAPE => match rest.next()? {
                    b'[' => rest.find(|key| (0x40..=0x7e).contains(key)).map(|_| ())?,
                    b'O' => rest.next().map(|_| ())?,
                    _ => {} // Alt and a key
                },
                key => return Some(key),
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_ctrl_c_and_q_stop_the_worm_and_ctrl_z_suspends() {
        for (keys, wish) in [
            (b"q".as_slice(), Wish::Stop),
            (b"\x03", Wish::Stop),
            (b"xq", Wish::Stop),
            (b"\x1b[A", Wish::GoOn),
            (b"\x1bq", Wish::GoOn),
            (b"\x1b[Aq", Wish::Stop),
            (b"\x1bOPq", Wish::Stop),
            (b"\x1b[1;5Dx", Wish::GoOn),
            (b"\x1b[", Wish::GoOn),
            (b"\x1a", Wish::Suspend),
        ] {
            assert_eq!(wish_of(keys, |_| ()), wish, "{keys:?}");
        }
        let mut handed = String::new();
        wish_of(b"c\x1b[A1\x1bOP\x00 \xff\x1bhe", |key| handed.push(key));
        assert_eq!(handed, "c1 e", "no part of a sequence is a key");
    }
}
