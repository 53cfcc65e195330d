//! Self-sensing on drawn worms in virtual time. `WORMD_SEEDS=200` draws as many; without it a small sample. With `WORMD_PITCH` set, every
//! worm has an inertial sensor.

mod accident;
mod cannot_tell;
mod change_over;
mod pitch;
mod plant;

use plant::{Drawn, Plant};
use worm_estimator::self_sensing::{Changes, MotorSample, SelfSensed, SelfSensing, Standing};
use worm_physics::{Ledger, Worm, steady_cycle};

/// Seeds of the worms: `few` from 1 on, or as many as `WORMD_SEEDS` says from `WORMD_FIRST_SEED` on.
fn seeds(few: u64) -> std::ops::Range<u64> {
    let from_environment = |name, otherwise| {
        let text = std::env::var(name).ok();
        text.and_then(|text| text.parse().ok()).unwrap_or(otherwise)
    };
    let first = from_environment("WORMD_FIRST_SEED", 1);
    first..first + from_environment("WORMD_SEEDS", few)
}

/// A drawn worm, its plant, and what senses it.
fn worm_of(seed: u64) -> (Drawn, Plant, SelfSensing) {
    let mut drawn = Drawn::new(seed);
    if std::env::var("WORMD_PITCH").is_ok() {
        drawn = drawn.with_pitch();
    }
    let plant = Plant::new(&drawn);
    let sensing = SelfSensing::new(&drawn.told, &drawn.config());
    (drawn, plant, sensing)
}

/// A cell of a worm, by its seed.
fn any_cell(drawn: &Drawn) -> usize {
    drawn.seed as usize % drawn.worm.cells()
}

/// Errors of a quantity, and what was said of them.
#[derive(Default)]
struct Errors {
    relative: Vec<f64>,
    whitened: Vec<f64>,
}

impl Errors {
    fn add(&mut self, error: f64, of: f64, sigma: f64) {
        self.relative.push(error / of);
        self.whitened.push(error / sigma);
    }

    fn mean(&self) -> f64 {
        self.relative.iter().sum::<f64>() / self.relative.len() as f64
    }

    fn rms(&self) -> f64 {
        (self.relative.iter().map(|error| error * error).sum::<f64>() / self.relative.len() as f64).sqrt()
    }

    /// Share whose 90 % interval holds the truth.
    fn coverage(&self) -> f64 {
        let held = self.whitened.iter().filter(|error| error.abs() < 1.645).count();
        held as f64 / self.whitened.len() as f64
    }

    fn within(&self, limit: f64) -> f64 {
        let held = self.relative.iter().filter(|error| error.abs() < limit).count();
        held as f64 / self.relative.len() as f64
    }

    fn line(&self, name: &str, unit: f64) {
        println!(
            "{name:24} mean {:+7.2}  rms {:6.2}  90 % interval holds {:4.0} %",
            unit * self.mean(),
            unit * self.rms(),
            100.0 * self.coverage()
        );
    }
}

/// Crawls for some cycles.
fn crawl(plant: &mut Plant, sensing: &mut SelfSensing, cycles: usize, mut each: impl FnMut(&Plant, &SelfSensed)) {
    let end = plant.cycles() + cycles;
    while plant.cycles() < end {
        let sample = plant.tick();
        if let Some(sensed) = sensing.update(&sample) {
            each(plant, sensed);
        }
    }
    if let Some(sensed) = sensing.finish() {
        each(plant, sensed);
    }
}

#[test]
fn ten_cycles_of_drawn_worms() {
    let [
        mut friction,
        mut stiffness,
        mut slope,
        mut energy,
        mut net,
        mut electrical,
        mut advance,
        mut slides,
    ] = std::array::from_fn(|_| Errors::default());
    let mut warming: [[Errors; 3]; 3] = Default::default();
    let seeds = seeds(12);
    for seed in seeds.clone() {
        let (drawn, mut plant, mut sensing) = worm_of(seed);
        let mut told: Vec<SelfSensed> = Vec::new();
        crawl(&mut plant, &mut sensing, 12, |plant, sensed| {
            told.push(*sensed);
            let [.., before, after] = &plant.milestones[..] else {
                return;
            };
            let truth_j = after.electrical_j - before.electrical_j;
            electrical.add(sensed.electrical_j - truth_j, truth_j, sensed.electrical_sigma_j);
        });
        let sensed = sensing.sensed().expect("cycles were seen");
        let (first, last) = (&plant.milestones[2], &plant.milestones[12]);
        let ledger = last.ledger.since(&first.ledger);
        let loss_j = ledger.loss_j() / 10.0;
        energy.add(
            sensed.figures.energy_loss_j - loss_j,
            loss_j,
            sensed.figures_sigma.energy_loss_j,
        );
        let net_j = ledger.actuator_net_j / 10.0;
        net.add(
            sensed.figures.energy_net_j - net_j,
            net_j,
            sensed.figures_sigma.energy_net_j,
        );
        let advance_m = (last.position_m - first.position_m) / 10.0;
        advance.add(
            sensed.figures.advance_m - advance_m,
            advance_m,
            sensed.figures_sigma.advance_m,
        );
        for (early, [of_friction, of_advance, of_losses]) in told.iter().zip(&mut warming) {
            let [inferred, sigma] = [&early.figures, &early.figures_sigma].map(|figures| figures.energy_loss_j);
            of_losses.add(inferred - loss_j, loss_j, sigma);
            of_advance.add(
                early.figures.advance_m - advance_m,
                advance_m,
                early.figures_sigma.advance_m,
            );
            for cell in 0..early.cells {
                let truth = drawn.friction_n(cell);
                of_friction.add(early.friction_n[cell] - truth, truth, early.friction_sigma_n[cell]);
            }
        }
        for cell in 0..sensed.cells {
            let of = |of: &Ledger| [of.forward_slide_m[cell], of.backward_slide_m[cell]].map(|slide_m| slide_m / 10.0);
            let (figures, sigma) = (&sensed.figures, &sensed.figures_sigma);
            let inferred = [figures.forward_slide_m[cell], figures.backward_slide_m[cell]];
            let sigma = [sigma.forward_slide_m[cell], sigma.backward_slide_m[cell]];
            for ((inferred_m, sigma_m), truth_m) in inferred.into_iter().zip(sigma).zip(of(&ledger)) {
                slides.add(inferred_m - truth_m, drawn.worm.stroke_m(), sigma_m);
            }
        }
        slope.add(
            sensed.slope_rad.to_degrees() - drawn.slope_deg(),
            1.0,
            sensed.slope_sigma_rad.to_degrees(),
        );
        for cell in 0..sensed.cells {
            let truth = drawn.friction_n(cell);
            friction.add(sensed.friction_n[cell] - truth, truth, sensed.friction_sigma_n[cell]);
            let truth = drawn.worm.contact(cell).stiffness_n_per_m;
            stiffness.add(
                sensed.stiffness_n_per_m[cell] - truth,
                truth,
                sensed.stiffness_sigma_n_per_m[cell],
            );
        }
        if std::env::var("WORMD_EACH").is_ok() {
            println!(
                "seed {seed}: {} cells, {:.1}°; slope {:.1} ± {:.1}°, advance {:.2} ± {:.2} of {:.2} mm, friction {:?} %, residual {:.2} mN m",
                sensed.cells,
                drawn.slope_deg(),
                sensed.slope_rad.to_degrees(),
                sensed.slope_sigma_rad.to_degrees(),
                1e3 * sensed.figures.advance_m,
                1e3 * sensed.figures_sigma.advance_m,
                1e3 * advance_m,
                (0..sensed.cells)
                    .map(|cell| (1e3 * (sensed.friction_n[cell] / drawn.friction_n(cell) - 1.0)).round() / 10.0)
                    .collect::<Vec<_>>(),
                1e3 * sensed.residual_n_m,
            );
        }
    }
    println!(
        "{} worms from seed {}, ten cycles",
        seeds.end - seeds.start,
        seeds.start
    );
    friction.line("friction, %", 100.0);
    stiffness.line("stiffness, %", 100.0);
    slope.line("slope, degrees", 1.0);
    energy.line("losses (11), %", 100.0);
    net.line("net work (13), %", 100.0);
    electrical.line("electrical, %", 100.0);
    advance.line("advance, %", 100.0);
    slides.line("slides, % of the stroke", 100.0);
    for (cycle, [friction, advance, losses]) in warming.iter().enumerate() {
        friction.line(&format!("after {}: friction, %", cycle + 1), 100.0);
        advance.line("advance, %", 100.0);
        losses.line("losses (11), %", 100.0);
    }
    println!("slope within 2 degrees: {:.0} %", 100.0 * slope.within(2.0));
    println!("advance within 5 %: {:.0} %", 100.0 * advance.within(0.05));
    // Now and then a worm has two answers, so the mean square says little of the others.
    for (name, errors, limit, coverage) in [
        ("friction", &friction, 0.1, 0.7),
        ("stiffness", &stiffness, 0.15, 0.65),
        ("slope", &slope, 5.0, 0.6),
        ("losses", &energy, 0.1, 0.6),
        ("net work", &net, 0.1, 0.6),
        ("electrical", &electrical, 0.01, 0.9),
        ("advance", &advance, 0.12, 0.7),
        ("slides", &slides, 0.1, 0.7),
    ] {
        assert!(
            errors.within(limit) > 0.8 && errors.coverage() > coverage,
            "{name} is worse than it was"
        );
    }
}

#[test]
fn distance_after_fifty_cycles() {
    let mut distance = Errors::default();
    let seeds = seeds(6);
    for seed in seeds.clone() {
        let (_, mut plant, mut sensing) = worm_of(seed);
        crawl(&mut plant, &mut sensing, 50, |_, _| {});
        let truth_m = plant.milestones[50].position_m;
        let reckoned = sensing.reckoned();
        distance.add(reckoned.position_m - truth_m, truth_m, reckoned.sigma_m);
    }
    println!(
        "{} worms from seed {}, fifty cycles",
        seeds.end - seeds.start,
        seeds.start
    );
    distance.line("distance, %", 100.0);
    println!("distance within 5 %: {:.0} %", 100.0 * distance.within(0.05));
    assert!(distance.within(0.1) > 0.8 && distance.coverage() > 0.6);
}

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

/// Estimates before and after a change, and which of two changes of the same advance explains the difference.
#[test]
fn payload_or_softer_pads() {
    let seeds = seeds(4);
    let [mut right, mut count] = [0.0, 0.0];
    for seed in seeds.clone() {
        let (drawn, mut plant, mut sensing) = worm_of(seed);
        if drawn.slope_deg() < 15.0 {
            continue;
        }
        let payload_kg = 0.03;
        let mut laden = drawn.worm.clone();
        laden.add_mass_kg(payload_kg);
        let softened = |factor: f64| {
            let mut worm = drawn.worm.clone();
            worm.scale_stiffness(None, factor);
            worm
        };
        let advance_m = |worm: &Worm| steady_cycle(worm).cycle().map_or(-1.0, |cycle| cycle.advance_m);
        let (mut low, mut high) = (0.3, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if advance_m(&softened(middle)) < advance_m(&laden) {
                low = middle
            } else {
                high = middle
            }
        }
        if advance_m(&laden) < 1e-3 || low < 0.31 {
            continue;
        }
        crawl(&mut plant, &mut sensing, 11, |_, _| {});
        let before = *sensing.sensed().expect("cycles were seen");
        let pull_n = payload_kg * 9.81 * drawn.worm.slope_rad().sin();
        for (worm, is_payload) in [(laden, true), (softened(low), false)] {
            let mut plant = plant.clone();
            plant.change(worm);
            let mut sensing = SelfSensing::new(&drawn.told, &drawn.config());
            crawl(&mut plant, &mut sensing, 12, |_, _| {});
            let after = sensing.sensed().expect("cycles were seen");
            let stiffness = |sensed: &SelfSensed| {
                let logs = sensed.stiffness_n_per_m[..sensed.cells]
                    .iter()
                    .map(|stiffness| stiffness.ln());
                logs.sum::<f64>() / sensed.cells as f64
            };
            let (pulled_n, softer) = (after.pull_n - before.pull_n, stiffness(after) - stiffness(&before));
            let pull_sigma_n = after.pull_sigma_n.hypot(before.pull_sigma_n);
            let softer_sigma = after.stiffness_sigma_n_per_m[0] / after.stiffness_n_per_m[0];
            let misfit = |expected_n: f64, expected: f64| {
                ((pulled_n - expected_n) / pull_sigma_n).powi(2) + ((softer - expected) / softer_sigma).powi(2)
            };
            let says_payload = misfit(pull_n, 0.0) < misfit(0.0, low.ln());
            right += f64::from(u8::from(says_payload == is_payload));
            count += 1.0;
        }
    }
    println!(
        "payload of 30 g or softer pads: {right} of {count} told apart, from seed {}",
        seeds.start
    );
    assert!(right > 0.8 * count);
}

#[test]
fn nothing_is_allocated() {
    let (_, mut plant, mut sensing) = worm_of(1);
    let samples: Vec<_> = (0..11_500).map(|_| plant.tick()).collect();
    let mut cycles = 0;
    let info = allocation_counter::measure(|| {
        for sample in &samples {
            cycles += usize::from(sensing.update(sample).is_some());
        }
    });
    assert_eq!((info.count_total, cycles), (0, 2), "allocations, cycles");
}

/// Readings that are missing or make no sense cost a cycle at most, and readings that were lost cost nothing.
#[test]
fn bad_readings_do_no_harm() {
    let (drawn, mut plant, mut sensing) = worm_of(4);
    let mut tick = 0;
    while plant.cycles() < 9 {
        let mut sample = plant.tick();
        tick += 1;
        match tick % 1013 {
            7 => sample.current_a = f64::NAN,
            400 => sample.phase = f64::INFINITY,
            500..515 => continue,
            800 => sample.temperature_c = f64::NAN,
            _ => {}
        }
        sensing.update(&sample);
    }
    let sensed = sensing.sensed().expect("cycles were seen");
    assert!(sensed.cycles > 5.0, "{} cycles", sensed.cycles);
    for cell in 0..sensed.cells {
        let error = sensed.friction_n[cell] / drawn.friction_n(cell) - 1.0;
        assert!(error.abs() < 0.1, "friction of cell {cell} is {error} off");
    }
}

#[test]
fn a_backward_crawl_counts_for_the_distance() {
    let (_, mut plant, mut sensing) = worm_of(9);
    crawl(&mut plant, &mut sensing, 5, |_, _| {});
    let (before, last) = (sensing.reckoned(), plant.tick());
    for tick in 0..5000 {
        let back = f64::from(tick) / 2500.0;
        let sample = MotorSample {
            time_s: last.time_s + 1e-3 * f64::from(tick),
            phase: last.phase - back,
            angle_rad: last.angle_rad - back * std::f64::consts::TAU,
            velocity_rad_per_s: -last.velocity_rad_per_s,
            ..last
        };
        assert!(sensing.update(&sample).is_none(), "a cycle backward is not fitted");
    }
    let after = sensing.reckoned();
    // Six cells on the level: 6.7 mm a cycle, either way.
    let back_m = before.position_m - after.position_m;
    assert!((0.012..0.0145).contains(&back_m), "{back_m} m");
}
