//! Electrical energy into the motor and heat in its winding, by the trapezoidal rule over the time that the motor lived through
//! (`motor_time`).
//!
//! Only readings of their own tick count; between two of them power is taken to run in a straight line. Over more than
//! [`LONGEST_GAP_S`] without a reading nothing is counted, and the standard error grows by what a steady power would
//! have made of the gap. The rest of the standard error is what the servo's registers resolve (0.1 V, 1 mA): steps that a
//! nearly constant supply does not average out, so they count in full over the cycle.
//!
//! A warm winding resists more: its temperature is taken to be the servo's, which is a few kelvin less than it is.

use crate::message::State;

/// Longest time without a reading over which power is interpolated, s.
const LONGEST_GAP_S: f64 = 0.1;
/// Standard deviation of a voltage read in steps of 0.1 V, V.
const VOLTAGE_SIGMA_V: f64 = 0.029;
/// Standard deviation of a current read in steps of 1 mA, A.
const CURRENT_SIGMA_A: f64 = 0.29e-3;

/// Resistance of copper grows by this share per kelvin …
const COPPER_PER_K: f64 = 0.00393;
/// … from the temperature at which the configured resistance holds, °C.
const RESISTANCE_AT_C: f64 = 25.0;

/// Energies since a beginning.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Energies {
    /// ∫ V·duty·I dt, J.
    pub(super) electrical_j: f64,
    /// ∫ I² R dt, J.
    pub(super) copper_j: f64,
    by_voltage_j_per_v: f64, // ∫ duty·I dt
    by_current_j_per_a: f64, // ∫ |V·duty| dt
    gap_variance_j2: f64,
}

impl Energies {
    /// What came since `earlier`.
    pub(super) fn since(&self, earlier: &Self) -> Self {
        Self {
            electrical_j: self.electrical_j - earlier.electrical_j,
            copper_j: self.copper_j - earlier.copper_j,
            by_voltage_j_per_v: self.by_voltage_j_per_v - earlier.by_voltage_j_per_v,
            by_current_j_per_a: self.by_current_j_per_a - earlier.by_current_j_per_a,
            gap_variance_j2: self.gap_variance_j2 - earlier.gap_variance_j2,
        }
    }

    /// Standard error of the electrical energy, J.
    pub(super) fn sigma_j(&self) -> f64 {
        let voltage_j = self.by_voltage_j_per_v * VOLTAGE_SIGMA_V;
        let current_j = self.by_current_j_per_a * CURRENT_SIGMA_A;
        (voltage_j * voltage_j + current_j * current_j + self.gap_variance_j2.max(0.0)).sqrt()
    }
}

#[derive(Debug, Clone, Copy)]
struct Reading {
    motor_ns: u64,
    power_w: f64,
    copper_w: f64,
    current_a: f64, // duty × current, what a volt more would add
    winding_v: f64,
}

/// The running integrals.
#[derive(Debug, Clone)]
pub(super) struct Electrical {
    resistance_ohm: f64,
    last: Option<Reading>,
    total: Energies,
}

impl Electrical {
    pub(super) fn new(resistance_ohm: f64) -> Self {
        Self {
            resistance_ohm,
            last: None,
            total: Energies::default(),
        }
    }

    /// Takes up a tick at `motor_ns` of the motor's time, if its motor readings are its own and make sense.
    pub(super) fn update(&mut self, state: &State, motor_ns: u64) {
        let winding_v = state.bus_voltage_v * state.motor_duty;
        let resistance_ohm = self.resistance_at_ohm(state.motor_temperature_c);
        let reading = Reading {
            motor_ns,
            power_w: winding_v * state.motor_current_a,
            copper_w: state.motor_current_a * state.motor_current_a * resistance_ohm,
            current_a: state.motor_duty * state.motor_current_a,
            winding_v: winding_v.abs(),
        };
        if state.motor_is_new != 1 || !reading.power_w.is_finite() || !reading.copper_w.is_finite() {
            return;
        }
        if let Some(last) = self.last.replace(reading)
            && reading.motor_ns > last.motor_ns
        {
            let dt = (reading.motor_ns - last.motor_ns) as f64 * 1e-9;
            let mean = |from: f64, to: f64| 0.5 * (from + to);
            let power_w = mean(last.power_w, reading.power_w);
            if dt <= LONGEST_GAP_S {
                self.total.electrical_j += power_w * dt;
                self.total.copper_j += mean(last.copper_w, reading.copper_w) * dt;
                self.total.by_voltage_j_per_v += mean(last.current_a, reading.current_a) * dt;
                self.total.by_current_j_per_a += mean(last.winding_v, reading.winding_v) * dt;
            } else {
                self.total.gap_variance_j2 += (power_w * dt) * (power_w * dt);
            }
        }
    }

    /// Resistance of the winding at a temperature in °C; as configured where that is not known.
    fn resistance_at_ohm(&self, celsius: f64) -> f64 {
        let warmer_k = if celsius.is_finite() {
            celsius - RESISTANCE_AT_C
        } else {
            0.0
        };
        self.resistance_ohm * (1.0 + COPPER_PER_K * warmer_k).max(0.0)
    }

    /// The controller began anew; the gap before it is not its power.
    pub(super) fn restart(&mut self) {
        self.last = None;
    }

    /// Power at the last reading, W; `NaN` before the first.
    pub(super) fn power_w(&self) -> f64 {
        self.last.map_or(f64::NAN, |last| last.power_w)
    }

    /// Integrals since the estimator began.
    pub(super) fn total(&self) -> Energies {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(time_ns: u64, current_a: f64) -> State {
        State {
            time_ns,
            bus_voltage_v: 5.0,
            motor_duty: 0.5,
            motor_current_a: current_a,
            motor_is_new: 1,
            ..State::unknown(4)
        }
    }

    /// A motor that lives through all of the computer's time.
    fn take(electrical: &mut Electrical, state: &State) {
        electrical.update(state, state.time_ns);
    }

    #[test]
    fn lost_and_repeated_readings_do_not_matter_but_a_long_gap_is_left_out() {
        let mut electrical = Electrical::new(2.0);
        for tick in (0..=1000u64).filter(|tick| tick % 7 != 3) {
            take(&mut electrical, &state(tick * 1_000_000, tick as f64 * 1e-3));
            let repeated = State {
                motor_is_new: 0,
                ..state(tick * 1_000_000, 99.0)
            };
            take(&mut electrical, &repeated);
        }
        let total = electrical.total();
        assert!((total.electrical_j - 1.25).abs() < 1e-9, "∫ 2.5 V · t dt");
        assert!((total.copper_j - 2.0 / 3.0).abs() < 1e-5, "∫ 2 Ω · t² dt");
        take(&mut electrical, &state(2_000_000_000, 1.0));
        let gap = electrical.total().since(&total);
        assert_eq!(gap.electrical_j, 0.0);
        assert!((gap.sigma_j() - 2.5).abs() < 1e-9);
    }

    #[test]
    fn a_warm_winding_heats_more() {
        let heat_j = |celsius| {
            let mut electrical = Electrical::new(2.0);
            for time_ns in [0, 50_000_000] {
                let warm = State {
                    motor_temperature_c: celsius,
                    ..state(time_ns, 1.0)
                };
                take(&mut electrical, &warm);
            }
            electrical.total().copper_j
        };
        assert!((heat_j(25.0) - 0.1).abs() < 1e-12 && (heat_j(f64::NAN) - 0.1).abs() < 1e-12);
        assert!((heat_j(65.0) - 0.1 * (1.0 + 40.0 * 0.00393)).abs() < 1e-12);
    }

    #[test]
    fn readings_that_make_no_sense_are_left_out() {
        let mut electrical = Electrical::new(2.0);
        for current_a in [1.0, f64::NAN, f64::INFINITY, 1.0] {
            let time_ns = electrical.last.map_or(0, |last| last.motor_ns + 10_000_000);
            take(&mut electrical, &state(time_ns, current_a));
        }
        assert!((electrical.total().electrical_j - 0.025).abs() < 1e-12);
    }
}
