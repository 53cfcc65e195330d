//! Distance by dead reckoning, with an error that grows, and corrected by marks.
//!
//! State: the position, and the bias of the inferred advance per cycle. The bias is the same in every cycle, so its error grows in
//! proportion to the distance; what scatters from cycle to cycle adds up as a random walk. A mark (a known place, or a tracker sample)
//! corrects both by Kalman's equations: after two marks the bias is known as well as they allow. An advance that becomes better known
//! corrects what was reckoned with the worse one. A mark that is further off than any error of the advance explains is believed, but
//! nothing is learned of the advance from it: the worm has slid as a whole, was carried, or counts from elsewhere.

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

/// How far a mark was off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkOff {
    /// How far it was ahead of the dead reckoning, m.
    pub ahead_m: f64,
    /// Standard error of that by both, m.
    pub sigma_m: f64,
}

impl MarkOff {
    /// The distance in standard errors.
    pub fn sigmas(&self) -> f64 {
        (self.ahead_m / self.sigma_m).abs()
    }
}

/// Least variance of an advance, m²: below it nothing is known.
const MIN_VARIANCE_M2: f64 = 1e-16;
/// Standard errors of the difference from which on a mark says nothing of the advance.
const FAR_SIGMAS: f64 = 4.0;

/// The dead reckoning.
#[derive(Debug, Clone)]
pub struct DeadReckoning {
    advance_m: f64, // of a forward cycle, by the fit
    position_m: f64,
    bias_m: f64, // of the advance per cycle
    position_variance: f64,
    covariance: f64,
    bias_variance: f64,
    fit_variance: f64,     // of the advance per cycle, by the fit
    mark_information: f64, // on the bias, by marks
}

impl DeadReckoning {
    /// At position 0, where the worm advances by so much a cycle, m, with this standard error.
    pub fn new(advance_m: f64, advance_sigma_m: f64) -> Self {
        let variance = (advance_sigma_m * advance_sigma_m).max(MIN_VARIANCE_M2);
        Self {
            advance_m,
            position_m: 0.0,
            bias_m: 0.0,
            position_variance: 0.0,
            covariance: 0.0,
            bias_variance: variance,
            fit_variance: variance,
            mark_information: 0.0,
        }
    }

    /// The advance of a forward cycle is better known now, m.
    pub fn know_advance(&mut self, advance_m: f64, advance_sigma_m: f64) {
        let change_m = advance_m - self.advance_m;
        self.advance_m = advance_m;
        self.fit_variance = (advance_sigma_m * advance_sigma_m).max(MIN_VARIANCE_M2);
        let information = 1.0 / self.fit_variance + self.mark_information;
        // What marks taught about the sum of advance and bias stays, whatever the fit says of the advance.
        let by_marks = self.mark_information / information;
        self.bias_m -= by_marks * change_m;
        let gain = self.covariance / self.bias_variance;
        self.position_m += gain * (1.0 - by_marks) * change_m;
        let variance = 1.0 / information;
        self.position_variance = (self.position_variance - gain * gain * (self.bias_variance - variance)).max(0.0);
        self.covariance = gain * variance;
        self.bias_variance = variance;
    }

    /// The worm is another from now on: what is learned of its advance does not correct what is behind.
    pub fn begin_anew(&mut self) {
        self.covariance = 0.0;
        (self.bias_m, self.mark_information) = (0.0, 0.0);
        self.bias_variance = self.fit_variance;
    }

    /// The cam turned by `turned` cycles; one backward takes the worm back by `backward_m`. `scatter_m` is from cycle to cycle.
    pub fn turn(&mut self, turned: f64, backward_m: f64, scatter_m: f64) {
        let advance_m = if turned > 0.0 { self.advance_m } else { backward_m };
        self.position_m += turned * (advance_m + self.bias_m);
        self.position_variance +=
            turned * (2.0 * self.covariance + turned * self.bias_variance) + turned.abs() * scatter_m * scatter_m;
        self.covariance += turned * self.bias_variance;
    }

    /// Corrects by a mark. Returns how far it was off.
    pub fn mark(&mut self, mark: &Mark) -> MarkOff {
        let innovation_m = mark.position_m - self.position_m;
        let variance = self.position_variance + mark.sigma_m * mark.sigma_m;
        let off = MarkOff {
            ahead_m: innovation_m,
            sigma_m: variance.max(0.0).sqrt(),
        };
        if variance <= 0.0 || !innovation_m.is_finite() {
            return off;
        }
        if off.sigmas() > FAR_SIGMAS {
            self.place(mark);
            return off;
        }
        let (gain, bias_gain) = (self.position_variance / variance, self.covariance / variance);
        self.position_m += gain * innovation_m;
        self.bias_m += bias_gain * innovation_m;
        self.bias_variance = (self.bias_variance - bias_gain * self.covariance).max(MIN_VARIANCE_M2);
        self.covariance *= 1.0 - gain;
        self.position_variance *= 1.0 - gain;
        self.mark_information = (1.0 / self.bias_variance - 1.0 / self.fit_variance).max(0.0);
        off
    }

    /// The worm is here, whatever was reckoned before.
    pub fn place(&mut self, mark: &Mark) {
        self.position_m = mark.position_m;
        self.position_variance = mark.sigma_m * mark.sigma_m;
        self.covariance = 0.0;
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

    fn crawled(cycles: u32) -> DeadReckoning {
        let mut reckoning = DeadReckoning::new(5e-3, 1e-4);
        (0..cycles).for_each(|_| reckoning.turn(1.0, 5e-3, 0.0));
        reckoning
    }

    #[test]
    fn a_bias_grows_with_the_distance_and_a_mark_corrects_it() {
        let mut reckoning = crawled(100);
        let before = reckoning.reckoned();
        assert!((before.position_m - 0.5).abs() < 1e-12 && (before.sigma_m - 0.01).abs() < 1e-12);
        // The worm really made 4.9 mm a cycle.
        reckoning.mark(&Mark {
            position_m: 0.49,
            sigma_m: 1e-4,
        });
        let after = reckoning.reckoned();
        assert!((after.position_m - 0.49).abs() < 1e-5 && after.sigma_m < 1.1e-4);
        for _ in 0..100 {
            reckoning.turn(1.0, 5e-3, 0.0);
            // The fit, which is surer by far than it should be, does not overrule the mark.
            reckoning.know_advance(5e-3, 1e-4);
        }
        let end = reckoning.reckoned();
        assert!((end.position_m - 0.98).abs() < 2e-5 && end.sigma_m < 3e-4, "{end:?}");
    }

    #[test]
    fn marks_that_contradict_each_other_are_known_by_their_distance() {
        let mut reckoning = crawled(100);
        let mark = |position_m| Mark {
            position_m,
            sigma_m: 0.01,
        };
        let first = reckoning.mark(&mark(0.5));
        assert!(
            first.sigmas() < 0.1 && (first.sigma_m - 0.01 * 2f64.sqrt()).abs() < 1e-12,
            "{first:?}"
        );
        // A second one at the same place that says something else: √(0.01²/2 + 0.01²) m is the error of both.
        let second = reckoning.mark(&mark(0.54));
        assert!(
            (second.ahead_m - 0.04).abs() < 1e-3 && (second.sigmas() - 3.27).abs() < 0.05,
            "{second:?}"
        );
        assert!(reckoning.reckoned().position_m < 0.52, "the place is between them");
        // One that is beyond any error is believed.
        assert!(reckoning.mark(&mark(0.7)).sigmas() > FAR_SIGMAS);
        assert!((reckoning.reckoned().position_m - 0.7).abs() < 1e-12);
    }

    #[test]
    fn there_and_back_the_bias_cancels_and_the_scatter_does_not() {
        let mut reckoning = DeadReckoning::new(5e-3, 1e-4);
        for turned in [1.0; 50].into_iter().chain([-1.0; 50]) {
            reckoning.turn(turned, 5e-3, 2e-5);
        }
        let end = reckoning.reckoned();
        assert!(
            end.position_m.abs() < 1e-12 && (end.sigma_m - 2e-4).abs() < 1e-6,
            "{end:?}"
        );
    }

    #[test]
    fn a_better_advance_corrects_what_is_behind_unless_the_worm_is_another() {
        let mut reckoning = crawled(10);
        reckoning.know_advance(4.8e-3, 1e-5);
        let end = reckoning.reckoned();
        assert!(
            (end.position_m - 0.048).abs() < 1e-9 && (end.sigma_m - 1e-4).abs() < 1e-9,
            "{end:?}"
        );
        let mut reckoning = crawled(10);
        reckoning.begin_anew();
        reckoning.know_advance(4.8e-3, 1e-5);
        let end = reckoning.reckoned();
        assert!(
            (end.position_m - 0.05).abs() < 1e-9 && (end.sigma_m - 1e-3).abs() < 1e-9,
            "{end:?}"
        );
    }
}
