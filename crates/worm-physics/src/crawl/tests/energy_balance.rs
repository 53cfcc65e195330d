//! The account of energy closes under every law, at every instant.

use super::{CYCLE_S, paper, strong};
use crate::{Crawl, Mechanics, Physics};

/// Largest gap, J, beside some 0.1 J that are moved.
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
fn the_account_closes_for_every_effect_and_for_all_together() {
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
