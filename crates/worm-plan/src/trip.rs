//! A design on a route, leg by leg, on the battery.
//!
//! # Intervals
//! What is not known is the same on every leg: how far the model's advance and the motor's energy are off, and the hotel power. So the
//! energy of the trip has one relative standard deviation, which does not shrink with the number of legs. The battery's capacity and its
//! charge at the start add theirs. Bounds are those of 90 %.

use super::design::{Design, Going, LegFailure, SlopeCost, Workbench};
use super::route::{Leg, Route};
use serde::Serialize;
use std::collections::BTreeMap;
use worm_estimator::estimate::range::{INTERVAL_SIGMAS, MODEL_ADVANCE_SIGMA, MODEL_ENERGY_SIGMA};

/// Standard deviation of the charge at the start, as a share of the battery.
const START_SIGMA: f64 = 0.02;
/// Part of the battery over which its voltage counts as constant, as a share.
const SLICE: f64 = 0.01;

/// A value with its 90 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// Best estimate.
    pub mean: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

impl Interval {
    fn new(mean: f64, sigma: f64) -> Self {
        Self {
            mean,
            low: (mean - INTERVAL_SIGMAS * sigma).max(0.0),
            high: mean + INTERVAL_SIGMAS * sigma,
        }
    }

    /// Of a charge: no trip fills the battery.
    fn of_charge(mean: f64, sigma: f64, start_share: f64) -> Self {
        let interval = Self::new(mean, sigma);
        Self {
            high: interval.high.min(start_share),
            ..interval
        }
    }
}

/// One leg of a trip. What follows a leg that fails is not known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LegResult {
    /// The leg.
    #[serde(flatten)]
    pub leg: Leg,
    /// Advance per gait cycle, m.
    pub advance_per_cycle_m: Option<f64>,
    /// Energy out of the battery per gait cycle, J.
    pub energy_per_cycle_j: Option<f64>,
    /// Greatest current of the motor, A.
    pub peak_current_a: Option<f64>,
    /// Gait cycles.
    pub cycles: Option<f64>,
    /// Time, s.
    pub time_s: Option<Interval>,
    /// Energy out of the battery, J.
    pub energy_j: Option<Interval>,
    /// Share of the battery's energy that is left at its end.
    pub charge_left_share: Option<Interval>,
    /// Probability of reaching its end with the reserve untouched.
    pub arrival_probability: f64,
    /// Why it fails, or the first leg before it.
    pub failure: Option<LegFailure>,
}

/// A trip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trip {
    /// The design.
    pub design: Design,
    /// Mean stiffness of a cell's contact, N/m.
    pub stiffness_n_per_m: f64,
    /// Whether it arrives, by the best estimate, with the reserve untouched.
    pub feasible: bool,
    /// Probability of that.
    pub arrival_probability: f64,
    /// The leg that fails first, from 1.
    pub failed_leg: Option<usize>,
    /// Length of the route, m.
    pub length_m: f64,
    /// Time, s; none where a leg fails.
    pub time_s: Option<Interval>,
    /// Energy out of the battery, J.
    pub energy_j: Option<Interval>,
    /// Share of the battery's energy that is used.
    pub charge_used_share: Option<f64>,
    /// Share that is left at the end.
    pub charge_left_share: Option<Interval>,
    /// Gait cycles.
    pub cycles: Option<f64>,
    /// How far the charge at the start would take it on such a route, the reserve untouched, m.
    pub range_m: Option<Interval>,
    /// The legs.
    pub legs: Vec<LegResult>,
}

/// Sums since the start.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    cycles: f64,
    time_s: f64,
    energy_j: f64,
    motor_j: f64,
    hotel_j: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.cycles += other.cycles;
        self.time_s += other.time_s;
        self.energy_j += other.energy_j;
        self.motor_j += other.motor_j;
        self.hotel_j += other.hotel_j;
    }

    /// Relative standard deviation of the energy.
    fn sigma(&self, bench: &Workbench) -> f64 {
        let bus_j = self.motor_j + self.hotel_j;
        let motor = MODEL_ENERGY_SIGMA * self.motor_j / bus_j;
        let hotel = bench.battery.hotel_power_sigma_share * self.hotel_j / bus_j;
        motor.hypot(hotel).hypot(MODEL_ADVANCE_SIGMA)
    }

    fn time(&self) -> Interval {
        Interval::new(self.time_s, MODEL_ADVANCE_SIGMA * self.time_s)
    }

    fn energy(&self, bench: &Workbench) -> Interval {
        Interval::new(self.energy_j, self.sigma(bench) * self.energy_j)
    }

    /// Share that is left, and the standard deviation of what is left above the reserve.
    fn left(&self, bench: &Workbench, start_share: f64) -> (f64, f64) {
        let used = self.energy_j / bench.battery.capacity_j;
        let sigma = (self.sigma(bench).hypot(bench.battery.capacity_sigma_share) * used).hypot(START_SIGMA);
        (start_share - used, sigma)
    }
}

/// A design on a route, with a share of the battery's energy at the start.
pub fn trip(bench: &Workbench, design: &Design, route: &Route, start_share: f64) -> Trip {
    let costs = leg_costs(bench, design, route, Going::Forward);
    let reserve = bench.battery.reserve_share;
    let arrival = |sums: &Sums| {
        let (left, sigma) = sums.left(bench, start_share);
        normal_below((left - reserve) / sigma)
    };
    let mut sums = Sums::default();
    // What the trip needs, also where the battery is likely to be empty before: it may hold more, and the worm need less.
    let mut needed = Sums::default();
    let mut is_possible = true;
    let mut failed: Option<(usize, LegFailure)> = None;
    let mut legs = Vec::with_capacity(route.legs().len());
    for (index, (leg, &cost)) in route.legs().iter().zip(&costs).enumerate() {
        let cycle_s = leg.cycle_s(design.cycle_s);
        let crawled = match (failed, cost) {
            (Some((_, failure)), _) | (None, Err(failure)) => Err(failure),
            (None, Ok(cost)) => crawl(bench, cycle_s, leg, &cost, start_share, &sums).map(|spent| (cost, spent)),
        };
        let result = match crawled {
            Ok((cost, spent)) => {
                sums.add(&spent);
                needed.add(&spent);
                let (left, sigma) = sums.left(bench, start_share);
                LegResult {
                    leg: *leg,
                    advance_per_cycle_m: Some(cost.advance_m),
                    energy_per_cycle_j: Some(spent.energy_j / spent.cycles),
                    peak_current_a: Some(cost.peak_current_a),
                    cycles: Some(spent.cycles),
                    time_s: Some(spent.time()),
                    energy_j: Some(spent.energy(bench)),
                    charge_left_share: Some(Interval::of_charge(left, sigma, start_share)),
                    arrival_probability: arrival(&sums),
                    failure: None,
                }
            }
            Err(failure) => {
                failed.get_or_insert((index, failure));
                match (failure, cost) {
                    (LegFailure::BatteryEmpty { .. }, Ok(cost)) => needed.add(&on_bus(bench, cycle_s, leg, &cost)),
                    _ => is_possible = false,
                }
                LegResult {
                    leg: *leg,
                    advance_per_cycle_m: None,
                    energy_per_cycle_j: None,
                    peak_current_a: None,
                    cycles: None,
                    time_s: None,
                    energy_j: None,
                    charge_left_share: None,
                    arrival_probability: if is_possible { arrival(&needed) } else { 0.0 },
                    failure: Some(failure),
                }
            }
        };
        legs.push(result);
    }
    let arrives = failed.is_none();
    let (left, sigma) = sums.left(bench, start_share);
    let used = sums.energy_j / bench.battery.capacity_j;
    let (usable, length_m) = (start_share - reserve, route.length_m());
    let range_sigma = sums
        .sigma(bench)
        .hypot(bench.battery.capacity_sigma_share)
        .hypot(START_SIGMA / usable.max(START_SIGMA));
    let range_m = length_m * usable.max(0.0) / used;
    Trip {
        design: design.clone(),
        stiffness_n_per_m: bench.stiffness_n_per_m(design),
        feasible: arrives && left >= reserve,
        arrival_probability: legs.last().map_or(0.0, |leg| leg.arrival_probability),
        failed_leg: failed.map(|(index, _)| index + 1),
        length_m,
        time_s: arrives.then(|| sums.time()),
        energy_j: arrives.then(|| sums.energy(bench)),
        charge_used_share: arrives.then_some(used),
        charge_left_share: arrives.then(|| Interval::of_charge(left, sigma, start_share)),
        cycles: arrives.then_some(sums.cycles),
        range_m: arrives.then(|| Interval::new(range_m, range_sigma * range_m)),
        legs,
    }
}

/// What a steady cycle costs on each leg, or why the leg cannot be crawled. Each slope at each speed is computed once.
pub(crate) fn leg_costs(
    bench: &Workbench,
    design: &Design,
    route: &Route,
    going: Going,
) -> Vec<Result<SlopeCost, LegFailure>> {
    let mut known: BTreeMap<(u64, u64), Result<SlopeCost, LegFailure>> = BTreeMap::new();
    let cost_of = |leg: &Leg| {
        let design = Design {
            cycle_s: leg.cycle_s(design.cycle_s),
            ..design.clone()
        };
        let key = (leg.slope_deg.to_bits(), design.cycle_s.to_bits());
        *known.entry(key).or_insert_with(|| {
            let mechanics = bench.mechanics_going(&design, leg.slope_deg, going)?;
            bench.cost(&mechanics, design.cycle_s)
        })
    };
    route.legs().iter().map(cost_of).collect()
}

/// What a leg takes from the bus.
fn on_bus(bench: &Workbench, cycle_s: f64, leg: &Leg, cost: &SlopeCost) -> Sums {
    let cycles = leg.length_m / cost.advance_m;
    let bus_j = bench.bus_j(cost, cycle_s);
    Sums {
        cycles,
        time_s: cycles * cycle_s,
        energy_j: cycles * bus_j,
        motor_j: cycles * cost.motor_j,
        hotel_j: cycles * (bus_j - cost.motor_j),
    }
}

/// Crawls a leg in slices of the battery, for its voltage falls.
fn crawl(
    bench: &Workbench,
    cycle_s: f64,
    leg: &Leg,
    cost: &SlopeCost,
    start_share: f64,
    before: &Sums,
) -> Result<Sums, LegFailure> {
    let capacity_j = bench.battery.capacity_j;
    let bus_j = bench.bus_j(cost, cycle_s);
    let cycles = leg.length_m / cost.advance_m;
    let mut energy_j = 0.0;
    let mut done = 0.0;
    while done < cycles {
        let after_m = done * cost.advance_m;
        let share = start_share - (before.energy_j + energy_j) / capacity_j;
        if share <= 0.0 {
            return Err(LegFailure::BatteryEmpty { after_m });
        }
        let factor = bench
            .battery_factor(cost, cycle_s, share)
            .map_err(|failure| match failure {
                LegFailure::BatteryEmpty { .. } => LegFailure::BatteryEmpty { after_m },
                other => other,
            })?;
        let slice = (SLICE * capacity_j / (bus_j * factor)).min(cycles - done);
        // A last slice of rounding alone would never end.
        done = if slice < 1e-9 * cycles { cycles } else { done + slice };
        energy_j += slice * bus_j * factor;
    }
    Ok(Sums {
        energy_j,
        ..on_bus(bench, cycle_s, leg, cost)
    })
}

/// Probability that a standard normal variable is below a value, to 2·10⁻⁴: the logistic approximation with a cubic term.
fn normal_below(sigmas: f64) -> f64 {
    let sigmas = sigmas.clamp(-8.0, 8.0);
    1.0 / (1.0 + (-1.5976 * sigmas - 0.070_56 * sigmas.powi(3)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use worm_estimator::config::Config;

    fn bench() -> Workbench {
        Workbench::new(&Config::default()).expect("the paper's worm")
    }

    fn route(text: &str) -> Route {
        Route::from_csv(&format!("length_m,slope_deg\n{text}"), Path::new("route.csv")).expect("a route")
    }

    #[test]
    fn legs_add_up_and_the_advance_is_that_of_table_1() {
        let bench = bench();
        let trip = trip(&bench, &bench.configured(), &route("2,0\n1,30\n1,0\n"), 1.0);
        assert!(trip.feasible && trip.failed_leg.is_none());
        for (leg, advance_m) in trip.legs.iter().zip([6.833e-3, 4.611e-3, 6.833e-3]) {
            assert!((leg.advance_per_cycle_m.expect("it crawls") - advance_m).abs() < 1e-6);
        }
        let sum = |of: fn(&LegResult) -> f64| trip.legs.iter().map(of).sum::<f64>();
        let energy_j = trip.energy_j.expect("it arrives").mean;
        assert!((sum(|leg| leg.energy_j.expect("it crawls").mean) - energy_j).abs() < 1e-9);
        assert!((trip.cycles.expect("it arrives") - (3.0 / 6.8333e-3 + 1.0 / 4.6111e-3)).abs() < 0.1);
        assert!((trip.time_s.expect("it arrives").mean - 2.5 * trip.cycles.expect("it arrives")).abs() < 1e-6);
        let left = trip.charge_left_share.expect("it arrives");
        assert!((left.mean - (1.0 - energy_j / 9000.0)).abs() < 1e-12 && left.low < left.mean && left.mean < left.high);
        assert!(
            trip.legs
                .iter()
                .all(|leg| leg.charge_left_share.is_some_and(|left| left.high <= 1.0))
        );
        // Hotel power alone is 1.25 J a cycle, and the identified motor takes some 0.42 J.
        let cycle_j = trip.legs[0].energy_per_cycle_j.expect("it crawls");
        assert!((1.6..1.75).contains(&cycle_j), "{cycle_j}");
    }

    #[test]
    fn it_says_which_leg_fails_and_why() {
        let bench = bench();
        let design = bench.configured();
        let failure = |design: &Design, text: &str| {
            let trip = trip(&bench, design, &route(text), 1.0);
            let leg = trip.failed_leg.expect("a leg fails");
            assert!(!trip.feasible && trip.arrival_probability < 1e-3);
            (leg, trip.legs[leg - 1].failure.expect("a reason"))
        };
        assert!(matches!(
            failure(&design, "1,0\n1,65\n1,0\n"),
            (2, LegFailure::SlidesBack { .. })
        ));
        let soft = Design {
            stiffness_factor: 0.3,
            ..design.clone()
        };
        assert!(matches!(
            failure(&soft, "1,0\n"),
            (1, LegFailure::StandsStill | LegFailure::SlidesBack { .. })
        ));
        let fast = Design {
            cycle_s: 0.5,
            ..design.clone()
        };
        assert!(matches!(failure(&fast, "1,0\n"), (1, LegFailure::Velocity { .. })));
        let (leg, empty) = failure(&design, "1,0\n1000,0\n");
        let LegFailure::BatteryEmpty { after_m } = empty else {
            panic!("{empty}")
        };
        // 9000 J at about 1.69 J for 6.83 mm.
        assert!(leg == 2 && (33.0..38.0).contains(&after_m), "{after_m}");
        let heavy = Config {
            limits: worm_estimator::config::Limits {
                current_a: 0.1,
                ..Default::default()
            },
            ..Config::default()
        };
        let heavy = Workbench::new(&heavy).expect("a worm");
        let stopped = trip(&heavy, &design, &route("1,30\n"), 1.0);
        assert!(
            matches!(stopped.legs[0].failure, Some(LegFailure::Current { .. })),
            "{stopped:?}"
        );
    }

    #[test]
    fn a_route_at_the_edge_of_the_range_is_an_even_bet() {
        let bench = bench();
        let design = bench.configured();
        let range_m = trip(&bench, &design, &route("1,0\n"), 0.8).range_m.expect("it crawls");
        let edge = trip(&bench, &design, &route(&format!("{},0\n", range_m.mean)), 0.8);
        assert!(
            (0.4..0.6).contains(&edge.arrival_probability),
            "{}",
            edge.arrival_probability
        );
        let long = trip(&bench, &design, &route(&format!("{},0\n", 1.3 * range_m.mean)), 0.8);
        assert!(
            long.failed_leg == Some(1) && (0.02..0.3).contains(&long.arrival_probability),
            "{long:?}"
        );
        let sure = trip(&bench, &design, &route(&format!("{},0\n", 0.5 * range_m.mean)), 0.8);
        assert!(sure.feasible && sure.arrival_probability > 0.98);
    }

    #[test]
    fn normal_probabilities_are_near_the_tabulated_ones() {
        for (sigmas, probability) in [(0.0, 0.5), (1.0, 0.841_34), (-1.645, 0.05), (3.0, 0.998_65)] {
            assert!((normal_below(sigmas) - probability).abs() < 5e-4, "{sigmas}");
        }
    }
}
