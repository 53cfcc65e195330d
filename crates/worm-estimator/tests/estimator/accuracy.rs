//! Accuracy of the measured cycles: tables over seeds, against the true values of the model that made the data.
//!
//! A table that changes is printed in full; if the change is intended, the new one belongs here.

use std::fmt::Write;
use testkit::crawl::{Crawl, Scene, config_of, paper_worm};
use worm_estimator::config::{DeformationSource, PerCell};
use worm_estimator::estimate::Estimator;
use worm_estimator::message::Cycle;
use worm_physics::Ledger;

const SEEDS: std::ops::RangeInclusive<u64> = 1..=10;
/// Eight cycles of 2.5 s, of which the first is not settled.
const TICKS: usize = 21_000;

/// Mean, root mean square, and the fraction within two standard errors.
#[derive(Default)]
struct Errors {
    count: f64,
    sum: f64,
    squares: f64,
    covered: f64,
}

impl Errors {
    fn add(&mut self, error: f64, sigma: f64) {
        self.count += 1.0;
        self.sum += error;
        self.squares += error * error;
        self.covered += f64::from(u8::from(error.abs() <= 2.0 * sigma));
    }

    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    fn rms(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }

    fn covered_percent(&self) -> f64 {
        100.0 * self.covered / self.count
    }
}

/// Crawls, and passes every settled cycle on with its true energies and advance.
fn settled_cycles(estimator: &mut Estimator, crawl: &mut Crawl, mut take: impl FnMut(&Cycle, &Ledger, f64)) {
    for _ in 0..TICKS {
        let state = crawl.tick();
        let Some(cycle) = estimator.update(&state).cycle.filter(|cycle| cycle.settled == 1) else {
            continue;
        };
        let index = cycle.index as usize;
        let (before, after) = (&crawl.milestones[index], &crawl.milestones[index + 1]);
        take(cycle, &after.ledger.since(&before.ledger), after.mean_m - before.mean_m);
    }
}

const ENERGY_AND_ADVANCE: &str = "\
seeds 1 to 10, 7 settled cycles each, 120 Hz, 20 % swing of the cam speed
slope  bounds   noise  outliers dropouts | loss (11) % mean rms cov | net (13) % mean rms cov | positive % mean rms cov | advance mm rms cov
   0°  equal    0.1 mm       0 %       0 % |   +0.1  0.2   99 |   +0.1  0.4   99 |   +0.0  0.2  100 |  0.03   99
   0°  unequal  0.1 mm       0 %       0 % |   -0.0  0.2   99 |   -0.1  0.4  100 |   -0.1  0.3  100 |  0.03   99
  30°  equal    0.1 mm       0 %       0 % |   +0.0  0.3   99 |   -0.3  0.4   99 |   -0.1  0.3  100 |  0.03   99
  30°  unequal  0.1 mm       0 %       0 % |   +0.1  0.3   99 |   -0.0  0.4  100 |   +0.0  0.3  100 |  0.03   97
  45°  equal    0.1 mm       0 %       0 % |   +0.0  0.2   97 |   +0.0  0.4  100 |   +0.0  0.3  100 |  0.03   99
  45°  unequal  0.1 mm       0 %       0 % |   +0.1  0.3   97 |   +0.0  0.5  100 |   +0.0  0.4  100 |  0.03   93
   0°  equal    0.3 mm       0 %       0 % |   +0.3  0.7   94 |   +0.5  1.1  100 |   +0.3  0.7  100 |  0.06  100
   0°  unequal  0.3 mm       0 %       0 % |   +0.1  0.6   96 |   -0.1  1.0  100 |   +0.0  0.7  100 |  0.06  100
  30°  equal    0.3 mm       0 %       0 % |   +0.1  0.7   97 |   -0.2  0.9   99 |   -0.1  0.7  100 |  0.06  100
  30°  unequal  0.3 mm       0 %       0 % |   +0.1  0.8   93 |   -0.3  1.1   99 |   -0.1  0.9  100 |  0.08   94
  45°  equal    0.3 mm       0 %       0 % |   +0.2  0.8   91 |   -0.5  1.2   97 |   -0.5  1.0   99 |  0.08   94
  45°  unequal  0.3 mm       0 %       0 % |   +0.2  0.8   91 |   -0.6  1.3   97 |   -0.3  1.0   99 |  0.10   89
   0°  equal    0.3 mm       5 %      10 % |   +0.3  0.7   99 |   +0.2  1.2  100 |   +0.1  0.6  100 |  0.06  100
   0°  unequal  0.3 mm       5 %      10 % |   +0.0  0.5  100 |   -0.3  1.0  100 |   -0.1  0.6  100 |  0.06   99
  30°  equal    0.3 mm       5 %      10 % |   +0.2  0.6  100 |   -0.3  0.8  100 |   -0.1  0.6  100 |  0.06   97
  30°  unequal  0.3 mm       5 %      10 % |   +0.2  0.8   97 |   -0.4  1.1  100 |   -0.3  0.8  100 |  0.08   97
  45°  equal    0.3 mm       5 %      10 % |   +0.3  0.7   99 |   -0.9  1.3   99 |   -0.8  1.1   99 |  0.08   99
  45°  unequal  0.3 mm       5 %      10 % |   +0.4  0.8   96 |   -0.7  1.4   99 |   -0.4  1.0  100 |  0.10   91
";

#[test]
fn energies_and_advance_over_slopes_bounds_and_noise() {
    let mut table = ENERGY_AND_ADVANCE
        .lines()
        .take(2)
        .fold(String::new(), |text, line| text + line + "\n");
    for (noise_m, outlier_fraction, dropout_share) in [(1e-4, 0.0, 0.0), (3e-4, 0.0, 0.0), (3e-4, 0.05, 0.1)] {
        for slope_deg in [0.0, 30.0, 45.0] {
            for unequal in [false, true] {
                let [mut loss, mut net, mut positive, mut advance] = std::array::from_fn(|_| Errors::default());
                for seed in SEEDS {
                    let scene = Scene {
                        seed,
                        noise_m,
                        outlier_fraction,
                        dropout_share,
                        ..Scene::default()
                    };
                    let worm = paper_worm(slope_deg, unequal);
                    let mut estimator = Estimator::new(&config_of(&worm, &scene)).expect("a valid configuration");
                    settled_cycles(
                        &mut estimator,
                        &mut Crawl::new(worm, scene),
                        |cycle, truth, advance_m| {
                            let percent = |value: f64, truth: f64| 100.0 * (value / truth - 1.0);
                            let sigma = |sigma: f64, truth: f64| 100.0 * sigma / truth;
                            let (true_loss, true_net) = (truth.loss_j(), truth.actuator_net_j);
                            let true_positive = truth.actuator_positive_j;
                            loss.add(
                                percent(cycle.energy_loss_j, true_loss),
                                sigma(cycle.energy_loss_sigma_j, true_loss),
                            );
                            let work_sigma_j = cycle.energy_actuator_sigma_j;
                            net.add(
                                percent(cycle.energy_actuator_net_j, true_net),
                                sigma(work_sigma_j, true_net),
                            );
                            positive.add(
                                percent(cycle.energy_actuator_positive_j, true_positive),
                                sigma(work_sigma_j, true_positive),
                            );
                            advance.add(1e3 * (cycle.advance_m - advance_m), 1e3 * cycle.advance_sigma_m);
                        },
                    );
                }
                writeln!(
                    table,
                    "{slope_deg:>4}°  {:<7}  {:.1} mm {:>7} % {:>7} % |   {:+.1}  {:.1}  {:>3.0} |   {:+.1}  {:.1}  {:>3.0} |   {:+.1}  {:.1}  {:>3.0} |  {:.2}  {:>3.0}",
                    if unequal { "unequal" } else { "equal" },
                    1e3 * noise_m,
                    100.0 * outlier_fraction,
                    100.0 * dropout_share,
                    loss.mean(), loss.rms(), loss.covered_percent(),
                    net.mean(), net.rms(), net.covered_percent(),
                    positive.mean(), positive.rms(), positive.covered_percent(),
                    advance.rms(), advance.covered_percent(),
                )
                .expect("text has room");
                for energy in [&loss, &net, &positive] {
                    assert!(energy.mean().abs() < 1.0 && energy.rms() < 2.0, "{table}");
                    assert!(energy.covered_percent() >= 80.0, "{table}");
                }
                assert_eq!(loss.count, 70.0);
            }
        }
    }
    assert_eq!(table, ENERGY_AND_ADVANCE, "\n{table}");
}

const BOUNDS: &str = "\
seeds 1 to 10, 0.1 mm noise, found on the first 5 cycles
slope  bounds   guess mm | largest error of each bound, mm | loss (11) of cycles 6 to 8, % rms cov
   0°  equal      1.50   |   0.04  0.02  0.03  0.03          |   0.4   93
   0°  unequal    1.75   |   0.09  0.01  0.01  0.08          |   0.3  100
  20°  unequal    1.75   |   0.01  0.02  0.03  0.03          |   0.3  100
  30°  equal      1.50   |   0.03  0.01  0.02  0.02          |   0.3  100
  30°  unequal    1.75   |   0.02  0.02  0.02  0.02          |   0.4  100
  45°  equal      2.00   |   0.02  0.02  0.03  0.02          |   0.2  100
  45°  unequal    1.75   |   0.02  0.01  0.02  0.02          |   0.4  100
";

#[test]
fn bounds_are_identified_from_positions_alone() {
    let mut table = BOUNDS
        .lines()
        .take(2)
        .fold(String::new(), |text, line| text + line + "\n");
    let cases = [
        (0.0, false, 1.5e-3),
        (0.0, true, 1.75e-3),
        (20.0, true, 1.75e-3),
        (30.0, false, 1.5e-3),
        (30.0, true, 1.75e-3),
        (45.0, false, 2.0e-3),
        (45.0, true, 1.75e-3),
    ];
    for (slope_deg, unequal, guess_m) in cases {
        let mut largest_mm = [0.0f64; 4];
        let mut loss = Errors::default();
        for seed in SEEDS {
            let scene = Scene {
                seed,
                noise_m: 1e-4,
                ..Scene::default()
            };
            let worm = paper_worm(slope_deg, unequal);
            let mut config = config_of(&worm, &scene);
            config.worm.max_deformation_m = PerCell::Same(guess_m);
            config.worm.max_deformation = DeformationSource::Identified;
            let mut estimator = Estimator::new(&config).expect("a valid configuration");
            let mut crawl = Crawl::new(worm.clone(), scene);
            settled_cycles(&mut estimator, &mut crawl, |cycle, truth, _| {
                let error = 100.0 * (cycle.energy_loss_j / truth.loss_j() - 1.0);
                loss.add(error, 100.0 * cycle.energy_loss_sigma_j / truth.loss_j());
            });
            for (cell, largest) in largest_mm.iter_mut().enumerate() {
                let found_m = estimator.latest().max_deformation_m[cell];
                *largest = largest.max(1e3 * (found_m - worm.contact(cell).forward_bound_m).abs());
            }
        }
        let [a, b, c, d] = largest_mm;
        writeln!(
            table,
            "{slope_deg:>4}°  {:<7}    {:.2}   |   {a:.2}  {b:.2}  {c:.2}  {d:.2}          |   {:.1}  {:>3.0}",
            if unequal { "unequal" } else { "equal" },
            1e3 * guess_m,
            loss.rms(),
            loss.covered_percent(),
        )
        .expect("text has room");
        assert!(largest_mm.iter().all(|&error| error < 0.1), "{table}");
        assert_eq!(loss.count, 30.0);
    }
    assert_eq!(table, BOUNDS, "\n{table}");
}
