//! The recalibrated values of a servo as people read them, and those that are far from what was stated.

use super::answer::FarOff;
use super::nuisance::Nuisance;
use super::recorded_servo::RecordedServo;
use crate::explain::answer::Calibrated;
use crate::explain::search::fit::Fit;
use worm_estimator::number::significant;

/// Standard deviations of its prior from which a value is far from the stated one.
const UNEXPECTED: f64 = 2.0;
/// The same of what the bench's own figures imitate: as a fraction of the stated value, and in standard errors. Its prior is wide, and the
/// scales and rules that a bench is measured with are not.
const IMITATED: (f64, f64) = (0.15, 3.0);

/// A recalibrated value beside the stated one.
struct Value {
    nuisance: Nuisance,
    calibrated: Calibrated,
    /// How far it is from the stated one, in standard deviations of its prior.
    unexpected: f64,
}

/// What was recalibrated.
pub(super) fn calibration(servo: &RecordedServo<'_>, fit: &Fit) -> Vec<Calibrated> {
    values(servo, fit).into_iter().map(|value| value.calibrated).collect()
}

/// What came out far from the stated value: something else that was stated may be wrong, and hide in it.
pub(super) fn far_off(servo: &RecordedServo<'_>, fit: &Fit) -> Vec<FarOff> {
    values(servo, fit).iter().filter_map(Value::far_off).collect()
}

fn values(servo: &RecordedServo<'_>, fit: &Fit) -> Vec<Value> {
    let sigmas = fit.sigmas();
    let motor = &servo.nominal.motor;
    let quantities = fit.hypothesis.free.iter().enumerate();
    let read = |(at, free): (usize, &crate::explain::search::parameter::Free)| {
        let (value, sigma) = (fit.at[at], sigmas[at]);
        let factor = |name: &str, nominal: f64, unit: &'static str| {
            let found = nominal * value.exp();
            (name.to_owned(), nominal, found, found * sigma, unit)
        };
        let plain = |name: &str, nominal: f64, unit: &'static str| (name.to_owned(), nominal, value, sigma, unit);
        let nuisance = Nuisance::of(free.what)?;
        let (name, nominal, found, sigma, unit) = match nuisance {
            Nuisance::TorqueConstant => factor("torque constant", motor.torque_constant, "N m/A"),
            Nuisance::Winding => factor("winding and bridge", motor.winding_ohm, "Ω"),
            Nuisance::Rotor => factor("rotor inertia behind the gears", motor.rotor_inertia_kg_m2, "kg m²"),
            Nuisance::Dry => plain("dry friction", motor.dry_n_m, "N m"),
            Nuisance::Viscous => plain("viscous friction", motor.viscous_n_m_s, "N m s/rad"),
            Nuisance::Zero => plain("zero angle", 0.0, "rad"),
            Nuisance::Table(_) => return None,
        };
        Some(Value {
            nuisance,
            unexpected: free.quantity.prior_residual(value),
            calibrated: Calibrated {
                name,
                nominal,
                found,
                sigma,
                unit,
                at_limit: fit.would_go_beyond(at),
            },
        })
    };
    quantities.filter_map(read).collect()
}

impl Value {
    fn far_off(&self) -> Option<FarOff> {
        let Calibrated {
            name,
            nominal,
            found,
            sigma,
            unit,
            at_limit,
        } = &self.calibrated;
        let off = found - nominal;
        let change = if *nominal == 0.0 { f64::NAN } else { off / nominal };
        let standard_errors = off / sigma;
        let is_of_bench = matches!(self.nuisance, Nuisance::TorqueConstant | Nuisance::Winding);
        let is_sure = change.abs() > IMITATED.0 && standard_errors.abs() > IMITATED.1;
        if !at_limit && self.unexpected.abs() <= UNEXPECTED && !(is_of_bench && is_sure) {
            return None;
        }
        let (found, stated) = (significant(*found, 3), significant(*nominal, 3));
        let is = match *at_limit {
            true => format!("came out at {found} {unit}, the end of what is believed, stated {stated}"),
            false => format!(
                "came out at {found} {unit}, {:.1} standard errors from the stated {stated}",
                standard_errors.abs()
            ),
        };
        Some(FarOff {
            name: name.clone(),
            change,
            prior_sigmas: self.unexpected,
            standard_errors,
            description: format!("{name} {is}: {}", self.what_to_check(off > 0.0)),
        })
    }

    /// What else than the value itself does the same to the positions.
    fn what_to_check(&self, is_more: bool) -> String {
        match self.nuisance {
            // By both the arm's weight is held against the torque of a duty.
            Nuisance::Winding | Nuisance::TorqueConstant => {
                let is_weaker = is_more == (self.nuisance == Nuisance::Winding);
                let (arm, supply) = match is_weaker {
                    true => ("heavier or longer", "weaker"),
                    false => ("lighter or shorter", "stronger"),
                };
                format!(
                    "an arm that is {arm} than stated, or a {supply} supply, looks the same, so check mass_kg, length_m, arm_mass_kg and supply_v"
                )
            }
            Nuisance::Rotor => {
                "an arm of another inertia than stated looks the same, so check length_m and arm_mass_kg".to_owned()
            }
            Nuisance::Zero => "check that the arm hangs still at angle 0".to_owned(),
            Nuisance::Dry | Nuisance::Viscous | Nuisance::Table(_) => {
                "check that the stated model is that of this servo, and that nothing rubs".to_owned()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{campaign, recalibrated, record};
    use super::*;

    /// Positions cannot tell a heavier arm from a motor that gives less, so it hides there; but not silently.
    #[test]
    fn a_mass_that_is_heavier_than_stated_is_suspected_and_the_right_one_is_not() {
        let campaign = campaign();
        let far_off_with = |mass_kg: f64| {
            let mut servo = campaign
                .model
                .on(campaign.pendulum, campaign.supply_v, campaign.duty_limit);
            servo.pendulum.mass_kg = mass_kg;
            recalibrated(&campaign, &record(&campaign, &servo, 0.0), far_off)
        };
        let stated_kg = campaign.pendulum.mass_kg;
        assert_eq!(far_off_with(stated_kg), Vec::new());
        let found = far_off_with(1.25 * stated_kg);
        let winding = found
            .iter()
            .find(|one| one.name == "winding and bridge")
            .expect("far off");
        assert!(winding.change > 0.15 && winding.standard_errors > 3.0, "{winding:?}");
        for said in ["heavier or longer than stated", "mass_kg", "supply_v"] {
            assert!(winding.description.contains(said), "{}", winding.description);
        }
    }
}
