//! Resuming the crawl after a pause of the computer, if the configuration allows it and it is safe.
//!
//! A pause longer than the servo's bus watchdog stops the motor, as it must. Nothing is wrong with the worm then, and deep in a
//! pipe there is no operator to reset it. It resumes from rest, with the usual ramp, when
//! - the pause caused the stop: any other fault needs an operator;
//! - it was crawling, and not backing off after an alarm;
//! - no alarm stands whose policy is more than a warning, except those despite which an operator permitted motion;
//! - what limits the crawl has not ended it: its lease is held, its time is not over, no emergency stop is pressed;
//! - servo, tracker and estimator answer, and the computer has not paused for [`SETTLED_NS`];
//! - that is so within [`WORTH_WAITING_NS`] after the pause: later somebody may be working at the worm;
//! - it has resumed fewer than [`MAX_RESUMES`] times within [`RESUME_WINDOW_NS`]: a computer that pauses more often cannot run a
//!   worm.
//!
//! Any command, and the end of the process, take precedence.

use worm_estimator::config::Config;

/// How long the computer must have run without a pause, ns.
const SETTLED_NS: u64 = 1_000_000_000;
/// How long after the pause it resumes at the latest, ns.
const WORTH_WAITING_NS: u64 = 10_000_000_000;
/// How often it resumes at most …
const MAX_RESUMES: usize = 3;
/// … within this time, ns.
const RESUME_WINDOW_NS: u64 = 60_000_000_000;

/// Whether, when and how fast to resume.
#[derive(Debug, Clone)]
pub(super) struct Resume {
    allowed: bool,
    velocity_rad_s: Option<f64>,
    settled_since_ns: u64,
    is_requested: bool,
    begun_ns: [Option<u64>; MAX_RESUMES], // the newest first
}

impl Resume {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            allowed: config.control.resume_after_pause,
            velocity_rad_s: None,
            settled_since_ns: 0,
            is_requested: false,
            begun_ns: [None; MAX_RESUMES],
        }
    }

    /// A pause has stopped a worm that crawled at `velocity_rad_s`.
    pub(super) fn begin(&mut self, now_ns: u64, velocity_rad_s: f64) {
        let resumes = self
            .begun_ns
            .iter()
            .flatten()
            .filter(|&&begun_ns| now_ns - begun_ns < RESUME_WINDOW_NS)
            .count();
        self.cancel();
        if self.allowed && resumes < MAX_RESUMES {
            self.begun_ns.rotate_right(1);
            self.begun_ns[0] = Some(now_ns);
            self.velocity_rad_s = Some(velocity_rad_s);
            self.settled_since_ns = now_ns;
        }
    }

    /// A command takes precedence, or preparing the servo failed.
    pub(super) fn cancel(&mut self) {
        self.velocity_rad_s = None;
        self.is_requested = false;
    }

    /// Whether to prepare the servo now. `is_ready`: the worm stands without torque, its devices answer and nothing forbids to crawl.
    /// True once.
    pub(super) fn is_due(&mut self, now_ns: u64, pause_ns: u64, is_ready: bool) -> bool {
        if pause_ns > 0 {
            self.settled_since_ns = now_ns;
        }
        if self.begun_ns[0].is_some_and(|begun_ns| now_ns - begun_ns > WORTH_WAITING_NS) && !self.is_requested {
            self.cancel();
        }
        let is_due = self.velocity_rad_s.is_some()
            && !self.is_requested
            && is_ready
            && now_ns - self.settled_since_ns >= SETTLED_NS;
        self.is_requested |= is_due;
        is_due
    }

    /// How fast to crawl now that torque is on, rad/s; none when a command switched it on.
    pub(super) fn take_velocity_rad_s(&mut self) -> Option<f64> {
        let is_requested = std::mem::take(&mut self.is_requested);
        self.velocity_rad_s.take().filter(|_| is_requested)
    }
}
