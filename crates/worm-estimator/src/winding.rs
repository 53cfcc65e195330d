//! Current in the motor's winding, and the power that it takes, from what the servo reports.
//!
//! A servo may report the duty of its bridge where a current is expected (`docs/servo-bench.md` in the repository: a real XL330 in position
//! mode). Whoever needs a current or a power asks here, so that all agree on what the register means.

use crate::message::State;

/// Resistance of copper grows by this fraction per kelvin …
const COPPER_PER_K: f64 = 0.00393;
/// … from the temperature at which the stated resistance holds, °C.
const RESISTANCE_AT_C: f64 = 25.0;
/// Standard deviation of a current read in steps of 1 mA, A.
const ROUNDING_A: f64 = 0.29e-3;

/// What the servo reports as its current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurrentSource {
    /// The current in the winding.
    Winding,
    /// Nothing that is one: the duty of the bridge, as a real XL330 in position mode does. The current then follows from voltage, duty,
    /// velocity and the resistance of the winding, and is as uncertain as that.
    Duty,
}

/// What a reading says of the winding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reported {
    /// What the servo calls its current, A.
    pub current_a: f64,
    /// Voltage on the bus, V.
    pub bus_voltage_v: f64,
    /// Duty of the bridge, −1 to 1.
    pub duty: f64,
    /// Velocity of the shaft, rad/s.
    pub velocity_rad_per_s: f64,
    /// Temperature of the servo, °C; `NaN` where unknown.
    pub temperature_c: f64,
}

impl From<&State> for Reported {
    fn from(state: &State) -> Self {
        Self {
            current_a: state.motor_current_a,
            bus_voltage_v: state.bus_voltage_v,
            duty: state.motor_duty,
            velocity_rad_per_s: state.motor_velocity_rad_s,
            temperature_c: state.motor_temperature_c,
        }
    }
}

/// Electrical power into the motor at one reading, with what it is uncertain by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorPower {
    /// The power, W.
    pub power_w: f64,
    /// By how much it grows with the voltage on the bus, A.
    pub by_voltage_a: f64,
    /// Standard error by what is not known of the current, W: rounding, or the constants that it follows from. It does not average out.
    pub current_sigma_w: f64,
}

/// The winding, and what the register of the current says of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Winding {
    /// What the reported current is.
    pub source: CurrentSource,
    /// Torque per current, N m/A, and back EMF per velocity, V s/rad.
    pub torque_constant_n_m_per_a: f64,
    /// Standard deviation of what is known of it, as a share; for [`CurrentSource::Duty`] that of the resistance, too.
    pub torque_constant_sigma: f64,
    /// Resistance of winding and bridge at 25 °C, Ω.
    pub resistance_ohm: f64,
}

impl Winding {
    /// Resistance at a temperature in °C, Ω; as stated where that is `NaN`.
    pub fn resistance_at_ohm(&self, celsius: f64) -> f64 {
        let warmer_k = if celsius.is_finite() {
            celsius - RESISTANCE_AT_C
        } else {
            0.0
        };
        self.resistance_ohm * (1.0 + COPPER_PER_K * warmer_k).max(0.0)
    }

    /// Current in the winding, A; `NaN` where a value that it needs is.
    #[inline]
    pub fn current_a(&self, reported: &Reported) -> f64 {
        match self.source {
            CurrentSource::Winding => reported.current_a,
            CurrentSource::Duty => {
                let winding_v = reported.bus_voltage_v * reported.duty;
                let induced_v = self.torque_constant_n_m_per_a * reported.velocity_rad_per_s;
                (winding_v - induced_v) / self.resistance_at_ohm(reported.temperature_c)
            }
        }
    }

    /// Electrical power into the motor; `NaN` where a value that it needs is.
    #[inline]
    pub fn power(&self, reported: &Reported) -> MotorPower {
        let current_a = self.current_a(reported);
        let winding_v = reported.bus_voltage_v * reported.duty;
        let (more_current_a_per_v, current_sigma_a) = match self.source {
            CurrentSource::Winding => (0.0, ROUNDING_A),
            CurrentSource::Duty => {
                let resistance_ohm = self.resistance_at_ohm(reported.temperature_c);
                let induced_a = self.torque_constant_n_m_per_a * reported.velocity_rad_per_s / resistance_ohm;
                let sigma_a = self.torque_constant_sigma * induced_a.hypot(current_a);
                (reported.duty / resistance_ohm, sigma_a)
            }
        };
        MotorPower {
            power_w: winding_v * current_a,
            by_voltage_a: reported.duty * current_a + winding_v * more_current_a_per_v,
            current_sigma_w: winding_v.abs() * current_sigma_a,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDING: Winding = Winding {
        source: CurrentSource::Winding,
        torque_constant_n_m_per_a: 0.39,
        torque_constant_sigma: 0.02,
        resistance_ohm: 3.4,
    };

    /// A motor at 5 V with this duty, at 2 rad/s: 0.212 A flow at a duty of 0.3.
    fn reported(duty: f64, celsius: f64) -> Reported {
        Reported {
            current_a: 0.885 * duty,
            bus_voltage_v: 5.0,
            duty,
            velocity_rad_per_s: 2.0,
            temperature_c: celsius,
        }
    }

    #[test]
    fn a_duty_for_a_current_needs_the_warm_resistance() {
        let by_duty = Winding {
            source: CurrentSource::Duty,
            ..WINDING
        };
        let table = [
            (WINDING, 25.0, 0.2655),
            (WINDING, 45.0, 0.2655),
            (by_duty, 25.0, 0.72 / 3.4),
            (by_duty, f64::NAN, 0.72 / 3.4),
            (by_duty, 45.0, 0.72 / 3.4 / 1.0786),
        ];
        for (winding, celsius, expected_a) in table {
            let reported = reported(0.3, celsius);
            let (current_a, power) = (winding.current_a(&reported), winding.power(&reported));
            assert!((current_a - expected_a).abs() < 1e-12, "{winding:?} at {celsius} °C");
            assert!(
                (power.power_w - 1.5 * expected_a).abs() < 1e-12,
                "{winding:?} at {celsius} °C"
            );
            let higher = Reported {
                bus_voltage_v: 5.001,
                ..reported
            };
            let grows_a = (winding.power(&higher).power_w - power.power_w) / 1e-3;
            assert!(
                (grows_a - power.by_voltage_a).abs() < 1e-4,
                "{winding:?} at {celsius} °C"
            );
        }
    }

    /// A current that is read is as good as its rounding; one that follows from the duty is as good as what is known of the motor.
    #[test]
    fn a_derived_power_is_as_uncertain_as_its_constants() {
        let by_duty = Winding {
            source: CurrentSource::Duty,
            ..WINDING
        };
        let sigma_w = |winding: Winding| winding.power(&reported(0.3, 25.0)).current_sigma_w;
        assert!((sigma_w(WINDING) - 1.5 * 0.29e-3).abs() < 1e-12);
        let expected_w = 1.5 * 0.02 * (0.78f64 / 3.4).hypot(0.72 / 3.4);
        assert!((sigma_w(by_duty) - expected_w).abs() < 1e-12);
    }
}
