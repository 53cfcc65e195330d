//! A worm whose truth is known: the exact model, seen by a poor tracker and an encoder.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use worm_estimator::config::{Config, PerCell};
use worm_estimator::message::State;
use worm_physics::MAX_CELLS;
use worm_physics::{Ledger, Motion, Worm};

/// How the worm is driven and measured.
#[derive(Debug, Clone)]
pub struct Scene {
    pub seed: u64,
    pub noise_m: f64,
    pub outlier_fraction: f64,
    pub dropout_share: f64,
    pub tracker_hz: f64,
    pub tick_hz: f64,
    /// Gait cycles per second; negative crawls backward.
    pub cycles_per_s: f64,
    /// Fraction by which the cam speed varies.
    pub ripple: f64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            seed: 1,
            noise_m: 3e-4,
            outlier_fraction: 0.0,
            dropout_share: 0.0,
            tracker_hz: 120.0,
            tick_hz: 1000.0,
            cycles_per_s: 0.4,
            ripple: 0.2,
        }
    }
}

/// The truth at a whole number of the phase.
#[derive(Debug, Clone)]
pub struct Milestone {
    pub ledger: Ledger,
    pub mean_m: f64,
}

/// The crawl; each call of [`Crawl::tick`] gives the next state.
pub struct Crawl {
    pub scene: Scene,
    pub worm: Worm,
    pub motion: Motion,
    /// One for each whole number of the phase that was crossed, the start included.
    pub milestones: Vec<Milestone>,
    /// Whether the cam stands still.
    pub paused: bool,
    rng: Xoshiro256PlusPlus,
    crawled_s: f64,
    time_s: f64,
    state: State,
    captures: u64,
}

impl Crawl {
    pub fn new(worm: Worm, scene: Scene) -> Self {
        let first: Vec<f64> = (0..worm.cells()).map(|cell| -0.04 * cell as f64).collect();
        let motion = Motion::at_rest(&worm, &first);
        let milestones = vec![Milestone {
            ledger: motion.ledger().clone(),
            mean_m: motion.mean_position_m(),
        }];
        let mut state = State::unknown(worm.cells());
        state.position_m = [f64::NAN; MAX_CELLS];
        Self {
            rng: Xoshiro256PlusPlus::seed_from_u64(scene.seed),
            scene,
            worm,
            motion,
            milestones,
            paused: false,
            crawled_s: 0.0,
            time_s: 0.0,
            state,
            captures: 0,
        }
    }

    /// The next tick's state.
    pub fn tick(&mut self) -> State {
        let from_s = self.time_s;
        self.state.sequence += 1;
        let to_s = self.state.sequence as f64 / self.scene.tick_hz + 5e-5 * self.rng.random::<f64>();
        self.state.sample_is_new = 0;
        let capture_s = (self.captures as f64 + 0.5) / self.scene.tracker_hz;
        if capture_s < to_s {
            self.run(capture_s.max(from_s));
            self.capture(capture_s);
        }
        self.run(to_s);
        let state = &mut self.state;
        state.time_ns = (1e9 + 1e9 * to_s) as u64;
        state.phase = (self.motion.phase() * 4096.0).round() / 4096.0;
        state.motor_angle_rad = state.phase * TAU;
        state.motor_velocity_rad_s = if self.paused {
            0.0
        } else {
            self.scene.cycles_per_s * TAU
        };
        state.motor_current_a = 0.2;
        state.motor_duty = 0.5;
        state.bus_voltage_v = 5.0;
        state.motor_is_new = 1;
        *state
    }

    fn run(&mut self, to_s: f64) {
        if !self.paused {
            self.crawled_s += to_s - self.time_s;
        }
        self.time_s = to_s;
        let swing_hz = 1.3;
        let swing_s = self.scene.ripple * (1.0 - (TAU * swing_hz * self.crawled_s).cos()) / (TAU * swing_hz);
        let phase = self.scene.cycles_per_s * (self.crawled_s + swing_s);
        let sign = self.scene.cycles_per_s.signum();
        let next_whole = sign * self.milestones.len() as f64;
        if sign * phase >= sign * next_whole {
            self.motion.advance_to(&self.worm, next_whole).expect("the worm holds");
            self.milestones.push(Milestone {
                ledger: self.motion.ledger().clone(),
                mean_m: self.motion.mean_position_m(),
            });
        }
        self.motion.advance_to(&self.worm, phase).expect("the worm holds");
    }

    fn capture(&mut self, capture_s: f64) {
        let state = &mut self.state;
        self.captures += 1;
        state.sample += 1;
        state.sample_is_new = 1;
        state.sample_time_s = 77.0 + capture_s;
        state.valid_mask = 0;
        for (cell, position_m) in self.motion.positions_m().iter().enumerate() {
            let noise: f64 = StandardNormal.sample(&mut self.rng);
            let (seen, outlier) = (self.rng.random::<f64>(), self.rng.random::<f64>());
            let off_m = if outlier < self.scene.outlier_fraction {
                let off_m = 2e-3 + 6e-3 * self.rng.random::<f64>();
                if self.rng.random::<f64>() < 0.5 { off_m } else { -off_m }
            } else {
                0.0
            };
            state.position_m[cell] = f64::NAN;
            if seen >= self.scene.dropout_share {
                state.valid_mask |= 1 << cell;
                state.position_m[cell] = position_m + self.scene.noise_m * noise + off_m;
            }
        }
    }
}

/// A configuration that describes the worm and the scene.
pub fn config_of(worm: &Worm, scene: &Scene) -> Config {
    let mut config = Config::default();
    let bounds = worm.contacts().iter().map(|contact| contact.forward_bound_m).collect();
    config.worm.cells = worm.cells();
    config.worm.mass_kg = worm.mass_kg();
    config.worm.stroke_m = worm.stroke_m();
    config.worm.max_deformation_m = PerCell::Each(bounds);
    config.worm.step_order = (1..=worm.cells()).collect();
    config.canal.slope_deg = worm.slope_rad().to_degrees();
    config.tracker.noise_m = scene.noise_m.max(1e-6);
    config.tracker.rate_hz = scene.tracker_hz;
    config
}

/// The paper's worm on a slope, with its equal or its identified unequal bounds.
pub fn paper_worm(slope_deg: f64, unequal: bool) -> Worm {
    let worm = Worm::paper().with_slope_rad(slope_deg.to_radians()).expect("a slope");
    if unequal {
        worm.with_max_deformations_m(&[2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3])
            .expect("four bounds")
    } else {
        worm
    }
}
