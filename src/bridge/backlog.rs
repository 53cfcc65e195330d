//! What waits for one laptop: bounded whatever the network does, and the newest first.
//!
//! Of each worm one frame waits at most. A newer one takes its place, with the cycles, alarms, commands and events of the older one, and the
//! lost frame is counted. So a slow or silent laptop costs memory that does not grow, and when it takes something again, it gets the worm
//! as it is now. How much may be under way without being confirmed is bounded too: what lies in buffers of the network is old.
//!
//! Pure: times are arguments, ns of one clock.

use super::pieces;
use super::wire::{Beat, Down, Echo, RemoteWatcher};
use crate::relay::wire::{Answer, Frame, Hello, Line};
use std::collections::VecDeque;

/// What may be under way, bytes.
const WINDOW: usize = 96 << 10;
/// While the oldest piece has been under way for so long, nothing more is sent, ns: the network holds back what would be old when it comes.
const HELD_UP_NS: u64 = 700_000_000;
/// After so long without a word on what is under way it is lost, ns.
const STUCK_NS: u64 = 3_000_000_000;
/// Answers that may wait.
const MAX_ANSWERS: usize = 256;
/// Gait cycles, alarms, commands and events that are kept of lost frames; as many as a relay keeps.
const MAX_KEPT: usize = 256;
/// Pieces whose time of sending is known.
const MAX_TIMES: usize = 4096;

/// What waits for a laptop.
#[derive(Debug)]
pub(crate) struct Backlog {
    stream: u64,
    next: u64,
    /// Pieces under way: number, size, when they were sent.
    under_way: VecDeque<(u64, usize, u64)>,
    under_way_bytes: usize,
    /// Since when nothing of it was confirmed.
    waiting_ns: u64,
    /// When the newest pieces were sent, by their numbers.
    times: VecDeque<(u64, u64)>,
    /// What is left of the message that is being sent.
    current: VecDeque<Vec<u8>>,
    answers: VecDeque<(RemoteWatcher, Answer)>,
    beat: Option<Beat>,
    worms: Vec<Waiting>,
    /// The worm whose turn it is.
    turn: usize,
}

/// What waits of one worm.
#[derive(Debug)]
struct Waiting {
    name: String,
    hello: Option<Box<Hello>>,
    frame: Option<Box<Frame>>,
    lost: u64,
}

impl Backlog {
    /// Nothing waits. `stream` is that of no earlier one for this laptop.
    pub(crate) fn new(stream: u64, worms: impl IntoIterator<Item = String>) -> Self {
        let waiting = |name| Waiting {
            name,
            hello: None,
            frame: None,
            lost: 0,
        };
        Self {
            stream,
            next: 0,
            under_way: VecDeque::new(),
            under_way_bytes: 0,
            waiting_ns: 0,
            times: VecDeque::new(),
            current: VecDeque::new(),
            answers: VecDeque::new(),
            beat: None,
            worms: worms.into_iter().map(waiting).collect(),
            turn: 0,
        }
    }

    /// Adds a line of a worm's relay, by the worm's index.
    pub(crate) fn add_line(&mut self, worm: usize, line: Line) {
        let Some(waiting) = self.worms.get_mut(worm) else {
            return;
        };
        match line {
            Line::Hello(hello) => {
                // The history has what the frames before it said.
                waiting.hello = Some(hello);
                waiting.frame = None;
            }
            Line::Frame(mut frame) => {
                if let Some(older) = waiting.frame.take() {
                    put_before(older.cycles, &mut frame.cycles);
                    put_before(older.alarms, &mut frame.alarms);
                    put_before(older.commands, &mut frame.commands);
                    put_before(older.events, &mut frame.events);
                    waiting.lost += 1;
                }
                waiting.frame = Some(frame);
            }
            Line::Lost { frames } => waiting.lost += frames,
            // Answers go to who asked, and a refused connection is the bridge's own matter.
            Line::Answer(_) | Line::Refused { .. } => {}
        }
    }

    /// Adds an answer.
    pub(crate) fn add_answer(&mut self, to: RemoteWatcher, answer: Answer) {
        if self.answers.len() == MAX_ANSWERS {
            self.answers.pop_front();
        }
        self.answers.push_back((to, answer));
    }

    /// Takes over the answers that wait in another one.
    pub(crate) fn adopt_answers(&mut self, other: Self) {
        self.answers = other.answers;
    }

    /// Says that the bridge is there, in the place of what was to be said before.
    pub(crate) fn beat(&mut self, beat: Beat) {
        self.beat = Some(beat);
    }

    /// Takes what the laptop has received.
    pub(crate) fn confirm(&mut self, echo: Echo, now_ns: u64) {
        if echo.stream != self.stream {
            return;
        }
        while let Some(&(sequence, bytes, _)) = self.under_way.front()
            && sequence <= echo.sequence
        {
            self.under_way.pop_front();
            self.under_way_bytes -= bytes;
            self.waiting_ns = now_ns;
        }
    }

    /// Whether this is what the laptop reads at present.
    pub(crate) fn is_read_by(&self, echo: Option<Echo>) -> bool {
        echo.is_some_and(|echo| echo.stream == self.stream)
    }

    /// Whether what is under way must be lost: then another stream is to begin.
    pub(crate) fn is_stuck(&self, now_ns: u64) -> bool {
        !self.under_way.is_empty() && now_ns.saturating_sub(self.waiting_ns) >= STUCK_NS
    }

    /// How long ago at most a message with this echo was sent: as long as the echoed piece and the message were under way together, ns.
    /// None where that cannot be known.
    pub(crate) fn age_ns(&self, echo: Echo, now_ns: u64) -> Option<u64> {
        let first = self.times.front()?.0;
        let index = usize::try_from(echo.sequence.checked_sub(first)?).ok()?;
        let (_, sent_ns) = self.times.get(index).filter(|_| echo.stream == self.stream)?;
        let held_ns = echo.held_ms.saturating_mul(1_000_000);
        Some(now_ns.saturating_sub(*sent_ns).saturating_sub(held_ns))
    }

    /// The next piece to send, if there is one and it may be sent.
    ///
    /// # Errors
    /// When a message cannot be written.
    pub(crate) fn next(&mut self, now_ns: u64) -> std::io::Result<Option<Vec<u8>>> {
        let oldest = self.under_way.front();
        let is_held_up = oldest.is_some_and(|(_, _, sent_ns)| now_ns.saturating_sub(*sent_ns) >= HELD_UP_NS);
        if is_held_up || self.under_way_bytes >= WINDOW {
            return Ok(None);
        }
        if self.current.is_empty() {
            let Some(message) = self.next_message() else {
                return Ok(None);
            };
            let message = serde_json::to_vec(&message)?;
            self.current = pieces::cut(&message)?.into();
        }
        let Some(content) = self.current.pop_front() else {
            return Ok(None);
        };
        let sequence = self.next;
        self.next += 1;
        let rest = u32::try_from(self.current.len()).unwrap_or(u32::MAX);
        let piece = pieces::to_bytes(self.stream, sequence, rest, &content);
        if self.under_way.is_empty() {
            self.waiting_ns = now_ns;
        }
        self.under_way.push_back((sequence, piece.len(), now_ns));
        self.under_way_bytes += piece.len();
        if self.times.len() == MAX_TIMES {
            self.times.pop_front();
        }
        self.times.push_back((sequence, now_ns));
        Ok(Some(piece))
    }

    /// Answers first, then the worms in turn.
    fn next_message(&mut self) -> Option<Down> {
        if let Some((to, answer)) = self.answers.pop_front() {
            return Some(Down::Answer { to, answer });
        }
        if let Some(beat) = self.beat.take() {
            return Some(Down::Beat(beat));
        }
        for _ in 0..self.worms.len() {
            let index = self.turn % self.worms.len();
            let waiting = &mut self.worms[index];
            let is_ready = waiting.hello.is_some() || waiting.frame.is_some();
            let line = if let Some(hello) = waiting.hello.take() {
                Line::Hello(hello)
            } else if waiting.lost > 0 && is_ready {
                Line::Lost {
                    frames: std::mem::take(&mut waiting.lost),
                }
            } else if let Some(frame) = waiting.frame.take() {
                self.turn += 1;
                Line::Frame(frame)
            } else {
                self.turn += 1;
                continue;
            };
            let worm = waiting.name.clone();
            return Some(Down::Line { worm, line });
        }
        None
    }
}

/// Puts older values before newer ones, as many as are kept.
fn put_before<T>(mut older: Vec<T>, newer: &mut Vec<T>) {
    if older.is_empty() {
        return;
    }
    older.append(newer);
    let surplus = older.len().saturating_sub(MAX_KEPT);
    older.drain(..surplus);
    *newer = older;
}

#[cfg(test)]
mod tests {
    use super::super::pieces::{Assembled, Assembler};
    use super::*;
    use crate::relay::source::{Seen, Worm};
    use crate::relay::wire::Subject;
    use worm_estimator::config::Config;

    const MS: u64 = 1_000_000;

    /// A worm whose frames have one event each.
    struct Source {
        worm: Worm,
        seen: Seen,
        number: u64,
    }

    impl Source {
        fn new() -> Self {
            Self {
                worm: Worm::new(Subject::of(&Config::default())),
                seen: Seen::default(),
                number: 0,
            }
        }

        fn hello(&self) -> Line {
            Line::Hello(Box::new(self.worm.hello(0)))
        }

        fn frame(&mut self) -> Line {
            self.number += 1;
            self.worm.note(self.number, format!("event {}", self.number));
            let frame = self.worm.frame(self.number, self.number, self.seen, 1, None);
            self.seen = self.worm.seen();
            Line::Frame(Box::new(frame))
        }
    }

    /// All that may be sent now, as the laptop reads it.
    fn send(backlog: &mut Backlog, assembler: &mut Assembler, now_ns: u64) -> Vec<Down> {
        let mut read = Vec::new();
        while let Some(piece) = backlog.next(now_ns).expect("can be written") {
            if let Assembled::Message(message) = assembler.take(&piece).expect("is a piece") {
                read.push(serde_json::from_slice(&message).expect("is a message"));
            }
        }
        read
    }

    fn echo(assembler: &Assembler, held_ms: u64) -> Echo {
        let (stream, sequence) = assembler.newest().expect("something came");
        Echo {
            stream,
            sequence,
            held_ms,
        }
    }

    #[test]
    fn a_laptop_that_confirms_nothing_costs_bounded_memory_and_gets_the_newest_and_every_event_later() {
        let mut source = Source::new();
        let mut backlog = Backlog::new(1, ["w".to_owned()]);
        let mut assembler = Assembler::default();
        backlog.add_line(0, source.hello());
        let mut numbers = Vec::new();
        let mut events = 0;
        let mut lost = 0;
        let mut sent_while_silent = 0;
        // Long enough to fill the window, and then twice as long.
        for tick in 0..3000_u64 {
            backlog.add_line(0, source.frame());
            let read = send(&mut backlog, &mut assembler, tick * 50 * MS);
            if tick > 1000 && tick < 2000 {
                sent_while_silent += read.len();
            }
            // It is silent from the 100th frame to the 2000th.
            if !(100..2000).contains(&tick) {
                backlog.confirm(echo(&assembler, 0), tick * 50 * MS);
            }
            for down in read {
                let Down::Line { worm, line } = down else {
                    panic!("{down:?}")
                };
                assert_eq!(worm, "w");
                match line {
                    Line::Frame(frame) => {
                        numbers.push(frame.number);
                        events += frame.events.len() as u64;
                    }
                    Line::Lost { frames } => lost += frames,
                    Line::Hello(_) => assert!(numbers.is_empty(), "the history comes first"),
                    other => panic!("{other:?}"),
                }
            }
        }
        assert_eq!(sent_while_silent, 0, "the window is full");
        assert!(numbers.is_sorted() && numbers.last() == Some(&3000), "the newest comes");
        assert_eq!(numbers.len() as u64 + lost, 3000, "what is lost is counted");
        assert!(lost > 500, "{lost}");
        let gap = numbers.windows(2).find(|pair| pair[1] - pair[0] > 500).expect("a gap");
        assert!(
            (2000..2003).contains(&gap[1]),
            "after an outage the newest first: {gap:?}"
        );
        // As many as a relay keeps, of those between.
        assert_eq!(events, 3000 - (gap[1] - gap[0]) + MAX_KEPT as u64);
    }

    #[test]
    fn the_age_of_a_message_needs_no_clock_but_one() {
        let mut backlog = Backlog::new(5, ["w".to_owned()]);
        let mut assembler = Assembler::default();
        let mut source = Source::new();
        let age = |backlog: &Backlog, echo, now_ms: u64| backlog.age_ns(echo, now_ms * MS).map(|age_ns| age_ns / MS);
        for tick in 0..10 {
            backlog.add_line(0, source.frame());
            send(&mut backlog, &mut assembler, tick * 50 * MS);
        }
        // The last piece was sent at 450 ms, came at 500, was answered 30 ms later, and the answer came at 600: 120 ms on the way.
        let answer = echo(&assembler, 30);
        assert_eq!(age(&backlog, answer, 600), Some(120));
        // The network held the answer back for half a minute.
        assert_eq!(age(&backlog, answer, 30_600), Some(30_120));
        for unknown in [
            Echo { stream: 4, ..answer },
            Echo {
                sequence: answer.sequence + 1,
                ..answer
            },
        ] {
            assert_eq!(age(&backlog, unknown, 600), None);
        }
        assert!(!backlog.is_stuck(2900 * MS) && backlog.is_stuck(3100 * MS));
        backlog.confirm(answer, 2900 * MS);
        assert!(!backlog.is_stuck(9000 * MS), "everything has come");
    }
}
