//! The watch screen: keys become requests, lines of the relay become the picture. Pure: times are arguments, ns of one clock.

use super::delay::Delay;
use super::fault::LatchedFault;
use super::ghost;
use super::picture::Picture;
use super::view::{self, Panel, View};
use crate::relay::message_json::Json;
use crate::relay::wire::{Answer, Line as Received, Request, Subject};
use crate::trip::wire::Ask;
use ratatui::Frame;
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::Line;
use std::collections::VecDeque;
use worm_estimator::message::{Mode, TripPhase};
use worm_estimator::time::seconds;
use worm_physics::MAX_CELLS;
use worm_plan::Ghost;
use worm_plan::ghost::SILENCE_NS;

/// After this time values count as old, ns.
const STALE_NS: u64 = 1_000_000_000;
/// A trip says twice a second how it stands, ns.
const TRIP_SILENCE_NS: u64 = 2_000_000_000;
/// How long the question "once more?" stands, ns.
const ASK_NS: u64 = 5_000_000_000;
/// How long a message stands in the status line, ns.
const MESSAGE_NS: u64 = 6_000_000_000;
/// How many lines of the log are kept.
const LOG_LINES: usize = 100;

/// Whose screen it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Seat {
    /// That of `wormd up`: leaving stops the worm.
    Up,
    /// That of `wormd watch`: leaving leaves the worm to others.
    Watch,
}

/// The screen of one watcher.
pub(crate) struct App {
    seat: Seat,
    picture: Picture,
    /// Where the worm is while nothing is heard of it.
    ghost: Ghost,
    /// How long frames from a robot elsewhere wait on the way.
    delay: Delay,
    /// The number by which the relay knows this watcher.
    me: Option<u64>,
    panel: Panel,
    /// A key that is to be pressed once more, and until when.
    asked: Option<(char, u64)>,
    /// The newest message, whether it is a refusal, and until when it stands.
    message: Option<(String, bool, u64)>,
    log: VecDeque<String>,
    /// When the newest line came; none without a connection.
    heard_ns: Option<u64>,
    /// Why there is no connection.
    problem: Option<String>,
    last_request: u64,
}

impl App {
    /// A screen that has heard nothing yet. `name` is that of the worm.
    pub(crate) fn new(seat: Seat, subject: Subject) -> Self {
        Self {
            seat,
            picture: Picture::new(subject),
            ghost: Ghost::default(),
            delay: Delay::default(),
            me: None,
            panel: Panel::Overview,
            asked: None,
            message: None,
            log: VecDeque::new(),
            heard_ns: None,
            problem: None,
            last_request: 0,
        }
    }

    /// Takes a line of the relay.
    pub(crate) fn take(&mut self, line: Received, now_ns: u64) {
        self.heard_ns = Some(now_ns);
        self.problem = None;
        match line {
            Received::Hello(hello) => {
                hello.cycles.iter().for_each(|Json(cycle)| self.ghost.note_cycle(cycle));
                self.picture.take_hello(*hello);
            }
            Received::Frame(frame) => {
                let frame = *frame;
                for event in &frame.events {
                    self.note(event.text.clone());
                }
                frame.cycles.iter().for_each(|Json(cycle)| self.ghost.note_cycle(cycle));
                self.picture.take_frame(frame);
                self.hear(now_ns);
            }
            Received::Answer(answer) => self.take_answer(answer, now_ns),
            Received::Lost { frames } => self.note(match &self.picture.network {
                None => format!("{frames} frames were left out: this screen did not take them"),
                Some(network) => format!("{frames} frames were lost on the way from {}", network.robot),
            }),
            Received::Refused { reason } => self.say(reason, true, now_ns),
        }
    }

    /// What has just come is of the worm as it is now, unless it waited on the way, or the worm is silent behind the relay.
    fn hear(&mut self, now_ns: u64) {
        let picture = &self.picture;
        let frame_ns = match &picture.network {
            None => now_ns.saturating_sub(picture.time_ns),
            // Of another computer's clock. The quickest took a round trip at most.
            Some(network) => {
                let round_trip_ns = network.round_trip_ms.unwrap_or(0).saturating_mul(1_000_000);
                let waited_ns = self.delay.take(&network.boot_id, picture.time_ns, now_ns);
                round_trip_ns.saturating_add(waited_ns)
            }
        };
        let age_ns = |age_ms: Option<u64>| age_ms.map(|ms| frame_ns.saturating_add(ms.saturating_mul(1_000_000)));
        let is_fresh = [picture.ages.state, picture.ages.estimate]
            .iter()
            .all(|&age_ms| age_ns(age_ms).is_some_and(|age_ns| age_ns < SILENCE_NS));
        let (Some(state), Some(estimate), true) = (&picture.state, &picture.estimate, is_fresh) else {
            return;
        };
        let trip = picture
            .trip
            .as_ref()
            .filter(|_| age_ns(picture.ages.trip).is_some_and(|age_ns| age_ns < TRIP_SILENCE_NS));
        let is_attended = picture.driver.as_ref().is_some_and(|driver| driver.attends);
        if let Some(score) = self.ghost.hear(state, estimate, trip, is_attended, now_ns) {
            let text = ghost::score_text(&score);
            self.note(text.clone());
            self.say(text, false, now_ns);
        }
    }

    fn take_answer(&mut self, answer: Answer, now_ns: u64) {
        // A driver of an earlier connection is not this one.
        self.me = Some(answer.watcher);
        match (answer.refusal, answer.command.as_str()) {
            (Some(refusal), _) => self.say(refusal, true, now_ns),
            (None, "hello" | "drive") => {}
            (None, "take_over") => self.say("you drive".to_owned(), false, now_ns),
            (None, command) => self.say(format!("{command} {}", answer.verdict), false, now_ns),
        }
    }

    /// Takes the answer to a hold that went past the relay.
    pub(crate) fn take_direct(&mut self, answer: &Answer, now_ns: u64) {
        let more = answer.refusal.as_deref().or(answer.note.as_deref());
        let text = format!("hold {}: {}", answer.verdict, more.unwrap_or_default());
        self.note(text.clone());
        self.say(text, answer.refusal.is_some(), now_ns);
    }

    /// The connection is gone.
    pub(crate) fn lose(&mut self, reason: String, now_ns: u64) {
        self.note(reason.clone());
        self.say(reason.clone(), true, now_ns);
        self.problem = Some(reason);
        self.me = None;
    }

    /// Why there is still no connection.
    pub(crate) fn explain(&mut self, problem: &str, now_ns: u64) {
        if self.problem.as_deref() != Some(problem) {
            self.lose(problem.to_owned(), now_ns);
        }
    }

    /// Adds a line to the log.
    pub(crate) fn note(&mut self, line: String) {
        if self.log.len() == LOG_LINES {
            self.log.pop_front();
        }
        self.log.push_back(line);
    }

    /// The log, when the screen is closed.
    pub(crate) fn take_log(&mut self) -> impl Iterator<Item = String> + '_ {
        self.log.drain(..)
    }

    fn say(&mut self, text: String, is_refusal: bool, now_ns: u64) {
        self.message = Some((text, is_refusal, now_ns.saturating_add(MESSAGE_NS)));
    }

    /// Takes a key; returns what it asks of the relay, with its number.
    pub(crate) fn key(&mut self, key: char, now_ns: u64) -> Option<(u64, Request)> {
        let asked = self.asked.take().filter(|(_, until_ns)| now_ns < *until_ns);
        let is_confirmed = asked.is_some_and(|(asked, _)| asked == key);
        let request = match key {
            'c' | 'r' | 'b' if !is_confirmed => {
                self.asked = Some((key, now_ns.saturating_add(ASK_NS)));
                None
            }
            'c' if self.needs_arming() => Some(Request::Arm),
            'c' => Some(Request::Crawl { cycles_per_s: None }),
            'r' => Some(Request::Reset),
            'b' => Some(Request::Trip { action: Ask::Return }),
            'p' if self.trip_waits() && !is_confirmed => {
                self.asked = Some((key, now_ns.saturating_add(ASK_NS)));
                None
            }
            'p' => Some(Request::Trip {
                action: if self.trip_waits() { Ask::Resume } else { Ask::Pause },
            }),
            'h' | ' ' => Some(Request::Hold),
            's' => Some(Request::Stop),
            't' => Some(Request::TakeOver),
            'k' => Some(Request::Acknowledge { alarms: Vec::new() }),
            _ => {
                self.turn(key);
                None
            }
        }?;
        self.last_request += 1;
        Some((self.last_request, request))
    }

    /// A request got no further than this process.
    pub(crate) fn not_sent(&mut self, now_ns: u64) {
        self.say("not sent: there is no connection to the relay".to_owned(), true, now_ns);
    }

    /// Turns to another page; the key of the present one turns back.
    fn turn(&mut self, key: char) {
        let cells = self.picture.subject.cells.clamp(1, MAX_CELLS);
        let wanted = match (key, self.panel) {
            ('1'..='9', _) => Panel::Cell(key as usize - '1' as usize),
            ('n', Panel::Cell(cell)) => Panel::Cell((cell + 1) % cells),
            ('e', _) => Panel::Energy,
            ('a', _) => Panel::Alarms,
            ('?', _) => Panel::Help,
            _ => return,
        };
        match wanted {
            Panel::Cell(cell) if cell >= cells => {}
            wanted if wanted == self.panel => self.panel = Panel::Overview,
            wanted => self.panel = wanted,
        }
    }

    fn trip_waits(&self) -> bool {
        let holding = TripPhase::Holding.code();
        self.picture.trip.is_some_and(|trip| trip.phase == holding)
    }

    fn needs_arming(&self) -> bool {
        self.picture
            .state
            .is_some_and(|state| state.mode == Mode::Disarmed.code())
    }

    /// Whether this screen drives.
    fn drives(&self) -> bool {
        self.me.is_some() && self.picture.driver.as_ref().map(|driver| driver.watcher) == self.me
    }

    /// Whether no other watcher was connected when the relay was last heard.
    pub(crate) fn is_alone(&self) -> bool {
        self.picture.watchers <= 1
    }

    /// Whether the worm crawls for as long as this screen is here.
    fn attends(&self) -> bool {
        self.drives() && self.picture.driver.as_ref().is_some_and(|driver| driver.attends)
    }

    /// Paints the screen.
    pub(crate) fn draw(&self, frame: &mut Frame<'_>, now_ns: u64) {
        view::draw(
            frame,
            &View {
                picture: &self.picture,
                status: self.status(now_ns),
                ghost: self.stale(now_ns).and_then(|_| self.ghost.predict(now_ns)),
                stale: self.stale(now_ns),
                panel: self.panel,
                leaving: match (self.seat, self.attends()) {
                    (Seat::Up, _) => "Ctrl-C or q stops the worm",
                    (Seat::Watch, true) => "q leaves, and the worm holds",
                    (Seat::Watch, false) => "q leaves; the worm goes on",
                },
                log: &self.log,
            },
        );
    }

    /// What is silent, and for how long.
    fn stale(&self, now_ns: u64) -> Option<String> {
        let Some(heard_ns) = self.heard_ns else {
            let problem = self.problem.as_deref().unwrap_or("waiting for the relay");
            return Some(problem.to_owned());
        };
        let unheard_ns = now_ns.saturating_sub(heard_ns);
        if unheard_ns >= STALE_NS {
            let s = seconds(unheard_ns);
            return Some(match &self.problem {
                Some(problem) => format!("{s:.0} s old: {problem}"),
                None => format!("nothing heard of the relay for {s:.0} s"),
            });
        }
        let of = |what: &str, age_ms: Option<u64>| {
            let age_ns = age_ms?.saturating_mul(1_000_000).saturating_add(unheard_ns);
            (age_ns >= STALE_NS).then(|| format!("no {what} for {:.0} s", seconds(age_ns)))
        };
        let ages = self.picture.ages;
        of("state", ages.state).or_else(|| of("estimate", ages.estimate))
    }

    /// The line below the head.
    fn status(&self, now_ns: u64) -> Line<'_> {
        if let Some((key, _)) = self.asked.filter(|(_, until_ns)| now_ns < *until_ns) {
            let what = match key {
                'r' => "reset the worm: torque on, motion permitted",
                'b' => "let the trip go home",
                'p' => "let the trip go on",
                _ if self.needs_arming() => "arm the worm: torque on",
                _ => "make the worm crawl, for as long as this screen is here",
            };
            return Line::from(format!(" {key} once more to {what} "))
                .style(Style::new().fg(Color::Black).bg(Color::Yellow));
        }
        if let Some((text, is_refusal, _)) = self.message.as_ref().filter(|(_, _, until_ns)| now_ns < *until_ns) {
            let colour = if *is_refusal { Color::Red } else { Color::Green };
            return Line::from(format!(" {text}")).fg(colour);
        }
        let drivers = self.drivers();
        match LatchedFault::of(&self.picture) {
            Some(fault) => Line::from(vec![
                format!(" fault {}; a: what to do, r twice: reset. ", fault.cause)
                    .fg(Color::Red)
                    .bold(),
                drivers.fg(Color::DarkGray),
            ]),
            None => Line::from(format!(" {drivers}")).fg(Color::DarkGray),
        }
    }

    /// Who drives.
    fn drivers(&self) -> String {
        let Some(driver) = &self.picture.driver else {
            return "nobody drives".to_owned();
        };
        let name = if self.drives() {
            "you drive"
        } else {
            driver.name.as_str()
        };
        let attends = if driver.attends {
            ", and the worm crawls while this lasts"
        } else {
            ""
        };
        let verb = if self.drives() { "" } else { " drives" };
        let since_s = driver.since_ms / 1000;
        format!("{name}{verb} since {since_s} s ago{attends}")
    }
}
