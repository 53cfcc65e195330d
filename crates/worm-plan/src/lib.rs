//! Trips on a battery: what a route costs, where it fails, and which design is best for it.
//!
//! # Modules, in reading order
//! - [`route`]: [`Route`], the legs of a trip, read from CSV.
//! - [`design`]: [`Design`], what the search varies, and [`Workbench`], which makes worms of designs and knows what they cost on a slope.
//! - [`mod@trip`]: [`trip()`], a design on a route, leg by leg, with the battery and the intervals.
//! - [`mod@search`]: [`search()`], every design of a grid on the route, on all processors; the best one and the trade-off.
//! - [`mod@check`]: [`check()`], the worm with inertia against the exact motion that everything here rests on.
//! - [`mod@plan`]: [`plan()`], all of it for one route.
//! - [`itinerary`]: [`Itinerary`], a route with what its legs cost out and home, for a worm that is on the way.
//! - `correction`: how far the worm on the way differs from the model; `energy_budget`: what is left against what the way home needs.
//! - [`guide`]: [`Guide`], the decisions of a trip that is under way.
//! - [`ghost`]: [`Ghost`], where a worm is expected of which nothing is heard.
//!
//! Everything is pure: files and terminals are the caller's.
//!
//! # What it takes for granted
//! Each leg is crawled in the steady cycle of its slope; the few cycles between two slopes are left out, and so is what the motor would
//! need to accelerate. The motor turns at a constant speed. The intervals say how far a model is usually off before the worm has
//! crawled: the constants of [`worm_estimator::estimate::range`], and the standard deviations of the battery in the configuration.

pub mod check;
mod correction;
pub mod design;
mod energy_budget;
pub mod ghost;
pub mod guide;
pub mod itinerary;
pub mod plan;
pub mod route;
pub mod search;
pub mod trip;

pub use check::{InertiaCheck, check};
pub use design::{Design, Going, LegFailure, SlopeCost, Workbench};
pub use ghost::Ghost;
pub use guide::{Action, Guide, Order};
pub use itinerary::{Heading, Impassable, Itinerary};
pub use plan::{BatteryUsed, Plan, plan};
pub use route::{Leg, Route, RouteError};
pub use search::{Bounds, BoundsError, Candidate, Search, search};
pub use trip::{Interval, LegResult, Trip, trip};
