//! The `range` topic: how far and how long the battery lasts.

use super::ZeroCopySend;
use super::message;

message! {
    /// How far and how long the battery lasts if the worm crawls on as in its last cycles: after each gait cycle, where a battery is
    /// configured. The low and high values bound a 90 % interval. What is kept in reserve does not count.
    Range = "wormd_range_v1", made: end_ns, cells: |_| 0, {
        /// Number of the gait cycle that it follows, as in the topic `cycle`.
        index: u64,
        /// When that cycle ended, ns of `CLOCK_MONOTONIC`.
        end_ns: u64,
        /// Share of the battery's energy that is left, 0 to 1.
        charge_share: f64,
        /// Its standard error.
        charge_sigma_share: f64,
        /// Energy left above the reserve and above the charge at which the voltage gets too low, J.
        energy_left_j: f64,
        /// Lower bound of it, J.
        energy_left_low_j: f64,
        /// Upper bound of it, J.
        energy_left_high_j: f64,
        /// Energy that a gait cycle takes from the battery: motor, hotel power, loss in the battery, J.
        energy_per_cycle_j: f64,
        /// Its standard error, J.
        energy_per_cycle_sigma_j: f64,
        /// Distance that a gait cycle advances, m.
        advance_per_cycle_m: f64,
        /// Its standard error, m.
        advance_per_cycle_sigma_m: f64,
        /// Gait cycles left.
        cycles: f64,
        /// Lower bound of them.
        cycles_low: f64,
        /// Upper bound of them.
        cycles_high: f64,
        /// Distance left, m; 0 where the worm does not advance.
        range_m: f64,
        /// Lower bound of it, m.
        range_low_m: f64,
        /// Upper bound of it, m.
        range_high_m: f64,
        /// Time left, s.
        time_s: f64,
        /// Lower bound of it, s.
        time_low_s: f64,
        /// Upper bound of it, s.
        time_high_s: f64,
        /// The gauge's reading that was taken with this cycle, 0 to 1; `NaN` without one.
        gauge_share: f64,
        /// Gait cycles since the worm began to crawl as it does now, that this rests on besides the model.
        cycles_used: u32,
        /// +1 crawling forward, −1 backward.
        direction: i32,
    }
}
