//! Electrical energy into the motor and heat in its winding, by the trapezoidal rule over motor time (`motor_time`).
//!
//! Only readings of their own tick count, and power is taken to be linear between two of them. Over more than [`LONGEST_GAP_S`] without
//! a reading nothing is counted, and the standard error grows by the energy that a steady power would have taken in the gap. The rest of
//! the standard error is the resolution of the servo's registers (0.1 V, 1 mA): a nearly constant supply does not average it out, so
//! it counts in full over the cycle. Where the current follows from the duty ([`Winding`]), what is known of the motor's constants takes
//! the place of the 1 mA.
//!
//! A warm winding has a higher resistance. Its temperature is taken to be the servo's, which is a few kelvin too low.

use crate::message::State;
use crate::winding::{MotorPower, Reported, Winding};

/// Longest time without a reading over which power is interpolated, s.
const LONGEST_GAP_S: f64 = 0.1;
/// Standard deviation of a voltage read in steps of 0.1 V, V.
const VOLTAGE_SIGMA_V: f64 = 0.029;

/// Energies since a beginning.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Energies {
    /// ∫ V·duty·I dt, J.
    pub(super) electrical_j: f64,
    /// ∫ I² R dt, J.
    pub(super) copper_j: f64,
    by_voltage_j_per_v: f64, // ∫ ∂P/∂V dt
    current_sigma_j: f64,    // ∫ of the power's standard error by the current
    gap_variance_j2: f64,
}

impl Energies {
    /// What came since `earlier`.
    pub(super) fn since(&self, earlier: &Self) -> Self {
        Self {
            electrical_j: self.electrical_j - earlier.electrical_j,
            copper_j: self.copper_j - earlier.copper_j,
            by_voltage_j_per_v: self.by_voltage_j_per_v - earlier.by_voltage_j_per_v,
            current_sigma_j: self.current_sigma_j - earlier.current_sigma_j,
            gap_variance_j2: self.gap_variance_j2 - earlier.gap_variance_j2,
        }
    }

    /// Standard error of the electrical energy, J.
    pub(super) fn sigma_j(&self) -> f64 {
        let voltage_j = self.by_voltage_j_per_v * VOLTAGE_SIGMA_V;
        let current_j = self.current_sigma_j;
        (voltage_j * voltage_j + current_j * current_j + self.gap_variance_j2.max(0.0)).sqrt()
    }
}

#[derive(Debug, Clone, Copy)]
struct Reading {
    motor_ns: u64,
    power: MotorPower,
    copper_w: f64,
}

/// The running integrals.
#[derive(Debug, Clone)]
pub(super) struct Electrical {
    winding: Winding,
    last: Option<Reading>,
    total: Energies,
}

impl Electrical {
    pub(super) fn new(winding: Winding) -> Self {
        Self {
            winding,
            last: None,
            total: Energies::default(),
        }
    }

    /// Adds a tick at motor time `motor_ns`, if its motor readings are new and valid.
    pub(super) fn update(&mut self, state: &State, motor_ns: u64) {
        let reported = Reported::from(state);
        let current_a = self.winding.current_a(&reported);
        let reading = Reading {
            motor_ns,
            power: self.winding.power(&reported),
            copper_w: current_a * current_a * self.winding.resistance_at_ohm(reported.temperature_c),
        };
        if state.motor_is_new != 1 || !reading.power.power_w.is_finite() || !reading.copper_w.is_finite() {
            return;
        }
        if let Some(last) = self.last.replace(reading)
            && reading.motor_ns > last.motor_ns
        {
            let dt = (reading.motor_ns - last.motor_ns) as f64 * 1e-9;
            let mean = |from: f64, to: f64| 0.5 * (from + to);
            let power_w = mean(last.power.power_w, reading.power.power_w);
            if dt <= LONGEST_GAP_S {
                self.total.electrical_j += power_w * dt;
                self.total.copper_j += mean(last.copper_w, reading.copper_w) * dt;
                self.total.by_voltage_j_per_v += mean(last.power.by_voltage_a, reading.power.by_voltage_a) * dt;
                self.total.current_sigma_j += mean(last.power.current_sigma_w, reading.power.current_sigma_w) * dt;
            } else {
                self.total.gap_variance_j2 += (power_w * dt) * (power_w * dt);
            }
        }
    }

    /// The controller began anew; the gap before it is not its power.
    pub(super) fn restart(&mut self) {
        self.last = None;
    }

    /// Power at the last reading, W; `NaN` before the first.
    pub(super) fn power_w(&self) -> f64 {
        self.last.map_or(f64::NAN, |last| last.power.power_w)
    }

    /// Integrals since the estimator began.
    pub(super) fn total(&self) -> Energies {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::winding::CurrentSource;

    fn electrical(source: CurrentSource) -> Electrical {
        Electrical::new(Winding {
            source,
            torque_constant_n_m_per_a: 0.4,
            torque_constant_sigma: 0.02,
            resistance_ohm: 2.0,
        })
    }

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

    /// A motor whose time is the computer's.
    fn take(electrical: &mut Electrical, state: &State) {
        electrical.update(state, state.time_ns);
    }

    #[test]
    fn lost_and_repeated_readings_do_not_matter_but_a_long_gap_is_left_out() {
        let mut electrical = electrical(CurrentSource::Winding);
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
            let mut electrical = electrical(CurrentSource::Winding);
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
        let mut electrical = electrical(CurrentSource::Winding);
        for current_a in [1.0, f64::NAN, f64::INFINITY, 1.0] {
            let time_ns = electrical.last.map_or(0, |last| last.motor_ns + 10_000_000);
            take(&mut electrical, &state(time_ns, current_a));
        }
        assert!((electrical.total().electrical_j - 0.025).abs() < 1e-12);
    }
    /// The register says 0.885 times the duty, and the winding carries (0.5 · 5 V − 0.4 V s · 5/s) / 2 Ω = 0.25 A.
    #[test]
    fn a_duty_in_the_register_of_the_current_is_not_counted_as_one() {
        let mut electrical = electrical(CurrentSource::Duty);
        for time_ns in [0, 50_000_000] {
            let turning = State {
                motor_velocity_rad_s: 5.0,
                ..state(time_ns, 0.885 * 0.5)
            };
            take(&mut electrical, &turning);
        }
        let total = electrical.total();
        assert!((total.electrical_j - 2.5 * 0.25 * 0.05).abs() < 1e-12, "{total:?}");
        assert!((total.copper_j - 0.25 * 0.25 * 2.0 * 0.05).abs() < 1e-12, "{total:?}");
        assert!(total.sigma_j() > 0.02 * total.electrical_j, "{total:?}");
    }
}
