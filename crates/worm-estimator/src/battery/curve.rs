//! Voltage without load over the energy that is left.
//!
//! The curves of the chemistries are *typical*, without a citable source: rested voltages of one cell at steps of a tenth of its *charge*,
//! rounded means of what makers and users commonly publish, of no particular product. `full_v` and `empty_v` stretch them, so that they
//! serve for any number of cells in series. They are good for some per cent of the charge where they are steep. On the plateau of lithium
//! iron phosphate no voltage says how much is left. Whoever needs better measures the own battery and writes its table into the
//! configuration.

use crate::config::{Battery, Chemistry};

/// Rested voltages of one cell from empty to full, V.
const LIPO_V: [f64; 11] = [3.27, 3.69, 3.73, 3.77, 3.80, 3.84, 3.87, 3.95, 4.02, 4.11, 4.20];
const LIFEPO4_V: [f64; 11] = [2.50, 3.00, 3.20, 3.22, 3.25, 3.26, 3.27, 3.30, 3.32, 3.35, 3.40];
const NIMH_V: [f64; 11] = [1.00, 1.20, 1.24, 1.26, 1.27, 1.28, 1.29, 1.30, 1.32, 1.35, 1.40];

/// Open-circuit voltage over the share of the energy that is left: a broken line that grows.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenCircuit {
    shares: Vec<f64>, // from 0 to 1, growing
    volts: Vec<f64>,  // growing
}

impl OpenCircuit {
    /// The curve of a checked battery.
    pub fn new(battery: &Battery) -> Self {
        if !battery.open_circuit_v.is_empty() {
            return Self::over_charge(battery.open_circuit_v.clone());
        }
        let cell: &[f64] = match battery.chemistry {
            Chemistry::Linear => {
                return Self {
                    shares: vec![0.0, 1.0],
                    volts: vec![battery.empty_v, battery.full_v],
                };
            }
            Chemistry::LiPo => &LIPO_V,
            Chemistry::LiFePO4 => &LIFEPO4_V,
            Chemistry::NiMH => &NIMH_V,
        };
        let (empty_v, full_v) = (cell[0], cell[cell.len() - 1]);
        let scale = (battery.full_v - battery.empty_v) / (full_v - empty_v);
        Self::over_charge(cell.iter().map(|v| battery.empty_v + scale * (v - empty_v)).collect())
    }

    /// A curve of voltages at equal steps of charge: the energy of each step is its mean voltage.
    fn over_charge(volts: Vec<f64>) -> Self {
        let energy: Vec<f64> = volts.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        let whole: f64 = energy.iter().sum();
        let mut below = 0.0;
        let mut shares = vec![0.0];
        shares.extend(energy.iter().map(|step| {
            below += step / whole;
            below.min(1.0)
        }));
        Self { shares, volts }
    }

    /// Voltage without load, V, at a share of the energy; beyond 0 and 1 that of empty and full.
    pub fn volts(&self, share: f64) -> f64 {
        broken_line(&self.shares, &self.volts, share)
    }

    /// Share of the energy that is left at a voltage without load.
    pub fn share(&self, volts: f64) -> f64 {
        broken_line(&self.volts, &self.shares, volts)
    }
}

fn broken_line(x: &[f64], y: &[f64], at: f64) -> f64 {
    let above = x.partition_point(|&x| x <= at).clamp(1, x.len() - 1);
    let fraction = ((at - x[above - 1]) / (x[above] - x[above - 1])).clamp(0.0, 1.0);
    y[above - 1] + fraction * (y[above] - y[above - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_curve_grows_and_is_its_own_inverse() {
        let table = Battery {
            open_circuit_v: vec![4.0, 4.9, 5.1, 5.6],
            ..Battery::default()
        };
        let of = |chemistry| Battery {
            chemistry,
            ..Battery::default()
        };
        for battery in [
            of(Chemistry::Linear),
            of(Chemistry::LiPo),
            of(Chemistry::LiFePO4),
            of(Chemistry::NiMH),
            table,
        ] {
            let curve = OpenCircuit::new(&battery);
            assert_eq!((curve.volts(-1.0), curve.volts(2.0)), (4.0, 5.6));
            assert!((curve.volts(0.0) - 4.0).abs() < 1e-12 && (curve.volts(1.0) - 5.6).abs() < 1e-12);
            for share in 1..100 {
                let share = f64::from(share) * 0.01;
                assert!(curve.volts(share) > curve.volts(share - 0.01));
                assert!((curve.share(curve.volts(share)) - share).abs() < 1e-9, "{battery:?}");
            }
        }
    }

    /// Two steps of equal charge at 1.5 and 2.5 V: the lower one holds three eighths of the energy.
    #[test]
    fn a_table_over_charge_becomes_one_over_energy() {
        let curve = OpenCircuit::over_charge(vec![1.0, 2.0, 3.0]);
        assert!((curve.share(2.0) - 0.375).abs() < 1e-12);
    }
}
