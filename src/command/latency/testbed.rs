//! The worm that is measured: virtual worm and controller as processes, as in `wormd up`, and the estimator, the very same code,
//! in a thread of this process, so that the moment at which it has a state in hand is known.

use super::bench::{Bench, ConfigFile};
use crate::command::child_process::{Child, Log, START_PATIENCE};
use crate::command::estimate::{self, PRIORITY_BELOW_LOOP};
use crate::command::{Failure, print};
use crate::realtime::{self, Grant, monotonic_ns};
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

/// Notes that may wait to be taken; more are dropped. The measuring loop takes them every few milliseconds.
pub(super) const NOTES: usize = 65_536;

/// How long the alarm's listener sleeps at most, and with it the time until an end is noticed.
const LONGEST_SLEEP: Duration = Duration::from_millis(100);

/// A state's number and when somebody had it in hand, ns.
pub(super) type Received = (u64, u64);

/// The running worm. Ended in the order of its fields' importance by [`end`](Self::end), or when dropped.
pub(super) struct Testbed {
    pub(super) instance: Instance,
    pub(super) controller: Child,
    virtual_worm: Option<VirtualWorm>,
    end: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Result<(), Failure>>>,
    /// When the estimator had each state in hand.
    pub(super) heard: Receiver<Received>,
    /// When stalls of the motor had woken a listener of the alarms, ns.
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
    pub(super) fn start(bench: &Bench, instance: &Instance, log: &Log, end: &AtomicBool) -> Result<Self, Failure> {
        // As `wormd up` does, which may be running under this name.
        let role = RoleLock::take(instance).map_err(Failure::unusable)?;
        let file = bench.file(instance.folder())?;
        let virtual_worm = match bench.config.port {
            None => Some(VirtualWorm::start(bench, &file, instance, log, end)?),
            Some(_) => None,
        };
        let threads_end = Arc::new(AtomicBool::new(false));
        let (heard_sender, heard) = bounded(NOTES);
        let (alarm_sender, stall_alarms) = bounded(NOTES);
        let mut threads = Vec::new();
        let (estimator, estimator_tid) = start_estimator(bench, instance, heard_sender, &threads_end)?;
        threads.push(estimator);
        threads.push(start_alarm_listener(bench, instance, alarm_sender, &threads_end)?);
        let mut testbed = Self {
            instance: instance.clone(),
            controller: start_controller(bench, &file, virtual_worm.as_ref(), log)?,
            virtual_worm,
            end: threads_end,
            threads,
            heard,
            stall_alarms,
            estimator_tid,
            file,
            _role: role,
        };
        testbed.controller.wait_until_ready(START_PATIENCE, log, end)?;
        Ok(testbed)
    }

    /// Ends the controller, and starts another one at another rate.
    pub(super) fn restart_controller(
        &mut self,
        bench: &Bench,
        rate_hz: f64,
        log: &Log,
        end: &AtomicBool,
    ) -> Result<(), Failure> {
        self.controller.end();
        let file = bench.file_at(rate_hz, self.instance.folder())?;
        self.controller = start_controller(bench, &file, self.virtual_worm.as_ref(), log)?;
        self.controller.wait_until_ready(START_PATIENCE, log, end)
    }

    /// The configuration file of its processes.
    pub(super) fn config(&self) -> &Path {
        self.file.path()
    }

    /// How a process ended that should not have.
    pub(super) fn find_ended(&mut self) -> Option<String> {
        if let Some(status) = self.controller.exit_status() {
            return Some(format!("the controller ended by itself, {status}"));
        }
        let worm = self.virtual_worm.as_mut()?;
        let status = worm.child.exit_status()?;
        Some(format!("the virtual worm ended by itself, {status}"))
    }

    /// Ends everything, the controller first, which stops the motor; gives when the virtual worm began to
    /// crawl, ns.
    pub(super) fn end(mut self) -> Option<u64> {
        self.controller.end();
        self.end_threads();
        let mut worm = self.virtual_worm.take()?;
        worm.child.end();
        let text = std::fs::read_to_string(&worm.ledger).ok()?;
        let ledger: serde_json::Value = serde_json::from_str(&text).ok()?;
        ledger["crawl_began_ns"].as_u64()
    }

    /// CPU time that the controller's threads and the estimator have taken so far, ns.
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
        bench: &Bench,
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
        for fault in bench.stall_faults() {
            arguments.extend(["--fault".into(), fault.into()]);
        }
        let mut child = Child::start("virtual-worm", &louder(arguments, bench.verbose), log)?;
        child.wait_until_ready(START_PATIENCE, log, end)?;
        Ok(Self { child, link, ledger })
    }
}

impl Drop for VirtualWorm {
    fn drop(&mut self) {
        self.child.end();
        // It may never have been written.
        let _ = std::fs::remove_file(&self.ledger);
    }
}

fn louder(mut arguments: Vec<OsString>, verbose: u8) -> Vec<OsString> {
    arguments.extend((0..verbose).map(|_| OsString::from("-v")));
    arguments
}

fn start_controller(bench: &Bench, file: &ConfigFile, worm: Option<&VirtualWorm>, log: &Log) -> Result<Child, Failure> {
    let mut arguments: Vec<OsString> = vec!["control".into(), "--config".into(), file.path().into()];
    if let Some(worm) = worm {
        arguments.extend(["--port".into(), worm.link.clone().into()]);
    }
    let mut child = Child::start("control", &louder(arguments, bench.verbose), log)?;
    child.be_patient(Duration::from_secs_f64(bench.config.gait.ramp_s));
    Ok(child)
}

type Thread = JoinHandle<Result<(), Failure>>;

fn spawn(name: &str, work: impl FnOnce() -> Result<(), Failure> + Send + 'static) -> Result<Thread, Failure> {
    std::thread::Builder::new()
        .name(name.to_owned())
        .spawn(work)
        .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))
}

/// Starts the estimator, and waits until it listens.
fn start_estimator(
    bench: &Bench,
    instance: &Instance,
    heard: Sender<Received>,
    end: &Arc<AtomicBool>,
) -> Result<(Thread, Pid), Failure> {
    let role = RoleLock::<Estimator>::take(instance).map_err(Failure::unusable)?;
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let (config, end) = (bench.config.clone(), Arc::clone(end));
    let (ready, is_ready) = bounded(1);
    let thread = spawn("estimator", move || {
        // Notes that nobody takes any more may be lost.
        let heard = |state: &State| {
            let _ = heard.try_send((state.sequence, monotonic_ns()));
        };
        let listens = |_: &[Grant]| {
            let _ = ready.send(gettid());
        };
        estimate::attend(&config, &hub, &role, &end, listens, heard)
    })?;
    // Should it end instead, its channel closes; joining tells why.
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

/// A listener to alarms, as a person's program would be one, woken by their event.
fn start_alarm_listener(
    bench: &Bench,
    instance: &Instance,
    stalls: Sender<u64>,
    end: &Arc<AtomicBool>,
) -> Result<Thread, Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let wanted = estimator_realtime(&bench.config.realtime);
    let end = Arc::clone(end);
    spawn("alarm listener", move || {
        let bell = hub.listener::<Alarm>().map_err(Failure::failed)?;
        let mut alarms = hub.subscriber::<Alarm>().map_err(Failure::failed)?;
        realtime::request(&wanted, 0);
        while !end.load(Ordering::Relaxed) {
            bell.wait(LONGEST_SLEEP).map_err(Failure::failed)?;
            while let Some(alarm) = alarms.next().map_err(Failure::failed)? {
                if alarm.kind == AlarmKind::MotorStall.code() && alarm.raised != 0 {
                    let _ = stalls.try_send(monotonic_ns());
                }
            }
        }
        Ok(())
    })
}

/// What the estimator asks of the operating system, for a thread beside it.
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
