//! The `command` service: requests to the controller, and its answers.

use super::ZeroCopySend;
use super::json::Name;
use super::short_text::ShortText;
use super::state::{Fault, Mode};
use super::{coded_enum, structure};

coded_enum! {
    /// A kind of request to the controller.
    CommandKind, "command" {
        /// Torque on.
        Arm = 0 => "arm",
        /// Turn the cam with the given speed.
        Crawl = 1 => "crawl",
        /// Keep the cam where it is, actively.
        Hold = 2 => "hold",
        /// Ramp down, then torque off.
        Stop = 3 => "stop",
        /// Leave the fault state, re-armed from the measured position; with torque on, permit motion despite the alarms that stand and
        /// do not clear at rest.
        Reset = 4 => "reset",
        /// Note that somebody has seen the alarms of [`Command::alarm_mask`]. Permits nothing.
        Acknowledge = 5 => "acknowledge",
        /// Go on crawling for [`Command::limit_s`] from now on. Never begins a crawl, and changes neither speed nor direction: whoever
        /// attends to a crawl must not overrule a hold.
        Renew = 6 => "renew",
        /// Note that the worm is at [`Command::position_m`], for the dead reckoning. Moves and permits nothing.
        Mark = 7 => "mark",
        /// Note that the sender drives from now on, in place of whoever did. Moves and permits nothing: who drives is the relay's to say.
        TakeOver = 8 => "take-over",
        /// Note that a command did not come this far, because another watcher drives. The sender is `NAME: COMMAND`. Moves and permits nothing.
        NotDriver = 9 => "not-driver",
        /// Note that a command did not come this far, because the certificate of whoever asked over the network does not permit it. The sender is
        /// `NAME: COMMAND`, and the name begins with that of the certificate. Moves and permits nothing.
        NotPermitted = 10 => "not-permitted",
        /// Note that a command did not come this far, because it came too late: over the network, or to a relay that stood still. The sender is
        /// `NAME: COMMAND`. Moves and permits nothing.
        Stale = 11 => "stale",
        /// Note that a command did not come this far, because too many wait for the controller, or too many watchers of a laptop command over
        /// the network. The sender is `NAME: COMMAND`. Moves and permits nothing.
        Busy = 12 => "busy",
    }
}

coded_enum! {
    /// The outcome of a command.
    CommandOutcome, "verdict" {
        /// Carried out, or under way.
        Accepted = 0 => "accepted",
        /// Not possible in the present mode, which is in the reply.
        WrongMode = 1 => "wrong-mode",
        /// The fault's cause is still there.
        FaultPersists = 2 => "fault-persists",
        /// The speed is not a number, or beyond the configured limit.
        BadSpeed = 3 => "bad-speed",
        /// The command's code is unknown to this controller.
        Unknown = 4 => "unknown",
        /// No estimator is running, and the configuration requires one for crawling.
        NoEstimator = 5 => "no-estimator",
        /// An alarm stands whose policy is more than a warning; [`Reply::alarm_mask`] has it.
        AlarmStands = 6 => "alarm-stands",
        /// The lease of the supervisor has lapsed, and the command gives no time of its own.
        NoLease = 7 => "no-lease",
        /// The position of a mark or its standard error is not a number, or beyond what a canal has.
        BadPosition = 8 => "bad-position",
    }
}

structure! {
    /// A request to the controller.
    Command = "wormd_command_v4", {
        /// Gait cycles per second for [`CommandKind::Crawl`], negative for backward; 0 means the configured gait.
        cycles_per_s: f64,
        /// For [`CommandKind::Crawl`] and [`CommandKind::Renew`], how long the worm may crawl before it holds, s. 0 leaves it to the controller:
        /// as long as the lease of `wormd up` lasts, and where nobody holds one `control.crawl_limit_s`.
        limit_s: f64,
        /// For [`CommandKind::Mark`], where the mean of the cells is along the canal, m.
        position_m: f64,
        /// For [`CommandKind::Mark`], the standard error of that, m; 0 means 5 mm.
        position_sigma_m: f64,
        /// [`CommandKind`] as a code.
        kind: u32 as Name<CommandKind>,
        /// Bit k set: the command concerns the alarm with code k, for [`CommandKind::Acknowledge`].
        alarm_mask: u32,
        /// User ID of the sender, for the record.
        user: u32,
        /// Padding to a multiple of eight bytes; zero.
        reserved: u32,
        /// Who sends it, for the record: a program, or the person on whose behalf it sends.
        sender: ShortText,
    }
}

/// Standard error of a mark whose sender gives none, m.
const DEFAULT_MARK_SIGMA_M: f64 = 5e-3;

impl CommandKind {
    /// Whether it is for the record alone: it says what somebody has seen, knows or was refused, and not what the worm is to do.
    pub const fn is_remark(self) -> bool {
        matches!(
            self,
            Self::Acknowledge
                | Self::Mark
                | Self::TakeOver
                | Self::NotDriver
                | Self::NotPermitted
                | Self::Stale
                | Self::Busy
        )
    }
}

impl Command {
    /// Longest distance that a mark may be away, m.
    pub const MAX_POSITION_M: f64 = 1e5;

    /// A command without parameters, of user 0 and an unnamed sender.
    pub const fn new(kind: CommandKind) -> Self {
        Self {
            cycles_per_s: 0.0,
            limit_s: 0.0,
            position_m: 0.0,
            position_sigma_m: 0.0,
            kind: kind.code(),
            alarm_mask: 0,
            user: 0,
            reserved: 0,
            sender: ShortText::EMPTY,
        }
    }
}

impl Command {
    /// Position and standard error of a mark, m; `None` where they make no sense.
    pub fn mark(&self) -> Option<(f64, f64)> {
        let sigma_m = if self.position_sigma_m == 0.0 {
            DEFAULT_MARK_SIGMA_M
        } else {
            self.position_sigma_m
        };
        let is_position = self.position_m.abs() <= Self::MAX_POSITION_M;
        let is_error = sigma_m > 0.0 && sigma_m <= Self::MAX_POSITION_M;
        (is_position && is_error).then_some((self.position_m, sigma_m))
    }
}

structure! {
    /// The controller's answer.
    Reply = "wormd_reply_v2", {
        /// Tick in which the command was processed.
        sequence: u64,
        /// [`CommandOutcome`] as a code.
        verdict: u32 as Name<CommandOutcome>,
        /// [`super::Mode`] after the command, as a code.
        mode: u32 as Name<Mode>,
        /// [`super::Fault`] as a code.
        fault: u32 as Name<Fault>,
        /// Bit k set: the alarm with code k stands in the way of the command.
        alarm_mask: u32,
    }
}
