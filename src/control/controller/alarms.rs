//! What the controller does about alarms.

use super::Controller;
use crate::control::interface::{Inputs, Note};
use crate::control::standing_alarms::bit;
use worm_estimator::config::Policy;
use worm_estimator::message::{AlarmKind, Fault, HoldReason, Mode};

impl Controller {
    /// Reacts to the alarms that were raised, by a message or by the level, and while crawling to every one that stands.
    pub(super) fn take_alarms(&mut self, inputs: &Inputs<'_>, now_ns: u64) {
        let sequence = self.assembler.state.sequence;
        let estimate = inputs
            .estimate
            .filter(|estimate| self.estimator.take(*estimate, sequence, now_ns));
        if !self.require_estimator && self.estimator.silent_ns(now_ns, 0) > self.estimator_timeout_ns {
            self.alarms.forget();
        }
        let raised = self
            .alarms
            .take(inputs.alarms, estimate.map(|estimate| estimate.raised_mask));
        if raised == 0 && self.alarms.blocking() == 0 {
            return;
        }
        for kind in AlarmKind::ALL {
            let is_raised_now = raised & bit(*kind) != 0;
            let stands_in_the_way = self.mode == Mode::Crawling && self.alarms.blocking() & bit(*kind) != 0;
            if is_raised_now || stands_in_the_way {
                self.react(*kind, is_raised_now, now_ns);
            }
        }
    }

    fn react(&mut self, kind: AlarmKind, is_raised_now: bool, now_ns: u64) {
        let is_crawling = self.mode == Mode::Crawling;
        match self.alarms.policy(kind) {
            Policy::Stop if self.has_torque() && self.mode != Mode::Stopping => {
                self.enter_fault(Fault::Alarm, Some(kind), now_ns);
            }
            Policy::Hold if is_crawling => self.hold_by_alarm(kind, now_ns),
            Policy::BackOff if is_crawling => match self.back_off {
                None => {
                    self.begin_back_off(now_ns);
                    self.notes.add(Note::BackedOff(kind));
                }
                // Raised on the way back: going back does not help. Before that it belongs to the same trouble.
                Some(_) if is_raised_now && self.ramp.has_turned() => self.hold_by_alarm(kind, now_ns),
                Some(_) => {}
            },
            _ => {}
        }
    }

    fn hold_by_alarm(&mut self, kind: AlarmKind, now_ns: u64) {
        self.enter_hold(HoldReason::Alarm, now_ns);
        self.notes.add(Note::HeldByAlarm(kind));
    }
}
