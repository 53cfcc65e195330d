//! A hypothesis about a plant: which effects act on it, and which quantities are free.

use super::law::shape::{Acts, LawShape};
use super::parameter::{Free, Hypothesised, Onset, What};
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

    /// The effects with these values, and the law.
    pub fn settings(&self, at: &[f64]) -> Vec<Setting> {
        let law = self.law_setting(0.0, at);
        self.effects_of(at, |_| true).chain(law).collect()
    }

    /// What acts so many cycles after the start of a run, in a crawl that counts its cycles from so many after it.
    pub fn settings_at(&self, run: usize, cycle: f64, counted_from: f64, at: &[f64]) -> Vec<Setting> {
        let acts = |onset: Onset| onset.acts_at(run, cycle);
        let law = match self.law_acts(at) {
            Acts::Never => None,
            Acts::Within(onset) if !acts(onset) => None,
            Acts::Within(_) | Acts::Throughout => self.law_setting(counted_from, at),
        };
        self.effects_of(at, |one| one.onset.is_none_or(acts))
            .chain(law)
            .collect()
    }

    fn effects_of(&self, at: &[f64], acts: impl Fn(&Hypothesised) -> bool) -> impl Iterator<Item = Setting> {
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
        let acting = effects.filter(move |(hypothesised, _)| acts(hypothesised));
        acting.map(|(hypothesised, values)| Setting::within(hypothesised.effect, hypothesised.cell, &values))
    }

    fn law_setting(&self, counted_from: f64, at: &[f64]) -> Option<Setting> {
        let law = LawShape::clone(self.law.as_deref()?).counted_from(counted_from);
        law.setting(&self.law_coefficients(at))
    }

    /// Whether there is a law that acts for a while alone.
    pub fn has_law_for_a_while(&self, at: &[f64]) -> bool {
        matches!(self.law_acts(at), Acts::Within(_))
    }

    /// When the law acts.
    fn law_acts(&self, at: &[f64]) -> Acts {
        let law = self.law.as_ref();
        law.map_or(Acts::Never, |law| law.acts(&self.law_coefficients(at)))
    }

    /// The coefficients of the law.
    pub fn law_coefficients(&self, at: &[f64]) -> Vec<f64> {
        let with_value = self.free.iter().zip(at);
        let of_law = with_value.filter(|(free, _)| matches!(free.what, What::Law(_)));
        of_law.map(|(_, &value)| value).collect()
    }

    /// Where what acts on a run begins or ends after its start, cycles since then, in this order.
    pub fn changes_at(&self, run: usize, at: &[f64]) -> Vec<f64> {
        let of_law = match self.law_acts(at) {
            Acts::Within(onset) => Some(onset),
            Acts::Never | Acts::Throughout => None,
        };
        let onsets = self.hypothesised.iter().filter_map(|one| one.onset).chain(of_law);
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
