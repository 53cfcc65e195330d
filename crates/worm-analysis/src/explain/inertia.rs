//! How much more the model is wrong where the worm is fast.
//!
//! The model has no mass but that of the body as a whole. At each start and stop of a step the body is pushed by stroke / T, T the time
//! of a cycle, and swings on its tips by that over their natural frequency ω = √(Σ k / m); what becomes of it at the tips is of second
//! order, as (ω T)⁻². The discrepancy of clean worms in MuJoCo, which have all their masses, follows this law from 0.9 to 9 s a cycle:
//! the evidence of 52 of them prefers it to the best discrepancy that is the same at every speed by a factor of e¹⁰⁰⁹. Three of them, at
//! 0.9 to 1.3 s a cycle, make most of it; worms with mass of the project's own need none of it. Much of it is the time step with which
//! those worms in MuJoCo were made (docs/results.md), so for fast worms this errs on the safe side.

use worm_physics::Worm;

/// ω T at which the discrepancy's scale is stated, rad: the paper's worm at 2.3 s a cycle.
const REFERENCE_RAD: f64 = 250.0;
/// What is left of the discrepancy at rest: contact laws are as wrong there.
const AT_REST: f64 = 0.4;

/// By how much more the model of a worm is wrong at so many seconds a cycle than at the reference.
pub(super) fn inexactness(worm: &Worm, cycle_s: f64) -> f64 {
    let whole_n_per_m: f64 = worm.contacts().iter().map(|contact| contact.stiffness_n_per_m).sum();
    let of_cycle_rad = (whole_n_per_m / worm.mass_kg()).sqrt() * cycle_s;
    AT_REST.hypot((REFERENCE_RAD / of_cycle_rad).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_falls_with_the_square_of_the_time_of_a_cycle_down_to_a_part_that_stays() {
        let worm = Worm::paper();
        let at = |cycle_s: f64| inexactness(&worm, cycle_s);
        assert!((at(0.25) / at(0.5) - 4.0).abs() < 0.01);
        assert!((at(20.0) - AT_REST).abs() < 0.01);
        let heavier = worm.clone().with_mass_kg(4.0 * worm.mass_kg()).expect("a mass");
        assert!((inexactness(&heavier, 2.0) - at(1.0)).abs() < 1e-9);
    }
}
