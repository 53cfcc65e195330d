//! The `trip` topic: where the worm is on its route, what it does there, and why.

use super::ZeroCopySend;
use super::json::{Name, OrNone};
use super::short_text::ShortText;
use super::{AlarmKind, coded_enum, message};
use worm_physics::MAX_CELLS;

coded_enum! {
    /// What a trip does.
    TripPhase, "trip phase" {
        /// It crawls along the route, away from home.
        Outbound = 0 => "outbound",
        /// It crawls home.
        Returning = 1 => "returning",
        /// It waits, and does not command motion; the reason says for what.
        Holding = 2 => "holding",
        /// It is over as it should be: the worm is at home, or at the end of a route that goes one way.
        Done = 3 => "done",
        /// It is over before that.
        Aborted = 4 => "aborted",
    }
}

coded_enum! {
    /// Why a trip is in its phase.
    TripReason, "trip reason" {
        /// It was begun.
        Started = 0 => "started",
        /// The end of the route was reached.
        EndOfRoute = 1 => "end-of-route",
        /// The worm is at home.
        Home = 2 => "home",
        /// What is left in the battery is needed for the way home.
        Energy = 3 => "energy",
        /// Nobody was heard for the time after which that counts as a lost link.
        LinkLost = 4 => "link-lost",
        /// Somebody is heard again.
        LinkBack = 5 => "link-back",
        /// An operator told the trip so.
        Operator = 6 => "operator",
        /// Somebody commanded the worm to hold.
        HoldCommanded = 7 => "hold-commanded",
        /// Somebody stopped the worm.
        StopCommanded = 8 => "stop-commanded",
        /// Somebody else drives.
        OtherDriver = 9 => "other-driver",
        /// The controller holds because of an alarm.
        Alarm = 10 => "alarm",
        /// The controller stopped because of a fault.
        Fault = 11 => "fault",
        /// The worm does not get ahead.
        Stuck = 12 => "stuck",
        /// The crawl ended without a command too often: this process is not run in time.
        Lapsed = 13 => "lapsed",
        /// This process was suspended.
        Suspended = 14 => "suspended",
        /// The controller refuses to crawl.
        Refused = 15 => "refused",
        /// The controller is gone.
        ControllerGone = 16 => "controller-gone",
        /// This process was told to end.
        Ended = 17 => "ended",
    }
}

coded_enum! {
    /// What a trip does when its link is lost.
    LinkLoss, "reaction to a lost link" {
        /// It holds.
        Hold = 0 => "hold",
        /// It goes home.
        Return = 1 => "return",
        /// It goes on.
        Continue = 2 => "continue",
    }
}

message! {
    /// How a trip stands: twice a second, and at every change. Low and high values bound a 90 % interval. Energies and what follows from
    /// them are not known without a battery.
    ///
    /// The lists are where the worm is expected if all goes on as planned: the way ahead, and the way home. They hold up to 16 points.
    TripStatus = "wormd_trip_v1", made: time_ns, cells: |trip| trip.point_count, {
        /// Number of this message since the trip began.
        sequence: u64,
        /// When it was made, ns of `CLOCK_MONOTONIC`.
        time_ns: u64,
        /// When the trip began, ns of `CLOCK_MONOTONIC`.
        started_ns: u64,
        /// When it came into its phase, for its reason, ns of `CLOCK_MONOTONIC`.
        since_ns: u64,
        /// Distance from home along the route, m.
        position_m: f64,
        /// Its standard error, m.
        position_sigma_m: f64,
        /// Length of the route, m.
        length_m: f64,
        /// Furthest distance from home that the trip is expected to reach, m; where a trip returns already, the furthest it has reached.
        turn_m: f64,
        /// Length of the present leg that is still ahead, in the direction of the trip, m.
        leg_left_m: f64,
        /// Speed of the cam that the trip commands, gait cycles per second, negative for backward; 0 while it commands none.
        cycles_per_s: f64,
        /// Distance that a gait cycle is expected to advance on the present leg, m.
        advance_per_cycle_m: f64,
        /// Its standard error, m.
        advance_per_cycle_sigma_m: f64,
        /// Standard deviation of the advance from cycle to cycle, m.
        advance_scatter_m: f64,
        /// Energy left in the battery above the reserve of this trip, J.
        energy_left_j: f64,
        /// Lower bound of it, J.
        energy_left_low_j: f64,
        /// Upper bound of it, J.
        energy_left_high_j: f64,
        /// Energy that the way home needs from here, J.
        energy_home_j: f64,
        /// Lower bound of it, J.
        energy_home_low_j: f64,
        /// Upper bound of it, J.
        energy_home_high_j: f64,
        /// Time that the way home takes from here, s.
        home_s: f64,
        /// Lower bound of it, s.
        home_low_s: f64,
        /// Upper bound of it, s.
        home_high_s: f64,
        /// Time until the trip is over, s; not known while it waits.
        left_s: f64,
        /// Lower bound of it, s.
        left_low_s: f64,
        /// Upper bound of it, s.
        left_high_s: f64,
        /// How long ago somebody was last heard, s.
        link_age_s: f64,
        /// Silence after which the link counts as lost, s.
        link_timeout_s: f64,
        /// Distances from home of the points ahead, m.
        point_m: [f64; MAX_CELLS],
        /// Times from now at which the worm is expected there, s.
        point_s: [f64; MAX_CELLS],
        /// Standard errors of the place at these times, m.
        point_sigma_m: [f64; MAX_CELLS],
        /// What it does: [`TripPhase`] as a code.
        phase: u32 as Name<TripPhase>,
        /// Why: [`TripReason`] as a code.
        reason: u32 as Name<TripReason>,
        /// What it goes on with when it no longer waits, `outbound` or `returning`: [`TripPhase`] as a code.
        heading: u32 as Name<TripPhase>,
        /// Alarm behind the reason `alarm` or `fault`: [`AlarmKind`] as a code, or `u32::MAX`.
        alarm: u32 as OrNone<Name<AlarmKind>>,
        /// What it does when the link is lost: [`LinkLoss`] as a code.
        link_loss: u32 as Name<LinkLoss>,
        /// 1 while the link counts as lost, else 0.
        link_is_lost: u32,
        /// 1 where the worm comes home at the end of the route, 0 where the trip ends there.
        return_home: u32,
        /// Number of the present leg, from 1.
        leg: u32,
        /// Legs of the route.
        leg_count: u32,
        /// Points in the lists.
        point_count: u32,
        /// Gait cycles that were measured on this trip.
        cycles: u32,
        /// 1 where only an operator can make it go on: `wormd trip resume`.
        needs_operator: u32,
        /// Who commanded what it waits for, or how it goes on: a program, or a watcher; empty where nobody did.
        by: ShortText,
    }
}
