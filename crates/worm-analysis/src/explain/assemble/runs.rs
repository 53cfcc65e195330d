//! The recordings of an answer, and how far the worm advanced in them.

use super::Parts;
use crate::explain::answer::{CurrentEvidence, RunSummary};
use crate::explain::search::fit::Fit;
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::worm::energy::of_cycles;
use crate::explain::worm::gap::deviation;
use crate::explain::worm::observed::Observed;
use crate::explain::worm::recorded_worm::RecordedWorm;
use crate::explain::worm::torque_residual;

/// What the recordings are, and how far the worm got in them.
pub(super) fn runs(worm: &RecordedWorm<'_>, parts: &Parts, named: Option<&Candidate>) -> Vec<RunSummary> {
    let of = |(run, observed): (usize, &Observed<'_>)| {
        let predicted_m = |fit: &Fit| {
            let predicted = worm.scene.predict(run, &fit.hypothesis, &fit.at);
            predicted.map_or(f64::NAN, |predicted| {
                let cells = observed.cells();
                advance_m(observed, |sample, cell| predicted.position_m[sample * cells + cell])
            })
        };
        RunSummary {
            recording: observed.run.recording.source.display().to_string(),
            slope_deg: observed.run.slope_deg,
            payload_kg: observed.run.payload_kg,
            cycles: (observed.phase[observed.samples() - 1] - observed.phase[0]).floor() as usize,
            cycle_s: observed.cycle_s,
            phase_recorded: observed.phase_recorded,
            laid_down: observed.laid_down,
            sees_positions: observed.sees_positions,
            noise_m: observed.noise_m,
            drift_per_cycle_m: if observed.sees_positions {
                worm.noise[run].drift_per_cycle_m()
            } else {
                f64::NAN
            },
            advance_m: [
                advance_m(observed, |sample, cell| observed.position_m[cell][sample]),
                predicted_m(&parts.recalibrated),
                named.map_or(f64::NAN, |candidate| predicted_m(&candidate.fit)),
            ],
            advance_sigma_m: None,
            current: current(worm, run, &parts.recalibrated, named),
        }
    };
    worm.scene.observed.iter().enumerate().map(of).collect()
}

/// What the current shows, where it counts.
fn current(
    worm: &RecordedWorm<'_>,
    run: usize,
    recalibrated: &Fit,
    named: Option<&Candidate>,
) -> Option<CurrentEvidence> {
    let observed = &worm.scene.observed[run];
    let named = named.map(|candidate| &candidate.fit);
    let mean = |of_cycles: Vec<f64>| of_cycles.iter().sum::<f64>() / of_cycles.len() as f64;
    let by = |fit: Option<&Fit>| {
        let predicted = fit.and_then(|fit| worm.scene.predict(run, &fit.hypothesis, &fit.at));
        predicted.map_or([f64::NAN; 2], |predicted| {
            let residual_n_m = torque_residual::residual_n_m(observed, &worm.bins[run], &predicted);
            [
                worm.torque_noise[run].rms_of_mean_cycle(&worm.bins[run], &residual_n_m),
                mean(of_cycles(observed, &predicted.work_j)),
            ]
        })
    };
    let shown_j = mean(shown_j(worm, run, named.unwrap_or(recalibrated))?);
    let [recalibrated, named] = [Some(recalibrated), named].map(by);
    Some(CurrentEvidence {
        torque_residual_n_m: [recalibrated[0], named[0]],
        work_j: [shown_j, recalibrated[1], named[1]],
    })
}

/// Net work that the cam takes in each settled cycle of a run, J: by the current and the gears of a fit.
fn shown_j(worm: &RecordedWorm<'_>, run: usize, fit: &Fit) -> Option<Vec<f64>> {
    let observed = &worm.scene.observed[run];
    let torque = observed.torque.as_ref()?;
    let gears = worm.scene.predict(run, &fit.hypothesis, &fit.at)?.gears;
    Some(of_cycles(observed, &torque.cumulative_j(&observed.phase, &gears)))
}

/// Standard error of its mean over the cycles, J, by their scatter; none of fewer than two.
pub(super) fn sigma_of_shown_j(worm: &RecordedWorm<'_>, run: usize, fit: &Fit) -> Option<f64> {
    let shown_j = shown_j(worm, run, fit)?;
    let sigma_j = deviation(&shown_j) / (shown_j.len() as f64).sqrt();
    Some(sigma_j).filter(|sigma_j| sigma_j.is_finite())
}

/// Advance per cycle, m: mean over the settled samples, each against the one a cycle later in which every cell was seen too.
fn advance_m(observed: &Observed<'_>, position_m: impl Fn(usize, usize) -> f64) -> f64 {
    let cells = observed.cells();
    let mean_m = |sample: usize| (0..cells).map(|cell| position_m(sample, cell)).sum::<f64>() / cells as f64;
    let (mut sum_m, mut count) = (0.0, 0.0);
    let mut after = observed.settled_from();
    for sample in observed.settled_from()..observed.samples() {
        while after < observed.samples() && observed.phase[after] < observed.phase[sample] + 1.0 {
            after += 1;
        }
        if after == observed.samples() {
            break;
        }
        // Both samples of a pair must show every cell; the part of the displacement past one cycle is removed in proportion.
        let displacement_m = mean_m(after) - mean_m(sample);
        if displacement_m.is_finite() {
            sum_m += displacement_m / (observed.phase[after] - observed.phase[sample]);
            count += 1.0;
        }
    }
    sum_m / count
}
