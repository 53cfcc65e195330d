//! Energy per cycle against the virtual worm's own ledger, cycle by cycle, through the packet codec at 1 kHz.
//!
//! The truth scatters by 1 % from cycle to cycle, the tracker has 0.3 mm of noise, and the servo's registers resolve 1 mA
//! and 0.1 V. A table that changes is printed in full; if the change is meant, the new one belongs here.

use super::harness::{config, crawling, wired};
use std::fmt::Write;
use worm_estimator::config::Config;
use worm_estimator::message::Cycle;
use wormd::link::virtual_worm::{Options, PlantLedger};
use wormd::soak::Machine;

const SEEDS: std::ops::RangeInclusive<u64> = 1..=4;
const SETTLED_CYCLES: usize = 10;
const UNEQUAL: &str = "[0.0020, 0.0011, 0.00175, 0.00215]";

pub type Quantity = (&'static str, fn(&Cycle) -> f64, fn(&PlantLedger) -> f64);

pub const QUANTITIES: [Quantity; 6] = [
    ("loss (11)", |c| c.energy_loss_j, |t| t.loss_j),
    ("net (13)", |c| c.energy_actuator_net_j, |t| t.actuator_net_j),
    (
        "positive (13)",
        |c| c.energy_actuator_positive_j,
        |t| t.actuator_positive_j,
    ),
    ("electrical", |c| c.energy_electrical_j, |t| t.electrical_j),
    ("copper", |c| c.energy_copper_j, |t| t.copper_j),
    ("inside", |c| c.energy_friction_inside_j, |t| t.friction_inside_j),
];

/// Mean of the worst seed, mean over all seeds and rms per cycle, %.
#[derive(Default)]
struct Errors {
    worst_mean: f64,
    sum: f64,
    squares: f64,
    count: f64,
}

impl Errors {
    fn add_run(&mut self, errors: &[f64]) {
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        if mean.abs() > self.worst_mean.abs() {
            self.worst_mean = mean;
        }
        self.sum += errors.iter().sum::<f64>();
        self.squares += errors.iter().map(|error| error * error).sum::<f64>();
        self.count += errors.len() as f64;
    }

    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    fn rms(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }
}

/// The configuration of a row of the tables.
fn worm(slope_deg: i32, deformation: &str, seed: u64) -> Config {
    config(&format!(
        "worm.max_deformation_m = {deformation}\ncanal.slope_deg = {slope_deg}\n\
         tracker.noise_m = 0.0003\nvirtual_worm.noise_m = 0.0003\nvirtual_worm.seed = {seed}\n"
    ))
}

/// Crawls for so many gait cycles and hands over what was measured and what was true.
fn crawl(config: &Config, cycles: f64) -> (Vec<Cycle>, Vec<PlantLedger>) {
    let wired = wired(config, &Options::default());
    let mut session = crawling(config, wired, 1000.0);
    session.cycles = Some(Vec::new());
    session.run_s(config.gait.cycle_s * (cycles + 0.3), |_| {});
    assert_eq!(session.raised_kinds(), [], "seed {}", config.virtual_worm.seed);
    let measured = session.cycles.take().unwrap_or_default();
    (
        measured,
        session.machine.plant().ledger().cycles().iter().cloned().collect(),
    )
}

pub fn percent(measured: f64, truth: f64) -> f64 {
    100.0 * (measured / truth - 1.0)
}

const TABLE: &str = "\
seeds 1..=4, 10 settled cycles each, noise 0.3 mm, scatter 1 %; error in %: mean (worst seed's mean) rms per cycle
 0° equal   | loss (11) +0.0 (-0.6) 0.8 | net (13) -0.1 (-0.5) 0.9 | positive (13) +0.1 (+0.3) 0.5 | electrical +0.2 (+0.2) 0.2 | copper -0.1 (-0.1) 0.1 | inside +0.4 (+0.4) 0.4
 0° unequal | loss (11) +0.3 (+0.6) 0.7 | net (13) +0.2 (+0.4) 0.9 | positive (13) +0.2 (+0.3) 0.7 | electrical +0.2 (+0.2) 0.2 | copper -0.1 (-0.1) 0.1 | inside +0.3 (+0.4) 0.4
30° equal   | loss (11) +0.2 (+0.5) 0.8 | net (13) -0.2 (-0.5) 0.8 | positive (13) -0.0 (-0.3) 0.7 | electrical +0.2 (+0.2) 0.2 | copper -0.1 (-0.1) 0.1 | inside +0.4 (+0.5) 0.5
30° unequal | loss (11) +0.1 (+0.4) 0.8 | net (13) -0.3 (-0.4) 0.9 | positive (13) -0.1 (-0.3) 0.8 | electrical +0.2 (+0.2) 0.2 | copper -0.1 (-0.1) 0.1 | inside +0.5 (+0.5) 0.5
45° equal   | loss (11) +0.3 (+0.6) 0.8 | net (13) -0.4 (-0.6) 0.9 | positive (13) -0.4 (-0.5) 0.8 | electrical +0.2 (+0.2) 0.2 | copper -0.1 (-0.1) 0.1 | inside +0.5 (+0.6) 0.6
45° unequal | loss (11) +0.2 (+0.4) 0.9 | net (13) -0.5 (-1.0) 1.2 | positive (13) -0.3 (-0.7) 0.9 | electrical +0.2 (+0.2) 0.2 | copper -0.1 (-0.1) 0.1 | inside +0.6 (+0.7) 0.6
";

#[test]
fn energies_of_a_cycle_are_within_two_percent_of_the_virtual_worms_ledger() {
    let mut table = format!(
        "seeds {SEEDS:?}, {SETTLED_CYCLES} settled cycles each, noise 0.3 mm, scatter 1 %; error in %: mean (worst seed's mean) rms per cycle\n"
    );
    let mut too_far = Vec::new();
    for slope_deg in [0, 30, 45] {
        for (bounds, deformation) in [("equal", "0.00175"), ("unequal", UNEQUAL)] {
            let mut errors: [Errors; 6] = Default::default();
            for seed in SEEDS {
                let (cycles, truth) = crawl(&worm(slope_deg, deformation, seed), SETTLED_CYCLES as f64 + 1.0);
                let settled: Vec<_> = cycles.iter().filter(|cycle| cycle.settled == 1).collect();
                assert_eq!(settled.len(), SETTLED_CYCLES, "seed {seed}");
                for ((_, measured, true_value), errors) in QUANTITIES.iter().zip(&mut errors) {
                    let run = settled
                        .iter()
                        .map(|cycle| percent(measured(cycle), true_value(&truth[cycle.index as usize])));
                    errors.add_run(&run.collect::<Vec<_>>());
                }
            }
            write!(table, "{slope_deg:>2}° {bounds:<7}").expect("text has room");
            for ((name, ..), errors) in QUANTITIES.iter().zip(&errors) {
                write!(
                    table,
                    " | {name} {:+.1} ({:+.1}) {:.1}",
                    errors.mean(),
                    errors.worst_mean,
                    errors.rms()
                )
                .expect("text has room");
                if errors.worst_mean.abs() > 2.0 {
                    too_far.push(format!("{slope_deg}° {bounds} {name}"));
                }
            }
            table.push('\n');
        }
    }
    assert!(too_far.is_empty(), "beyond 2 %: {too_far:?}\n{table}");
    assert_eq!(table, TABLE, "\n{table}");
}

/// Error of the first cycle in %, and its standard error.
const FIRST: &str = "\
seeds 1..=4, the cycle from rest; largest error (stated standard error) in %
 0° equal   | loss (11) +0.9 (6.2) | net (13) +1.6 (5.9) | positive (13) +1.3 (5.6)
 0° unequal | loss (11) +0.7 (7.5) | net (13) +1.4 (7.0) | positive (13) +1.1 (6.5)
30° equal   | loss (11) -0.6 (5.2) | net (13) +1.0 (5.0) | positive (13) +1.0 (4.8)
30° unequal | loss (11) -0.9 (6.2) | net (13) -1.3 (5.8) | positive (13) +1.0 (5.5)
45° equal   | loss (11) +0.8 (4.9) | net (13) +1.4 (4.7) | positive (13) +1.3 (4.5)
45° unequal | loss (11) +0.7 (5.7) | net (13) -1.4 (5.4) | positive (13) -1.1 (5.2)
";

#[test]
fn the_first_cycle_is_the_best_guess_and_says_how_good_it_is() {
    let mut table = format!("seeds {SEEDS:?}, the cycle from rest; largest error (stated standard error) in %\n");
    let mut wrong = Vec::new();
    for slope_deg in [0, 30, 45] {
        for (bounds, deformation) in [("equal", "0.00175"), ("unequal", UNEQUAL)] {
            let mut largest = [(0.0f64, 0.0f64); 3];
            for seed in SEEDS {
                let (cycles, truth) = crawl(&worm(slope_deg, deformation, seed), 1.0);
                let (cycle, truth) = (&cycles[0], &truth[0]);
                assert_eq!((cycle.index, cycle.settled), (0, 0), "seed {seed}");
                let sigmas = [
                    cycle.energy_loss_sigma_j,
                    cycle.energy_actuator_sigma_j,
                    cycle.energy_actuator_sigma_j,
                ];
                for (((_, measured, true_value), largest), sigma_j) in QUANTITIES.iter().zip(&mut largest).zip(sigmas) {
                    let error = percent(measured(cycle), true_value(truth));
                    let sigma = 100.0 * sigma_j / true_value(truth);
                    if error.abs() >= largest.0.abs() {
                        *largest = (error, sigma);
                    }
                    if error.is_nan() || error.abs() > 2.0 * sigma {
                        wrong.push(format!("seed {seed}, {slope_deg}° {bounds}: {error:.1} ({sigma:.1})"));
                    }
                }
            }
            write!(table, "{slope_deg:>2}° {bounds:<7}").expect("text has room");
            for ((name, ..), (error, sigma)) in QUANTITIES.iter().zip(largest) {
                write!(table, " | {name} {error:+.1} ({sigma:.1})").expect("text has room");
            }
            table.push('\n');
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}\n{table}");
    assert_eq!(table, FIRST, "\n{table}");
}

#[test]
fn a_motor_that_has_warmed_up_is_measured_as_well_as_a_cold_one() {
    let config = config("gait.cycle_s = 1.25\nvirtual_worm.ambient_c = 35\n");
    let minutes = 12.0;
    let (cycles, truth) = crawl(&config, minutes * 60.0 / config.gait.cycle_s);
    let last = &cycles[cycles.len() - SETTLED_CYCLES..];
    for (name, measured, true_value) in &QUANTITIES[3..] {
        let errors = last
            .iter()
            .map(|cycle| percent(measured(cycle), true_value(&truth[cycle.index as usize])));
        let mean = errors.sum::<f64>() / last.len() as f64;
        println!("after {minutes} minutes: {name} {mean:+.2} %");
        assert!(mean.abs() <= 2.0, "{name}: {mean} %");
    }
}
