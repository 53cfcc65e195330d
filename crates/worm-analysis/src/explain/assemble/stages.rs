//! The gap between model and data, stage by stage.

use super::Parts;
use crate::explain::answer::{Stage, StageKind};
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::search::law::fitted_law::FittedLaw;
use crate::explain::worm::gap::{Measured, clusters};
use crate::explain::worm::recorded_worm::RecordedWorm;

/// The gap, stage by stage, and what fraction of it each candidate closes.
pub(super) struct Gap {
    pub stages: Vec<Stage>,
    /// With its 90 % interval.
    pub closure: Vec<(f64, [f64; 2])>,
    best_wrong: f64,
}

impl Gap {
    pub fn measure(worm: &RecordedWorm<'_>, parts: &Parts, named: &[Candidate], law: Option<&FittedLaw>) -> Self {
        let selected = &parts.found.selected;
        let best = selected
            .candidates
            .first()
            .map_or(&parts.recalibrated, |candidate| &candidate.fit);
        let measured = Measured::new(worm, best);
        let recalibrated = measured.stage(
            StageKind::Recalibrated,
            None,
            &parts.recalibrated,
            &parts.found.recalibrated_held_out.fits,
        );
        let floor = measured.floor_of_closure();
        let stage = |kind: StageKind, candidate: &Candidate| {
            let folds = candidate.held_out.as_ref().map_or(&[][..], |held_out| &held_out.fits);
            let names: Vec<&str> = candidate
                .named()
                .map(|(_, hypothesised)| hypothesised.effect.name)
                .collect();
            measured.stage(kind, Some(names.join(" + ")), &candidate.fit, folds)
        };
        let without = &parts.found.recalibrated_held_out;
        let closure = |candidate: &Candidate| {
            let held_out = candidate.held_out.as_ref();
            let (left, open) = held_out.map_or_else(Default::default, |held_out| held_out.determined_beside(without));
            let left = clusters(worm, &candidate.fit, &left);
            clusters(worm, &parts.recalibrated, &open).closure(&left, floor)
        };
        let of_named: Vec<Stage> = named
            .iter()
            .map(|candidate| stage(StageKind::Named, candidate))
            .collect();
        let wrong = selected
            .best_wrong
            .as_ref()
            .map(|candidate| stage(StageKind::BestWrong, candidate));
        let closures = named.iter().map(closure).collect();
        let best_wrong = selected
            .best_wrong
            .as_ref()
            .map_or(0.0, |candidate| closure(candidate).0);
        let mut stages = vec![
            measured.stage(StageKind::Baseline, None, &parts.found.nominal, &[]),
            recalibrated,
        ];
        stages.extend(wrong);
        stages.extend(of_named.into_iter().next());
        stages.extend(law.map(|law| {
            measured.stage(
                StageKind::Law,
                Some(law.shape.to_string()),
                &law.fit,
                &law.held_out.fits,
            )
        }));
        stages.push(measured.free_form_stage(&parts.recalibrated));
        stages.push(measured.floor_stage());
        Self {
            stages,
            closure: closures,
            best_wrong,
        }
    }

    /// A candidate's closure less that of the best other one, candidate or not.
    pub fn margin(&self, place: usize) -> f64 {
        let others = self.closure.iter().enumerate().filter(|(other, _)| *other != place);
        self.closure[place].0 - others.map(|(_, closure)| closure.0).fold(self.best_wrong, f64::max)
    }
}
