//! The topics over real shared memory.

use super::home::{Home, segments};
use std::thread;
use std::time::{Duration, Instant};
use worm_estimator::message::{
    Alarm, AlarmKind, Command, CommandKind, CommandOutcome, CommandRecord, Cycle, Estimate, Mode, Reply, Severity,
    ShortText, State, Timing,
};
use worm_physics::MAX_CELLS;
use wormd::topics::{
    CommandError, Controller, Estimator, Hub, InstanceError, PortError, Publisher, RoleError, RoleLock, Topic,
};

const SECOND: Duration = Duration::from_secs(1);

fn state(sequence: u64) -> State {
    State {
        sequence,
        time_ns: 7 * sequence,
        ..State::unknown(4)
    }
}

fn timing(sequence: u64) -> Timing {
    Timing {
        sequence,
        deadline_ns: 1,
        wake_lateness_ns: 2,
        bus_ns: 3,
        compute_ns: 4,
        publish_ns: 5,
        notify_ns: 0,
        waited_ns: 0,
        stolen_ns: 0,
        overruns: 6,
        period_ns: 1_000_000,
        host_paused_ns: 0,
        host_pauses: 0,
        overrun: 0,
        culprit: 0,
        minor_faults: 0,
        major_faults: 0,
    }
}

fn command_record(sequence: u64) -> CommandRecord {
    let reply = Reply {
        sequence: 10 * sequence,
        verdict: CommandOutcome::Accepted.code(),
        mode: Mode::Armed.code(),
        fault: 0,
        alarm_mask: 0,
    };
    let command = Command {
        sender: ShortText::new("tester"),
        ..Command::new(CommandKind::Hold)
    };
    CommandRecord::new(sequence, (7 * sequence, 2.5), false, &command, &reply)
}

fn estimate(state_sequence: u64) -> Estimate {
    Estimate {
        state_sequence,
        time_ns: 1,
        sample: 2,
        states_lost: 3,
        phase: 0.5,
        position_m: [0.25; MAX_CELLS],
        contact_m: [0.5; MAX_CELLS],
        deformation_m: [1e-3; MAX_CELLS],
        force_n: [1.0; MAX_CELLS],
        forward_slide_m: [0.0; MAX_CELLS],
        backward_slide_m: [0.0; MAX_CELLS],
        power_electrical_w: 1.5,
        energy_electrical_j: 2.5,
        energy_loss_j: 3.5,
        max_deformation_m: [2e-3; MAX_CELLS],
        battery_fraction: 0.75,
        cell_count: 4,
        sliding_mask: 5,
        armed_mask: 6,
        raised_mask: 7,
    }
}

fn cycle(index: u64) -> Cycle {
    Cycle {
        index,
        end_ns: 1,
        duration_s: 2.5,
        host_paused_s: 0.0,
        advance_m: 0.01,
        advance_sigma_m: 1e-4,
        forward_slide_m: [0.0; MAX_CELLS],
        backward_slide_m: [0.0; MAX_CELLS],
        energy_loss_j: 1.0,
        energy_loss_sigma_j: 0.1,
        energy_actuator_net_j: 2.0,
        energy_actuator_positive_j: 3.0,
        energy_actuator_sigma_j: 0.2,
        energy_electrical_j: 4.0,
        energy_copper_j: 0.5,
        energy_friction_inside_j: 0.5,
        energy_electrical_sigma_j: 0.3,
        cot: 5.0,
        predicted_advance_m: 0.011,
        predicted_energy_loss_j: 1.1,
        predicted_energy_positive_j: 3.1,
        predicted_forward_slide_m: [0.0; MAX_CELLS],
        predicted_backward_slide_m: [0.0; MAX_CELLS],
        samples: 100,
        cell_count: 4,
        settled: 1,
        direction: 1,
    }
}

fn alarm(sequence: u64) -> Alarm {
    Alarm {
        sequence,
        time_ns: 1,
        since_ns: 2,
        value: 3.0,
        threshold: 4.0,
        phase: 5.0,
        kind: AlarmKind::JammedCell.code(),
        severity: Severity::Critical.code(),
        raised: 1,
        cell: 2,
    }
}

/// `NaN` is no value's equal, itself included: compare as text.
fn same<T: std::fmt::Debug>(left: &T, right: &T) -> bool {
    format!("{left:?}") == format!("{right:?}")
}

fn round_trip<T: Topic>(hub: &Hub, role: &RoleLock<T::Owner>, value: T) {
    let mut subscriber = hub.subscriber::<T>().expect("subscriber");
    let publisher = hub.publisher::<T>(role).expect("publisher");
    assert!(
        subscriber.next().expect("receive").is_none(),
        "{}: nothing was sent yet",
        T::NAME
    );
    publisher.publish(&value).expect("publish");
    publisher.publish(&value).expect("publish again");
    for _ in 0..2 {
        let sample = subscriber.next().expect("receive").expect("a sample");
        assert!(same(&*sample, &value), "{}: {sample:?}", T::NAME);
    }
    assert!(subscriber.latest().expect("receive").is_none());
    assert_eq!(subscriber.received(), 2);
}

#[test]
fn every_topic_arrives_as_it_was_sent() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let controller = RoleLock::<Controller>::take(&instance).expect("role");
    let estimator = RoleLock::<Estimator>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    round_trip(&hub, &controller, state(1));
    round_trip(&hub, &controller, timing(1));
    round_trip(&hub, &estimator, estimate(1));
    round_trip(&hub, &estimator, cycle(1));
    round_trip(&hub, &estimator, alarm(1));
}

fn sends_history<T: Topic>(hub: &Hub, role: &RoleLock<T::Owner>, value: impl Fn(u64) -> T) {
    let publisher: Publisher<T> = hub.publisher(role).expect("publisher");
    for number in 0..40 {
        publisher.publish(&value(number)).expect("publish");
    }
    let mut late = hub.subscriber::<T>().expect("subscriber");
    assert!(
        late.next().expect("receive").is_none(),
        "{}: the publisher has not looked yet",
        T::NAME
    );
    publisher.idle().expect("idle");
    for number in 40 - T::HISTORY as u64..40 {
        let sample = late.next().expect("receive").expect("history");
        assert!(same(&*sample, &value(number)), "{}: {number}", T::NAME);
    }
    assert!(late.next().expect("receive").is_none());
    assert_eq!(late.lost(), 0, "what went before a subscriber came is not lost");
}

#[test]
fn a_late_joiner_gets_the_last_values_from_an_idle_publisher() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let controller = RoleLock::<Controller>::take(&instance).expect("role");
    let estimator = RoleLock::<Estimator>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    sends_history(&hub, &controller, state);
    sends_history(&hub, &controller, timing);
    sends_history(&hub, &controller, command_record);
    sends_history(&hub, &estimator, estimate);
    sends_history(&hub, &estimator, cycle);
    sends_history(&hub, &estimator, alarm);
}

#[test]
fn a_subscriber_that_does_not_read_loses_its_oldest_and_nobody_else_does() {
    const SENT: u64 = 10_000;
    let home = Home::new();
    let instance = home.instance("worm1");
    let controller = RoleLock::<Controller>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    let publisher = hub.publisher::<State>(&controller).expect("publisher");
    let mut asleep = hub.subscriber::<State>().expect("subscriber");
    let mut awake = hub.subscriber::<State>().expect("subscriber");
    publisher.publish(&state(0)).expect("publish");
    assert_eq!(asleep.next().expect("receive").expect("a sample").sequence, 0);
    for sequence in 1..SENT {
        publisher.publish(&state(sequence)).expect("publish");
        if sequence % 500 == 0 {
            while awake.next().expect("receive").is_some() {}
        }
    }
    assert_eq!(awake.latest().expect("receive").expect("a sample").sequence, SENT - 1);
    assert_eq!((awake.received(), awake.lost()), (SENT, 0));

    let oldest = asleep.next().expect("receive").expect("a sample").sequence;
    assert_eq!(oldest, SENT - State::BUFFER as u64);
    assert_eq!(asleep.latest().expect("receive").expect("a sample").sequence, SENT - 1);
    assert_eq!(asleep.received(), 1 + State::BUFFER as u64);
    assert_eq!(asleep.received() + asleep.lost(), SENT);
}

#[test]
fn a_hub_may_change_threads() {
    let home = Home::new();
    let hub = Hub::open(&home.instance("worm1")).expect("hub");
    thread::spawn(move || hub.subscriber::<State>().expect("subscriber").received())
        .join()
        .expect("the other thread");
}

#[test]
fn neighbours_do_not_hear_each_other_whether_by_name_or_by_root() {
    let (home, other_home) = (Home::new(), Home::new());
    let instances = [
        home.instance("worm1"),
        home.instance("worm2"),
        other_home.instance("worm1"),
    ];
    let roles: Vec<_> = instances
        .iter()
        .map(|instance| RoleLock::<Controller>::take(instance).expect("role"))
        .collect();
    let hubs: Vec<_> = instances
        .iter()
        .map(|instance| Hub::open(instance).expect("hub"))
        .collect();
    let mut subscribers: Vec<_> = hubs
        .iter()
        .map(|hub| hub.subscriber::<State>().expect("subscriber"))
        .collect();
    let publishers: Vec<_> = hubs
        .iter()
        .zip(&roles)
        .map(|(hub, role)| hub.publisher::<State>(role).expect("publisher"))
        .collect();
    for (worm, publisher) in publishers.iter().enumerate() {
        publisher.publish(&state(worm as u64)).expect("publish");
    }
    for (worm, subscriber) in subscribers.iter_mut().enumerate() {
        assert_eq!(
            subscriber.next().expect("receive").expect("a sample").sequence,
            worm as u64
        );
        assert!(subscriber.next().expect("receive").is_none());
    }
    let error = hubs[0].publisher::<State>(&roles[1]).expect_err("another worm's role");
    assert!(
        matches!(&error, PortError::OtherWorm { worm, .. } if worm == "worm2"),
        "{error}"
    );
}

#[test]
fn an_event_wakes_a_sleeping_listener() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let estimator = RoleLock::<Estimator>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    let alarms = hub.publisher::<Alarm>(&estimator).expect("publisher");
    let notifier = hub.notifier::<Alarm>(&estimator).expect("notifier");
    let (ready, is_ready) = std::sync::mpsc::channel();
    let watcher_instance = instance.clone();
    let watcher = thread::spawn(move || {
        let hub = Hub::open(&watcher_instance).expect("hub");
        let listener = hub.listener::<Alarm>().expect("listener");
        let mut alarms = hub.subscriber::<Alarm>().expect("subscriber");
        let begun = Instant::now();
        assert_eq!(
            listener.wait(Duration::from_millis(30)).expect("wait"),
            0,
            "nobody called"
        );
        assert!(begun.elapsed() >= Duration::from_millis(29), "{:?}", begun.elapsed());
        ready.send(()).expect("send");
        assert!(listener.wait(10 * SECOND).expect("wait") > 0);
        let seen = alarms.next().expect("receive").expect("the alarm").sequence;
        assert_eq!(listener.wait(Duration::ZERO).expect("wait"), 0, "drained");
        seen
    });
    is_ready.recv().expect("the watcher");
    thread::sleep(Duration::from_millis(20));
    alarms.publish(&alarm(3)).expect("publish");
    assert_eq!(notifier.notify().expect("notify"), 1);
    assert_eq!(watcher.join().expect("the watcher"), 3);
}

#[test]
fn a_command_is_answered_once_and_an_abandoned_one_is_not_carried_out() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let hub = Hub::open(&instance).expect("hub");
    let client = hub.command_client().expect("client");
    let arm = Command::new(CommandKind::Arm);
    let crawl = Command {
        cycles_per_s: 0.4,
        ..Command::new(CommandKind::Crawl)
    };

    let error = client.call(arm, SECOND).expect_err("nobody is there");
    assert!(matches!(error, CommandError::NoController { .. }));
    assert!(
        error.to_string().contains("worm1") && error.to_string().contains("wormd up"),
        "{error}"
    );

    let controller = RoleLock::<Controller>::take(&instance).expect("role");
    assert_eq!(RoleLock::<Controller>::holder(&instance), Some(std::process::id()));
    let error = client
        .call(arm, Duration::from_millis(30))
        .expect_err("it is only starting");
    assert!(
        matches!(error, CommandError::NoAnswer { pid, .. } if pid == std::process::id()),
        "{error}"
    );

    let server = hub.command_server(&controller).expect("server");
    let error = client
        .call(arm, Duration::from_millis(30))
        .expect_err("it does not answer");
    assert!(matches!(error, CommandError::NoAnswer { .. }), "{error}");

    let leaver_instance = instance.clone();
    let leaver = thread::spawn(move || {
        let hub = Hub::open(&leaver_instance).expect("hub");
        hub.command_client().expect("client").call(arm, 10 * SECOND)
    });
    let request = loop {
        if let Some(request) = server.take().expect("take") {
            break request;
        }
        thread::sleep(Duration::from_millis(1));
    };
    drop((request, server));
    let error = leaver.join().expect("client").expect_err("it left");
    assert!(matches!(error, CommandError::Left { .. }), "{error}");

    let server = hub.command_server(&controller).expect("server");
    let (done, is_done) = std::sync::mpsc::channel::<()>();
    let caller_instance = instance.clone();
    let caller = thread::spawn(move || {
        let hub = Hub::open(&caller_instance).expect("hub");
        let client = hub.command_client().expect("client");
        let reply = client.call(crawl, 10 * SECOND);
        drop(done);
        reply
    });
    let mut taken = Vec::new();
    while is_done.try_recv() != Err(std::sync::mpsc::TryRecvError::Disconnected) {
        while let Some((command, responder)) = server.take().expect("take") {
            taken.push(command);
            let reply = Reply {
                sequence: 9,
                verdict: CommandOutcome::Accepted.code(),
                mode: Mode::Crawling.code(),
                fault: 0,
                alarm_mask: 0,
            };
            responder.answer(&reply).expect("answer");
        }
        thread::sleep(Duration::from_millis(1));
    }
    let reply = caller.join().expect("caller").expect("an answer");
    assert_eq!((reply.sequence, reply.mode), (9, Mode::Crawling.code()));
    assert_eq!(taken, [crawl], "the abandoned ones were not carried out");
}

#[test]
fn a_second_controller_is_refused_with_worm_role_and_pid() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let first = RoleLock::<Controller>::take(&instance).expect("role");
    let RoleError::AlreadyRunning(refusal) = RoleLock::<Controller>::take(&instance).expect_err("it is taken") else {
        panic!("another error");
    };
    assert_eq!(
        (refusal.pid, refusal.role, refusal.worm.as_str()),
        (std::process::id(), "controller", "worm1")
    );
    let text = refusal.to_string();
    assert!(text.contains(&format!("kill {}", std::process::id())), "{text}");

    RoleLock::<Estimator>::take(&instance).expect("another role of the same worm");
    RoleLock::<Controller>::take(&home.instance("worm2")).expect("the same role of another worm");
    drop(first);
    assert_eq!(RoleLock::<Controller>::holder(&instance), None);
    RoleLock::<Controller>::take(&instance).expect("free again");
}

#[test]
fn after_an_orderly_exit_nothing_remains() {
    let home = Home::new();
    let instance = home.instance("worm1");
    {
        let controller = RoleLock::<Controller>::take(&instance).expect("role");
        let hub = Hub::open(&instance).expect("hub");
        let publisher = hub.publisher::<State>(&controller).expect("publisher");
        let _listener = hub.listener::<State>().expect("listener");
        let _server = hub.command_server(&controller).expect("server");
        let mut watcher = Hub::open(&instance)
            .expect("hub")
            .subscriber::<State>()
            .expect("subscriber");
        assert!(!segments(&instance).is_empty());
        drop(hub);
        publisher.publish(&state(1)).expect("a port outlives its hub");
        assert!(watcher.next().expect("receive").is_some());
    }
    assert_eq!(segments(&instance), [] as [std::path::PathBuf; 0]);
    let left: Vec<_> = std::fs::read_dir(home.root()).expect("root").flatten().collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn roots_that_cannot_be_used_are_refused_with_the_remedy() {
    let home = Home::new();
    let file = home.root().join("file");
    std::fs::write(&file, "").expect("write");
    let error = wormd::topics::Instance::new(&file.join("below"), "worm1").expect_err("no folder");
    assert!(
        matches!(error, InstanceError::Unusable { .. }) && error.to_string().contains("topics.root"),
        "{error}"
    );

    let long = home.root().join("a-rather-long-folder-name");
    let error = wormd::topics::Instance::new(&long, "worm1").expect_err("too long");
    assert!(error.to_string().contains("at most 48 characters, not 53"), "{error}");
    let longest = home
        .root()
        .join("x".repeat(48 - 10 - 1 - home.root().as_os_str().len()));
    let instance = wormd::topics::Instance::new(&longest, "worm1").expect("just short enough");
    let hub = Hub::open(&instance).expect("hub");
    hub.listener::<State>().expect("its socket has a path");
}

#[test]
fn publishing_allocates_once_and_receiving_never() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let controller = RoleLock::<Controller>::take(&instance).expect("role");
    let hub = Hub::open(&instance).expect("hub");
    let publisher = hub.publisher::<State>(&controller).expect("publisher");
    let notifier = hub.notifier::<State>(&controller).expect("notifier");
    let listener = hub.listener::<State>().expect("listener");
    let server = hub.command_server(&controller).expect("server");
    let mut subscriber = hub.subscriber::<State>().expect("subscriber");
    let value = state(1);
    let mut tick = || {
        let publish = allocation_counter::measure(|| publisher.publish(&value).expect("publish"));
        let notify = allocation_counter::measure(|| assert_eq!(notifier.notify().expect("notify"), 1));
        let wait = allocation_counter::measure(|| assert_eq!(listener.wait(SECOND).expect("wait"), 1));
        let receive = allocation_counter::measure(|| assert!(subscriber.latest().expect("receive").is_some()));
        let poll = allocation_counter::measure(|| assert!(server.take().expect("take").is_none()));
        [publish, notify, wait, receive, poll].map(|step| step.count_total)
    };
    tick(); // connects
    for _ in 0..10 {
        assert_eq!(tick(), [1, 0, 0, 0, 0]);
    }
}
