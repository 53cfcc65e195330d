//! Tables against the effects of the library that they reproduce.

use super::{CYCLE_S, effect, paper};
use crate::effect::Setting;
use crate::{ActsOn, Axis, Crawl, Cycle, Mechanics, Physics, Table, steady_cycle_of};

fn table(acts_on: ActsOn, axis: Axis, grid: &[f64], value: &[f64]) -> Setting {
    let table = Table::new(acts_on, &[(axis, grid.to_vec())], value.to_vec(), None).expect("a table");
    Setting::of_table(table, None, 4).expect("of all cells")
}

fn cycle(slope_deg: f64, settings: &[Setting]) -> Cycle {
    let outcome = steady_cycle_of(&Physics::of(paper(slope_deg)).with(settings), CYCLE_S);
    outcome.cycle().unwrap_or_else(|| panic!("{outcome:?}")).clone()
}

/// Positions of every cell after some cycles from rest, m.
fn after(physics: &Physics, cycles: f64) -> Vec<f64> {
    let mechanics = Mechanics::new(physics);
    let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.0, 0.04, 0.08, 0.12], Some(0.4)).expect("it holds");
    crawl
        .advance_to(&mechanics, cycles, cycles * CYCLE_S)
        .expect("it holds");
    crawl.positions_m().to_vec()
}

#[test]
fn a_table_gives_the_cycle_of_the_effect_that_it_reproduces() {
    for slope_deg in [0.0, 30.0] {
        let pairs = [
            (
                effect("viscous-drag", &[20.0]),
                table(ActsOn::ContactForce, Axis::Speed, &[-1.0, 1.0], &[-20.0, 20.0]),
            ),
            (
                effect("constant-drag", &[0.4]),
                table(ActsOn::ContactForce, Axis::Deformation, &[0.0], &[0.1]),
            ),
            (
                effect("slope-clamping", &[0.4]),
                table(
                    ActsOn::FrictionFactor,
                    Axis::Slope,
                    &[0.0, 30.0],
                    &[1.0, 1.0 - 0.4 * (1.0 - 30.0_f64.to_radians().cos())],
                ),
            ),
        ];
        for (named, by_table) in pairs {
            let name = named.effect().name;
            let (named, by_table) = (cycle(slope_deg, &[named]), cycle(slope_deg, &[by_table]));
            let apart_m = (named.advance_m - by_table.advance_m).abs();
            assert!(apart_m < 2e-7, "{name}, {slope_deg}°: {apart_m} m apart");
            let energies_j = [named.energy_loss_j, by_table.energy_loss_j];
            // Of the effect's forces the weight's part is work of another entry; the sum is the same.
            let apart = (energies_j[0] / energies_j[1] - 1.0).abs();
            assert!(apart < 2e-3, "{name}, {slope_deg}°: {energies_j:?} J");
        }
    }
}

#[test]
fn a_table_over_place_or_time_gives_the_crawl_of_the_effect_that_it_reproduces() {
    let factor = 0.6;
    let [from_m, to_m] = [0.05, 0.08];
    let edge_m = 0.5e-3;
    let points_m = [from_m - edge_m, from_m + edge_m, to_m - edge_m, to_m + edge_m];
    let wear: f64 = 0.03;
    let cycles: Vec<f64> = (0..=40).map(|quarter| 0.25 * f64::from(quarter)).collect();
    let left: Vec<f64> = cycles.iter().map(|cycles| (1.0 - wear).powf(*cycles)).collect();
    for (named, by_table) in [
        (
            effect("slick-patch", &[factor, from_m, to_m - from_m]),
            table(
                ActsOn::FrictionFactor,
                Axis::Place,
                &points_m,
                &[1.0, factor, factor, 1.0],
            ),
        ),
        (
            effect("wear", &[wear]),
            table(ActsOn::FrictionFactor, Axis::Time, &cycles, &left),
        ),
    ] {
        let name = named.effect().name;
        let [plain, named, by_table] = [
            after(&Physics::of(paper(20.0)), 10.0),
            after(&Physics::of(paper(20.0)).with(&[named]), 10.0),
            after(&Physics::of(paper(20.0)).with(&[by_table]), 10.0),
        ];
        for cell in 0..4 {
            let apart_m = (named[cell] - by_table[cell]).abs();
            assert!(apart_m < 2e-6, "{name}, cell {cell}: {apart_m} m apart");
            assert!((named[cell] - plain[cell]).abs() > 1e-4, "{name} does something");
        }
    }
}

/// On one cell, and with two axes of which one says nothing, it is the same law.
#[test]
fn a_second_axis_and_a_cell_only_select() {
    let one = table(ActsOn::ContactForce, Axis::Phase, &[0.1, 0.3, 0.5], &[0.0, 0.3, 0.0]);
    let axes = [(Axis::Slope, vec![0.0, 60.0]), (Axis::Phase, vec![0.1, 0.3, 0.5])];
    let both = Table::new(ActsOn::ContactForce, &axes, vec![0.0, 0.3, 0.0, 0.0, 0.3, 0.0], None);
    let both = both.expect("a table");
    let each: Vec<Setting> = (0..4)
        .map(|cell| Setting::of_table(both.clone(), Some(cell), 4).expect("it has the cell"))
        .collect();
    let (one, each) = (cycle(30.0, &[one]), cycle(30.0, &each));
    assert!((one.advance_m - each.advance_m).abs() < 1e-9);
    assert!((one.advance_m - cycle(30.0, &[]).advance_m).abs() > 1e-5);
    let error = Setting::of_table(both, Some(4), 4).expect_err("it has no such cell");
    assert_eq!(error.to_string(), "effect `table`: cell 5 of 4: give 1 to 4");
}

/// What goes forward in a mirrored worm goes backward in the worm.
#[test]
fn a_table_seen_from_the_other_end_acts_the_other_way() {
    let drag = |sign: f64| table(ActsOn::ContactForce, Axis::Slope, &[-30.0, 30.0], &[0.05, sign * 0.1]);
    let physics = Physics::of(paper(30.0)).with(&[drag(1.0)]);
    let there = steady_cycle_of(&physics.clone().mirrored().mirrored(), CYCLE_S);
    let here = steady_cycle_of(&physics, CYCLE_S);
    let [there, here] = [there, here].map(|outcome| outcome.cycle().expect("it crawls").advance_m);
    assert!((there - here).abs() < 1e-12, "{there} and {here}");
}
