//! Energy on the way: what is left in the battery, what the way home needs, and whether it is time to turn round.
//!
//! What is left is the `range` topic's charge, above the reserve and above the charge at which the voltage is too low for a leg of the way
//! home, less what the hotel power has taken since. What the way home needs is the model's energy for the legs back, corrected by what the
//! cycles so far have cost and advanced. Both have a standard error. The trip turns round where the lower bound of their difference, on
//! the next cycle's end, is no longer above zero.

use super::correction::{Correction, Ratios};
use super::design::Workbench;
use super::itinerary::{Cost, Heading, Itinerary};
use worm_estimator::battery::OpenCircuit;
use worm_estimator::estimate::range::INTERVAL_SIGMAS;
use worm_estimator::message::Range;
use worm_estimator::time::seconds;

/// Gait cycles that pass until the next decision is carried out: the one under way, and half of one for the turn.
const CYCLES_TO_TURN: f64 = 1.5;
/// Steps of the search for the turn.
const TURN_STEPS: u32 = 40;

/// An energy with its standard error, J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Energy {
    pub(super) mean_j: f64,
    pub(super) sigma_j: f64,
}

impl Energy {
    pub(super) const UNKNOWN: Self = Self {
        mean_j: f64::NAN,
        sigma_j: f64::NAN,
    };

    /// Bounds of a 90 % interval, J.
    pub(super) fn bounds_j(&self) -> [f64; 2] {
        let half_j = INTERVAL_SIGMAS * self.sigma_j;
        // What is not known stays so: the greater of a number and NaN is the number.
        let low_j = if self.mean_j >= half_j {
            self.mean_j - half_j
        } else {
            0.0 * self.mean_j
        };
        [low_j, self.mean_j + half_j]
    }
}

/// The battery on the way.
#[derive(Debug, Clone)]
pub(super) struct EnergyBudget {
    capacity_j: f64,
    reserve_share: f64,
    hotel_power_w: f64,
    resistance_ohm: f64,
    curve: OpenCircuit,
    range: Option<Range>,
}

impl EnergyBudget {
    /// The battery of a workbench; none where it is not configured.
    pub(super) fn new(bench: &Workbench, reserve_share: f64) -> Option<Self> {
        let battery = &bench.battery;
        bench.battery_is_configured.then(|| Self {
            capacity_j: battery.capacity_j,
            reserve_share,
            hotel_power_w: battery.hotel_power_w,
            resistance_ohm: battery.internal_resistance_ohm,
            curve: bench.curve.clone(),
            range: None,
        })
    }

    pub(super) fn note_range(&mut self, range: &Range) {
        self.range = Some(*range);
    }

    /// What is left for a way home from a place; none before the charge is known.
    pub(super) fn left(&self, itinerary: &Itinerary, place_m: f64, now_ns: u64) -> Option<Energy> {
        let range = self.range.as_ref().filter(|range| range.charge_share.is_finite())?;
        let floor = self.reserve_share.max(itinerary.home_floor(place_m));
        let since_s = seconds(now_ns.saturating_sub(range.end_ns));
        let below_j = (range.energy_left_j - range.energy_left_low_j).max(0.0);
        // At the end of the battery the lower bound is cut off at 0; the charge itself still has its error.
        let sigma_j = (below_j / INTERVAL_SIGMAS).max(if range.energy_left_low_j > 0.0 {
            0.0
        } else {
            range.charge_sigma_share * self.capacity_j
        });
        Some(Energy {
            mean_j: (range.charge_share - floor) * self.capacity_j - self.hotel_power_w * since_s,
            sigma_j,
        })
    }

    /// What a part of the way takes out of the battery.
    fn needed(&self, cost: &Cost, ratios: &Ratios) -> Energy {
        if cost.time_s <= 0.0 {
            return Energy {
                mean_j: 0.0,
                sigma_j: 0.0,
            };
        }
        let (advance, energy) = (&ratios.advance, &ratios.energy);
        let motor_j = cost.motor_j * energy.mean();
        let bus_j = (motor_j + cost.hotel_j) / advance.mean();
        let power_w = (motor_j + cost.hotel_j) / cost.time_s;
        // At the reserve the voltage is lowest, and the loss in the battery greatest.
        let open_v = self.curve.volts(self.reserve_share);
        let mean_j = bus_j * (1.0 + power_w * self.resistance_ohm / (open_v * open_v));
        let of_motor = motor_j / (motor_j + cost.hotel_j).max(f64::MIN_POSITIVE);
        let relative = (advance.sigma() / advance.mean()).hypot(of_motor * energy.sigma() / energy.mean());
        Energy {
            mean_j,
            sigma_j: relative * mean_j,
        }
    }

    /// What the way home needs from a place; none where there is no way home.
    pub(super) fn home(&self, itinerary: &Itinerary, correction: &Correction, place_m: f64) -> Option<Energy> {
        let cost = itinerary.cost(place_m, 0.0, Heading::Home)?;
        Some(self.needed(&cost, &correction.of(Heading::Home)))
    }

    /// What the way to the end of the route needs from a place.
    fn to_end(&self, itinerary: &Itinerary, correction: &Correction, place_m: f64) -> Option<Energy> {
        let cost = itinerary.cost(place_m, itinerary.length_m(), Heading::Out)?;
        Some(self.needed(&cost, &correction.of(Heading::Out)))
    }

    /// What is to spare at a place further out, where the way there is paid, too: the lower bound, J.
    fn spare_j(
        &self,
        itinerary: &Itinerary,
        correction: &Correction,
        from_m: f64,
        place_m: f64,
        now_ns: u64,
    ) -> Option<f64> {
        let left = self.left(itinerary, place_m, now_ns)?;
        let out = itinerary.cost(from_m, place_m, Heading::Out)?;
        let out = self.needed(&out, &correction.of(Heading::Out));
        let home = self.home(itinerary, correction, place_m)?;
        let sigma_j = left.sigma_j.hypot(home.sigma_j);
        Some(left.mean_j - out.mean_j - home.mean_j - INTERVAL_SIGMAS * sigma_j)
    }

    /// Where a decision that is made now is carried out.
    fn next_turn_m(itinerary: &Itinerary, correction: &Correction, place_m: f64) -> f64 {
        let leg = itinerary.leg_at(place_m, Heading::Out);
        let advance_m = itinerary.cycle(leg, Heading::Out).map_or(0.0, |cost| cost.advance_m);
        let ahead_m = CYCLES_TO_TURN * advance_m * correction.of(Heading::Out).advance.mean();
        (place_m + ahead_m).min(itinerary.length_m())
    }

    /// Whether what is left is needed for the way home. Not where nothing is known of it, and not on a route that goes one way and whose end is
    /// nearer than home, in energy, or within reach.
    pub(super) fn is_due(
        &self,
        itinerary: &Itinerary,
        correction: &Correction,
        place_m: f64,
        return_home: bool,
        now_ns: u64,
    ) -> bool {
        let turn_m = Self::next_turn_m(itinerary, correction, place_m);
        let Some(spare_j) = self.spare_j(itinerary, correction, place_m, turn_m, now_ns) else {
            return false;
        };
        if spare_j > 0.0 {
            return false;
        }
        if return_home {
            return true;
        }
        let ways = (
            self.left(itinerary, place_m, now_ns),
            self.to_end(itinerary, correction, place_m),
            self.home(itinerary, correction, place_m),
        );
        let (Some(left), Some(end), Some(home)) = ways else {
            return false;
        };
        let reaches_end = left.mean_j - end.mean_j > INTERVAL_SIGMAS * left.sigma_j.hypot(end.sigma_j);
        !reaches_end && end.mean_j > home.mean_j
    }

    /// Furthest place from which the worm is expected to come home.
    pub(super) fn turn_m(&self, itinerary: &Itinerary, correction: &Correction, place_m: f64, now_ns: u64) -> f64 {
        let end_m = itinerary.length_m();
        let is_beyond = |turn_m: f64| {
            let spare_j = self.spare_j(itinerary, correction, place_m, turn_m, now_ns);
            spare_j.is_some_and(|spare_j| spare_j <= 0.0)
        };
        if !is_beyond(end_m) {
            return end_m;
        }
        let (mut low_m, mut high_m) = (place_m, end_m);
        for _ in 0..TURN_STEPS {
            let middle_m = f64::midpoint(low_m, high_m);
            if is_beyond(middle_m) {
                high_m = middle_m;
            } else {
                low_m = middle_m;
            }
        }
        low_m
    }

    /// Standard error of the place where the battery makes the worm turn, m: that of the energy, over what a metre out and home takes.
    pub(super) fn turn_sigma_m(
        &self,
        itinerary: &Itinerary,
        correction: &Correction,
        turn_m: f64,
        now_ns: u64,
    ) -> Option<f64> {
        let leg = itinerary.leg_at(turn_m, Heading::Out);
        let j_per_m = |heading: Heading| {
            let [start_m, end_m] = itinerary.ends_of(leg);
            let cost = itinerary.cost(start_m, end_m, heading)?;
            Some(self.needed(&cost, &correction.of(heading)).mean_j / (end_m - start_m))
        };
        let left = self.left(itinerary, turn_m, now_ns)?;
        let home = self.home(itinerary, correction, turn_m)?;
        Some(left.sigma_j.hypot(home.sigma_j) / (j_per_m(Heading::Out)? + j_per_m(Heading::Home)?))
    }
}
