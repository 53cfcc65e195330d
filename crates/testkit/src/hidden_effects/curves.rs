//! The curves that the table's limits cut, and the calibration of the stated probabilities, each in bins.

use super::assessment::Assessment;
use super::statistics::Proportion;
use super::truth::CampaignKind;
use std::fmt;

/// Lower ends of bins of the significance, standard deviations.
const SIGMA: [f64; 6] = [0.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// Of the true impact on advance or energy, relative.
const IMPACT: [f64; 6] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2];
/// Of the discrepancy put into a clean worm, m.
const DISCREPANCY_M: [f64; 6] = [0.0, 2e-6, 7e-6, 15e-6, 25e-6, 35e-6];
/// Of a stated probability.
const PROBABILITY: [f64; 5] = [0.0, 0.5, 0.75, 0.9, 0.99];

/// A curve: the lower end of each bin, and the proportion in it.
pub type Curve = Vec<(f64, Proportion)>;

/// Many assessments as curves.
#[derive(Debug)]
pub struct Curves<'a>(pub &'a [Assessment]);

impl Curves<'_> {
    fn binned(&self, ends: &[f64], value: impl Fn(&Assessment) -> Option<(f64, bool)>) -> Curve {
        let mut curve: Curve = ends.iter().map(|&end| (end, Proportion::default())).collect();
        for (at, hit) in self.0.iter().filter_map(value) {
            let bin = ends.partition_point(|&end| end <= at).saturating_sub(1);
            curve[bin].1.hits += usize::from(hit);
            curve[bin].1.of += 1;
        }
        curve
    }

    /// How often the class of a single effect is right, by its significance.
    pub fn class_by_sigma(&self) -> Curve {
        self.binned(&SIGMA, |one| {
            one.right_class
                .filter(|_| one.is_single())
                .map(|right| (one.truth.sigma, right))
        })
    }

    /// The same by its impact on advance or energy.
    pub fn class_by_impact(&self) -> Curve {
        self.binned(&IMPACT, |one| {
            one.right_class
                .filter(|_| one.is_single())
                .map(|right| (one.truth.impact(), right))
        })
    }

    /// How often a stranger is reported as outside, by its significance.
    pub fn strangers_by_sigma(&self) -> Curve {
        self.binned(&SIGMA, |one| {
            (one.truth.kind == CampaignKind::Stranger)
                .then(|| (one.truth.sigma, one.verdict == super::answer::Verdict::Outside))
        })
    }

    /// How often a clean worm is given an effect, by the discrepancy put into it.
    pub fn clean_by_discrepancy(&self) -> Curve {
        self.binned(&DISCREPANCY_M, |one| {
            (one.truth.kind == CampaignKind::Clean).then(|| (one.truth.discrepancy_m, one.verdict.names()))
        })
    }

    /// How often a clean worm is reported as outside the library, by the discrepancy put into it.
    pub fn clean_outside_by_discrepancy(&self) -> Curve {
        self.binned(&DISCREPANCY_M, |one| {
            let outside = one.verdict == super::answer::Verdict::Outside;
            (one.truth.kind == CampaignKind::Clean).then_some((one.truth.discrepancy_m, outside))
        })
    }

    /// How often an answer is right, by the probability that it states.
    pub fn calibration(&self) -> Curve {
        self.binned(&PROBABILITY, |one| one.stated)
    }

    /// The mean of the stated probabilities in each bin of [`calibration`](Self::calibration); none where there is none.
    pub fn mean_stated(&self) -> Vec<Option<f64>> {
        let in_bin = |bin: usize| {
            let next = PROBABILITY.get(bin + 1).copied().unwrap_or(f64::INFINITY);
            let stated = self.0.iter().filter_map(|one| one.stated).map(|stated| stated.0);
            let inside: Vec<f64> = stated.filter(|at| (PROBABILITY[bin]..next).contains(at)).collect();
            (!inside.is_empty()).then(|| inside.iter().sum::<f64>() / inside.len() as f64)
        };
        (0..PROBABILITY.len()).map(in_bin).collect()
    }
}

impl fmt::Display for Curves<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let curves = [
            (
                "single: class right, by significance from",
                self.class_by_sigma(),
                1.0,
                "sigma",
            ),
            (
                "single: class right, by impact from",
                self.class_by_impact(),
                100.0,
                "%",
            ),
            (
                "stranger: outside, by significance from",
                self.strangers_by_sigma(),
                1.0,
                "sigma",
            ),
            (
                "clean: named, by discrepancy from",
                self.clean_by_discrepancy(),
                1e6,
                "um",
            ),
            (
                "clean: outside, by discrepancy from",
                self.clean_outside_by_discrepancy(),
                1e6,
                "um",
            ),
        ];
        for (what, curve, scale, unit) in curves {
            writeln!(out, "\n{what}")?;
            for (end, proportion) in curve.into_iter().filter(|bin| bin.1.of > 0) {
                writeln!(out, "  {:>5} {unit:<6} {proportion}", scale * end)?;
            }
        }
        writeln!(out, "\ncalibration: right, by stated probability from")?;
        for ((end, proportion), mean) in self.calibration().into_iter().zip(self.mean_stated()) {
            if let Some(mean) = mean {
                writeln!(out, "  {end:>5} (mean {mean:.4}) {proportion}")?;
            }
        }
        Ok(())
    }
}
