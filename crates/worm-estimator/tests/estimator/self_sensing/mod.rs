//! Self-sensing on drawn worms in virtual time. `WORMD_SEEDS=200` draws as many; without it a small sample.

mod plant;

use plant::{Drawn, Plant};
use worm_estimator::self_sensing::{SelfSensed, SelfSensing};

/// Number of worms.
fn seeds(few: u64) -> u64 {
    std::env::var("WORMD_SEEDS").ok().and_then(|seeds| seeds.parse().ok()).unwrap_or(few)
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
}

#[test]
fn ten_cycles_of_drawn_worms() {
    let [mut friction, mut stiffness, mut slope, mut energy, mut net, mut electrical, mut advance] =
        std::array::from_fn(|_| Errors::default());
    for seed in 1..=seeds(12) {
        let drawn = Drawn::new(seed);
        let mut plant = Plant::new(&drawn);
        let mut sensing = SelfSensing::new(&drawn.told, &drawn.config());
        crawl(&mut plant, &mut sensing, 12, |plant, sensed| {
            let [.., before, after] = &plant.milestones[..] else { return };
            let truth_j = after.electrical_j - before.electrical_j;
            electrical.add(sensed.electrical_j - truth_j, truth_j, sensed.electrical_sigma_j);
        });
        let sensed = sensing.sensed().expect("cycles were seen");
        let (first, last) = (&plant.milestones[2], &plant.milestones[12]);
        let ledger = last.ledger.since(&first.ledger);
        let loss_j = ledger.loss_j() / 10.0;
        energy.add(sensed.figures.energy_loss_j - loss_j, loss_j, sensed.figures_sigma.energy_loss_j);
        let net_j = ledger.actuator_net_j / 10.0;
        net.add(sensed.figures.energy_net_j - net_j, net_j, sensed.figures_sigma.energy_net_j);
        let advance_m = (last.position_m - first.position_m) / 10.0;
        advance.add(sensed.figures.advance_m - advance_m, advance_m, sensed.figures_sigma.advance_m);
        slope.add(sensed.slope_rad.to_degrees() - drawn.slope_deg(), 1.0, sensed.slope_sigma_rad.to_degrees());
        for cell in 0..sensed.cells {
            let truth = drawn.friction_n(cell);
            friction.add(sensed.friction_n[cell] - truth, truth, sensed.friction_sigma_n[cell]);
            let truth = drawn.worm.contact(cell).stiffness_n_per_m;
            stiffness.add(sensed.stiffness_n_per_m[cell] - truth, truth, sensed.stiffness_sigma_n_per_m[cell]);
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
    println!("{} worms, seeds 1 to {}, ten cycles", slope.relative.len(), seeds(12));
    friction.line("friction, %", 100.0);
    stiffness.line("stiffness, %", 100.0);
    slope.line("slope, degrees", 1.0);
    energy.line("losses (11), %", 100.0);
    net.line("net work (13), %", 100.0);
    electrical.line("electrical, %", 100.0);
    advance.line("advance, %", 100.0);
    println!("slope within 2 degrees: {:.0} %", 100.0 * slope.within(2.0));
    println!("advance within 5 %: {:.0} %", 100.0 * advance.within(0.05));
}
