//! How far the battery lasts: what the estimator says after three cycles, against virtual worms that crawl on until only the reserve is left.
//!
//! The estimator knows the configuration; each worm's battery, hotel power, friction inside and tips are others. Statistics over hundreds of
//! drawn worms are in the estimator's own tests; this one has the registers, the tracker and the cycles of the whole system.

use super::harness::{config, crawling, wired};
use wormd::link::virtual_worm::Options;
use wormd::soak::Machine;

/// A battery for some forty cycles.
const CONFIGURED: &str = "battery.capacity_j = 80.0\n";

#[test]
fn after_three_cycles_the_range_is_within_its_interval() {
    for (seed, hidden) in [
        "battery.capacity_j = 80.0\n",
        "battery.capacity_j = 84.0\nvirtual_worm.inner_friction_n_m = 0.0005\n",
        "battery.capacity_j = 77.0\nvirtual_worm.inner_friction_n_m = 0.025\n",
        "battery = { capacity_j = 78.0, hotel_power_w = 0.55 }\nvirtual_worm.max_deformation_m = 0.0019\n",
        "battery = { capacity_j = 82.0, hotel_power_w = 0.46 }\nvirtual_worm.max_deformation_m = 0.0016\n",
    ]
    .into_iter()
    .enumerate()
    {
        let truth = config(&format!("{hidden}virtual_worm.seed = {}\n", seed + 1));
        let mut session = crawling(&config(CONFIGURED), wired(&truth, &Options::default()), 1000.0);
        session.cycles = Some(Vec::new());
        while session.ranges.len() < 3 {
            session.run_s(0.01, |_| {});
            assert!(session.now_s() < 12.0, "three cycles take 7.5 s");
        }
        let said = session.ranges[2];
        let at_m = session.machine.plant().total().advance_m;
        while session.machine.plant().supply().charge_share() > 0.1 {
            session.run_s(0.1, |_| {});
            assert!(session.now_s() < 300.0, "the battery is empty after some 100 s");
        }
        let rest_m = session.machine.plant().total().advance_m - at_m;
        println!(
            "{}: {:.0} mm, said {:.0} ({:.0} to {:.0})",
            hidden.replace('\n', " "),
            1e3 * rest_m,
            1e3 * said.range_m,
            1e3 * said.range_low_m,
            1e3 * said.range_high_m
        );
        assert!(
            (said.range_low_m..=said.range_high_m).contains(&rest_m),
            "{hidden}: {rest_m} m, said {said:?}"
        );
        assert!(
            said.range_high_m - said.range_low_m < 0.5 * rest_m,
            "{hidden}: {said:?} says little"
        );
    }
}
