//! How much is left in the battery.
//!
//! # State and noise
//! What is left is s = s₀ − c q/C: s₀ the share at the start, q the energy counted since then, C the configured capacity. The factor c
//! covers that the battery holds more or less than C, and that the hotel power is another than configured; both stay as they are while the
//! worm crawls. So (s₀, c) is all that is not known, it does not change, and its probability lives on a fixed grid: s₀ is at first
//! anywhere between empty and full, c near 1 with the configured standard deviations.
//!
//! A voltage reading is the mean over a gait cycle of bus voltage + current × internal resistance. It differs from the curve by
//! - an error that all readings share: that of the curve and of the voltmeter, and a quarter of the drop over the internal resistance, which
//!   nobody knows better. It is integrated out, so a thousand readings are no better than it allows;
//! - the servo's rounding to 0.1 V. It stays the same until the voltage has moved, so a reading counts in full only once for each per cent of
//!   the battery, and the first one at once.
//!
//! The curve's error is in truth not the same everywhere. Old readings are therefore forgotten slowly.

use super::OpenCircuit;
use crate::config::Battery;

/// Places of s₀, from empty to full.
const STARTS: usize = 128;
/// Places of c, over this many standard deviations to either side.
const FACTORS: usize = 13;
const FACTOR_SIGMAS: f64 = 3.0;
/// Least standard deviation of c, so that its places differ.
const MIN_FACTOR_SIGMA: f64 = 1e-3;
/// Standard deviation of a voltage read in steps of 0.1 V, V.
const ROUNDING_SIGMA_V: f64 = 0.03;
/// Error of the internal resistance, as a fraction.
const RESISTANCE_SIGMA_FRACTION: f64 = 0.25;
/// Share of the battery after which a reading counts in full again.
const FULL_READING_SHARE: f64 = 0.01;
/// Sum of weights beyond which old readings are forgotten.
const MEMORY: f64 = 20.0;
/// Places of a distribution's histogram.
const PLACES: usize = 256;

/// A quantity with its 90 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// It is below this with a probability of 5 %.
    pub low: f64,
    /// It is above this with a probability of 5 %.
    pub high: f64,
}

/// A pair of s₀ and c, and how well it fits what was read.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    start: f64,
    factor: f64,
    log_prior: f64,
    residual_v: f64,         // sum of weight × (reading − curve)
    squared_residual_v: f64, // sum of weight × its square
    gauge_log_likelihood: f64,
}

/// What is known of the charge. Fixed size after construction.
#[derive(Debug, Clone)]
pub struct ChargeEstimate {
    curve: OpenCircuit,
    capacity_j: f64,
    resistance_ohm: f64,
    curve_sigma_v: f64,
    candidates: Vec<Candidate>,
    weights: Vec<f64>, // of the candidates; sum 1
    is_read: bool,
    drawn_j: f64,          // counted since the first reading
    drawn_at_reading: f64, // at the last reading
    drawn_at_gauge: Option<f64>,
    reading_weight: f64,
    drop_v: f64, // mean drop over the internal resistance, with the readings' weights
}

impl ChargeEstimate {
    /// Nothing is known yet but the configured battery. `factor_sigma` is the standard deviation of c.
    pub fn new(battery: &Battery, factor_sigma: f64) -> Self {
        let factor_sigma = factor_sigma.max(MIN_FACTOR_SIGMA);
        let half = (FACTORS / 2) as f64;
        let candidates: Vec<Candidate> = (0..STARTS * FACTORS)
            .map(|index| {
                let sigmas = FACTOR_SIGMAS * ((index % FACTORS) as f64 / half - 1.0);
                Candidate {
                    start: ((index / FACTORS) as f64 + 0.5) / STARTS as f64,
                    factor: (factor_sigma * sigmas).exp(),
                    log_prior: -0.5 * sigmas * sigmas,
                    residual_v: 0.0,
                    squared_residual_v: 0.0,
                    gauge_log_likelihood: 0.0,
                }
            })
            .collect();
        let mut estimate = Self {
            curve: OpenCircuit::new(battery),
            capacity_j: battery.capacity_j,
            resistance_ohm: battery.internal_resistance_ohm,
            curve_sigma_v: battery.open_circuit_sigma_v,
            weights: vec![0.0; candidates.len()],
            candidates,
            is_read: false,
            drawn_j: 0.0,
            drawn_at_reading: 0.0,
            drawn_at_gauge: None,
            reading_weight: 0.0,
            drop_v: 0.0,
        };
        estimate.weigh();
        estimate
    }

    /// Whether a voltage or a gauge was read.
    pub fn is_known(&self) -> bool {
        self.is_read || self.drawn_at_gauge.is_some()
    }

    /// Counts energy out of the battery, the loss in its internal resistance included, J.
    pub fn draw(&mut self, energy_j: f64) {
        self.drawn_j += energy_j;
    }

    /// Takes a reading: the mean bus voltage over a while, V, and the mean current out of the battery, A.
    pub fn read(&mut self, bus_v: f64, current_a: f64) {
        let spent = (self.drawn_j - self.drawn_at_reading) / self.capacity_j;
        let weight = if self.is_read {
            (spent / FULL_READING_SHARE).clamp(0.0, 1.0)
        } else {
            1.0
        };
        self.is_read = true;
        self.drawn_at_reading = self.drawn_j;
        let keep = (MEMORY / (self.reading_weight + weight)).min(1.0);
        let open_v = bus_v + current_a * self.resistance_ohm;
        for at in 0..self.candidates.len() {
            let residual_v = open_v - self.curve.volts(self.share_of(at));
            let candidate = &mut self.candidates[at];
            candidate.residual_v = keep * (candidate.residual_v + weight * residual_v);
            candidate.squared_residual_v = keep * (candidate.squared_residual_v + weight * residual_v * residual_v);
        }
        self.reading_weight += weight;
        let drop_v = current_a * self.resistance_ohm;
        self.drop_v += weight / self.reading_weight * (drop_v - self.drop_v);
        self.reading_weight *= keep;
        self.weigh();
    }

    /// Takes a gauge's reading: the share that is left, and its standard deviation.
    pub fn read_gauge(&mut self, share: f64, sigma: f64) {
        let weight = self.drawn_at_gauge.map_or(1.0, |drawn_j| {
            ((self.drawn_j - drawn_j) / self.capacity_j / FULL_READING_SHARE).clamp(0.0, 1.0)
        });
        self.drawn_at_gauge = Some(self.drawn_j);
        for at in 0..self.candidates.len() {
            let sigmas = (share - self.share_of(at)) / sigma;
            self.candidates[at].gauge_log_likelihood -= 0.5 * weight * sigmas * sigmas;
        }
        self.weigh();
    }

    /// Share of the energy that is left, and its standard error.
    pub fn share(&self) -> (f64, f64) {
        let shares = || self.weights.iter().enumerate().map(|(at, w)| (w, self.share_of(at)));
        let mean: f64 = shares().map(|(weight, share)| weight * share).sum();
        let variance: f64 = shares().map(|(weight, share)| weight * (share - mean).powi(2)).sum();
        (mean, variance.sqrt())
    }

    /// Energy left above a share of the battery, J, counted as the consumers are counted: in joules of the configured hotel power.
    pub fn left_above_j(&self, share: f64) -> Spread {
        let left = |at: usize| {
            let left_j = (self.share_of(at) - share) * self.capacity_j;
            (left_j / self.candidates[at].factor).max(0.0)
        };
        let most = (0..self.candidates.len()).map(left).fold(0.0, f64::max);
        let mut histogram = [0.0; PLACES];
        let mut mean = 0.0;
        for (at, weight) in self.weights.iter().enumerate() {
            mean += weight * left(at);
            let place = (left(at) / most.max(f64::MIN_POSITIVE) * PLACES as f64) as usize;
            histogram[place.min(PLACES - 1)] += weight;
        }
        let quantile = |probability: f64| {
            let mut below = 0.0;
            for (place, weight) in histogram.iter().enumerate() {
                if below + weight >= probability {
                    let within = (probability - below) / weight;
                    return (place as f64 + within) / PLACES as f64 * most;
                }
                below += weight;
            }
            most
        };
        Spread {
            mean,
            low: quantile(0.05),
            high: quantile(0.95),
        }
    }

    /// Voltage without load at a share, V.
    pub fn curve(&self) -> &OpenCircuit {
        &self.curve
    }

    fn share_of(&self, at: usize) -> f64 {
        let candidate = &self.candidates[at];
        (candidate.start - candidate.factor * self.drawn_j / self.capacity_j).max(0.0)
    }

    /// Weighs the candidates by prior and readings, with the common error integrated out.
    fn weigh(&mut self) {
        let rounding = ROUNDING_SIGMA_V * ROUNDING_SIGMA_V;
        let common = self.curve_sigma_v.powi(2) + (RESISTANCE_SIGMA_FRACTION * self.drop_v).powi(2);
        let shrink = common / (rounding * (rounding + common * self.reading_weight));
        let mut best = f64::NEG_INFINITY;
        for (candidate, weight) in self.candidates.iter().zip(&mut self.weights) {
            let misfit = candidate.squared_residual_v / rounding - shrink * candidate.residual_v.powi(2);
            *weight = candidate.log_prior + candidate.gauge_log_likelihood - 0.5 * misfit;
            best = best.max(*weight);
        }
        let mut sum = 0.0;
        for weight in &mut self.weights {
            *weight = (*weight - best).exp();
            sum += *weight;
        }
        self.weights.iter_mut().for_each(|weight| *weight /= sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Chemistry;

    fn lipo() -> Battery {
        Battery {
            full_v: 4.2,
            empty_v: 3.27,
            chemistry: Chemistry::LiPo,
            ..Battery::default()
        }
    }

    #[test]
    fn nothing_is_known_before_the_first_reading_and_little_on_a_plateau() {
        let battery = lipo();
        let mut charge = ChargeEstimate::new(&battery, 0.05);
        let (share, sigma) = charge.share();
        assert!(!charge.is_known() && (share - 0.5).abs() < 1e-9 && (sigma - 12f64.sqrt().recip()).abs() < 1e-3);
        charge.read(4.15, 0.0);
        let (full, sigma_full) = charge.share();
        assert!(full > 0.9 && sigma_full < 0.05, "{full} ± {sigma_full}");
        let mut charge = ChargeEstimate::new(&battery, 0.05);
        charge.read(3.80, 0.0);
        let (middle, sigma_middle) = charge.share();
        assert!(
            (middle - 0.4).abs() < 0.08 && sigma_middle > 1.5 * sigma_full,
            "{middle} ± {sigma_middle}"
        );
        charge.read_gauge(0.45, 0.02);
        let (gauged, sigma_gauged) = charge.share();
        assert!((gauged - 0.45).abs() < 0.02 && sigma_gauged < 0.021);
    }

    /// Many readings at rest are worth hardly more than one: they share their error.
    #[test]
    fn patience_does_not_make_a_voltmeter_better() {
        let mut charge = ChargeEstimate::new(&lipo(), 0.05);
        charge.read(3.95, 0.0);
        let once = charge.share().1;
        (0..1000).for_each(|_| charge.read(3.95, 0.0));
        assert_eq!(charge.share().1, once);
    }

    /// A battery that holds a tenth less than it should is found out by its voltage while it empties.
    #[test]
    fn a_weak_battery_shows_while_it_empties() {
        let battery = Battery::default();
        let curve = OpenCircuit::new(&battery);
        let mut charge = ChargeEstimate::new(&battery, 0.1);
        for step in 0..=80 {
            let drawn = f64::from(step) * 0.01;
            charge.read(curve.volts(1.0 - drawn / 0.9), 0.0);
            charge.draw(0.01 * battery.capacity_j);
        }
        let left = charge.left_above_j(0.0);
        let truth_j = (0.9 - 0.81) * battery.capacity_j;
        assert!(left.low < truth_j && truth_j < left.high, "{left:?} {truth_j}");
        assert!(
            left.high < 0.14 * battery.capacity_j,
            "counting alone would say 0.19: {left:?}"
        );
    }
}
