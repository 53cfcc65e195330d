//! Which alarms stand, which of them somebody has seen, and despite which the worm may move.
//!
//! Alarms arrive twice: as messages when they are raised and cleared, and as a level, the mask in every estimate. The messages are
//! faster; the level recovers a lost message. The loop reads the messages first and the estimates after them. So an estimate can be
//! older than a message only if both are read in one tick, and the level of a kind does not count in a tick with a message of that
//! kind. In every later tick the level is the newer of the two.

use worm_estimator::config::{Config, Policy};
use worm_estimator::message::{Alarm, AlarmKind};

/// The bits of all alarms that this version knows.
const KNOWN: u32 = (1 << AlarmKind::ALL.len()) - 1;

/// The alarms, as bits by their codes.
#[derive(Debug, Clone)]
pub(super) struct StandingAlarms {
    policies: [Policy; AlarmKind::ALL.len()],
    /// Those whose policy is more than a warning.
    stopping: u32,
    raised: u32,
    permitted: u32,
    acknowledged: u32,
    acknowledged_by: u32,
}

/// The bit of an alarm.
pub(super) const fn bit(kind: AlarmKind) -> u32 {
    1 << kind.code()
}

/// The alarms that clear by themselves once the worm rests.
fn clearing_at_rest() -> u32 {
    let kinds = AlarmKind::ALL.iter().filter(|kind| kind.clears_at_rest());
    kinds.fold(0, |mask, kind| mask | bit(*kind))
}

impl StandingAlarms {
    /// None stands.
    pub(super) fn new(config: &Config) -> Self {
        let mut policies = [Policy::Warn; AlarmKind::ALL.len()];
        let mut stopping = 0;
        for kind in AlarmKind::ALL {
            let policy = config.alarms.of(*kind).policy;
            policies[kind.code() as usize] = policy;
            if policy != Policy::Warn {
                stopping |= bit(*kind);
            }
        }
        Self {
            policies,
            stopping,
            raised: 0,
            permitted: 0,
            acknowledged: 0,
            acknowledged_by: u32::MAX,
        }
    }

    /// Takes the messages and the level of one tick; returns the alarms that were raised.
    pub(super) fn take(&mut self, messages: &[Alarm], level: Option<u32>) -> u32 {
        let mut fresh = 0;
        let mut changed = 0;
        for alarm in messages {
            // Unknown kinds, of a newer estimator, have no policy.
            let Ok(kind) = AlarmKind::try_from(alarm.kind) else {
                continue;
            };
            changed |= bit(kind);
            self.clear(bit(kind));
            if alarm.raised != 0 {
                self.raised |= bit(kind);
                fresh |= bit(kind);
            }
        }
        if let Some(level) = level {
            let level = (level & KNOWN & !changed) | (self.raised & changed);
            // One that was permitted has not been cleared since.
            fresh |= level & !self.raised & !self.permitted;
            self.clear(!level);
            self.raised = level;
        }
        fresh
    }

    fn clear(&mut self, mask: u32) {
        self.raised &= !mask;
        self.permitted &= !mask;
        self.acknowledged &= !mask;
    }

    /// The estimator is silent and not required: nothing is known of its alarms.
    pub(super) fn forget(&mut self) {
        self.clear(KNOWN);
    }

    pub(super) fn policy(&self, kind: AlarmKind) -> Policy {
        self.policies[kind.code() as usize]
    }

    /// The standing alarms that forbid crawling.
    pub(super) fn blocking(&self) -> u32 {
        self.raised & self.stopping & !self.permitted
    }

    /// The standing alarms despite which the worm may move.
    pub(super) fn permitted(&self) -> u32 {
        self.raised & self.permitted
    }

    /// Permits motion despite the alarms that stand now and do not clear at rest, until each is cleared; returns them.
    pub(super) fn permit(&mut self) -> u32 {
        let mask = self.blocking() & !clearing_at_rest();
        self.permitted |= mask;
        mask
    }

    /// Marks the standing alarms in `mask`, of all with 0, as seen by `user`; returns them.
    pub(super) fn acknowledge(&mut self, mask: u32, user: u32) -> u32 {
        let mask = if mask == 0 { KNOWN } else { mask } & self.raised;
        self.acknowledged |= mask;
        if mask != 0 {
            self.acknowledged_by = user;
        }
        mask
    }

    /// The standing alarms that were acknowledged.
    pub(super) fn acknowledged(&self) -> u32 {
        self.acknowledged
    }

    /// Who acknowledged one of them last; `u32::MAX` where none is.
    pub(super) fn acknowledged_by(&self) -> u32 {
        if self.acknowledged == 0 {
            u32::MAX
        } else {
            self.acknowledged_by
        }
    }
}
