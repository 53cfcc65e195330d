//! The analysis of recordings.

mod theory;

pub(super) use self::theory::theory;
use super::analysis::{Analysis, CycleResult, CycleValues, FirstEstimate, PaperSearch, PhaseSource, Theory};
use super::energy_balance;
use super::error::AnalysisError;
use crate::identify::{self, IdentifiedGait, Prior, Steadied, fit, gait, onset, search};
use crate::recording::{Recording, Repair};
use worm_estimator::config::Config;
use worm_physics::effect::Setting;
use worm_physics::{Physics, Worm, rigid_energy_j};

/// What a worm can carry, kg, as in a campaign.
const PAYLOADS_KG: std::ops::RangeInclusive<f64> = 0.0..=100.0;
/// How far the stroke seen may be from the configured one, as a factor, before the recording is of another worm.
const STROKE_FACTOR: f64 = 2.0;
/// The same factor between a metre and a millimetre.
const MILLIMETRES: std::ops::Range<f64> = 300.0..3000.0;
/// Standard error of a largest tip deformation, m, from which a warning says that the data do not determine it.
const UNKNOWN_M: f64 = 1e-4;
/// Ratio of the residual to what noise and drift explain, from which there is a warning.
const NOTABLE_MISFIT: f64 = 1.5;
/// How far the mean cycle time may be from the stated one, as a fraction.
const CYCLE_FRACTION: f64 = 0.2;

/// One recording and the conditions that it was made under.
#[derive(Debug, Clone, Copy)]
pub struct RecordedRun<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Slope of the canal, degrees, positive uphill.
    pub slope_deg: f64,
    /// Known extra mass, kg.
    pub payload_kg: f64,
    /// Time of a cycle, where it was noted, s.
    pub cycle_s: Option<f64>,
}

impl<'a> RecordedRun<'a> {
    /// A recording of the worm as it is on a slope, degrees, at a pace that nobody noted.
    pub fn at_slope(recording: &'a Recording, slope_deg: f64) -> Self {
        Self {
            recording,
            slope_deg,
            payload_kg: 0.0,
            cycle_s: None,
        }
    }
}

/// Progress of an analysis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Current stage.
    pub stage: &'static str,
    /// Fraction done, 0 to 1.
    pub fraction: f64,
}

/// A recording on its way through the analysis.
struct Prepared<'a> {
    run: RecordedRun<'a>,
    gait: IdentifiedGait,
    first_m: Vec<f64>,
    search: Option<search::Found>,
    repairs: Vec<Repair>,
}

/// Analyses recordings of one worm; several are fitted together, with common largest tip deformations and mass.
///
/// # Errors
/// [`AnalysisError`] names the recording and the remedy.
pub fn analyze(
    runs: &[RecordedRun<'_>],
    config: &Config,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<Analysis>, AnalysisError> {
    let base = Worm::try_from(config)?;
    let effects = config.effect_settings()?;
    let mut prepared = Vec::with_capacity(runs.len());
    for (index, run) in runs.iter().enumerate() {
        progress(Progress {
            stage: "gait",
            fraction: 0.3 * index as f64 / runs.len() as f64,
        });
        prepared.push(Prepared::new(*run, &base, config)?);
    }
    if prepared.is_empty() {
        return Err(AnalysisError::NoRun);
    }
    let to_fit: Vec<identify::PositionRun<'_>> = prepared
        .iter()
        .map(|prepared| identify::PositionRun {
            time_s: &prepared.run.recording.time_s,
            gait: &prepared.gait,
            slope_rad: prepared.run.slope_deg.to_radians(),
            payload_kg: prepared.run.payload_kg,
        })
        .collect();
    let fitted = fit::fit(&base, &to_fit, &starts(&base, &prepared), &mut |fraction| {
        progress(Progress {
            stage: "deformations",
            fraction: 0.3 + 0.6 * fraction,
        });
    })?;
    let mut analyses = Vec::with_capacity(prepared.len());
    for (index, prepared) in prepared.iter().enumerate() {
        progress(Progress {
            stage: "energy",
            fraction: 0.9 + 0.1 * index as f64 / runs.len() as f64,
        });
        analyses.push(prepared.finish(index, &fitted, &base, &effects)?);
    }
    Ok(analyses)
}

/// Refuses conditions under which no worm crawls, and a recording of another worm.
pub(super) fn check_conditions(run: &RecordedRun<'_>, base: &Worm) -> Result<(), AnalysisError> {
    let name = || run.recording.source.display().to_string();
    if !(-90.0..=90.0).contains(&run.slope_deg) {
        return Err(AnalysisError::Slope {
            recording: name(),
            slope_deg: run.slope_deg,
        });
    }
    if !PAYLOADS_KG.contains(&run.payload_kg) {
        return Err(AnalysisError::Payload {
            recording: name(),
            payload_kg: run.payload_kg,
        });
    }
    if run.recording.cells() != base.cells() {
        return Err(AnalysisError::Cells {
            recording: name(),
            found: run.recording.cells(),
            configured: base.cells(),
        });
    }
    Ok(())
}

/// The configured worm under a run's conditions.
pub(super) fn nominal_worm(run: &RecordedRun<'_>, base: &Worm) -> Result<Worm, AnalysisError> {
    let worm = base.clone().with_slope_rad(run.slope_deg.to_radians())?;
    Ok(worm.with_mass_kg(base.mass_kg() + run.payload_kg)?)
}

/// Where the search for the bounds begins: by inspection, by the paper's search, by the configuration.
fn starts(base: &Worm, prepared: &[Prepared<'_>]) -> Vec<Vec<f64>> {
    let cells = base.cells();
    let runs = prepared.len() as f64;
    let mean = |of: &dyn Fn(&Prepared<'_>) -> Vec<f64>| -> Vec<f64> {
        let mut mean = vec![0.0; cells];
        for prepared in prepared {
            for (mean, value) in mean.iter_mut().zip(of(prepared)) {
                *mean += value / runs;
            }
        }
        mean
    };
    let inspected = mean(&|prepared| prepared.first_m.clone());
    let searched = mean(&|prepared| match &prepared.search {
        Some(found) => found.max_deformation_m.clone(),
        None => prepared.first_m.clone(),
    });
    let configured = base.contacts().iter().map(|contact| contact.forward_bound_m).collect();
    let level = inspected.iter().sum::<f64>() / cells as f64;
    vec![searched, inspected, configured, vec![level; cells]]
}

impl<'a> Prepared<'a> {
    fn new(run: RecordedRun<'a>, base: &Worm, config: &Config) -> Result<Self, AnalysisError> {
        let recording = run.recording;
        let name = || recording.source.display().to_string();
        check_conditions(&run, base)?;
        let prior = Prior {
            step_order: &config.worm.step_order_from_zero(),
            phase: recording.gait_phase.as_deref(),
        };
        let find_gait =
            |measured_m: &[Vec<f64>], filled_m: &[Vec<f64>]| gait::find(&recording.time_s, measured_m, filled_m, prior);
        let Steadied {
            recording: steadied,
            gait,
            repairs,
            ..
        } = identify::steady(recording, find_gait).map_err(|source| AnalysisError::IdentifiedGait {
            recording: name(),
            source,
        })?;
        let filled_m = steadied.filled();
        check_stroke(gait.stroke_m, base.stroke_m(), name)?;
        let first_m: Vec<f64> = onset::find(&gait).iter().map(|onset| onset.max_deformation_m).collect();
        let stiffness_n_per_m: Vec<f64> = base
            .contacts()
            .iter()
            .map(|contact| contact.stiffness_n_per_m)
            .collect();
        let pull_n = (base.mass_kg() + run.payload_kg) * base.gravity_m_per_s2() * run.slope_deg.to_radians().sin();
        let search = search::search(&filled_m, &gait, &first_m, &stiffness_n_per_m, pull_n);
        Ok(Self {
            run,
            gait,
            first_m,
            search,
            repairs,
        })
    }

    fn finish(
        &self,
        index: usize,
        fitted: &identify::Fitted,
        base: &Worm,
        effects: &[Setting],
    ) -> Result<Analysis, AnalysisError> {
        let recording = self.run.recording;
        let fitted_run = &fitted.runs[index];
        let worm = &fitted_run.worm;
        let configured_kg = base.mass_kg() + self.run.payload_kg;
        let balance = energy_balance::follow(recording, &self.gait, fitted_run, fitted.damping_ratio, configured_kg)?;
        let settled: Vec<&CycleValues> = balance
            .cycles
            .iter()
            .filter(|cycle| cycle.settled)
            .map(|cycle| &cycle.values)
            .collect();
        let every: Vec<&CycleValues> = balance.cycles.iter().map(|cycle| &cycle.values).collect();
        let counted = if settled.is_empty() { &every } else { &settled };
        let (mean, std) = CycleValues::mean_and_std(counted, recording.cells());
        let deformation_m = mean_deformations(&balance);
        let carried_n: f64 = worm
            .contacts()
            .iter()
            .zip(&deformation_m)
            .map(|(contact, deformation_m)| contact.stiffness_n_per_m * deformation_m)
            .sum();
        let pull_per_kg = worm.gravity_m_per_s2() * worm.slope_rad().sin();
        let mass_kg = fitted
            .mass_kg
            .filter(|_| pull_per_kg != 0.0)
            .map(|_| -carried_n / pull_per_kg - self.run.payload_kg);
        let nominal = nominal_worm(&self.run, base)?;
        let durations_s: Vec<f64> = balance
            .cycles
            .iter()
            .filter(|cycle| cycle.settled || settled.is_empty())
            .map(|cycle| cycle.duration_s)
            .collect();
        let cycle_s = durations_s.iter().sum::<f64>() / durations_s.len() as f64;
        Ok(Analysis {
            recording: recording.source.display().to_string(),
            slope_deg: self.run.slope_deg,
            cells: recording.cells(),
            samples: recording.samples(),
            duration_s: recording.time_s[recording.samples() - 1] - recording.time_s[0],
            cycle_s,
            step_order: self.gait.step_order.iter().map(|cell| cell + 1).collect(),
            phase_source: if recording.gait_phase.is_some() {
                PhaseSource::Recorded
            } else {
                PhaseSource::Positions
            },
            stroke_m: self.gait.stroke_m,
            noise_m: self.gait.noise_m,
            first_estimate: FirstEstimate {
                max_deformation_m: self.first_m.clone(),
            },
            paper_search: self.search.as_ref().map(|found| PaperSearch {
                max_deformation_m: found.max_deformation_m.clone(),
                candidates: found.candidates,
                mean_force_n: found.mean_force_n,
                force_std_n: found.force_std_n,
            }),
            max_deformation_m: fitted.max_deformation_m.clone(),
            max_deformation_sigma_m: fitted.max_deformation_sigma_m.clone(),
            laid_down: fitted_run.laid_down,
            mean_deformation_m: deformation_m.iter().sum(),
            mass_estimate_kg: mass_kg,
            mass_sigma_kg: mass_kg.and(fitted.mass_sigma_kg),
            momentum_violation_n: carried_n + configured_kg * pull_per_kg,
            damping_ratio: fitted.damping_ratio,
            misfit_ratio: fitted.misfit_ratio,
            rigid_energy_j: rigid_energy_j(worm, mean.advance_m),
            theory: Theory {
                identified: theory(&Physics::of(worm.clone()).found_with(effects), cycle_s),
                nominal: theory(&Physics::of(nominal).with(effects), cycle_s),
            },
            warnings: self.warnings(fitted, &balance.cycles, cycle_s, mass_kg, base, effects),
            repairs: self.repairs.iter().map(|repair| repair.in_run(index)).collect(),
            cycles: balance.cycles,
            mean,
            std,
            torque_profile: None,
            series: balance.series,
        })
    }

    fn warnings(
        &self,
        fitted: &identify::Fitted,
        cycles: &[CycleResult],
        cycle_s: f64,
        mass_kg: Option<f64>,
        base: &Worm,
        effects: &[Setting],
    ) -> Vec<String> {
        let mut warnings = self.run.recording.warnings.clone();
        warnings.extend(self.repairs.iter().map(Repair::to_string));
        if !effects.is_empty() {
            let names: Vec<&str> = effects.iter().map(|effect| effect.effect().name).collect();
            warnings.push(format!(
                "theory's cycles are with the configured effects ({}), but the largest tip deformations, the mass and the energies measured were found with the paper's laws alone: what an effect does to them is in them",
                names.join(", ")
            ));
        }
        let unknown: Vec<String> = fitted
            .max_deformation_sigma_m
            .iter()
            .enumerate()
            .filter(|(_, sigma_m)| sigma_m.is_nan() || **sigma_m >= UNKNOWN_M)
            .map(|(cell, sigma_m)| format!("{} (±{:.2} mm)", cell + 1, sigma_m * 1e3))
            .collect();
        if !unknown.is_empty() {
            warnings.push(format!(
                "the largest tip deformation of cell {} is hardly to be seen in these positions: a tip that never slides backward shows its bound only together with others; add a run on a slope, or one that begins when the worm is laid down",
                unknown.join(", ")
            ));
        }
        if fitted.misfit_ratio > NOTABLE_MISFIT {
            warnings.push(format!(
                "theory leaves {:.1} times the variance that noise explains: the worm does something that the model does not know",
                fitted.misfit_ratio
            ));
        }
        if let (Some(mass_kg), Some(sigma_kg)) = (mass_kg, fitted.mass_sigma_kg)
            && (mass_kg - base.mass_kg()).abs() > 3.0 * sigma_kg
        {
            warnings.push(format!(
                "the positions speak for a mass of {:.0} ± {:.0} g, but worm.mass_kg is {:.0} g: weigh the worm, and check slope and stiffness",
                mass_kg * 1e3,
                sigma_kg * 1e3,
                base.mass_kg() * 1e3
            ));
        }
        if let Some(stated_s) = self.run.cycle_s
            && (cycle_s - stated_s).abs() > CYCLE_FRACTION * stated_s
        {
            warnings.push(format!(
                "a gait cycle took {cycle_s:.2} s, not the stated {stated_s:.2} s"
            ));
        }
        if base.cells() == 2 {
            warnings.push(
                "with two cells no cell ever stands still in the body to measure the others by: the largest tip deformations are rough, and their standard errors too small".to_owned(),
            );
        }
        if self.gait.outliers > 0 {
            warnings.push(format!(
                "{} positions far off their neighbours in time were left out",
                self.gait.outliers
            ));
        }
        if !cycles.iter().any(|cycle| cycle.settled) {
            warnings.push(
                "no cycle begins after every tip has ended a step: mean and standard deviation are over all cycles"
                    .to_owned(),
            );
        }
        warnings
    }
}

/// Refuses a recording whose steps are not those of the configured worm.
fn check_stroke(seen_m: f64, configured_m: f64, name: impl Fn() -> String) -> Result<(), AnalysisError> {
    let factor = seen_m / configured_m;
    if MILLIMETRES.contains(&factor) {
        return Err(AnalysisError::Millimetres {
            recording: name(),
            stroke_m: seen_m,
        });
    }
    if !(1.0 / STROKE_FACTOR..=STROKE_FACTOR).contains(&factor) {
        return Err(AnalysisError::Stroke {
            recording: name(),
            seen_m,
            configured_m,
        });
    }
    Ok(())
}

/// Time mean of each tip's deformation over the settled cycles, or over everything where there are none, m.
fn mean_deformations(balance: &energy_balance::EnergyBalance) -> Vec<f64> {
    let range = match &balance.settled {
        settled if settled.is_empty() => 0..balance.series.time_s.len(),
        settled => settled.clone(),
    };
    let time_s = &balance.series.time_s[range.clone()];
    balance
        .series
        .deformation_m
        .iter()
        .map(|series| {
            let series = &series[range.clone()];
            let (mut integral, mut whole_s) = (0.0, 0.0);
            for at in 1..series.len() {
                let step_s = time_s[at] - time_s[at - 1];
                integral += 0.5 * (series[at] + series[at - 1]) * step_s;
                whole_s += step_s;
            }
            integral / whole_s
        })
        .collect()
}

#[cfg(test)]
mod tests;
