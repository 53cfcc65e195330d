//! Which settings are accepted, and that neutral values have no effect.

use super::{CYCLE_S, of_cell, paper};
use std::collections::BTreeMap;
use worm_physics::effect::{Effect, LIBRARY, Scope, Setting};
use worm_physics::study::{Study, study};
use worm_physics::{Crawl, Locomotion, Mechanics, Physics};

const FIRST_M: [f64; 4] = [0.12, 0.08, 0.04, 0.0];

fn neutral(effect: &'static Effect) -> Setting {
    let values: Vec<f64> = effect.parameters.iter().map(|parameter| parameter.neutral).collect();
    let cell = (effect.scope == Scope::OneCell).then_some(2);
    Setting::new(effect, cell, &values, 4).expect("neutral values are allowed")
}

/// Positions after a cycle and a half, by the motion that the physics need and by the incremental one with mass.
fn positions_m(physics: &Physics) -> Vec<f64> {
    let mut motion = Locomotion::at_rest(physics, &FIRST_M).expect("it holds");
    motion.advance_to(1.5, 1.5 * CYCLE_S).expect("it holds");
    assert!(motion.is_exact());
    let mechanics = Mechanics::new(physics);
    let mut crawl = Crawl::at_rest(&mechanics, 0.0, &FIRST_M, Some(0.1)).expect("it holds");
    crawl.advance_to(&mechanics, 1.5, 1.5 * CYCLE_S).expect("it holds");
    [motion.positions_m(), crawl.positions_m()].concat()
}

#[test]
fn neutral_values_change_nothing_to_the_last_bit() {
    let plain = Physics::of(paper(20.0));
    let expected_m = positions_m(&plain);
    for effect in LIBRARY {
        let physics = plain.clone().with([&neutral(effect)]);
        assert_eq!(positions_m(&physics), expected_m, "{}", effect.name);
        assert_eq!(
            (physics.view, physics.slowdown_per_n),
            (plain.view, plain.slowdown_per_n),
            "{}",
            effect.name
        );
    }
}

#[test]
fn values_are_taken_to_their_ends_and_not_beyond() {
    for effect in LIBRARY {
        let neutral = neutral(effect);
        for (at, parameter) in effect.parameters.iter().enumerate() {
            let with = |value: f64| {
                let mut values = neutral.values().to_vec();
                values[at] = value;
                Setting::new(effect, neutral.cell(), &values, 4)
            };
            let width = parameter.max - parameter.min;
            for value in [parameter.min, parameter.max] {
                assert_eq!(with(value).expect("in range").values()[at], value);
            }
            for value in [parameter.min - 1e-6 * width, parameter.max + 1e-6 * width, f64::NAN] {
                let error = with(value).expect_err("out of range").to_string();
                assert!(
                    error.contains(parameter.name) && error.contains("must be from"),
                    "{error}"
                );
            }
        }
    }
}

/// A shape that is left out has its usual value, a severity or a place in the canal none.
#[test]
fn a_shape_that_is_left_out_is_the_usual_one() {
    let given = |name: &str, parameters: &[(&str, f64)]| {
        let parameters: BTreeMap<String, f64> = parameters
            .iter()
            .map(|(name, value)| ((*name).to_owned(), *value))
            .collect();
        Setting::by_names(name, None, &parameters, 4).map(|setting| setting.values().to_vec())
    };
    assert_eq!(given("backlash", &[("play_m", 1e-3)]).expect("complete"), [1e-3, 20.0]);
    assert_eq!(
        given("pad-creep", &[("creep_share", 0.4)]).expect("complete"),
        [0.4, 0.5]
    );
    for (name, parameters, missing) in [
        ("backlash", &[("damping_n_s_per_m", 5.0)][..], "play_m"),
        ("slick-patch", &[("friction_factor", 0.5), ("length_m", 0.02)], "from_m"),
    ] {
        let error = given(name, parameters).expect_err("incomplete").to_string();
        assert!(error.contains(missing), "{error}");
    }
}

/// An effect that names a cell needs designs that have it.
#[test]
fn a_study_refuses_an_effect_on_a_cell_that_a_design_lacks() {
    let base = paper(0.0);
    let clamped = [of_cell("unequal-clamping", Some(3), &[1.2])];
    let rows = |cells: &[usize]| {
        study(&Study {
            base: &base,
            effects: &clamped,
            cells,
            slopes_deg: &[0.0],
            cycle_s: CYCLE_S,
        })
    };
    assert_eq!(rows(&[4, 5]).expect("both have cell 4").len(), 2);
    let error = rows(&[4, 3]).expect_err("3 cells have no cell 4").to_string();
    assert!(
        error.contains("a design of 3 cells") && error.contains("cell 4 of 3"),
        "{error}"
    );
}

#[test]
fn what_is_no_effect_is_refused_with_a_remedy() {
    let values = |pairs: &[(&str, f64)]| -> BTreeMap<String, f64> {
        pairs.iter().map(|&(name, value)| (name.to_owned(), value)).collect()
    };
    type Case<'a> = (&'a str, Option<usize>, &'a [(&'a str, f64)], &'a str);
    let cases: [Case<'_>; 7] = [
        (
            "constant-drug",
            None,
            &[("force_n", 0.1)],
            "the library has unequal-clamping, ",
        ),
        ("constant-drag", None, &[], "needs `force_n`"),
        (
            "constant-drag",
            None,
            &[("force_n", 0.1), ("mass_kg", 0.1)],
            "has no parameter `mass_kg`: it has force_n",
        ),
        (
            "constant-drag",
            Some(1),
            &[("force_n", 0.1)],
            "the whole worm: leave `cell` out",
        ),
        (
            "unequal-clamping",
            None,
            &[("friction_factor", 0.7)],
            "say which `cell` it concerns, 1 to 4",
        ),
        (
            "unequal-clamping",
            Some(4),
            &[("friction_factor", 0.7)],
            "cell 5 of 4: give 1 to 4",
        ),
        (
            "lost-stroke",
            Some(9),
            &[("lost_share", 0.1)],
            "cell 10 of 4: give 1 to 4",
        ),
    ];
    for (name, cell, pairs, expected) in cases {
        let error = Setting::by_names(name, cell, &values(pairs), 4)
            .expect_err(name)
            .to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn clamped_values_are_always_numbers_in_range() {
    for effect in LIBRARY {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0] {
            let setting = Setting::within(effect, None, &[value; 3]);
            for (kept, parameter) in setting.values().iter().zip(effect.parameters) {
                let (name, range) = (effect.name, parameter.min..=parameter.max);
                assert!(range.contains(kept), "{name}, {}: {kept} from {value}", parameter.name);
                assert!(!value.is_nan() || *kept == parameter.neutral, "{name}: {kept}");
            }
        }
    }
}
