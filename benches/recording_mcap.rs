//! Time that a log costs the recorder: serialising, writing, and reading back.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::path::Path;
use std::time::SystemTime;
use worm_estimator::message::{Mode, ProtobufMessage, State, Timing};
use worm_log::{Origin, Writer};

/// Ticks in a chunk at 1 kHz and a chunk every second.
const TICKS: u64 = 1000;

/// A state with numbers of realistic length.
fn state(tick: u64) -> State {
    let turn = tick as f64 * 0.000_4;
    let mut state = State {
        sequence: tick,
        time_ns: 83_726_154_119_000 + tick * 1_000_123,
        phase: turn,
        motor_angle_rad: turn * std::f64::consts::TAU,
        motor_velocity_rad_s: 2.51 + turn.sin() * 0.02,
        goal_velocity_rad_s: 2.513_274_122_871_834_5,
        motor_current_a: 0.133 + turn.cos() * 0.01,
        motor_duty: 0.41,
        bus_voltage_v: 5.0,
        motor_temperature_c: 31.0,
        sample_time_s: (tick / 8) as f64 / 120.0,
        sample: tick / 8,
        sample_is_new: u32::from(tick.is_multiple_of(8)),
        motor_is_new: 1,
        valid_mask: 15,
        mode: Mode::Crawling.code(),
        ..State::unknown(4)
    };
    for (cell, position_m) in state.position_m[..4].iter_mut().enumerate() {
        *position_m = 0.04 * cell as f64 + (tick / 8) as f64 * 1.1e-5;
    }
    state
}

fn timing(tick: u64) -> Timing {
    Timing {
        sequence: tick,
        deadline_ns: 83_726_154_000_000 + tick * 1_000_000,
        wake_lateness_ns: 33_000 + tick % 977,
        bus_ns: 92_000 + tick % 1013,
        compute_ns: 1_100 + tick % 97,
        publish_ns: 1_300 + tick % 89,
        notify_ns: 16_000 + tick % 83,
        waited_ns: 0,
        stolen_ns: 0,
        overruns: 0,
        period_ns: 1_000_000,
        host_paused_ns: 0,
        host_pauses: 0,
        overrun: 0,
        culprit: 0,
        minor_faults: 0,
        major_faults: 0,
    }
}

fn recording(criterion: &mut Criterion) {
    let origin = Origin {
        worm: "bench".to_owned(),
        cells: 4,
        config: None,
        begun: SystemTime::UNIX_EPOCH,
        begun_ns: 1,
    };
    let mut group = criterion.benchmark_group("log");
    group.throughput(Throughput::Elements(TICKS));
    group.bench_function(
        "write state and timing of a tick, 1000 ticks and their chunk",
        |bencher| {
            let mut writer = Writer::new(std::io::sink(), Path::new("bench"), &origin).expect("a sink takes all");
            let mut tick = 0;
            bencher.iter(|| {
                for _ in 0..TICKS {
                    tick += 1;
                    writer.write(&state(tick)).expect("a sink takes all");
                    writer.write(&timing(tick)).expect("a sink takes all");
                }
                writer.flush().expect("a sink takes all");
            });
        },
    );
    group.throughput(Throughput::Elements(1));
    let mut bytes = Vec::new();
    group.bench_function("a state to Protocol Buffers", |bencher| {
        bencher.iter(|| {
            bytes.clear();
            black_box(state(1)).write_protobuf(&mut bytes);
        });
    });
    group.bench_function("a state from Protocol Buffers", |bencher| {
        bencher.iter(|| State::read_protobuf(black_box(&bytes)).expect("is a state"));
    });
    group.finish();
}

criterion_group!(benches, recording);
criterion_main!(benches);
