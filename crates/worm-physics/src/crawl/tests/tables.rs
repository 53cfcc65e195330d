//! Tables against the effects of the library that they reproduce.

use super::{CYCLE_S, effect, paper};
use crate::effect::Setting;
use crate::{ActsOn, Axis, Crawl, Cycle, Locomotion, Mechanics, Physics, Table, steady_cycle_of};

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

/// A friction that repeats along the canal: the steady cycle is the mean over the canal, and not what happens where the tenth cycle ends.
#[test]
fn the_cycle_in_a_canal_that_repeats_is_the_mean_over_its_periods() {
    let [grid, value] = [[0.0, 0.01, 0.02, 0.03], [1.0, 0.6, 1.0, 1.15]];
    let with_period = |period_m: f64| {
        let axes = [(Axis::Place, grid.to_vec())];
        let table = Table::new(ActsOn::FrictionFactor, &axes, value.to_vec(), Some(period_m)).expect("a table");
        Physics::of(paper(0.0)).with(&[Setting::of_table(table, None, 4).expect("of all cells")])
    };
    for period_m in [0.035, 0.041, 0.06] {
        let physics = with_period(period_m);
        let outcome = steady_cycle_of(&physics, CYCLE_S);
        let cycle = outcome.cycle().expect("it holds");
        let mut motion = Locomotion::at_rest(&physics, &[0.0; 4]).expect("it holds");
        motion.advance_to(10.0, 10.0 * CYCLE_S).expect("it holds");
        let begin_m = motion.mean_position_m();
        motion.advance_to(210.0, 200.0 * CYCLE_S).expect("it holds");
        let mean_m = (motion.mean_position_m() - begin_m) / 200.0;
        let off = cycle.advance_m / mean_m - 1.0;
        assert!(off.abs() < 0.01, "{period_m}: {} m for {mean_m}", cycle.advance_m);
        let lost = cycle.energy_loss_j / cycle.energy_actuator_net_j - 1.0;
        assert!(lost.abs() < 0.03, "{period_m}: {cycle:?}");
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

/// A displacement over the load is the drive's compliance, one over the phase a stroke that is shorter: positions and torque at the cam.
/// That by the load follows one to two increments late, of a hundred in a step.
#[test]
fn a_displacement_gives_the_motion_of_the_effect_that_it_reproduces() {
    // The second one yields as much as the pads do.
    let yielding = |compliance_m_per_n: f64| {
        let displacement_m = [5.0, -5.0].map(|force_n| compliance_m_per_n * force_n);
        (
            effect("actuator-compliance", &[compliance_m_per_n]),
            table(ActsOn::DriveDisplacement, Axis::Load, &[-5.0, 5.0], &displacement_m),
        )
    };
    // A cell falls behind its cam while it steps, and ahead of it while each of the three others does: beside them it steps by so much less.
    let (lost, stroke_m) = (0.05, 11.5e-3);
    let behind_m = [0.0, -0.75 * lost * stroke_m];
    let pairs = [
        yielding(1e-4),
        yielding(1e-3),
        (
            effect("lost-stroke", &[lost]),
            table(ActsOn::DriveDisplacement, Axis::Phase, &[0.0, 0.25], &behind_m),
        ),
    ];
    for slope_deg in [0.0, 25.0] {
        for (named, by_table) in &pairs {
            let name = named.effect().name;
            let physics = |with: &[Setting]| Physics::of(paper(slope_deg)).with(with);
            let [plain, named, by_table] =
                [&[][..], std::slice::from_ref(named), std::slice::from_ref(by_table)].map(|with| load(&physics(with)));
            let difference = |one: &[f64], other: &[f64]| {
                let squares = one.iter().zip(other).map(|(one, other)| (one - other).powi(2));
                squares.sum::<f64>().sqrt()
            };
            let (apart, changed) = (difference(&named.0, &by_table.0), difference(&named.0, &plain.0));
            assert!(
                apart < 0.05 * changed,
                "{name}, {slope_deg}°: {apart} m of {changed} m apart"
            );
            let (apart, changed) = (difference(&named.1, &by_table.1), difference(&named.1, &plain.1));
            assert!(
                apart < 0.1 * changed,
                "{name}, {slope_deg}°: {apart} J of {changed} J apart"
            );
        }
    }
}

/// Distances between cells and the drive's load at places in the third cycle.
fn load(physics: &Physics) -> (Vec<f64>, Vec<f64>) {
    let mechanics = Mechanics::new(physics);
    let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.0; 4], None).expect("it holds");
    let mut found = (Vec::new(), Vec::new());
    for place in 0..200 {
        let phase = 0.02 * (f64::from(place) + 0.3); // never where one step ends and the next begins
        crawl.advance_to(&mechanics, phase, 0.02 * CYCLE_S).expect("it holds");
        if phase > 2.0 {
            let at_m = crawl.positions_m();
            found.0.extend(at_m.iter().map(|cell_m| cell_m - at_m[0]));
            found.1.push(crawl.drive_load_j(&mechanics));
        }
    }
    found
}

/// What goes forward in a mirrored worm goes backward in the worm, over every axis and of everything that a table acts on.
#[test]
fn a_table_seen_from_the_other_end_is_the_crawl_in_reverse() {
    for (acts_on, axis, grid, value) in [
        (ActsOn::ContactForce, Axis::Slope, [-30.0, 0.0, 30.0], [0.05, 0.0, 0.3]),
        (ActsOn::ContactForce, Axis::Phase, [0.0, 0.1, 0.4], [0.0, 0.3, -0.1]),
        (ActsOn::FrictionFactor, Axis::Phase, [0.1, 0.2, 0.7], [0.8, 1.0, 0.9]),
        (ActsOn::FrictionFactor, Axis::Place, [-0.02, 0.0, 0.02], [0.8, 1.0, 0.9]),
        (
            ActsOn::DriveDisplacement,
            Axis::Phase,
            [0.0, 0.25, 0.5],
            [0.0, -1e-3, 0.5e-3],
        ),
        (
            ActsOn::DriveDisplacement,
            Axis::Load,
            [-3.0, 0.0, 3.0],
            [2e-4, 0.0, -5e-4],
        ),
    ] {
        let law = table(acts_on, axis, &grid, &value);
        let name = format!("{} over {}", acts_on.name(), axis.name());
        let physics = Physics::of(paper(20.0)).with(&[law]);
        let back = Mechanics::new(&physics);
        let there = Mechanics::new(&physics.mirrored());
        let first_m = [0.0, 0.04, 0.08, 0.12];
        let mut backward = Crawl::at_rest(&back, 0.0, &first_m, None).expect("it holds");
        let mut forward = Crawl::at_rest(&there, 0.0, &first_m.map(|at_m| -at_m), None).expect("it holds");
        for tenth in 1..=30 {
            let cycles = 0.1 * f64::from(tenth);
            backward.advance_to(&back, -cycles, 0.1 * CYCLE_S).expect("it holds");
            forward.advance_to(&there, cycles, 0.1 * CYCLE_S).expect("it holds");
            for (one_m, other_m) in backward.positions_m().iter().zip(forward.positions_m()) {
                assert!(
                    (one_m + other_m).abs() < 1e-8,
                    "{name}, {cycles} cycles: {one_m} and {other_m} m"
                );
            }
        }
    }
}
