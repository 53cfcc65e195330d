//! A tip on bristles behind a drive that yields.

use crate::pad::{Pad, PadLaw, Rate};

const COMPLIANCE_M_PER_N: f64 = 2e-4;
const STEP_S: f64 = 4e-3;

/// The closed form is the shift at which the drive's displacement is the cell's and what the compliance takes.
#[test]
fn the_closed_form_balances_drive_and_tip() {
    let law = PadLaw {
        stiffness_n_per_m: 980.0,
        forward_n: 1.6,
        backward_n: 1.3,
        static_over_kinetic: 1.0,
        presliding: 0.02,
        ..PadLaw::default()
    };
    let mut pad = Pad::default();
    // To and fro, damped and not, up to several times what the tip can hold.
    for number in 0..400 {
        let angle = 0.1 * f64::from(number);
        let driven_m = 1e-3 * angle.sin() * (0.37 * angle).cos();
        let rate = Rate {
            relaxing: 0.0,
            damping_n_per_m: if number % 3 == 0 { 0.0 } else { 8.0 / STEP_S },
        };
        let hold = law.hold(&pad, 1.0, STEP_S);
        let loaded = law.load_bristles(&pad, driven_m, &mut hold.clone(), rate, COMPLIANCE_M_PER_N);
        let shift_m = driven_m - COMPLIANCE_M_PER_N * (loaded.force_n - pad.force_n);
        let by_shift = law.load(&pad, shift_m, &mut hold.clone(), rate);
        assert!((by_shift.force_n - loaded.force_n).abs() < 1e-9, "increment {number}");
        assert!((by_shift.deformation_m - loaded.deformation_m).abs() < 1e-12);
        assert!((by_shift.slide_m - loaded.slide_m).abs() < 1e-12);
        assert!((by_shift.tangent_n_per_m - loaded.tangent_n_per_m).abs() < 1e-6 * loaded.tangent_n_per_m + 1e-6);
        law.take(&mut pad, &loaded, STEP_S, rate);
    }
}
