//! The pipe from a parent: standard input of a process that was started with `--supervised`.
//!
//! A parent-death signal would not do: the kernel forgets it when a binary with file capabilities is executed. The end of a pipe
//! comes whatever the binary may do, and however the parent dies.

use crate::realtime;
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::io;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::time::Duration;

/// Silence is counted in steps of this: a pause of the whole computer counts as one step at most.
const STEP_MS: u8 = 20;

/// What a process knows of its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parent {
    /// Nobody who watches over this process: it was started by itself.
    None,
    /// It is there, and says so.
    Here,
    /// It has not said anything for as long as its lease lasts.
    Silent,
    /// It has ended.
    Gone,
}

impl Parent {
    const ALL: [Self; 4] = [Self::None, Self::Here, Self::Silent, Self::Gone];

    /// As a word.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Here => "here",
            Self::Silent => "silent",
            Self::Gone => "gone",
        }
    }
}

/// Reads standard input in a thread of its own.
#[derive(Debug, Clone)]
pub struct ParentPipe {
    lease: Duration,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    state: AtomicU8,
    unheard: AtomicU32, // ticks since the thread last listened
}

impl ParentPipe {
    /// Watches standard input: silence for `lease` counts as a silent parent, the end of the pipe as the parent's end. The thread
    /// gets the real-time priority `priority` where the system allows it; 0 for none.
    ///
    /// # Errors
    /// When there is no thread to be had.
    pub fn watch(lease: Duration, priority: u8) -> io::Result<Self> {
        let pipe = Self::of(lease);
        let there = pipe.clone();
        std::thread::Builder::new().name("parent".to_owned()).spawn(move || {
            if priority > 0 {
                // Where it is refused, so is the loop's own, which is reported.
                let _ = realtime::set_fifo(priority);
            }
            there.read();
        })?;
        Ok(pipe)
    }

    fn of(lease: Duration) -> Self {
        let shared = Shared {
            state: AtomicU8::new(Parent::Here as u8),
            unheard: AtomicU32::new(0),
        };
        Self {
            lease,
            shared: Arc::new(shared),
        }
    }

    /// What is known now.
    pub fn state(&self) -> Parent {
        let code = self.shared.state.load(Ordering::Acquire);
        Parent::ALL.get(usize::from(code)).copied().unwrap_or(Parent::Gone)
    }

    /// What is known in this tick of the loop, one every `period`. A parent to whom nobody listens is silent: the thread that
    /// listens might not get a CPU while the loop does. Time is counted in ticks, so a pause of the whole computer does not count.
    pub fn state_in_tick(&self, period: Duration) -> Parent {
        let unheard = self.shared.unheard.fetch_add(1, Ordering::Relaxed).saturating_add(1);
        let is_unheard = period.saturating_mul(unheard) >= self.lease;
        match self.state() {
            Parent::Here if is_unheard => Parent::Silent,
            state => state,
        }
    }

    fn listened(&self, state: Parent) {
        self.shared.state.store(state as u8, Ordering::Release);
        self.shared.unheard.store(0, Ordering::Relaxed);
    }

    /// Reads until the end of the pipe.
    fn read(&self) {
        let stdin = io::stdin();
        let mut silence = Silence::of(self.lease);
        let mut bytes = [0; 256];
        loop {
            let mut readable = [PollFd::new(stdin.as_fd(), PollFlags::POLLIN)];
            let state = match poll(&mut readable, PollTimeout::from(STEP_MS)) {
                Ok(0) => silence.step(),
                Err(Errno::EINTR) => continue,
                Ok(_) => match nix::unistd::read(stdin.as_fd(), &mut bytes) {
                    Ok(0) => Parent::Gone,
                    Ok(_) => silence.broken(),
                    Err(Errno::EINTR | Errno::EAGAIN) => continue,
                    Err(_) => Parent::Gone,
                },
                Err(_) => Parent::Gone,
            };
            self.listened(state);
            if state == Parent::Gone {
                return;
            }
        }
    }
}

/// Silence of the parent while this process ran to hear it.
struct Silence {
    lease: Duration,
    lasted: Duration,
}

impl Silence {
    fn of(lease: Duration) -> Self {
        let lasted = Duration::ZERO;
        Self { lease, lasted }
    }

    /// One more step without a word.
    fn step(&mut self) -> Parent {
        self.lasted = self.lasted.saturating_add(Duration::from_millis(STEP_MS.into()));
        if self.lasted >= self.lease {
            Parent::Silent
        } else {
            Parent::Here
        }
    }

    fn broken(&mut self) -> Parent {
        self.lasted = Duration::ZERO;
        Parent::Here
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lease_lapses_after_its_time_of_silence_and_comes_back_with_a_word() {
        let mut silence = Silence::of(Duration::from_millis(100));
        let heard: Vec<_> = (0..6).map(|_| silence.step()).collect();
        let (here, silent) = (Parent::Here, Parent::Silent);
        assert_eq!(heard, [here, here, here, here, silent, silent]);
        assert_eq!((silence.broken(), silence.step()), (here, here));
    }

    #[test]
    fn a_parent_to_whom_nobody_listens_is_silent() {
        let pipe = ParentPipe::of(Duration::from_millis(100));
        let tick = Duration::from_millis(25);
        let in_ticks = || -> Vec<_> { (0..5).map(|_| pipe.state_in_tick(tick)).collect() };
        let (here, silent) = (Parent::Here, Parent::Silent);
        assert_eq!(in_ticks(), [here, here, here, silent, silent]);
        pipe.listened(Parent::Here);
        assert_eq!(in_ticks(), [here, here, here, silent, silent]);
        pipe.listened(Parent::Gone);
        assert_eq!(in_ticks(), [Parent::Gone; 5]);
    }
}
