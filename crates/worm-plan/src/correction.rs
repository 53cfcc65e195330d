//! How far the worm on the way differs from the model: measured over modelled advance, and energy of the motor, per gait cycle.
//!
//! A Kalman filter of one state for each ratio: it begins at 1 with how far off a model usually is, wanders a little with every cycle, and
//! may be another one on another leg, because a model that is wrong on one slope is wrong differently on the next. The way home begins
//! with what the way out has shown, and with what that does not tell about it.

use super::itinerary::Heading;
use worm_estimator::estimate::range::{MODEL_ADVANCE_SIGMA, MODEL_ENERGY_SIGMA, MODEL_LEG_SIGMA};

/// How much a ratio wanders in one cycle.
const WANDER: f64 = 0.002;
/// How much it may change from one leg to the next.
pub(super) const LEG_SIGMA: f64 = MODEL_LEG_SIGMA;
/// What the way out does not tell about the way home: other slopes, and the other direction.
pub(super) const TRANSFER_SIGMA: f64 = 0.08;
/// The guess of the scatter from cycle to cycle …
const SCATTER: f64 = 0.03;
/// … counts as so many values.
const SCATTER_VALUES: f64 = 4.0;
/// The scatter is a mean over at most so many values.
const SCATTER_MEMORY: f64 = 50.0;
/// Least ratio: of a worm that hardly gets ahead, no finite way home follows.
const LEAST: f64 = 0.02;

/// A ratio of measurement to model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ratio {
    mean: f64,
    variance: f64,
    scatter_variance: f64,
    scatter_values: f64,
}

impl Ratio {
    fn new(mean: f64, sigma: f64) -> Self {
        Self {
            mean,
            variance: sigma * sigma,
            scatter_variance: SCATTER * SCATTER,
            scatter_values: SCATTER_VALUES,
        }
    }

    fn add(&mut self, value: f64, sigma: f64) {
        self.variance += WANDER * WANDER;
        let noise = self.scatter_variance + sigma * sigma;
        let innovation = value - self.mean;
        let expected = self.variance + noise;
        let gain = self.variance / expected;
        let scatter = innovation * innovation * self.scatter_variance / expected;
        self.scatter_values = (self.scatter_values + 1.0).min(SCATTER_MEMORY);
        self.scatter_variance += (scatter - self.scatter_variance) / self.scatter_values;
        self.mean = (self.mean + gain * innovation).max(LEAST);
        self.variance *= 1.0 - gain;
    }

    /// It is this, whatever was thought before. What is inferred has weighed all cycles already: taken like single measurements, it would seem
    /// surer with each.
    fn know(&mut self, mean: f64, sigma: f64) {
        (self.mean, self.variance) = (mean.max(LEAST), sigma * sigma);
    }

    fn widened(self, sigma: f64) -> Self {
        Self {
            variance: self.variance + sigma * sigma,
            ..self
        }
    }

    /// Best estimate.
    pub(super) const fn mean(&self) -> f64 {
        self.mean
    }

    /// Standard error.
    pub(super) fn sigma(&self) -> f64 {
        self.variance.sqrt()
    }

    /// Standard deviation from cycle to cycle.
    pub(super) fn scatter(&self) -> f64 {
        self.scatter_variance.sqrt()
    }
}

/// Both ratios of one way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ratios {
    pub(super) advance: Ratio,
    pub(super) energy: Ratio,
    leg: Option<usize>,
}

impl Ratios {
    fn prior() -> Self {
        Self {
            advance: Ratio::new(1.0, MODEL_ADVANCE_SIGMA),
            energy: Ratio::new(1.0, MODEL_ENERGY_SIGMA),
            leg: None,
        }
    }

    fn widened(self, sigma: f64) -> Self {
        Self {
            advance: self.advance.widened(sigma),
            energy: self.energy.widened(sigma),
            leg: None,
        }
    }
}

/// What the cycles so far say of both ways.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction {
    out: Option<Ratios>,
    home: Option<Ratios>,
}

/// A cycle over what the model says of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    /// Advance; none where it is not known.
    pub(super) advance: Option<Advance>,
    /// Energy of the motor, and its standard error; none where it is not known.
    pub(super) energy: Option<(f64, f64)>,
}

/// An advance over the model's, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Advance {
    /// Of this cycle, by positions.
    Measured(f64, f64),
    /// Of the cycles of late, by the motor's current.
    Inferred(f64, f64),
}

impl Correction {
    /// Nothing was measured yet.
    pub(super) const fn new() -> Self {
        Self { out: None, home: None }
    }

    /// Takes a cycle on a leg.
    pub(super) fn add(&mut self, heading: Heading, leg: usize, measured: &Measured) {
        let mut ratios = self.of(heading);
        if ratios.leg.is_some_and(|last| last != leg) {
            ratios = ratios.widened(LEG_SIGMA);
        }
        ratios.leg = Some(leg);
        match measured.advance {
            Some(Advance::Measured(value, sigma)) => ratios.advance.add(value, sigma),
            Some(Advance::Inferred(value, sigma)) => ratios.advance.know(value, sigma),
            None => {}
        }
        if let Some((value, sigma)) = measured.energy {
            ratios.energy.add(value, sigma);
        }
        *match heading {
            Heading::Out => &mut self.out,
            Heading::Home => &mut self.home,
        } = Some(ratios);
    }

    /// The ratios of a way.
    pub(super) fn of(&self, heading: Heading) -> Ratios {
        let (own, other) = match heading {
            Heading::Out => (self.out, self.home),
            Heading::Home => (self.home, self.out),
        };
        let by_other = || other.map(|ratios| ratios.widened(TRANSFER_SIGMA));
        own.or_else(by_other).unwrap_or_else(Ratios::prior)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_home_begins_with_what_the_way_out_has_shown() {
        let mut correction = Correction::new();
        let prior = correction.of(Heading::Home);
        assert_eq!(
            (prior.advance.mean(), prior.advance.sigma()),
            (1.0, MODEL_ADVANCE_SIGMA)
        );
        let measured = Measured {
            advance: Some(Advance::Measured(0.9, 0.005)),
            energy: Some((1.3, 0.01)),
        };
        (0..20).for_each(|_| correction.add(Heading::Out, 0, &measured));
        let (out, home) = (correction.of(Heading::Out), correction.of(Heading::Home));
        assert!(
            (out.advance.mean() - 0.9).abs() < 0.01 && out.advance.sigma() < 0.02,
            "{out:?}"
        );
        assert!((out.energy.mean() - 1.3).abs() < 0.02);
        assert!((home.advance.mean() - 0.9).abs() < 0.01 && home.advance.sigma() >= TRANSFER_SIGMA);
        // Another leg is less certain, and the first cycle there counts for more.
        correction.add(Heading::Out, 1, &measured);
        let next = correction.of(Heading::Out);
        assert!(next.advance.sigma() > out.advance.sigma());
        (0..10).for_each(|_| {
            correction.add(
                Heading::Home,
                1,
                &Measured {
                    advance: Some(Advance::Measured(1.0, 0.005)),
                    energy: None,
                },
            )
        });
        let home = correction.of(Heading::Home);
        assert!(
            (home.advance.mean() - 1.0).abs() < 0.02 && home.advance.sigma() < 0.03,
            "{home:?}"
        );
        assert!((home.energy.mean() - 1.3).abs() < 0.02);
    }
}
