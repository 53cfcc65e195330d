//! What is known of the worm, and the events that tell pages. Pure: times are arguments, ns of `CLOCK_MONOTONIC`.
//!
//! Each page has a [`Cursor`]. The next event for it is the history where it has none (it has just come, or a new relay has more), then
//! the newest frame with all cycles, alarms and events since its last one, so a slow page loses pictures and no facts. No page has a queue.

use crate::relay::History;
use crate::relay::message_json::Json;
use crate::relay::wire::{Ages, Event, Frame, Hello, Sample, Subject};
use crate::remedy;
use crate::trip::words;
use crate::watch::breakdown::Breakdown;
use crate::watch::picture::Picture;
use crate::watch::{alarm_text, recording};
use axum::body::Bytes;
use serde::Serialize;
use std::collections::BTreeMap;
use worm_estimator::message::{Alarm, AlarmKind, Cycle, Fault};

/// After so long without a frame pages are told, and told again each time, ns.
const SILENCE_NS: u64 = 500_000_000;
/// What is older counts as old, ms.
pub(super) const STALE_MS: u64 = 1000;

/// All that is known of a worm.
pub(super) struct Feed {
    pub(super) picture: Picture,
    /// Version of the relay's `wormd`, and the kernel's name for the computer's run.
    wormd: String,
    boot_id: String,
    /// Counts histories: a page that has another one needs this one.
    epoch: u64,
    frames: u64,
    frame: Option<Frame>,
    /// The history to which the newest frame belongs: one of a relay before says nothing new.
    frame_epoch: u64,
    /// When the newest frame came.
    frame_ns: u64,
    /// What there was before it.
    before: Seen,
    /// The newest frame for pages that have all before it.
    frame_event: Bytes,
    /// The history, until there is more of it.
    hello_event: Option<Bytes>,
    connection: Connection,
    /// Counts what was said about the connection.
    statuses: u64,
    status_ns: u64,
}

/// How it stands with the relay.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Connection {
    /// Whether there is a connection.
    pub(super) connected: bool,
    /// Why not.
    pub(super) problem: Option<String>,
}

/// What a page has.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Cursor {
    epoch: u64,
    frames: u64,
    statuses: u64,
    seen: Seen,
}

/// How much of each list.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Seen {
    cycles: u64,
    alarms: u64,
    events: u64,
}

/// The first event of a page.
#[derive(Serialize)]
struct PageHello<'a> {
    wormd: &'a str,
    boot_id: &'a str,
    time_ns: u64,
    worm: &'a Subject,
    samples: Vec<Sample>,
    cycles: Vec<Json<Cycle>>,
    energy: Vec<Breakdown>,
    alarms: Vec<Json<Alarm>>,
    events: Vec<Event>,
    remedies: BTreeMap<&'static str, String>,
    fault_remedies: BTreeMap<&'static str, String>,
}

/// What a frame has beside what the relay says: in words, and computed, so that each is done in one place.
#[derive(Serialize)]
struct Extra {
    energy: Vec<Breakdown>,
    raised_text: Vec<String>,
    recording_text: Option<String>,
    trip_text: Option<String>,
    trip_energy_text: Option<String>,
}

/// What the server says about itself beside the relay's frame.
#[derive(Serialize)]
struct ServerStatus<'a> {
    #[serde(flatten)]
    connection: &'a Connection,
    frame_age_ms: Option<u64>,
    time_ns: u64,
}

impl Feed {
    /// Nothing is known yet but the configuration.
    pub(super) fn new(subject: Subject) -> Self {
        Self {
            picture: Picture::new(subject),
            wormd: env!("CARGO_PKG_VERSION").to_owned(),
            boot_id: String::new(),
            // A page begins with none.
            epoch: 1,
            frames: 0,
            frame: None,
            frame_epoch: 0,
            frame_ns: 0,
            before: Seen::default(),
            frame_event: Bytes::new(),
            hello_event: None,
            connection: Connection {
                connected: false,
                problem: None,
            },
            statuses: 0,
            status_ns: 0,
        }
    }

    /// Takes what a relay says first.
    pub(super) fn take_hello(&mut self, hello: Hello) {
        self.connection = Connection {
            connected: true,
            problem: None,
        };
        if hello.boot_id != self.boot_id && !self.boot_id.is_empty() {
            // The computer's clock began anew: nothing that was seen has a time any more.
            self.picture = Picture::new(hello.worm.clone());
        }
        self.wormd.clone_from(&hello.wormd);
        self.boot_id.clone_from(&hello.boot_id);
        self.picture.take_hello(hello);
        self.epoch += 1;
        self.hello_event = None;
    }

    /// Takes a frame.
    pub(super) fn take_frame(&mut self, frame: Frame, now_ns: u64) {
        self.before = self.seen();
        self.frame = Some(frame.clone());
        self.picture.take_frame(frame);
        self.frames += 1;
        self.frame_epoch = self.epoch;
        self.frame_ns = now_ns;
        self.hello_event = None;
        self.frame_event = self.frame_since(self.before);
    }

    /// There is no connection, for this reason. True when that is new.
    pub(super) fn lose(&mut self, problem: &str, now_ns: u64) -> bool {
        let lost = Connection {
            connected: false,
            problem: Some(problem.to_owned()),
        };
        let is_new = self.connection != lost;
        if is_new {
            self.connection = lost;
            self.say_status(now_ns);
        }
        is_new
    }

    /// Whether pages are to be told that nothing comes.
    pub(super) fn is_silent(&mut self, now_ns: u64) -> bool {
        let last_ns = self.frame_ns.max(self.status_ns);
        let is_due = now_ns.saturating_sub(last_ns) >= SILENCE_NS;
        if is_due {
            self.say_status(now_ns);
        }
        is_due
    }

    fn say_status(&mut self, now_ns: u64) {
        self.status_ns = now_ns;
        self.statuses += 1;
    }

    /// The next event for a page, if there is one that it does not have.
    pub(super) fn next_event(&mut self, cursor: &mut Cursor, now_ns: u64) -> Option<Bytes> {
        let newest = Cursor {
            epoch: self.epoch,
            frames: self.frames,
            statuses: self.statuses,
            seen: self.seen(),
        };
        if cursor.epoch != newest.epoch {
            // A frame has more than the history: it comes next.
            *cursor = Cursor {
                frames: self.frames.saturating_sub(1),
                statuses: self.statuses.wrapping_sub(1),
                ..newest
            };
            if self.hello_event.is_none() {
                self.hello_event = Some(event("hello", &to_json(&self.hello(now_ns)), now_ns));
            }
            return self.hello_event.clone();
        }
        if cursor.frames < newest.frames && self.frame_epoch == self.epoch {
            let has_all_before = cursor.seen == self.before && cursor.frames + 1 == newest.frames;
            let frame = match has_all_before {
                true => self.frame_event.clone(),
                false => self.frame_since(cursor.seen),
            };
            (cursor.frames, cursor.seen) = (newest.frames, newest.seen);
            return Some(frame);
        }
        if cursor.statuses != newest.statuses {
            cursor.statuses = newest.statuses;
            return Some(event("status", &to_json(&self.server_status(now_ns)), now_ns));
        }
        None
    }

    /// The newest frame with the ages as they are now, and what the server says about itself. None before the first frame.
    pub(super) fn state_json(&self, now_ns: u64) -> Option<String> {
        let mut frame = self.frame.clone()?;
        frame.age_ms = self.ages(now_ns);
        let server = to_json(&self.server_status(now_ns));
        Some(with_members(&to_json(&frame), &format!("{{\"server\":{server}}}")))
    }

    /// How old the newest messages are now: they grow old also when no frame comes.
    pub(super) fn ages(&self, now_ns: u64) -> Ages {
        let more_ms = self.frame_age_ms(now_ns).unwrap_or(0);
        let Ages {
            state,
            estimate,
            timing,
            recording,
            trip,
        } = self.picture.ages;
        let now = |age: Option<u64>| age.map(|ms| ms.saturating_add(more_ms));
        Ages {
            state: now(state),
            estimate: now(estimate),
            timing: now(timing),
            recording: now(recording),
            trip: now(trip),
        }
    }

    /// How long ago the newest frame came, ms.
    pub(super) fn frame_age_ms(&self, now_ns: u64) -> Option<u64> {
        (self.frames > 0).then(|| now_ns.saturating_sub(self.frame_ns) / 1_000_000)
    }

    /// Whether the worm's state is known and not old.
    pub(super) fn is_live(&self, now_ns: u64) -> bool {
        self.ages(now_ns).state.is_some_and(|age_ms| age_ms < STALE_MS)
    }

    /// How it stands with the relay.
    pub(super) fn connection(&self) -> &Connection {
        &self.connection
    }

    fn server_status(&self, now_ns: u64) -> ServerStatus<'_> {
        ServerStatus {
            connection: &self.connection,
            frame_age_ms: self.frame_age_ms(now_ns),
            time_ns: now_ns,
        }
    }

    fn seen(&self) -> Seen {
        Seen {
            cycles: self.picture.cycles.total(),
            alarms: self.picture.alarms.total(),
            events: self.picture.events.total(),
        }
    }

    fn hello(&self, now_ns: u64) -> PageHello<'_> {
        let picture = &self.picture;
        let remedies = AlarmKind::ALL.iter().map(|&kind| (kind.name(), remedy::of(kind)));
        let faults = Fault::ALL.iter().map(|&fault| {
            (
                fault.name(),
                remedy::of_fault(fault).map_or(String::new(), |(_, remedy)| remedy),
            )
        });
        PageHello {
            wormd: &self.wormd,
            boot_id: &self.boot_id,
            time_ns: now_ns,
            worm: &picture.subject,
            samples: History::samples(&picture.history),
            cycles: picture.cycles.iter().copied().map(Json).collect(),
            energy: picture
                .cycles
                .iter()
                .map(|cycle| Breakdown::of(cycle, &picture.subject))
                .collect(),
            alarms: picture.alarms.iter().copied().map(Json).collect(),
            events: picture.events.iter().cloned().collect(),
            remedies: remedies.collect(),
            fault_remedies: faults.collect(),
        }
    }

    /// The newest frame, with what came since.
    fn frame_since(&self, seen: Seen) -> Bytes {
        let picture = &self.picture;
        let Some(newest) = &self.frame else {
            return Bytes::new();
        };
        let cycles: Vec<_> = picture.cycles.since(seen.cycles).copied().collect();
        let extra = Extra {
            energy: cycles
                .iter()
                .map(|cycle| Breakdown::of(cycle, &picture.subject))
                .collect(),
            raised_text: picture
                .raised
                .iter()
                .map(|alarm| alarm_text::of(alarm, &picture.subject))
                .collect(),
            recording_text: picture.recording.as_ref().map(recording::progress_text),
            trip_text: picture.trip.as_ref().map(words::line),
            trip_energy_text: picture.trip.as_ref().and_then(words::energy),
        };
        let frame = Frame {
            cycles: cycles.into_iter().map(Json).collect(),
            alarms: picture.alarms.since(seen.alarms).copied().map(Json).collect(),
            // Pages have them as events.
            commands: Vec::new(),
            events: picture.events.since(seen.events).cloned().collect(),
            ..newest.clone()
        };
        event(
            "frame",
            &with_members(&to_json(&frame), &to_json(&extra)),
            self.frame_ns,
        )
    }
}

/// An event of the stream; the data is on one line.
/// Its number is when it was made, ms: by it a page says when it asks for something, see [`Asked`](super::caller::Asked).
fn event(name: &str, data: &str, made_ns: u64) -> Bytes {
    let number = made_ns / 1_000_000;
    format!("id: {number}\nevent: {name}\ndata: {data}\n\n").into()
}

/// A JSON object with the members of another one.
fn with_members(object: &str, more: &str) -> String {
    match (object.strip_suffix('}'), more.strip_prefix('{')) {
        (Some(object), Some(more)) => format!("{object},{more}"),
        _ => object.to_owned(),
    }
}

fn to_json(value: &impl Serialize) -> String {
    // None of these types refuses to be written.
    serde_json::to_string(value).unwrap_or_else(|error| {
        tracing::error!("a message for the pages: {error}");
        "{}".to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relay::source::Worm;
    use crate::watch::Telemetry;
    use serde_json::Value;
    use worm_estimator::config::Config;
    use worm_estimator::message::State;

    const MS: u64 = 1_000_000;

    /// A relay's worm, without the relay.
    fn worm() -> Worm {
        let mut worm = Worm::new(Subject::of(&Config::default()));
        worm.telemetry = Telemetry::with_limits(10, 10);
        worm
    }

    /// Takes all events that there are for a page: their names and data.
    fn events(feed: &mut Feed, cursor: &mut Cursor, now_ns: u64) -> Vec<(String, Value)> {
        std::iter::from_fn(|| feed.next_event(cursor, now_ns))
            .map(|event| {
                let text = String::from_utf8(event.to_vec()).expect("is text");
                let (number, rest) = text
                    .strip_prefix("id: ")
                    .and_then(|rest| rest.split_once("\nevent: "))
                    .unwrap_or_else(|| panic!("{text}"));
                let made_ms: u64 = number.parse().expect("when it was made");
                assert!(made_ms <= now_ns / 1_000_000, "{text}");
                let (name, data) = rest
                    .strip_suffix("\n\n")
                    .and_then(|rest| rest.split_once("\ndata: "))
                    .unwrap_or_else(|| panic!("{text}"));
                assert!(!data.contains('\n'), "{data}");
                (name.to_owned(), serde_json::from_str(data).expect("is JSON"))
            })
            .collect()
    }

    fn names(events: &[(String, Value)]) -> Vec<&str> {
        events.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// The texts of an event's list.
    fn texts(event: &(String, Value)) -> Vec<&str> {
        let list = event.1["events"].as_array().expect("a list");
        list.iter().filter_map(|event| event["text"].as_str()).collect()
    }

    #[test]
    fn a_page_gets_everything_once_however_slowly_it_reads() {
        let (mut worm, mut feed) = (worm(), Feed::new(Subject::of(&Config::default())));
        let mut early = Cursor::default();
        assert!(feed.lose("the worm does not run", 0));
        assert!(!feed.lose("the worm does not run", MS), "is known");
        let before = events(&mut feed, &mut early, MS);
        assert_eq!(names(&before), ["hello", "status"], "without a worm");
        assert_eq!(before[1].1["problem"], "the worm does not run");
        assert!(feed.state_json(MS).is_none());

        feed.take_hello(worm.hello(2 * MS));
        assert_eq!(names(&events(&mut feed, &mut early, 2 * MS)), ["hello", "status"]);
        let mut slow = early;
        let mut seen = worm.seen();
        for number in 1..=3 {
            worm.telemetry.state = Some(State {
                time_ns: number * 50 * MS,
                ..State::unknown(4)
            });
            worm.note(number * 50 * MS, format!("event {number}"));
            feed.take_frame(worm.frame(number, number * 50 * MS, seen, 1, None), number * 50 * MS);
            seen = worm.seen();
            let new = events(&mut feed, &mut early, number * 50 * MS);
            assert_eq!(names(&new), ["frame"]);
            assert_eq!(texts(&new[0]), [format!("event {number}")]);
        }
        let missed = events(&mut feed, &mut slow, 150 * MS);
        assert_eq!(names(&missed), ["frame"], "the newest alone");
        assert_eq!(missed[0].1["number"], 3);
        assert_eq!(texts(&missed[0]), ["event 1", "event 2", "event 3"]);
        let late = events(&mut feed, &mut Cursor::default(), 150 * MS);
        assert_eq!(names(&late), ["hello", "frame", "status"]);
        assert_eq!(texts(&late[0]), ["event 1", "event 2", "event 3"]);
        assert!(texts(&late[1]).is_empty(), "nothing twice");
    }

    #[test]
    fn what_is_known_grows_old_also_when_nothing_comes() {
        let (mut worm, mut feed) = (worm(), Feed::new(Subject::of(&Config::default())));
        worm.telemetry.state = Some(State {
            time_ns: 100 * MS,
            ..State::unknown(4)
        });
        feed.take_hello(worm.hello(110 * MS));
        feed.take_frame(worm.frame(1, 120 * MS, worm.seen(), 1, None), 120 * MS);
        assert_eq!((feed.ages(120 * MS).state, feed.is_live(120 * MS)), (Some(20), true));
        assert!(!feed.is_silent(600 * MS) && feed.is_silent(620 * MS));
        assert!(!feed.is_silent(700 * MS), "was said");
        assert_eq!(
            (feed.ages(1100 * MS).state, feed.is_live(1100 * MS)),
            (Some(1000), false)
        );
        let state: Value = serde_json::from_str(&feed.state_json(1120 * MS).expect("is known")).expect("JSON");
        assert_eq!(state["age_ms"]["state"], 1020);
        assert_eq!(
            (&state["server"]["frame_age_ms"], &state["number"]),
            (&1000.into(), &1.into())
        );

        // The page has had that frame: one of a relay before is not shown as news.
        let mut page = Cursor::default();
        feed.take_hello(worm.hello(1200 * MS));
        assert_eq!(names(&events(&mut feed, &mut page, 1200 * MS)), ["hello", "status"]);
    }
}
