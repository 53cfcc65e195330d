//! One worm with its controller and its estimator, tick by tick, wired like the processes: what the estimator publishes in one
//! tick reaches the controller in the next.

use super::machine::{Exchange, Machine, SERVICE_TIMEOUT_S, Served};
use crate::control::{Controller, EstimateSeen, Inputs, Lease, Outputs, Service, ServiceOutcome};
use worm_estimator::config::Config;
use worm_estimator::estimate::{EstimatorError, Observer};
use worm_estimator::message::{
    Alarm, AlarmKind, Command, CommandKind, CommandOutcome, Cycle, Fault, Mode, Range, State,
};

/// The estimator's heartbeat while no sample comes, s.
const HEARTBEAT_S: f64 = 0.1;
/// How often a service asks a servo that does not answer.
const ATTEMPTS: u32 = 3;

/// What a pause keeps from running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paused {
    /// The whole computer: worm, controller and estimator.
    Computer,
    /// The controller.
    Controller,
    /// The virtual worm, whose world then stands still.
    Worm,
    /// The estimator.
    Estimator,
}

/// The loop around one worm.
pub struct Session<M> {
    /// The worm.
    pub machine: M,
    controller: Controller,
    /// The estimator.
    pub observer: Observer,
    period_ns: u64,
    now_ns: u64,
    /// How long the worm's world has stood still.
    stood_ns: u64,
    /// How long it stood still during the service behind the last tick; counted with the next tick.
    stands_in_service_ns: u64,
    /// For how long the controller has not run since its last tick.
    absent_ns: u64,
    worm_stands_until_ns: u64,
    estimator_stands_until_ns: u64,
    /// States that the estimator has not taken yet.
    waiting: Vec<State>,
    last: Option<Outputs>,
    /// What became of the service that the last tick requested, and how long it took, ns.
    served: Option<(Served, u64)>,
    on_the_way: Vec<Alarm>,
    estimate_on_the_way: Option<EstimateSeen>,
    spoken_ns: u64,
    /// Every alarm that was raised.
    pub raised: Vec<Alarm>,
    /// Every cycle that ended, if they are collected.
    pub cycles: Option<Vec<Cycle>>,
    /// How far the battery lasts, after each of them.
    pub ranges: Vec<Range>,
}

/// What a tick showed.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    /// What the controller published.
    pub state: State,
    /// The goal velocity that it sends in the next exchange, counts.
    pub goal_counts: i32,
    /// What became of the command.
    pub verdict: Option<CommandOutcome>,
    /// What became of the service at the end of the tick.
    pub service: Option<ServiceOutcome>,
}

impl<M: Machine> Session<M> {
    /// A disarmed worm; ticks at `rate_hz`.
    ///
    /// # Errors
    /// [`EstimatorError`] for a configuration that was not checked.
    pub fn new(config: &Config, machine: M, rate_hz: f64) -> Result<Self, EstimatorError> {
        Ok(Self {
            machine,
            controller: Controller::new(config),
            observer: Observer::new(config)?,
            period_ns: (1e9 / rate_hz) as u64,
            now_ns: 1_000_000_000, // what start-up took, and more
            stood_ns: 0,
            stands_in_service_ns: 0,
            absent_ns: 0,
            worm_stands_until_ns: 0,
            estimator_stands_until_ns: 0,
            waiting: Vec::new(),
            last: None,
            served: None,
            on_the_way: Vec::new(),
            estimate_on_the_way: None,
            spoken_ns: 0,
            raised: Vec::new(),
            cycles: None,
            ranges: Vec::new(),
        })
    }

    /// Virtual time, s.
    pub fn now_s(&self) -> f64 {
        self.now_ns as f64 * 1e-9
    }

    /// The controller's mode.
    pub fn mode(&self) -> Mode {
        self.controller.mode()
    }

    /// The controller's latched fault.
    pub fn fault(&self) -> Fault {
        self.controller.fault()
    }

    /// Gives a command in the next tick.
    pub fn send(&mut self, kind: CommandKind, cycles_per_s: f64) -> Tick {
        self.tick(Some(Command {
            cycles_per_s,
            ..Command::new(kind)
        }))
    }

    /// Ticks for this long and shows every tick.
    pub fn run_s(&mut self, seconds: f64, mut look: impl FnMut(&Tick)) {
        let until_ns = self.now_ns + (seconds * 1e9) as u64;
        while self.now_ns < until_ns {
            look(&self.tick(None));
        }
    }

    /// Pauses a part of it for this long, beginning now.
    pub fn pause(&mut self, paused: Paused, ms: u64) {
        let pause_ns = ms * 1_000_000;
        match paused {
            Paused::Computer => {
                self.stood_ns += pause_ns;
                self.absent_ns += pause_ns;
                self.now_ns += pause_ns;
            }
            Paused::Controller => {
                self.absent_ns += pause_ns;
                self.now_ns += pause_ns;
            }
            Paused::Worm => self.worm_stands_until_ns = self.now_ns + pause_ns,
            Paused::Estimator => self.estimator_stands_until_ns = self.now_ns + pause_ns,
        }
    }

    /// How long the worm's world has stood still because of pauses, ns.
    pub fn stood_ns(&self) -> u64 {
        self.stood_ns
    }

    /// Time in the worm's world, s.
    pub fn world_s(&self) -> f64 {
        (self.now_ns - self.stood_ns) as f64 * 1e-9
    }

    /// One exchange with a worm whose world goes on; one that stands still answers nothing until it goes on.
    fn exchange(&mut self) -> Exchange {
        let goal_counts = self.last.map_or(0, |last| last.goal_counts);
        if self.now_ns < self.worm_stands_until_ns {
            self.stood_ns += self.period_ns;
            return Exchange {
                servo: None,
                tracker: None,
                lost: 0,
                emergency_stop: None,
            };
        }
        let world_s = self.world_s();
        self.machine.exchange(goal_counts, world_s)
    }

    /// A service, and when it was over, ns. A worm that stands still answers nothing.
    fn serve(&mut self, service: Service) -> (Served, u64) {
        let (now_ns, world_s) = (self.now_ns, self.world_s());
        if now_ns < self.worm_stands_until_ns {
            let took_s = f64::from(ATTEMPTS) * SERVICE_TIMEOUT_S;
            let took_ns = (took_s * 1e9) as u64;
            self.stands_in_service_ns = took_ns;
            let served = Served {
                outcome: ServiceOutcome::Failed(service),
                hardware_error: None,
                ended_s: world_s,
            };
            return (served, now_ns + took_ns);
        }
        let served = self.machine.serve(service, world_s);
        (served, now_ns.max((served.ended_s * 1e9) as u64 + self.stood_ns))
    }

    /// One tick, in the order of `control::run`.
    pub fn tick(&mut self, command: Option<Command>) -> Tick {
        self.now_ns += self.period_ns;
        self.stood_ns += std::mem::take(&mut self.stands_in_service_ns);
        let exchange = self.exchange();
        let now_ns = self.now_ns;
        let served = self.served.take();
        let outputs = self.controller.tick(&Inputs {
            now_ns,
            absent_ns: std::mem::take(&mut self.absent_ns),
            lost_exchanges: exchange.lost,
            servo: exchange.servo.as_ref(),
            tracker: exchange.tracker.as_ref(),
            command,
            alarms: &self.on_the_way,
            estimate: self.estimate_on_the_way.take(),
            lease: Lease::Held,
            emergency_stop: exchange.emergency_stop,
            end: false,
            service: served.as_ref().map(|(served, _)| served.outcome),
            service_ns: served.as_ref().map_or(0, |(_, took_ns)| *took_ns),
            hardware_error: served.and_then(|(served, _)| served.hardware_error),
        });
        self.last = Some(outputs);
        self.served = outputs.service.map(|service| {
            // A service pauses the schedule.
            let (served, ended_ns) = self.serve(service);
            self.now_ns = ended_ns;
            (served, ended_ns - now_ns)
        });
        self.on_the_way.clear();
        self.waiting.push(outputs.state);
        if self.now_ns >= self.estimator_stands_until_ns {
            for state in std::mem::take(&mut self.waiting) {
                self.estimate(&state);
            }
        }
        Tick {
            state: outputs.state,
            goal_counts: outputs.goal_counts,
            verdict: outputs
                .reply
                .map(|reply| CommandOutcome::try_from(reply.verdict).unwrap_or(CommandOutcome::Unknown)),
            service: self.served.map(|(served, _)| served.outcome),
        }
    }

    fn estimate(&mut self, state: &State) {
        let report = self.observer.update(state);
        self.on_the_way.extend_from_slice(&report.alarms);
        self.raised
            .extend(report.alarms.iter().filter(|alarm| alarm.raised == 1));
        let beats = state.time_ns.saturating_sub(self.spoken_ns) as f64 * 1e-9 >= HEARTBEAT_S;
        if report.estimate.is_some() || beats {
            self.estimate_on_the_way = Some((&self.observer.latest()).into());
            self.spoken_ns = state.time_ns;
        }
        if let (Some(cycles), Some(cycle)) = (&mut self.cycles, report.cycle) {
            cycles.push(cycle);
            self.ranges.extend(report.range);
        }
    }

    /// The names of the alarms that were raised, each once, in the order in which they came.
    pub fn raised_kinds(&self) -> Vec<AlarmKind> {
        let mut kinds = Vec::new();
        for alarm in &self.raised {
            if let Ok(kind) = AlarmKind::try_from(alarm.kind)
                && !kinds.contains(&kind)
            {
                kinds.push(kind);
            }
        }
        kinds
    }
}
