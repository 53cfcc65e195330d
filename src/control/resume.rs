//! Crawling on by itself after a pause of the computer, where the configuration allows it and it is safe.
//!
//! A pause that is longer than the servo's bus watchdog stops the motor, as it must. Nothing is wrong with the worm then, and a
//! worm deep in a pipe has nobody to reset it. It crawls on from rest, with the usual ramp, when
//! - the pause is what stopped it: any other fault is for a person;
//! - it was crawling, and not on its way back from an alarm;
//! - no alarm stands that would have it do anything but warn;
//! - servo and tracker answer, and the computer has not paused for [`SETTLED_NS`];
//! - it is not the [`MAX_IN_A_ROW`]th time within [`ROW_NS`]: such a computer cannot run a worm.
//!
//! Any command, and the end of the process, come before it.

use worm_estimator::config::{Config, Policy};
use worm_estimator::message::{Alarm, AlarmKind};

/// How long the computer must have gone on without a pause, ns.
const SETTLED_NS: u64 = 1_000_000_000;
/// So often it crawls on by itself …
const MAX_IN_A_ROW: usize = 3;
/// … within this time, ns.
const ROW_NS: u64 = 60_000_000_000;

/// Whether, when and how fast to crawl on.
#[derive(Debug, Clone)]
pub(super) struct Resume {
    allowed: bool,
    only_warns: [bool; AlarmKind::ALL.len()],
    standing: [bool; AlarmKind::ALL.len()],
    velocity_rad_s: Option<f64>,
    settled_since_ns: u64,
    asked: bool,
    begun_ns: [Option<u64>; MAX_IN_A_ROW], // the newest first
}

impl Resume {
    pub(super) fn new(config: &Config) -> Self {
        let mut only_warns = [true; AlarmKind::ALL.len()];
        for kind in AlarmKind::ALL {
            only_warns[kind.code() as usize] = config.alarms.of(*kind).policy == Policy::Warn;
        }
        Self {
            allowed: config.control.resume_after_pause,
            only_warns,
            standing: [false; AlarmKind::ALL.len()],
            velocity_rad_s: None,
            settled_since_ns: 0,
            asked: false,
            begun_ns: [None; MAX_IN_A_ROW],
        }
    }

    /// Keeps which alarms stand.
    pub(super) fn take_alarms(&mut self, changes: &[Alarm]) {
        for alarm in changes {
            if let Some(standing) = self.standing.get_mut(alarm.kind as usize) {
                *standing = alarm.raised != 0;
            }
        }
    }

    /// A pause has stopped a worm that crawled at `velocity_rad_s`.
    pub(super) fn begin(&mut self, now_ns: u64, velocity_rad_s: f64) {
        let in_a_row = self
            .begun_ns
            .iter()
            .flatten()
            .filter(|&&begun_ns| now_ns - begun_ns < ROW_NS)
            .count();
        self.give_up();
        if self.allowed && in_a_row < MAX_IN_A_ROW {
            self.begun_ns.rotate_right(1);
            self.begun_ns[0] = Some(now_ns);
            self.velocity_rad_s = Some(velocity_rad_s);
            self.settled_since_ns = now_ns;
        }
    }

    /// Somebody else decides now, or it did not succeed.
    pub(super) fn give_up(&mut self) {
        self.velocity_rad_s = None;
        self.asked = false;
    }

    /// Whether to prepare the servo now, `is_ready` when the worm stands without torque and its devices answer. True once.
    pub(super) fn is_due(&mut self, now_ns: u64, pause_ns: u64, is_ready: bool) -> bool {
        if pause_ns > 0 {
            self.settled_since_ns = now_ns;
        }
        let is_safe = self
            .standing
            .iter()
            .zip(self.only_warns)
            .all(|(stands, only_warns)| !stands || only_warns);
        let is_due = self.velocity_rad_s.is_some()
            && !self.asked
            && is_ready
            && is_safe
            && now_ns - self.settled_since_ns >= SETTLED_NS;
        self.asked |= is_due;
        is_due
    }

    /// How fast to crawl now that torque is on, rad/s; nothing where a person had it switched on.
    pub(super) fn take_velocity_rad_s(&mut self) -> Option<f64> {
        let asked = std::mem::take(&mut self.asked);
        self.velocity_rad_s.take().filter(|_| asked)
    }
}
