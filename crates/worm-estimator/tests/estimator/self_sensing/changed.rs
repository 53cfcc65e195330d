//! What is said of a worm that has changed, and of one that has not.

use super::plant::Plant;
use super::{Errors, any_cell, crawl, seeds, worm_of};
use worm_estimator::self_sensing::{Changes, SelfSensing, Standing};
use worm_physics::{Worm, steady_cycle};

/// Cycles after a change until something is reported, at most `cycles`; and what is reported then.
fn reported(plant: &mut Plant, sensing: &mut SelfSensing, cycles: usize) -> Option<(usize, Changes)> {
    let from = plant.cycles();
    let mut first = None;
    crawl(plant, sensing, cycles, |plant, sensed| {
        if sensed.changes.any() && first.is_none() {
            first = Some((plant.cycles() - from, sensed.changes));
        }
    });
    first
}

/// To what shares the friction of all cells falls.
const ALL_TO: [f64; 3] = [0.7, 0.4, 0.2];

#[test]
fn a_changed_worm_is_reported() {
    let [mut lost, mut right_cell, mut nearly_all_lost, mut jammed, mut loaded] = [0; 5];
    let seeds = seeds(6);
    let count = (seeds.end - seeds.start) as f64;
    let sliding = |worm: &Worm| worm.check_hold().is_err() || steady_cycle(worm).cycle().is_none();
    let mut nearly_all_can = 0.0;
    let [mut loss, mut rise, mut friction] = std::array::from_fn(|_| Errors::default());
    let mut of_all = [[0; 4]; ALL_TO.len()];
    for seed in seeds.clone() {
        let (drawn, plant, mut sensing) = worm_of(seed);
        let cell = any_cell(&drawn);
        let mut usual = plant;
        // The first two are not fitted.
        crawl(&mut usual, &mut sensing, 11, |_, sensed| {
            assert!(!sensed.changes.any(), "seed {seed}")
        });
        let try_out = |worm: Worm, mut friction: Option<&mut Errors>| {
            let (mut plant, mut sensing) = (usual.clone(), sensing.clone());
            plant.change(worm.clone());
            let found = reported(&mut plant, &mut sensing, 3);
            for (cell, contact) in worm.contacts().iter().enumerate() {
                let sensed = sensing.sensed().filter(|sensed| sensed.standing == Standing::Changed);
                if let (Some(errors), Some(sensed)) = (&mut friction, sensed) {
                    let truth_n = contact.stiffness_n_per_m * contact.forward_bound_m;
                    errors.add(
                        sensed.friction_n[cell] - truth_n,
                        truth_n,
                        sensed.friction_sigma_n[cell],
                    );
                }
            }
            found.map(|(_, changes)| changes)
        };
        let mut wet = drawn.worm.clone();
        wet.scale_friction(Some(cell), 0.7);
        if let Some(changes) = try_out(wet, Some(&mut friction)) {
            if changes.friction_lost == 1 << cell {
                loss.add(changes.loss_share - 0.3, 0.3, changes.loss_sigma);
            }
            lost += u32::from(changes.friction_lost != 0);
            right_cell += u32::from(changes.friction_lost == 1 << cell);
        }
        let mut wet = drawn.worm.clone();
        wet.scale_friction(Some(cell), 0.3);
        if !sliding(&wet) {
            nearly_all_can += 1.0;
            nearly_all_lost += u32::from(try_out(wet, None).is_some_and(|changes| changes.friction_lost == 1 << cell));
        }
        for (factor, [can, lost, all, loaded]) in ALL_TO.into_iter().zip(&mut of_all) {
            let mut wet = drawn.worm.clone();
            wet.scale_friction(None, factor);
            if !sliding(&wet) {
                *can += 1;
                let changes = try_out(wet, None).unwrap_or_default();
                *lost += u32::from(changes.friction_lost != 0);
                *all += u32::from(changes.all_friction_lost);
                *loaded += u32::from(changes.friction_lost == 0 && changes.any());
                if std::env::var("WORMD_EACH").is_ok() && changes.friction_lost == 0 {
                    println!("seed {seed}, {:.1}°, all to {factor}: {changes:?}", drawn.slope_deg());
                }
            }
        }
        let stuck = drawn
            .worm
            .clone()
            .with_stroke_scale(cell, 0.0)
            .expect("a stroke in range");
        jammed += u32::from(try_out(stuck, None).is_some_and(|changes| changes.jammed == 1 << cell));
        let dragged = drawn
            .worm
            .clone()
            .with_resisting_force_n(0.8)
            .expect("a force in range");
        if !sliding(&dragged) {
            let changes = try_out(dragged, None).unwrap_or_default();
            loaded += u32::from(changes.any());
            if changes.more_load {
                rise.add(changes.load_rise_n - 0.8, 0.8, changes.load_rise_sigma_n);
            }
        }
    }
    let percent = |part: u32, of: f64| 100.0 * f64::from(part) / of;
    println!(
        "{count} worms from seed {}, a change after nine cycles that were fitted, reported within three",
        seeds.start
    );
    println!(
        "30 % of a cell's friction lost: {:.0} %, that cell {:.0} %",
        percent(lost, count),
        percent(right_cell, count)
    );
    println!(
        "70 % of a cell's friction lost, that cell: {:.0} %",
        percent(nearly_all_lost, nearly_all_can)
    );
    for (factor, [can, lost, all, loaded]) in ALL_TO.into_iter().zip(of_all) {
        println!(
            "all friction to {factor}, {can} worms that hold: {:.0} %, of all cells {:.0} %, under another name {:.0} %",
            percent(lost, can.into()),
            percent(all, can.into()),
            percent(loaded, can.into())
        );
    }
    println!(
        "jammed, that cell: {:.0} %; drag of 0.8 N: {:.0} %",
        percent(jammed, count),
        percent(loaded, count)
    );
    loss.line("share lost, %", 100.0);
    friction.line("friction of all cells then, %", 100.0);
    rise.line("rise of the load, %", 100.0);
    assert!(percent(right_cell, count) > 80.0 && percent(jammed, count) > 80.0);
    assert!(friction.coverage() > 0.75);
    assert!(of_all.iter().all(|[can, _, all, _]| 10 * all >= 9 * can), "{of_all:?}");
}

#[test]
fn a_sound_worm_raises_nothing() {
    let mut hours = 0.0;
    let seeds = seeds(4);
    for seed in seeds.clone() {
        let (_, mut plant, mut sensing) = worm_of(seed);
        crawl(&mut plant, &mut sensing, 100, |plant, sensed| {
            assert!(
                !sensed.changes.any(),
                "seed {seed}, cycle {}: {:?}",
                plant.cycles(),
                sensed.changes
            );
        });
        hours += 100.0 * 2.5 / 3600.0;
    }
    println!("{hours:.1} simulated hours from seed {} without an alarm", seeds.start);
}
