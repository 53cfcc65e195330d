//! The gait phase at which a tracker sample was captured.
//!
//! A sample reaches the estimator with the first tick after its capture, up to a tick late, and the cam has turned on meanwhile. The
//! tracker stamps captures with its own clock. The smallest difference seen so far between the tick's time and that stamp stands for a
//! sample without delay; it is allowed to grow slowly, because clocks drift. What a sample has beyond it is its age. A constant delay
//! cannot be told from an offset of the clocks and remains: 0.3 ms of it are 0.006 mm.
//!
//! One wrong difference must not spoil the ages for minutes. No sample is older than a tick or two; where all samples of a second seem to
//! be, the smallest difference was wrong, and that of this second takes its place.
//!
//! Times here are motor times (`motor_time`): a simulated tracker stands still when its motor does, and its samples do not age.

/// How far two crystal clocks may drift apart.
const DRIFT: f64 = 1e-4;
/// Age from which a clock must have jumped, s.
const JUMP_S: f64 = 0.2;
/// Greatest age that a sample can have, in ticks; after a silence of the motor, in its length.
const MAX_AGE_TICKS: f64 = 2.0;
/// The smallest difference is held against the samples of this long, s.
const REVIEW_S: f64 = 1.0;

/// Compares the two clocks and remembers the last reading of the motor.
#[derive(Debug, Clone, Copy, Default)]
pub struct Capture {
    min_lag_s: Option<(f64, f64)>, // and when
    review: Option<Review>,
    before: Option<(f64, f64)>, // time and phase of the reading before
}

/// The samples of the present second.
#[derive(Debug, Clone, Copy)]
struct Review {
    began_s: f64,
    min_lag_s: f64,
}

impl Capture {
    /// Records a tick at which the motor was read, after [`place`](Self::place) has had its sample, if any. While the motor is silent its phase
    /// stands still in the states, and then jumps: no speed follows from that.
    pub fn note_reading(&mut self, time_s: f64, phase: f64) {
        self.before = Some((time_s, phase));
    }

    /// Forgets both clocks.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Time and phase of a sample that came with the tick at `time_s` and `phase`.
    pub fn place(&mut self, sample_time_s: f64, time_s: f64, phase: f64) -> (f64, f64) {
        let Some((before_s, before)) = self.before.filter(|(before_s, _)| *before_s < time_s) else {
            return (time_s - self.age_s(sample_time_s, time_s, f64::INFINITY), phase);
        };
        let since_s = time_s - before_s;
        let max_age_s = MAX_AGE_TICKS * since_s;
        let age_s = self.age_s(sample_time_s, time_s, max_age_s);
        (
            time_s - age_s,
            phase - (phase - before) / since_s * age_s.min(max_age_s),
        )
    }

    fn age_s(&mut self, sample_time_s: f64, time_s: f64, max_age_s: f64) -> f64 {
        let lag_s = time_s - sample_time_s;
        if !lag_s.is_finite() {
            return 0.0;
        }
        let min_s = match self.min_lag_s {
            Some((min_s, since_s)) => (min_s + DRIFT * (time_s - since_s).max(0.0)).min(lag_s),
            None => lag_s,
        };
        let min_s = if lag_s - min_s > JUMP_S { lag_s } else { min_s };
        let min_s = self.reviewed(min_s, lag_s, time_s, max_age_s);
        self.min_lag_s = Some((min_s, time_s));
        lag_s - min_s
    }

    /// The smallest difference, unless all samples of a second seem too old by it.
    fn reviewed(&mut self, min_s: f64, lag_s: f64, time_s: f64, max_age_s: f64) -> f64 {
        let mut review = self.review.unwrap_or(Review {
            began_s: time_s,
            min_lag_s: lag_s,
        });
        review.min_lag_s = review.min_lag_s.min(lag_s);
        let is_over = !(0.0..REVIEW_S).contains(&(time_s - review.began_s));
        self.review = (!is_over).then_some(review);
        if is_over && review.min_lag_s - min_s > max_age_s {
            review.min_lag_s
        } else {
            min_s
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ages of the samples of a tracker at 120 Hz in a loop at 1 kHz, ms: how far they are from the truth at most, in the second that
    /// ends `after_s` after a tick whose time was wrong by `error_s`.
    fn worst_error_ms(error_s: f64, after_s: f64) -> f64 {
        let mut capture = Capture::default();
        let (mut sample, mut worst_ms) = (0_u32, 0.0_f64);
        let wrong_at = 10_000;
        let end = wrong_at + (after_s * 1e3) as u32;
        for tick in 1..=end {
            let now_s = f64::from(tick) * 1e-3;
            let time_s = now_s + if tick == wrong_at { error_s } else { 0.0 };
            let captured_s = f64::from(sample) / 120.0;
            // The wrong tick brings a sample, whatever the tracker does then.
            if captured_s <= now_s || tick == wrong_at {
                let (then_s, _) = capture.place(captured_s + 450.0, time_s, 0.0);
                if tick > end - 1000 && tick != wrong_at {
                    worst_ms = worst_ms.max(1e3 * (then_s - captured_s).abs());
                }
                sample += 1;
            }
            capture.note_reading(time_s, 0.0);
        }
        worst_ms
    }

    /// At 0.7 cycles a second, a sample 3 ms old comes with the first reading after a silence of the motor.
    #[test]
    fn after_a_silence_the_cam_is_where_it_was_when_the_sample_was_captured() {
        let mut capture = Capture::default();
        let phase = |time_s: f64| 0.7 * time_s;
        for tick in 1..=250 {
            let time_s = 4e-3 * f64::from(tick);
            capture.place(time_s, time_s, phase(time_s));
            capture.note_reading(time_s, phase(time_s));
        }
        let again_s = 1.064;
        let (captured_s, placed) = capture.place(again_s - 3e-3, again_s, phase(again_s));
        assert!((captured_s - (again_s - 3e-3)).abs() < 2e-4, "{captured_s}");
        assert!((placed - phase(captured_s)).abs() < 1e-4, "{placed}");
    }

    #[test]
    fn samples_are_placed_when_they_were_captured() {
        // The tick after the capture, and what the clocks may drift apart until the next sample that is just in time.
        assert!(worst_error_ms(0.0, 1.0) < 0.1, "{}", worst_error_ms(0.0, 1.0));
    }

    #[test]
    fn one_wrong_time_does_not_spoil_the_ages_for_long() {
        for error_s in [-0.003, -0.05, -0.19, 0.05, 0.3] {
            let error_ms = worst_error_ms(error_s, 3.5);
            assert!(error_ms < 0.1, "{error_ms} ms after a time wrong by {error_s} s");
        }
    }
}
