//! At which gait phase a tracker sample was captured.
//!
//! A sample reaches the estimator with the first tick after its capture, up to a tick late, and the cam has turned on. The
//! tracker stamps captures with a clock of its own. Times here are those that the motor lived through (`motor_time`): a simulated tracker
//! stands still when its motor does, and its samples are not old by that. The least difference ever seen between the tick's time and that stamp,
//! let grow slowly because clocks drift, stands for a sample without delay; what a sample has beyond it is its age.
//! A constant delay cannot be told from a difference of the clocks and stays in: 0.3 ms of it are 0.006 mm.

/// How far two crystal clocks may drift apart.
const DRIFT: f64 = 1e-4;
/// Age beyond which the clocks are taken to have jumped, s.
const JUMP_S: f64 = 0.2;

/// The comparison of the two clocks and the tick before.
#[derive(Debug, Clone, Copy, Default)]
pub struct Capture {
    min_lag_s: Option<(f64, f64)>, // and when
    before: Option<(f64, f64)>,    // time and phase of the tick before
}

impl Capture {
    /// Notes a tick whose sample, if any, has been placed.
    pub fn note_tick(&mut self, time_s: f64, phase: f64) {
        self.before = Some((time_s, phase));
    }

    /// Forgets both clocks.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Time and phase of a sample that came with the tick at `time_s` and `phase`.
    pub fn place(&mut self, sample_time_s: f64, time_s: f64, phase: f64) -> (f64, f64) {
        let age_s = self.age_s(sample_time_s, time_s);
        let phase_then = match self.before {
            Some((before_s, before)) if before_s < time_s => {
                phase - (phase - before) / (time_s - before_s) * age_s.min(2.0 * (time_s - before_s))
            }
            _ => phase,
        };
        (time_s - age_s, phase_then)
    }

    fn age_s(&mut self, sample_time_s: f64, time_s: f64) -> f64 {
        let lag_s = time_s - sample_time_s;
        if !lag_s.is_finite() {
            return 0.0;
        }
        let min_s = match self.min_lag_s {
            Some((min_s, since_s)) => (min_s + DRIFT * (time_s - since_s).max(0.0)).min(lag_s),
            None => lag_s,
        };
        let min_s = if lag_s - min_s > JUMP_S { lag_s } else { min_s };
        self.min_lag_s = Some((min_s, time_s));
        lag_s - min_s
    }
}
