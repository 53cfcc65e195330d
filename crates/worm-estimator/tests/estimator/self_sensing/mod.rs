//! Self-sensing on drawn worms in virtual time. `WORMD_SEEDS=200` draws as many; without it a small sample. With `WORMD_PITCH` set, every
//! worm has an inertial sensor.

mod accident;
mod cannot_tell;
mod change_over;
mod changed;
mod pitch;
mod plant;

use plant::{Drawn, Plant};
use worm_estimator::self_sensing::{MotorSample, SelfSensed, SelfSensing};
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

/// All tips lie in one canal, and that may hold them half as well as is stated, or half as well again.
#[test]
fn a_canal_of_another_friction_is_found() {
    for factor in [0.5, 1.6] {
        let [mut friction, mut losses] = std::array::from_fn(|_| Errors::default());
        for seed in seeds(10) {
            let mut drawn = Drawn::new(seed);
            drawn.worm.scale_friction(None, factor);
            if drawn.worm.check_hold().is_err() || steady_cycle(&drawn.worm).cycle().is_none() {
                continue;
            }
            let (mut plant, mut sensing) = (Plant::new(&drawn), SelfSensing::new(&drawn.told, &drawn.config()));
            crawl(&mut plant, &mut sensing, 12, |_, _| {});
            let sensed = *sensing.sensed().expect("cycles were seen");
            for cell in 0..sensed.cells {
                let truth_n = drawn.friction_n(cell);
                friction.add(
                    sensed.friction_n[cell] - truth_n,
                    truth_n,
                    sensed.friction_sigma_n[cell],
                );
            }
            let [.., before, after] = &plant.milestones[..] else {
                panic!("twelve cycles")
            };
            let truth_j = after.ledger.loss_j() - before.ledger.loss_j();
            let figures = (&sensed.figures, &sensed.figures_sigma);
            losses.add(figures.0.energy_loss_j - truth_j, truth_j, figures.1.energy_loss_j);
        }
        println!("friction of all cells × {factor}");
        friction.line("friction, %", 100.0);
        losses.line("losses (11), %", 100.0);
        assert!(friction.within(0.2) > 0.85 && friction.coverage() > 0.75, "× {factor}");
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

/// Pads' damping and the gears' viscous friction go by the speed at which the worm crawls, not by the configured one.
#[test]
fn a_worm_that_crawls_slower_than_configured_is_known_as_well() {
    let friction_n = |told_s: f64| {
        let drawn = Drawn::new(7).with_cycle_s(4.0, told_s);
        let (mut plant, mut sensing) = (Plant::new(&drawn), SelfSensing::new(&drawn.told, &drawn.config()));
        crawl(&mut plant, &mut sensing, 6, |_, _| {});
        let sensed = *sensing.sensed().expect("cycles were seen");
        (sensed.friction_n, sensed.friction_sigma_n)
    };
    let (usual_n, sigma_n) = friction_n(4.0);
    for told_s in [0.8, 2.5, 10.0] {
        let (found_n, _) = friction_n(told_s);
        for cell in 0..3 {
            let off = (found_n[cell] - usual_n[cell]) / sigma_n[cell];
            assert!(
                off.abs() < 1e-3,
                "told {told_s} s, friction of cell {cell} is {off} standard errors off"
            );
        }
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
