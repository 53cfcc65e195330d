//! The cost of the topics in the control loop, per call, with one subscriber or listener that keeps up.

use criterion::{Criterion, criterion_group, criterion_main};
use std::time::Duration;
use worm_estimator::message::{State, Timing};
use wormd::topics::{Controller, Hub, Instance, RoleLock};

fn topics(criterion: &mut Criterion) {
    let root = tempfile::Builder::new()
        .prefix("wb")
        .tempdir_in("/dev/shm")
        .expect("a folder in /dev/shm");
    let instance = Instance::new(root.path(), "bench").expect("instance");
    let role = RoleLock::<Controller>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    let states = hub.publisher::<State>(&role).expect("publisher");
    let timings = hub.publisher::<Timing>(&role).expect("publisher");
    let notifier = hub.notifier::<State>(&role).expect("notifier");
    let server = hub.command_server(&role).expect("server");
    let listener = hub.listener::<State>().expect("listener");
    let mut subscriber = hub.subscriber::<State>().expect("subscriber");
    let value = State::unknown(4);
    // SAFETY: a message consists of plain numbers, for which zero is a valid value.
    let timing: Timing = unsafe { std::mem::zeroed() };

    criterion.bench_function("publish state", |bencher| {
        bencher.iter(|| states.publish(&value));
    });
    criterion.bench_function("publish timing, nobody listens", |bencher| {
        bencher.iter(|| timings.publish(&timing));
    });
    criterion.bench_function("publish and receive state", |bencher| {
        bencher.iter(|| {
            states.publish(&value).expect("publish");
            subscriber.latest().expect("receive").map(|state| state.sequence)
        });
    });
    criterion.bench_function("notify and wait", |bencher| {
        bencher.iter(|| {
            notifier.notify().expect("notify");
            listener.wait(Duration::from_secs(1))
        });
    });
    criterion.bench_function("poll for a command", |bencher| {
        bencher.iter(|| server.take().map(|request| request.is_some()));
    });
}

criterion_group!(benches, topics);
criterion_main!(benches);
