//! A worm for tests: its kinematics as closed forms, its motor as a first-order lag, its faults as switches.

use super::super::{AlarmMonitor, Observation};
use crate::config::Config;
use crate::message::{Alarm, AlarmKind, Cycle, Estimate, Fault, Mode, State};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use worm_physics::MAX_CELLS;

/// Time constant with which the simulated servo follows its goal, s.
const SERVO_LAG_S: f64 = 0.02;
/// Time constant with which tracker and filter follow the cells, s.
const TRACKER_LAG_S: f64 = 0.015;
/// Between neighbouring cells, m.
const SPACING_M: f64 = 0.04;
/// Counts of the goal register per turn/s.
const GOAL_COUNTS_PER_TURN_S: f64 = 60.0 / 0.229;

/// Faults and imperfections of the worm.
#[derive(Debug, Clone)]
pub struct Trouble {
    pub stalled: bool,
    /// Fraction of its speed that the cam loses.
    pub sluggish: f64,
    pub jammed: Option<usize>,
    /// Fraction of its stroke that the jammed cell loses.
    pub jam_fraction: f64,
    pub slipping: bool,
    pub slide_m_per_s: f64,
    pub electrical_factor: f64,
    pub loss_factor: f64,
    /// Probability that an exchange with the servo fails.
    pub link_failing: f64,
    pub tracker_dead: bool,
    pub hidden_cell: Option<usize>,
    /// Probability that a position is not seen.
    pub dropout: f64,
    pub hardware_error: u32,
    pub temperature_c: f64,
    pub fault: Fault,
}

impl Trouble {
    pub fn none() -> Self {
        Self {
            stalled: false,
            sluggish: 0.0,
            jammed: None,
            jam_fraction: 1.0,
            slipping: false,
            slide_m_per_s: 0.0,
            electrical_factor: 1.0,
            loss_factor: 1.0,
            link_failing: 0.0,
            tracker_dead: false,
            hidden_cell: None,
            dropout: 0.0,
            hardware_error: 0,
            temperature_c: 35.0,
            fault: Fault::None,
        }
    }
}

/// The worm, and the monitor of its alarms.
pub struct Bench {
    pub config: Config,
    pub monitor: AlarmMonitor,
    pub state: State,
    pub trouble: Trouble,
    /// Standard deviation of a filtered position, m.
    pub noise_m: f64,
    /// Standard deviation of energy and of the advance lost to tips, from cycle to cycle, as a fraction.
    pub scatter: f64,
    /// True stroke over the configured one.
    pub stroke_factor: f64,
    /// Energy in the battery, J.
    pub battery_j: f64,
    /// Alarms raised or cleared.
    pub changes: Vec<Alarm>,
    random: Xoshiro256PlusPlus,
    seen_m: [f64; MAX_CELLS], // true positions as the tracker and the filter follow them, late
    estimate: Estimate,
    tick_ns: u64,
    sample_debt: f64,
    command_turns_per_s: f64,
    speed: f64, // true, turns/s
    phase: f64, // true
    travel_m: [f64; MAX_CELLS],
    mean_m: f64,
    stride_error: f64,
    cycle_mean_m: f64,
    cycle_ns: u64,
    cycle_index: u64,
    cycles_in_direction: u32,
}

impl Bench {
    pub fn new(config: Config, seed: u64) -> Self {
        let cells = config.worm.cells;
        let mut state = State::unknown(cells);
        state.phase = 0.0;
        state.time_ns = 5_000_000_000;
        Self {
            monitor: AlarmMonitor::new(&config),
            trouble: Trouble::none(),
            noise_m: 5e-5,
            scatter: 0.01,
            stroke_factor: 1.0,
            battery_j: config.battery.as_ref().map_or(0.0, |battery| battery.capacity_j),
            changes: Vec::new(),
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            seen_m: std::array::from_fn(|cell| -SPACING_M * cell as f64),
            estimate: blank_estimate(cells),
            tick_ns: (1e9 / config.control.rate_hz) as u64,
            sample_debt: 0.0,
            command_turns_per_s: 0.0,
            speed: 0.0,
            phase: 0.0,
            travel_m: [0.0; MAX_CELLS],
            mean_m: 0.0,
            stride_error: 0.0,
            cycle_mean_m: 0.0,
            cycle_ns: state.time_ns,
            cycle_index: 0,
            cycles_in_direction: 0,
            state,
            config,
        }
    }

    /// Commands a mode; `cycles_per_s` counts while crawling.
    pub fn command(&mut self, mode: Mode, cycles_per_s: f64) {
        self.state.mode = mode.code();
        self.command_turns_per_s = if mode == Mode::Crawling { cycles_per_s } else { 0.0 };
    }

    /// Crawls with the configured gait for a number of cycles.
    pub fn crawl_cycles(&mut self, cycles: f64) {
        let cycles_per_s = self.config.gait_cycles_per_s();
        self.command(Mode::Crawling, cycles_per_s);
        self.run(cycles / cycles_per_s.abs());
    }

    pub fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 1e9 / self.tick_ns as f64).round() as u64 {
            self.tick();
        }
    }

    pub fn time_s(&self) -> f64 {
        self.state.time_ns as f64 * 1e-9
    }

    pub fn raised(&self) -> Vec<AlarmKind> {
        let mask = self.monitor.raised_mask();
        let is_raised = |kind: &AlarmKind| mask >> kind.code() & 1 == 1;
        AlarmKind::ALL.iter().copied().filter(is_raised).collect()
    }

    pub fn is_armed(&self, kind: AlarmKind) -> bool {
        self.monitor.armed_mask() >> kind.code() & 1 == 1
    }

    /// Resets the controller's counters.
    pub fn restart_controller(&mut self) {
        self.state.sequence = 0;
        self.state.sample = 0;
        self.state.samples_missed = 0;
        self.state.link_failures = 0;
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    fn happens(&mut self, fraction: f64) -> bool {
        fraction > 0.0 && self.random.random::<f64>() < fraction
    }

    /// Advance per cycle and retraction per step in a direction, m: between the printed values of Table 1, linear.
    fn gait(&self, direction: f64) -> (f64, f64) {
        let slope_deg = self.config.canal.slope_deg * direction;
        let advance_m = if slope_deg >= 0.0 {
            6.83e-3 - slope_deg * 1.05e-4
        } else {
            6.83e-3 - slope_deg * 4e-5
        };
        (advance_m, 3e-5 * slope_deg.max(0.0))
    }

    fn tick(&mut self) {
        let step_s = self.tick_ns as f64 * 1e-9;
        self.state.sequence += 1;
        self.state.time_ns += self.tick_ns;
        let cycle = self.turn(step_s);
        let up = if self.config.canal.slope_deg < 0.0 { -1.0 } else { 1.0 };
        self.mean_m -= up * self.trouble.slide_m_per_s * step_s;
        self.measure_motor(step_s);
        let sampled = self.sample(step_s);
        let observation = Observation {
            state: &self.state,
            estimate: sampled.then_some(&self.estimate),
            cycle: cycle.as_ref(),
            residuals: None,
            inferred: None,
        };
        let changes = self.monitor.update(&observation);
        self.changes.extend_from_slice(&changes);
    }

    fn turn(&mut self, step_s: f64) -> Option<Cycle> {
        let ramp = self.config.gait_cycles_per_s().abs() / self.config.gait.ramp_s * step_s;
        let goal = self.state.goal_velocity_rad_s / TAU;
        let goal = goal + (self.command_turns_per_s - goal).clamp(-ramp, ramp);
        self.state.goal_velocity_rad_s = goal * TAU;
        let register = (goal * GOAL_COUNTS_PER_TURN_S).round() / GOAL_COUNTS_PER_TURN_S;
        let load = 1.0 - self.trouble.sluggish + 0.03 * (self.phase * 4.0 * TAU).sin();
        self.speed += (register * load - self.speed) * (step_s / SERVO_LAG_S).min(1.0);
        if self.trouble.stalled {
            self.speed = 0.0;
        }
        let before = self.phase;
        self.phase += self.speed * step_s;
        self.crawl(before);
        let ended = before.floor() != self.phase.floor();
        ended.then(|| self.end_cycle())
    }

    fn crawl(&mut self, before: f64) {
        let turned = self.phase - before;
        if turned == 0.0 {
            return;
        }
        let cells = self.config.worm.cells;
        let direction = turned.signum();
        let steps = before * cells as f64;
        let cell = self.config.worm.step_order[(steps.floor() as i64).rem_euclid(cells as i64) as usize] - 1;
        let lost = if self.trouble.jammed == Some(cell) {
            self.trouble.jam_fraction
        } else {
            0.0
        };
        let stroke_m = self.stroke_factor * self.config.worm.stroke_m;
        self.travel_m[cell] += stroke_m * cells as f64 * turned * (1.0 - lost);
        let (advance_m, retraction_m) = self.gait(direction);
        let advance_m = advance_m * self.stroke_factor * self.stroke_factor;
        let gain_m = if self.trouble.slipping {
            0.0
        } else {
            advance_m * (1.0 + self.stride_error) / cells as f64
        };
        let within = steps - steps.floor();
        let done = if direction > 0.0 { within } else { 1.0 - within };
        let per_step_m = if done < 0.35 {
            -retraction_m / 0.35
        } else {
            (gain_m + retraction_m) / 0.65
        };
        self.mean_m += direction * per_step_m * turned.abs() * cells as f64;
    }

    fn end_cycle(&mut self) -> Cycle {
        let direction = self.speed.signum();
        let duration_s = (self.state.time_ns - self.cycle_ns) as f64 * 1e-9;
        let (electrical, loss) = (1.0 + self.scatter * self.normal(), 1.0 + self.scatter * self.normal());
        let mut cycle = blank_cycle(self.config.worm.cells);
        cycle.index = self.cycle_index;
        cycle.end_ns = self.state.time_ns;
        cycle.duration_s = duration_s;
        cycle.advance_m = self.mean_m - self.cycle_mean_m;
        cycle.energy_electrical_j = (0.3 + 0.5 * duration_s) * electrical * self.trouble.electrical_factor;
        cycle.energy_loss_j = 0.05 * loss * self.trouble.loss_factor;
        cycle.predicted_advance_m = 1.1 * self.gait(direction).0;
        cycle.predicted_energy_loss_j = 0.055;
        cycle.settled = u32::from(self.cycles_in_direction > 0);
        cycle.direction = direction as i32;
        self.cycle_index += 1;
        self.cycles_in_direction += 1;
        self.cycle_ns = self.state.time_ns;
        self.cycle_mean_m = self.mean_m;
        self.stride_error = self.scatter * self.normal();
        cycle
    }

    fn measure_motor(&mut self, step_s: f64) {
        let failed = self.happens(self.trouble.link_failing);
        self.state.motor_is_new = u32::from(!failed);
        self.state.link_failures += u64::from(failed);
        let load = 0.15 + 0.05 * self.speed.abs();
        self.state.motor_current_a = if self.state.mode == Mode::Disarmed.code() {
            0.0
        } else {
            load
        };
        self.state.motor_duty = 0.5;
        let (open_v, resistance_ohm) = match &self.config.battery {
            None => (5.0, 0.2),
            Some(battery) => {
                let motor_w = self.state.motor_duty * self.state.motor_current_a * 5.0;
                self.battery_j -= (motor_w + battery.hotel_power_w) * step_s;
                let fraction = self.battery_j / battery.capacity_j;
                let open_v = battery.empty_v + fraction * (battery.full_v - battery.empty_v);
                (open_v, battery.internal_resistance_ohm)
            }
        };
        let hotel_a = self
            .config
            .battery
            .as_ref()
            .map_or(0.0, |battery| battery.hotel_power_w / open_v);
        let sagging_v = open_v - (0.5 * self.state.motor_current_a + hotel_a) * resistance_ohm;
        self.state.bus_voltage_v = (sagging_v * 10.0).round() * 0.1;
        self.state.motor_temperature_c = self.trouble.temperature_c.round();
        self.state.hardware_error = self.trouble.hardware_error;
        self.state.fault = self.trouble.fault.code();
        if !failed {
            self.state.phase = (self.phase * 4096.0).round() / 4096.0;
            self.state.motor_angle_rad = self.state.phase * TAU;
            self.state.motor_velocity_rad_s = self.speed * TAU;
        }
    }

    fn sample(&mut self, step_s: f64) -> bool {
        let cells = self.config.worm.cells;
        let mean_travel_m = self.travel_m[..cells].iter().sum::<f64>() / cells as f64;
        for cell in 0..cells {
            let true_m = self.mean_m + self.travel_m[cell] - mean_travel_m - SPACING_M * cell as f64;
            self.seen_m[cell] += (true_m - self.seen_m[cell]) * (step_s / TRACKER_LAG_S).min(1.0);
        }
        self.sample_debt += self.config.tracker.rate_hz * step_s;
        let due = self.sample_debt >= 1.0;
        self.sample_debt -= f64::from(u8::from(due));
        self.state.sample_is_new = u32::from(due && !self.trouble.tracker_dead);
        if self.state.sample_is_new == 0 {
            return false;
        }
        self.state.sample += 1;
        self.state.valid_mask = 0;
        for cell in 0..cells {
            if self.trouble.hidden_cell == Some(cell) || self.happens(self.trouble.dropout) {
                continue;
            }
            self.state.valid_mask |= 1 << cell;
            self.state.position_m[cell] = self.seen_m[cell];
            self.estimate.position_m[cell] = self.seen_m[cell] + self.noise_m * self.normal();
        }
        self.estimate.time_ns = self.state.time_ns;
        self.estimate.sample = self.state.sample;
        self.estimate.phase = self.state.phase;
        true
    }
}

pub fn blank_estimate(cells: usize) -> Estimate {
    Estimate {
        state_sequence: 0,
        time_ns: 0,
        sample: 0,
        states_lost: 0,
        phase: 0.0,
        position_m: [f64::NAN; MAX_CELLS],
        contact_m: [f64::NAN; MAX_CELLS],
        deformation_m: [f64::NAN; MAX_CELLS],
        force_n: [f64::NAN; MAX_CELLS],
        forward_slide_m: [0.0; MAX_CELLS],
        backward_slide_m: [0.0; MAX_CELLS],
        power_electrical_w: 0.0,
        energy_electrical_j: 0.0,
        energy_loss_j: 0.0,
        max_deformation_m: [0.00175; MAX_CELLS],
        battery_fraction: f64::NAN,
        cell_count: cells as u32,
        sliding_mask: 0,
        armed_mask: 0,
        raised_mask: 0,
    }
}

pub fn blank_cycle(cells: usize) -> Cycle {
    Cycle {
        index: 0,
        end_ns: 0,
        duration_s: 0.0,
        host_paused_s: 0.0,
        advance_m: 0.0,
        advance_sigma_m: 1e-5,
        forward_slide_m: [0.0; MAX_CELLS],
        backward_slide_m: [0.0; MAX_CELLS],
        energy_loss_j: 0.0,
        energy_loss_sigma_j: 5e-4,
        energy_actuator_net_j: 0.0,
        energy_actuator_positive_j: 0.0,
        energy_actuator_sigma_j: 0.0,
        energy_electrical_j: 0.0,
        energy_copper_j: 0.0,
        energy_friction_inside_j: 0.0,
        energy_electrical_sigma_j: 1e-3,
        cot: f64::NAN,
        predicted_advance_m: f64::NAN,
        predicted_energy_loss_j: f64::NAN,
        predicted_energy_positive_j: f64::NAN,
        predicted_forward_slide_m: [0.0; MAX_CELLS],
        predicted_backward_slide_m: [0.0; MAX_CELLS],
        samples: 300,
        cell_count: cells as u32,
        settled: 1,
        direction: 1,
    }
}
