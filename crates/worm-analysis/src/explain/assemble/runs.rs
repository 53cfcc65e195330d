//! The recordings of an answer, and how far the worm advanced in them.

use super::Parts;
use crate::explain::answer::RunSummary;
use crate::explain::search::fit::Fit;
use crate::explain::search::judge::candidate::Candidate;
use crate::explain::worm::observed::Observed;
use crate::explain::worm::recorded_worm::RecordedWorm;

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
            noise_m: observed.noise_m,
            drift_per_cycle_m: worm.noise[run].drift_per_cycle_m(),
            advance_m: [
                advance_m(observed, |sample, cell| observed.position_m[cell][sample]),
                predicted_m(&parts.recalibrated),
                named.map_or(f64::NAN, |candidate| predicted_m(&candidate.fit)),
            ],
            advance_sigma_m: None,
        }
    };
    worm.scene.observed.iter().enumerate().map(of).collect()
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
