//! What is expected of an effect before the data are seen.
//!
//! # Severity
//! An effect is worth a name for what it does, so the prior is on its impact: the largest relative change of the outcome (the advance) of any run
//! is log-normal about some median (6 % unless the user says otherwise), with a standard deviation of 0.9 in the logarithm. It
//! vanishes towards none (a non-local prior: Johnson and Rossell 2010), so that small effects earn nothing and data without one
//! speak for *none*. Where the advance does not move, the median is ten notable changes. Senses that are hardly physical (a drag
//! that pushes) have a tenth of the mass, and where physics or care sets a limit (the slope is set by an inclinometer, the stroke
//! by a cam) the density falls off beyond it.
//!
//! # Odds
//! None 0.5, something else 0.1, a single effect 0.35, a pair 0.05; shared equally by families (exact twins are one), then by cells,
//! then 0.55 to an effect that acts throughout, 0.3 to one that begins in mid-run, 0.1 to one that ends there and 0.05 to one that does
//! both: in every run, or once in one of them, at any cycle.

use super::super::parameter::{Hypothesised, Onset};
use worm_physics::effect::{Effect, Parameter, Scope, Sense};

/// Prior probability of none, of something else, of a single effect and of a pair.
pub(in crate::explain) const NONE: f64 = 0.5;
pub(in crate::explain) const OTHER: f64 = 0.1;
pub(in crate::explain) const SINGLE: f64 = 0.35;
pub(in crate::explain) const PAIR: f64 = 0.05;
/// The same, beside these, of conditions that are stated wrongly as a whole and nothing missing, of one run whose condition may be any, and
/// of one run that was not made like the others: guesses. The second is much smaller, for it can take the place of any effect that hardly
/// differs between the other runs.
pub(in crate::explain) const MISSTATED: f64 = 0.02;
pub(in crate::explain) const MISSTATED_RUN: f64 = 1e-4;
pub(in crate::explain) const UNLIKE_RUN: f64 = 0.01;
/// Part of what is something else that leaves nothing beside an effect of the library, or a pair: no data of the same kind could tell. Of
/// 25 strangers of both test beds' development splits 6 did.
pub(in crate::explain) const IMITATED: f64 = 0.25;
/// Standard deviation of the logarithm of the impact.
const LN_IMPACT: f64 = 0.9;
/// Impacts from which the median is interpolated, and the severity without any, in notable changes.
const MEASURABLE: std::ops::RangeInclusive<f64> = 2e-3..=0.8;
const WITHOUT_IMPACT: f64 = 10.0;
/// Mass of the sense that is hardly physical.
const UNPHYSICAL: f64 = 0.1;
/// Probabilities that an effect which may begin in mid-run does, that it ends there, and that it does both.
const BEGINS: f64 = 0.3;
const ENDS: f64 = 0.1;
const BOTH: f64 = 0.05;
/// Nodes of the integral that normalises the density of one sense.
const NODES: usize = 60;

/// The prior of an effect's severity.
#[derive(Debug, Clone, Copy)]
pub(in crate::explain) struct SeverityPrior {
    neutral: f64,
    /// Largest change to either side, below and above neutral.
    reach: [f64; 2],
    ln_median: f64,
    care: Option<f64>,
    /// Logarithm of the mass over the integral of the density, below and above neutral.
    ln_mass: [f64; 2],
}

impl SeverityPrior {
    /// From the median of the impact, as a fraction of the advance, and changes of the severity that were simulated, each with its
    /// impact.
    pub fn new(effect: &Effect, expected_impact: f64, impacts: &[(f64, f64)]) -> Self {
        let severity = effect.severity();
        let reach = [severity.neutral - severity.min, severity.max - severity.neutral];
        // From the change whose impact is nearest to the median, in proportion.
        let off = |impact: f64| (impact / expected_impact).ln();
        let nearest = impacts
            .iter()
            .filter(|(_, impact)| MEASURABLE.contains(impact))
            .min_by(|a, b| off(a.1).abs().total_cmp(&off(b.1).abs()));
        let median = match nearest {
            Some((change, impact)) => change.abs() * expected_impact / impact,
            None => WITHOUT_IMPACT * severity.notable,
        };
        let ln_median = median.clamp(severity.notable, 0.7 * reach[0].max(reach[1])).ln();
        let mut prior = Self {
            neutral: severity.neutral,
            reach,
            ln_median,
            care: effect.care,
            ln_mass: [0.0; 2],
        };
        let below = match (reach[0] > 0.0, reach[1] > 0.0) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            _ if effect.sense != Sense::Either => UNPHYSICAL,
            _ => 0.5,
        };
        prior.ln_mass = [(below, 0), (1.0 - below, 1)].map(|(mass, side): (f64, usize)| {
            if mass == 0.0 {
                f64::NEG_INFINITY
            } else {
                mass.ln() - prior.integral(side).ln()
            }
        });
        prior
    }

    /// Logarithm of the density of the logarithm of a change, up to a constant.
    fn ln_shape(&self, ln_change: f64) -> f64 {
        let off = (ln_change - self.ln_median) / LN_IMPACT;
        let careless = self.care.map_or(0.0, |care| ln_change.exp() / care);
        -0.5 * off * off - 0.5 * careless * careless
    }

    fn integral(&self, side: usize) -> f64 {
        let from = self.ln_median - 4.0 * LN_IMPACT;
        let to = (self.ln_median + 4.0 * LN_IMPACT).min(self.reach[side].ln());
        let width = (to - from).max(1e-6) / NODES as f64;
        let nodes = (0..NODES).map(|node| from + (node as f64 + 0.5) * width);
        nodes.map(|ln_change| self.ln_shape(ln_change).exp() * width).sum()
    }

    /// Logarithm of the density of the logarithm of the change at some severity, on its side of neutral.
    pub fn ln_density_of_logarithm(&self, value: f64) -> f64 {
        let change = value - self.neutral;
        if change == 0.0 {
            return f64::NEG_INFINITY;
        }
        self.ln_mass[usize::from(change > 0.0)] + self.ln_shape(change.abs().ln())
    }

    /// Logarithm of the density at some severity, in one over its unit.
    pub fn ln_density(&self, value: f64) -> f64 {
        self.ln_density_of_logarithm(value) - (value - self.neutral).abs().ln()
    }

    /// A severity whose change from neutral is that of another times a factor.
    pub fn scaled(&self, value: f64, factor: f64) -> f64 {
        self.neutral + factor * (value - self.neutral)
    }

    /// Width of the prior about some severity, for the curvature of the evidence.
    pub fn width(&self, value: f64) -> f64 {
        LN_IMPACT * (value - self.neutral).abs()
    }
}

/// Whether a severity has a sense that its effect can have.
pub(in crate::explain) fn is_possible(effect: &Effect, value: f64) -> bool {
    effect.sense != Sense::Positive || value >= effect.severity().neutral
}

/// Logarithm of the density of a parameter of shape, and its width: uniform in the logarithm where it is positive, else along the canal.
pub(in crate::explain) fn shape(parameter: &Parameter, value: f64, stretch_m: (f64, f64)) -> (f64, f64) {
    let twelfth = 12.0_f64.sqrt();
    if parameter.min > 0.0 {
        let whole = (parameter.max / parameter.min).ln();
        (-(value * whole).ln(), value * whole / twelfth)
    } else {
        let whole = stretch_m.1 - stretch_m.0;
        (-whole.ln(), whole / twelfth)
    }
}

/// What the number of hypotheses depends on.
#[derive(Debug, Clone, Copy)]
pub(in crate::explain) struct Campaign {
    pub channels: usize,
    pub runs: usize,
    /// Cycles of a run in which an effect may begin.
    pub cycles: f64,
    /// Families of effects that the data can show.
    pub families: f64,
}

/// Families of effects: exact twins count once.
pub(in crate::explain) fn families(hypotheses: &[Hypothesised]) -> f64 {
    let mut effects: Vec<&Effect> = hypotheses.iter().map(|one| one.effect).collect();
    effects.dedup_by_key(|effect| effect.name);
    effects
        .iter()
        .map(|effect| 1.0 / (1.0 + effect.twins.len() as f64))
        .sum()
}

impl Campaign {
    /// Logarithm of the share of one hypothesised effect among all single ones; of one that begins in mid-run, per cycle.
    fn ln_share(&self, one: &Hypothesised) -> f64 {
        let variants = match one.effect.scope {
            Scope::Worm => 1.0,
            Scope::OneCell => self.channels as f64,
            // All cells as probable as any one.
            Scope::AnyCells if one.cell.is_none() => 2.0,
            Scope::AnyCells => 2.0 * self.channels as f64,
        };
        let twins = 1.0 + one.effect.twins.len() as f64;
        let at_some_cycle = |onset: Onset| match (onset.begins, onset.ends) {
            // Every pair of cycles as probable as any other.
            (Some(_), Some(_)) => BOTH / (0.5 * self.cycles * (self.cycles - 1.0)).max(1.0),
            (None, Some(_)) => ENDS / self.cycles,
            _ => BEGINS / self.cycles,
        };
        let when = match one.onset {
            _ if !one.effect.may_begin => 1.0,
            None => 1.0 - BEGINS - ENDS - BOTH,
            // All runs as probable as any one.
            Some(onset) if self.runs == 1 => at_some_cycle(onset),
            Some(onset) if onset.run.is_none() => 0.5 * at_some_cycle(onset),
            Some(onset) => 0.5 * at_some_cycle(onset) / self.runs as f64,
        };
        when.ln() - (self.families * variants * twins).ln()
    }

    /// Logarithm of the prior probability of one effect, or of a pair.
    pub fn ln_prior(&self, all: &[Hypothesised]) -> f64 {
        let shares: f64 = all.iter().map(|one| self.ln_share(one)).sum();
        match all.len() {
            1 => SINGLE.ln() + shares,
            // Two of n families: n (n − 1) / 2 pairs.
            _ => (2.0 * PAIR).ln() + shares,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::worm::plant::hypotheses;
    use worm_physics::effect::named;

    /// An effect whose change by one unit changes the advance by so much.
    fn prior(name: &str, change: f64, impact: f64) -> SeverityPrior {
        SeverityPrior::new(named(name).expect("an effect"), 0.06, &[(change, impact)])
    }

    /// Mass of a density of the logarithm of the change, on one side of neutral.
    fn mass(prior: &SeverityPrior, neutral: f64, sign: f64, reach: f64) -> f64 {
        let (from, to, nodes) = ((1e-6_f64).ln(), reach.ln(), 20_000);
        let width = (to - from) / f64::from(nodes);
        let at = |node: i32| neutral + sign * (from + (f64::from(node) + 0.5) * width).exp();
        (0..nodes)
            .map(|node| prior.ln_density_of_logarithm(at(node)).exp() * width)
            .sum()
    }

    #[test]
    fn both_senses_together_have_a_mass_of_one() {
        for (name, neutral, reach, below) in [
            ("constant-drag", 0.0, [4.0, 4.0], 0.1),
            ("directional-friction", 1.0, [0.7, 1.5], 0.5),
            ("slope-error", 0.0, [15.0, 15.0], 0.5),
            ("pad-hardening", 0.0, [0.0, 4.0], 0.0),
        ] {
            let prior = prior(name, 0.2, 0.05);
            let minus = if reach[0] > 0.0 {
                mass(&prior, neutral, -1.0, reach[0])
            } else {
                0.0
            };
            let plus = mass(&prior, neutral, 1.0, reach[1]);
            assert!(
                (minus - below).abs() < 0.01 && (plus + below - 1.0).abs() < 0.01,
                "{name}: {minus} and {plus}"
            );
        }
    }

    #[test]
    fn the_median_changes_the_advance_by_six_per_cent_and_nothing_is_expected_at_zero() {
        let prior = prior("constant-drag", 0.3, 0.03);
        let at = |newton: f64| prior.ln_density_of_logarithm(newton);
        assert!(at(0.6) > at(0.5) && at(0.6) > at(0.7));
        assert!(at(0.6) - at(0.006) > 12.0, "a hundredth of it is next to impossible");
    }

    #[test]
    fn a_tether_does_not_push() {
        let tether = named("tether-drag").expect("an effect");
        assert!(is_possible(tether, 0.2) && !is_possible(tether, -0.2));
        assert!(is_possible(named("payload").expect("an effect"), -0.02));
    }

    #[test]
    fn a_slope_error_of_nine_degrees_costs_what_an_inclinometer_makes_of_it() {
        let prior = prior("slope-error", 1.0, 0.02);
        let fall = prior.ln_density_of_logarithm(3.0) - prior.ln_density_of_logarithm(9.0);
        assert!(fall > 15.0, "{fall}");
    }

    #[test]
    fn all_single_effects_together_have_the_prior_of_a_single_one() {
        let all = hypotheses(4, true);
        let campaign = Campaign {
            channels: 4,
            runs: 3,
            cycles: 10.0,
            families: families(&all),
        };
        let (cycles, pairs) = (campaign.cycles, 0.5 * campaign.cycles * (campaign.cycles - 1.0));
        let of_run = |run: Option<usize>| {
            let both = Onset {
                ends: Some(5.0),
                ..Onset::from(3.0, run)
            };
            [
                (Onset::from(3.0, run), cycles),
                (Onset::until(3.0, run), cycles),
                (both, pairs),
            ]
        };
        let prior = |one: &Hypothesised| {
            let mut sum = campaign.ln_prior(&[*one]).exp();
            if one.effect.may_begin {
                let onsets = [None, Some(0), Some(1), Some(2)].into_iter().flat_map(of_run);
                let with_onset = onsets.map(|(onset, times)| {
                    let one = Hypothesised {
                        onset: Some(onset),
                        ..*one
                    };
                    times * campaign.ln_prior(&[one]).exp()
                });
                sum += with_onset.sum::<f64>();
            }
            sum
        };
        let sum: f64 = all.iter().map(prior).sum();
        assert!((sum - SINGLE).abs() < 1e-9, "{sum}");
    }
}
