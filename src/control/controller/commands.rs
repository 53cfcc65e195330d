//! Commands: what is accepted in which mode, and what is answered.

use super::Controller;
use crate::control::crawl_limit::CrawlLimit;
use crate::control::interface::{Inputs, Note, Service};
use std::f64::consts::TAU;
use worm_estimator::message::{Command, CommandKind, CommandOutcome, HoldReason, Mode, Reply};

/// An answer before it is addressed: the outcome, and the alarms that it concerns.
type Answer = (CommandOutcome, u32);

const ACCEPTED: Answer = (CommandOutcome::Accepted, 0);

impl Controller {
    pub(super) fn take_command(&mut self, command: &Command, now_ns: u64, inputs: &Inputs<'_>) -> Reply {
        let kind = CommandKind::try_from(command.kind);
        let (outcome, alarm_mask) = match kind {
            Err(_) => (CommandOutcome::Unknown, 0),
            Ok(kind) => self.execute(kind, command, now_ns, inputs),
        };
        let is_remark = kind.is_ok_and(CommandKind::is_remark);
        if outcome == CommandOutcome::Accepted && !is_remark {
            // Somebody is there.
            self.idle_since_ns = None;
        }
        Reply {
            sequence: self.assembler.state.sequence,
            verdict: outcome.code(),
            mode: self.mode.code(),
            fault: self.fault.code(),
            alarm_mask,
        }
    }

    fn execute(&mut self, kind: CommandKind, command: &Command, now_ns: u64, inputs: &Inputs<'_>) -> Answer {
        let needs_release = matches!(kind, CommandKind::Arm | CommandKind::Crawl | CommandKind::Reset);
        if needs_release && self.is_emergency() {
            return (CommandOutcome::FaultPersists, 0);
        }
        match (kind, self.mode) {
            (CommandKind::Arm, Mode::Disarmed) => {
                self.pending.get_or_insert(Service::Arm);
                ACCEPTED
            }
            (CommandKind::Arm, Mode::Armed) => ACCEPTED,
            (CommandKind::Crawl, Mode::Armed | Mode::Crawling | Mode::Holding) => {
                self.begin_crawl(command, now_ns, inputs)
            }
            (CommandKind::Renew, Mode::Crawling) => {
                match CrawlLimit::of_command(command.limit_s, self.crawl_limit_s, inputs.lease, now_ns) {
                    Ok(limit) => {
                        self.crawl_limit = limit;
                        ACCEPTED
                    }
                    Err(refusal) => (refusal, 0),
                }
            }
            (CommandKind::Hold, Mode::Armed | Mode::Crawling | Mode::Holding) => {
                if self.mode != Mode::Holding {
                    self.enter_hold(HoldReason::Command, now_ns);
                }
                ACCEPTED
            }
            (CommandKind::Stop, mode) => {
                self.stop(mode, now_ns);
                ACCEPTED
            }
            (CommandKind::Reset, Mode::Fault) => {
                if self.safety.persists(self.fault, now_ns, inputs.servo, &self.assembler) {
                    (CommandOutcome::FaultPersists, 0)
                } else {
                    self.pending.get_or_insert(Service::Arm);
                    ACCEPTED
                }
            }
            (CommandKind::Reset, Mode::Armed | Mode::Holding) => self.permit_motion(command.user),
            (CommandKind::Acknowledge, _) => {
                let mask = self.alarms.acknowledge(command.alarm_mask, command.user);
                if mask != 0 {
                    self.notes.add(Note::Acknowledged {
                        mask,
                        user: command.user,
                    });
                }
                (CommandOutcome::Accepted, mask)
            }
            (CommandKind::Mark, _) => match command.mark() {
                Some((position_m, _)) => {
                    self.notes.add(Note::Marked {
                        position_um: (position_m * 1e6).round() as i64,
                        user: command.user,
                    });
                    ACCEPTED
                }
                None => (CommandOutcome::BadPosition, 0),
            },
            // The record is all that they are for.
            (
                CommandKind::TakeOver
                | CommandKind::NotDriver
                | CommandKind::NotPermitted
                | CommandKind::Stale
                | CommandKind::Busy,
                _,
            ) => ACCEPTED,
            _ => (CommandOutcome::WrongMode, 0),
        }
    }

    /// Stops whatever goes on. Where torque may still be on, it is switched off at once.
    fn stop(&mut self, mode: Mode, now_ns: u64) {
        self.pending = None;
        match mode {
            Mode::Armed | Mode::Crawling | Mode::Holding => self.enter(Mode::Stopping, now_ns),
            Mode::Stopping | Mode::Fault => self.disarm_due_ns = self.disarm_due_ns.map(|due_ns| due_ns.min(now_ns)),
            Mode::Disarmed => {}
        }
    }

    fn begin_crawl(&mut self, command: &Command, now_ns: u64, inputs: &Inputs<'_>) -> Answer {
        let velocity_rad_s = if command.cycles_per_s == 0.0 {
            self.gait_velocity_rad_s
        } else {
            command.cycles_per_s * TAU
        };
        // A speed that is no number is none within the limit.
        let is_within_limit = velocity_rad_s.abs() <= self.velocity_limit_rad_s;
        if !is_within_limit {
            return (CommandOutcome::BadSpeed, 0);
        }
        let limit = match CrawlLimit::of_command(command.limit_s, self.crawl_limit_s, inputs.lease, now_ns) {
            Ok(limit) => limit,
            Err(refusal) => return (refusal, 0),
        };
        if self.lacks_estimator(now_ns) {
            return (CommandOutcome::NoEstimator, 0);
        }
        let blocking = self.alarms.blocking();
        if blocking != 0 {
            return (CommandOutcome::AlarmStands, blocking);
        }
        if self.mode != Mode::Crawling {
            self.enter(Mode::Crawling, now_ns);
        }
        self.back_off = None;
        self.crawl_limit = limit;
        self.ramp.aim(velocity_rad_s);
        ACCEPTED
    }

    /// Permits motion despite the alarms that stand now, for those that do not clear by themselves at rest.
    fn permit_motion(&mut self, user: u32) -> Answer {
        let mask = self.alarms.permit();
        if mask != 0 {
            self.notes.add(Note::Permitted { mask, user });
        }
        match (self.alarms.permitted(), self.alarms.blocking()) {
            (0, 0) => (CommandOutcome::WrongMode, 0),
            (0, blocking) => (CommandOutcome::AlarmStands, blocking),
            (_, blocking) => (CommandOutcome::Accepted, blocking),
        }
    }
}
