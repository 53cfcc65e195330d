//! A worm with its motor, whose parameters are drawn and hidden: dynamics, not the quasi-static cycle that the estimator inverts.
//!
//! The body has mass and damping (Newmark's method in [`Crawl`]), its friction scatters from cycle to cycle. The motor is a winding behind
//! a bridge with the servo's own velocity loop, a rotor, and the friction that was identified on a real XL330: dry, viscous, by the
//! load on the gears, and by its square. It has ripple and warms up. What is read is rounded as the servo's registers round.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use worm_estimator::self_sensing::{GearModel, MotorSample, Ripple, SelfSensingConfig};
use worm_physics::{Contact, Crawl, Ledger, Mechanics, Outcome, Physics, Worm, steady_cycle};

const STEP_S: f64 = 5e-4;
const STEPS_PER_TICK: u32 = 2;
const SUPPLY_V: f64 = 5.0;
const SUPPLY_OHM: f64 = 0.2;
const COUNT_RAD: f64 = TAU / 4096.0;
const VELOCITY_COUNT: f64 = 0.229 * TAU / 60.0;
/// The servo's own loop: duty per velocity error, and per time and velocity error.
const LOOP: [f64; 2] = [0.066, 11.5];

/// A number in a variable of the environment.
fn from_environment(name: &str) -> Option<f64> {
    std::env::var(name).ok()?.parse().ok()
}

/// What a drawn worm is.
#[derive(Debug, Clone)]
pub struct Drawn {
    pub seed: u64,
    /// The worm itself.
    pub worm: Worm,
    /// What the estimator is told of it.
    pub told: Worm,
    pub told_gear: GearModel,
    gear: GearModel,
    winding_ohm: f64,
    warmer_k: f64,
    friction_per_k: f64,
    scatter: f64,
    damping_ratio: f64,
    noise_a: f64,
    /// Time of a gait cycle, s, and what the estimator is told of it.
    cycle_s: [f64; 2],
    pitch: Option<Pitch>,
}

/// An inertial sensor on the body.
#[derive(Debug, Clone, Copy)]
struct Pitch {
    offset_rad: f64,
    rocking_rad: f64,
}

/// The motor whose friction was identified (`docs/servo-bench.md`), as a gear model with what a calibration leaves uncertain.
pub fn identified_gear() -> GearModel {
    let mut ripple = [Ripple::default(); 4];
    (ripple[0].waves, ripple[1].waves) = (7.0, 18.0);
    GearModel {
        dry_n_m: 0.0092,
        viscous_n_m_s_per_rad: 0.0064,
        friction_sigma_n_m: 0.0045,
        torque_constant_sigma: 0.02,
        load_friction: 0.316,
        load_friction_sigma: 0.02,
        load_share: 0.81,
        load_squared_per_n_m: 0.276,
        load_squared_share: 1.0,
        ripple,
        ripple_sigma_n_m: 0.001,
        ..GearModel::plain(0.372, 3.32, 0.0019)
    }
}

impl Drawn {
    /// Draws a worm that gets ahead by at least a seventh of its stroke.
    pub fn new(seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        loop {
            let drawn = Self::draw(seed, &mut rng);
            if let Outcome::Steady(cycle) = steady_cycle(&drawn.worm)
                && cycle.advance_m > drawn.worm.stroke_m() / 7.0
            {
                return drawn;
            }
        }
    }

    fn draw(seed: u64, rng: &mut Xoshiro256PlusPlus) -> Self {
        let mut normal = |sigma: f64| -> f64 {
            let normal: f64 = StandardNormal.sample(rng);
            sigma * normal.clamp(-2.5, 2.5)
        };
        let told_gear = identified_gear();
        let mut gear = told_gear;
        gear.torque_constant_n_m_per_a *= 1.0 + normal(0.02);
        gear.load_friction += normal(0.02);
        let friction = 1.0 + normal(0.15);
        gear.dry_n_m *= friction;
        gear.viscous_n_m_s_per_rad *= friction;
        for ripple in &mut gear.ripple[..2] {
            (ripple.sine_n_m, ripple.cosine_n_m) = (normal(7e-4), normal(7e-4));
        }
        let winding_ohm = 3.32 * (1.0 + normal(0.1));
        let scales: Vec<(f64, f64)> = (0..6).map(|_| (normal(0.2).exp(), normal(0.15).exp())).collect();
        let cells = rng.random_range(3..=6);
        let told = Worm::uniform(
            cells,
            Contact::symmetric(980.0, 1.75e-3),
            0.08325 * cells as f64,
            11.5e-3,
        )
        .expect("the figures of the paper are in range");
        let slope_rad = if rng.random_bool(0.25) {
            0.0
        } else {
            rng.random_range(0.0..40f64).to_radians()
        };
        let mut worm = told.clone().with_slope_rad(slope_rad).expect("a slope within range");
        for (cell, (friction, stiffness)) in scales[..cells].iter().enumerate() {
            let (friction_n, stiffness) = (1.715 * friction, 980.0 * stiffness);
            let contact = Contact::symmetric(stiffness, friction_n / stiffness);
            worm = worm.with_contact(cell, contact).expect("a contact within range");
        }
        Self {
            seed,
            worm,
            told,
            told_gear,
            gear,
            winding_ohm,
            warmer_k: rng.random_range(3.0..15.0),
            friction_per_k: rng.random_range(0.0..0.006),
            scatter: rng.random_range(0.002..0.02),
            damping_ratio: rng.random_range(0.2..0.7),
            noise_a: rng.random_range(0.5e-3..3e-3),
            cycle_s: ["WORMD_CYCLE_S", "WORMD_TOLD_CYCLE_S"].map(|name| from_environment(name).unwrap_or(2.5)),
            pitch: None,
        }
    }

    /// The same worm with an inertial sensor, half a degree off.
    pub fn with_pitch(mut self) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed ^ 0x91c);
        let normal: f64 = StandardNormal.sample(&mut rng);
        self.pitch = Some(Pitch {
            offset_rad: 0.5f64.to_radians() * normal,
            rocking_rad: rng.random_range(0.0..2f64).to_radians(),
        });
        self
    }

    /// The same worm with another gait: time of a cycle, s, and what the estimator is told of that.
    pub fn with_cycle_s(mut self, crawled_s: f64, told_s: f64) -> Self {
        self.cycle_s = [crawled_s, told_s];
        self
    }

    /// What the estimator is told. With `WORMD_CALIBRATED` set to a standard deviation, N m: after the cold gears of this worm were calibrated lifted, by
    /// a torque constant that is as wrong as before.
    pub fn config(&self) -> SelfSensingConfig {
        let mut gear = self.told_gear;
        if let Some(sigma_n_m) = from_environment("WORMD_CALIBRATED") {
            let by_constant = gear.torque_constant_n_m_per_a / self.gear.torque_constant_n_m_per_a;
            gear.dry_n_m = self.gear.dry_n_m * by_constant;
            gear.viscous_n_m_s_per_rad = self.gear.viscous_n_m_s_per_rad * by_constant;
            gear.friction_sigma_n_m = sigma_n_m;
        }
        SelfSensingConfig {
            cycle_s: self.cycle_s[1],
            ..SelfSensingConfig::new(gear)
        }
    }

    pub fn slope_deg(&self) -> f64 {
        self.worm.slope_rad().to_degrees()
    }

    pub fn friction_n(&self, cell: usize) -> f64 {
        let contact = self.worm.contact(cell);
        contact.stiffness_n_per_m * contact.forward_bound_m
    }
}

/// The truth at the end of a cycle.
#[derive(Debug, Clone, Default)]
pub struct Milestone {
    pub ledger: Ledger,
    pub electrical_j: f64,
    pub position_m: f64,
}

/// The worm in motion.
#[derive(Clone)]
pub struct Plant {
    drawn: Drawn,
    mechanics: Mechanics,
    crawl: Crawl,
    rng: Xoshiro256PlusPlus,
    time_s: f64,
    angle_rad: f64,
    velocity: f64,
    integral: f64,
    current_a: f64,
    duty: f64,
    electrical_j: f64,
    /// One for each whole cycle, the start included.
    pub milestones: Vec<Milestone>,
}

impl Plant {
    pub fn new(drawn: &Drawn) -> Self {
        let mechanics = Mechanics::new(&Physics::of(drawn.worm.clone()));
        let positions_m = vec![0.0; drawn.worm.cells()];
        let crawl = Crawl::at_rest(&mechanics, 0.0, &positions_m, Some(drawn.damping_ratio))
            .expect("a drawn worm holds at rest");
        Self {
            drawn: drawn.clone(),
            mechanics,
            crawl,
            rng: Xoshiro256PlusPlus::seed_from_u64(drawn.seed ^ 0x5eed),
            time_s: 0.0,
            angle_rad: 0.0,
            velocity: 0.0,
            integral: 0.0,
            current_a: 0.0,
            duty: 0.0,
            electrical_j: 0.0,
            milestones: vec![Milestone::default()],
        }
    }

    /// Changes the worm while it crawls.
    pub fn change(&mut self, worm: Worm) {
        self.drawn.worm = worm;
        self.scatter();
    }

    /// The gears take so many times the torque without load from now on.
    pub fn stiffen_gears(&mut self, factor: f64) {
        self.drawn.gear.dry_n_m *= factor;
        self.drawn.gear.viscous_n_m_s_per_rad *= factor;
    }

    pub fn cycles(&self) -> usize {
        self.milestones.len() - 1
    }

    fn scatter(&mut self) {
        let mut worm = self.drawn.worm.clone();
        for cell in 0..worm.cells() {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            worm.scale_friction(Some(cell), 1.0 + self.drawn.scatter * normal.clamp(-3.0, 3.0));
        }
        self.mechanics = Mechanics::new(&Physics::of(worm));
        self.crawl.take_up(&self.mechanics);
    }

    /// One tick of 1 ms: what the registers say at its end.
    pub fn tick(&mut self) -> MotorSample {
        for _ in 0..STEPS_PER_TICK {
            self.step();
        }
        let mut noise = || -> f64 { StandardNormal.sample(&mut self.rng) };
        let current_a = ((self.current_a + self.drawn.noise_a * noise()) * 1e3).round() * 1e-3;
        let velocity = ((self.velocity + 0.3 * VELOCITY_COUNT * noise()) / VELOCITY_COUNT).round() * VELOCITY_COUNT;
        let angle_rad = (self.angle_rad / COUNT_RAD).floor() * COUNT_RAD;
        MotorSample {
            time_s: self.time_s,
            phase: angle_rad / TAU,
            angle_rad,
            velocity_rad_per_s: velocity,
            current_a,
            bus_voltage_v: (10.0 * self.bus_v()).round() / 10.0,
            duty: (self.duty * 885.0).round() / 885.0,
            temperature_c: (25.0 + self.warmth_k()).floor(),
            pitch_rad: self.pitch_rad(),
            stamp_ns: 0,
        }
    }

    /// What an inertial sensor says: the slope, off by what it is mounted askew and by its offset, and the body's rocking with the gait.
    fn pitch_rad(&self) -> f64 {
        let Some(pitch) = self.drawn.pitch else { return f64::NAN };
        let rocking_rad = pitch.rocking_rad * self.angle_rad.sin();
        ((self.drawn.worm.slope_rad() + pitch.offset_rad + rocking_rad).to_degrees() * 100.0)
            .round()
            .to_radians()
            / 100.0
    }

    fn bus_v(&self) -> f64 {
        SUPPLY_V - SUPPLY_OHM * self.duty * self.current_a
    }

    fn warmth_k(&self) -> f64 {
        self.drawn.warmer_k * (1.0 - (-self.time_s / 120.0).exp())
    }

    fn step(&mut self) {
        let (gear, warmth_k) = (self.drawn.gear, self.warmth_k());
        let goal = TAU / self.drawn.cycle_s[0] * (self.time_s / 0.25).min(1.0);
        let bus_v = self.bus_v();
        let constant = gear.torque_constant_n_m_per_a * (1.0 - 0.001 * warmth_k);
        let winding_ohm = self.drawn.winding_ohm * (1.0 + 0.00393 * (warmth_k + 4.0));
        let cam_n_m = self.crawl.drive_load_j(&self.mechanics) / TAU;
        self.integral = (self.integral + LOOP[1] * (goal - self.velocity) * STEP_S).clamp(-1.0, 1.0);
        self.duty = (self.integral + LOOP[0] * (goal - self.velocity)).clamp(-1.0, 1.0);
        self.current_a = (self.duty * bus_v - constant * self.velocity) / winding_ohm;
        let motor_n_m = constant * self.current_a;
        let warm = 1.0 - self.drawn.friction_per_k * warmth_k;
        let against_n_m = warm * gear.dry_n_m + gear.load_friction_n_m(motor_n_m, cam_n_m);
        let free_n_m = motor_n_m - cam_n_m - gear.ripple_n_m(self.angle_rad);
        let damping = warm * gear.viscous_n_m_s_per_rad + constant * constant / winding_ohm;
        // The back EMF is solved at the step's end, like the viscous friction.
        let driven = self.velocity
            + STEP_S / gear.inertia_kg_m2 * (free_n_m + constant * constant / winding_ohm * self.velocity);
        let damped = 1.0 + STEP_S / gear.inertia_kg_m2 * damping;
        let most = STEP_S / gear.inertia_kg_m2 * against_n_m;
        let before = self.velocity;
        self.velocity = if driven.abs() <= most {
            0.0
        } else {
            (driven - most.copysign(driven)) / damped
        };
        let mean_a = (self.duty * bus_v - constant * 0.5 * (before + self.velocity)) / winding_ohm;
        self.electrical_j += bus_v * self.duty * mean_a * STEP_S;
        self.time_s += STEP_S;
        let phase_before = self.angle_rad / TAU;
        self.angle_rad += 0.5 * (before + self.velocity) * STEP_S;
        let phase = self.angle_rad / TAU;
        let mut left_s = STEP_S;
        if phase.floor() > phase_before.floor() {
            let share = (phase.floor() - phase_before) / (phase - phase_before);
            self.advance(phase.floor(), share * STEP_S);
            left_s *= 1.0 - share;
            self.milestones.push(Milestone {
                ledger: self.crawl.ledger().clone(),
                electrical_j: self.electrical_j,
                position_m: self.crawl.mean_position_m(),
            });
            self.scatter();
        }
        self.advance(phase, left_s);
    }

    fn advance(&mut self, phase: f64, duration_s: f64) {
        self.crawl
            .advance_to(&self.mechanics, phase, duration_s)
            .expect("a drawn worm does not slide down");
    }
}
