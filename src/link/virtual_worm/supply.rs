//! What feeds the servo: a battery whose voltage falls as it empties, or a bench supply.

use worm_estimator::battery::OpenCircuit;
use worm_estimator::config::Config;

/// Volts on the bus never fall below this in the equations, so that power over voltage stays finite.
const MIN_BUS_V: f64 = 0.1;

/// A voltage source with inner resistance; with a battery also a finite store.
#[derive(Debug, Clone, PartialEq)]
pub struct Supply {
    curve: Option<OpenCircuit>, // none for a bench supply
    bench_v: f64,
    resistance_ohm: f64,
    hotel_power_w: f64,
    capacity_j: f64, // infinite for a bench supply
    charge_j: f64,   // in [0, capacity_j]
    drop_v: f64,
    extra_ohm: f64,
}

impl Supply {
    /// The configured battery, full; without one the bench supply of `[virtual_worm]`.
    pub fn new(config: &Config) -> Self {
        let bench = &config.virtual_worm;
        match &config.battery {
            Some(battery) => Self {
                curve: Some(OpenCircuit::new(battery)),
                bench_v: bench.supply_v,
                resistance_ohm: battery.internal_resistance_ohm,
                hotel_power_w: battery.hotel_power_w,
                capacity_j: battery.capacity_j,
                charge_j: battery.capacity_j,
                drop_v: 0.0,
                extra_ohm: 0.0,
            },
            None => Self {
                curve: None,
                bench_v: bench.supply_v,
                resistance_ohm: bench.supply_resistance_ohm,
                hotel_power_w: 0.0,
                capacity_j: f64::INFINITY,
                charge_j: f64::INFINITY,
                drop_v: 0.0,
                extra_ohm: 0.0,
            },
        }
    }

    /// Share of the charge that is left, 0 to 1; 1 for a bench supply.
    pub fn charge_share(&self) -> f64 {
        if self.capacity_j.is_finite() {
            self.charge_j / self.capacity_j
        } else {
            1.0
        }
    }

    /// Sets the share of the charge that is left; a bench supply has none to set.
    pub fn set_charge_fraction(&mut self, fraction: f64) {
        if self.capacity_j.is_finite() {
            self.charge_j = self.capacity_j * fraction.clamp(0.0, 1.0);
        }
    }

    /// A defect on top of the supply: a missing voltage and an added resistance.
    pub fn set_defect(&mut self, drop_v: f64, extra_ohm: f64) {
        self.drop_v = drop_v;
        self.extra_ohm = extra_ohm;
    }

    /// Voltage without load, V: by the battery's curve, and the battery's protection opens when it is empty.
    pub fn open_circuit_v(&self) -> f64 {
        if self.charge_j <= 0.0 {
            return 0.0;
        }
        let charged_v = match &self.curve {
            Some(curve) => curve.volts(self.charge_share()),
            None => self.bench_v,
        };
        (charged_v - self.drop_v).max(0.0)
    }

    /// Voltage on the bus, V, while a motor that takes `conductance_s`·V − `feedback_a` hangs on it.
    ///
    /// A bridge at duty D takes D·I from the bus, and I = (D·V − k·ω)/R; so the conductance is D²/R and the feedback
    /// D·k·ω/R. Solving for V here, rather than lagging behind it, keeps a weak supply stable. `bus_v` is the voltage of
    /// the step before, for the power of everything else.
    pub fn bus_v(&self, conductance_s: f64, feedback_a: f64, bus_v: f64) -> f64 {
        let resistance_ohm = self.resistance_ohm + self.extra_ohm;
        let hotel_a = self.hotel_power_w / bus_v.max(MIN_BUS_V);
        let source_v = self.open_circuit_v() + resistance_ohm * (feedback_a - hotel_a);
        (source_v / (1.0 + resistance_ohm * conductance_s)).max(0.0)
    }

    /// Takes what the motor took in a step, and what everything else took, out of the store. Heat in the inner
    /// resistance is counted: the store gives open-circuit voltage times current.
    pub fn draw(&mut self, motor_j: f64, bus_v: f64, dt_s: f64) {
        if self.capacity_j.is_finite() {
            let bus_j = motor_j + self.hotel_power_w * dt_s;
            let store_j = bus_j * self.open_circuit_v() / bus_v.max(MIN_BUS_V);
            self.charge_j = (self.charge_j - store_j).clamp(0.0, self.capacity_j);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_estimator::config::Battery;

    fn on_battery() -> Supply {
        Supply::new(&Config {
            battery: Some(Battery {
                capacity_j: 1000.0,
                full_v: 5.6,
                empty_v: 4.0,
                internal_resistance_ohm: 0.2,
                hotel_power_w: 0.5,
                reserve_share: 0.1,
                ..Battery::default()
            }),
            ..Config::default()
        })
    }

    #[test]
    fn voltage_falls_with_charge_and_ends_with_it() {
        let mut supply = on_battery();
        assert!((supply.open_circuit_v() - 5.6).abs() < 1e-12);
        supply.set_charge_fraction(0.5);
        assert!((supply.open_circuit_v() - 4.8).abs() < 1e-12);
        supply.draw(600.0, 4.8, 0.0);
        assert_eq!((supply.charge_share(), supply.open_circuit_v()), (0.0, 0.0));
    }

    #[test]
    fn load_makes_it_sag_by_current_times_resistance() {
        let supply = Supply::new(&Config::default()); // 5 V, 0.2 ohm
        let bus_v = supply.bus_v(1.0 / 3.4, 0.0, 5.0); // a stalled motor at full duty
        assert!((bus_v - (5.0 - 0.2 * bus_v / 3.4)).abs() < 1e-12);
        assert_eq!(supply.charge_share(), 1.0);
    }

    #[test]
    fn others_take_power_too() {
        let mut supply = on_battery();
        supply.draw(0.0, 5.6, 100.0);
        assert!((supply.charge_share() - 0.95).abs() < 1e-12);
    }
}
