//! The ghost of a worm: where it is expected while nothing is heard of it, how sure that is, and how well it was hit in the end.
//!
//! A [`Ghost`] takes what is heard of the worm. When nothing comes any more, [`Ghost::predict`] says how far the worm has crawled since, by
//! - the **trip** that is under way: its own schedule, and what it does when its link is lost, too. The link is taken to be lost when the
//!   watcher's silence began;
//! - else the **crawl** that was going on, at the mean advance of the measured cycles. Where the worm crawls only for as long as its
//!   driver is heard, it holds after a second, unless the driver is still heard by others.
//!
//! The interval grows with what is not known: the standard error of the advance times the distance, the scatter of each cycle, another leg.
//! What it cannot know is that something stopped the worm meanwhile: an alarm, a fault, somebody else.
//!
//! Everything is pure; times are ns of one clock. [`Prediction`] and [`Score`] are JSON for who shows them elsewhere.

use super::correction::TRANSFER_SIGMA;
use serde::Serialize;
use std::f64::consts::TAU;
use worm_estimator::estimate::range::{INTERVAL_SIGMAS, MODEL_ADVANCE_SIGMA};
use worm_estimator::message::{Cycle, Estimate, LinkLoss, Mode, State, TripPhase, TripStatus};
use worm_estimator::time::seconds;
use worm_physics::MAX_CELLS;

/// Silence after which a watcher shows the ghost, ns.
pub const SILENCE_NS: u64 = 1_000_000_000;
/// Silence that is worth a score, ns.
const SCORED_NS: u64 = 3_000_000_000;
/// How long a worm crawls whose driver is gone, s.
const LAPSE_S: f64 = 1.0;
/// Newest cycles that say how far one goes.
const CYCLES: usize = 20;
/// Cycles that the model's prediction counts as.
const PRIOR_CYCLES: f64 = 1.0;
/// Standard deviation of the advance from cycle to cycle as long as it is not known, as a fraction.
const SCATTER: f64 = 0.03;
/// How much the mean advance may change while nobody looks, as a fraction.
const CHANGE_SIGMA: f64 = 0.02;
/// How far a place within a gait cycle is from its even share, and the moment of a command from the cycle's end, in advances of a cycle.
const WITHIN_CYCLE: f64 = 0.3;

/// What is known of the worm at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Heard {
    time_ns: u64,
    /// Mean position of the cells along the canal, m; none where nobody saw it.
    at_m: Option<f64>,
    /// Gait cycles per second, negative for backward; 0 where it does not crawl.
    cycles_per_s: f64,
    /// Whether the crawl lasts only as long as its driver is heard.
    is_attended: bool,
    trip: Option<TripStatus>,
}

/// The ghost of one worm.
#[derive(Debug, Clone, Default)]
pub struct Ghost {
    heard: Option<Heard>,
    pace: Pace,
}

/// What the ghost does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Doing {
    /// It stands where it was.
    Rests,
    /// It crawls on.
    Crawls,
    /// It crawls home, on a trip.
    Returns,
    /// It crawled, and holds by now.
    Holds,
    /// Its trip is over by now.
    Arrived,
}

/// A value with its 90 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Expected {
    /// Best estimate.
    pub mean: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

impl Expected {
    fn new(mean: f64, sigma: f64) -> Self {
        let half = INTERVAL_SIGMAS * sigma;
        Self {
            mean,
            low: mean - half,
            high: mean + half,
        }
    }
}

/// Where the worm is expected.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Prediction {
    /// How long nothing has been heard, s.
    pub silent_s: f64,
    /// What the worm does, as expected.
    pub doing: Doing,
    /// How far its cells have moved along the canal since it was last heard, m; negative towards smaller positions.
    pub moved_m: Expected,
    /// Distance from home along the route, m; none where there is no trip.
    pub place_m: Option<Expected>,
    /// Time until the trip is over, s; none where there is no trip or it has no end.
    pub left_s: Option<Expected>,
}

/// How well the ghost was hit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Score {
    /// How long nothing was heard, s.
    pub silent_s: f64,
    /// How far the cells moved meanwhile, m.
    pub moved_m: f64,
    /// That less what was predicted, m.
    pub error_m: f64,
    /// The same in standard deviations of the prediction.
    pub error_sigmas: f64,
    /// Whether it is in the 90 % interval.
    pub is_inside: bool,
}

impl Ghost {
    /// Takes a finished gait cycle.
    pub fn note_cycle(&mut self, cycle: &Cycle) {
        self.pace.add(cycle);
    }

    /// Takes what is heard of the worm now: messages that are no older than [`SILENCE_NS`]. `is_attended` says whether it crawls only as long as
    /// its driver is heard. Returns the score of the ghost, if there was a silence before and after which the worm was seen.
    pub fn hear(
        &mut self,
        state: &State,
        estimate: &Estimate,
        trip: Option<&TripStatus>,
        is_attended: bool,
        now_ns: u64,
    ) -> Option<Score> {
        let at_m = mean_position_m(estimate);
        let is_crawling = state.mode == Mode::Crawling.code();
        let score = at_m.and_then(|at_m| self.score(at_m, now_ns));
        self.heard = Some(Heard {
            time_ns: now_ns,
            at_m,
            cycles_per_s: if is_crawling {
                state.goal_velocity_rad_s / TAU
            } else {
                0.0
            },
            is_attended,
            trip: trip.filter(|trip| is_under_way(trip, now_ns)).copied(),
        });
        score
    }

    /// Where the worm is expected now; none before it was heard.
    pub fn predict(&self, now_ns: u64) -> Option<Prediction> {
        let heard = self.heard.as_ref()?;
        let silent_s = seconds(now_ns.saturating_sub(heard.time_ns));
        Some(match &heard.trip {
            Some(trip) => self.on_trip(heard, trip, silent_s),
            None => self.on_crawl(heard, silent_s),
        })
    }

    fn score(&self, at_m: f64, now_ns: u64) -> Option<Score> {
        let heard = self.heard.as_ref()?;
        let silent_ns = now_ns.saturating_sub(heard.time_ns);
        let predicted = self.predict(now_ns).filter(|_| silent_ns >= SCORED_NS)?;
        let moved_m = at_m - heard.at_m?;
        let expected = predicted.moved_m;
        let sigma_m = (expected.high - expected.low) / (2.0 * INTERVAL_SIGMAS);
        let error_m = moved_m - expected.mean;
        Some(Score {
            silent_s: seconds(silent_ns),
            moved_m,
            error_m,
            error_sigmas: error_m / sigma_m,
            is_inside: (expected.low..=expected.high).contains(&moved_m),
        })
    }

    fn on_crawl(&self, heard: &Heard, silent_s: f64) -> Prediction {
        let crawled_s = if heard.is_attended {
            silent_s.min(LAPSE_S)
        } else {
            silent_s
        };
        let step = self.pace.step(heard.cycles_per_s, crawled_s);
        let mut moved_m = Expected::new(step.mean_m, step.sigma_m);
        if heard.is_attended {
            // Others may still hear the driver.
            let on = self.pace.step(heard.cycles_per_s, silent_s);
            let furthest = Expected::new(on.mean_m, on.sigma_m);
            (moved_m.low, moved_m.high) = (moved_m.low.min(furthest.low), moved_m.high.max(furthest.high));
        }
        let doing = match heard.cycles_per_s == 0.0 {
            true => Doing::Rests,
            false if heard.is_attended && silent_s > LAPSE_S => Doing::Holds,
            false => Doing::Crawls,
        };
        Prediction {
            silent_s,
            doing,
            moved_m,
            place_m: None,
            left_s: None,
        }
    }

    fn on_trip(&self, heard: &Heard, trip: &TripStatus, silent_s: f64) -> Prediction {
        let schedule = Schedule::of(trip);
        let age_s = seconds(heard.time_ns.saturating_sub(trip.time_ns));
        let (from, to) = (schedule.at(age_s), schedule.at(age_s + silent_s));
        let cycle_m = trip.advance_per_cycle_m.abs();
        let is_moving = trip.point_count > 0;
        let extra_m = if is_moving { WITHIN_CYCLE * cycle_m } else { 0.0 };
        let grown_m = (to.sigma_m.powi(2) - from.sigma_m.powi(2)).max(0.0).sqrt();
        let sigma_m = grown_m.hypot(extra_m).max(MIN_SIGMA_M);
        let sign = schedule.out_sign;
        let place_m = Expected::new(to.place_m, to.sigma_m.hypot(extra_m));
        Prediction {
            silent_s,
            doing: to.doing,
            moved_m: Expected::new(sign * (to.place_m - from.place_m), sigma_m),
            place_m: Some(place_m),
            left_s: schedule.left(age_s + silent_s),
        }
    }
}

/// Standard error of the place of a worm that rests, m: the tracker's, and a slide of the tips that is not noticed.
const MIN_SIGMA_M: f64 = 2e-4;

/// Whether a message is of a trip that goes on, and new enough to be believed.
fn is_under_way(trip: &TripStatus, now_ns: u64) -> bool {
    /// A trip says twice a second how it stands.
    const OLD_NS: u64 = 3_000_000_000;
    let phase = TripPhase::try_from(trip.phase);
    let is_over = matches!(phase, Err(_) | Ok(TripPhase::Done | TripPhase::Aborted));
    !is_over && now_ns.saturating_sub(trip.time_ns) < OLD_NS
}

fn mean_position_m(estimate: &Estimate) -> Option<f64> {
    let cells = (estimate.cell_count as usize).min(MAX_CELLS);
    let sum_m: f64 = estimate.position_m[..cells].iter().sum();
    (cells > 0 && sum_m.is_finite()).then(|| sum_m / cells as f64)
}

/// How far a cycle goes, by the newest cycles of one direction.
#[derive(Debug, Clone, Default)]
struct Pace {
    direction: i32,
    /// Advance of each of the newest cycles, m.
    advances_m: Vec<f64>,
    predicted_m: f64,
}

/// A distance along the canal.
#[derive(Debug, Clone, Copy)]
struct Step {
    mean_m: f64,
    sigma_m: f64,
}

impl Pace {
    fn add(&mut self, cycle: &Cycle) {
        if cycle.direction != self.direction {
            self.advances_m.clear();
        }
        self.direction = cycle.direction;
        self.predicted_m = cycle.predicted_advance_m;
        if !cycle.advance_m.is_finite() {
            return;
        }
        if self.advances_m.len() == CYCLES {
            self.advances_m.remove(0);
        }
        self.advances_m.push(cycle.advance_m);
    }

    /// The distance that a crawl of this speed goes in a time.
    fn step(&self, cycles_per_s: f64, time_s: f64) -> Step {
        let cycles = (cycles_per_s * time_s).abs();
        let is_same_way = f64::from(self.direction) * cycles_per_s > 0.0;
        let known = if is_same_way { self.advances_m.as_slice() } else { &[] };
        let count = known.len() as f64;
        // Backward it goes about as far as forward.
        let predicted_m = match (self.predicted_m.is_finite(), is_same_way) {
            (false, _) => 0.0,
            (true, true) => self.predicted_m,
            (true, false) => -self.predicted_m,
        };
        let weight = count + PRIOR_CYCLES;
        let mean_m = (known.iter().sum::<f64>() + PRIOR_CYCLES * predicted_m) / weight;
        let squares: f64 = known.iter().map(|advance_m| (advance_m - mean_m).powi(2)).sum();
        let guess_m2 = (SCATTER * mean_m).powi(2);
        let scatter_m2 = (squares + 4.0 * guess_m2) / (count + 4.0);
        let prior_m2 = (MODEL_ADVANCE_SIGMA * mean_m * PRIOR_CYCLES / weight).powi(2);
        let change_m2 = (CHANGE_SIGMA * mean_m).powi(2);
        let mean_m2 = scatter_m2 / weight + prior_m2 + change_m2;
        let within_m = if cycles > 0.0 { WITHIN_CYCLE * mean_m } else { 0.0 };
        let sigma_m = (mean_m2 * cycles * cycles + scatter_m2 * cycles).sqrt().hypot(within_m);
        Step {
            mean_m: mean_m * cycles,
            sigma_m: sigma_m.max(MIN_SIGMA_M),
        }
    }
}

/// Where a trip is expected, over the time since its message.
struct Schedule {
    /// Times, s; places, m; standard errors, m; growing times, the first 0.
    points: Vec<(f64, f64, f64)>,
    /// When the trip waits for its link, or is over, s.
    ends_s: f64,
    ends: Doing,
    /// When it is on its way home, s.
    home_from_s: f64,
    /// Time until it is over at first, with bounds as factors.
    left: Option<(f64, f64, f64)>,
    /// Sign of the way out along the canal.
    out_sign: f64,
}

/// A place at a moment.
struct At {
    place_m: f64,
    sigma_m: f64,
    doing: Doing,
}

impl Schedule {
    fn of(trip: &TripStatus) -> Self {
        let is_out = trip.heading == TripPhase::Outbound.code();
        let heading_sign = if is_out { 1.0 } else { -1.0 };
        let out_sign = if trip.cycles_per_s < 0.0 {
            -heading_sign
        } else {
            heading_sign
        };
        let mut points = vec![(0.0, trip.position_m, trip.position_sigma_m)];
        let count = (trip.point_count as usize).min(MAX_CELLS);
        for at in 0..count {
            let point = (trip.point_s[at], trip.point_m[at], trip.point_sigma_m[at]);
            let last_s = points.last().map_or(0.0, |last| last.0);
            if point.0 >= last_s && point.1.is_finite() && point.2.is_finite() {
                points.push(point);
            }
        }
        let last_s = points.last().map_or(0.0, |last| last.0);
        let turn = points.windows(2).find(|pair| pair[1].1 < pair[0].1);
        let mut schedule = Self {
            home_from_s: turn.map_or(f64::INFINITY, |pair| pair[0].0),
            ends_s: if count > 0 { last_s } else { f64::INFINITY },
            ends: Doing::Arrived,
            left: (trip.left_s > 0.0).then(|| {
                (
                    trip.left_s,
                    trip.left_low_s / trip.left_s,
                    trip.left_high_s / trip.left_s,
                )
            }),
            points,
            out_sign,
        };
        let lost_s = (trip.link_timeout_s - trip.link_age_s).max(0.0);
        // What the trip does by itself when the link is lost. What it does already goes on.
        if is_out && count > 0 && lost_s < schedule.home_from_s && lost_s < last_s {
            match LinkLoss::try_from(trip.link_loss) {
                Ok(LinkLoss::Hold) => schedule.hold_at(lost_s),
                Ok(LinkLoss::Return) => schedule.return_at(lost_s, trip),
                _ => {}
            }
        }
        schedule
    }

    fn hold_at(&mut self, lost_s: f64) {
        let (place_m, sigma_m) = self.interpolated(lost_s);
        self.points.retain(|point| point.0 < lost_s);
        self.points.push((lost_s, place_m, sigma_m));
        (self.ends_s, self.ends, self.left) = (lost_s, Doing::Holds, None);
    }

    fn return_at(&mut self, lost_s: f64, trip: &TripStatus) {
        let (turn_m, sigma_m) = self.interpolated(lost_s);
        // The way home from here takes what it takes from where the trip was, and the rest in proportion.
        let home_s = trip.home_s
            * if trip.position_m > 0.0 {
                turn_m / trip.position_m
            } else {
                0.0
            };
        let planned: Vec<_> = self
            .points
            .iter()
            .copied()
            .filter(|point| point.0 >= self.home_from_s)
            .collect();
        self.points.retain(|point| point.0 < lost_s);
        self.points.push((lost_s, turn_m, sigma_m));
        let relative = (trip.advance_per_cycle_sigma_m / trip.advance_per_cycle_m)
            .abs()
            .hypot(TRANSFER_SIGMA);
        // Where the schedule has the way home, it says how long each part of it takes.
        let passed_s = time_of_place(&planned, turn_m);
        match passed_s {
            Some(passed_s) => {
                let later = planned.iter().filter(|point| point.0 > passed_s && point.1 < turn_m);
                for &(time_s, place_m, _) in later {
                    let grown_m = sigma_m.hypot(relative * (turn_m - place_m));
                    self.points.push((lost_s + time_s - passed_s, place_m, grown_m));
                }
            }
            None => self
                .points
                .push((lost_s + home_s, 0.0, sigma_m.hypot(relative * turn_m))),
        }
        let over_s = self.points.last().map_or(lost_s, |last| last.0);
        (self.home_from_s, self.ends_s) = (lost_s, over_s);
        let whole = (trip.home_low_s / trip.home_s, trip.home_high_s / trip.home_s);
        self.left = Some((over_s, whole.0, whole.1));
    }

    fn interpolated(&self, time_s: f64) -> (f64, f64) {
        let above = self.points.partition_point(|point| point.0 <= time_s);
        let Some(&(_, place_m, sigma_m)) = self.points.get(above) else {
            return self.points.last().map_or((f64::NAN, f64::NAN), |last| (last.1, last.2));
        };
        let before = self.points[above.saturating_sub(1)];
        let span_s = self.points[above].0 - before.0;
        let fraction = if span_s > 0.0 {
            (time_s - before.0) / span_s
        } else {
            1.0
        };
        // The variance grows with the square of the time where the speed is not known.
        let variance = before.2.powi(2) + fraction * fraction * (sigma_m.powi(2) - before.2.powi(2));
        (before.1 + fraction * (place_m - before.1), variance.max(0.0).sqrt())
    }

    fn at(&self, time_s: f64) -> At {
        let (place_m, sigma_m) = self.interpolated(time_s.min(self.ends_s));
        let doing = if self.points.len() < 2 {
            Doing::Rests
        } else if time_s >= self.ends_s {
            self.ends
        } else if time_s >= self.home_from_s {
            Doing::Returns
        } else {
            Doing::Crawls
        };
        At {
            place_m,
            sigma_m,
            doing,
        }
    }

    fn left(&self, time_s: f64) -> Option<Expected> {
        let (mean_s, low, high) = self.left?;
        Some(Expected {
            mean: (mean_s - time_s).max(0.0),
            low: (mean_s * low - time_s).max(0.0),
            high: (mean_s * high - time_s).max(0.0),
        })
    }
}

/// When a schedule that goes home passes a place.
fn time_of_place(points: &[(f64, f64, f64)], place_m: f64) -> Option<f64> {
    let passing = points
        .windows(2)
        .find(|pair| pair[0].1 >= place_m && pair[1].1 <= place_m)?;
    let [(from_s, from_m, _), (to_s, to_m, _)] = [passing[0], passing[1]];
    let fraction = if from_m > to_m {
        (from_m - place_m) / (from_m - to_m)
    } else {
        1.0
    };
    Some(from_s + fraction * (to_s - from_s))
}
