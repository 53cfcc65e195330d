//! The battery on board.

use super::Limits;
use super::check::Checker;
use serde::Deserialize;

/// Most voltages of an own open-circuit curve.
pub const MAX_CURVE_POINTS: usize = 32;

/// How the open-circuit voltage falls from full to empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Chemistry {
    /// In a straight line over the energy.
    Linear,
    /// Lithium cobalt or nickel manganese cobalt oxide, in pouches or round cells.
    LiPo,
    /// Lithium iron phosphate.
    LiFePO4,
    /// Nickel metal hydride.
    NiMH,
}

/// The battery on board.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Battery {
    /// Energy when full, J.
    pub capacity_j: f64,
    /// Open-circuit voltage when full, V.
    pub full_v: f64,
    /// Open-circuit voltage when empty, V.
    pub empty_v: f64,
    /// How the voltage falls between them, where there is no table.
    pub chemistry: Chemistry,
    /// Open-circuit voltages at equal steps of charge from empty to full, V; empty: the chemistry's curve.
    pub open_circuit_v: Vec<f64>,
    /// Internal resistance, ohm.
    pub internal_resistance_ohm: f64,
    /// Voltage under load at which a protection or the computer switches off, V; absent: `limits.voltage_v`.
    pub cut_off_v: Option<f64>,
    /// Power of everything but the motor, W.
    pub hotel_power_w: f64,
    /// Fraction of the charge kept in reserve beyond the way home.
    pub reserve_share: f64,
    /// File that holds the gauge's reading in per cent; absent: there is no gauge.
    pub gauge: Option<String>,
    /// Standard deviation of the capacity, as a fraction of it.
    pub capacity_sigma_share: f64,
    /// Standard deviation of the hotel power, as a fraction of it.
    pub hotel_power_sigma_share: f64,
    /// Standard deviation of the open-circuit voltages, V: the curve's, and the voltmeter's.
    pub open_circuit_sigma_v: f64,
}

impl Default for Battery {
    /// Four small NiMH cells in series.
    fn default() -> Self {
        Self {
            capacity_j: 9000.0,
            full_v: 5.6,
            empty_v: 4.0,
            chemistry: Chemistry::Linear,
            open_circuit_v: Vec::new(),
            internal_resistance_ohm: 0.2,
            cut_off_v: None,
            hotel_power_w: 0.5,
            reserve_share: 0.1,
            gauge: None,
            capacity_sigma_share: 0.05,
            hotel_power_sigma_share: 0.1,
            open_circuit_sigma_v: 0.02,
        }
    }
}

impl Battery {
    pub(super) fn check(&self, checker: &mut Checker) {
        for (key, value, range, unit) in [
            ("battery.capacity_j", self.capacity_j, 1.0..=1e7, "J"),
            ("battery.full_v", self.full_v, 1.0..=60.0, "V"),
            ("battery.empty_v", self.empty_v, 0.5..=60.0, "V"),
            (
                "battery.internal_resistance_ohm",
                self.internal_resistance_ohm,
                0.0..=10.0,
                "ohm",
            ),
            ("battery.cut_off_v", self.cut_off_v.unwrap_or(0.0), 0.0..=60.0, "V"),
            ("battery.hotel_power_w", self.hotel_power_w, 0.0..=100.0, "W"),
            ("battery.reserve_share", self.reserve_share, 0.0..=0.9, ""),
            ("battery.capacity_sigma_share", self.capacity_sigma_share, 0.0..=0.5, ""),
            (
                "battery.hotel_power_sigma_share",
                self.hotel_power_sigma_share,
                0.0..=1.0,
                "",
            ),
            (
                "battery.open_circuit_sigma_v",
                self.open_circuit_sigma_v,
                0.001..=1.0,
                "V",
            ),
        ] {
            checker.range(key, value, range, unit);
        }
        checker.require(
            self.empty_v < self.full_v,
            "battery.empty_v",
            self.empty_v,
            "must be below battery.full_v",
        );
        if let Some(cut_off_v) = self.cut_off_v {
            checker.require(
                cut_off_v < self.full_v,
                "battery.cut_off_v",
                cut_off_v,
                "must be below battery.full_v: the battery would never give anything",
            );
        }
        self.check_curve(checker);
        if let Some(gauge) = &self.gauge {
            checker.require(
                gauge.starts_with('/'),
                "battery.gauge",
                format!("{gauge:?}"),
                "must be the absolute path of a file",
            );
        }
    }

    fn check_curve(&self, checker: &mut Checker) {
        let volts = &self.open_circuit_v;
        let (Some(first), Some(last)) = (volts.first(), volts.last()) else {
            return;
        };
        let grows = volts.windows(2).all(|pair| pair[0] < pair[1]);
        checker.require(
            (2..=MAX_CURVE_POINTS).contains(&volts.len()) && grows,
            "battery.open_circuit_v",
            format!("{volts:?}"),
            format!("must be 2 to {MAX_CURVE_POINTS} voltages, each above the one before"),
        );
        checker.require(
            *first == self.empty_v && *last == self.full_v,
            "battery.open_circuit_v",
            format!("{volts:?}"),
            "must begin with battery.empty_v and end with battery.full_v",
        );
    }

    /// The voltage under load below which the worm stops, V: the battery's own, or the controller's limit.
    pub fn lowest_bus_v(&self, limits: &Limits) -> f64 {
        self.cut_off_v.unwrap_or(0.0).max(limits.voltage_v)
    }
}
