//! Distance by dead reckoning, with an error that grows, and corrected by marks.
//!
//! State: the position, and the bias of the inferred advance per cycle. The bias is the same in every cycle, so its error grows in
//! proportion to the distance; what scatters from cycle to cycle adds up as a random walk. A mark (a known place, or a tracker sample)
//! corrects both by Kalman's equations: after two marks the bias is known as well as they allow.

/// A known position of the worm's mean cell along the canal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Where it is, m.
    pub position_m: f64,
    /// Standard deviation of that, m.
    pub sigma_m: f64,
}

/// Position and standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reckoned {
    /// Position of the mean of the cells along the canal since the beginning, m.
    pub position_m: f64,
    /// Its standard error, m.
    pub sigma_m: f64,
}

/// The dead reckoning.
#[derive(Debug, Clone)]
pub struct DeadReckoning {
    position_m: f64,
    bias_m: f64, // of the advance per cycle
    position_variance: f64,
    covariance: f64,
    bias_variance: f64,
    fit_variance: f64,     // of the advance per cycle, by the fit
    mark_information: f64, // on the bias, by marks
}

impl DeadReckoning {
    /// At position 0, where an advance per cycle has this standard error, m.
    pub fn new(advance_sigma_m: f64) -> Self {
        let variance = advance_sigma_m * advance_sigma_m;
        Self {
            position_m: 0.0,
            bias_m: 0.0,
            position_variance: 0.0,
            covariance: 0.0,
            bias_variance: variance,
            fit_variance: variance,
            mark_information: 0.0,
        }
    }

    /// The advance per cycle is known better now, or less well.
    pub fn set_advance_sigma(&mut self, advance_sigma_m: f64) {
        self.fit_variance = (advance_sigma_m * advance_sigma_m).max(1e-16);
        let variance = 1.0 / (1.0 / self.fit_variance + self.mark_information);
        if self.bias_variance > 0.0 {
            self.covariance *= (variance / self.bias_variance).sqrt();
        }
        self.bias_variance = variance;
    }

    /// The cam turned by `turned` cycles, in which the worm advances by `advance_m` a cycle, with `scatter_m` from cycle to cycle.
    pub fn turn(&mut self, turned: f64, advance_m: f64, scatter_m: f64) {
        self.position_m += turned * (advance_m + self.bias_m);
        self.position_variance +=
            turned * (2.0 * self.covariance + turned * self.bias_variance) + turned.abs() * scatter_m * scatter_m;
        self.covariance += turned * self.bias_variance;
    }

    /// Corrects by a mark.
    pub fn mark(&mut self, mark: &Mark) {
        let innovation_m = mark.position_m - self.position_m;
        let variance = self.position_variance + mark.sigma_m * mark.sigma_m;
        if variance <= 0.0 || !innovation_m.is_finite() {
            return;
        }
        let (gain, bias_gain) = (self.position_variance / variance, self.covariance / variance);
        self.position_m += gain * innovation_m;
        self.bias_m += bias_gain * innovation_m;
        self.bias_variance = (self.bias_variance - bias_gain * self.covariance).max(1e-16);
        self.covariance *= 1.0 - gain;
        self.position_variance *= 1.0 - gain;
        self.mark_information = (1.0 / self.bias_variance - 1.0 / self.fit_variance).max(0.0);
    }

    /// Where the worm is.
    pub fn reckoned(&self) -> Reckoned {
        Reckoned {
            position_m: self.position_m,
            sigma_m: self.position_variance.max(0.0).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bias_grows_with_the_distance_and_a_mark_corrects_it() {
        let mut reckoning = DeadReckoning::new(1e-4);
        for _ in 0..100 {
            reckoning.turn(1.0, 5e-3, 0.0);
        }
        let before = reckoning.reckoned();
        assert!((before.position_m - 0.5).abs() < 1e-12 && (before.sigma_m - 0.01).abs() < 1e-12);
        // The worm really made 4.9 mm a cycle.
        reckoning.mark(&Mark { position_m: 0.49, sigma_m: 1e-4 });
        let after = reckoning.reckoned();
        assert!((after.position_m - 0.49).abs() < 1e-5 && after.sigma_m < 1.1e-4);
        for _ in 0..100 {
            reckoning.turn(1.0, 5e-3, 0.0);
        }
        let end = reckoning.reckoned();
        assert!((end.position_m - 0.98).abs() < 2e-5, "{end:?}");
        assert!(end.sigma_m < 3e-4, "{end:?}");
    }

    #[test]
    fn there_and_back_the_bias_cancels_and_the_scatter_does_not() {
        let mut reckoning = DeadReckoning::new(1e-4);
        for turned in [1.0; 50].into_iter().chain([-1.0; 50]) {
            reckoning.turn(turned, 5e-3, 2e-5);
        }
        let end = reckoning.reckoned();
        assert!(end.position_m.abs() < 1e-12 && (end.sigma_m - 2e-4).abs() < 1e-6, "{end:?}");
    }
}
