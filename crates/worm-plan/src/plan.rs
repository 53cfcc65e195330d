//! A plan: the configured worm on a route, the best design for it, the trade-off, and the check.

use super::check::{InertiaCheck, check};
use super::design::Workbench;
use super::route::{Leg, Route};
use super::search::{Bounds, BoundsError, Search, search};
use super::trip::{Trip, trip};
use serde::Serialize;

/// The battery that a plan counts on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BatteryUsed {
    /// Whether the configuration has a `[battery]`; otherwise its commented-out values count.
    pub is_configured: bool,
    /// Energy when full, J.
    pub capacity_j: f64,
    /// Share of it that is there at the start.
    pub start_share: f64,
    /// Share that is kept in reserve.
    pub reserve_share: f64,
    /// Power of everything but the motor, W.
    pub hotel_power_w: f64,
}

/// A plan. Its field names are a contract of the JSON output.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// The legs.
    pub route: Vec<Leg>,
    /// Its length, m.
    pub length_m: f64,
    /// The battery.
    pub battery: BatteryUsed,
    /// The configured worm's trip.
    pub configured: Trip,
    /// The search for the best design.
    pub search: Search,
    /// The best design's trip; none where no design makes it.
    pub best: Option<Trip>,
    /// The worm with inertia on the best design, or on the configured one where there is none.
    pub inertia_check: Vec<InertiaCheck>,
}

/// Plans a trip on a battery with a share of its energy at the start.
///
/// # Errors
/// [`BoundsError`].
pub fn plan(bench: &Workbench, route: &Route, bounds: &Bounds, start_share: f64) -> Result<Plan, BoundsError> {
    let search = search(bench, route, bounds)?;
    let best = search.best.as_ref().map(|best| &best.design);
    let configured = bench.configured();
    Ok(Plan {
        route: route.legs().to_vec(),
        length_m: route.length_m(),
        battery: BatteryUsed {
            is_configured: bench.battery_is_configured,
            capacity_j: bench.battery.capacity_j,
            start_share,
            reserve_share: bench.battery.reserve_share,
            hotel_power_w: bench.battery.hotel_power_w,
        },
        configured: trip(bench, &configured, route, start_share),
        best: best.map(|best| trip(bench, best, route, start_share)),
        inertia_check: check(bench, best.unwrap_or(&configured), route),
        search,
    })
}
