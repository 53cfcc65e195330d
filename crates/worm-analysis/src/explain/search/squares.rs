//! Squares of residuals by blocks of a run (the cycles of a worm), and what fraction of a gap is closed.

use std::f64::consts::SQRT_2;

/// Standard errors to either end of a 90 % interval.
pub(in crate::explain) const NINETY: f64 = 1.645;

/// Squares of each cycle of each run: neighbouring samples are not independent, cycles are nearly so.
#[derive(Debug, Clone, Default)]
pub(in crate::explain) struct Clusters(Vec<Vec<Squares>>);

impl Clusters {
    pub fn add(&mut self, run: usize, cycle: usize, squares: Squares) {
        if self.0.len() <= run {
            self.0.resize(run + 1, Vec::new());
        }
        if self.0[run].len() <= cycle {
            self.0[run].resize(cycle + 1, Squares::default());
        }
        self.0[run][cycle].add(squares);
    }

    fn each(&self) -> impl Iterator<Item = Squares> {
        self.0.iter().flatten().copied().filter(|squares| squares.count > 0.0)
    }

    pub fn total(&self) -> Squares {
        self.each().fold(Squares::default(), |mut sum, squares| {
            sum.add(squares);
            sum
        })
    }

    /// 90 % interval of the root mean square.
    pub fn interval_m(&self) -> [f64; 2] {
        let total = self.total();
        let mean_m2 = total.sum / total.count;
        let off = self
            .each()
            .map(|squares| (squares.sum - mean_m2 * squares.count).powi(2));
        let half_m2 = NINETY * off.sum::<f64>().sqrt() / total.count;
        [mean_m2 - half_m2, mean_m2 + half_m2].map(|m2| m2.max(0.0).sqrt())
    }

    /// The fraction of the squared gap between these residuals and a floor that others close, with its 90 % interval; `NaN` where the
    /// gap is within its own error, and where the interval is wider than from nothing to all on either side.
    pub fn closure(&self, closed: &Self, floor_m: f64) -> (f64, [f64; 2]) {
        let pairs: Vec<(f64, f64)> = self
            .each()
            .zip(closed.each())
            .map(|(open, left)| {
                let left_m2 = left.sum / left.count * open.count;
                (open.sum - floor_m * floor_m * open.count, open.sum - left_m2)
            })
            .collect();
        let (gap, gain) = pairs
            .iter()
            .fold((0.0, 0.0), |(gap, gain), pair| (gap + pair.0, gain + pair.1));
        let count = pairs.len() as f64;
        let spread = pairs
            .iter()
            .map(|(one, _)| (one - gap / count).powi(2))
            .sum::<f64>()
            .sqrt();
        // The floor is as uncertain as the gap.
        if gap.is_nan() || gap - NINETY * SQRT_2 * spread <= 0.0 {
            return (f64::NAN, [f64::NAN; 2]);
        }
        let closure = gain / gap;
        let off = pairs
            .iter()
            .map(|(gap, gain)| (gain - closure * gap).powi(2))
            .sum::<f64>();
        let half = NINETY * off.sqrt() / gap;
        if half > 1.0 {
            return (f64::NAN, [f64::NAN; 2]);
        }
        (closure, [closure - half, closure + half])
    }
}

/// A running mean of squares.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::explain) struct Squares {
    pub sum: f64,
    pub count: f64,
}

impl Squares {
    /// Of a run that a model cannot make.
    pub const IMPOSSIBLE: Self = Self {
        sum: f64::NAN,
        count: 1.0,
    };

    pub fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    /// `NaN` without values.
    pub fn rms(self) -> f64 {
        (self.sum / self.count).sqrt()
    }
}
