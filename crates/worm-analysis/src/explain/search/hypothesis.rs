//! A hypothesis about a plant: which effects act on it, and which quantities are free.

use super::law::shape::LawShape;
use super::parameter::{Free, Hypothesised, What};
use crate::least_squares::Quantity;
use std::sync::Arc;
use worm_physics::effect::Setting;

/// Nuisances and effects, and which quantities are free.
#[derive(Debug, Clone, Default)]
pub(in crate::explain) struct Hypothesis {
    pub hypothesised: Vec<Hypothesised>,
    pub free: Vec<Free>,
    /// A law that no effect describes, beside the effects.
    pub law: Option<Arc<LawShape>>,
    /// All of a run is predicted, even where it repeats.
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
            law: None,
            throughout: false,
        }
    }

    /// The nominal values: every nuisance at its centre, every effect neutral.
    pub fn neutral(&self) -> Vec<f64> {
        self.free.iter().map(|free| free.quantity.centre).collect()
    }

    /// The place of a quantity among the free ones.
    pub fn place_of(&self, what: What) -> Option<usize> {
        self.free.iter().position(|free| free.what == what)
    }

    /// Priors and limits of all free quantities.
    pub fn quantities(&self) -> Vec<Quantity> {
        self.free.iter().map(|free| free.quantity).collect()
    }

    /// The effects with these values.
    pub fn settings(&self, at: &[f64]) -> Vec<Setting> {
        self.settings_of(at, |_| true)
    }

    /// The effects that act so many cycles after the start of a run.
    pub fn settings_at(&self, run: usize, cycle: f64, at: &[f64]) -> Vec<Setting> {
        self.settings_of(at, |one| one.onset.is_none_or(|onset| onset.acts_at(run, cycle)))
    }

    fn settings_of(&self, at: &[f64], acts: impl Fn(&Hypothesised) -> bool) -> Vec<Setting> {
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
        let effects = self.hypothesised.iter().zip(values);
        let acting = effects.filter(|(hypothesised, _)| acts(hypothesised));
        let law = self
            .law
            .iter()
            .filter_map(|law| law.setting(&self.law_coefficients(at)));
        acting
            .map(|(hypothesised, values)| Setting::within(hypothesised.effect, hypothesised.cell, &values))
            .chain(law)
            .collect()
    }

    /// The coefficients of the law.
    pub fn law_coefficients(&self, at: &[f64]) -> Vec<f64> {
        let with_value = self.free.iter().zip(at);
        let of_law = with_value.filter(|(free, _)| matches!(free.what, What::Law(_)));
        of_law.map(|(_, &value)| value).collect()
    }

    /// Where effects of a run begin or end after its start, cycles since then, in this order.
    pub fn changes_at(&self, run: usize) -> Vec<f64> {
        let onsets = self.hypothesised.iter().filter_map(|one| one.onset);
        let of_run = onsets.filter(|onset| onset.is_in(run));
        let mut all: Vec<f64> = of_run
            .flat_map(|onset| onset.begins.into_iter().chain(onset.ends))
            .collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// The same with all effects acting throughout.
    pub fn without_onsets(&self) -> Self {
        let mut all = self.clone();
        all.hypothesised.iter_mut().for_each(|one| one.onset = None);
        all
    }
}
