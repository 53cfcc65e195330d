//! The effects of an answer as people read them.

use crate::explain::answer::{FoundParameter, NamedEffect, with_cell};
use crate::explain::model_selection::Candidate;
use crate::explain::parameter::{Hypothesised, What};
use crate::explain::speed_droop::SpeedDroop;
use worm_physics::effect::MOTOR_DROOP;

/// The effects of a candidate.
pub(in crate::explain) fn named_effects(
    candidate: &Candidate,
    probability: f64,
    closure: f64,
    margin: f64,
) -> Vec<NamedEffect> {
    let sigmas = candidate.sigmas();
    let name =
        |hypothesised: &Hypothesised| with_cell(hypothesised.effect.name, hypothesised.cell.map(|cell| cell + 1));
    let of = |(place, hypothesised): (usize, &Hypothesised)| {
        let quantities = candidate.fit.hypothesis.free.iter().enumerate();
        let parameters = quantities.filter_map(|(at, free)| match free.what {
            What::Effect { place: mine, parameter } if mine == place => {
                let parameter = &hypothesised.effect.parameters[parameter];
                Some(FoundParameter {
                    name: parameter.name.to_owned(),
                    value: candidate.fit.at[at],
                    sigma: sigmas[at],
                    unit: parameter.unit.to_owned(),
                    cell: hypothesised.cell.map(|cell| cell + 1),
                })
            }
            _ => None,
        });
        NamedEffect {
            name: hypothesised.effect.name.to_owned(),
            twins: hypothesised
                .effect
                .all_twins(hypothesised.cell)
                .into_iter()
                .map(str::to_owned)
                .collect(),
            parameters: parameters.collect(),
            cell: hypothesised.cell.map(|cell| cell + 1),
            together_with: candidate
                .hypothesised
                .iter()
                .filter(|other| *other != hypothesised)
                .map(name)
                .collect(),
            closure,
            margin,
            probability,
            improvement: candidate.improvement,
            separated_by: hypothesised.effect.separated_by.to_owned(),
        }
    };
    candidate.hypothesised.iter().enumerate().map(of).collect()
}

/// A motor that slows down under load, found in times alone.
pub(super) fn droop_effect(speed_droop: &SpeedDroop) -> NamedEffect {
    let effect = MOTOR_DROOP;
    let parameter = effect.severity();
    NamedEffect {
        name: effect.name.to_owned(),
        twins: Vec::new(),
        together_with: Vec::new(),
        parameters: vec![FoundParameter {
            name: parameter.name.to_owned(),
            value: speed_droop.slowdown_per_n,
            sigma: speed_droop.sigma,
            unit: parameter.unit.to_owned(),
            cell: None,
        }],
        cell: None,
        // It shows in time and does not change the gap in positions.
        closure: f64::NAN,
        margin: f64::NAN,
        probability: 1.0 / (1.0 + (-0.5 * speed_droop.improvement).exp()),
        improvement: speed_droop.improvement,
        separated_by: effect.separated_by.to_owned(),
    }
}
