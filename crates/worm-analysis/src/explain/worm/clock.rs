//! The gait phase that each sample of a recording shows.

use super::observed::Observed;
use super::phase_correction::PhaseCorrection;

/// The gait phase one latency before each sample: a position shows the worm as it was then.
pub(in crate::explain) struct Clock<'a> {
    time_s: &'a [f64],
    phase: &'a [f64],
    /// At the start of the recording, where clocks are set, and its growth, s/s.
    latency_s: f64,
    drift: f64,
    pub phase_correction: Option<PhaseCorrection>,
    after: usize,
}

impl<'a> Clock<'a> {
    pub fn new(observed: &'a Observed<'_>, latency_s: f64, drift: f64) -> Self {
        Self {
            time_s: &observed.run.recording.time_s,
            phase: &observed.phase,
            latency_s,
            drift,
            phase_correction: None,
            after: 1,
        }
    }

    /// For samples asked in order.
    pub fn phase_at(&mut self, sample: usize) -> f64 {
        let phase = self.recorded_at(sample);
        self.phase_correction
            .as_ref()
            .map_or(phase, |phase_correction| phase_correction.corrected(phase))
    }

    fn recorded_at(&mut self, sample: usize) -> f64 {
        if self.latency_s == 0.0 && self.drift == 0.0 {
            return self.phase[sample];
        }
        let last = self.time_s.len() - 1;
        let at_s = self.time_s[sample] - self.latency_s - self.drift * (self.time_s[sample] - self.time_s[0]);
        while self.after < last && self.time_s[self.after] < at_s {
            self.after += 1;
        }
        while self.after > 1 && self.time_s[self.after - 1] > at_s {
            self.after -= 1;
        }
        let (low, high) = (self.after - 1, self.after);
        let fraction = (at_s - self.time_s[low]) / (self.time_s[high] - self.time_s[low]);
        // Before the first sample and after the last, the phase is extrapolated.
        self.phase[low] + fraction.clamp(-10.0, 11.0) * (self.phase[high] - self.phase[low])
    }
}

#[cfg(test)]
mod tests {
    use super::super::nuisance::Nuisance;
    use super::*;
    use crate::explain::fixture::{Campaign, record, scene};
    use crate::explain::search::hypothesis::Hypothesis;

    /// A clock that has fallen behind by some time shows what a latency of that time shows.
    #[test]
    fn two_clocks_that_run_apart_are_a_latency_that_grows() {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let scene = scene(&recordings, &campaign);
        let observed = &scene.observed[0];
        let (time_s, drift) = (&recordings[0].time_s, 1e-3);
        let mut drifting = Clock::new(observed, 2e-3, drift);
        for sample in 0..observed.samples() {
            let latency_s = 2e-3 + drift * (time_s[sample] - time_s[0]);
            let late = Clock::new(observed, latency_s, 0.0).phase_at(sample);
            assert!((drifting.phase_at(sample) - late).abs() < 1e-12, "sample {sample}");
        }
        let free = Nuisance::all(4, 2, true);
        let nuisances = Hypothesis::new(&free, &[]);
        let mut at = nuisances.neutral();
        let predict = |at: &[f64]| scene.predict(0, &nuisances, at).expect("it holds").position_m;
        let without = predict(&at);
        let place = free.iter().position(|free| free.what == Nuisance::ClockDrift.what());
        at[place.expect("it is free")] = drift;
        let apart = predict(&at)
            .iter()
            .zip(&without)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(apart > 1e-4, "{apart} m");
    }
}
