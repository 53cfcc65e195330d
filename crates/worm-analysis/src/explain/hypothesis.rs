//! A hypothesis about the worm: which effects act on it, and which quantities are free.

use super::parameter::{Free, Hypothesised, What};
use crate::least_squares::Quantity;
use worm_physics::effect::Setting;

/// Nuisances and effects, and which quantities are free.
#[derive(Debug, Clone, Default)]
pub(super) struct Hypothesis {
    pub hypothesised: Vec<Hypothesised>,
    pub free: Vec<Free>,
    /// Every cycle is simulated, even where the crawl is periodic.
    pub throughout: bool,
}

impl Hypothesis {
    /// Nuisances and effects.
    pub fn new(nuisances: &[Free], hypothesised: &[Hypothesised]) -> Self {
        let mut free = nuisances.to_vec();
        for (place, hypothesised) in hypothesised.iter().enumerate() {
            let parameters = hypothesised.effect.parameters.iter().enumerate();
            free.extend(parameters.map(|(number, parameter)| Free::of_effect(place, number, parameter)));
        }
        Self {
            hypothesised: hypothesised.to_vec(),
            free,
            throughout: false,
        }
    }

    /// The nominal values: every nuisance at its centre, every effect neutral.
    pub fn neutral(&self) -> Vec<f64> {
        self.free.iter().map(|free| free.quantity.centre).collect()
    }

    /// Priors and limits of all free quantities.
    pub fn quantities(&self) -> Vec<Quantity> {
        self.free.iter().map(|free| free.quantity).collect()
    }

    /// The effects with these values.
    pub fn settings(&self, at: &[f64]) -> Vec<Setting> {
        let mut values: Vec<Vec<f64>> = self
            .hypothesised
            .iter()
            .map(|hypothesised| vec![0.0; hypothesised.effect.parameters.len()])
            .collect();
        for (free, &value) in self.free.iter().zip(at) {
            if let What::Effect { place, parameter } = free.what {
                values[place][parameter] = value;
            }
        }
        self.hypothesised
            .iter()
            .zip(values)
            .map(|(hypothesised, values)| Setting::within(hypothesised.effect, hypothesised.cell, &values))
            .collect()
    }
}
