//! The `alarm` topic: what is wrong, since when, and by how much.

use super::ZeroCopySend;
use super::json::{Name, OrNone};
use super::{coded_enum, message};

coded_enum! {
    /// The kind of an alarm. The code is its bit in [`super::Estimate::armed_mask`] and `raised_mask`.
    AlarmKind, "alarm" {
        /// The cam does not turn as commanded.
        MotorStall = 0 => "motor-stall",
        /// A cell does not extend in its step.
        JammedCell = 1 => "jammed-cell",
        /// The cam turns and the worm does not advance.
        NoProgress = 2 => "no-progress",
        /// The worm moves down the canal.
        SlidingDown = 3 => "sliding-down",
        /// Cycles cost more than they should.
        EnergyOverBudget = 4 => "energy-over-budget",
        /// The remaining charge is needed for the way home.
        BatteryLow = 5 => "battery-low",
        /// The servo does not answer, or answers badly.
        LinkFault = 6 => "link-fault",
        /// The tracker sends no samples, loses many, or does not see a cell.
        TrackerFault = 7 => "tracker-fault",
        /// The servo reports a hardware error, overheating or low voltage.
        DeviceFault = 8 => "device-fault",
        /// The worm makes a displacement that the model does not explain.
        ModelMismatch = 9 => "model-mismatch",
        /// The recorder could not go on, or was killed.
        RecordingStopped = 10 => "recording-stopped",
        /// By the motor's current, a cell or all of them have lost friction: a wet canal, a worn pad.
        FrictionLoss = 11 => "friction-loss",
        /// By the motor's current, a cell does not move in its step.
        InferredJam = 12 => "inferred-jam",
        /// By the motor's current, the cam's load is larger than it was: a pull on the body, or friction in the gears.
        MoreLoad = 13 => "more-load",
    }
}

impl AlarmKind {
    /// Whether it exists only in motion: it then clears two seconds after the worm is no longer commanded to move.
    pub const fn clears_at_rest(self) -> bool {
        matches!(self, Self::MotorStall | Self::JammedCell | Self::NoProgress)
    }
}

coded_enum! {
    /// How serious an alarm is.
    Severity, "severity" {
        /// Worth knowing.
        Warning = 0 => "warning",
        /// The worm cannot go on like this.
        Critical = 1 => "critical",
    }
}

message! {
    /// One change of one alarm: raised or cleared.
    Alarm = "wormd_alarm_v1", made: time_ns, cells: |_| 0, {
        /// Number of this change since the estimator started.
        sequence: u64,
        /// When it was raised or cleared, ns of `CLOCK_MONOTONIC`.
        time_ns: u64,
        /// When its condition began, as estimated, ns of `CLOCK_MONOTONIC`.
        since_ns: u64,
        /// The monitored quantity at the change, in the unit of the threshold.
        value: f64,
        /// The threshold that it passed.
        threshold: f64,
        /// Gait phase at the change, cycles; for a model mismatch, the last one at which the gait passed the place where it shows.
        phase: f64,
        /// The kind of alarm: [`AlarmKind`] as a code.
        kind: u32 as Name<AlarmKind>,
        /// How serious it is: [`Severity`] as a code.
        severity: u32 as Name<Severity>,
        /// 1 raised, 0 cleared.
        raised: u32,
        /// The cell concerned, from 0, or `u32::MAX` where it is not a single cell.
        cell: u32 as OrNone<u32>,
    }
}

impl Alarm {
    /// No alarm: fills the unused end of a fixed-size list.
    pub const NONE: Self = Self {
        sequence: 0,
        time_ns: 0,
        since_ns: 0,
        value: 0.0,
        threshold: 0.0,
        phase: 0.0,
        kind: 0,
        severity: 0,
        raised: 0,
        cell: u32::MAX,
    };
}
