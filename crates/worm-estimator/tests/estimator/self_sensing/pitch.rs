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

/// While the sensor is silent nothing is measured, and a new slope counts with the first cycle on it.
#[test]
fn a_silent_sensor_measures_nothing_and_a_new_slope_counts_at_once() {
    for seed in seeds(4) {
        let drawn = Drawn::new(seed).with_pitch();
        let mut plant = Plant::new(&drawn);
        let mut sensing = SelfSensing::new(&drawn.told, &drawn.config());
        crawl(&mut plant, &mut sensing, 15, |_, _| {});
        let before = *sensing.sensed().expect("cycles were seen");
        assert!(before.slope_is_measured);
        let end = plant.cycles() + 8;
        while plant.cycles() < end {
            let mut sample = plant.tick();
            sample.pitch_rad = f64::NAN;
            sensing.update(&sample);
        }
        sensing.finish();
        let silent = *sensing.sensed().expect("cycles were seen");
        let [sigma_deg, before_deg] = [silent, before].map(|sensed| sensed.slope_sigma_rad.to_degrees());
        println!("seed {seed}: slope ± {before_deg:.1}°, without the sensor ± {sigma_deg:.1}°");
        assert!(!silent.slope_is_measured && sigma_deg > before_deg, "seed {seed}");

        let (steeper_deg, worm) = (4.0, drawn.worm.clone());
        let slope_rad = worm.slope_rad() + f64::to_radians(steeper_deg);
        let steeper = worm.with_slope_rad(slope_rad).expect("a slope in range");
        if steady_cycle(&steeper).cycle().is_none() {
            continue;
        }
        crawl(&mut plant, &mut sensing, 3, |_, _| {});
        plant.change(steeper);
        // The cycle under way ends on the new slope.
        crawl(&mut plant, &mut sensing, 2, |_, _| {});
        let after = sensing.sensed().expect("cycles were seen");
        let off_deg = after.slope_rad.to_degrees() - slope_rad.to_degrees();
        println!("seed {seed}: {off_deg:+.2}° off after a rise of {steeper_deg}°");
        assert!(after.slope_is_measured && off_deg.abs() < 1.5, "seed {seed}");
    }
}
