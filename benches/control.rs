//! The controller's tick alone: state machine, safety rules and message, without bus and topics.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use worm_estimator::config::Config;
use worm_estimator::message::{Command, CommandKind};
use worm_physics::MAX_CELLS;
use wormd::control::{Controller, Inputs, Service, ServiceOutcome};
use wormd::link::{ServoReading, TrackerReading};

const READING: ServoReading = ServoReading {
    watchdog: 5,
    goal_velocity_rad_s: 2.5,
    realtime_tick_ms: 0,
    moving: true,
    duty: 0.3,
    current_a: 0.15,
    velocity_rad_s: 2.5,
    position_rad: 1.0,
    voltage_v: 5.0,
    temperature_c: 30.0,
    alert: false,
};

fn tick(criterion: &mut Criterion) {
    let mut controller = Controller::new(&Config::default());
    let mut tracker = TrackerReading {
        sample: 0,
        capture_time_us: 0,
        cell_count: 4,
        valid: 0b1111,
        positions_m: [0.1; MAX_CELLS],
    };
    let mut inputs = Inputs {
        now_ns: 0,
        absent_ns: 0,
        lost_exchanges: 0,
        servo: Some(&READING),
        tracker: None,
        command: None,
        alarms: &[],
        estimate_arrived: true,
        end: false,
        service: Some(ServiceOutcome::Done(Service::Arm)),
        hardware_error: None,
    };
    controller.tick(&inputs);
    inputs.service = None;
    inputs.command = Some(Command {
        cycles_per_s: 0.0,
        kind: CommandKind::Crawl.code(),
        reserved: 0,
    });
    controller.tick(&inputs);
    inputs.command = None;

    criterion.bench_function("controller tick while crawling", |bencher| {
        let mut now_ns = 0;
        bencher.iter(|| {
            now_ns += 1_000_000;
            tracker.sample += 1;
            let inputs = Inputs {
                now_ns,
                tracker: Some(&tracker),
                ..inputs
            };
            black_box(controller.tick(black_box(&inputs)))
        });
    });
}

criterion_group!(benches, tick);
criterion_main!(benches);
