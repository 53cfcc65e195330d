//! The recalibrated model as people read it.

use crate::explain::answer::Calibrated;
use crate::explain::search::fit::Fit;
use crate::explain::worm::nuisance::Nuisance;
use worm_estimator::config::Config;

/// What was recalibrated, as people read it.
pub(in crate::explain) fn calibration(fit: &Fit, config: &Config) -> Vec<Calibrated> {
    let sigmas = fit.sigmas();
    let quantities = fit.hypothesis.free.iter().enumerate();
    quantities
        .filter_map(|(at, free)| {
            let nuisance = Nuisance::of(free.what)?;
            let (value, sigma) = (fit.at[at], sigmas[at]);
            let factor = |name: String| (name, 1.0, value.exp(), value.exp() * sigma, "");
            let (name, nominal, found, sigma, unit) = match nuisance {
                Nuisance::Friction => factor("friction".to_owned()),
                Nuisance::Stiffness => factor("stiffness".to_owned()),
                Nuisance::Stroke => {
                    let stroke_m = config.worm.stroke_m;
                    let found_m = stroke_m * value.exp();
                    ("stroke".to_owned(), stroke_m, found_m, found_m * sigma, "m")
                }
                Nuisance::FrictionOf(cell) => factor(format!("friction of cell {}", cell + 1)),
                Nuisance::StiffnessOf(cell) => factor(format!("stiffness of cell {}", cell + 1)),
                Nuisance::StrokeOf(cell) => factor(format!("stroke of cell {}", cell + 1)),
                Nuisance::FrictionIn(run) => factor(format!("friction in run {}", run + 1)),
                Nuisance::SlopeOf(run) => (format!("slope of run {}", run + 1), 0.0, value, sigma, "deg"),
                Nuisance::Clock => ("clock".to_owned(), 0.0, value, sigma, "s"),
                Nuisance::ClockDrift => ("clock drift".to_owned(), 0.0, value, sigma, "s/s"),
                Nuisance::Damping => {
                    let (name, _, found, sigma, unit) = factor("damping".to_owned());
                    (name, free.quantity.centre.exp(), found, sigma, unit)
                }
                Nuisance::Presliding => ("presliding".to_owned(), free.quantity.centre, value, sigma, ""),
                Nuisance::Rounding => ("rounding".to_owned(), free.quantity.centre, value, sigma, ""),
                Nuisance::Viscosity => ("viscosity".to_owned(), free.quantity.centre, value, sigma, "N s/m"),
                Nuisance::Breakaway => ("breakaway".to_owned(), free.quantity.centre, value, sigma, ""),
                Nuisance::GearOffset => ("friction of the gears".to_owned(), 0.0, value, sigma, "N m"),
                Nuisance::TorqueGain => ("torque constant".to_owned(), 0.0, value, sigma, ""),
                Nuisance::PadDamping => ("damping in the pads".to_owned(), free.quantity.centre, value, sigma, ""),
                Nuisance::GearLoad => ("friction of the gears by the load".to_owned(), 0.0, value, sigma, ""),
            };
            Some(Calibrated {
                name,
                nominal,
                found,
                sigma,
                unit,
                at_limit: fit.would_go_beyond(at),
            })
        })
        .collect()
}
