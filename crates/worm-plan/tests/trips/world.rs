//! One worm in virtual time. The physics is the exact motion of the true worm on the true slopes; the trip and the estimator know only the
//! configuration, the route, and what is measured.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use std::path::Path;
use worm_estimator::battery::{OpenCircuit, under_load};
use worm_estimator::config::{Battery, Chemistry, Config, Limits, PerCell, Trip};
use worm_estimator::estimate::RangeEstimator;
use worm_estimator::message::{
    CommandOutcome, Cycle, Estimate, FieldAccess, HoldReason, Inferred, Mode, State, TripStatus,
};
use worm_plan::guide::LIMIT_S;
use worm_plan::itinerary::Itinerary;
use worm_plan::{Action, Going, Guide, Heading, Route, Workbench};

pub const STEP_S: f64 = 0.125;
const STEP_NS: u64 = 125_000_000;
/// Standard deviations by which worms differ from the configuration, as fractions.
const FRICTION_SIGMA: f64 = 0.4;
const DEFORMATION_SIGMA: f64 = 0.1;
const RESISTANCE_SIGMA: f64 = 0.25;
/// Standard deviation of what the model is off by on each leg and in each direction, beyond all that, as a fraction: against the paper's
/// experiment (Table 4) it is off by +5, −18 and 0 % on three slopes.
const LEG_SIGMA: f64 = 0.06;
/// Standard deviation of a slope from the route's, degrees, and of a length, as a fraction.
const SLOPE_SIGMA_DEG: f64 = 1.5;
const LENGTH_SIGMA: f64 = 0.01;

pub struct Rng(Xoshiro256PlusPlus);

impl Rng {
    pub fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    pub fn index(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }
}

/// Standard deviation of the advance that is inferred without a tracker, as a fraction of the true worm's by the model.
const INFERRED_SIGMA: f64 = 0.03;

/// A worm on its trip.
pub struct World {
    pub guide: Guide,
    pub now_ns: u64,
    /// True distance from home, m.
    pub place_m: f64,
    /// Furthest that it was, m.
    pub furthest_m: f64,
    /// True share of the battery's energy.
    pub share: f64,
    pub is_dead: bool,
    /// Whether somebody is heard.
    pub link: bool,
    pub cycles: Vec<Cycle>,
    config: Config,
    range: Option<RangeEstimator>,
    truth: Itinerary,
    curve: OpenCircuit,
    offset_v: f64,
    resistance_ohm: f64,
    capacity_j: f64,
    hotel_w: f64,
    scatter: f64,
    /// Inferred advance over the true worm's by the model; none with a tracker.
    inferred: Option<f64>,
    /// Advance and energy over those of the true worm's model, out and home, for each leg.
    unmodelled: Vec<[[f64; 2]; 2]>,
    rng: Rng,
    state: State,
    until_ns: u64,
    cycles_per_s: f64,
    done: f64,
    cycle: Draft,
}

/// The open cycle.
#[derive(Clone, Copy)]
struct Draft {
    advance_m: f64,
    motor_w: f64,
    measured_j: f64,
    index: u64,
}

impl World {
    /// A worm on a route of one to five legs, for which its battery suffices, or not. None where it cannot crawl there as it truly is.
    pub fn draw(seed: u64, trip: Trip) -> Option<Self> {
        Self::draw_with(seed, trip, true)
    }

    /// The same worm without a tracker.
    pub fn draw_without_tracker(seed: u64, trip: Trip) -> Option<Self> {
        Self::draw_with(seed, trip, false)
    }

    fn draw_with(seed: u64, trip: Trip, has_tracker: bool) -> Option<Self> {
        let mut rng = Rng::new(seed);
        let (chemistry, full_v, empty_v, lowest_v) = [
            (Chemistry::Linear, 5.6, 4.0, 3.7),
            (Chemistry::NiMH, 5.6, 4.0, 4.2),
            (Chemistry::LiPo, 4.2, 3.27, 3.3),
        ][rng.index(3)];
        let battery = Battery {
            capacity_j: 1200.0,
            chemistry,
            full_v,
            empty_v,
            hotel_power_w: rng.between(0.1, 0.8),
            ..Battery::default()
        };
        let mut config = Config {
            limits: Limits {
                voltage_v: lowest_v,
                current_a: 1.5,
                ..Limits::default()
            },
            battery: Some(battery.clone()),
            trip,
            ..Config::default()
        };
        config.tracker.present = has_tracker;
        let bench = Workbench::new(&config).ok()?;
        let share = rng.between(0.5, 1.0);
        // Half of the routes are longer than the battery lasts.
        let level = Route::from_csv("length_m,slope_deg\n1,0\n", Path::new("level.csv")).ok()?;
        let range_m = worm_plan::trip(&bench, &bench.configured(), &level, share)
            .range_m?
            .mean;
        let legs = 1 + rng.index(5);
        let (mut text, mut true_text) = (String::new(), String::new());
        let length_m = range_m * rng.between(0.1, 0.9) / legs as f64;
        for _ in 0..legs {
            let slope_deg = if rng.index(3) == 0 {
                0.0
            } else {
                rng.between(-25.0, 25.0)
            };
            text += &format!("{length_m},{slope_deg}\n");
            let true_length_m = length_m * (1.0 + LENGTH_SIGMA * rng.normal());
            true_text += &format!("{true_length_m},{}\n", slope_deg + SLOPE_SIGMA_DEG * rng.normal());
        }
        let route = |text: &str| Route::from_csv(&format!("length_m,slope_deg\n{text}"), Path::new("route.csv"));
        let mut truly = config.clone();
        let friction = (1.0 + FRICTION_SIGMA * rng.normal()).clamp(0.2, 2.2);
        truly.virtual_worm.inner_friction_n_m *= friction;
        truly.virtual_worm.inner_viscous_n_m_s_per_rad *= friction;
        let deformation = (1.0 + DEFORMATION_SIGMA * rng.normal()).clamp(0.6, 1.4);
        let bounds_m = config.worm.max_deformation_m.to_vec(config.worm.cells);
        truly.worm.max_deformation_m = PerCell::Each(bounds_m.iter().map(|bound_m| bound_m * deformation).collect());
        let true_bench = Workbench::new(&truly).ok()?;
        let truth = Itinerary::new(&true_bench, &route(&true_text).ok()?, Going::Forward, true).ok()?;
        let guide = Guide::new(&bench, &config, &route(&text).ok()?, true, 0).ok()?;
        let mut world = Self {
            guide,
            now_ns: 0,
            place_m: 0.0,
            furthest_m: 0.0,
            share,
            is_dead: false,
            link: true,
            cycles: Vec::new(),
            range: RangeEstimator::new(&config).expect("a servo"),
            truth,
            curve: OpenCircuit::new(&battery),
            offset_v: battery.open_circuit_sigma_v * rng.normal(),
            resistance_ohm: battery.internal_resistance_ohm * (1.0 + RESISTANCE_SIGMA * rng.normal()).max(0.2),
            capacity_j: battery.capacity_j * (1.0 + battery.capacity_sigma_share * rng.normal()),
            hotel_w: battery.hotel_power_w * (1.0 + battery.hotel_power_sigma_share * rng.normal()).max(0.1),
            scatter: rng.between(0.005, 0.04),
            inferred: None,
            unmodelled: (0..legs)
                .map(|_| [[(); 2]; 2].map(|of| of.map(|()| (1.0 + LEG_SIGMA * rng.normal()).max(0.7))))
                .collect(),
            rng,
            state: State::unknown(4),
            until_ns: 0,
            cycles_per_s: 0.0,
            done: 0.0,
            cycle: Draft {
                advance_m: 0.0,
                motor_w: 0.0,
                measured_j: 0.0,
                index: 0,
            },
            config,
        };
        if !has_tracker {
            world.inferred = Some(1.0 + INFERRED_SIGMA * world.rng.normal());
            world.guide.note_inferred(&Inferred {
                position_m: 0.0,
                position_sigma_m: 0.0,
                phase: 0.0,
                ..Inferred::empty()
            });
        }
        Some(world)
    }

    /// One step of time.
    pub fn step(&mut self) {
        self.now_ns += STEP_NS;
        if self.link {
            self.guide.note_link(self.now_ns);
        }
        self.obey();
        self.live();
        self.guide.note_state(&self.state, self.now_ns);
    }

    pub fn is_over(&self) -> bool {
        self.is_dead || self.guide.is_over()
    }

    pub fn status(&mut self) -> TripStatus {
        self.guide.status(self.now_ns)
    }

    /// The newest state.
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// Where the cells are: all at one place.
    pub fn estimate(&self) -> Estimate {
        Estimate {
            cell_count: 4,
            position_m: [self.place_m + self.done * self.cycle.advance_m; worm_physics::MAX_CELLS],
            ..Estimate::empty()
        }
    }

    fn obey(&mut self) {
        let Some(action) = self.guide.next(self.now_ns) else {
            return;
        };
        let until_ns = self.now_ns + (LIMIT_S * 1e9) as u64;
        match action {
            Action::Arm => self.state.mode = Mode::Armed.code(),
            Action::Crawl(cycles_per_s) => {
                if cycles_per_s * self.cycles_per_s <= 0.0 {
                    self.done = 0.0;
                    self.cycles_per_s = cycles_per_s;
                    self.begin_cycle();
                }
                self.cycles_per_s = cycles_per_s;
                (self.until_ns, self.state.mode) = (until_ns, Mode::Crawling.code());
            }
            Action::Renew => self.until_ns = until_ns,
            Action::Hold => self.rest(HoldReason::Command),
        }
        self.guide.answered(
            action,
            Some((CommandOutcome::Accepted, self.state.sequence)),
            self.now_ns,
        );
    }

    fn rest(&mut self, reason: HoldReason) {
        (self.state.mode, self.state.hold_reason) = (Mode::Holding.code(), reason.code());
    }

    fn live(&mut self) {
        if self.state.mode == Mode::Crawling.code() && self.now_ns > self.until_ns {
            self.rest(HoldReason::TimeLimit);
        }
        let is_crawling = self.state.mode == Mode::Crawling.code();
        let ripple = 1.0 + 0.3 * (TAU * 4.0 * self.done).sin();
        let motor_w = if is_crawling { self.cycle.motor_w * ripple } else { 0.0 };
        let open_v = self.curve.volts(self.share) + self.offset_v;
        let loaded = under_load(open_v, self.resistance_ohm, motor_w + self.hotel_w);
        let Some((current_a, bus_v)) = loaded.filter(|(_, bus_v)| *bus_v > self.config.limits.voltage_v) else {
            self.is_dead = true;
            return;
        };
        self.share -= open_v * current_a * STEP_S / self.capacity_j;
        self.is_dead |= self.share <= 0.0;
        let read_v = (bus_v * 10.0).round() / 10.0;
        self.state = State {
            sequence: self.state.sequence + 1,
            time_ns: self.now_ns,
            bus_voltage_v: read_v,
            motor_duty: 0.5,
            motor_current_a: 2.0 * motor_w / bus_v,
            goal_velocity_rad_s: if is_crawling { TAU * self.cycles_per_s } else { 0.0 },
            ..self.state
        };
        if let Some(range) = &mut self.range {
            range.note_state(&self.state);
        }
        if is_crawling {
            self.cycle.measured_j += motor_w / bus_v * read_v * STEP_S;
            self.done += self.cycles_per_s.abs() * STEP_S;
            if self.done >= 1.0 - 1e-9 {
                self.finish_cycle();
            }
        }
    }

    fn heading(&self) -> Heading {
        if self.cycles_per_s > 0.0 {
            Heading::Out
        } else {
            Heading::Home
        }
    }

    fn begin_cycle(&mut self) {
        let heading = self.heading();
        let leg = self.truth.leg_at(self.place_m, heading);
        let cost = *self.truth.cycle(leg, heading).expect("it can crawl home");
        let cycle_s = self.truth.cycle_s(leg);
        let [advance, energy] = self.unmodelled[leg][usize::from(heading == Heading::Home)];
        self.cycle = Draft {
            advance_m: heading.sign() * cost.advance_m * advance * (1.0 + self.scatter * self.rng.normal()),
            motor_w: cost.motor_j / cycle_s * energy * (1.0 + self.scatter * self.rng.normal()),
            measured_j: 0.0,
            index: self.cycle.index,
        };
    }

    /// What is inferred of a cycle that turned the cam forward: the true worm by the model, which is not all that it does.
    fn infer(&mut self, ratio: f64) {
        let leg = self.truth.leg_at(self.place_m, Heading::Out);
        let Some(cost) = self.truth.cycle(leg, Heading::Out).filter(|_| self.cycles_per_s > 0.0) else {
            return;
        };
        self.guide.note_inferred(&Inferred {
            end_ns: self.now_ns,
            cycles: 4.0,
            advance_m: ratio * cost.advance_m,
            advance_sigma_m: INFERRED_SIGMA * cost.advance_m,
            ..Inferred::empty()
        });
    }

    fn finish_cycle(&mut self) {
        self.done = 0.0;
        self.place_m += self.cycle.advance_m;
        self.furthest_m = self.furthest_m.max(self.place_m);
        let mut cycle = Cycle {
            index: self.cycle.index,
            end_ns: self.now_ns,
            duration_s: 1.0 / self.cycles_per_s.abs(),
            host_paused_s: 0.0,
            advance_m: self.cycle.advance_m + 5e-5 * self.rng.normal(),
            advance_sigma_m: 5e-5,
            energy_electrical_j: self.cycle.measured_j,
            energy_electrical_sigma_j: self.cycle.measured_j * 0.005,
            predicted_advance_m: self.cycles_per_s.signum() * 6.8e-3,
            predicted_energy_loss_j: 0.047,
            settled: 1,
            direction: self.cycles_per_s.signum() as i32,
            ..Cycle::empty()
        };
        if let Some(ratio) = self.inferred {
            (cycle.advance_m, cycle.advance_sigma_m, cycle.settled) = (f64::NAN, f64::NAN, 0);
            self.infer(ratio);
        }
        self.guide.note_cycle(&cycle, self.now_ns);
        self.cycles.push(cycle);
        if let Some(range) = self.range.as_mut().and_then(|range| range.note_cycle(&cycle)) {
            self.guide.note_range(&range);
        }
        self.cycle.index += 1;
        self.begin_cycle();
    }
}
