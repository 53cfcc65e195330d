//! What goes into a tick and what comes out of it.

use crate::link::{ServoReading, TrackerReading};
use worm_estimator::message::{Alarm, AlarmKind, Command, Estimate, Reply, State};

/// Inputs of one tick.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// When the exchange with the bus ended, ns of `CLOCK_MONOTONIC`.
    pub now_ns: u64,
    /// How long the loop could not run since the last tick although it was due, ns: silence in that time does not count.
    pub absent_ns: u64,
    /// Earlier exchanges that are known by now to have had no answer.
    pub lost_exchanges: u32,
    /// The servo's answer, if it came.
    pub servo: Option<&'a ServoReading>,
    /// The tracker's answer, if it came.
    pub tracker: Option<&'a TrackerReading>,
    /// A command that arrived, if any.
    pub command: Option<Command>,
    /// Alarm changes that arrived since the last tick.
    pub alarms: &'a [Alarm],
    /// The newest estimate, if one arrived since the last tick.
    pub estimate: Option<EstimateSeen>,
    /// The lease under which the worm crawls.
    pub lease: Lease,
    /// Whether the emergency stop is pressed; none where there is none.
    pub emergency_stop: Option<bool>,
    /// Whether the process was asked to end.
    pub end: bool,
    /// The outcome of the service that the last tick requested, if any; the readings of this tick are from after it.
    pub service: Option<ServiceOutcome>,
    /// How long that service took, ns; 0 where there was none. It does not count as silence.
    pub service_ns: u64,
    /// The servo's hardware error status, if it was read since the last tick.
    pub hardware_error: Option<u8>,
}

/// What a tick needs of an [`Estimate`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EstimateSeen {
    /// The tick whose state it is based on.
    pub state_sequence: u64,
    /// Bit k set: the alarm with code k is raised.
    pub raised_mask: u32,
}

impl From<&Estimate> for EstimateSeen {
    fn from(estimate: &Estimate) -> Self {
        Self {
            state_sequence: estimate.state_sequence,
            raised_mask: estimate.raised_mask,
        }
    }
}

/// Whether whoever started the controller still watches over the crawl.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lease {
    /// The controller was started by itself: crawls are limited in time.
    None,
    /// The supervisor is there and renews the lease.
    Held,
    /// The supervisor has gone, or has been silent for `control.lease_s`.
    Lapsed,
}

/// Work on the bus beyond the tick's exchange, done at the end of the tick that requests it. It takes several milliseconds, so it is
/// done only while the worm stands still, or to make it stand still.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Service {
    /// Prepare the servo as at start-up (which clears a tripped watchdog), then switch torque on.
    Arm,
    /// Switch torque off.
    Disarm,
}

/// Outcome of a [`Service`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ServiceOutcome {
    /// Done, and verified by reading back.
    Done(Service),
    /// Failed; the loop has logged why.
    Failed(Service),
}

/// Outputs of one tick.
#[derive(Debug, Clone, Copy)]
pub struct Outputs {
    /// The state to publish.
    pub state: State,
    /// Goal velocity for the next exchange, servo counts of 0.229 rev/min.
    pub goal_counts: i32,
    /// Work on the bus to do at once, before the next exchange.
    pub service: Option<Service>,
    /// What is worth an entry in the journal, besides the mode.
    pub notes: Notes,
    /// The answer to this tick's command.
    pub reply: Option<Reply>,
    /// The pause of the computer that ended in this tick, ns; 0 where there was none.
    pub host_paused_ns: u64,
    /// Whether the process may end: it was asked to, and the motor is off (or cannot be reached).
    pub finished: bool,
}

/// An event of a tick, for the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Note {
    /// The crawl ended because its lease lapsed.
    LeaseLapsed,
    /// The crawl ended because its time was over.
    TimeLimit,
    /// Torque goes off because the worm has idled.
    Idle,
    /// An alarm made the worm hold.
    HeldByAlarm(AlarmKind),
    /// An alarm made the worm back off.
    BackedOff(AlarmKind),
    /// A back-off did not reach its end in time.
    BackOffTimedOut,
    /// A user permitted motion despite the alarms of the mask.
    Permitted {
        /// Bit k set: the alarm with code k.
        mask: u32,
        /// User ID.
        user: u32,
    },
    /// A user has seen the alarms of the mask.
    Acknowledged {
        /// Bit k set: the alarm with code k.
        mask: u32,
        /// User ID.
        user: u32,
    },
    /// A user said where the worm is.
    Marked {
        /// Where, µm along the canal.
        position_um: i64,
        /// User ID.
        user: u32,
    },
    /// The silence that was taken for a lost link was a restart of the servo.
    SilenceWasRestart,
}

/// The notes of one tick, in their order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Notes([Option<Note>; 4]);

impl Notes {
    /// Adds a note. A tick makes fewer than there is room for; a further one would be dropped.
    pub(super) fn add(&mut self, note: Note) {
        if let Some(free) = self.0.iter_mut().find(|note| note.is_none()) {
            *free = Some(note);
        }
    }

    /// The notes.
    pub fn iter(&self) -> impl Iterator<Item = Note> {
        self.0.into_iter().flatten()
    }
}
