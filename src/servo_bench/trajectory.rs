//! What a servo on a bench is told while it is recorded.

use std::f64::consts::{FRAC_PI_2, PI};
use std::str::FromStr;

/// Duration of every trajectory, s.
pub const DURATION_S: f64 = 6.0;
/// When the torque goes off in [`Trajectory::Lift`], s.
const DROPPED_S: f64 = 2.0;

/// A course of the goal, as the recordings in `examples/xl330-bench` have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trajectory {
    /// Two swings in one.
    SinSin,
    /// Swings that grow faster.
    SinTimeSquare,
    /// A slow rise, and a slower descent.
    Slow,
    /// A lift, after which the torque is off and the arm falls.
    Lift,
}

/// The goal at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Share of the amplitude, −1 to 1.
    pub share: f64,
    /// Whether the torque is on.
    pub torque: bool,
}

impl Trajectory {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::SinSin, Self::SinTimeSquare, Self::Slow, Self::Lift];

    /// Its name in files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SinSin => "sin_sin",
            Self::SinTimeSquare => "sin_time_square",
            Self::Slow => "slow",
            Self::Lift => "lift",
        }
    }

    /// The goal after a time. It begins at 0 and at rest, or nearly.
    pub fn at(self, time_s: f64) -> Goal {
        let smooth = |share: f64| 0.5 - 0.5 * (PI * share.clamp(0.0, 1.0)).cos();
        let share = match self {
            Self::SinSin => 0.75 * (FRAC_PI_2 * time_s * 2.0 / 3.0).sin() + 0.25 * (4.0 * FRAC_PI_2 * time_s).sin(),
            Self::SinTimeSquare => 0.65 * (time_s * time_s).sin(),
            Self::Slow if time_s < 3.0 => smooth(time_s / 3.0),
            Self::Slow => 1.0 - 0.9 * smooth((time_s - 3.0) / 3.0),
            Self::Lift => -smooth(time_s / DROPPED_S),
        };
        Goal {
            share,
            torque: self != Self::Lift || time_s < DROPPED_S,
        }
    }
}

impl FromStr for Trajectory {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|trajectory| trajectory.name() == text);
        found.ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("there is no trajectory '{text}': give one of {names}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No goal leaves the amplitude or jumps, and each is another course.
    #[test]
    fn they_begin_at_rest_and_stay_within_the_amplitude() {
        for trajectory in Trajectory::ALL {
            assert_eq!(trajectory.name().parse(), Ok(trajectory));
            let mut before = trajectory.at(0.0);
            assert!(before.share.abs() < 1e-9 && before.torque);
            for step in 1..=6000 {
                let goal = trajectory.at(f64::from(step) * 1e-3);
                assert!(goal.share.abs() <= 1.0 + 1e-9, "{trajectory:?} {step}");
                assert!((goal.share - before.share).abs() < 0.01, "{trajectory:?} {step}");
                before = goal;
            }
        }
    }
}
