//! Every friction law that a worm's tips may be given.

use super::{advance_m, slow_advance_of_m};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use testkit::hidden_effects::body::Worm;
use testkit::hidden_effects::deviations::Deviations;
use testkit::hidden_effects::effect_size::advances_m;
use testkit::hidden_effects::parameters::WormParameters;
use testkit::hidden_effects::scene::{STEP_S, Scene};
use testkit::hidden_effects::tip::contact::{Contact, Law};
use testkit::hidden_effects::tip::dahl::Dahl;
use testkit::hidden_effects::tip::laws::Laws;
use testkit::hidden_effects::tip::weakening::Weakening;
use testkit::hidden_effects::tip::{Limits, Pad, Tip};

/// Contacts drawn at random: enough that each law with both kinds of weakening is among them.
fn contacts() -> Vec<Contact> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    (0..24).map(|_| Contact::draw(&mut rng)).collect()
}

/// Name of a contact's law in messages.
fn name(contact: &Contact) -> &'static str {
    match contact.law {
        Law::Lugre(_) => "lugre",
        Law::ElastoPlastic(_) => "elasto-plastic",
        Law::Dahl(Dahl { .. }) => "dahl",
        Law::Coulomb(_) => "coulomb",
    }
}

/// The first contact of each law, Dahl's two knees counted as two, with each kind of weakening.
fn one_of_each() -> Vec<Contact> {
    let kind = |contact: &Contact| {
        let knee = match contact.law {
            Law::Dahl(Dahl { knee }) => Some(knee),
            _ => None,
        };
        (
            name(contact),
            knee,
            matches!(contact.weakening, Weakening::Velocity { .. }),
        )
    };
    let mut each: Vec<Contact> = Vec::new();
    for contact in contacts() {
        if each.iter().all(|other| kind(other) != kind(&contact)) {
            each.push(contact);
        }
    }
    each
}

const LIMIT_N: f64 = 1.715;

/// The nominal pad on a contact.
fn pad(contact: Contact, static_over_kinetic: f64) -> Pad {
    Pad {
        stiffness_n_per_m: 980.0,
        damping_n_s_per_m: 5.0,
        hardening: 0.0,
        laws: Laws::default(),
        discrepancy_m: 0.0,
        creep_share: 0.0,
        creep_s: 1.0,
        yielding_share: 0.0,
        yielding_m: 1.75e-3,
        bristle_n_per_m: LIMIT_N / contact.presliding_m,
        contact,
        static_over_kinetic,
    }
}

const LIMITS: Limits = Limits {
    forward_n: LIMIT_N,
    backward_n: LIMIT_N,
};

#[test]
fn every_law_is_drawn() {
    let mut seen: Vec<_> = one_of_each().iter().map(name).collect();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen, ["coulomb", "dahl", "elasto-plastic", "lugre"]);
    let weakens_with_velocity = |contact: &Contact| matches!(contact.weakening, Weakening::Velocity { .. });
    assert!(contacts().iter().any(weakens_with_velocity) && !contacts().iter().all(weakens_with_velocity));
}

/// A tip loaded to nine tenths of its limit stays for as long as a run lasts.
#[test]
fn a_resting_tip_does_not_creep() {
    for contact in contacts() {
        let pad = pad(contact, contact.static_over_kinetic);
        for sign in [1.0, -1.0] {
            let mut tip = Tip::laid_down(0.0);
            let mut rest = |cell_m_s: f64, lasts_s: f64| {
                for _ in 0..(lasts_s / STEP_S) as usize {
                    tip.follow(sign * cell_m_s * STEP_S, STEP_S, &pad, LIMITS);
                }
                tip.place_m
            };
            rest(0.9 * LIMIT_N / pad.stiffness_n_per_m / 0.2, 0.2);
            let settled_m = rest(0.0, 0.5);
            let crept_m = (rest(0.0, 30.0) - settled_m).abs();
            assert!(crept_m < 2e-6, "{} crept {crept_m} m: {contact:?}", name(&contact));
        }
    }
}

/// A cell that is pulled along as in a step first meets the static bound, then the kinetic one; the severity is their ratio.
#[test]
fn the_static_bound_stands_above_the_kinetic_one() {
    for contact in contacts() {
        for ratio in [1.0, 1.05, 1.3, 1.8] {
            let pad = pad(contact, ratio);
            let mut tip = Tip::laid_down(0.0);
            let cell_m_s = 18e-3;
            let mut max_n: f64 = 0.0;
            for _ in 0..(2.0 / STEP_S) as usize {
                tip.follow(cell_m_s * STEP_S, STEP_S, &pad, LIMITS);
                max_n = max_n.max(tip.force_n);
            }
            let message = format!(
                "{}, ratio {ratio}: {max_n} N, then {} N: {contact:?}",
                name(&contact),
                tip.force_n
            );
            // To it add the viscous part and, while the bristle bends, its damper.
            let excess = max_n / LIMIT_N - 1.0;
            assert!(excess < 1.02 * (ratio - 1.0) + 0.01, "{message}");
            // The faster a contact is loaded and the rounder its knee, the less of a small excess is felt.
            assert!(excess > 0.4 * (ratio - 1.0) - 1e-3, "{message}");
            let slides_n = tip.force_n / LIMIT_N - 1.0;
            assert!((-0.01..0.01).contains(&slides_n), "{message}");
        }
    }
}

/// The law alone is no effect: the worm crawls as on rigid tips.
#[test]
fn a_clean_worm_is_clean_under_every_law() {
    let worm = |contact: Contact, damping_ratio: f64| Worm {
        parameters: WormParameters {
            contact,
            damping_ratio,
            ..WormParameters::nominal()
        },
        deviations: Deviations::default(),
        unmodelled: None,
    };
    let level_m = advance_m(&worm(Contact::rigid(), 0.3), 0.0);
    for slope_deg in [0.0, 30.0, 45.0] {
        let slow_m = slow_advance_of_m(&worm(Contact::rigid(), 1.0), slope_deg);
        let rigid_m = advance_m(&worm(Contact::rigid(), 0.3), slope_deg);
        for contact in one_of_each() {
            let change = slow_advance_of_m(&worm(contact, 1.0), slope_deg) / slow_m - 1.0;
            println!("{} at {slope_deg}°, slow: {:+.2} %", name(&contact), 1e2 * change);
            assert!(change.abs() < 0.0125, "at {slope_deg}°, slow: {change} of {contact:?}");
        }
        for contact in one_of_each() {
            let change = (advance_m(&worm(contact, 0.3), slope_deg) - rigid_m) / level_m;
            assert!(
                change.abs() < 0.01,
                "at {slope_deg}°: {change} of the level's advance, {contact:?}"
            );
        }
    }
}

#[test]
fn half_the_time_step_changes_nothing_that_matters() {
    for contact in one_of_each() {
        let worm = Worm {
            parameters: WormParameters {
                contact,
                damping_ratio: 0.1,
                rounding: 0.002,
                ..WormParameters::nominal()
            },
            deviations: Deviations {
                static_over_kinetic: 1.3,
                hardening: 0.5,
                creep_share: 0.3,
                yielding_share: 0.2,
                compliance_m_per_n: 3e-4,
                drag_n_s_per_m: 5.0,
                play_m: 0.3e-3,
                ..Deviations::default()
            },
            unmodelled: None,
        };
        for slope_deg in [0.0, 30.0] {
            let advance_m = |step_s: f64| {
                let scene = Scene {
                    cycles: 3.0,
                    step_s,
                    ..Scene::ideal(slope_deg, 2.5)
                };
                advances_m(&scene.simulate(&worm).expect("the worm holds"))[2]
            };
            let ratio = advance_m(0.5 * STEP_S) / advance_m(STEP_S);
            assert!(
                (ratio - 1.0).abs() < 0.005,
                "at {slope_deg}° the advance changes by a factor {ratio}: {contact:?}"
            );
        }
    }
}
