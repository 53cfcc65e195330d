//! The energy balance closes under every law, at every instant.

use super::{CYCLE_S, paper, strong};
use crate::effect::Setting;
use crate::{ActsOn, Axis, Crawl, Mechanics, Physics, Table};

/// Largest error of the balance, J, of some 0.1 J.
const GAP_J: f64 = 1e-9;

fn assert_closes(name: &str, physics: &Physics, damping_ratio: Option<f64>) {
    let mechanics = Mechanics::new(physics);
    let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.12, 0.08, 0.04, 0.0], damping_ratio).expect("it holds");
    let held_j = crawl.elastic_energy_j(&mechanics);
    for tenth in 1..=23 {
        crawl
            .advance_to(&mechanics, f64::from(tenth) * 0.1, 0.1 * CYCLE_S)
            .unwrap_or_else(|slides| panic!("{name}: {slides}"));
        let ledger = crawl.ledger();
        let stored_j = crawl.elastic_energy_j(&mechanics) - held_j + crawl.kinetic_energy_j(&mechanics);
        let gap_j = ledger.actuator_net_j - ledger.loss_j() - ledger.settling_loss_j - stored_j;
        assert!(
            gap_j.abs() < GAP_J,
            "{name}, inertia {damping_ratio:?}, tenth {tenth}: {gap_j} J of {ledger:?}"
        );
    }
    assert!(crawl.ledger().actuator_net_j > 0.01, "{name}: nothing was moved");
}

#[test]
fn the_energy_balance_closes_for_every_effect_and_for_all_together() {
    for damping_ratio in [None, Some(0.1)] {
        let mut all = Physics::of(paper(15.0));
        for setting in strong() {
            let name = setting.effect().name;
            assert_closes(name, &Physics::of(paper(15.0)).with([&setting]), damping_ratio);
            all = all.with([&setting]);
        }
        assert_closes("all together", &all, damping_ratio);
    }
}

#[test]
fn the_energy_balance_closes_for_tables_over_every_axis() {
    for axis in Axis::ALL.into_iter().filter(|axis| !axis.is_of_motor()) {
        let width = match axis {
            Axis::Deformation | Axis::RecentDeformation | Axis::RecentSlide => 1e-3,
            Axis::DeformationRate | Axis::Speed | Axis::Place => 1e-2,
            Axis::Phase => 0.3,
            Axis::Slope => 30.0,
            _ => 1.0,
        };
        for acts_on in ActsOn::ALL.into_iter().filter(|acts_on| !acts_on.is_of_motor()) {
            let neutral = acts_on.neutral();
            let grid = [(axis, vec![-width, 0.0, 0.5 * width, width])];
            let unit = if acts_on == ActsOn::DriveDisplacement {
                1e-2
            } else {
                1.0
            };
            let value = [-0.1, 0.02, 0.1, 0.2].map(|value| neutral + unit * value).to_vec();
            let grid = if axis == Axis::Phase {
                [(axis, vec![0.0, 0.2, 0.3, 0.6])]
            } else {
                grid
            };
            let table = Table::new(acts_on, &grid, value, None).expect("a table");
            let name = table.to_string();
            let setting = Setting::of_table(table, None, 4).expect("of all cells");
            for damping_ratio in [None, Some(0.1)] {
                assert_closes(&name, &Physics::of(paper(15.0)).with([&setting]), damping_ratio);
            }
        }
    }
}
