//! What relay and watchers say to each other: JSON objects, one a line. docs/relay.md has them field by field.

use super::message_json::Json;
use crate::latency::Percentiles;
use crate::supervisor::controller;
use crate::trip::wire::Ask;
use serde::{Deserialize, Serialize};
use worm_estimator::config::{Config, Direction};
use worm_estimator::message::{
    Alarm, CommandKind, CommandRecord, Cycle, Estimate, Inferred, Range, RecordingStatus, State, Timing, TripStatus,
};

/// Version of this language. A higher one may have taken fields away or changed what they mean; new fields need no new version,
/// because both sides ignore what they do not know.
pub(crate) const VERSION: u32 = 1;

/// Longest line of a watcher, bytes.
pub(crate) const MAX_REQUEST: usize = 4096;

/// A line of the relay.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Line {
    /// The first line.
    Hello(Box<Hello>),
    /// How the worm stands, 20 times a second.
    Frame(Box<Frame>),
    /// The answer to a request.
    Answer(Answer),
    /// Frames were left out here, because this watcher did not read.
    Lost {
        /// How many.
        frames: u64,
    },
    /// The relay closes the connection.
    Refused {
        /// Why, and what to do.
        reason: String,
    },
}

/// What a watcher needs once.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Hello {
    /// [`VERSION`] of the relay.
    pub version: u32,
    /// Version of the relay's `wormd`.
    pub wormd: String,
    /// Process of the relay.
    pub pid: u32,
    /// The kernel's name for this run of the computer: times of another one do not compare.
    pub boot_id: String,
    /// Now, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// Over a network the robot, by its certificate; none on the worm's own computer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// The worm, as far as a picture needs it.
    pub worm: Subject,
    /// The text of the configuration file, as the relay read it when it began; none where it was given none. For who records.
    #[serde(default)]
    pub config: Option<String>,
    /// Samples of the last ten minutes, the oldest first.
    pub samples: Vec<Sample>,
    /// The newest gait cycles.
    pub cycles: Vec<Json<Cycle>>,
    /// The newest changes of alarms.
    pub alarms: Vec<Json<Alarm>>,
    /// The newest commands, as the controller recorded them.
    #[serde(default)]
    pub commands: Vec<Json<CommandRecord>>,
    /// The newest commands and changes of the driver, in words.
    pub events: Vec<Event>,
}

/// The part of [`Hello`] that every version has.
#[derive(Debug, Deserialize)]
pub(crate) struct AnyHello {
    pub hello: AnyVersion,
}

/// The version alone.
#[derive(Debug, Deserialize)]
pub(crate) struct AnyVersion {
    pub version: u32,
}

/// What a picture shows of the worm besides its telemetry, from the configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Subject {
    /// Name of the worm.
    pub name: String,
    /// How many cells it has.
    pub cells: usize,
    /// The port that drives it; none for the virtual worm, and where the configuration is not known.
    pub port: Option<String>,
    /// Slope of the canal, degrees.
    pub slope_deg: f64,
    /// Whether the gait is driven backward.
    pub backward: bool,
    /// Tick rate, Hz.
    pub rate_hz: f64,
    /// The order in which the cells step, from 1.
    pub step_order: Vec<usize>,
    /// Largest deformation that bars and charts show, m.
    pub full_scale_m: f64,
    /// Mass of the worm, kg.
    pub mass_kg: f64,
    /// Distance between neighbouring cells, m: where positions are not measured.
    #[serde(default = "usual_spacing_m")]
    pub cell_spacing_m: f64,
}

/// Of relays that do not say it.
fn usual_spacing_m() -> f64 {
    Config::default().worm.cell_spacing_m
}

impl Subject {
    /// The configured worm.
    pub(crate) fn of(config: &Config) -> Self {
        let bounds_m = config.worm.max_deformation_m.to_vec(config.worm.cells);
        Self {
            name: config.worm.name.clone(),
            cells: config.worm.cells,
            port: config.port.as_ref().map(|port| port.path.clone()),
            slope_deg: config.canal.slope_deg,
            backward: config.gait.direction == Direction::Backward,
            rate_hz: config.control.rate_hz,
            step_order: config.worm.step_order.clone(),
            full_scale_m: bounds_m.into_iter().fold(0.0, f64::max),
            mass_kg: config.worm.mass_kg,
            cell_spacing_m: config.worm.cell_spacing_m,
        }
    }
}

/// One moment of the history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sample {
    /// When, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// Gait cycles done.
    pub phase: Option<f64>,
    /// Motor current, A.
    pub motor_current_a: Option<f32>,
    /// Position of each cell, m.
    pub position_m: Vec<Option<f32>>,
    /// Deformation of each tip, m.
    pub deformation_m: Vec<Option<f32>>,
}

/// How the worm stands.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Frame {
    /// Number of the frame since the relay began.
    pub number: u64,
    /// When it was made, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// Watchers that are connected.
    pub watchers: usize,
    /// How old the newest message of each topic is.
    pub age_ms: Ages,
    /// The newest state.
    pub state: Option<Json<State>>,
    /// The newest estimate.
    pub estimate: Option<Json<Estimate>>,
    /// The newest timing.
    pub timing: Option<Json<Timing>>,
    /// Where the ticks' time went since the relay began.
    pub statistics: Option<Statistics>,
    /// How the recording goes, if there is one.
    pub recording: Option<Json<RecordingStatus>>,
    /// How far and how long the battery lasts, after the newest gait cycle, if there is one.
    pub range: Option<Json<Range>>,
    /// How the trip stands that is under way, or how the last one ended; none where there was none.
    #[serde(default)]
    pub trip: Option<Json<TripStatus>>,
    /// What the motor's current alone says, after the newest gait cycle that was fitted; none where self-sensing is off.
    #[serde(default)]
    pub inferred: Option<Json<Inferred>>,
    /// The alarms that are raised.
    pub raised: Vec<Json<Alarm>>,
    /// Gait cycles since the frame before.
    pub cycles: Vec<Json<Cycle>>,
    /// Changes of alarms since the frame before.
    pub alarms: Vec<Json<Alarm>>,
    /// Commands since the frame before, as the controller recorded them.
    #[serde(default)]
    pub commands: Vec<Json<CommandRecord>>,
    /// Commands and changes of the driver since the frame before, in words.
    pub events: Vec<Event>,
    /// Who drives, if anybody does.
    pub driver: Option<Driver>,
    /// The network between the relay and this watcher, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub network: Option<Network>,
}

/// What is between a relay and its watchers when the worm is on another computer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Network {
    /// The robot, by its certificate.
    pub robot: String,
    /// Whether this computer's certificate permits to drive.
    pub may_drive: bool,
    /// Frames that were lost on the way since the link began.
    pub frames_lost: u64,
    /// How long a piece and its confirmation take together, ms; none where that is not known.
    pub round_trip_ms: Option<u64>,
    /// The kernel's name for this run of the robot's computer.
    pub boot_id: String,
    /// Whether the robot's kernel counts its wall time as synchronised; none where it does not say.
    pub synchronised: Option<bool>,
    /// The robot's wall time (Unix) less its `CLOCK_MONOTONIC`, ns.
    pub wall_offset_ns: i64,
}

/// Ages of the newest messages, ms; none where none ever came.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Ages {
    pub state: Option<u64>,
    pub estimate: Option<u64>,
    pub timing: Option<u64>,
    pub recording: Option<u64>,
    #[serde(default)]
    pub trip: Option<u64>,
}

/// Where the ticks' time went.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Statistics {
    /// How long after its deadline each tick began, µs.
    pub wake_us: Percentiles,
    /// Bus exchange, µs.
    pub bus_us: Percentiles,
    /// Computation, µs.
    pub compute_us: Percentiles,
    /// Pauses of the computer.
    pub host_pauses: u64,
    /// How long they were together, s.
    pub host_paused_s: f64,
}

/// Who drives.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Driver {
    /// Number of the watcher.
    pub watcher: u64,
    /// The name that it gave.
    pub name: String,
    /// Its user id.
    pub user: u32,
    /// For how long it has been driving, ms.
    pub since_ms: u64,
    /// Whether the worm crawls for as long as this watcher is heard.
    pub attends: bool,
}

/// A command, or a change of the driver.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Event {
    /// When, ns of `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// In words, with who it was.
    pub text: String,
}

/// A line of a watcher.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RequestLine {
    /// Comes back in the answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// When it was asked for, ns of `CLOCK_MONOTONIC` of the computer on which it is read; without it, when it is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sent_ns: Option<u64>,
    /// What the watcher wants.
    #[serde(flatten)]
    pub request: Request,
}

/// What a watcher may ask for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case")]
pub(crate) enum Request {
    /// Says who it is. Without it a watcher is called by its process.
    Hello {
        /// [`VERSION`] of the watcher.
        version: u32,
        /// Its name.
        name: String,
    },
    /// It is still there. No answer.
    Alive,
    /// Drive, if nobody does.
    Drive,
    /// Drive instead of whoever does.
    TakeOver,
    /// Torque on.
    Arm,
    /// Crawl for as long as this watcher is heard.
    Crawl {
        /// Gait cycles per second, negative for backward; without it the configured gait.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        cycles_per_s: Option<f64>,
    },
    /// Hold. Anyone may.
    Hold,
    /// Stop.
    Stop,
    /// Leave the fault, or permit motion despite alarms.
    Reset,
    /// Tell the trip that is under way something. Anyone may make it wait.
    Trip {
        /// What.
        action: Ask,
    },
    /// Note that somebody has seen these alarms. Anyone may.
    Acknowledge {
        /// Names; without any, all alarms.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        alarms: Vec<String>,
    },
    /// Note where the worm is, for its dead reckoning. Anyone may.
    Mark {
        /// The mean of the cells along the canal, m.
        position_m: f64,
        /// Standard error of that, m; without it 5 mm.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        sigma_m: Option<f64>,
    },
    /// Note that a bridge has refused the command of somebody on its network. No answer.
    NoteRefusal {
        /// Who asked.
        name: String,
        /// The command.
        refused: String,
        /// Why, as the answer to whoever asked says it.
        verdict: NetworkRefusal,
    },
}

/// Why a bridge passes a command on to nobody.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum NetworkRefusal {
    /// The certificate does not permit it.
    NotPermitted,
    /// It came too late.
    Stale,
    /// Too many watchers of the laptop command already.
    Busy,
}

impl NetworkRefusal {
    /// The remark by which it is recorded, whose name is the verdict.
    pub(crate) fn kind(self) -> CommandKind {
        match self {
            Self::NotPermitted => CommandKind::NotPermitted,
            Self::Stale => CommandKind::Stale,
            Self::Busy => CommandKind::Busy,
        }
    }
}

impl Request {
    /// As on the wire.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Hello { .. } => "hello",
            Self::Alive => "alive",
            Self::Drive => "drive",
            Self::TakeOver => "take_over",
            Self::Trip { .. } => "trip",
            Self::NoteRefusal { .. } => "note_refusal",
            Self::Arm
            | Self::Crawl { .. }
            | Self::Hold
            | Self::Stop
            | Self::Reset
            | Self::Acknowledge { .. }
            | Self::Mark { .. } => self.kind().map_or("", CommandKind::name),
        }
    }

    /// The controller's command behind it; none where the relay answers by itself.
    pub(crate) fn kind(&self) -> Option<CommandKind> {
        match self {
            Self::Hello { .. }
            | Self::Alive
            | Self::Drive
            | Self::TakeOver
            | Self::Trip { .. }
            | Self::NoteRefusal { .. } => None,
            Self::Arm => Some(CommandKind::Arm),
            Self::Crawl { .. } => Some(CommandKind::Crawl),
            Self::Hold => Some(CommandKind::Hold),
            Self::Stop => Some(CommandKind::Stop),
            Self::Reset => Some(CommandKind::Reset),
            Self::Acknowledge { .. } => Some(CommandKind::Acknowledge),
            Self::Mark { .. } => Some(CommandKind::Mark),
        }
    }
}

/// The answer to a request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Answer {
    /// That of the request.
    pub id: Option<u64>,
    /// The number of the watcher that asked, as in [`Driver::watcher`].
    pub watcher: u64,
    /// What was asked for.
    pub command: String,
    /// `accepted`; the controller's verdict; `not-driver`, `no-answer`, `busy`, `stale` or `unusable`.
    pub verdict: String,
    /// Why not, and what to do; none when it was accepted.
    pub refusal: Option<String>,
    /// What else there is to say: that a hold went past a relay that did not answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// The controller's mode after the command, where it answered.
    pub mode: Option<String>,
    /// Its fault.
    pub fault: Option<String>,
    /// Its tick that took the command.
    pub tick: Option<u64>,
}

impl Answer {
    /// An answer of the relay itself.
    pub(crate) fn own(watcher: u64, id: Option<u64>, command: &str, verdict: &str, refusal: Option<String>) -> Self {
        Self {
            id,
            watcher,
            command: command.to_owned(),
            verdict: verdict.to_owned(),
            refusal,
            note: None,
            mode: None,
            fault: None,
            tick: None,
        }
    }

    /// The controller's answer.
    pub(crate) fn of_controller(watcher: u64, id: Option<u64>, command: &str, answer: &controller::Answer) -> Self {
        Self {
            mode: Some(answer.mode().to_owned()),
            fault: Some(answer.fault().to_owned()),
            tick: Some(answer.tick()),
            ..Self::own(watcher, id, command, answer.verdict(), answer.refusal())
        }
    }
}

/// A line as bytes, with its end.
pub(crate) fn to_bytes(line: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec(line)?;
    bytes.push(b'\n');
    Ok(bytes)
}
