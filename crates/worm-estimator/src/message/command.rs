//! The `command` service: what the controller is asked to do, and what it answers.

use super::ZeroCopySend;
use super::coded_enum;

coded_enum! {
    /// What the controller is asked to do.
    CommandKind, "command" {
        /// Torque on.
        Arm = 0 => "arm",
        /// Turn the cam with the given speed.
        Crawl = 1 => "crawl",
        /// Keep the cam where it is, actively.
        Hold = 2 => "hold",
        /// Ramp down, then torque off.
        Stop = 3 => "stop",
        /// Leave the fault state; the worm is re-armed from the measured position.
        Reset = 4 => "reset",
    }
}

coded_enum! {
    /// What became of a command.
    CommandOutcome, "verdict" {
        /// Carried out, or under way.
        Accepted = 0 => "accepted",
        /// Not possible in the present mode; the mode stands in the reply.
        WrongMode = 1 => "wrong-mode",
        /// The fault's cause is still there.
        FaultPersists = 2 => "fault-persists",
        /// The speed is not a number, or beyond the configured limit.
        BadSpeed = 3 => "bad-speed",
        /// The command's code is unknown to this controller.
        Unknown = 4 => "unknown",
        /// No estimator is running, and the configuration requires one for crawling.
        NoEstimator = 5 => "no-estimator",
    }
}

/// A request to the controller.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("wormd_command_v1")]
#[repr(C)]
pub struct Command {
    /// Gait cycles per second for [`CommandKind::Crawl`], negative for backward; 0 means the configured gait.
    pub cycles_per_s: f64,
    /// [`CommandKind`] as a code.
    pub kind: u32,
    /// Fills the structure to a whole number of eight bytes; zero.
    pub reserved: u32,
}

/// The controller's answer.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("wormd_reply_v1")]
#[repr(C)]
pub struct Reply {
    /// Tick in which the command was taken.
    pub sequence: u64,
    /// [`CommandOutcome`] as a code.
    pub verdict: u32,
    /// [`super::Mode`] after the command, as a code.
    pub mode: u32,
    /// [`super::Fault`] as a code.
    pub fault: u32,
    /// Fills the structure to a whole number of eight bytes; zero.
    pub reserved: u32,
}
