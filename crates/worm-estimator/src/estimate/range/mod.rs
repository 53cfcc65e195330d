//! Remaining range and time, with an interval, from the first gait cycle on.
//!
//! What is left in the battery ([`ChargeEstimate`]) is divided by what a cycle costs, and multiplied by how far it goes:
//!
//! - **Cost.** Electrical energy of the motor, measured in each cycle, plus hotel power × duration, plus the loss in the internal resistance.
//! - **Distance.** Advance, measured in each cycle; of a worm that nobody sees, as the motor's current says it.
//!
//! Both begin with what the model predicts and with how far off a model may be, and each measured cycle moves them (`running_mean`): after
//! three cycles hardly anything of the prediction is left. A change of direction or speed begins anew, because another gait costs
//! something else. A cycle that contains a hold, or in which the computer paused, says nothing of a usual cycle and is left out.
//!
//! The bounds are those of the charge, widened by the standard errors of cost and distance. Cost and distance are those of the last cycles:
//! where the canal ahead is steeper, they are wrong; `wormd plan` takes slopes into account.

mod running_mean;
#[cfg(test)]
mod tests;

use crate::battery::{ChargeEstimate, Spread};
use crate::config::{Battery, Config, PhysicsError};
use crate::message::{Cycle, Range, State};
use crate::time::seconds;
use crate::winding::{Reported, Winding};
use running_mean::RunningMean;
use std::f64::consts::TAU;
use worm_physics::{DriveLoad, Motor};

/// Standard deviation of the advance that the model predicts, as a fraction: the paper's own, Table 4 against the experiment.
pub const MODEL_ADVANCE_SIGMA: f64 = 0.12;
/// Standard deviation of what the model leaves on a leg whatever the worm's parameters are, as a fraction: against the paper's experiment
/// (Table 4) it is off by +5, −18 and 0 % on three slopes.
pub const MODEL_LEG_SIGMA: f64 = 0.08;
/// Standard deviation of the motor's energy that the model predicts, as a fraction: friction inside differs from servo to servo.
pub const MODEL_ENERGY_SIGMA: f64 = 0.4;
/// Standard error added to a cycle that began before the tips were known, as a fraction: the first from rest is not a usual one.
const UNSETTLED_SIGMA: f64 = 0.1;
/// A cycle whose duration differs from the usual one by more than this fraction contains a hold, or begins another speed …
const OTHER_DURATION: f64 = 0.2;
/// … which it is if the next one is as long, within this fraction.
const SAME_DURATION: f64 = 0.1;
/// Time after which a worm at rest reads its battery, s.
const REST_WINDOW_S: f64 = 10.0;
/// Longest step between two states that is counted, s.
const LONGEST_STEP_S: f64 = 10.0;
/// Time constant of the load that counts for the lowest voltage, s: as long as the controller averages the voltage.
const LOAD_S: f64 = 0.1;
/// Standard deviation of a gauge's reading, as a share of the battery.
const GAUGE_SIGMA: f64 = 0.03;
/// Standard deviations to either bound of a 90 % interval.
pub const INTERVAL_SIGMAS: f64 = 1.645;

/// Follows the battery and the cost of the crawl. It allocates nothing after construction.
#[derive(Debug, Clone)]
pub struct RangeEstimator {
    battery: Battery,
    motor: Motor,
    winding: Winding,
    lowest_bus_v: f64,
    may_lack_positions: bool,
    charge: ChargeEstimate,
    window: Window,
    load_a: f64,
    last_ns: Option<u64>,
    duration_s: f64,      // of a usual cycle
    last_duration_s: f64, // of the last cycle, usual or not
    direction: i32,
    gauge_share: f64,              // read since the last cycle, or NaN
    energy_j: Option<RunningMean>, // of the motor
    advance_m: Option<RunningMean>,
    inferred_m: Option<(f64, f64)>, // advance of a forward cycle, and its standard error
}

/// Means since the battery was last read.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    duration_s: f64,
    volt_s: f64,
    ampere_s: f64,
    peak_a: f64,
}

impl RangeEstimator {
    /// An estimator for a checked configuration; none without a battery.
    ///
    /// # Errors
    /// [`PhysicsError`] for values that a checked configuration cannot have.
    pub fn new(config: &Config) -> Result<Option<Self>, PhysicsError> {
        let Some(battery) = config.battery.clone() else {
            return Ok(None);
        };
        let motor = config.motor()?;
        let cycle_s = config.gait.cycle_s;
        // What share of the cost the hotel power has decides how much its error counts.
        let hotel_j = battery.hotel_power_w * cycle_s;
        let idle = DriveLoad::constant(0.0);
        let hotel_share = hotel_j / (hotel_j + motor.cycle(&idle, cycle_s).energy_j).max(f64::MIN_POSITIVE);
        let factor_sigma = battery
            .capacity_sigma_share
            .hypot(hotel_share * battery.hotel_power_sigma_share);
        Ok(Some(Self {
            charge: ChargeEstimate::new(&battery, factor_sigma),
            lowest_bus_v: battery.lowest_bus_v(&config.limits),
            may_lack_positions: config.position_source().may_be_missing(),
            battery,
            motor,
            winding: config.winding(),
            window: Window::default(),
            load_a: 0.0,
            last_ns: None,
            duration_s: cycle_s,
            last_duration_s: f64::NAN,
            direction: 0,
            gauge_share: f64::NAN,
            energy_j: None,
            advance_m: None,
            inferred_m: None,
        }))
    }

    /// Takes a state: counts what the battery gives, and reads its voltage.
    pub fn note_state(&mut self, state: &State) {
        let last_ns = self.last_ns.replace(state.time_ns).unwrap_or(state.time_ns);
        let step_s = seconds(state.time_ns.saturating_sub(last_ns)).min(LONGEST_STEP_S);
        let (bus_v, battery) = (state.bus_voltage_v, &self.battery);
        if step_s <= 0.0 || !bus_v.is_finite() || bus_v < 0.5 * battery.empty_v || bus_v > 2.0 * battery.full_v {
            return;
        }
        let motor_w = self.winding.power(&Reported::from(state)).power_w;
        let motor_w = if motor_w.is_finite() {
            motor_w.clamp(0.0, 1e3)
        } else {
            0.0
        };
        let load_w = motor_w + battery.hotel_power_w;
        let current_a = load_w / bus_v;
        let loss_w = current_a * current_a * battery.internal_resistance_ohm;
        self.charge.draw((load_w + loss_w) * step_s);
        self.load_a += (step_s / LOAD_S).min(1.0) * (current_a - self.load_a);
        self.window.duration_s += step_s;
        self.window.volt_s += bus_v * step_s;
        self.window.ampere_s += current_a * step_s;
        self.window.peak_a = self.window.peak_a.max(self.load_a);
        if self.window.duration_s > REST_WINDOW_S.max(3.0 * self.duration_s) {
            self.read_battery();
        }
    }

    /// Takes a gauge's reading: the share of the energy that is left, 0 to 1. It counts at the end of the cycle, of several the last one.
    pub fn note_gauge(&mut self, share: f64) {
        if (0.0..=1.0).contains(&share) {
            self.gauge_share = share;
        }
    }

    /// Takes the advance of a forward cycle as the motor's current says it, with its standard error, m: it counts where none was measured.
    pub fn note_inferred_advance(&mut self, advance_m: f64, sigma_m: f64) {
        self.inferred_m = Some((advance_m, sigma_m.hypot(MODEL_LEG_SIGMA * advance_m)));
    }

    /// Takes a finished cycle, after its last state, and says how far the battery lasts. Nothing before the first voltage and the
    /// first cycle of a known cost.
    pub fn note_cycle(&mut self, cycle: &Cycle) -> Option<Range> {
        let peak_a = self.read_battery();
        self.follow(cycle);
        let energy_j = self.energy_j?;
        if self.advance_m.is_none() && !self.may_lack_positions {
            return None;
        }
        // A replay finds the reading in the range that is returned.
        let gauge_share = std::mem::replace(&mut self.gauge_share, f64::NAN);
        if gauge_share.is_finite() {
            self.charge.read_gauge(gauge_share, GAUGE_SIGMA);
        }
        if !self.charge.is_known() {
            return None;
        }
        let load_j = energy_j.mean() + self.battery.hotel_power_w * self.duration_s;
        let (share, share_sigma) = self.charge.share();
        let open_v = self.charge.curve().volts(share);
        let loss = load_j / self.duration_s / open_v * self.battery.internal_resistance_ohm / open_v;
        let cost_j = load_j * (1.0 + loss);
        let rounding_j = finite_or(cycle.energy_electrical_sigma_j, 0.0);
        let cost_sigma_j = energy_j.sigma().hypot(rounding_j) * (1.0 + loss);
        let lowest_open_v = self.lowest_bus_v + peak_a * self.battery.internal_resistance_ohm;
        let too_low = if lowest_open_v > self.battery.empty_v {
            self.charge.curve().share(lowest_open_v)
        } else {
            0.0
        };
        let left = self.charge.left_above_j(too_low.max(self.battery.reserve_share));
        let cycles = scaled(left, 1.0 / cost_j, cost_sigma_j / cost_j);
        let time_s = scaled(left, self.duration_s / cost_j, cost_sigma_j / cost_j);
        // Without positions and current nobody knows how far a cycle goes: cycles and time are all that can be said.
        let measured_m = self.advance_m.map(|advance_m| (advance_m.mean(), advance_m.sigma()));
        let inferred_m = self.inferred_m.filter(|_| self.direction > 0);
        let (mean_m, sigma_m) = measured_m.or(inferred_m).unwrap_or((f64::NAN, f64::NAN));
        let range_m = if mean_m > 0.0 {
            scaled(left, mean_m / cost_j, (cost_sigma_j / cost_j).hypot(sigma_m / mean_m))
        } else if mean_m.is_nan() {
            Spread {
                mean: f64::NAN,
                low: f64::NAN,
                high: f64::NAN,
            }
        } else {
            scaled(left, 0.0, 0.0)
        };
        Some(Range {
            index: cycle.index,
            end_ns: cycle.end_ns,
            charge_share: share,
            charge_sigma_share: share_sigma,
            energy_left_j: left.mean,
            energy_left_low_j: left.low,
            energy_left_high_j: left.high,
            energy_per_cycle_j: cost_j,
            energy_per_cycle_sigma_j: cost_sigma_j,
            advance_per_cycle_m: mean_m,
            advance_per_cycle_sigma_m: sigma_m,
            cycles: cycles.mean,
            cycles_low: cycles.low,
            cycles_high: cycles.high,
            range_m: range_m.mean,
            range_low_m: range_m.low,
            range_high_m: range_m.high,
            time_s: time_s.mean,
            time_low_s: time_s.low,
            time_high_s: time_s.high,
            gauge_share,
            cycles_used: energy_j.seen(),
            direction: self.direction,
        })
    }

    /// Reads the battery by the means of the window, and begins a new one. Returns the greatest current in it, A.
    fn read_battery(&mut self) -> f64 {
        let window = std::mem::take(&mut self.window);
        if window.duration_s > 0.0 {
            let (bus_v, current_a) = (window.volt_s / window.duration_s, window.ampere_s / window.duration_s);
            self.charge.read(bus_v, current_a);
        }
        window.peak_a
    }

    /// Moves cost and advance by a cycle, if it is a usual one.
    fn follow(&mut self, cycle: &Cycle) {
        let is_near = |duration_s: f64, fraction: f64| (cycle.duration_s / duration_s - 1.0).abs() <= fraction;
        let last_duration_s = std::mem::replace(&mut self.last_duration_s, cycle.duration_s);
        let energy_j = cycle.energy_electrical_j;
        if !(cycle.duration_s > 0.0 && energy_j.is_finite() && cycle.host_paused_s == 0.0) {
            return;
        }
        let is_other_gait = if cycle.direction != self.direction {
            true
        } else if is_near(self.duration_s, OTHER_DURATION) {
            false
        } else if is_near(last_duration_s, SAME_DURATION) {
            true
        } else {
            return;
        };
        if is_other_gait {
            (self.energy_j, self.advance_m) = (None, None);
            (self.direction, self.duration_s) = (cycle.direction, cycle.duration_s);
        }
        self.duration_s += 0.2 * (cycle.duration_s - self.duration_s);
        let unsettled = if cycle.settled == 0 { UNSETTLED_SIGMA } else { 0.0 };
        let predicted_j = self.predicted_energy_j(cycle);
        self.energy_j
            .get_or_insert_with(|| RunningMean::predicted(predicted_j, MODEL_ENERGY_SIGMA, energy_j))
            .add(energy_j, unsettled * energy_j.abs());
        let sign = f64::from(self.direction);
        let (advance_m, predicted_m) = (sign * cycle.advance_m, sign * cycle.predicted_advance_m);
        if advance_m.is_finite() {
            let sigma_m = finite_or(cycle.advance_sigma_m, 0.0).hypot(unsettled * advance_m);
            self.advance_m
                .get_or_insert_with(|| RunningMean::predicted(predicted_m, MODEL_ADVANCE_SIGMA, advance_m))
                .add(advance_m, sigma_m);
        }
    }

    /// Energy of the motor for the work that the model predicts, J, with the torque taken as even; `NaN` where it predicts none.
    fn predicted_energy_j(&self, cycle: &Cycle) -> f64 {
        let load = DriveLoad::constant(cycle.predicted_energy_loss_j / TAU);
        self.motor.cycle(&load, cycle.duration_s).energy_j
    }
}

fn finite_or(value: f64, other: f64) -> f64 {
    if value.is_finite() { value } else { other }
}

/// A spread times a factor that is itself uncertain by a fraction.
fn scaled(spread: Spread, factor: f64, sigma_fraction: f64) -> Spread {
    let mean = spread.mean * factor;
    let wider = INTERVAL_SIGMAS * sigma_fraction * mean;
    Spread {
        mean,
        low: (mean - wider.hypot(mean - spread.low * factor)).max(0.0),
        high: mean + wider.hypot(spread.high * factor - mean),
    }
}
