//! A route with what its legs cost out and home, for a worm that is on the way: the sums between any two places.

use super::design::{Design, Going, LegFailure, SlopeCost, Workbench};
use super::route::{Leg, Route};
use super::trip::leg_costs;
use std::fmt;

/// Steps of the search for the least charge with which a leg can be crawled.
const CHARGE_STEPS: u32 = 20;

/// Which way a trip goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Heading {
    /// Away from home, along the route.
    Out,
    /// Home.
    Home,
}

impl Heading {
    /// +1 away from home, −1 towards it.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Out => 1.0,
            Self::Home => -1.0,
        }
    }
}

/// A leg that cannot be crawled.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub struct Impassable {
    /// The leg, from 1.
    pub leg: usize,
    /// Its slope as the route has it, degrees.
    pub slope_deg: f64,
    /// The way on which it fails.
    pub heading: Heading,
    /// Why.
    pub failure: LegFailure,
}

impl fmt::Display for Impassable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (leg, slope_deg, failure) = (self.leg, self.slope_deg, self.failure);
        match self.heading {
            Heading::Out => write!(f, "leg {leg} ({slope_deg}°) cannot be crawled: {failure}"),
            Heading::Home => write!(
                f,
                "leg {leg} ({slope_deg}°) cannot be crawled on the way home ({}°): {failure}",
                0.0 - slope_deg
            ),
        }
    }
}

/// What a part of the way takes by the model.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cost {
    /// Gait cycles.
    pub cycles: f64,
    /// Time, s.
    pub time_s: f64,
    /// Electrical energy of the motor, J.
    pub motor_j: f64,
    /// Energy of everything else, J.
    pub hotel_j: f64,
}

impl Cost {
    fn plus(&self, other: &Self, factor: f64) -> Self {
        Self {
            cycles: self.cycles + factor * other.cycles,
            time_s: self.time_s + factor * other.time_s,
            motor_j: self.motor_j + factor * other.motor_j,
            hotel_j: self.hotel_j + factor * other.hotel_j,
        }
    }

    /// Mean power, W.
    pub fn power_w(&self) -> f64 {
        (self.motor_j + self.hotel_j) / self.time_s
    }
}

/// One way along all legs.
#[derive(Debug, Clone)]
struct Way {
    /// What a steady cycle costs on each leg.
    costs: Vec<SlopeCost>,
    /// Sums from home to the beginning of each leg, and to the end of the last.
    sums: Vec<Cost>,
    /// Share of the battery's energy below which the voltage is too low for the legs up to here.
    floors: Vec<f64>,
}

/// A route for a worm that is on the way.
#[derive(Debug, Clone)]
pub struct Itinerary {
    legs: Vec<Leg>,
    /// Where each leg begins, m from home; and where the last one ends.
    starts_m: Vec<f64>,
    usual_cycle_s: f64,
    out_going: Going,
    out: Way,
    home: Option<Way>,
}

impl Itinerary {
    /// A route for the configured worm, which goes out `going`. Without `needs_home`, the way home may be impossible.
    ///
    /// # Errors
    /// [`Impassable`] for the first leg that the worm cannot crawl on a full battery.
    pub fn new(bench: &Workbench, route: &Route, going: Going, needs_home: bool) -> Result<Self, Impassable> {
        let design = bench.configured();
        let legs = route.legs().to_vec();
        let mut starts_m = vec![0.0];
        let mut end_m = 0.0;
        for leg in &legs {
            end_m += leg.length_m;
            starts_m.push(end_m);
        }
        let out = Way::new(bench, &design, route, going, Heading::Out)?;
        let home = match Way::new(bench, &design, route, going.reversed(), Heading::Home) {
            Err(impassable) if needs_home => return Err(impassable),
            other => other.ok(),
        };
        Ok(Self {
            legs,
            starts_m,
            usual_cycle_s: design.cycle_s,
            out_going: going,
            out,
            home,
        })
    }

    /// The legs.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Length of the route, m.
    pub fn length_m(&self) -> f64 {
        self.starts_m.last().copied().unwrap_or_default()
    }

    /// Whether the worm can crawl home.
    pub const fn can_go_home(&self) -> bool {
        self.home.is_some()
    }

    /// The leg, from 0, that lies ahead of a place.
    pub fn leg_at(&self, place_m: f64, heading: Heading) -> usize {
        let ends_m = &self.starts_m[1..];
        let leg = match heading {
            Heading::Out => ends_m.partition_point(|&end_m| end_m <= place_m),
            Heading::Home => ends_m.partition_point(|&end_m| end_m < place_m),
        };
        leg.min(self.legs.len() - 1)
    }

    /// Where a leg begins and ends, m from home.
    pub fn ends_of(&self, leg: usize) -> [f64; 2] {
        [self.starts_m[leg], self.starts_m[leg + 1]]
    }

    /// Speed of the cam on a leg, gait cycles per second, negative for backward.
    pub fn cycles_per_s(&self, leg: usize, heading: Heading) -> f64 {
        self.out_going.sign() * heading.sign() / self.cycle_s(leg)
    }

    /// Time of a gait cycle on a leg, s.
    pub fn cycle_s(&self, leg: usize) -> f64 {
        self.legs[leg].cycle_s(self.usual_cycle_s)
    }

    /// Sign of the advance on the way out, along the canal: +1 where the first cell is ahead.
    pub const fn out_sign(&self) -> f64 {
        self.out_going.sign()
    }

    /// What a steady cycle costs on a leg; none for the way home where there is none.
    pub fn cycle(&self, leg: usize, heading: Heading) -> Option<&SlopeCost> {
        self.way(heading).map(|way| &way.costs[leg])
    }

    /// What the way from one place to another costs, whichever is nearer to home; none for the way home where there is none.
    pub fn cost(&self, from_m: f64, to_m: f64, heading: Heading) -> Option<Cost> {
        let way = self.way(heading)?;
        let (near_m, far_m) = (from_m.min(to_m), from_m.max(to_m));
        Some(self.sum_to(way, far_m).plus(&self.sum_to(way, near_m), -1.0))
    }

    /// Share of the battery's energy below which its voltage is too low for the way home from a place.
    pub fn home_floor(&self, place_m: f64) -> f64 {
        let leg = self.leg_at(place_m, Heading::Home);
        self.home.as_ref().map_or(0.0, |way| way.floors[leg])
    }

    fn way(&self, heading: Heading) -> Option<&Way> {
        match heading {
            Heading::Out => Some(&self.out),
            Heading::Home => self.home.as_ref(),
        }
    }

    fn sum_to(&self, way: &Way, place_m: f64) -> Cost {
        let place_m = place_m.clamp(0.0, self.length_m());
        let leg = self.leg_at(place_m, Heading::Home);
        let [start_m, end_m] = self.ends_of(leg);
        let fraction = (place_m - start_m) / (end_m - start_m);
        let of_leg = way.sums[leg + 1].plus(&way.sums[leg], -1.0);
        way.sums[leg].plus(&of_leg, fraction)
    }
}

impl Way {
    fn new(
        bench: &Workbench,
        design: &Design,
        route: &Route,
        going: Going,
        heading: Heading,
    ) -> Result<Self, Impassable> {
        // Home the legs go down where they went up.
        let costs = leg_costs(bench, design, &route.scaled_slopes(heading.sign()), going);
        let mut way = Self {
            costs: Vec::with_capacity(costs.len()),
            sums: vec![Cost::default()],
            floors: Vec::with_capacity(costs.len()),
        };
        let (mut sum, mut floor) = (Cost::default(), 0.0_f64);
        for (index, (leg, cost)) in route.legs().iter().zip(costs).enumerate() {
            let impassable = |failure| Impassable {
                leg: index + 1,
                slope_deg: leg.slope_deg,
                heading,
                failure,
            };
            let cost = cost.map_err(impassable)?;
            let cycle_s = leg.cycle_s(design.cycle_s);
            bench.battery_factor(&cost, cycle_s, 1.0).map_err(impassable)?;
            floor = floor.max(least_charge(bench, &cost, cycle_s));
            let cycles = leg.length_m / cost.advance_m;
            sum = Cost {
                cycles: sum.cycles + cycles,
                time_s: sum.time_s + cycles * cycle_s,
                motor_j: sum.motor_j + cycles * cost.motor_j,
                hotel_j: sum.hotel_j + cycles * bench.battery.hotel_power_w * cycle_s,
            };
            way.costs.push(cost);
            way.sums.push(sum);
            way.floors.push(floor);
        }
        Ok(way)
    }
}

/// The least share of the battery's energy with which it has the voltage for a cycle; it has it with all.
fn least_charge(bench: &Workbench, cost: &SlopeCost, cycle_s: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    if bench.battery_factor(cost, cycle_s, low).is_ok() {
        return low;
    }
    for _ in 0..CHARGE_STEPS {
        let middle = f64::midpoint(low, high);
        match bench.battery_factor(cost, cycle_s, middle) {
            Ok(_) => high = middle,
            Err(_) => low = middle,
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use worm_estimator::config::Config;

    fn itinerary(text: &str, needs_home: bool) -> Result<Itinerary, Impassable> {
        let bench = Workbench::new(&Config::default()).expect("the paper's worm");
        let route = Route::from_csv(&format!("length_m,slope_deg,cycle_s\n{text}"), Path::new("route.csv"));
        Itinerary::new(&bench, &route.expect("a route"), Going::Forward, needs_home)
    }

    #[test]
    fn sums_are_those_of_the_legs() {
        let way = itinerary("2,0,\n1,30,5\n", true).expect("it can be crawled");
        assert_eq!((way.length_m(), way.ends_of(1)), (3.0, [2.0, 3.0]));
        let out = way.cost(1.0, 2.5, Heading::Out).expect("there is one");
        assert!(
            (out.cycles - (1.0 / 6.8333e-3 + 0.5 / 4.6111e-3)).abs() < 0.05,
            "{out:?}"
        );
        assert!((out.time_s - (2.5 / 6.8333e-3 + 0.5 * 5.0 / 4.6111e-3)).abs() < 0.2);
        let home = way.cost(2.5, 1.0, Heading::Home).expect("there is one");
        // The level is the same both ways, and down goes further with less.
        assert!(home.cycles < out.cycles && home.motor_j < out.motor_j);
        assert_eq!(way.cost(1.0, 1.0, Heading::Out), Some(Cost::default()));
        assert!((way.cycles_per_s(0, Heading::Out) - 0.4).abs() < 1e-12);
        assert!((way.cycles_per_s(1, Heading::Home) + 0.2).abs() < 1e-12);
        let legs = |place_m| (way.leg_at(place_m, Heading::Out), way.leg_at(place_m, Heading::Home));
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0, 9.0].map(legs),
            [(0, 0), (0, 0), (1, 0), (1, 1), (1, 1)]
        );
    }

    #[test]
    fn a_leg_that_cannot_be_crawled_is_named_with_its_way() {
        let up = itinerary("1,0,\n1,65,\n", true).expect_err("too steep");
        assert!((up.leg, up.heading) == (2, Heading::Out), "{up}");
        let down = itinerary("1,0,\n1,-65,\n", true).expect_err("too steep home");
        assert!((down.leg, down.heading) == (2, Heading::Home), "{down}");
        assert!(down.to_string().contains("on the way home (65°)"), "{down}");
        let one_way = itinerary("1,0,\n1,-65,\n", false);
        assert!(one_way.is_ok_and(|way| !way.can_go_home() && way.cost(0.0, 2.0, Heading::Home).is_none()));
    }
}
