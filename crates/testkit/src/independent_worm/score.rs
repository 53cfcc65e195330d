//! An analysis held against the truth.

use super::balance::TrueBalance;
use super::truth::Truth;
use std::fmt;
use worm_analysis::experiment::Analysis;

/// Errors of one energy, in percent of the truth.
#[derive(Debug, Clone, Copy)]
pub struct EnergyError {
    /// Of the mean over the settled cycles.
    pub mean_percent: f64,
    /// Of the worst single cycle.
    pub worst_percent: f64,
}

/// What an analysis found, and how wrong it is.
#[derive(Debug, Clone)]
pub struct Score {
    pub case: String,
    pub slope_deg: f64,
    pub true_m: Vec<f64>,
    pub found_m: Vec<f64>,
    pub sigma_m: Vec<f64>,
    /// By the paper's search, where it ran.
    pub search_m: Option<Vec<f64>>,
    /// By (11), (13) net and (13) positive.
    pub energies: [EnergyError; 3],
    /// Of the mean advance, m for a cycle.
    pub mean_advance_m: f64,
    /// Of the worst single cycle, m.
    pub worst_advance_m: f64,
    pub mass_percent: Option<f64>,
    /// Its standard error, in percent.
    pub mass_sigma_percent: Option<f64>,
    pub order_is_right: bool,
    /// Whether the analysis took the worm to have been laid down where the recording begins.
    pub laid_down: bool,
    /// Largest distance of a cycle's start from where it truly begins, cycles.
    pub phase_error: f64,
    pub settled_cycles: usize,
    pub true_cycles: usize,
}

/// What is asked of an analysis.
#[derive(Debug, Clone, Copy)]
pub struct Tolerances {
    pub bound_m: f64,
    pub energy_percent: f64,
    pub advance_m: f64,
    pub mass_percent: f64,
    /// How far the phase at which a cycle is said to begin may be off, cycles.
    pub phase_cycles: f64,
    /// Cycles of the recording that need not be settled.
    pub lost_cycles: usize,
}

/// What the accuracy is promised to be.
pub const TOLERANCES: Tolerances = Tolerances {
    bound_m: 1e-4,
    energy_percent: 3.0,
    advance_m: 0.05e-3,
    mass_percent: 3.0,
    phase_cycles: 0.03,
    lost_cycles: 2,
};

impl Score {
    pub fn of(case: impl Into<String>, analysis: &Analysis, truth: &Truth) -> Self {
        let settled: Vec<_> = analysis.cycles.iter().filter(|cycle| cycle.settled).collect();
        let pairs: Vec<_> = settled
            .iter()
            .map(|cycle| {
                let balance = truth.over(cycle.start_s, cycle.start_s + cycle.duration_s);
                (&cycle.values, balance)
            })
            .collect();
        let energy = |found: fn(&worm_analysis::experiment::CycleValues) -> f64, truly: fn(&TrueBalance) -> f64| {
            let found_j = pairs.iter().map(|(values, _)| found(values));
            let true_j = pairs.iter().map(|(_, balance)| truly(balance));
            let percent = |found_j: f64, true_j: f64| 100.0 * (found_j / true_j - 1.0);
            EnergyError {
                mean_percent: percent(found_j.clone().sum(), true_j.clone().sum()),
                worst_percent: worst(found_j.zip(true_j).map(|(found_j, true_j)| percent(found_j, true_j))),
            }
        };
        let advance_errors = || {
            pairs
                .iter()
                .map(|(values, balance)| values.advance_m - balance.advance_m())
        };
        let rotation = truth
            .step_order
            .iter()
            .position(|cell| analysis.step_order.first() == Some(cell));
        let order_is_right = rotation.is_some_and(|slot| {
            let turned = truth.step_order.iter().cycle().skip(slot).take(truth.step_order.len());
            turned.eq(&analysis.step_order)
        });
        let first_phase = rotation.unwrap_or(0) as f64 / truth.step_order.len() as f64;
        let phase_error = worst(settled.iter().map(|cycle| {
            let cycles = truth.phase_at(cycle.start_s) - first_phase;
            cycles - cycles.round()
        }));
        Self {
            case: case.into(),
            slope_deg: analysis.slope_deg,
            true_m: truth.max_deformation_m.clone(),
            found_m: analysis.max_deformation_m.clone(),
            sigma_m: analysis.max_deformation_sigma_m.clone(),
            search_m: analysis
                .paper_search
                .as_ref()
                .map(|search| search.max_deformation_m.clone()),
            energies: [
                energy(|values| values.energy_loss_j, TrueBalance::loss_j),
                energy(|values| values.energy_actuator_net_j, |balance| balance.actuator_net_j),
                energy(
                    |values| values.energy_actuator_positive_j,
                    |balance| balance.actuator_positive_j,
                ),
            ],
            mean_advance_m: advance_errors().sum::<f64>() / pairs.len() as f64,
            worst_advance_m: worst(advance_errors()),
            mass_percent: analysis.mass_estimate_kg.map(|kg| 100.0 * (kg / truth.mass_kg - 1.0)),
            mass_sigma_percent: analysis.mass_sigma_kg.map(|kg| 100.0 * kg / truth.mass_kg),
            order_is_right,
            laid_down: analysis.laid_down,
            phase_error,
            settled_cycles: settled.len(),
            true_cycles: truth.cycles.len(),
        }
    }

    /// Errors of the bounds, m.
    pub fn errors_m(&self) -> impl Iterator<Item = f64> {
        self.found_m
            .iter()
            .zip(&self.true_m)
            .map(|(found, truly)| found - truly)
    }

    /// Errors of the bounds by the paper's search, m; nothing where it did not run.
    pub fn search_errors_m(&self) -> impl Iterator<Item = f64> {
        let found = self.search_m.iter().flatten();
        found.zip(&self.true_m).map(|(found, truly)| found - truly)
    }

    /// What was promised and is not kept, but for the bounds.
    pub fn violations_beside_bounds(&self, tolerances: Tolerances) -> Vec<String> {
        let mut violations = Vec::new();
        let mut hold = |kept: bool, what: String| {
            if !kept {
                violations.push(format!("{}: {what}", self.case));
            }
        };
        hold(self.order_is_right, "the step order is wrong".to_owned());
        hold(
            self.phase_error.abs() < tolerances.phase_cycles,
            format!("cycles begin {:.3} cycles off", self.phase_error),
        );
        hold(
            self.settled_cycles + tolerances.lost_cycles >= self.true_cycles,
            format!(
                "only {} of {} cycles are settled",
                self.settled_cycles, self.true_cycles
            ),
        );
        for (name, energy) in ["(11)", "(13) net", "(13) positive"].iter().zip(self.energies) {
            let percent = energy.mean_percent;
            hold(
                percent.abs() < tolerances.energy_percent,
                format!("the mean energy by {name} is {percent:+.2} % off"),
            );
        }
        hold(
            self.mean_advance_m.abs() < tolerances.advance_m,
            format!("the mean advance is {:+.3} mm off", 1e3 * self.mean_advance_m),
        );
        if self.slope_deg >= 15.0 {
            let percent = self.mass_percent.unwrap_or(f64::NAN);
            let sigma = self.mass_sigma_percent.unwrap_or(f64::NAN);
            hold(
                percent.abs() < tolerances.mass_percent.max(3.0 * sigma),
                format!("the mass is {percent:+.1} % off, said to be known within {sigma:.1} %"),
            );
        }
        violations
    }

    /// What was promised and is not kept.
    pub fn violations(&self, tolerances: Tolerances) -> Vec<String> {
        let mut violations = self.violations_beside_bounds(tolerances);
        for (cell, error_m) in self.errors_m().enumerate() {
            let kept = error_m.abs() < tolerances.bound_m;
            if !kept {
                let (case, number, error_mm) = (&self.case, cell + 1, 1e3 * error_m);
                violations.push(format!("{case}: the bound of cell {number} is {error_mm:+.3} mm off"));
            }
        }
        violations
    }
}

impl fmt::Display for Score {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |values_m: &[f64], digits: usize| {
            let each: Vec<String> = values_m.iter().map(|m| format!("{:.digits$}", 1e3 * m)).collect();
            each.join(" ")
        };
        let [loss, net, positive] = self.energies.map(|error| {
            let EnergyError {
                mean_percent,
                worst_percent,
            } = error;
            format!("{mean_percent:+.1} ({worst_percent:+.1})")
        });
        write!(
            out,
            "{:<9} {:>2}° | {:<29} | {:<29} | {:<29} | {:+.3} | {loss:>12} {net:>12} {positive:>12} | {:+.3} ({:+.3}) | {:<8} | {} | {:<9} | {}/{}",
            self.case,
            self.slope_deg,
            mm(&self.true_m, 2),
            mm(&self.found_m, 2),
            mm(&self.sigma_m, 3),
            1e3 * worst(self.errors_m()),
            1e3 * self.mean_advance_m,
            1e3 * self.worst_advance_m,
            match (self.mass_percent, self.mass_sigma_percent) {
                (Some(percent), Some(sigma)) => format!("{percent:+.1}±{sigma:.1}"),
                _ => String::new(),
            },
            if self.order_is_right { "right" } else { "WRONG" },
            if self.laid_down { "laid down" } else { "under way" },
            self.settled_cycles,
            self.true_cycles,
        )
    }
}

/// What stands above rows of scores.
pub const HEADER: &str = "case, slope | true bounds, mm | found | sigma | worst error, mm | energy errors %: (11), (13) net, (13) positive, mean (worst cycle) | advance error, mm | mass % | order | begins | settled";

/// The value farthest from 0, sign kept; `NaN` if any is.
fn worst(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |worst: f64, error| {
        if error.is_nan() || error.abs() > worst.abs() {
            error
        } else {
            worst
        }
    })
}

/// Root mean square; `NaN` of nothing.
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (count, squares) = values.fold((0.0, 0.0), |(count, squares), value| {
        (count + 1.0, squares + value * value)
    });
    f64::sqrt(squares / count)
}
