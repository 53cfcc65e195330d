//! Page's cumulative sum for "the mean has risen", with honest small-sample limits.
//!
//! Each value enters as its excess over the usual, as a share of it. The sum S ← max(0, S + excess − k) drifts down while all is
//! well and climbs after a rise; it alarms when S > h.
//!
//! - **usual**: the median of the first values, so that one outlier among them does no harm; it is refined until
//!   [`LEARNED`] values are known and then stands still, so that a slow rise is not learned away.
//! - **k** = half the shift that is worth an alarm (Page's choice for that shift), plus two standard errors of the
//!   usual: from three values it is not well known, and the chart says so by asking for more.
//! - **σ**: median absolute deviation of the first values, pooled with the stated standard error and a scatter of 2 %, which
//!   weigh as much as four values.
//! - **h** from Siegmund's approximation of the average run length (D. Siegmund, Sequential Analysis, 1985, ch. II):
//!   ARL = (exp(2Δb) − 2Δb − 1)/(2Δ²) with Δ = half the shift over σ, b = h/σ + 1.166, for one false alarm in [`RUN_LENGTH`] values.
//! - One value never alarms: an increment is cut at 0.6 h, so an outlier must be followed by a second.

/// Values from which on the usual stands still.
const LEARNED: u32 = 30;
/// Values between two false alarms, on average.
const RUN_LENGTH: f64 = 1e6;
/// Scatter that is assumed before it is known, share of the usual.
const PRIOR_SCATTER: f64 = 0.02;
/// How many values the assumed scatter weighs.
const PRIOR_WEIGHT: f64 = 4.0;
/// Largest increment, share of the decision limit.
const LARGEST_INCREMENT: f64 = 0.6;
/// The sum counts no further than this, in decision limits, so that it can fall back.
const LARGEST_SUM: f64 = 1.5;
/// Deviations are learned up to this many standard deviations.
const LEARNED_SIGMAS: f64 = 3.0;
/// Median absolute deviation to standard deviation, for normal scatter.
const MAD_TO_SIGMA: f64 = 1.4826;
/// Most values that are kept for the first median (the largest `calibration_cycles`).
const KEPT: usize = 100;

/// Where the sum stands after a value.
#[derive(Debug, Clone, Copy)]
pub(super) struct CusumLevel {
    /// Mean excess since the sum left zero, share of the usual.
    pub excess: f64,
    /// The reference k that this mean must stay below.
    pub reference: f64,
    /// The sum is beyond the decision limit.
    pub beyond: bool,
    /// The sum is back at zero.
    pub at_zero: bool,
    /// When the first value of the rise began, ns.
    pub since_ns: u64,
}

#[derive(Debug, Clone)]
pub(super) struct CusumChart {
    shift: f64,
    wanted: u32,
    first: [f64; KEPT],
    stated_sum: f64, // of the squared stated standard errors of the first values
    count: u32,
    baseline: f64,
    sigma: f64, // share of the usual
    sum: f64,
    risen_sum: f64, // of the excesses since the sum left zero
    risen_count: u32,
    since_ns: u64,
}

impl CusumChart {
    /// A chart for a rise by `shift`, a share of the usual, that calibrates on `wanted` values.
    pub(super) fn new(shift: f64, wanted: u32) -> Self {
        Self {
            shift,
            wanted: wanted.clamp(1, KEPT as u32),
            first: [0.0; KEPT],
            stated_sum: 0.0,
            count: 0,
            baseline: f64::NAN,
            sigma: f64::NAN,
            sum: 0.0,
            risen_sum: 0.0,
            risen_count: 0,
            since_ns: 0,
        }
    }

    /// Calibrated, with a usual value that is clearly positive.
    pub(super) fn is_calibrated(&self) -> bool {
        self.baseline > 0.0 && self.sigma < 1.0 / 3.0
    }

    /// Takes a value with its stated standard error and the least that is plausible as usual; tells nothing before
    /// calibration. The value began at `began_ns`.
    pub(super) fn add(
        &mut self,
        value: f64,
        stated_sigma: f64,
        min_baseline: f64,
        began_ns: u64,
    ) -> Option<CusumLevel> {
        if !value.is_finite() {
            return None;
        }
        let stated_sigma = if stated_sigma.is_finite() { stated_sigma } else { 0.0 };
        if self.count < self.wanted {
            self.first[self.count as usize] = value;
            self.stated_sum += stated_sigma * stated_sigma;
            self.count += 1;
            if self.count == self.wanted {
                self.calibrate(min_baseline);
            }
            return None;
        }
        self.is_calibrated().then(|| self.evaluate(value, began_ns))
    }

    fn calibrate(&mut self, min_baseline: f64) {
        let count = self.count as usize;
        let first = &mut self.first[..count];
        first.sort_unstable_by(f64::total_cmp);
        let median = median_of_sorted(first);
        for value in first.iter_mut() {
            *value = (*value - median).abs();
        }
        first.sort_unstable_by(f64::total_cmp);
        let scatter = MAD_TO_SIGMA * median_of_sorted(first);
        let min_baseline = if min_baseline.is_finite() { min_baseline } else { 0.0 };
        self.baseline = median.max(min_baseline);
        let stated = self.stated_sum / f64::from(self.count) / (self.baseline * self.baseline);
        let prior = PRIOR_SCATTER * PRIOR_SCATTER + stated;
        let degrees = f64::from(self.count - 1);
        let measured = (scatter / self.baseline) * (scatter / self.baseline);
        self.sigma = ((PRIOR_WEIGHT * prior + degrees * measured) / (PRIOR_WEIGHT + degrees)).sqrt();
    }

    fn reference(&self) -> f64 {
        0.5 * self.shift + 2.0 * self.sigma / f64::from(self.count).sqrt()
    }

    /// The decision limit h, share of the usual.
    fn limit(&self) -> f64 {
        let drift = 0.5 * self.shift / self.sigma;
        let mut b = 1.0;
        // b = ln(1 + 2Δ²·ARL + 2Δb)/(2Δ): the right side grows slowly in b, so this converges at once.
        for _ in 0..8 {
            b = (2.0 * drift * drift * RUN_LENGTH + 2.0 * drift * b).ln_1p() / (2.0 * drift);
        }
        // Two values with the full shift must be able to reach it, one must not.
        ((b - 1.166) * self.sigma).max(0.75 * self.shift)
    }

    fn evaluate(&mut self, value: f64, began_ns: u64) -> CusumLevel {
        let excess = value / self.baseline - 1.0;
        let (reference, limit) = (self.reference(), self.limit());
        if self.sum == 0.0 {
            self.since_ns = began_ns;
            self.risen_sum = 0.0;
            self.risen_count = 0;
        }
        self.sum = (self.sum + (excess - reference).min(LARGEST_INCREMENT * limit)).clamp(0.0, LARGEST_SUM * limit);
        self.risen_sum += excess;
        self.risen_count += 1;
        if self.sum == 0.0 && self.count < LEARNED.max(self.wanted) {
            self.learn(excess);
        }
        CusumLevel {
            excess: self.risen_sum / f64::from(self.risen_count),
            reference,
            beyond: self.sum > limit,
            at_zero: self.sum == 0.0,
            since_ns: self.since_ns,
        }
    }

    fn learn(&mut self, excess: f64) {
        self.count += 1;
        let count = f64::from(self.count);
        let max = LEARNED_SIGMAS * self.sigma;
        let off = excess.clamp(-max, max);
        self.baseline *= 1.0 + off / count;
        let weight = PRIOR_WEIGHT + count - 1.0;
        self.sigma = (self.sigma * self.sigma + (off * off - self.sigma * self.sigma) / weight).sqrt();
    }
}

fn median_of_sorted(values: &[f64]) -> f64 {
    match values.len() {
        0 => f64::NAN,
        count => 0.5 * (values[(count - 1) / 2] + values[count / 2]),
    }
}
