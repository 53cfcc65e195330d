//! Time as the motor had it.
//!
//! A real servo goes on while the computer pauses: it turns and takes energy. A simulated one, whose own computer pauses, does not.
//! Whatever is integrated over the motor's time has to tell the two apart, and the servo's own clock (register 120, in
//! [`State::motor_time_s`]) can. That clock is coarse, and cheap oscillators are off by per cents. So the computer's clock counts,
//! except where the two disagree by more than these errors explain: there the servo's clock counts.

use crate::message::State;

/// How far the two clocks may disagree between two readings, ns: each reading is up to a tick and a millisecond old.
const TOLERANCE_NS: i64 = 2_500_000;
/// … plus this fraction of the time between them: the error of an oscillator without a crystal.
const TOLERANCE_FRACTION: f64 = 0.03;
/// For this long after a gap, a next reading can still show that the one before was late and the motor did not stand still, ns.
const LATE_READING_NS: u64 = 50_000_000;

/// Follows the motor's time from state to state.
#[derive(Debug, Clone, Default)]
pub struct MotorTime {
    last: Option<Reading>,
    standstill_ns: i64,
    suspected: Option<SuspectedStandstill>,
}

#[derive(Debug, Clone, Copy)]
struct Reading {
    time_ns: u64,
    motor_s: f64,
}

/// A gap in which the motor seems to have stood still.
#[derive(Debug, Clone, Copy)]
struct SuspectedStandstill {
    until_ns: u64,
    standstill_ns: i64,
}

impl MotorTime {
    /// Processes a state and returns the motor's time, ns: the computer's time less all standstills.
    pub fn update(&mut self, state: &State) -> u64 {
        if state.motor_is_new == 1 {
            let reading = Reading {
                time_ns: state.time_ns,
                motor_s: state.motor_time_s,
            };
            if let Some(last) = self.last.replace(reading) {
                self.compare(last, reading);
            }
        }
        state.time_ns.saturating_add_signed(self.standstill_ns.saturating_neg())
    }

    /// Forgets both clocks, but not the standstills so far.
    pub fn forget(&mut self) {
        self.last = None;
        self.suspected = None;
    }

    fn compare(&mut self, from: Reading, to: Reading) {
        let elapsed_ns = to.time_ns.saturating_sub(from.time_ns);
        let motor_s = to.motor_s - from.motor_s;
        if !motor_s.is_finite() || motor_s < 0.0 {
            return;
        }
        // A log may hold any numbers.
        let elapsed_as_signed_ns = i64::try_from(elapsed_ns).unwrap_or(i64::MAX);
        let behind_ns = elapsed_as_signed_ns.saturating_sub((motor_s * 1e9).round() as i64);
        let tolerance_ns = TOLERANCE_NS.saturating_add((TOLERANCE_FRACTION * elapsed_ns as f64) as i64);
        if behind_ns > tolerance_ns {
            self.standstill_ns = self.standstill_ns.saturating_add(behind_ns);
            self.suspected = Some(SuspectedStandstill {
                until_ns: to.time_ns.saturating_add(LATE_READING_NS),
                standstill_ns: behind_ns,
            });
        } else if behind_ns < -tolerance_ns
            && let Some(doubt) = self.suspected.take_if(|doubt| to.time_ns <= doubt.until_ns)
        {
            // The motor has caught up: it did not stand still, its reading was late.
            let late_ns = doubt.standstill_ns.min(behind_ns.saturating_neg());
            self.standstill_ns = self.standstill_ns.saturating_sub(late_ns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Motor time in ms after readings at these times of the computer's and the servo's clock, in ms.
    fn motor_time_ms(readings: &[(u64, f64)]) -> u64 {
        let mut motor_time = MotorTime::default();
        let mut now_ns = 0;
        for &(time_ms, motor_ms) in readings {
            now_ns = motor_time.update(&State {
                time_ns: time_ms * 1_000_000,
                motor_time_s: motor_ms * 1e-3,
                motor_is_new: 1,
                ..State::unknown(4)
            });
        }
        (now_ns + 500_000) / 1_000_000
    }

    #[test]
    fn any_numbers_give_a_time() {
        let times_ns = [u64::MAX, 0, u64::MAX - 1, u64::MAX, 1 << 63, u64::MAX];
        for (first, &time_ns) in times_ns.iter().enumerate() {
            let mut motor_time = MotorTime::default();
            for (&next_ns, motor_time_s) in times_ns[first..].iter().zip([0.0, 1e300, 0.0, 1e-300, f64::MAX, 1e18]) {
                let state = State {
                    time_ns: next_ns.max(time_ns),
                    motor_time_s,
                    motor_is_new: 1,
                    ..State::unknown(4)
                };
                motor_time.update(&state);
            }
        }
    }

    #[test]
    fn servo_clock_decides_whether_the_motor_stood_still_in_a_gap() {
        for (what, readings, expected) in [
            (
                "a servo that goes on",
                &[(1000, 10.0), (1001, 11.0), (1301, 311.0)][..],
                1301,
            ),
            (
                "one that stood still",
                &[(1000, 10.0), (1001, 11.0), (1301, 12.0)],
                1002,
            ),
            (
                "an oscillator that is off by 2 %",
                &[(1000, 10.0), (1100, 108.0), (2100, 1088.0)],
                2100,
            ),
            (
                "a reading that came late, and the next in time",
                &[(1000, 10.0), (1008, 11.0), (1009, 19.0)],
                1009,
            ),
            ("a clock that is not known", &[(1000, f64::NAN), (1300, f64::NAN)], 1300),
            ("a clock that went back", &[(1000, 500.0), (1300, 3.0)], 1300),
        ] {
            assert_eq!(motor_time_ms(readings), expected, "{what}");
        }
    }
}
