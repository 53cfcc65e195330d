//! Friction, stiffness, pull, advance and energy of a worm that nobody sees, from the current of its motor.
//!
//! # How it works
//! 1. [`gear`]: what the motor's current leaves for the cam, after the gears' friction, which depends on the load on them.
//! 2. `profile`: that torque over the gait phase. The cam moves one cell at a time by the stroke Ls, so a torque τ is the force
//!    2π τ/(n Ls) of the stepping cell's actuator.
//! 3. `model`: the profile that the exact quasi-static cycle gives. A stepping cell's force rises from −k·δmax to k·δmax: how far says
//!    its friction, how steeply the stiffness, and where the rise bends (a cell behind begins to slide) the pull on the body.
//! 4. `fit`: worm and gears that explain the mean profile best, with their covariance, and by the exact model what follows from
//!    them: advance, slides, energies.
//! 5. `pitch`: where a sensor measures it, the slope, and what it says of the pull.
//! 6. [`dead_reckoning`]: the distance. [`twins`]: what the current cannot tell. [`change`]: alarms. [`calibration`]: the gears' friction.
//!
//! # What it cannot tell
//! - Slope, payload on a slope and constant drag are one pull, unless a sensor measures the pitch. On the level a payload does nothing at
//!   all.
//! - An error of the torque constant scales every force: friction is never known better than that constant.
//! - An advance follows from the model. A worm that slides as a whole, tips and all, does not turn its cam any differently.
//! - Cycles crawled backward count for the distance, by the model, but are not fitted.
//!
//! # Cost
//! A cycle is fitted over the readings that follow it: each does one evaluation of the model, a few microseconds for four cells, until
//! there is nothing left to do. That takes some hundred readings, and some 1,500 where everything is searched: in the first and the third
//! cycle, and when the worm has changed. A cycle that ends meanwhile waits; of several the newest. Nothing is allocated after construction.

pub mod calibration;
pub mod change;
pub mod dead_reckoning;
mod fit;
pub mod gear;
mod leading;
mod model;
mod parameters;
mod pitch;
mod profile;
mod sample;
mod sensed;
pub mod twins;

pub use change::{Armed, Changes};
pub use dead_reckoning::{Mark, MarkOff, Reckoned};
pub use gear::{CurrentSource, GearModel, Ripple};
pub use model::CycleFigures;
pub use pitch::PitchSensor;
pub use profile::{BINS_PER_STEP, MAX_BINS};
pub use sample::MotorSample;
pub use sensed::{SelfSensed, Standing};
pub use twins::{Blind, Twin, Unknown};

use crate::winding::{MotorPower, Reported};
use change::{ChangeDetector, ComparedCycle, Seen};
use dead_reckoning::DeadReckoning;
use fit::{CycleChange, Fit};
use parameters::{Parameters, Vector};
use pitch::MeanPitch;
use profile::Profile;
use std::f64::consts::TAU;
use worm_physics::Worm;

/// Longest turn of the cam between two readings that is still bridged, cycles.
const LONGEST_TURN: f64 = 0.02;
/// How far the cam turns until the tips are loaded as in a steady crawl, cycles: from a rest or a reversal, and from relaxed tips. By the exact
/// cycle of 2 to 16 cells at up to 30°, the second cycle of a worm whose tips were relaxed differs from the steady one by up to a quarter of
/// k·δmax, the third by at most 2 %, and the second after a reversal by less than 1 %.
const LOADING_CYCLES: f64 = 0.9;
const RELAXED_LOADING_CYCLES: f64 = 1.9;
/// Longest time that the cam may stand in a cycle that is fitted, s: tips give way meanwhile, and it then starts with a ramp.
const LONGEST_REST_S: f64 = 0.1;
/// Time that it stands from which on torque may have been off meanwhile, and the tips be relaxed, s.
const RELAXING_REST_S: f64 = 3.0;
/// Longest time between two readings over which power is taken to be linear, s.
const LONGEST_GAP_S: f64 = 0.1;
/// Standard deviation of a voltage read in steps of 0.1 V, V, and of a current read in steps of 1 mA, A.
const ROUNDING: [f64; 2] = [0.029, 0.29e-3];
/// Cycles below which the fit may still find a better answer.
pub(crate) const WARM_CYCLES: f64 = 3.0;
/// Gait-to-gait scatter of the advance, as a share of what compliance takes of the stroke.
const ADVANCE_SCATTER_SHARE: f64 = 0.02;

/// What is known before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfSensingConfig {
    /// The motor with its gears.
    pub gear: GearModel,
    /// Standard deviation of each cell's ln friction about the stated worm's, beside what all have in common.
    pub friction_sigma: f64,
    /// Standard deviation of each cell's ln stiffness about the stated worm's.
    pub stiffness_sigma: f64,
    /// Standard deviation of the pull about that of the stated slope, N, while no pitch is measured.
    pub pull_sigma_n: f64,
    /// How well a pitch that is measured says the slope, and the slope the pull.
    pub pitch: PitchSensor,
    /// Usual time of a gait cycle, s.
    pub cycle_s: f64,
    /// Cycles over which the mean profile is taken; older ones fade.
    pub memory_cycles: f64,
    /// Evaluations of the model with each reading, while there is a cycle to fit.
    pub evaluations_per_reading: u32,
}

impl SelfSensingConfig {
    /// Friction within a half of what is stated, stiffness within a quarter, any slope.
    pub fn new(gear: GearModel) -> Self {
        Self {
            gear,
            friction_sigma: 0.4,
            stiffness_sigma: 0.25,
            pull_sigma_n: 2.5,
            pitch: PitchSensor::default(),
            cycle_s: 2.5,
            memory_cycles: 40.0,
            evaluations_per_reading: 1,
        }
    }
}

/// Senses a worm by its motor's current.
#[derive(Debug, Clone)]
pub struct SelfSensing {
    gear: GearModel,
    weight_n: f64,
    stroke_m: f64,
    profile: Profile,
    pitch: MeanPitch, // of the open cycle
    pitch_sensor: PitchSensor,
    fit: Fit,
    detector: ChangeDetector,
    allowed: Vector,
    reckoning: DeadReckoning,
    advance_m: [f64; 2], // a cycle, forward and backward, along the crawl
    last: Option<Reading>,
    turned_s: f64,       // when the cam was last seen to turn
    loaded_cycles: f64,  // how far the cam has turned since it last stood or turned back
    loading_cycles: f64, // how far it must, until the tips are loaded
    whole: bool,         // the open cycle was seen from its beginning; never the first, in which the tips load up
    energy: Energy,
    evaluations: u32,             // with each reading
    waiting: Option<ClosedCycle>, // its profile is in `profile`
    fitting: Option<ClosedCycle>,
    has_changed: bool,                    // the worm that is being fitted is another than before
    figures_before: Option<CycleFigures>, // of the worm before it changed
    sensed: Option<SelfSensed>,
}

/// A cycle that is over.
#[derive(Debug, Clone, Copy)]
struct ClosedCycle {
    end_ns: u64,
    end_phase: f64,
    energy: Energy,
    pitch_sine: Option<f64>, // where it was measured
}

#[derive(Debug, Clone, Copy)]
struct Reading {
    sample: MotorSample,
    torque_n_m: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Energy {
    electrical_j: f64,
    by_voltage: f64, // J/V
    by_current: f64, // J/A, had the current no error but its rounding
}

impl SelfSensing {
    /// `worm` is what is known of it: cells, stroke, mass, step order, and friction, stiffness and slope within the standard deviations
    /// of `config`.
    pub fn new(worm: &Worm, config: &SelfSensingConfig) -> Self {
        let fit = Fit::new(worm, config);
        let gear = &config.gear;
        let gear_friction_n_m = gear.dry_n_m + gear.viscous_n_m_s_per_rad * TAU / config.cycle_s;
        let detector = ChangeDetector::new(worm, gear_friction_n_m);
        let (advance_m, advance_sigma_m) = fit
            .figures()
            .map_or((0.0, 0.0), |(figures, sigma)| (figures.advance_m, sigma.advance_m));
        Self {
            gear: config.gear,
            weight_n: worm.weight_n(),
            stroke_m: worm.stroke_m(),
            profile: Profile::new(worm.cells()),
            pitch: MeanPitch::default(),
            pitch_sensor: config.pitch,
            allowed: detector.allowed(),
            detector,
            reckoning: DeadReckoning::new(advance_m, advance_sigma_m),
            advance_m: [advance_m, fit.backward_advance_m().unwrap_or(advance_m)],
            fit,
            last: None,
            turned_s: f64::INFINITY,
            loaded_cycles: 0.0,
            loading_cycles: RELAXED_LOADING_CYCLES,
            whole: false,
            energy: Energy::default(),
            evaluations: config.evaluations_per_reading.max(1),
            waiting: None,
            fitting: None,
            has_changed: false,
            figures_before: None,
            sensed: None,
        }
    }

    /// Takes a reading; those of which a value is missing are left out. Returns what is known after a cycle, once it is fitted: some
    /// readings after its end.
    pub fn update(&mut self, sample: &MotorSample) -> Option<&SelfSensed> {
        // First, so that the reading which ends a cycle does not compare it as well.
        let mut is_new = false;
        for _ in 0..self.evaluations {
            is_new |= self.work();
        }
        self.take(sample);
        if is_new { self.sensed.as_ref() } else { None }
    }

    /// Does all the work that is left, at once. Returns what is known after the last cycle that it fitted, if there was one.
    pub fn finish(&mut self) -> Option<&SelfSensed> {
        let mut is_new = false;
        while self.fitting.is_some() || self.waiting.is_some() {
            is_new |= self.work();
        }
        if is_new { self.sensed.as_ref() } else { None }
    }

    /// The readings that follow are not those after the last: the controller has started anew. What is known of the worm stays.
    pub fn interrupt(&mut self) {
        self.last = None;
        self.load_anew(RELAXED_LOADING_CYCLES);
    }

    /// The tips are not loaded as in a steady crawl any more, and need so many cycles to be: at least what they still needed.
    fn load_anew(&mut self, cycles: f64) {
        (self.whole, self.loaded_cycles) = (false, 0.0);
        self.loading_cycles = self.loading_cycles.max(cycles);
    }

    fn take(&mut self, sample: &MotorSample) {
        let winding_a = self.gear.winding_current_a(&Reported::from(sample));
        let torque_n_m = self
            .gear
            .cam_torque_n_m(winding_a, sample.velocity_rad_per_s, sample.angle_rad);
        if !(torque_n_m.is_finite() && sample.phase.is_finite() && sample.time_s.is_finite()) {
            return;
        }
        let reading = Reading {
            sample: *sample,
            torque_n_m,
        };
        let Some(last) = self.last.replace(reading) else { return };
        let turned = sample.phase - last.sample.phase;
        // Also where a slow cam has not reached the next count of its encoder.
        self.add_energy(&last.sample, sample);
        if turned == 0.0 {
            let rest_s = sample.time_s - self.turned_s;
            if rest_s > RELAXING_REST_S {
                self.load_anew(RELAXED_LOADING_CYCLES);
            } else if rest_s > LONGEST_REST_S {
                self.load_anew(LOADING_CYCLES);
            }
            return;
        }
        self.turned_s = sample.time_s;
        self.loaded_cycles += turned;
        if turned < 0.0 {
            self.load_anew(LOADING_CYCLES);
        }
        self.reckon(turned);
        if !(0.0..=LONGEST_TURN).contains(&turned) {
            self.whole = false;
            return;
        }
        let middle = 0.5 * (sample.phase + last.sample.phase);
        if sample.phase.floor() != last.sample.phase.floor() {
            if self.whole && self.profile.close(self.gear.inertia_kg_m2) {
                self.waiting = Some(ClosedCycle {
                    end_ns: sample.stamp_ns,
                    end_phase: sample.phase.floor(),
                    energy: self.energy,
                    pitch_sine: self.pitch.sine(),
                });
            }
            self.profile.clear();
            self.pitch.clear();
            self.energy = Energy::default();
            self.whole = self.loaded_cycles >= self.loading_cycles;
            if self.whole {
                self.loading_cycles = 0.0;
            }
        }
        self.pitch.add(sample.pitch_rad, turned);
        let mean = |now: f64, before: f64| 0.5 * (now + before);
        self.profile.add(
            middle - middle.floor(),
            turned,
            mean(torque_n_m, last.torque_n_m),
            mean(sample.velocity_rad_per_s, last.sample.velocity_rad_per_s),
        );
    }

    /// Corrects the distance by a known position. Returns how far it was off.
    pub fn mark(&mut self, mark: &Mark) -> MarkOff {
        self.reckoning.mark(mark)
    }

    /// The worm is here, whatever was reckoned before: nothing is learned from the difference.
    pub fn place(&mut self, mark: &Mark) {
        self.reckoning.place(mark);
    }

    /// How far the worm advances while the cam turns by so many cycles, negative backward, m.
    pub fn crawled_m(&self, turned: f64) -> f64 {
        turned * self.advance_m[usize::from(turned < 0.0)]
    }

    /// Where the worm is by dead reckoning, along the canal from where it began.
    pub fn reckoned(&self) -> Reckoned {
        self.reckoning.reckoned()
    }

    /// What was known after the last cycle.
    pub fn sensed(&self) -> Option<&SelfSensed> {
        self.sensed.as_ref()
    }

    /// By how much the gears' friction exceeds what was stated, and its standard error, N m; none before a cycle was fitted.
    pub fn gear_excess_n_m(&self) -> Option<(f64, f64)> {
        self.sensed.as_ref()?;
        let parameters = self.fit.parameters();
        let at = parameters.gears_at();
        let variance = self.fit.covariance()[(at, at)];
        Some((parameters.values[at], variance.max(0.0).sqrt()))
    }

    /// Mean torque at the cam over the phase, and the model's, N m, [`BINS_PER_STEP`] for each step.
    pub fn profiles_n_m(&self) -> (&[f64], &[f64]) {
        self.fit.profiles_n_m()
    }

    /// Whether a cycle that has ended is still to be fitted.
    pub(crate) fn is_at_work(&self) -> bool {
        self.waiting.is_some() || self.fitting.is_some()
    }

    fn reckon(&mut self, turned: f64) {
        let advance_m = if turned > 0.0 {
            self.advance_m[0]
        } else {
            self.advance_m[1]
        };
        let scatter_m = ADVANCE_SCATTER_SHARE * (self.stroke_m - advance_m).abs();
        self.reckoning.turn(turned, self.advance_m[1], scatter_m);
    }

    fn add_energy(&mut self, from: &MotorSample, to: &MotorSample) {
        let dt_s = to.time_s - from.time_s;
        if !(0.0..=LONGEST_GAP_S).contains(&dt_s) {
            self.whole = false;
            return;
        }
        let powers = [from, to].map(|sample| self.gear.winding().power(&Reported::from(sample)));
        let mean = |of: fn(&MotorPower) -> f64| 0.5 * dt_s * powers.iter().map(of).sum::<f64>();
        let electrical_j = mean(|power| power.power_w);
        if electrical_j.is_finite() {
            self.energy.electrical_j += electrical_j;
            self.energy.by_voltage += mean(|power| power.by_voltage_a);
            self.energy.by_current += mean(|power| power.current_sigma_w) / ROUNDING[1];
        }
    }

    /// One evaluation of the model, if there is a cycle to fit. True when there is something new.
    fn work(&mut self) -> bool {
        if let Some(cycle) = self.fitting {
            if !self.fit.step() {
                let first = self.fit.take_first_answer().filter(|_| self.has_changed);
                return first.is_some_and(|first| self.judge_early(&cycle, &first));
            }
            self.fitting = None;
            self.follow(&cycle);
            return true;
        }
        let Some(cycle) = self.waiting.take() else { return false };
        let torque_n_m = self.profile.torque_n_m();
        let seen = if self.detector.is_another() && self.fit.is_as_before(torque_n_m) {
            self.detector.see_one_as_before()
        } else {
            let score = self.fit.score(torque_n_m, self.fit.profiles_n_m().0);
            self.fit.change(&score, &self.allowed).map_or(Seen::Usual, |change| {
                self.detector.compare(&ComparedCycle {
                    usual: self.fit.parameters(),
                    weight_n: self.fit.known_pull_n(),
                    cycles: self.fit.cycles(),
                    change,
                    torque_n_m,
                    mean_n_m: self.fit.profiles_n_m().0,
                })
            })
        };
        self.has_changed = matches!(seen, Seen::FirstChanged | Seen::Changed);
        if matches!(seen, Seen::FirstChanged) {
            self.fit.set_aside(torque_n_m);
            self.figures_before = self.fit.figures().map(|(figures, _)| *figures);
        }
        match seen {
            Seen::Usual => {}
            Seen::Odd => {
                self.show(&cycle, Standing::Odd);
                return true;
            }
            Seen::FirstChanged | Seen::Changed => {
                self.reckoning.begin_anew();
                self.fit.forget();
            }
            Seen::AsBefore => {
                self.reckoning.begin_anew();
                self.fit.go_on_as_before();
            }
        }
        let pull_n = cycle.pitch_sine.map(|sine| {
            let sigma_n = self.pitch_sensor.pull_sigma_n(self.weight_n, sine);
            (self.weight_n * sine, sigma_n)
        });
        self.fit.take(&self.profile, pull_n);
        self.fitting = Some(cycle);
        false
    }

    /// By how much the unknowns of the newest cycle differ from those of the worm before it changed.
    fn difference(&mut self) -> Option<CycleChange> {
        if !self.detector.is_another() {
            return None;
        }
        let score = self.fit.score(self.fit.cycle_n_m(), self.fit.before_n_m());
        self.fit.change(&score, &self.allowed)
    }

    /// Says in what a changed worm differs before everything is searched. True when it does.
    fn judge_early(&mut self, cycle: &ClosedCycle, first: &Parameters) -> bool {
        let difference = self.difference();
        let has_changed = self.detector.judge_early(
            (first, self.fit.known_pull_n()),
            self.fit.cycle_n_m(),
            difference.as_ref(),
        );
        if has_changed {
            self.show(cycle, Standing::Changed);
        }
        has_changed
    }

    /// Brings everything that follows from the fit up to date.
    fn follow(&mut self, cycle: &ClosedCycle) {
        // While the worm is another, every cycle says anew in what it differs, and whether it still does.
        if self.detector.is_another() {
            let difference = self.difference();
            let now = (self.fit.parameters(), self.fit.known_pull_n());
            if self.has_changed || self.detector.changes().any() {
                self.detector.judge(now, self.fit.cycle_n_m(), difference.as_ref());
            } else {
                self.detector.judge_late(now, self.fit.cycle_n_m(), difference.as_ref());
            }
        }
        if let Some((figures, sigma)) = self.figures() {
            let backward_m = self.fit.backward_advance_m().unwrap_or(figures.advance_m);
            self.advance_m = [figures.advance_m, backward_m];
            self.reckoning.know_advance(figures.advance_m, sigma.advance_m);
        }
        let standing = if self.detector.changes().any() {
            Standing::Changed
        } else if self.fit.cycles() < WARM_CYCLES {
            Standing::WarmingUp
        } else {
            Standing::Fitted
        };
        self.show(cycle, standing);
    }
}
