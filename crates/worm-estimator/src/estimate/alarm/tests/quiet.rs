//! A healthy worm raises no alarm, however poor its measurements and however irregular its commands.

use super::worm::Bench;
use crate::config::{Battery, Config};
use crate::message::Mode;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// One kind of day without faults, by its difference from a plain one.
#[derive(Clone, Copy)]
struct Day {
    name: &'static str,
    slope_deg: f64,
    cells: usize,
    noise_m: f64,
    dropout: f64,
    battery: bool,
    /// Fraction of its speed that the cam lacks.
    sluggish: f64,
    /// True stroke over the configured one.
    stroke_factor: f64,
    /// Starts, stops, holds, reversals and speed changes at random; otherwise it crawls on.
    restless: bool,
}

const PLAIN: Day = Day {
    name: "level",
    slope_deg: 0.0,
    cells: 4,
    noise_m: 5e-5,
    dropout: 0.01,
    battery: false,
    sluggish: 0.0,
    stroke_factor: 1.0,
    restless: false,
};

const RESTLESS: Day = Day {
    name: "level, restless",
    noise_m: 1e-4,
    battery: true,
    restless: true,
    ..PLAIN
};

#[rustfmt::skip]
const DAYS: &[Day] = &[
    PLAIN,
    Day { name: "level, 0.3 mm", noise_m: 3e-4, ..PLAIN },
    Day { name: "30°, 0.3 mm", slope_deg: 30.0, noise_m: 3e-4, ..PLAIN },
    Day { name: "45°, 0.3 mm", slope_deg: 45.0, noise_m: 3e-4, battery: true, ..PLAIN },
    Day { name: "cam 10 % slow", sluggish: 0.1, ..PLAIN },
    RESTLESS,
    Day { name: "30°, restless", slope_deg: 30.0, ..RESTLESS },
    Day { name: "45°, restless, 0.3 mm", slope_deg: 45.0, noise_m: 3e-4, ..RESTLESS },
    Day { name: "down 45°, restless", slope_deg: -45.0, ..RESTLESS },
    Day { name: "stroke 25 % short of the file's", stroke_factor: 0.75, ..RESTLESS },
    Day { name: "two cells, restless", cells: 2, ..RESTLESS },
    Day { name: "six cells, restless, dropouts", slope_deg: 20.0, cells: 6, dropout: 0.05, ..RESTLESS },
];

fn live(day: &Day, seed: u64, hours: f64) {
    let mut config = Config::default();
    config.canal.slope_deg = day.slope_deg;
    config.worm.cells = day.cells;
    config.worm.step_order = (1..=day.cells).collect();
    config.control.rate_hz = 250.0;
    config.battery = day.battery.then_some(Battery {
        capacity_j: 1e6,
        full_v: 5.6,
        empty_v: 4.0,
        internal_resistance_ohm: 0.2,
        hotel_power_w: 0.5,
        reserve_share: 0.1,
        ..Battery::default()
    });
    let mut bench = Bench::new(config, seed);
    bench.noise_m = day.noise_m;
    bench.trouble.dropout = day.dropout;
    bench.trouble.link_failing = 0.01;
    bench.trouble.sluggish = day.sluggish;
    bench.stroke_factor = day.stroke_factor;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x5EED);
    let end_s = bench.time_s() + hours * 3600.0;
    bench.run(1.0);
    bench.command(Mode::Crawling, 0.4);
    while bench.time_s() < end_s {
        if day.restless {
            let mode = [
                Mode::Crawling,
                Mode::Crawling,
                Mode::Holding,
                Mode::Armed,
                Mode::Stopping,
                Mode::Disarmed,
            ];
            let speed = [0.4, 0.4, -0.4, 0.2, 0.7, 0.1, -0.2];
            let (mode, speed) = (
                mode[random.random_range(0..mode.len())],
                speed[random.random_range(0..speed.len())],
            );
            bench.command(mode, speed);
            bench.run(random.random_range(0.1..40.0));
        } else {
            bench.run(600.0);
        }
        assert!(
            bench.changes.is_empty(),
            "{} (seed {seed}), after {:.0} s: {:#?}",
            day.name,
            bench.time_s(),
            bench.changes
        );
    }
}

#[test]
fn twenty_quiet_hours_are_quiet() {
    std::thread::scope(|scope| {
        for half in [0, 1] {
            scope.spawn(move || DAYS.iter().skip(half).step_by(2).for_each(|day| live(day, 11, 2.0)));
        }
    });
}
