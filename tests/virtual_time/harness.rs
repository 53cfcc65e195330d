//! One worm with its controller and its estimator, tick by tick, wired as the processes are: what the estimator says in one tick
//! reaches the controller in the next.

use super::machine::Machine;
use wormd::config::Config;
use wormd::control::{Controller, Inputs, Outputs};
use wormd::estimate::Observer;
use wormd::message::{Alarm, AlarmKind, Command, CommandKind, Cycle, Fault, Mode, State, Verdict};

/// The estimator's heartbeat while no sample comes, s.
const HEARTBEAT_S: f64 = 0.1;

/// The loop around one worm.
pub struct Session<M> {
    pub machine: M,
    controller: Controller,
    pub observer: Observer,
    period_ns: u64,
    now_ns: u64,
    last: Option<Outputs>,
    on_the_way: Vec<Alarm>,
    estimate_on_the_way: bool,
    spoken_ns: u64,
    /// Every alarm that was raised.
    pub raised: Vec<Alarm>,
    /// Every cycle that ended, while somebody wants them.
    pub cycles: Option<Vec<Cycle>>,
}

/// What a tick showed.
pub struct Tick {
    pub state: State,
    pub goal_counts: i32,
    pub verdict: Option<Verdict>,
}

impl<M: Machine> Session<M> {
    /// A disarmed worm; ticks at `rate_hz`.
    pub fn new(config: &Config, machine: M, rate_hz: f64) -> Self {
        Self {
            machine,
            controller: Controller::new(config),
            observer: Observer::new(config).expect("a valid configuration"),
            period_ns: (1e9 / rate_hz) as u64,
            now_ns: 1_000_000_000, // what start-up took, and more
            last: None,
            on_the_way: Vec::new(),
            estimate_on_the_way: false,
            spoken_ns: 0,
            raised: Vec::new(),
            cycles: None,
        }
    }

    /// A worm that was armed and told to crawl with the configured gait.
    pub fn crawling(config: &Config, machine: M, rate_hz: f64) -> Self {
        let mut session = Self::new(config, machine, rate_hz);
        session.begin();
        session.command(CommandKind::Crawl, 0.0);
        session
    }

    /// Waits for the estimator, then arms.
    pub fn begin(&mut self) {
        self.run_s(0.05, |_| {});
        self.command(CommandKind::Arm, 0.0);
        self.run_s(0.05, |_| {});
        assert_eq!(self.controller.mode(), Mode::Armed, "a sound worm can be armed");
    }

    pub fn now_s(&self) -> f64 {
        self.now_ns as f64 * 1e-9
    }

    pub fn mode(&self) -> Mode {
        self.controller.mode()
    }

    pub fn fault(&self) -> Fault {
        self.controller.fault()
    }

    /// Gives a command, which must be accepted.
    pub fn command(&mut self, kind: CommandKind, cycles_per_s: f64) {
        let command = Command {
            cycles_per_s,
            kind: kind.code(),
            reserved: 0,
        };
        let verdict = self.tick(Some(command)).verdict;
        assert_eq!(verdict, Some(Verdict::Accepted), "{kind:?} at {} s", self.now_s());
    }

    /// Ticks for so long and shows every tick.
    pub fn run_s(&mut self, seconds: f64, mut look: impl FnMut(&Tick)) {
        let until_ns = self.now_ns + (seconds * 1e9) as u64;
        while self.now_ns < until_ns {
            look(&self.tick(None));
        }
    }

    /// One tick, in the order of `control::run`.
    pub fn tick(&mut self, command: Option<Command>) -> Tick {
        self.now_ns += self.period_ns;
        let goal_counts = self.last.map_or(0, |last| last.goal_counts);
        let exchange = self.machine.exchange(goal_counts, self.now_s());
        let now_ns = self.now_ns;
        let service = self.last.and_then(|last| last.service);
        let served = service.map(|service| self.machine.serve(service, self.now_s()));
        if let Some(served) = &served {
            // A service pauses the schedule.
            self.now_ns = self.now_ns.max((served.ended_s * 1e9) as u64);
        }
        let outputs = self.controller.tick(&Inputs {
            now_ns,
            servo: exchange.servo.as_ref(),
            tracker: exchange.tracker.as_ref(),
            command,
            alarms: &self.on_the_way,
            estimate_arrived: self.estimate_on_the_way,
            end: false,
            service: served.as_ref().map(|served| served.outcome),
            hardware_error: served.and_then(|served| served.hardware_error),
        });
        self.last = Some(outputs);
        self.estimate(&outputs.state);
        Tick {
            state: outputs.state,
            goal_counts: outputs.goal_counts,
            verdict: outputs
                .reply
                .map(|reply| Verdict::try_from(reply.verdict).expect("a verdict")),
        }
    }

    fn estimate(&mut self, state: &State) {
        let report = self.observer.update(state);
        self.on_the_way.clear();
        self.on_the_way.extend_from_slice(&report.alarms);
        self.raised
            .extend(report.alarms.iter().filter(|alarm| alarm.raised == 1));
        let beats = state.time_ns.saturating_sub(self.spoken_ns) as f64 * 1e-9 >= HEARTBEAT_S;
        self.estimate_on_the_way = report.estimate.is_some() || beats;
        if self.estimate_on_the_way {
            self.spoken_ns = state.time_ns;
        }
        if let (Some(cycles), Some(cycle)) = (&mut self.cycles, report.cycle) {
            cycles.push(cycle);
        }
    }

    /// The names of the alarms that were raised, each once, in the order in which they came.
    pub fn raised_kinds(&self) -> Vec<AlarmKind> {
        let mut kinds = Vec::new();
        for alarm in &self.raised {
            let kind = AlarmKind::try_from(alarm.kind).expect("a known alarm");
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        kinds
    }
}

/// A configuration from what differs.
pub fn config(toml: &str) -> Config {
    Config::from_toml(toml, "test".as_ref()).expect("a valid test configuration")
}
