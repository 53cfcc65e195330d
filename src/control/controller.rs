//! The tick: inputs and time in, outputs out. All of the controller's behaviour and none of its I/O.

mod alarms;
mod commands;
mod motion;

use super::crawl_limit::CrawlLimit;
use super::estimator_watch::EstimatorWatch;
use super::interface::{Inputs, Lease, Note, Notes, Outputs, Service, ServiceOutcome};
use super::loop_clock::{ClockStep, LoopClock, seconds_to_ns};
use super::ramp::{CountRounding, Ramp};
use super::resume::Resume;
use super::safety::{Safety, SafetyInputs};
use super::standing_alarms::StandingAlarms;
use super::state_assembler::StateAssembler;
use motion::BackOff;
use std::f64::consts::TAU;
use worm_estimator::config::{Config, IdleDisarm, OnLapsedLease};
use worm_estimator::message::{AlarmKind, Fault, HoldReason, Mode, State};
use worm_estimator::time::seconds;

/// Goal velocity per count, rad/s (XL330-M288 e-manual, register 104: 0.229 rev/min).
const RAD_S_PER_COUNT: f64 = 0.229 * TAU / 60.0;

/// Interval of the attempts to switch torque off on a servo that does not answer, ns.
const RETRY_NS: u64 = 500_000_000;

/// Attempts to switch torque off before an ending process gives up; the servo's own watchdog then stops the motor.
const DISARM_ATTEMPTS: u32 = 3;

/// The controller: a state machine that is advanced by [`Controller::tick`].
///
/// ```text
///             arm              crawl             hold, alarm, lapsed lease, time limit
/// disarmed ────────► armed ───────────► crawling ───────────────► holding
///    ▲                 │                   │  ▲                      │
///    │                 │ stop, idle        │  └──────── crawl ───────┤
///    │                 ▼                   ▼ stop                    │ stop, idle
///    └───────────── stopping ◄───────────────────────────────────────┘
///
/// any of these but disarmed ── limit, silence, alarm with policy stop, emergency stop ──► fault ── reset ──► armed
/// ```
///
/// An arming that fails may have left torque on: a disarmed worm then goes through `stopping`, a faulty one stays in its fault,
/// until torque is confirmed to be off.
#[derive(Debug, Clone)]
pub struct Controller {
    gait_velocity_rad_s: f64,
    velocity_limit_rad_s: f64,
    hold_gain_per_s: f64,
    back_off_cycles: f64,
    require_estimator: bool,
    estimator_timeout_ns: u64,
    crawl_limit_s: f64,
    on_lapsed_lease: OnLapsedLease,
    /// Time without motion after which torque goes off, ns; none where it stays on.
    idle_limit_ns: Option<u64>,

    loop_clock: LoopClock,
    assembler: StateAssembler,
    safety: Safety,
    estimator: EstimatorWatch,
    alarms: StandingAlarms,
    ramp: Ramp,
    rounding: CountRounding,

    mode: Mode,
    fault: Fault,
    fault_alarm: Option<AlarmKind>,
    /// The link is lost while torque was on, and the servo has not answered since.
    is_silence_unexplained: bool,
    /// How long the computer has paused since the servo last answered in a tick without a pause, ns; frozen when a fault is
    /// latched.
    paused_unanswered_ns: u64,
    resume: Resume,
    hold_reason: HoldReason,
    /// Cam angle that a hold keeps; none until the cam has come to rest.
    hold_angle_rad: Option<f64>,
    /// Since when a hold commands the cam to stand.
    at_rest_since_ns: Option<u64>,
    /// Since when the cam of a hold that keeps no angle yet has been at rest.
    resting_since_ns: Option<u64>,
    back_off: Option<BackOff>,
    crawl_limit: CrawlLimit,
    /// Since when torque is on and no motion is commanded.
    idle_since_ns: Option<u64>,
    mode_since_ns: u64,
    armed_ns: u64,
    emergency_stop: Option<bool>,
    /// The service that a command, or a resume, has requested.
    pending: Option<Service>,
    /// When to switch torque off; none when it is off, or is to stay on.
    disarm_due_ns: Option<u64>,
    disarm_failures: u32,
    notes: Notes,
}

impl Controller {
    /// A disarmed controller.
    pub fn new(config: &Config) -> Self {
        let gait_velocity_rad_s = config.gait_cycles_per_s() * TAU;
        let idles_out = match config.control.idle_disarm {
            IdleDisarm::Level => config.canal.slope_deg.abs() <= IdleDisarm::LEVEL_DEG,
            IdleDisarm::Always => true,
            IdleDisarm::Never => false,
        };
        Self {
            gait_velocity_rad_s,
            velocity_limit_rad_s: config.servo.velocity_limit_rev_per_min * TAU / 60.0,
            hold_gain_per_s: config.control.hold_gain_per_s,
            back_off_cycles: config.control.back_off_cycles,
            require_estimator: config.control.require_estimator,
            estimator_timeout_ns: seconds_to_ns(config.control.estimator_timeout_s),
            crawl_limit_s: config.control.crawl_limit_s,
            on_lapsed_lease: config.control.on_lapsed_lease,
            idle_limit_ns: idles_out.then(|| seconds_to_ns(config.control.idle_disarm_s)),
            loop_clock: LoopClock::default(),
            assembler: StateAssembler::new(config),
            safety: Safety::new(config),
            estimator: EstimatorWatch::new(config),
            alarms: StandingAlarms::new(config),
            ramp: Ramp::at_rest(gait_velocity_rad_s.abs() / config.gait.ramp_s),
            rounding: CountRounding::default(),
            mode: Mode::Disarmed,
            fault: Fault::None,
            fault_alarm: None,
            is_silence_unexplained: false,
            paused_unanswered_ns: 0,
            resume: Resume::new(config),
            hold_reason: HoldReason::None,
            hold_angle_rad: None,
            at_rest_since_ns: None,
            resting_since_ns: None,
            back_off: None,
            crawl_limit: CrawlLimit::NONE,
            idle_since_ns: None,
            mode_since_ns: 0,
            armed_ns: 0,
            emergency_stop: None,
            pending: None,
            disarm_due_ns: None,
            disarm_failures: 0,
            notes: Notes::default(),
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

    /// One tick. All times in it are of the loop's own clock, which stands still while the computer pauses and during services.
    pub fn tick(&mut self, inputs: &Inputs<'_>) -> Outputs {
        let ClockStep {
            present_ns: now_ns,
            step_ns,
            pause_ns,
        } = self
            .loop_clock
            .advance(inputs.now_ns, inputs.absent_ns, inputs.service_ns);
        let dt_s = seconds(step_ns);
        self.notes = Notes::default();

        self.assembler.state.link_failures += u64::from(inputs.lost_exchanges);
        self.assembler.take_servo(inputs.now_ns, now_ns, inputs.servo);
        self.assembler.take_tracker(inputs.now_ns, now_ns, inputs.tracker);
        if let Some(bits) = inputs.hardware_error {
            self.assembler.state.hardware_error = u32::from(bits);
        }
        if let Some(outcome) = inputs.service {
            self.take_service(outcome, now_ns);
        }
        self.emergency_stop = inputs.emergency_stop;
        // A line that is dead silences the switch, too: the reason is the line then.
        let is_line_silent = inputs.servo.is_none();
        if !is_line_silent {
            self.heed_emergency_stop(now_ns);
        }
        if self.mode != Mode::Fault {
            self.paused_unanswered_ns += pause_ns;
        }
        if self.has_torque() {
            self.check_safety(inputs, now_ns, dt_s);
        }
        if is_line_silent {
            self.heed_emergency_stop(now_ns);
        }
        self.explain_silence(inputs);
        // A reading in the tick of the pause itself may be older than the pause.
        if self.mode != Mode::Fault && inputs.servo.is_some() && pause_ns == 0 {
            self.paused_unanswered_ns = 0;
        }
        self.take_alarms(inputs, now_ns);
        self.check_crawl_limit(inputs.lease, now_ns);
        self.resume_after_pause(now_ns, pause_ns, inputs);
        let reply = inputs
            .command
            .map(|command| self.take_command(&command, now_ns, inputs));
        if inputs.end {
            self.begin_end(now_ns);
        }

        let velocity_rad_s = self.command_velocity(now_ns, dt_s);
        self.watch_idling(velocity_rad_s, now_ns);
        let service = self.due_service(now_ns);
        let finished = inputs.end && self.is_over();
        let servo_rad_s = self.assembler.cam().servo_velocity_rad_s(velocity_rad_s);
        Outputs {
            state: self.fill_state(inputs.now_ns, now_ns, velocity_rad_s),
            goal_counts: self.rounding.round(servo_rad_s / RAD_S_PER_COUNT),
            service,
            notes: self.notes,
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
        self.hold_reason = HoldReason::None;
        self.hold_angle_rad = None;
        self.at_rest_since_ns = None;
        self.resting_since_ns = None;
        self.back_off = None;
    }

    fn enter_hold(&mut self, reason: HoldReason, now_ns: u64) {
        self.enter(Mode::Holding, now_ns);
        self.hold_reason = reason;
    }

    fn enter_fault(&mut self, fault: Fault, alarm: Option<AlarmKind>, now_ns: u64) {
        self.enter(Mode::Fault, now_ns);
        self.fault = fault;
        self.fault_alarm = alarm;
        self.is_silence_unexplained = fault == Fault::LinkLost;
        self.ramp.halt();
        self.request_disarm(now_ns);
    }

    fn request_disarm(&mut self, now_ns: u64) {
        self.disarm_due_ns = Some(now_ns);
        self.disarm_failures = 0;
    }

    fn is_emergency(&self) -> bool {
        self.emergency_stop == Some(true)
    }

    fn heed_emergency_stop(&mut self, now_ns: u64) {
        if !self.is_emergency() {
            return;
        }
        self.resume.cancel();
        self.pending = None;
        if self.has_torque() {
            self.enter_fault(Fault::EmergencyStop, None, now_ns);
        }
    }

    fn check_safety(&mut self, inputs: &Inputs<'_>, now_ns: u64, dt_s: f64) {
        // A servo that could not be prepared need not look like one that was.
        let is_unprepared = inputs.service == Some(ServiceOutcome::Failed(Service::Arm));
        let fault = self.safety.check(&SafetyInputs {
            now_ns,
            dt_s,
            servo: inputs.servo.filter(|_| !is_unprepared),
            assembler: &self.assembler,
            estimator: &self.estimator,
            paused_ns: self.paused_unanswered_ns,
            armed_ns: self.armed_ns,
            crawling_since_ns: (self.mode == Mode::Crawling).then_some(self.mode_since_ns),
        });
        if let Some(fault) = fault {
            if fault == Fault::HostPaused && self.mode == Mode::Crawling && self.back_off.is_none() {
                self.resume.begin(now_ns, self.ramp.target_rad_s());
            }
            self.enter_fault(fault, None, now_ns);
        }
    }

    /// The first answer after a lost link shows whether the servo was silent because it restarted: its watchdog is then off. The
    /// fault keeps its time and gets its real reason.
    fn explain_silence(&mut self, inputs: &Inputs<'_>) {
        let Some(servo) = inputs.servo.filter(|_| self.is_silence_unexplained) else {
            return;
        };
        self.is_silence_unexplained = false;
        if self.fault == Fault::LinkLost && servo.watchdog == 0 {
            self.fault = Fault::ServoRestarted;
            self.notes.add(Note::SilenceWasRestart);
        }
    }

    /// Whether the estimator forbids to crawl.
    fn lacks_estimator(&self, now_ns: u64) -> bool {
        self.require_estimator && !self.estimator.keeps_up(now_ns, self.estimator_timeout_ns)
    }

    /// Prepares the servo again after a pause of the computer, if this is configured and safe.
    fn resume_after_pause(&mut self, now_ns: u64, pause_ns: u64, inputs: &Inputs<'_>) {
        let is_disarmed = self.mode == Mode::Fault && self.disarm_due_ns.is_none() && self.pending.is_none();
        let devices_answer = inputs.servo.is_some_and(|servo| !servo.alert)
            && !self
                .safety
                .persists(Fault::TrackerStale, now_ns, inputs.servo, &self.assembler);
        let may_crawl = self.alarms.blocking() == 0
            && self.crawl_limit.reached(now_ns, inputs.lease).is_none()
            && !self.lacks_estimator(now_ns);
        if inputs.end || inputs.command.is_some() {
            self.resume.cancel();
        } else if self
            .resume
            .is_due(now_ns, pause_ns, is_disarmed && devices_answer && may_crawl)
        {
            self.pending = Some(Service::Arm);
        }
    }

    fn take_service(&mut self, outcome: ServiceOutcome, now_ns: u64) {
        match outcome {
            ServiceOutcome::Done(Service::Arm) => {
                self.fault = Fault::None;
                self.fault_alarm = None;
                self.is_silence_unexplained = false;
                // An attempt to switch torque off that is still due would undo this.
                self.disarm_due_ns = None;
                self.disarm_failures = 0;
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
            // The loop has logged the reason. The servo may have switched torque on, and only its answer was lost.
            ServiceOutcome::Failed(Service::Arm) => {
                self.resume.cancel();
                // The attempt has changed the servo's settings, which no longer show why it was silent.
                self.is_silence_unexplained = false;
                if self.mode != Mode::Fault {
                    self.enter(Mode::Stopping, now_ns);
                    self.armed_ns = now_ns;
                }
                self.request_disarm(now_ns);
            }
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

    /// Ends a crawl whose lease has lapsed, or whose time is over.
    fn check_crawl_limit(&mut self, lease: Lease, now_ns: u64) {
        if self.mode == Mode::Crawling {
            self.crawl_limit.lean_on(lease);
        }
        let Some(reason) = self.crawl_limit.reached(now_ns, lease) else {
            return;
        };
        let is_lapsed = reason == HoldReason::LeaseLapsed;
        if is_lapsed && self.has_torque() {
            // Without a ramp, also where one has begun: nobody watches over the worm.
            self.ramp.halt();
        }
        if self.mode != Mode::Crawling {
            return;
        }
        self.notes
            .add(if is_lapsed { Note::LeaseLapsed } else { Note::TimeLimit });
        if is_lapsed && self.on_lapsed_lease == OnLapsedLease::Stop {
            self.enter(Mode::Stopping, now_ns);
        } else {
            self.enter_hold(reason, now_ns);
        }
    }

    fn begin_end(&mut self, now_ns: u64) {
        match self.mode {
            Mode::Armed | Mode::Crawling | Mode::Holding => self.enter(Mode::Stopping, now_ns),
            Mode::Disarmed | Mode::Stopping | Mode::Fault => {}
        }
        self.pending = None;
    }

    /// Switches torque off after a long time without motion, where it is configured.
    fn watch_idling(&mut self, velocity_rad_s: f64, now_ns: u64) {
        if !matches!(self.mode, Mode::Armed | Mode::Holding) || velocity_rad_s != 0.0 {
            self.idle_since_ns = None;
            return;
        }
        let since_ns = *self.idle_since_ns.get_or_insert(now_ns);
        if self.idle_limit_ns.is_some_and(|limit_ns| now_ns - since_ns >= limit_ns) {
            self.notes.add(Note::Idle);
            self.enter(Mode::Stopping, now_ns);
        }
    }

    /// The service of this tick. Torque goes off before anything else; but when that has failed, an arming, which opens a lost port
    /// and prepares the servo, comes before the next attempt.
    fn due_service(&mut self, now_ns: u64) -> Option<Service> {
        let is_disarm_due = self.disarm_due_ns.is_some_and(|due_ns| now_ns >= due_ns);
        if is_disarm_due && (self.pending.is_none() || self.disarm_failures == 0) {
            // Not again until the outcome of this one is known.
            self.disarm_due_ns = Some(u64::MAX);
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

    fn fill_state(&mut self, time_ns: u64, now_ns: u64, velocity_rad_s: f64) -> State {
        let state = &mut self.assembler.state;
        state.time_ns = time_ns;
        state.host_paused_ns = self.loop_clock.paused_ns();
        state.goal_velocity_rad_s = velocity_rad_s;
        state.mode = self.mode.code();
        state.fault = self.fault.code();
        state.fault_alarm = self.fault_alarm.map_or(u32::MAX, AlarmKind::code);
        state.hold_reason = self.hold_reason.code();
        state.acknowledged_mask = self.alarms.acknowledged();
        state.acknowledged_by = self.alarms.acknowledged_by();
        state.emergency_stop = self.emergency_stop.map_or(u32::MAX, u32::from);
        self.estimator.note_state(state, now_ns);
        let published = *state;
        state.sequence += 1;
        published
    }
}

#[cfg(test)]
mod tests;
