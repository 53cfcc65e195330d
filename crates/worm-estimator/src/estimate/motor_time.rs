//! The time that the motor has lived through.
//!
//! A servo on a bus lives while the computer pauses: it goes on turning and takes energy. A simulated one, whose own computer pauses,
//! does not: for it a pause is no time at all. Whoever integrates over the motor's time must know the difference, and the
//! servo's own clock (register 120, in [`State::motor_time_s`]) tells it. That clock is coarse, and cheap oscillators are off by
//! per cents; so the computer's clock counts as a rule, and the servo's where the two disagree by more than these can explain.

use crate::message::State;

/// How far the two clocks may disagree over one step between readings, ns: each reading is up to a tick and a millisecond old.
const TOLERANCE_NS: i64 = 2_500_000;
/// … and by which share of the step: what an oscillator without a crystal is off by.
const TOLERANCE_FRACTION: f64 = 0.03;
/// How long after a gap it may still turn out that a reading was late rather than the motor standing still, ns.
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

/// A gap that the motor seems to have stood still in.
#[derive(Debug, Clone, Copy)]
struct SuspectedStandstill {
    until_ns: u64,
    standstill_ns: i64,
}

impl MotorTime {
    /// Takes a state; the motor's time at it, ns: the computer's less what the motor stood still.
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
        state.time_ns.saturating_add_signed(-self.standstill_ns)
    }

    /// Nothing is known of the clocks any more; what the motor stood still stays.
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
        let behind_ns = elapsed_ns as i64 - (motor_s * 1e9).round() as i64;
        let tolerance_ns = TOLERANCE_NS + (TOLERANCE_FRACTION * elapsed_ns as f64) as i64;
        if behind_ns > tolerance_ns {
            self.standstill_ns += behind_ns;
            self.suspected = Some(SuspectedStandstill {
                until_ns: to.time_ns + LATE_READING_NS,
                standstill_ns: behind_ns,
            });
        } else if behind_ns < -tolerance_ns
            && let Some(doubt) = self.suspected.take_if(|doubt| to.time_ns <= doubt.until_ns)
        {
            // The motor has made up for it: it had not stood still, its reading was late.
            self.standstill_ns -= doubt.standstill_ns.min(-behind_ns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lived time in ms after readings at these times of the computer's and the servo's clock, in ms.
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
    fn the_servo_s_clock_tells_who_lived_through_a_gap() {
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
