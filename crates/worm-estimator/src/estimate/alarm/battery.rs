//! Battery low: the remaining charge is needed for the way home.
//!
//! **Charge.** Between corrections the charge falls by the energy drawn: the motor's power (duty × bus voltage × winding current), the hotel power,
//! and the loss in the battery's internal resistance. The open-circuit voltage, bus voltage + current × internal resistance, which
//! the battery's curve turns into a charge, corrects it: at first with the weight of a mean over the time since the start, so a usable value is there
//! after a second; later with a time constant of [`CORRECTION_S`], so that neither a start of the motor nor the 0.1 V steps of the
//! servo's reading show. The `range` topic has the charge with its standard error, from the end of the first gait cycle; this one is there
//! after a second.
//!
//! **Way home.** Distance from where the estimator first saw the worm × electrical energy per metre, hotel power included, over the last
//! cycles. The way home may be steeper or flatter than the way out was; the last known cost is used for both. Before the first cycle that
//! advanced, the way home is at most a few strokes, and only the reserve counts.
//!
//! On a worm without positions nobody knows how far it is home: then, too, only the reserve counts.
//!
//! The monitored value is (charge − reserve) over the energy for the way home.

use super::cam_motion::{Tick, finite_or_zero};
use super::latch::{DetectorOutput, Reading, ReadingState};
use super::sample::Positions;
use crate::battery::OpenCircuit;
use crate::config::{Battery, Config};
use crate::message::{Cycle, Severity, State};
use crate::winding::{Reported, Winding};

/// Time constant of the correction by voltage once the charge is known, s.
const CORRECTION_S: f64 = 600.0;
/// Time with voltage readings after which the charge is known well enough, s.
const USABLE_S: f64 = 1.0;
/// Weight of the newest cycle in the cost per metre.
const COST_WEIGHT: f64 = 0.1;
/// A cycle longer than this many steady ones contains a hold: its cost does not count.
const LONGEST_CYCLE: f64 = 1.5;
/// The cost is known once the weighted distance is this fraction of the stroke.
const MIN_ADVANCE_FRACTION: f64 = 0.05;
/// The alarm is over when the ratio is above the threshold by this factor.
const CLEAR_FACTOR: f64 = 1.15;
/// Ratios above this are reported as this: the worm is at home.
const LARGEST_RATIO: f64 = 1000.0;

#[derive(Debug, Clone)]
pub(super) struct BatteryLow {
    battery: Option<Battery>,
    curve: Option<OpenCircuit>,
    winding: Winding,
    threshold: f64,
    stroke_m: f64,
    fraction: f64,
    known_s: f64, // time with voltage readings
    home: Option<Positions>,
    distance_m: f64,
    paid_j: f64,   // in the last cycles, older ones weighing less
    gained_m: f64, // with the same weights
    since_ns: u64,
}

impl BatteryLow {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            battery: config.battery.clone(),
            curve: config.battery.as_ref().map(OpenCircuit::new),
            winding: config.winding(),
            threshold: config.alarms.battery_low.threshold,
            stroke_m: config.worm.stroke_m,
            fraction: f64::NAN,
            known_s: 0.0,
            home: None,
            distance_m: 0.0,
            paid_j: 0.0,
            gained_m: 0.0,
            since_ns: 0,
        }
    }

    /// Charge left, 0 to 1; `NaN` without a battery or before its voltage was read.
    pub(super) const fn fraction(&self) -> f64 {
        self.fraction
    }

    pub(super) fn note_positions(&mut self, positions: &Positions) {
        match &self.home {
            None if positions.mask != 0 => self.home = Some(*positions),
            None => {}
            Some(home) => {
                if let Some(moved_m) = positions.median_moved_since(home) {
                    self.distance_m = moved_m.abs();
                }
            }
        }
    }

    pub(super) fn note_cycle(&mut self, tick: &Tick, cycle: &Cycle) {
        let Some(battery) = &self.battery else { return };
        let displacement_m = cycle.advance_m.abs();
        let energy_j = cycle.energy_electrical_j + battery.hotel_power_w * cycle.duration_s;
        let crawled_through = cycle.duration_s * tick.regime_cycles_per_s.abs() <= LONGEST_CYCLE;
        if crawled_through && displacement_m <= self.stroke_m && energy_j > 0.0 && energy_j < 1e9 {
            self.paid_j += energy_j - COST_WEIGHT * self.paid_j;
            self.gained_m += displacement_m - COST_WEIGHT * self.gained_m;
        }
    }

    /// Cost per metre of the last cycles, J/m, once they advanced far enough.
    fn cost_j_per_m(&self) -> Option<f64> {
        (self.gained_m >= MIN_ADVANCE_FRACTION * self.stroke_m).then(|| self.paid_j / self.gained_m)
    }

    pub(super) fn update(&mut self, tick: &Tick, state: &State) -> DetectorOutput {
        let (Some(battery), Some(curve)) = (&self.battery, &self.curve) else {
            return DetectorOutput::Unknown;
        };
        let volts = state.bus_voltage_v;
        if volts.is_finite() && volts > 0.5 * battery.empty_v && volts < 2.0 * battery.full_v {
            let motor_w = finite_or_zero(self.winding.power(&Reported::from(state)).power_w);
            let load_w = motor_w.clamp(0.0, 1e3) + battery.hotel_power_w;
            let amperes = load_w / volts;
            let drawn_w = load_w + amperes * amperes * battery.internal_resistance_ohm;
            let open_v = volts + amperes * battery.internal_resistance_ohm;
            let by_voltage = curve.share(open_v);
            self.known_s += tick.step_s;
            if self.fraction.is_nan() {
                self.fraction = by_voltage;
            }
            self.fraction -= drawn_w * tick.step_s / battery.capacity_j;
            let weight = tick.step_s / self.known_s.clamp(tick.step_s.max(1e-3), CORRECTION_S);
            self.fraction = (self.fraction + weight * (by_voltage - self.fraction)).clamp(0.0, 1.0);
        }
        if self.known_s < USABLE_S {
            return DetectorOutput::Unknown;
        }
        let left_j = (self.fraction - battery.reserve_share) * battery.capacity_j;
        let home_j = self.distance_m * self.cost_j_per_m().unwrap_or(0.0);
        let ratio = (left_j.max(0.0) / home_j.max(left_j.max(1e-9) / LARGEST_RATIO)).min(LARGEST_RATIO);
        let verdict = if ratio < self.threshold {
            ReadingState::Bad
        } else if ratio > CLEAR_FACTOR * self.threshold {
            ReadingState::Good
        } else {
            ReadingState::Between
        };
        if verdict != ReadingState::Bad {
            self.since_ns = tick.now_ns;
        }
        DetectorOutput::Measured(Reading {
            value: ratio,
            threshold: self.threshold,
            verdict,
            since_ns: self.since_ns,
            cell: None,
            severity: Severity::Warning,
        })
    }
}
