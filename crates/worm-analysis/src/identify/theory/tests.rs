//! The body's swing: gone where damping is large, an exact oscillator where it is not.

use super::{CRITICAL, Swing, TheoryBody};
use worm_physics::{Motion, Worm};

const SPEED_M_S: f64 = 4e-3; // the jump of the body's velocity when a tip begins to slide

fn worm() -> Worm {
    Worm::paper()
        .with_max_deformations_m(&[2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3])
        .and_then(|worm| worm.with_slope_rad(0.3))
        .expect("a worm")
}

fn natural_rad_s(worm: &Worm) -> f64 {
    (980.0 * 3.0 / worm.mass_kg()).sqrt() // one of four tips slides
}

/// The damper drags a little at tips that slide, so each cycle may add its own micrometre or two.
#[test]
fn with_great_damping_the_way_is_quasi_static() {
    let worm = worm();
    let start_m = [-1e-3, -0.5e-3, 0.2e-3, 0.0];
    let mut body = TheoryBody::at_rest(&worm, 0.3, &start_m, 100.0);
    let mut motion = Motion::under_way(&worm, 0.3, &[0.0; 4], &start_m);
    let mut off_m = 0.0; // at the end of the cycle before
    for sample in 1..=3000 {
        let phase = 0.3 + f64::from(sample) / 300.0;
        let displacement_m = body.go_to(phase, 1.0 / 120.0).expect("it holds");
        motion.advance_to(&worm, phase).expect("it holds");
        let quasi_static_m = motion.mean_position_m() - worm.stroke_m() * (phase - 0.3);
        let more_m: f64 = displacement_m - quasi_static_m - off_m;
        assert!(more_m.abs() < 2e-6, "sample {sample}: off by {more_m} m more");
        if sample % 300 == 0 {
            off_m += more_m;
        }
    }
}

#[test]
fn a_swing_without_damping_neither_gains_nor_loses() {
    let worm = worm();
    let natural_rad_s = natural_rad_s(&worm);
    let mut swing = Swing::new(&worm, 0.0);
    swing.velocity_m_s = SPEED_M_S;
    for _ in 0..100_000 {
        swing.swing(1.7e-3);
        let speed_m_s = swing.velocity_m_s.hypot(natural_rad_s * swing.at_m);
        assert!((speed_m_s / SPEED_M_S - 1.0).abs() < 1e-9, "{speed_m_s} m/s");
    }
}

#[test]
fn a_jump_of_velocity_leaves_the_excursion_of_an_oscillator() {
    let worm = worm();
    for damping_ratio in [0.01, 0.05, 0.3, 0.9] {
        let mut swing = Swing::new(&worm, damping_ratio);
        swing.velocity_m_s = SPEED_M_S;
        let mut peak_m = 0.0_f64;
        for _ in 0..2000 {
            swing.swing(2e-5);
            peak_m = peak_m.max(swing.at_m);
        }
        let turn = (1.0 - damping_ratio * damping_ratio).sqrt();
        let fade = (-damping_ratio / turn * (turn / damping_ratio).atan()).exp();
        let expected_m = SPEED_M_S / natural_rad_s(&worm) * fade;
        assert!(
            (peak_m / expected_m - 1.0).abs() < 1e-4,
            "ζ {damping_ratio}: {peak_m} m, not {expected_m} m"
        );
    }
}

/// Just below and just above critical damping lie on either side of the critical form, equally far off.
#[test]
fn both_forms_meet_at_critical_damping() {
    let worm = worm();
    let natural_rad_s = natural_rad_s(&worm);
    let after = |damping_ratio: f64, time_s: f64| {
        let mut swing = Swing::new(&worm, damping_ratio);
        swing.velocity_m_s = SPEED_M_S;
        swing.swing(time_s);
        swing
    };
    for time_s in [0.001, 0.005, 0.02, 0.05] {
        let (under, over) = (after(1.0 - 1.1 * CRITICAL, time_s), after(1.0 + 1.1 * CRITICAL, time_s));
        let critical_m = SPEED_M_S * time_s * (-natural_rad_s * time_s).exp();
        let critical_m_s = critical_m * (1.0 / time_s - natural_rad_s);
        let (at_m, velocity_m_s) = (
            0.5 * (under.at_m + over.at_m),
            0.5 * (under.velocity_m_s + over.velocity_m_s),
        );
        assert!(
            (at_m / critical_m - 1.0).abs() < 1e-4,
            "{time_s} s: {at_m} m, not {critical_m} m"
        );
        assert!(
            (velocity_m_s / critical_m_s - 1.0).abs() < 1e-4,
            "{time_s} s: {velocity_m_s} m/s, not {critical_m_s}"
        );
        let between = (after(1.0, time_s).at_m / critical_m - 1.0).abs();
        assert!(between < 0.01, "ζ = 1 at {time_s} s is off by the share {between}");
    }
}
