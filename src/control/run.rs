//! The real-time loop: sleeps until each deadline, exchanges, ticks, publishes. All behaviour is in
//! [`Controller::tick`]; this file has only I/O, and the record of where the time went.

use super::controller::Controller;
use super::hardware::Drive;
use super::interface::{EstimateSeen, Inputs, Lease, Outputs, Service, ServiceOutcome};
use super::journal::{Entry, Journal};
use super::loop_clock::{ExchangeTimes, MIN_PAUSE_NS, Silence, absent_ns};
use super::ports::{ALARMS_PER_TICK, Asker, Ports, take_command};
use super::rate::RateKeeper;
use super::sched_counters::{Counts, Parts, find_culprit};
use super::schedule::{Schedule, bus_allowed_ns};
use crate::attendance::{Attendance, Parent};
use crate::link::{EmergencyStopError, EmergencyStopInput};
use crate::logging::Summed;
use crate::realtime::{self, CpuWitness, Grant, monotonic_ns};
use crate::topics::{Controller as ControllerRole, Hub, PortError, PublishError, RoleLock};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{Alarm, Command, CommandRecord, Culprit, Mode, Timing};

/// The witness's priority lies this far below the loop's: never in its way, and above everything that could delay a device's
/// answer.
const WITNESS_BELOW_LOOP: u8 = 5;

/// So many ticks lie between two of those that let late joiners into the topic `command`.
const TICKS_TO_JOIN: u64 = 32;

/// Stack that is touched before the first tick, bytes: many times what a tick uses.
const STACK_BYTES: usize = 256 * 1024;

/// Why the loop could not start.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A topic cannot be used.
    #[error(transparent)]
    Topic(#[from] PortError),
    /// The emergency stop cannot be read.
    #[error(transparent)]
    EmergencyStop(#[from] EmergencyStopError),
    /// A thread beside the loop cannot be started.
    #[error("a thread beside the loop cannot be started: {0}")]
    Thread(std::io::Error),
}

/// Totals of the loop at its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ending {
    /// Ticks that were run.
    pub ticks: u64,
    /// Deadlines that passed without a tick.
    pub overruns: u64,
    /// Messages that could not be published.
    pub unpublished: u64,
}

/// Runs the worm until `end` is set and the motor is off; a worm whose parent is gone also until the motor is off for another
/// reason. `ready` is called once, when topics and operating system are set
/// up, with what the operating system granted.
///
/// # Errors
/// [`RunError`] when the loop could not start. Once it runs, problems are faults and alarms, not errors.
pub fn run(
    config: &Config,
    drive: &mut Drive,
    hub: &Hub,
    role: &RoleLock<ControllerRole>,
    attendance: &Attendance,
    end: &AtomicBool,
    ready: impl FnOnce(&[Grant]),
) -> Result<Ending, RunError> {
    let emergency_stop = EmergencyStopInput::open(config)?;
    let ports = Ports::open(hub, role)?;
    let journal = Journal::start().map_err(RunError::Thread)?;
    let witness_priority = config.realtime.priority.saturating_sub(WITNESS_BELOW_LOOP);
    let witness = CpuWitness::start(witness_priority).map_err(RunError::Thread)?;
    let grants = realtime::request(&config.realtime, 0);
    prefault_stack();
    ready(&grants);
    let mut tick_loop = Loop {
        ports,
        journal,
        witness,
        silence: Silence::new(config),
        emergency_stop,
        absent_ns: 0,
        exchanged_ns: 0,
        controller: Controller::new(config),
        schedule: Schedule::new(config.control.rate_hz, monotonic_ns()),
        rate: RateKeeper::new(
            config.control.rate_hz,
            slowest_rate_hz(config),
            config.control.adapt_rate,
        ),
        configured_hz: config.control.rate_hz,
        bus_wait_share: config.control.bus_wait_share,
        alarms: [Alarm::NONE; ALARMS_PER_TICK],
        last: None,
        served: Served::NOTHING,
        failed_services: Summed::default(),
        publish_ns: 0,
        work_ns: 0,
        host_pauses: 0,
        unpublished: 0,
        ticks: 0,
        commands: 0,
        was_gone: false,
    };
    while !tick_loop.tick(drive, attendance, end.load(Ordering::Relaxed)) {}
    Ok(Ending {
        ticks: tick_loop.ticks,
        overruns: tick_loop.schedule.skipped(),
        unpublished: tick_loop.unpublished,
    })
}

/// The slowest rate that the loop may fall back to: it still reads every sample of a tracker, and detects silences in time.
fn slowest_rate_hz(config: &Config) -> f64 {
    let shortest_s = config
        .control
        .link_timeout_s
        .min(f64::from(config.servo.watchdog_ms) * 1e-3);
    let samples_hz = config.tracker_rate_hz().map_or(0.0, |rate_hz| 2.0 * rate_hz);
    samples_hz.max(5.0 / shortest_s)
}

struct Loop {
    ports: Ports,
    journal: Journal,
    witness: CpuWitness,
    silence: Silence,
    emergency_stop: Option<EmergencyStopInput>,
    /// How long the loop could not run although it was due, in all.
    absent_ns: u64,
    /// When the last exchange ended.
    exchanged_ns: u64,
    controller: Controller,
    schedule: Schedule,
    rate: RateKeeper,
    configured_hz: f64,
    bus_wait_share: f64,
    alarms: [Alarm; ALARMS_PER_TICK],
    /// What the last tick decided.
    last: Option<Outputs>,
    /// What became of the service that it requested.
    served: Served,
    failed_services: Summed<u64>,
    /// How long the last tick's publishing took.
    publish_ns: u64,
    /// How long the last tick worked after its exchange, without its service.
    work_ns: u64,
    host_pauses: u64,
    unpublished: u64,
    ticks: u64,
    /// Commands that were answered.
    commands: u64,
    was_gone: bool,
}

/// What became of a service.
#[derive(Clone, Copy)]
struct Served {
    outcome: Option<ServiceOutcome>,
    /// The servo's hardware error status, if it was read.
    hardware_error: Option<u8>,
    /// How long it took.
    took_ns: u64,
}

impl Served {
    /// No service was requested.
    const NOTHING: Self = Self {
        outcome: None,
        hardware_error: None,
        took_ns: 0,
    };
}

/// Times of one tick, ns of `CLOCK_MONOTONIC`.
#[derive(Clone, Copy)]
struct Times {
    deadline: u64,
    woken: u64,
    /// How long the devices had for their answer.
    bus_allowed: u64,
    exchanged: u64,
    computed: u64,
    published: u64,
    notified: u64,
}

impl Loop {
    /// One tick; true when the loop is over.
    fn tick(&mut self, drive: &mut Drive, attendance: &Attendance, end: bool) -> bool {
        let deadline = self.schedule.deadline_ns();
        while monotonic_ns() < deadline {
            realtime::sleep_until(deadline);
        }
        let woken = monotonic_ns();

        let bus_allowed = bus_allowed_ns(self.bus_wait_share, self.schedule.period_ns(), woken - deadline);
        let outcome = drive.exchange(
            self.last.map_or(0, |last| last.goal_counts),
            Instant::now() + Duration::from_nanos(bus_allowed),
        );
        self.note_port(drive.is_gone());
        let exchanged = monotonic_ns();
        let absent_ns = absent_ns(
            &ExchangeTimes {
                deadline,
                woken,
                bus_allowed,
                exchanged,
                work_before: self.work_ns,
                elapsed: exchanged.saturating_sub(std::mem::replace(&mut self.exchanged_ns, exchanged)),
            },
            self.schedule.period_ns(),
        ) + self.unanswerable_ns(outcome.servo.is_ok(), drive.is_gone());

        self.absent_ns += absent_ns;
        let present_ns = exchanged.saturating_sub(self.absent_ns);
        let emergency_stop = self.emergency_stop.as_mut();
        let emergency_stop = emergency_stop.map(|input| input.is_pressed(present_ns, &outcome));

        let alarm_count = self.ports.take_alarms(&mut self.alarms);
        let estimate = self.ports.estimates.latest().ok().flatten();
        let (command, responder) = take_command(&self.ports.commands, attendance);
        let parent = attendance.parent_in_tick(Duration::from_nanos(self.schedule.period_ns()));
        let lease = lease_of(parent);
        let inputs = Inputs {
            now_ns: exchanged,
            absent_ns,
            lost_exchanges: outcome.lost,
            servo: outcome.servo.as_ref().ok(),
            tracker: outcome.tracker.as_ref().ok(),
            command,
            alarms: &self.alarms[..alarm_count],
            estimate: estimate.as_deref().map(EstimateSeen::from),
            lease,
            emergency_stop,
            end: end || (parent == Parent::Gone && is_without_torque(self.controller.mode())),
            service: self.served.outcome,
            service_ns: self.served.took_ns,
            hardware_error: self.served.hardware_error,
        };
        let mode = self.controller.mode();
        let outputs = self.controller.tick(&inputs);
        self.note_mode(mode, &outputs);
        let computed = monotonic_ns();

        let published_state = self.ports.state.publish(&outputs.state);
        self.count_unpublished(published_state);
        let published = monotonic_ns();
        // One system call for each listener, none without. A listener that cannot be woken is not the loop's problem.
        let _ = self.ports.state_event.notify();
        let notified = monotonic_ns();
        attendance.note(self.ticks + 1, self.controller.mode(), self.controller.fault());
        self.publish_command(command.as_ref(), lease, &outputs);
        if let Some(reply) = &outputs.reply {
            match responder {
                // A client that has gone meanwhile needs no answer.
                Some(Asker::Topic(responder)) => drop(responder.answer(reply)),
                Some(Asker::StopSocket(number)) => attendance.answer(number, reply),
                None => {}
            }
        }
        // At once, because it may be to switch torque off. A finished loop has done what it could.
        let service = outputs.service.filter(|_| !outputs.finished);
        self.served = service.map_or(Served::NOTHING, |service| {
            // It takes its time, in which the emergency stop is not read: that is no silence of the switch.
            if let Some(emergency_stop) = &mut self.emergency_stop {
                emergency_stop.forget();
            }
            serve(drive, service, &mut self.failed_services)
        });
        self.finish(
            Times {
                deadline,
                woken,
                bus_allowed,
                exchanged,
                computed,
                published,
                notified,
            },
            outputs.host_paused_ns,
            outcome.late,
        );
        self.last = Some(outputs);
        self.ticks += 1;
        self.journal.count_ticks(self.ticks);
        outputs.finished
    }

    /// How much of this tick is not charged to a silent servo: all of it while a CPU of this computer does not run, since the answer
    /// may be waiting for that CPU.
    fn unanswerable_ns(&mut self, answered: bool, is_gone: bool) -> u64 {
        let period_ns = self.schedule.period_ns();
        let witness = &self.witness;
        self.silence
            .uncharged_ns(period_ns, answered || is_gone, || witness.check())
    }

    fn note_port(&mut self, is_gone: bool) {
        if is_gone != self.was_gone {
            self.journal
                .note(if is_gone { Entry::PortLost } else { Entry::PortBack });
            self.was_gone = is_gone;
        }
    }

    fn note_mode(&self, from: Mode, outputs: &Outputs) {
        let to = self.controller.mode();
        if from != to {
            self.journal.note(Entry::ModeChanged {
                from,
                to,
                fault: self.controller.fault(),
                alarm: outputs.state.fault_alarm,
                pause_ns: self.controller.pause_of_fault_ns(),
            });
        }
        for note in outputs.notes.iter() {
            self.journal.note(Entry::Noted(note));
        }
    }

    fn count_unpublished(&mut self, outcome: Result<(), PublishError>) {
        self.unpublished += u64::from(outcome.is_err());
    }

    /// Publishes what became of this tick's command. Without one it lets late joiners in, but not in every tick: the other topics do
    /// that with each message.
    fn publish_command(&mut self, command: Option<&Command>, lease: Lease, outputs: &Outputs) {
        let records = &self.ports.command_records;
        let published = match (command, &outputs.reply) {
            (Some(command), Some(reply)) => {
                let at = (outputs.state.time_ns, outputs.state.phase);
                let supervised = lease == Lease::Held;
                let record = CommandRecord::new(self.commands, at, supervised, command, reply);
                self.commands += 1;
                records.publish(&record)
            }
            _ if self.ticks.is_multiple_of(TICKS_TO_JOIN) => records.idle(),
            _ => return,
        };
        self.count_unpublished(published);
    }

    /// Ends the tick on the schedule and publishes where its time went. A tick with a service has paused on purpose, while the worm
    /// stood still: it is no overrun.
    fn finish(&mut self, times: Times, host_paused_ns: u64, late_answer: bool) {
        let period_ns = self.schedule.period_ns();
        let skipped = if self.served.outcome.is_some() {
            self.schedule.finish_pause(monotonic_ns());
            0
        } else {
            self.schedule.finish(monotonic_ns())
        };
        let (culprit, evidence) = if skipped == 0 {
            (Culprit::None, Counts::default())
        } else {
            self.explain_late_tick(&times)
        };
        if host_paused_ns > 0 {
            self.host_pauses += 1;
            self.journal.note(Entry::HostPaused {
                pause_ns: host_paused_ns,
                evidence,
            });
        } else if skipped > 0 && times.notified - times.exchanged < MIN_PAUSE_NS {
            // A pause in the middle of the tick's own work is reported as a pause by the next tick.
            let late_us = (times.notified - times.deadline) / 1000;
            self.journal.note(Entry::Overrun {
                sequence: self.ticks,
                skipped,
                culprit,
                late_us: u32::try_from(late_us).unwrap_or(u32::MAX),
            });
        }
        let timing = Timing {
            sequence: self.ticks,
            deadline_ns: times.deadline,
            wake_lateness_ns: times.woken - times.deadline,
            bus_ns: times.exchanged - times.woken,
            compute_ns: times.computed - times.exchanged,
            publish_ns: self.publish_ns,
            notify_ns: times.notified - times.published,
            waited_ns: evidence.waited_ns,
            stolen_ns: evidence.stolen_ns,
            overruns: self.schedule.skipped(),
            period_ns,
            host_paused_ns,
            host_pauses: self.host_pauses,
            overrun: u32::from(skipped > 0),
            culprit: culprit.code(),
            minor_faults: u32::try_from(evidence.minor_faults).unwrap_or(u32::MAX),
            major_faults: u32::try_from(evidence.major_faults).unwrap_or(u32::MAX),
        };
        let published = self.ports.timing.publish(&timing);
        self.count_unpublished(published);
        let end = monotonic_ns();
        self.publish_ns = (end - times.notified + times.published - times.computed).saturating_sub(self.served.took_ns);
        self.work_ns = (end - times.exchanged).saturating_sub(self.served.took_ns);
        // The deadlines that a pause cost say nothing about the rate.
        let is_paused = host_paused_ns > 0 || self.work_ns >= MIN_PAUSE_NS;
        let (skipped, late_answer) = if is_paused { (0, false) } else { (skipped, late_answer) };
        if let Some(divider) = self.rate.take(skipped, late_answer) {
            self.schedule.slow_down(divider);
            self.journal.note(Entry::RateChanged {
                configured_hz: self.configured_hz,
                held_hz: self.configured_hz / divider as f64,
            });
        }
    }

    /// Finds the cause of a late tick.
    fn explain_late_tick(&self, times: &Times) -> (Culprit, Counts) {
        let evidence = self.journal.evidence(self.ticks);
        let parts = Parts {
            wake: times.woken - times.deadline,
            bus: times.exchanged - times.woken,
            bus_allowed: times.bus_allowed,
            compute: times.computed - times.exchanged,
            publish: times.notified - times.computed,
        };
        (find_culprit(&parts, &evidence), evidence)
    }
}

/// Touches as much stack as a tick could ever use, so that no tick waits for its pages.
#[inline(never)]
fn prefault_stack() {
    let mut stack = [0_u8; STACK_BYTES];
    std::hint::black_box(&mut stack);
}

/// Executes a service and returns what became of it. Logging is allowed here, because the worm stands still, or is to, and because it
/// waits for no reader (`print::log_in_background`). While a port is gone, torque is tried to be switched off twice a second.
fn serve(drive: &mut Drive, service: Service, failures: &mut Summed<u64>) -> Served {
    let begun = monotonic_ns();
    let (outcome, hardware_error) = match drive.serve(service) {
        Ok(hardware_error) => (ServiceOutcome::Done(service), hardware_error),
        Err(error) => {
            failures.add(|count| *count += 1);
            match failures.take_due(begun, false) {
                Some(1) => tracing::error!("{service:?} failed: {error}"),
                Some(count) => {
                    tracing::error!("{service:?} failed: {error}; {count} failures since this was last said")
                }
                None => {}
            }
            (ServiceOutcome::Failed(service), None)
        }
    };
    Served {
        outcome: Some(outcome),
        hardware_error,
        took_ns: monotonic_ns() - begun,
    }
}

/// Whether the worm rests without torque, or with none that could be switched off: an orphaned controller then has nothing left to do.
fn is_without_torque(mode: Mode) -> bool {
    matches!(mode, Mode::Disarmed | Mode::Fault)
}

fn lease_of(parent: Parent) -> Lease {
    match parent {
        Parent::None => Lease::None,
        Parent::Here => Lease::Held,
        Parent::Silent | Parent::Gone => Lease::Lapsed,
    }
}
