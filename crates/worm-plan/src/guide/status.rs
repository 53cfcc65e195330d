//! How a trip stands, as a message, with where the worm is expected from now on.

use super::{Guide, Motion, Wait};
use crate::correction::LEG_SIGMA;
use crate::energy_budget::Energy;
use crate::itinerary::{Cost, Heading};
use worm_estimator::config::OnLinkLoss;
use worm_estimator::estimate::range::INTERVAL_SIGMAS;
use worm_estimator::message::{LinkLoss, TripPhase, TripStatus};
use worm_estimator::time::seconds;
use worm_physics::MAX_CELLS;

/// How much of what is not known of the battery may still change until it makes the worm turn; the rest is the same then.
const TURN_CHANGE: f64 = 0.5;
/// Most points of each way ahead.
const POINTS: usize = MAX_CELLS / 2;

/// Where the worm is expected, and when.
#[derive(Debug, Clone, Copy)]
struct Point {
    place_m: f64,
    time_s: f64,
    sigma_m: f64,
}

/// A time with its standard error, s.
#[derive(Debug, Clone, Copy)]
struct Time {
    mean_s: f64,
    sigma_s: f64,
}

impl Time {
    const UNKNOWN: Self = Self {
        mean_s: f64::NAN,
        sigma_s: f64::NAN,
    };

    fn bounds_s(&self) -> [f64; 2] {
        let half_s = INTERVAL_SIGMAS * self.sigma_s;
        // What is not known stays so: the greater of a number and NaN is the number.
        let low_s = if self.mean_s >= half_s {
            self.mean_s - half_s
        } else {
            0.0 * self.mean_s
        };
        [low_s, self.mean_s + half_s]
    }
}

impl Guide {
    /// What the trip does.
    pub const fn phase(&self) -> TripPhase {
        match (self.over, self.wait, self.heading) {
            (Some(phase), ..) => phase,
            (None, Some(_), _) => TripPhase::Holding,
            (None, None, heading) => phase_of(heading),
        }
    }

    /// A status was published: the next one is another message, and has the next number.
    pub const fn note_published(&mut self) {
        self.published += 1;
    }

    /// How the trip stands. It is looked at more often than it is published, so looking does not count.
    pub fn status(&self, now_ns: u64) -> TripStatus {
        let place_m = self.place.m;
        let leg = self.itinerary.leg_at(place_m, self.heading);
        let [start_m, end_m] = self.itinerary.ends_of(leg);
        let leg_left_m = match self.heading {
            Heading::Out => end_m - place_m,
            Heading::Home => place_m - start_m,
        };
        let budget = self.budget.as_ref();
        let left = budget.and_then(|budget| budget.left(&self.itinerary, place_m, now_ns));
        let home = budget.and_then(|budget| budget.home(&self.itinerary, &self.correction, place_m));
        let (left, home) = (left.unwrap_or(Energy::UNKNOWN), home.unwrap_or(Energy::UNKNOWN));
        let home_time = self.time(place_m, 0.0, Heading::Home);
        let turn_m = self.turn_m(now_ns);
        let (points, left_time) = match self.phase() {
            TripPhase::Outbound | TripPhase::Returning => self.ahead(turn_m, self.turn_sigma_m(turn_m, now_ns)),
            _ => (Vec::new(), Time::UNKNOWN),
        };
        let ratio = self.correction.of(self.heading).advance;
        let advance_m = self.advance_m();
        let list = |of: fn(&Point) -> f64| std::array::from_fn(|at| points.get(at).map_or(f64::NAN, of));
        let [energy_left_low_j, energy_left_high_j] = left.bounds_j();
        let [energy_home_low_j, energy_home_high_j] = home.bounds_j();
        let [home_low_s, home_high_s] = home_time.bounds_s();
        let [left_low_s, left_high_s] = left_time.bounds_s();
        TripStatus {
            sequence: self.published + 1,
            time_ns: now_ns,
            started_ns: self.started_ns,
            since_ns: self.why.since_ns,
            position_m: place_m,
            position_sigma_m: self.place.sigma_m(),
            length_m: self.itinerary.length_m(),
            turn_m,
            leg_left_m: leg_left_m.max(0.0),
            cycles_per_s: match self.motion {
                Motion::Crawling { cycles_per_s, .. } => cycles_per_s,
                Motion::Rest => 0.0,
            },
            advance_per_cycle_m: advance_m,
            advance_per_cycle_sigma_m: advance_m * ratio.sigma() / ratio.mean(),
            advance_scatter_m: advance_m * ratio.scatter() / ratio.mean(),
            energy_left_j: left.mean_j,
            energy_left_low_j,
            energy_left_high_j,
            energy_home_j: home.mean_j,
            energy_home_low_j,
            energy_home_high_j,
            home_s: home_time.mean_s,
            home_low_s,
            home_high_s,
            left_s: left_time.mean_s,
            left_low_s,
            left_high_s,
            link_age_s: seconds(now_ns.saturating_sub(self.heard_ns)),
            link_timeout_s: self.settings.link_timeout_s,
            point_m: list(|point| point.place_m),
            point_s: list(|point| point.time_s),
            point_sigma_m: list(|point| point.sigma_m),
            phase: self.phase().code(),
            reason: self.why.reason.code(),
            heading: phase_of(self.heading).code(),
            alarm: self.why.alarm.map_or(u32::MAX, |alarm| alarm.code()),
            link_loss: match self.settings.link_loss {
                OnLinkLoss::Hold => LinkLoss::Hold,
                OnLinkLoss::Return => LinkLoss::Return,
                OnLinkLoss::Continue => LinkLoss::Continue,
            }
            .code(),
            link_is_lost: self.link_is_lost.into(),
            return_home: self.return_home.into(),
            leg: leg as u32 + 1,
            leg_count: self.itinerary.legs().len() as u32,
            point_count: points.len() as u32,
            cycles: self.place.cycles,
            needs_operator: u32::from(self.wait == Some(Wait::Operator)),
            by: self.why.by,
        }
    }

    /// Furthest distance from home that is expected, m.
    fn turn_m(&self, now_ns: u64) -> f64 {
        match (self.heading, self.over) {
            (Heading::Home, _) | (_, Some(_)) => self.place.furthest_m,
            (Heading::Out, None) => {
                let end_m = self.itinerary.length_m();
                let by_energy = self
                    .budget
                    .as_ref()
                    .filter(|_| self.return_home)
                    .map_or(end_m, |budget| {
                        budget.turn_m(&self.itinerary, &self.correction, self.place.m, now_ns)
                    });
                by_energy.max(self.place.m)
            }
        }
    }

    /// Standard error of that, m: 0 where the route ends there.
    fn turn_sigma_m(&self, turn_m: f64, now_ns: u64) -> f64 {
        if self.heading == Heading::Home || turn_m >= self.itinerary.length_m() {
            return 0.0;
        }
        let budget = self.budget.as_ref();
        let sigma_m = budget.and_then(|budget| budget.turn_sigma_m(&self.itinerary, &self.correction, turn_m, now_ns));
        sigma_m.unwrap_or(0.0)
    }

    /// The time from one place to another.
    fn time(&self, from_m: f64, to_m: f64, heading: Heading) -> Time {
        let cost = self.itinerary.cost(from_m, to_m, heading);
        cost.map_or(Time::UNKNOWN, |cost| Time {
            mean_s: cost.time_s / self.correction.of(heading).advance.mean(),
            sigma_s: self.pace_sigma(from_m, to_m, heading) * cost.time_s / self.correction.of(heading).advance.mean(),
        })
    }

    /// Standard error of the speed between two places, as a fraction: another leg may be crawled at another one.
    fn pace_sigma(&self, from_m: f64, to_m: f64, heading: Heading) -> f64 {
        let ratio = self.correction.of(heading).advance;
        let leg = |place_m: f64| self.itinerary.leg_at(place_m, heading);
        let other_leg = if leg(from_m) == leg(to_m) { 0.0 } else { LEG_SIGMA };
        (ratio.sigma() / ratio.mean()).hypot(other_leg)
    }

    /// Where the worm is expected from now on, and when the trip is over.
    fn ahead(&self, turn_m: f64, turn_sigma_m: f64) -> (Vec<Point>, Time) {
        let place_m = self.place.m;
        let mut points = Vec::with_capacity(MAX_CELLS);
        let (mut time_s, mut sigma_s, mut sigma_m) = (0.0, 0.0, self.place.sigma_m());
        let (mut from_m, mut heading) = (place_m, Heading::Home);
        if self.heading == Heading::Out {
            for to_m in thinned(self.leg_ends(place_m, turn_m), POINTS) {
                points.push(self.point(place_m, to_m, Heading::Out, 0.0, self.place.sigma_m()));
            }
            let out = self.time(place_m, turn_m, Heading::Out);
            (time_s, sigma_s) = (out.mean_s, out.sigma_s);
            // Who turns later by a distance comes home later by the time for twice that, and is as far behind.
            let twice_m = 2.0 * TURN_CHANGE * turn_sigma_m;
            sigma_m = points.last().map_or(sigma_m, |point| point.sigma_m).hypot(twice_m);
            sigma_s = sigma_s.hypot(twice_m * time_s / (turn_m - place_m).max(turn_sigma_m).max(1e-3));
            (from_m, heading) = (turn_m, if self.return_home { Heading::Home } else { Heading::Out });
        }
        if heading == Heading::Home {
            let mut ends_m = self.leg_ends(0.0, from_m);
            ends_m.reverse();
            // The last of them is where the way home begins.
            let stops = ends_m.into_iter().skip(1).chain([0.0]).collect();
            for to_m in thinned(stops, POINTS) {
                points.push(self.point(from_m, to_m, Heading::Home, time_s, sigma_m));
            }
            let home = self.time(from_m, 0.0, Heading::Home);
            time_s += home.mean_s;
            sigma_s = sigma_s.hypot(home.sigma_s);
        }
        let time = Time {
            mean_s: time_s,
            sigma_s,
        };
        (points, time)
    }

    fn point(&self, from_m: f64, to_m: f64, heading: Heading, after_s: f64, sigma_m: f64) -> Point {
        let cost = self.itinerary.cost(from_m, to_m, heading).unwrap_or_default();
        let ratio = self.correction.of(heading).advance;
        let distance_m = (to_m - from_m).abs();
        let scattered_m = scatter_m(&cost, ratio.scatter(), distance_m);
        let paced_m = self.pace_sigma(from_m, to_m, heading) * distance_m;
        Point {
            place_m: to_m,
            time_s: after_s + cost.time_s / ratio.mean(),
            sigma_m: sigma_m.hypot(paced_m).hypot(scattered_m),
        }
    }

    /// Where legs end between two places, the further one included.
    fn leg_ends(&self, near_m: f64, far_m: f64) -> Vec<f64> {
        let first = self.itinerary.leg_at(near_m, Heading::Out);
        let ends = (first..self.itinerary.legs().len()).map(|leg| self.itinerary.ends_of(leg)[1]);
        let mut ends: Vec<f64> = ends.take_while(|&end_m| end_m < far_m).collect();
        ends.push(far_m);
        ends
    }
}

/// What the scatter from cycle to cycle adds up to over a distance, m.
fn scatter_m(cost: &Cost, scatter: f64, distance_m: f64) -> f64 {
    if cost.cycles > 0.0 {
        distance_m * scatter / cost.cycles.sqrt()
    } else {
        0.0
    }
}

/// At most so many of the places, evenly spread, the last one among them.
fn thinned(places_m: Vec<f64>, most: usize) -> Vec<f64> {
    let count = places_m.len();
    if count <= most {
        return places_m;
    }
    (1..=most).map(|number| places_m[number * count / most - 1]).collect()
}

const fn phase_of(heading: Heading) -> TripPhase {
    match heading {
        Heading::Out => TripPhase::Outbound,
        Heading::Home => TripPhase::Returning,
    }
}
