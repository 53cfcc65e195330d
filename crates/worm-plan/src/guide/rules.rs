//! What changes a trip by itself: the end of the route, energy, the link, alarms and faults, a worm that does not get ahead.

use super::{
    Action, CONTROLLER_TIMEOUT_NS, Guide, LAPSES_NS, MAX_LAPSES, Motion, RETRY_FOR_NS, RETRY_NS, SUSPENDED_NS, Seen,
    Wait, Why,
};
use crate::energy_budget::EnergyBudget;
use crate::itinerary::Heading;
use worm_estimator::config::{OnLinkBack, OnLinkLoss, OnStuck};
use worm_estimator::message::{AlarmKind, HoldReason, Mode, ShortText, State, TripPhase, TripReason};

impl Guide {
    pub(super) fn decide(&mut self, now_ns: u64) {
        self.check_attention(now_ns);
        self.check_controller(now_ns);
        if self.over.is_some() {
            return;
        }
        self.check_link(now_ns);
        if self.wait.is_none() || self.wait == Some(Wait::Link) {
            self.check_energy(now_ns);
        }
        if self.wait.is_none() {
            self.check_ends(now_ns);
        }
    }

    /// Was this suspended while the controller went on?
    fn check_attention(&mut self, now_ns: u64) {
        let (Some((called_ns, loop_ns)), Some(seen)) = (self.called, &self.seen) else {
            return;
        };
        let is_late = now_ns.saturating_sub(called_ns) >= SUSPENDED_NS;
        let controller_ran = seen.loop_ns().saturating_sub(loop_ns) >= SUSPENDED_NS / 2;
        if is_late && controller_ran && self.motion != Motion::Rest {
            self.wait_for(Wait::Operator, TripReason::Suspended, now_ns);
        }
    }

    fn check_controller(&mut self, now_ns: u64) {
        let silent_since_ns = self.seen.as_ref().map_or(self.started_ns, |seen| seen.at_ns);
        if now_ns.saturating_sub(silent_since_ns) >= CONTROLLER_TIMEOUT_NS {
            self.motion = Motion::Rest;
            self.end(TripPhase::Aborted, TripReason::ControllerGone, now_ns);
            return;
        }
        let Some(Seen { state, .. }) = self.seen else { return };
        if state.mode == Mode::Fault.code() {
            self.motion = Motion::Rest;
            self.end(TripPhase::Aborted, TripReason::Fault, now_ns);
            self.why.alarm = AlarmKind::try_from(state.fault_alarm).ok();
            return;
        }
        if let Motion::Crawling { tick, .. } = self.motion
            && state.sequence > tick
        {
            self.check_mode(&state, now_ns);
        }
    }

    /// The worm was told to crawl: does it?
    fn check_mode(&mut self, state: &State, now_ns: u64) {
        match Mode::try_from(state.mode) {
            Ok(Mode::Crawling) => return,
            Ok(Mode::Holding) => {}
            _ => {
                self.motion = Motion::Rest;
                return self.wait_for(Wait::Operator, TripReason::StopCommanded, now_ns);
            }
        }
        self.motion = Motion::Rest;
        match HoldReason::try_from(state.hold_reason) {
            Ok(HoldReason::Alarm) => self.note_alarm(now_ns),
            Ok(HoldReason::LeaseLapsed | HoldReason::TimeLimit) => self.note_lapse(now_ns),
            _ => self.wait_for(Wait::Operator, TripReason::HoldCommanded, now_ns),
        }
    }

    /// The controller holds because of an alarm.
    fn note_alarm(&mut self, now_ns: u64) {
        let raised = self.raised_mask & self.acting_alarms;
        let alarm = AlarmKind::ALL
            .iter()
            .copied()
            .find(|kind| raised >> kind.code() & 1 == 1);
        if self.turns_back_when_stuck() {
            self.go(Heading::Home, TripReason::Alarm, now_ns);
            // An alarm of motion clears after some time at rest, and until then the controller refuses.
            self.wait = Some(retry(now_ns));
        } else {
            self.wait_for(Wait::Operator, TripReason::Alarm, now_ns);
        }
        self.why.alarm = alarm;
    }

    /// The crawl was not renewed in time.
    fn note_lapse(&mut self, now_ns: u64) {
        self.lapses.retain(|at_ns| now_ns.saturating_sub(*at_ns) < LAPSES_NS);
        self.lapses.push_back(now_ns);
        if self.lapses.len() > MAX_LAPSES {
            self.wait_for(Wait::Operator, TripReason::Lapsed, now_ns);
        }
    }

    fn check_link(&mut self, now_ns: u64) {
        let timeout_ns = (self.settings.link_timeout_s * 1e9) as u64;
        let was_lost = self.link_is_lost;
        self.link_is_lost = now_ns.saturating_sub(self.heard_ns) >= timeout_ns;
        if self.link_is_lost && self.heading == Heading::Out {
            match (self.settings.link_loss, self.wait) {
                (OnLinkLoss::Hold, None) => self.wait_for(Wait::Link, TripReason::LinkLost, now_ns),
                (OnLinkLoss::Return, None) => self.go(Heading::Home, TripReason::LinkLost, now_ns),
                _ => {}
            }
        }
        if was_lost && !self.link_is_lost && self.wait == Some(Wait::Link) {
            match self.settings.on_link_back {
                OnLinkBack::GoOn => self.go(self.heading, TripReason::LinkBack, now_ns),
                OnLinkBack::Wait => self.wait_for(Wait::Operator, TripReason::LinkBack, now_ns),
            }
        }
    }

    pub(super) fn is_energy_due(&self, now_ns: u64) -> bool {
        let due = |budget: &EnergyBudget| {
            budget.is_due(
                &self.itinerary,
                &self.correction,
                self.place.m,
                self.return_home,
                now_ns,
            )
        };
        self.budget.as_ref().is_some_and(due)
    }

    fn check_energy(&mut self, now_ns: u64) {
        if self.heading == Heading::Out && self.itinerary.can_go_home() && self.is_energy_due(now_ns) {
            self.go(Heading::Home, TripReason::Energy, now_ns);
        }
    }

    /// The end of the route, and home: within half a cycle, because the next one would go as far beyond.
    fn check_ends(&mut self, now_ns: u64) {
        let half_m = 0.5 * self.advance_m();
        match self.heading {
            Heading::Out if self.place.m >= self.itinerary.length_m() - half_m => {
                if self.return_home {
                    self.go(Heading::Home, TripReason::EndOfRoute, now_ns);
                } else {
                    self.end(TripPhase::Done, TripReason::EndOfRoute, now_ns);
                }
            }
            Heading::Home if self.place.m <= half_m => self.end(TripPhase::Done, TripReason::Home, now_ns),
            _ => {}
        }
    }

    /// Advance of the next cycle, m.
    pub(super) fn advance_m(&self) -> f64 {
        let leg = self.itinerary.leg_at(self.place.m, self.heading);
        let model = self.itinerary.cycle(leg, self.heading);
        model.map_or(0.0, |cost| cost.advance_m) * self.correction.of(self.heading).advance.mean()
    }

    pub(super) fn note_progress(&mut self, fraction: f64, now_ns: u64) {
        let cycles = self.settings.stuck_cycles as usize;
        self.progress.push_back(fraction);
        if self.progress.len() > cycles {
            self.progress.pop_front();
        }
        let mean = self.progress.iter().sum::<f64>() / self.progress.len() as f64;
        if self.progress.len() < cycles || mean >= self.settings.stuck_share {
            return;
        }
        if self.turns_back_when_stuck() {
            self.go(Heading::Home, TripReason::Stuck, now_ns);
        } else {
            self.wait_for(Wait::Operator, TripReason::Stuck, now_ns);
        }
    }

    fn turns_back_when_stuck(&self) -> bool {
        let may_return = self.settings.on_stuck == OnStuck::Return && self.itinerary.can_go_home();
        self.heading == Heading::Out && may_return
    }

    pub(super) fn wanted_cycles_per_s(&self) -> f64 {
        let leg = self.itinerary.leg_at(self.place.m, self.heading);
        self.itinerary.cycles_per_s(leg, self.heading)
    }

    /// The command with which a crawl begins, from any mode.
    pub(super) fn begin_crawl(&mut self, cycles_per_s: f64) -> Option<Action> {
        match Mode::try_from(self.seen?.state.mode) {
            Ok(Mode::Disarmed) => self.may_arm.then_some(Action::Arm),
            Ok(Mode::Armed | Mode::Crawling | Mode::Holding) => Some(Action::Crawl(cycles_per_s)),
            _ => None,
        }
    }

    /// The controller refused to arm or to crawl, or gave no answer.
    pub(super) fn refused(&mut self, now_ns: u64) {
        match &mut self.wait {
            Some(Wait::Retry { next_ns, until_ns }) if now_ns < *until_ns => *next_ns = now_ns + RETRY_NS,
            Some(Wait::Retry { .. }) if self.has_crawled => {
                // The reason for which it waits is the cause.
                self.wait = Some(Wait::Operator);
                self.why.since_ns = now_ns;
            }
            Some(Wait::Retry { .. }) => self.end(TripPhase::Aborted, TripReason::Refused, now_ns),
            _ => {
                self.motion = Motion::Rest;
                self.wait_for(retry(now_ns), TripReason::Refused, now_ns);
            }
        }
    }

    pub(super) fn go(&mut self, heading: Heading, reason: TripReason, now_ns: u64) {
        (self.heading, self.wait) = (heading, None);
        self.progress.clear();
        self.explain(reason, now_ns);
    }

    pub(super) fn wait_for(&mut self, wait: Wait, reason: TripReason, now_ns: u64) {
        self.wait = Some(wait);
        self.progress.clear();
        self.explain(reason, now_ns);
    }

    pub(super) fn end(&mut self, phase: TripPhase, reason: TripReason, now_ns: u64) {
        (self.over, self.wait) = (Some(phase), None);
        self.explain(reason, now_ns);
    }

    fn explain(&mut self, reason: TripReason, now_ns: u64) {
        self.why = Why {
            reason,
            alarm: None,
            by: ShortText::EMPTY,
            since_ns: now_ns,
        };
    }
}

const fn retry(now_ns: u64) -> Wait {
    Wait::Retry {
        next_ns: now_ns + RETRY_NS,
        until_ns: now_ns + RETRY_FOR_NS,
    }
}
