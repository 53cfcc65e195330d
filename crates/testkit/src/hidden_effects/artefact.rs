//! What goes wrong with recordings in laboratories, put into recordings that were right.

use crate::random::log_uniform;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_analysis::recording::Recording;

/// Share of campaigns with an artefact.
const SHARE: f64 = 0.25;

/// What is wrong in one run of a campaign, or in all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Artefact {
    /// Two neighbouring markers exchange their labels for a while, or until the end.
    Swap { for_s: f64 },
    /// The camera is knocked: all positions jump and stay.
    Knock { by_m: f64 },
    /// The camera drifts evenly.
    Drift { by_m_per_s: f64 },
    /// One marker is reported where it last was.
    Frozen { for_s: f64 },
    /// One marker jumps away now and then, for a sample or a few.
    Jumps { by_m: f64, times: usize },
    /// The camera's clock runs faster than that of the phase.
    ClockDrift { rate: f64 },
}

impl Artefact {
    /// One in a share of the campaigns.
    pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Option<Self> {
        let spoiled = rng.random::<f64>() < SHARE;
        let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
        let drawn = match rng.random_range(0..7) {
            0 => Self::Swap {
                for_s: rng.random_range(0.1..1.0),
            },
            1 => Self::Swap { for_s: f64::INFINITY },
            2 => Self::Knock {
                by_m: sign * log_uniform(0.5e-3, 5e-3, rng),
            },
            3 => Self::Drift {
                by_m_per_s: sign * log_uniform(2e-6, 30e-6, rng),
            },
            4 => Self::Frozen {
                for_s: rng.random_range(0.3..1.5),
            },
            5 => Self::Jumps {
                by_m: sign * log_uniform(3e-3, 30e-3, rng),
                times: rng.random_range(1..6),
            },
            _ => Self::ClockDrift {
                rate: sign * log_uniform(3e-5, 5e-4, rng),
            },
        };
        spoiled.then_some(drawn)
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Swap { for_s } if for_s.is_infinite() => "permanent-swap",
            Self::Swap { .. } => "swap",
            Self::Knock { .. } => "knock",
            Self::Drift { .. } => "drift",
            Self::Frozen { .. } => "frozen-marker",
            Self::Jumps { .. } => "jumping-marker",
            Self::ClockDrift { .. } => "clock-drift",
        }
    }

    /// Whether it changes recordings with or without the cam's phase: without a second device there is no other clock.
    pub fn shows(self, with_phase: bool) -> bool {
        with_phase || !matches!(self, Self::ClockDrift { .. })
    }

    /// Puts it into one of the recordings, at a place drawn at random; a clock runs wrong in all.
    pub fn spoil(self, recordings: &mut [Recording], rng: &mut Xoshiro256PlusPlus) {
        let run = rng.random_range(0..recordings.len());
        if let Self::ClockDrift { rate } = self {
            for recording in recordings {
                drift_clock(recording, rate);
            }
            return;
        }
        let recording = &mut recordings[run];
        let samples = recording.time_s.len();
        let cells = recording.position_m.len();
        let cell = rng.random_range(0..cells - 1);
        let begin = rng.random_range(samples / 5..samples / 2);
        let end_after = |for_s: f64| {
            let until_s = recording.time_s[begin] + for_s;
            recording.time_s.partition_point(|&time_s| time_s < until_s)
        };
        match self {
            Self::Swap { for_s } => {
                let end = end_after(for_s);
                let (before, after) = recording.position_m.split_at_mut(cell + 1);
                before[cell][begin..end].swap_with_slice(&mut after[0][begin..end]);
            }
            Self::Knock { by_m } => recording
                .position_m
                .iter_mut()
                .flat_map(|series_m| &mut series_m[begin..])
                .for_each(|m| *m += by_m),
            Self::Drift { by_m_per_s } => {
                for series_m in &mut recording.position_m {
                    let timed = series_m.iter_mut().zip(&recording.time_s);
                    timed.for_each(|(m, time_s)| *m += by_m_per_s * time_s);
                }
            }
            Self::Frozen { for_s } => {
                let end = end_after(for_s);
                let held_m = recording.position_m[cell][begin];
                recording.position_m[cell][begin..end].fill(held_m);
            }
            Self::Jumps { by_m, times } => {
                for _ in 0..times {
                    let at = rng.random_range(0..samples - 4);
                    let lasts = rng.random_range(1..4);
                    recording.position_m[cell][at..at + lasts]
                        .iter_mut()
                        .for_each(|m| *m += by_m);
                }
            }
            Self::ClockDrift { .. } => {}
        }
    }
}

fn drift_clock(recording: &mut Recording, rate: f64) {
    let Some(phase) = &mut recording.gait_phase else {
        return;
    };
    // The phase of a moment that the other clock calls a little later.
    let time_s = &recording.time_s;
    let true_phase = phase.clone();
    for (sample, phase) in phase.iter_mut().enumerate() {
        let at_s = time_s[sample] * (1.0 + rate);
        let row = time_s
            .partition_point(|&earlier| earlier <= at_s)
            .clamp(1, time_s.len() - 1)
            - 1;
        let fraction = (at_s - time_s[row]) / (time_s[row + 1] - time_s[row]);
        *phase = true_phase[row] + fraction * (true_phase[row + 1] - true_phase[row]);
    }
}
