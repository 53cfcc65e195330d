//! The watch screen on a terminal: the relay's lines in, the picture out, and keys back to the relay.

use super::Painter;
use crate::command::{Failure, print};
use crate::realtime::monotonic_ns;
use crate::relay::client::{Received, RelayLink};
use crate::relay::direct_hold::HoldWatch;
use crate::relay::wire::{Answer, Line, Request, Subject};
use crate::supervisor::child_process::LogLines;
use crate::topics::{Instance, Relay, RoleLock};
use crate::watch::app::{App, Seat};
use ratatui::DefaultTerminal;
use std::ffi::OsString;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;

/// How long `wormd up` waits at its end for the relay that it alone has used: less than its screen may take to close.
const RELAY_TIMEOUT: Duration = Duration::from_millis(400);

/// The screen of one watcher. That it paints is its sign of life: a terminal that takes nothing any more attends to nothing.
pub(crate) struct WatchScreen {
    /// None once it is given back.
    terminal: Option<Box<DefaultTerminal>>,
    app: App,
    link: RelayLink,
    /// Holds that the relay has not answered yet.
    holds: HoldWatch,
    seat: Seat,
    instance: Instance,
    /// Log lines of the worm's own processes, for `wormd up`.
    log: Option<LogLines>,
    is_greeted: bool,
}

impl WatchScreen {
    /// The link of a screen. `arguments` select the worm for a relay.
    pub(crate) fn link(instance: &Instance, arguments: Vec<OsString>, seat: Seat) -> RelayLink {
        RelayLink::new(instance, arguments, name_of(seat))
    }

    /// Takes the terminal.
    ///
    /// # Errors
    /// [`Failure::Failed`] when it cannot be used.
    pub(crate) fn open(
        seat: Seat,
        config: &Config,
        instance: &Instance,
        link: RelayLink,
        log: Option<LogLines>,
    ) -> Result<Self, Failure> {
        Ok(Self {
            terminal: Some(Box::new(init(seat)?)),
            app: App::new(seat, Subject::of(config)),
            link,
            holds: HoldWatch::new(instance),
            seat,
            instance: instance.clone(),
            log,
            is_greeted: false,
        })
    }

    fn take_new(&mut self) {
        if let Some(log) = &mut self.log {
            log.take_new().for_each(|line| self.app.note(line.to_string()));
        }
        let now_ns = monotonic_ns();
        for received in self.link.poll() {
            match received {
                Received::Line(line) => {
                    let is_stale = matches!(&line, Line::Answer(it) if it.command == "drive" && it.verdict == "stale");
                    self.is_greeted &= !is_stale;
                    if let Line::Answer(Answer { id: Some(id), .. }) = &line {
                        self.holds.answered(*id);
                    }
                    self.app.take(line, now_ns);
                }
                // What is of interest in it comes with the frames, too.
                Received::Log(line) => tracing::debug!("relay: {line}"),
                Received::Lost(reason) => {
                    self.is_greeted = false;
                    self.app.lose(reason, now_ns);
                }
            }
        }
        for answer in self.holds.poll() {
            self.app.take_direct(&answer, now_ns);
        }
        if let Some(problem) = self.link.problem() {
            self.app.explain(problem, now_ns);
        }
        // Who started the worm drives it, until somebody takes over.
        if self.seat == Seat::Up && !self.is_greeted {
            self.is_greeted = self.link.send(0, Request::Drive);
        }
    }

    fn draw(&mut self) -> Result<(), Failure> {
        let now_ns = monotonic_ns();
        let app = &self.app;
        let Some(terminal) = &mut self.terminal else {
            return Ok(());
        };
        terminal
            .draw(|frame| app.draw(frame, now_ns))
            .map(drop)
            .map_err(|error| Failure::failed(format!("the terminal is gone: {error}")))
    }

    /// Gives the terminal back.
    fn restore(&mut self) {
        let Some(mut terminal) = self.terminal.take() else {
            return;
        };
        let cursor = terminal.show_cursor();
        if let Err(error) = ratatui::try_restore().and(cursor) {
            tracing::debug!("the terminal could not be restored: {error}");
            // Its drop would print to a standard error that is gone, and panic.
            Box::leak(terminal);
        }
    }
}

impl Painter for WatchScreen {
    fn key(&mut self, key: char) {
        let now_ns = monotonic_ns();
        let Some((id, request)) = self.app.key(key, now_ns) else {
            return;
        };
        if request == Request::Hold {
            self.holds.asked(id, &name_of(self.seat));
        }
        if !self.link.send(id, request) {
            self.app.not_sent(now_ns);
        }
    }

    fn show(&mut self) -> Result<(), Failure> {
        self.take_new();
        self.draw()
    }

    fn leave(&mut self) {
        self.restore();
    }

    fn enter(&mut self) -> Result<(), Failure> {
        self.terminal = Some(Box::new(init(self.seat)?));
        Ok(())
    }

    fn close(&mut self) {
        self.restore();
        if let Some(log) = &mut self.log {
            log.take_new().for_each(|line| self.app.note(line.to_string()));
            self.app.take_log().for_each(print::log_line);
        }
        self.link.close();
        let begun = Instant::now();
        // A relay without watchers ends with its worm, and nothing is to be left of it.
        while self.seat == Seat::Up
            && self.app.is_alone()
            && RoleLock::<Relay>::holder(&self.instance).is_some()
            && begun.elapsed() < RELAY_TIMEOUT
        {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

fn init(seat: Seat) -> Result<DefaultTerminal, Failure> {
    let remedy = match seat {
        Seat::Up => "try --plain",
        Seat::Watch => "`wormd watch` needs a terminal; for scripts there is the relay's socket, see docs/relay.md",
    };
    ratatui::try_init().map_err(|error| Failure::failed(format!("the terminal cannot be used ({error}): {remedy}")))
}

/// The name under which a screen watches.
fn name_of(seat: Seat) -> String {
    match seat {
        Seat::Up => "wormd up".to_owned(),
        Seat::Watch => own_name(),
    }
}

/// A name by which the others may know who this is: user, and over ssh from where.
fn own_name() -> String {
    let user = nix::unistd::User::from_uid(nix::unistd::getuid()).ok().flatten();
    let user = user.map_or_else(|| nix::unistd::getuid().to_string(), |user| user.name);
    match std::env::var("SSH_CONNECTION") {
        Ok(connection) => format!("{user} from {}", connection.split(' ').next().unwrap_or_default()),
        Err(_) => user,
    }
}
