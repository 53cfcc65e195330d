//! The tick: inputs and time in, outputs out. All of the controller's behaviour and none of its I/O.

use super::interface::{Inputs, Outputs, Service, ServiceOutcome};
use super::loop_clock::{ClockStep, LoopClock};
use super::ramp::{CountRounding, Ramp};
use super::resume::Resume;
use super::safety::{Safety, SafetyInputs};
use super::state_assembler::StateAssembler;
use crate::link::ServoReading;
use std::f64::consts::TAU;
use worm_estimator::config::{Config, Policy};
use worm_estimator::message::{Alarm, AlarmKind, Command, CommandKind, CommandOutcome, Fault, Mode, Reply, State};
use worm_estimator::time::seconds;

/// Goal velocity per count, rad/s (XL330-M288 e-manual, register 104: 0.229 rev/min).
const RAD_S_PER_COUNT: f64 = 0.229 * TAU / 60.0;

/// Cam velocity below which the motor counts as standing still, rad/s: two counts.
const STANDSTILL_RAD_S: f64 = 2.0 * RAD_S_PER_COUNT;

/// Longest wait for the cam to stand still before torque goes off, ns.
const STANDSTILL_TIMEOUT_NS: u64 = 500_000_000;

/// Interval of the attempts to switch torque off on a servo that does not answer, ns.
const RETRY_NS: u64 = 500_000_000;

/// Attempts to switch torque off before an ending process gives up; the servo's own watchdog then stops the motor.
const DISARM_ATTEMPTS: u32 = 3;

/// The controller: a state machine that is advanced by [`Controller::tick`].
///
/// ```text
///             arm              crawl                hold, alarm
/// disarmed ────────► armed ───────────► crawling ───────────────► holding
///    ▲                 │                   │  ▲                      │
///    │                 │ stop              │  └──────── crawl ───────┤
///    │                 ▼                   ▼ stop                    │
///    └───────────── stopping ◄───────────────────────────────────────┘
///
/// any of these but disarmed ── limit, silence, alarm with policy stop ──► fault ── reset ──► armed
/// ```
#[derive(Debug, Clone)]
pub struct Controller {
    gait_velocity_rad_s: f64,
    velocity_limit_rad_s: f64,
    hold_gain_per_s: f64,
    back_off_cycles: f64,
    require_estimator: bool,
    policies: [Policy; AlarmKind::ALL.len()],

    loop_clock: LoopClock,
    assembler: StateAssembler,
    safety: Safety,
    ramp: Ramp,
    rounding: CountRounding,

    mode: Mode,
    fault: Fault,
    fault_alarm: Option<AlarmKind>,
    /// How long the computer has paused since the servo last answered in a tick without a pause, ns; frozen when a fault is
    /// latched.
    paused_unanswered_ns: u64,
    resume: Resume,
    /// Cam angle that a hold keeps; none until the ramp has come to rest.
    hold_angle_rad: Option<f64>,
    /// Cam angle at which a back-off ends.
    back_off_until_rad: Option<f64>,
    mode_since_ns: u64,
    armed_ns: u64,
    estimate_seen_ns: Option<u64>,
    /// The service that the next output requests.
    pending: Option<Service>,
    /// When to switch torque off; none when it is off, or is to stay on.
    disarm_due_ns: Option<u64>,
    disarm_failures: u32,
    limit_ns: Option<u64>,
}

impl Controller {
    /// A disarmed controller.
    pub fn new(config: &Config) -> Self {
        let gait_velocity_rad_s = config.gait_cycles_per_s() * TAU;
        let mut policies = [Policy::Warn; AlarmKind::ALL.len()];
        for kind in AlarmKind::ALL {
            policies[kind.code() as usize] = config.alarms.of(*kind).policy;
        }
        Self {
            gait_velocity_rad_s,
            velocity_limit_rad_s: config.servo.velocity_limit_rev_per_min * TAU / 60.0,
            hold_gain_per_s: config.control.hold_gain_per_s,
            back_off_cycles: config.control.back_off_cycles,
            require_estimator: config.control.require_estimator,
            policies,
            loop_clock: LoopClock::default(),
            assembler: StateAssembler::new(config),
            safety: Safety::new(config),
            ramp: Ramp::at_rest(gait_velocity_rad_s.abs() / config.gait.ramp_s),
            rounding: CountRounding::default(),
            mode: Mode::Disarmed,
            fault: Fault::None,
            fault_alarm: None,
            paused_unanswered_ns: 0,
            resume: Resume::new(config),
            hold_angle_rad: None,
            back_off_until_rad: None,
            mode_since_ns: 0,
            armed_ns: 0,
            estimate_seen_ns: None,
            pending: None,
            disarm_due_ns: None,
            disarm_failures: 0,
            limit_ns: None,
        }
    }

    /// The mode of the state machine.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The latched reason of a fault.
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// How long the computer paused before the fault [`Fault::HostPaused`], ns.
    pub fn pause_of_fault_ns(&self) -> u64 {
        self.paused_unanswered_ns
    }

    /// One tick. All times in it are of the loop's own clock, which stands still while the computer pauses.
    pub fn tick(&mut self, inputs: &Inputs<'_>) -> Outputs {
        let ClockStep {
            present_ns: now_ns,
            step_ns,
            pause_ns,
        } = self.loop_clock.advance(inputs.now_ns, inputs.absent_ns);
        let dt_s = seconds(step_ns);

        self.assembler.state.link_failures += u64::from(inputs.lost_exchanges);
        self.assembler.take_servo(inputs.now_ns, now_ns, inputs.servo);
        self.assembler.take_tracker(inputs.now_ns, now_ns, inputs.tracker);
        if inputs.estimate.is_some() {
            self.estimate_seen_ns = Some(now_ns);
        }
        if let Some(bits) = inputs.hardware_error {
            self.assembler.state.hardware_error = u32::from(bits);
        }
        if let Some(outcome) = inputs.service {
            self.take_service(outcome, now_ns);
        }
        self.resume.take_alarms(inputs.alarms);
        if self.mode != Mode::Fault {
            self.paused_unanswered_ns += pause_ns;
        }
        if self.has_torque() {
            self.check_safety(inputs, now_ns, dt_s);
        }
        // A reading in the tick of the pause itself may be older than the pause.
        if self.mode != Mode::Fault && inputs.servo.is_some() && pause_ns == 0 {
            self.paused_unanswered_ns = 0;
        }
        for alarm in inputs.alarms {
            self.take_alarm(alarm, now_ns);
        }
        self.resume_after_pause(now_ns, pause_ns, inputs);
        let reply = inputs
            .command
            .map(|command| self.take_command(&command, now_ns, inputs.servo));
        if inputs.end {
            self.begin_end(now_ns);
        }

        // STOPGAP
        if inputs.lease == super::interface::Lease::Lapsed && self.mode == Mode::Crawling {
            self.ramp.halt();
            self.enter(Mode::Holding, now_ns);
        }
        if self.mode == Mode::Crawling && self.limit_ns.is_some_and(|limit| now_ns >= limit) {
            self.enter(Mode::Holding, now_ns);
        }
        if let Some(c) = inputs.command
            && c.kind == CommandKind::Crawl.code()
        {
            self.limit_ns = if c.limit_s > 0.0 {
                Some(now_ns + (c.limit_s * 1e9) as u64)
            } else {
                None
            };
        }
        let velocity_rad_s = self.command_velocity(now_ns, dt_s);
        let service = self.due_service(now_ns);
        let finished = inputs.end && self.is_over();
        let servo_rad_s = self.assembler.cam().servo_velocity_rad_s(velocity_rad_s);
        Outputs {
            state: self.fill_state(inputs.now_ns, velocity_rad_s),
            goal_counts: self.rounding.round(servo_rad_s / RAD_S_PER_COUNT),
            service,
            reply,
            host_paused_ns: pause_ns,
            finished,
        }
    }

    fn has_torque(&self) -> bool {
        matches!(self.mode, Mode::Armed | Mode::Crawling | Mode::Holding | Mode::Stopping)
    }

    fn enter(&mut self, mode: Mode, now_ns: u64) {
        self.mode = mode;
        self.mode_since_ns = now_ns;
        self.hold_angle_rad = None;
        self.back_off_until_rad = None;
    }

    fn enter_fault(&mut self, fault: Fault, alarm: Option<AlarmKind>, now_ns: u64) {
        self.enter(Mode::Fault, now_ns);
        self.fault = fault;
        self.fault_alarm = alarm;
        self.ramp.halt();
        self.request_disarm(now_ns);
    }

    fn request_disarm(&mut self, now_ns: u64) {
        self.disarm_due_ns = Some(now_ns);
        self.disarm_failures = 0;
    }

    fn check_safety(&mut self, inputs: &Inputs<'_>, now_ns: u64, dt_s: f64) {
        let fault = self.safety.check(&SafetyInputs {
            now_ns,
            dt_s,
            // A reading from before a service says nothing about the servo after it.
            servo: inputs.servo.filter(|_| inputs.service.is_none()),
            assembler: &self.assembler,
            estimate_seen_ns: self.estimate_seen_ns,
            paused_ns: self.paused_unanswered_ns,
            armed_ns: self.armed_ns,
            crawling_since_ns: (self.mode == Mode::Crawling).then_some(self.mode_since_ns),
        });
        if let Some(fault) = fault {
            if fault == Fault::HostPaused && self.mode == Mode::Crawling && self.back_off_until_rad.is_none() {
                self.resume.begin(now_ns, self.ramp.target_rad_s());
            }
            self.enter_fault(fault, None, now_ns);
        }
    }

    /// Prepares the servo again after a pause of the computer, if this is configured and safe.
    fn resume_after_pause(&mut self, now_ns: u64, pause_ns: u64, inputs: &Inputs<'_>) {
        let is_disarmed = self.mode == Mode::Fault && self.disarm_due_ns.is_none() && self.pending.is_none();
        let devices_answer = inputs.servo.is_some_and(|servo| !servo.alert)
            && !self
                .safety
                .persists(Fault::TrackerStale, now_ns, inputs.servo, &self.assembler);
        if inputs.end || inputs.command.is_some() {
            self.resume.cancel();
        } else if self.resume.is_due(now_ns, pause_ns, is_disarmed && devices_answer) {
            self.pending = Some(Service::Arm);
        }
    }

    fn take_service(&mut self, outcome: ServiceOutcome, now_ns: u64) {
        self.pending = None;
        match outcome {
            ServiceOutcome::Done(Service::Arm) => {
                self.fault = Fault::None;
                self.fault_alarm = None;
                self.armed_ns = now_ns;
                self.safety.rearm();
                self.ramp.halt();
                self.enter(Mode::Armed, now_ns);
                if let Some(velocity_rad_s) = self.resume.take_velocity_rad_s() {
                    self.enter(Mode::Crawling, now_ns);
                    self.ramp.aim(velocity_rad_s);
                }
            }
            ServiceOutcome::Done(Service::Disarm) => {
                self.disarm_due_ns = None;
                if self.mode != Mode::Fault {
                    self.enter(Mode::Disarmed, now_ns);
                }
            }
            // A disarmed worm stays disarmed, a faulty one in its fault; the loop has logged the reason.
            ServiceOutcome::Failed(Service::Arm) => self.resume.cancel(),
            ServiceOutcome::Failed(Service::Disarm) => {
                self.disarm_failures += 1;
                self.disarm_due_ns = Some(now_ns + RETRY_NS);
                if self.mode != Mode::Fault {
                    self.enter(Mode::Fault, now_ns);
                    self.fault = Fault::LinkLost;
                }
            }
        }
    }

    fn take_alarm(&mut self, alarm: &Alarm, now_ns: u64) {
        // Unknown kinds, of a newer estimator, have no policy.
        let Ok(kind) = AlarmKind::try_from(alarm.kind) else {
            return;
        };
        if alarm.raised == 0 || !self.has_torque() {
            return;
        }
        let is_crawling = self.mode == Mode::Crawling;
        match self.policies[kind.code() as usize] {
            Policy::Stop if self.mode != Mode::Stopping => self.enter_fault(Fault::Alarm, Some(kind), now_ns),
            Policy::Hold if is_crawling => self.enter(Mode::Holding, now_ns),
            // An alarm during a back-off does not begin another one.
            Policy::BackOff if is_crawling && self.back_off_until_rad.is_none() => self.begin_back_off(),
            _ => {}
        }
    }

    fn begin_back_off(&mut self) {
        let backward = -self.ramp.direction_of_target();
        self.ramp.aim(backward * self.gait_velocity_rad_s.abs());
        self.back_off_until_rad = Some(self.assembler.state.motor_angle_rad + backward * self.back_off_cycles * TAU);
    }

    fn take_command(&mut self, command: &Command, now_ns: u64, servo: Option<&ServoReading>) -> Reply {
        let verdict = match CommandKind::try_from(command.kind) {
            Err(_) => CommandOutcome::Unknown,
            Ok(kind) => self.execute(kind, command.cycles_per_s, now_ns, servo),
        };
        Reply {
            sequence: self.assembler.state.sequence,
            verdict: verdict.code(),
            mode: self.mode.code(),
            fault: self.fault.code(),
            alarm_mask: 0,
        }
    }

    fn execute(
        &mut self,
        kind: CommandKind,
        cycles_per_s: f64,
        now_ns: u64,
        servo: Option<&ServoReading>,
    ) -> CommandOutcome {
        match (kind, self.mode) {
            (CommandKind::Arm, Mode::Disarmed) => {
                self.pending.get_or_insert(Service::Arm);
                CommandOutcome::Accepted
            }
            (CommandKind::Arm, Mode::Armed) => CommandOutcome::Accepted,
            (CommandKind::Crawl, Mode::Armed | Mode::Crawling | Mode::Holding) => {
                self.begin_crawl(cycles_per_s, now_ns)
            }
            (CommandKind::Hold, Mode::Armed | Mode::Crawling | Mode::Holding) => {
                if self.mode != Mode::Holding {
                    self.enter(Mode::Holding, now_ns);
                }
                CommandOutcome::Accepted
            }
            (CommandKind::Stop, Mode::Armed | Mode::Crawling | Mode::Holding) => {
                self.enter(Mode::Stopping, now_ns);
                CommandOutcome::Accepted
            }
            (CommandKind::Stop, Mode::Stopping | Mode::Disarmed | Mode::Fault) => CommandOutcome::Accepted,
            (CommandKind::Reset, Mode::Fault) => {
                if self.safety.persists(self.fault, now_ns, servo, &self.assembler) {
                    CommandOutcome::FaultPersists
                } else {
                    self.pending.get_or_insert(Service::Arm);
                    CommandOutcome::Accepted
                }
            }
            (CommandKind::Acknowledge, _) => CommandOutcome::Accepted,
            _ => CommandOutcome::WrongMode,
        }
    }

    fn begin_crawl(&mut self, cycles_per_s: f64, now_ns: u64) -> CommandOutcome {
        let velocity_rad_s = if cycles_per_s == 0.0 {
            self.gait_velocity_rad_s
        } else {
            cycles_per_s * TAU
        };
        if velocity_rad_s.is_nan() || velocity_rad_s.abs() > self.velocity_limit_rad_s {
            return CommandOutcome::BadSpeed;
        }
        if self.require_estimator && self.estimate_seen_ns.is_none() {
            return CommandOutcome::NoEstimator;
        }
        if self.mode != Mode::Crawling {
            self.enter(Mode::Crawling, now_ns);
        }
        self.back_off_until_rad = None;
        self.ramp.aim(velocity_rad_s);
        CommandOutcome::Accepted
    }

    fn begin_end(&mut self, now_ns: u64) {
        match self.mode {
            Mode::Armed | Mode::Crawling | Mode::Holding => self.enter(Mode::Stopping, now_ns),
            Mode::Disarmed | Mode::Stopping | Mode::Fault => {}
        }
        self.pending = self.pending.filter(|service| *service == Service::Disarm);
    }

    /// The cam velocity commanded in this tick, rad/s.
    fn command_velocity(&mut self, now_ns: u64, dt_s: f64) -> f64 {
        let angle_rad = self.assembler.state.motor_angle_rad;
        match self.mode {
            Mode::Disarmed | Mode::Armed | Mode::Fault => {
                self.ramp.halt();
                0.0
            }
            Mode::Crawling => {
                if self
                    .back_off_until_rad
                    .is_some_and(|until_rad| (angle_rad - until_rad) * self.ramp.direction_of_target() >= 0.0)
                {
                    self.enter(Mode::Holding, now_ns);
                }
                self.ramp.advance(dt_s)
            }
            Mode::Holding => self.hold_velocity(angle_rad, dt_s),
            Mode::Stopping => {
                self.ramp.aim(0.0);
                let velocity_rad_s = self.ramp.advance(dt_s);
                let is_standing =
                    self.ramp.is_at_rest() && self.assembler.state.motor_velocity_rad_s.abs() < STANDSTILL_RAD_S;
                let is_timed_out = now_ns.saturating_sub(self.mode_since_ns) > STANDSTILL_TIMEOUT_NS;
                if self.disarm_due_ns.is_none() && (is_standing || (self.ramp.is_at_rest() && is_timed_out)) {
                    self.request_disarm(now_ns);
                }
                velocity_rad_s
            }
        }
    }

    /// A hold first ramps down, then keeps the angle at which the cam came to rest.
    fn hold_velocity(&mut self, angle_rad: f64, dt_s: f64) -> f64 {
        let Some(hold_rad) = self.hold_angle_rad else {
            self.ramp.aim(0.0);
            let velocity_rad_s = self.ramp.advance(dt_s);
            if self.ramp.is_at_rest() {
                self.hold_angle_rad = Some(angle_rad);
            }
            return velocity_rad_s;
        };
        let max_rad_s = self.gait_velocity_rad_s.abs();
        (self.hold_gain_per_s * (hold_rad - angle_rad)).clamp(-max_rad_s, max_rad_s)
    }

    fn due_service(&mut self, now_ns: u64) -> Option<Service> {
        if self.disarm_due_ns.is_some_and(|due_ns| now_ns >= due_ns) {
            // Not again until the outcome of this one is known.
            self.disarm_due_ns = Some(u64::MAX);
            self.pending = None;
            return Some(Service::Disarm);
        }
        self.pending.take()
    }

    fn is_over(&self) -> bool {
        match self.mode {
            Mode::Disarmed => true,
            Mode::Fault => self.disarm_due_ns.is_none() || self.disarm_failures >= DISARM_ATTEMPTS,
            _ => false,
        }
    }

    fn fill_state(&mut self, now_ns: u64, velocity_rad_s: f64) -> State {
        let state = &mut self.assembler.state;
        state.time_ns = now_ns;
        state.host_paused_ns = self.loop_clock.paused_ns();
        state.goal_velocity_rad_s = velocity_rad_s;
        state.mode = self.mode.code();
        state.fault = self.fault.code();
        state.fault_alarm = self.fault_alarm.map_or(u32::MAX, AlarmKind::code);
        let published = *state;
        state.sequence += 1;
        published
    }
}

#[cfg(test)]
mod tests;
