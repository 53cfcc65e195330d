//! The effects of an answer as people read them.

use crate::explain::answer::{FoundOnset, FoundParameter, NamedEffect, with_cell};
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::search::parameter::{Hypothesised, Onset, What};
use crate::explain::worm::observed::Observed;
use crate::explain::worm::speed_droop::SpeedDroop;
use worm_physics::effect::MOTOR_DROOP;

/// How far a severity is off because no law is quite the worm's, as a fraction of its change: worms in MuJoCo have the library's effects
/// by laws of another form.
const LAW_ERROR: f64 = 0.07;

/// The effects of a candidate; `when` says when one begins or ends.
pub(in crate::explain) fn named_effects(
    when: &dyn Fn(Onset) -> FoundOnset,
    candidate: &Candidate,
    probability: f64,
    (closure, closure_interval): (f64, [f64; 2]),
    margin: f64,
) -> Vec<NamedEffect> {
    let sigmas = candidate.sigmas();
    let name =
        |hypothesised: &Hypothesised| with_cell(hypothesised.effect.name, hypothesised.cell.map(|cell| cell + 1));
    let of = |(place, hypothesised): (usize, &Hypothesised)| {
        let quantities = candidate.fit.hypothesis.free.iter().enumerate();
        let parameters = quantities.filter_map(|(at, free)| match free.what {
            What::Effect { place: mine, parameter } if mine == place => {
                let (is_severity, parameter) = (parameter == 0, &hypothesised.effect.parameters[parameter]);
                let value = candidate.fit.at[at];
                let of_law = if is_severity {
                    LAW_ERROR * (value - parameter.neutral)
                } else {
                    0.0
                };
                Some(FoundParameter {
                    name: parameter.name.to_owned(),
                    value,
                    sigma: sigmas[at].hypot(of_law),
                    unit: parameter.unit.to_owned(),
                    cell: hypothesised.cell.map(|cell| cell + 1),
                })
            }
            _ => None,
        });
        NamedEffect {
            name: hypothesised.effect.name.to_owned(),
            twins: hypothesised.twins().into_iter().map(str::to_owned).collect(),
            parameters: parameters.collect(),
            cell: hypothesised.cell.map(|cell| cell + 1),
            onset: hypothesised.onset.map(when),
            together_with: candidate
                .named()
                .filter(|(other, _)| *other != place)
                .map(|(_, other)| name(other))
                .collect(),
            closure,
            closure_interval,
            margin,
            probability,
            improvement: candidate.improvement,
            separated_by: hypothesised.effect.separated_by.to_owned(),
        }
    };
    candidate.named().map(of).collect()
}

/// When something begins or ends, in cycles and seconds.
pub(super) fn found_onset(observed: &[Observed<'_>], onset: Onset) -> FoundOnset {
    let seen = &observed[onset.run.unwrap_or(0)];
    let time_s = |cycle: f64| {
        let phase = seen.phase[0] + cycle;
        let sample = seen.phase.partition_point(|&here| here < phase).min(seen.samples() - 1);
        let time_s = &seen.run.recording.time_s;
        time_s[sample] - time_s[0]
    };
    let run = onset
        .run
        .map(|run| observed[run].run.recording.source.display().to_string());
    found_onset_in(run, onset, time_s)
}

/// When something begins or ends in a run, with the time of a cycle, s.
pub(in crate::explain) fn found_onset_in(run: Option<String>, onset: Onset, time_s: impl Fn(f64) -> f64) -> FoundOnset {
    let until_cycle = onset.begins.and(onset.ends);
    let cycle = onset.begins.or(onset.ends).unwrap_or(0.0);
    FoundOnset {
        cycle,
        time_s: time_s(cycle),
        run,
        ends: onset.begins.is_none(),
        until_cycle,
        until_s: until_cycle.map(time_s),
    }
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
        onset: None,
        // It shows in time and does not change the gap in positions.
        closure: f64::NAN,
        closure_interval: [f64::NAN; 2],
        margin: f64::NAN,
        probability: 1.0 / (1.0 + (-0.5 * speed_droop.improvement).exp()),
        improvement: speed_droop.improvement,
        separated_by: effect.separated_by.to_owned(),
    }
}
