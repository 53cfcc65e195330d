//! A tip holds the sum of its spring and its damper.

use crate::pad::{Pad, PadLaw, Rate};

const STIFFNESS_N_PER_M: f64 = 980.0;
const DAMPING_N_S_PER_M: f64 = 8.0;
const LIMIT_N: f64 = 1.6;
const STEP_S: f64 = 1e-5;

/// A pad without load whose cell moves by so many metres in each increment: deformation and force after each, and the energy that was
/// put in less what is stored and what was lost, J.
fn driven(presliding: f64, shifts_m: impl Iterator<Item = f64>) -> (Vec<(f64, f64)>, f64) {
    let law = PadLaw {
        stiffness_n_per_m: STIFFNESS_N_PER_M,
        forward_n: LIMIT_N,
        backward_n: LIMIT_N,
        static_over_kinetic: 1.0,
        presliding,
        ..PadLaw::default()
    };
    let rate = Rate {
        relaxing: 0.0,
        damping_n_per_m: DAMPING_N_S_PER_M / STEP_S,
    };
    let mut pad = Pad::default();
    let mut balance_j = 0.0;
    let seen = shifts_m.map(|shift_m| {
        let mut hold = law.hold(&pad, 1.0, STEP_S);
        let loaded = law.load(&pad, shift_m, &mut hold, rate);
        let before_n = pad.force_n;
        let lost_j = law.take(&mut pad, &loaded, STEP_S, rate);
        balance_j += 0.5 * (before_n + loaded.force_n) * shift_m - loaded.force_n * loaded.slide_m - lost_j;
        (pad.deformation_m, pad.force_n)
    });
    let seen = seen.collect();
    (seen, balance_j - law.elastic_j(&pad))
}

/// Pulled at v it slides from k δ + c v = F on, and then creeps to F/k: δ = F/k − (c v/k) e^(−k t/c).
#[test]
fn a_tip_that_is_pulled_fast_slides_early_and_its_pad_goes_on_giving() {
    let speed_m_s = 0.05;
    let (seen, gap_j) = driven(0.0, std::iter::repeat_n(speed_m_s * STEP_S, 6000));
    let ahead_m = DAMPING_N_S_PER_M * speed_m_s / STIFFNESS_N_PER_M;
    let bound_m = LIMIT_N / STIFFNESS_N_PER_M;
    let slides_s = (bound_m - ahead_m) / speed_m_s;
    for (number, (deformation_m, force_n)) in seen.iter().enumerate() {
        let time_s = STEP_S * (number + 1) as f64;
        let (expected_m, expected_n) = if time_s < slides_s {
            let deformation_m = speed_m_s * time_s;
            (deformation_m, STIFFNESS_N_PER_M * (deformation_m + ahead_m))
        } else {
            let creeping = (-(time_s - slides_s) * STIFFNESS_N_PER_M / DAMPING_N_S_PER_M).exp();
            (bound_m - ahead_m * creeping, LIMIT_N)
        };
        assert!(
            (deformation_m - expected_m).abs() < 2e-3 * bound_m && (force_n - expected_n).abs() < 2e-3 * LIMIT_N,
            "at {time_s} s: {deformation_m} m and {force_n} N, not {expected_m} m and {expected_n} N"
        );
    }
    assert!(gap_j.abs() < 1e-12, "{gap_j} J of the energy are gone");
}

/// To and fro, on bristles and without: the force never exceeds what the tip holds, and every joule is somewhere.
#[test]
fn no_contact_carries_more_than_its_friction() {
    for presliding in [0.0, 0.02] {
        let to_and_fro = (0..20_000).map(|step| 3e-6 * (1e-3 * f64::from(step)).sin());
        let (seen, gap_j) = driven(presliding, to_and_fro);
        let most_n = seen.iter().fold(0.0_f64, |most, (_, force_n)| most.max(force_n.abs()));
        assert!(
            most_n > 0.95 * LIMIT_N && most_n <= LIMIT_N * (1.0 + 1e-12),
            "{most_n} N"
        );
        // On bristles the force changes within an increment while the tip slides.
        assert!(gap_j.abs() < 1e-12, "presliding {presliding}: {gap_j} J are gone");
    }
}
