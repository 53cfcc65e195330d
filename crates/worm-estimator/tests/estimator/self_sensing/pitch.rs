//! Worms with an inertial sensor: the slope is measured, and told from other loads.

use super::plant::{Drawn, Plant};
use super::{Errors, crawl, seeds};
use worm_estimator::self_sensing::SelfSensing;
use worm_physics::steady_cycle;

#[test]
fn a_pitch_sensor_tells_the_slope_from_other_loads() {
    let [mut slope, mut load] = std::array::from_fn(|_| Errors::default());
    let seeds = seeds(12);
    for seed in seeds.clone() {
        let drag_n = 0.1 * (seed % 4) as f64;
        let drawn = Drawn::new(seed).with_pitch();
        let dragged = drawn.worm.clone().with_resisting_force_n(drag_n);
        let mut plant = Plant::new(&drawn);
        plant.change(dragged.expect("a force in range"));
        let mut sensing = SelfSensing::new(&drawn.told, &drawn.config());
        crawl(&mut plant, &mut sensing, 12, |_, _| {});
        let sensed = sensing.sensed().expect("cycles were seen");
        assert!(sensed.slope_is_measured);
        slope.add(
            sensed.slope_rad.to_degrees() - drawn.slope_deg(),
            1.0,
            sensed.slope_sigma_rad.to_degrees(),
        );
        let weight_n = drawn.told.weight_n() * sensed.slope_rad.sin();
        load.add(sensed.pull_n - weight_n - drag_n, 1.0, sensed.pull_sigma_n);
    }
    println!(
        "{} worms from seed {}, ten cycles, drags of 0 to 0.3 N",
        seeds.end - seeds.start,
        seeds.start
    );
    slope.line("slope, degrees", 1.0);
    load.line("drag, N", 1.0);
    assert!(slope.within(2.0) == 1.0 && slope.coverage() > 0.6);
    assert!(load.within(0.3) > 0.8 && load.coverage() > 0.6);
}

/// A canal that gets steeper is no load where the pitch is measured, and a drag still is one.
#[test]
fn a_steeper_canal_is_no_load() {
    let seeds = seeds(4);
    let [mut steeper, mut dragged, mut count] = [0; 3];
    for seed in seeds.clone() {
        let drawn = Drawn::new(seed).with_pitch();
        let slope_rad = drawn.worm.slope_rad() + 14f64.to_radians();
        let worms = [
            drawn.worm.clone().with_slope_rad(slope_rad),
            drawn.worm.clone().with_resisting_force_n(0.8),
        ];
        let mut usual = Plant::new(&drawn);
        let mut sensing = SelfSensing::new(&drawn.told, &drawn.config());
        crawl(&mut usual, &mut sensing, 10, |_, _| {});
        let worms = worms.map(|worm| worm.expect("figures in range"));
        if worms.iter().any(|worm| steady_cycle(worm).cycle().is_none()) {
            continue;
        }
        count += 1;
        let [is_load, is_drag] = worms.map(|worm| {
            let (mut plant, mut sensing) = (usual.clone(), sensing.clone());
            plant.change(worm);
            let mut seen = false;
            crawl(&mut plant, &mut sensing, 6, |_, sensed| {
                seen |= sensed.changes.more_load
            });
            seen
        });
        steeper += u32::from(is_load);
        dragged += u32::from(is_drag);
    }
    println!(
        "{count} worms from seed {} with a pitch sensor: more load on 14° more {steeper} times, by a drag of 0.8 N {dragged} times",
        seeds.start
    );
    assert!(count > 0 && 5 * steeper <= count && 2 * dragged > count);
}
