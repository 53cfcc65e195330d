//! From the lines of a robot's relay to what is recorded: each message once, what was lost, and where another file has to begin. Pure.

use super::super::log_head::{LogClock, LogHead, wall_time};
use super::super::recorded_topics::Batch;
use super::once::Once;
use crate::relay::message_json::Json;
use crate::relay::wire::{Frame, Hello, Line, Network};
use crate::topics::{Count, Topic};
use std::collections::BTreeMap;
use std::time::SystemTime;
use worm_estimator::message::Estimate;
use worm_log::{Channel, Logged, Note, Origin};

/// Time between the frames of a relay, ns.
const FRAME_NS: u64 = 50_000_000;
/// A time without frames that is noted one by one, ns; what is shorter only counts.
const GAP_NS: u64 = 1_000_000_000;

/// What is to be done, in this order.
#[derive(Debug)]
pub(super) enum Step {
    /// Begin a file with this head, the first one or the next.
    Begin(Box<LogHead>),
    /// Write these messages.
    Write(Box<Batch>),
    /// Write this note.
    Note(Note),
    /// Nothing more can be recorded, for this reason.
    End(String),
}

/// What is known of the worm, and what of it is recorded.
#[derive(Debug)]
pub(super) struct Intake {
    topics: Vec<Channel>,
    /// The text of a configuration that the user gave, for a relay that knows none.
    own_config: Option<String>,
    greeting: Option<Greeting>,
    run: Option<Run>,
    frames_lost: u64,
}

/// What the relay said first.
#[derive(Debug)]
struct Greeting {
    worm: String,
    cells: usize,
    rate_hz: f64,
    boot_id: String,
    /// The relay's process.
    pid: u32,
    config: Option<String>,
    /// What it knew then.
    history: Batch,
}

/// The run of the robot's computer that is being recorded.
#[derive(Debug)]
struct Run {
    boot_id: String,
    cells: usize,
    config: Option<String>,
    state: Once,
    timing: Once,
    estimate: Once,
    cycle: Once,
    alarm: Once,
    range: Once,
    command: Once,
    trip: Once,
    inferred: Once,
    cycles: Count,
    alarms: Count,
    /// The newest frame: the process that numbered it, its number and its time.
    newest: Option<(u32, u64, u64)>,
}

impl Intake {
    /// Takes these topics, and the commands.
    pub(super) fn new(topics: &[Channel], own_config: Option<String>) -> Self {
        Self {
            topics: topics.to_vec(),
            own_config,
            greeting: None,
            run: None,
            frames_lost: 0,
        }
    }

    /// Frames that did not come since the recording began.
    pub(super) fn frames_lost(&self) -> u64 {
        self.frames_lost
    }

    /// How many messages of a topic did not come; none where that is not known, because frames have only the newest.
    pub(super) fn lost(&self, channel: Channel) -> Option<u64> {
        let run = self.run.as_ref().filter(|_| self.topics.contains(&channel))?;
        match channel {
            Channel::Cycle => Some(run.cycles.lost()),
            Channel::Alarm => Some(run.alarms.lost()),
            _ => None,
        }
    }

    /// Takes a line that came at `now_ns` of this computer's `CLOCK_MONOTONIC`, when its wall time was `wall`.
    pub(super) fn take(&mut self, line: Line, now_ns: u64, wall: SystemTime) -> Vec<Step> {
        match line {
            Line::Hello(hello) => self.take_hello(*hello),
            Line::Frame(frame) => self.take_frame(*frame, now_ns, wall),
            // The numbers of the frames say what was lost, whoever has lost it.
            Line::Lost { .. } | Line::Answer(_) | Line::Refused { .. } => Vec::new(),
        }
    }

    fn take_hello(&mut self, hello: Hello) -> Vec<Step> {
        if hello.robot.is_none() {
            let reason = format!(
                "{} runs on this computer now, and the recording is that of a robot elsewhere: record it by another call",
                hello.worm.name
            );
            return vec![Step::End(reason)];
        }
        let history = Batch {
            cycles: plain(hello.cycles),
            alarms: plain(hello.alarms),
            commands: plain(hello.commands),
            ..Batch::default()
        };
        self.greeting = Some(Greeting {
            worm: hello.worm.name,
            cells: hello.worm.cells,
            rate_hz: hello.worm.rate_hz,
            boot_id: hello.boot_id,
            pid: hello.pid,
            config: hello.config,
            history,
        });
        Vec::new()
    }

    fn take_frame(&mut self, frame: Frame, now_ns: u64, wall: SystemTime) -> Vec<Step> {
        let (Some(greeting), Some(network)) = (&mut self.greeting, &frame.network) else {
            return Vec::new();
        };
        if network.boot_id != greeting.boot_id {
            // Of which clock its times are is not sure before the next greeting.
            return Vec::new();
        }
        let mut steps = Vec::new();
        let is_same = |run: &Run| {
            let knows_other = greeting.config.is_some() && greeting.config != run.config;
            run.boot_id == greeting.boot_id && run.cells == greeting.cells && !knows_other
        };
        if !self.run.as_ref().is_some_and(is_same) {
            let (own, before) = (self.own_config.as_ref(), self.run.as_ref());
            let head = greeting.head((frame.time_ns, now_ns), wall, network, own, before);
            steps.push(Step::Begin(Box::new(head)));
            let since_ns = match before {
                // Of what was made before the recording began, only what this frame is about.
                None => frame.time_ns.saturating_sub(FRAME_NS),
                Some(before) if before.boot_id == greeting.boot_id => before.recorded_until_ns().saturating_add(1),
                Some(_) => 0,
            };
            self.run = Some(Run::new(greeting, since_ns));
        }
        let Some(run) = &mut self.run else { return steps };
        let history = std::mem::take(&mut greeting.history);
        let gap = run.gap(&frame, greeting.pid);
        let lost_before = [run.cycles.lost(), run.alarms.lost()];
        let batch = run.new_messages(history, &frame, &self.topics);
        if let Some(gap) = gap {
            self.frames_lost = self.frames_lost.saturating_add(gap.frames);
            let lost = [run.cycles.lost(), run.alarms.lost()];
            if gap.is_long() {
                steps.push(Step::Note(gap.note(
                    lost[0].saturating_sub(lost_before[0]),
                    lost[1].saturating_sub(lost_before[1]),
                )));
            }
        }
        if batch.len() > 0 {
            steps.push(Step::Write(Box::new(batch)));
        }
        steps
    }
}

impl Greeting {
    /// The head of a file that begins with a frame, made at the first time of the robot and come at the second one of this computer.
    fn head(
        &self,
        (time_ns, now_ns): (u64, u64),
        wall: SystemTime,
        network: &Network,
        own_config: Option<&String>,
        before: Option<&Run>,
    ) -> LogHead {
        let robot = &network.robot;
        let mut text = format!(
            "recorded over a network from {robot}: at most {} of {} ticks a second, and of range, trip and self-sensing the newest; every tick is in \
             logs that were recorded on the robot",
            1_000_000_000 / FRAME_NS,
            self.rate_hz
        );
        match before {
            Some(before) if before.boot_id != self.boot_id => {
                text += "; the robot's computer was started anew since the file before, and its clocks with it";
            }
            Some(_) => text += "; the worm's configuration is another one than in the file before",
            None => {}
        }
        let config = self.config.as_ref().or(own_config);
        if config.is_none() {
            text += "; its relay knows no configuration, so this log has none";
        }
        let unix = wall.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let known = |value: Option<bool>| value.map_or("unknown".to_owned(), |value| value.to_string());
        let values = [
            ("robot", robot.clone()),
            ("boot_id", self.boot_id.clone()),
            ("wall_offset_ns", network.wall_offset_ns.to_string()),
            ("wall_synchronised", known(network.synchronised)),
            ("receiver_unix_ns", unix.as_nanos().to_string()),
        ];
        let values: BTreeMap<_, _> = values.map(|(name, value)| (name.to_owned(), value)).into();
        LogHead {
            origin: Origin {
                worm: self.worm.clone(),
                cells: self.cells,
                config: config.cloned(),
                begun: wall_time(time_ns, network.wall_offset_ns),
                begun_ns: time_ns,
            },
            clock: LogClock::Robot {
                ahead_ns: (time_ns as i64).saturating_sub(now_ns as i64),
                wall_offset_ns: network.wall_offset_ns,
            },
            notes: vec![Note { text, values }],
        }
    }
}

impl Run {
    fn new(greeting: &Greeting, since_ns: u64) -> Self {
        let once = || Once::since(since_ns);
        Self {
            boot_id: greeting.boot_id.clone(),
            cells: greeting.cells,
            config: greeting.config.clone(),
            state: once(),
            timing: once(),
            estimate: once(),
            cycle: once(),
            alarm: once(),
            range: once(),
            command: once(),
            trip: once(),
            inferred: once(),
            cycles: Count::default(),
            alarms: Count::default(),
            newest: None,
        }
    }

    /// What was made until then was taken, ns.
    fn recorded_until_ns(&self) -> u64 {
        self.newest.map_or(0, |(_, _, time_ns)| time_ns)
    }

    /// What did not come before this frame, numbered by the process `pid`.
    fn gap(&mut self, frame: &Frame, pid: u32) -> Option<Gap> {
        let (before_pid, number, from_ns) = self.newest.replace((pid, frame.number, frame.time_ns))?;
        let time_ns = frame.time_ns.saturating_sub(from_ns);
        let frames = match before_pid == pid {
            true => frame.number.saturating_sub(number).saturating_sub(1),
            // Another relay counts anew; it took some time to start.
            false => (time_ns / FRAME_NS).saturating_sub(1),
        };
        (frames > 0).then_some(Gap {
            from_ns,
            to_ns: frame.time_ns,
            frames,
        })
    }

    /// What was not taken before, of these topics and the commands.
    fn new_messages(&mut self, history: Batch, frame: &Frame, topics: &[Channel]) -> Batch {
        fn newest<T: Topic + Logged>(once: &mut Once, message: Option<Json<T>>) -> Vec<T> {
            let message = message.map(|Json(message)| message);
            message.into_iter().filter(|message| once.takes(message)).collect()
        }
        fn all<T: Topic + Logged>(once: &mut Once, history: Vec<T>, messages: &[Json<T>]) -> Vec<T> {
            let messages = messages.iter().map(|Json(message)| *message);
            let all = history.into_iter().chain(messages);
            all.filter(|message| once.takes(message)).collect()
        }
        let estimate = frame.estimate.map(|Json(estimate)| estimate);
        let new_estimate = estimate.filter(|estimate| self.estimate.takes_key(estimate_key(estimate)));
        let mut batch = Batch {
            states: newest(&mut self.state, frame.state),
            timings: newest(&mut self.timing, frame.timing),
            estimates: new_estimate.into_iter().collect(),
            cycles: all(&mut self.cycle, history.cycles, &frame.cycles),
            alarms: all(&mut self.alarm, history.alarms, &frame.alarms),
            ranges: newest(&mut self.range, frame.range),
            commands: all(&mut self.command, history.commands, &frame.commands),
            trips: newest(&mut self.trip, frame.trip),
            inferred: newest(&mut self.inferred, frame.inferred),
        };
        count(&mut self.cycles, &batch.cycles);
        count(&mut self.alarms, &batch.alarms);
        batch.keep_only(topics);
        batch
    }
}

/// Estimates have no number. One that is repeated while no sample comes is new when it says something new of the alarms.
fn estimate_key(estimate: &Estimate) -> (u64, u64) {
    let masks = u64::from(estimate.armed_mask) << 32 | u64::from(estimate.raised_mask);
    (estimate.time_ns, masks)
}

fn count<T: Topic>(count: &mut Count, messages: &[T]) {
    messages.iter().for_each(|message| count.add(message.number()));
}

fn plain<T>(messages: Vec<Json<T>>) -> Vec<T> {
    messages.into_iter().map(|Json(message)| message).collect()
}

/// A time from which no frames came.
#[derive(Debug, Clone, Copy)]
struct Gap {
    from_ns: u64,
    to_ns: u64,
    frames: u64,
}

impl Gap {
    fn is_long(self) -> bool {
        self.to_ns.saturating_sub(self.from_ns) >= GAP_NS
    }

    fn note(self, cycles_lost: u64, alarms_lost: u64) -> Note {
        let [from_s, to_s] = [self.from_ns, self.to_ns].map(|time_ns| time_ns as f64 * 1e-9);
        let kept = match (cycles_lost, alarms_lost) {
            (0, 0) => "no cycle and no change of an alarm of it is missing".to_owned(),
            (cycles, alarms) => format!("{cycles} cycles and {alarms} changes of alarms of it are missing, too"),
        };
        let text = format!(
            "nothing came over the network from t = {from_s:.3} s to {to_s:.3} s ({:.1} s, {} frames); {kept}",
            to_s - from_s,
            self.frames
        );
        let values = [
            ("gap_from_ns", self.from_ns),
            ("gap_to_ns", self.to_ns),
            ("frames_lost", self.frames),
            ("cycles_lost", cycles_lost),
            ("alarms_lost", alarms_lost),
        ];
        Note {
            text,
            values: values.map(|(name, value)| (name.to_owned(), value.to_string())).into(),
        }
    }
}

#[cfg(test)]
mod tests;
