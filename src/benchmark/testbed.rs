//! The worm that is measured: virtual worm and controller as processes, as in `wormd up`, and the same estimator code in a
//! thread of this process, so that the time at which it receives a state is known.

use super::settings::{Benchmark, ConfigFile};
use crate::attendance::RoundCounter;
use crate::estimator::{self, PRIORITY_BELOW_LOOP};
use crate::failure::Failure;
use crate::print;
use crate::realtime::{self, Grant, monotonic_ns};
use crate::supervisor::child_process::{Child, Log, START_TIMEOUT};
use crate::topics::{Estimator, Hub, Instance, RoleLock, Supervisor};
use crossbeam::channel::{Receiver, Sender, bounded};
use nix::unistd::{Pid, gettid};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use worm_estimator::config::Realtime;
use worm_estimator::message::{Alarm, AlarmKind, State};

/// Length of the queues to the measuring thread, which empties them every few milliseconds. What does not fit is dropped.
pub(super) const QUEUE: usize = 65_536;

/// Longest sleep of the alarm listener, and so the delay with which it notices the end.
const MAX_SLEEP: Duration = Duration::from_millis(100);

/// A state's number, and when it was received, ns.
pub(super) type Received = (u64, u64);

/// The running worm. [`end`](Self::end) or its drop ends it, the controller first.
pub(super) struct Testbed {
    pub(super) instance: Instance,
    pub(super) controller: Child,
    virtual_worm: Option<VirtualWorm>,
    end: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Result<(), Failure>>>,
    /// When the estimator received each state.
    pub(super) received: Receiver<Received>,
    /// When alarms of a motor stall woke their listener, ns.
    pub(super) stall_alarms: Receiver<u64>,
    estimator_tid: Pid,
    file: ConfigFile,
    _role: RoleLock<Supervisor>,
}

struct VirtualWorm {
    child: Child,
    link: PathBuf,
    ledger: PathBuf,
}

impl Testbed {
    /// Starts everything, the controller last, and waits until it is ready.
    pub(super) fn start(
        benchmark: &Benchmark,
        instance: &Instance,
        log: &Log,
        end: &AtomicBool,
    ) -> Result<Self, Failure> {
        // The same lock as of `wormd up`, which may be running under this name.
        let role = RoleLock::take(instance).map_err(Failure::unusable)?;
        let file = benchmark.file(instance.folder())?;
        let virtual_worm = match benchmark.config.port {
            None => Some(VirtualWorm::start(benchmark, &file, instance, log, end)?),
            Some(_) => None,
        };
        let threads_end = Arc::new(AtomicBool::new(false));
        let (received_sender, received) = bounded(QUEUE);
        let (alarm_sender, stall_alarms) = bounded(QUEUE);
        let mut threads = Vec::new();
        let (estimator, estimator_tid) = start_estimator(benchmark, instance, received_sender, &threads_end)?;
        threads.push(estimator);
        threads.push(start_alarm_listener(benchmark, instance, alarm_sender, &threads_end)?);
        let mut testbed = Self {
            instance: instance.clone(),
            controller: start_controller(benchmark, &file, virtual_worm.as_ref(), log)?,
            virtual_worm,
            end: threads_end,
            threads,
            received,
            stall_alarms,
            estimator_tid,
            file,
            _role: role,
        };
        testbed.controller.wait_until_ready(START_TIMEOUT, log, end)?;
        Ok(testbed)
    }

    /// Ends the controller, and starts one at another rate.
    pub(super) fn restart_controller(
        &mut self,
        benchmark: &Benchmark,
        rate_hz: f64,
        log: &Log,
        end: &AtomicBool,
    ) -> Result<(), Failure> {
        self.controller.end();
        let file = benchmark.file_at(rate_hz, self.instance.folder())?;
        self.controller = start_controller(benchmark, &file, self.virtual_worm.as_ref(), log)?;
        self.controller.wait_until_ready(START_TIMEOUT, log, end)
    }

    /// The configuration file of its processes.
    pub(super) fn config(&self) -> &Path {
        self.file.path()
    }

    /// How a process ended by itself, if one has.
    pub(super) fn find_ended(&mut self) -> Option<String> {
        if let Some(status) = self.controller.exit_status() {
            return Some(format!("the controller ended by itself, {status}"));
        }
        let worm = self.virtual_worm.as_mut()?;
        let status = worm.child.exit_status()?;
        Some(format!("the virtual worm ended by itself, {status}"))
    }

    /// Ends everything, first the controller, which stops the motor. Returns when the virtual worm began to crawl, ns; none on
    /// a real worm.
    pub(super) fn end(mut self) -> Option<u64> {
        self.controller.end();
        self.end_threads();
        let mut worm = self.virtual_worm.take()?;
        worm.child.end();
        let text = std::fs::read_to_string(&worm.ledger).ok()?;
        let ledger: serde_json::Value = serde_json::from_str(&text).ok()?;
        ledger["crawl_began_ns"].as_u64()
    }

    /// CPU time that the controller's threads and the estimator have used so far, ns.
    pub(super) fn cpu_ns(&self) -> (u64, u64) {
        let controller = format!("/proc/{}/task", self.controller.id());
        let threads = std::fs::read_dir(controller).into_iter().flatten().flatten();
        let controller_ns = threads.map(|thread| cpu_ns_of(&thread.path())).sum();
        let estimator = format!("/proc/self/task/{}", self.estimator_tid);
        (controller_ns, cpu_ns_of(Path::new(&estimator)))
    }

    fn end_threads(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            match thread.join() {
                Ok(Ok(())) => {}
                Ok(Err(failure)) => print::log_line(format_args!("wormd: {failure}")),
                Err(_) => print::log_line("wormd: a thread of the benchmark panicked"),
            }
        }
    }
}

impl Drop for Testbed {
    fn drop(&mut self) {
        self.controller.end();
        self.end_threads();
    }
}

impl VirtualWorm {
    fn start(
        benchmark: &Benchmark,
        file: &ConfigFile,
        instance: &Instance,
        log: &Log,
        end: &AtomicBool,
    ) -> Result<Self, Failure> {
        let link = instance.folder().join("tty");
        let ledger = file.path().with_extension("ledger.json");
        let mut arguments: Vec<OsString> = vec![
            "virtual-worm".into(),
            "--config".into(),
            file.path().into(),
            "--link".into(),
            link.clone().into(),
            "--ledger".into(),
            ledger.clone().into(),
        ];
        for fault in benchmark.stall_faults() {
            arguments.extend(["--fault".into(), fault.into()]);
        }
        let mut child = Child::start(
            "virtual-worm",
            &with_verbosity(arguments, benchmark.options.verbose),
            log,
        )?;
        child.wait_until_ready(START_TIMEOUT, log, end)?;
        Ok(Self { child, link, ledger })
    }
}

impl Drop for VirtualWorm {
    fn drop(&mut self) {
        self.child.end();
        // It may not exist: the virtual worm writes it at its end.
        let _ = std::fs::remove_file(&self.ledger);
    }
}

fn with_verbosity(mut arguments: Vec<OsString>, verbose: u8) -> Vec<OsString> {
    arguments.extend((0..verbose).map(|_| OsString::from("-v")));
    arguments
}

fn start_controller(
    benchmark: &Benchmark,
    file: &ConfigFile,
    worm: Option<&VirtualWorm>,
    log: &Log,
) -> Result<Child, Failure> {
    let mut arguments: Vec<OsString> = vec!["control".into(), "--config".into(), file.path().into()];
    if let Some(worm) = worm {
        arguments.extend(["--port".into(), worm.link.clone().into()]);
    }
    let mut child = Child::start("control", &with_verbosity(arguments, benchmark.options.verbose), log)?;
    child.extend_end_timeout(Duration::from_secs_f64(benchmark.config.gait.ramp_s));
    // Only a virtual worm is ever moved here.
    child.keep_lease()?;
    Ok(child)
}

type Thread = JoinHandle<Result<(), Failure>>;

fn spawn(name: &str, work: impl FnOnce() -> Result<(), Failure> + Send + 'static) -> Result<Thread, Failure> {
    std::thread::Builder::new()
        .name(name.to_owned())
        .spawn(work)
        .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))
}

/// Starts the estimator, and waits until it listens; returns its thread and thread id.
fn start_estimator(
    benchmark: &Benchmark,
    instance: &Instance,
    received: Sender<Received>,
    end: &Arc<AtomicBool>,
) -> Result<(Thread, Pid), Failure> {
    let role = RoleLock::<Estimator>::take(instance).map_err(Failure::unusable)?;
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let (config, end) = (benchmark.config.clone(), Arc::clone(end));
    let (ready, is_ready) = bounded(1);
    let thread = spawn("estimator", move || {
        // After the measurement nobody empties the queue.
        let on_state = |state: &State| {
            let _ = received.try_send((state.sequence, monotonic_ns()));
        };
        let on_ready = |_: &[Grant]| {
            let _ = ready.send(gettid());
        };
        estimator::run(&config, &hub, &role, &end, &RoundCounter::default(), on_ready, on_state)
    })?;
    // If it ends instead, the channel closes, and joining returns the reason.
    match is_ready.recv() {
        Ok(tid) => Ok((thread, tid)),
        Err(_) => match thread.join() {
            Ok(Err(failure)) => Err(failure),
            _ => Err(Failure::failed("the estimator did not start")),
        },
    }
}

/// CPU time of a thread by its folder in `/proc`, ns: the first number of `schedstat`.
fn cpu_ns_of(thread: &Path) -> u64 {
    std::fs::read_to_string(thread.join("schedstat"))
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse().ok())
        .unwrap_or(0)
}

/// A listener to alarms as a user's program would have it, woken by their event.
fn start_alarm_listener(
    benchmark: &Benchmark,
    instance: &Instance,
    stalls: Sender<u64>,
    end: &Arc<AtomicBool>,
) -> Result<Thread, Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let wanted = estimator_realtime(&benchmark.config.realtime);
    let end = Arc::clone(end);
    spawn("alarm listener", move || {
        let event = hub.listener::<Alarm>().map_err(Failure::failed)?;
        let mut alarms = hub.subscriber::<Alarm>().map_err(Failure::failed)?;
        realtime::request(&wanted, 0);
        while !end.load(Ordering::Relaxed) {
            event.wait(MAX_SLEEP).map_err(Failure::failed)?;
            while let Some(alarm) = alarms.next().map_err(Failure::failed)? {
                if alarm.kind == AlarmKind::MotorStall.code() && alarm.raised != 0 {
                    let _ = stalls.try_send(monotonic_ns());
                }
            }
        }
        Ok(())
    })
}

/// What a thread at the estimator's priority requests from the operating system.
pub(super) fn estimator_realtime(wanted: &Realtime) -> Realtime {
    let priority = match wanted.priority {
        0 => 0,
        priority => priority.saturating_sub(PRIORITY_BELOW_LOOP).max(1),
    };
    Realtime {
        priority,
        cpu: None,
        lock_memory: wanted.lock_memory,
    }
}
