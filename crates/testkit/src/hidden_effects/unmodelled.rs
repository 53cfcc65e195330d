//! Effects that the library does not know, for which the right answer is to say so.
//!
//! Eighteen kinds. Those of the development split and those of the test split are different ones, so that what is learned on the
//! first must hold on strangers of another kind.

use super::MAX_CELLS;
use super::parameters::each_of;
use crate::random::log_uniform;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// An effect that is not in the library.
#[derive(Debug, Clone)]
pub enum UnmodelledEffect {
    /// A corrugated canal pushes each cell to and fro.
    Corrugation {
        period_m: f64,
        force_n: f64,
        angle_rad: f64,
    },
    /// Friction swings slowly with the room's temperature.
    FrictionSwing {
        fraction: f64,
        period_cycles: f64,
        angle_rad: f64,
    },
    /// A weak elastic pull towards a place ahead, which fades further out.
    Anchor { place_m: f64, reach_m: f64, force_n: f64 },
    /// A wave on the cam's profile, of its own height for each cell, as a fraction of the stroke.
    ProfileError { wave_share: [f64; MAX_CELLS] },
    /// A bump in the canal that pushes each cell back as it passes.
    Obstacle { place_m: f64, force_n: f64 },
    /// Friction jumps in the middle of a run and stays.
    FrictionJump { factor: f64 },
    /// The canal swings, out of step with the gait.
    Sway {
        force_n: f64,
        period_s: f64,
        angle_rad: f64,
    },
    /// Something resists each cell by the square of its velocity.
    TurbulentDrag { drag_n_s2_per_m2: f64 },
    /// The friction of one cell comes and goes.
    FadingCell {
        cell: usize,
        fraction: f64,
        period_cycles: f64,
        angle_rad: f64,
    },
    /// Friction is higher at first and settles within a cycle or two.
    WarmingTips { fraction: f64, cycles: f64 },
    /// The canal bends upward: weight grows with the place of each cell.
    BentCanal { n_per_m: f64 },
    /// The strokes of two cells swap lengths every cycle.
    AlternatingStroke { fraction: f64 },
    /// A cable tugs now and then.
    TuggingCable {
        force_n: f64,
        period_s: f64,
        angle_rad: f64,
    },
    /// Friction along the canal rises and falls.
    Washboard {
        fraction: f64,
        period_m: f64,
        angle_rad: f64,
    },
    /// Friction grows with the logarithm of the cell's speed.
    SpeedStrengthening { per_decade: f64 },
    /// The canal narrows: friction grows with the distance travelled by each cell.
    TaperingCanal { per_m: f64 },
    /// Something viscous and elastic trails behind: it pulls back and lets go within a while.
    StickyTrail { n_per_m: f64, relaxes_s: f64 },
    /// The cam's shaft is bent: the stroke of a cell changes smoothly over several cycles.
    WanderingStroke { fraction: f64, period_cycles: f64 },
}

/// Width of an obstacle: twice the standard deviation of its Gaussian, m.
const OBSTACLE_M: f64 = 5e-3;
/// Speed about which friction that grows with speed is stated, m/s.
const USUAL_M_S: f64 = 5e-3;
/// Number of kinds.
pub const KINDS: u64 = 18;
/// The kinds of the development split; all others are those of the test split.
pub const DEVELOPMENT_KINDS: [u64; 9] = [0, 1, 2, 6, 7, 8, 9, 10, 11];
pub const TEST_KINDS: [u64; 9] = [3, 4, 5, 12, 13, 14, 15, 16, 17];

/// When a friction acts.
#[derive(Debug, Clone, Copy)]
pub struct Situation {
    /// Cycles since the run's start.
    pub cycles: f64,
    /// Whether a jump of the friction is due.
    pub jumped: bool,
}

impl UnmodelledEffect {
    /// One of the [`KINDS`], its parameters drawn at random.
    pub fn draw(kind: u64, cells: usize, rng: &mut Xoshiro256PlusPlus) -> Self {
        match kind % KINDS {
            0 => Self::Corrugation {
                period_m: rng.random_range(7e-3..15e-3),
                force_n: rng.random_range(0.2..0.6),
                angle_rad: rng.random_range(0.0..TAU),
            },
            1 => Self::FrictionSwing {
                fraction: 0.1,
                period_cycles: rng.random_range(3.0..6.0),
                angle_rad: rng.random_range(0.0..TAU),
            },
            2 => Self::Anchor {
                place_m: rng.random_range(0.005..0.030),
                reach_m: rng.random_range(0.010..0.025),
                force_n: rng.random_range(0.3..1.0),
            },
            3 => Self::ProfileError {
                wave_share: each_of(cells, |_| {
                    let fraction = rng.random_range(0.01..0.03);
                    if rng.random::<bool>() { fraction } else { -fraction }
                }),
            },
            4 => Self::Obstacle {
                // Where some cell passes on every slope: the first cell starts at 0 and advances by 20 mm at least.
                place_m: rng.random_range(0.003..0.018),
                force_n: rng.random_range(0.5..1.5),
            },
            5 => {
                let fraction = rng.random_range(0.15..0.4);
                let factor = if rng.random::<bool>() {
                    1.0 + fraction
                } else {
                    1.0 - fraction
                };
                Self::FrictionJump { factor }
            }
            6 => Self::Sway {
                force_n: log_uniform(0.1, 0.5, rng),
                period_s: log_uniform(0.8, 8.0, rng),
                angle_rad: rng.random_range(0.0..TAU),
            },
            7 => Self::TurbulentDrag {
                drag_n_s2_per_m2: log_uniform(200.0, 1500.0, rng),
            },
            8 => Self::FadingCell {
                cell: rng.random_range(0..cells),
                fraction: log_uniform(0.2, 0.6, rng),
                period_cycles: rng.random_range(2.4..5.6),
                angle_rad: rng.random_range(0.0..TAU),
            },
            9 => Self::WarmingTips {
                fraction: log_uniform(0.15, 0.5, rng),
                cycles: rng.random_range(0.5..2.0),
            },
            10 => Self::BentCanal {
                n_per_m: log_uniform(1.0, 6.0, rng),
            },
            11 => Self::AlternatingStroke {
                fraction: log_uniform(0.02, 0.08, rng),
            },
            12 => Self::TuggingCable {
                force_n: log_uniform(0.2, 0.8, rng),
                period_s: log_uniform(0.7, 7.0, rng),
                angle_rad: rng.random_range(0.0..TAU),
            },
            13 => Self::Washboard {
                fraction: log_uniform(0.1, 0.4, rng),
                period_m: rng.random_range(4e-3..13e-3),
                angle_rad: rng.random_range(0.0..TAU),
            },
            14 => Self::SpeedStrengthening {
                per_decade: log_uniform(0.05, 0.25, rng),
            },
            15 => Self::TaperingCanal {
                per_m: log_uniform(1.0, 5.0, rng),
            },
            16 => Self::StickyTrail {
                n_per_m: log_uniform(20.0, 120.0, rng),
                relaxes_s: log_uniform(0.3, 3.0, rng),
            },
            _ => Self::WanderingStroke {
                fraction: log_uniform(0.03, 0.1, rng),
                period_cycles: rng.random_range(3.3..7.7),
            },
        }
    }

    /// What it is called in a case's name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Corrugation { .. } => "corrugation",
            Self::FrictionSwing { .. } => "friction-swing",
            Self::Anchor { .. } => "anchor",
            Self::ProfileError { .. } => "profile-error",
            Self::Obstacle { .. } => "obstacle",
            Self::FrictionJump { .. } => "friction-jump",
            Self::Sway { .. } => "sway",
            Self::TurbulentDrag { .. } => "turbulent-drag",
            Self::FadingCell { .. } => "fading-cell",
            Self::WarmingTips { .. } => "warming-tips",
            Self::BentCanal { .. } => "bent-canal",
            Self::AlternatingStroke { .. } => "alternating-stroke",
            Self::TuggingCable { .. } => "tugging-cable",
            Self::Washboard { .. } => "washboard",
            Self::SpeedStrengthening { .. } => "speed-strengthening",
            Self::TaperingCanal { .. } => "tapering-canal",
            Self::StickyTrail { .. } => "sticky-trail",
            Self::WanderingStroke { .. } => "wandering-stroke",
        }
    }

    /// Force on a cell at a place with a velocity, N, backward.
    pub fn on_cell_n(&self, place_m: f64, velocity_m_s: f64) -> f64 {
        match *self {
            Self::Corrugation {
                period_m,
                force_n,
                angle_rad,
            } => force_n * (TAU * place_m / period_m + angle_rad).sin(),
            Self::Obstacle {
                place_m: bump_m,
                force_n,
            } => {
                let away = (place_m - bump_m) / (0.5 * OBSTACLE_M);
                if away.abs() < 5.0 {
                    force_n * (-0.5 * away * away).exp()
                } else {
                    0.0
                }
            }
            Self::TurbulentDrag { drag_n_s2_per_m2 } => drag_n_s2_per_m2 * velocity_m_s * velocity_m_s.abs(),
            Self::BentCanal { n_per_m } => n_per_m * place_m,
            _ => 0.0,
        }
    }

    /// Force on the worm at a displacement since the run's start, N, backward; `followed_m`: where what trails behind is.
    pub fn on_worm_n(&self, displacement_m: f64, followed_m: f64, time_s: f64) -> f64 {
        match *self {
            Self::Anchor {
                place_m,
                reach_m,
                force_n,
            } => {
                let away = (displacement_m - place_m) / reach_m;
                force_n * away * (0.5 * (1.0 - away * away)).exp()
            }
            Self::Sway {
                force_n,
                period_s,
                angle_rad,
            } => force_n * (TAU * time_s / period_s + angle_rad).sin(),
            Self::TuggingCable {
                force_n,
                period_s,
                angle_rad,
            } => force_n * (TAU * time_s / period_s + angle_rad).sin().max(0.0).powi(3),
            Self::StickyTrail { n_per_m, .. } => n_per_m * (displacement_m - followed_m),
            _ => 0.0,
        }
    }

    /// Time in which what trails behind follows, s.
    pub fn follows_s(&self) -> Option<f64> {
        match *self {
            Self::StickyTrail { relaxes_s, .. } => Some(relaxes_s),
            _ => None,
        }
    }

    /// Factor on the friction of a tip at a place whose cell has a velocity.
    pub fn friction_factor(&self, tip: usize, place_m: f64, velocity_m_s: f64, now: Situation) -> f64 {
        let cycles = now.cycles.max(0.0);
        match *self {
            Self::FrictionSwing {
                fraction,
                period_cycles,
                angle_rad,
            } => 1.0 + fraction * (TAU * now.cycles / period_cycles + angle_rad).sin(),
            Self::FrictionJump { factor } if now.jumped => factor,
            Self::FadingCell {
                cell,
                fraction,
                period_cycles,
                angle_rad,
            } if cell == tip => 1.0 + fraction * (TAU * cycles / period_cycles + angle_rad).sin(),
            Self::WarmingTips {
                fraction,
                cycles: scale,
            } => 1.0 + fraction * (-cycles / scale).exp(),
            Self::Washboard {
                fraction,
                period_m,
                angle_rad,
            } => 1.0 + fraction * (TAU * place_m / period_m + angle_rad).sin(),
            Self::SpeedStrengthening { per_decade } => {
                1.0 + per_decade * (0.1 + velocity_m_s.abs() / USUAL_M_S).log10()
            }
            Self::TaperingCanal { per_m } => (1.0 + per_m * place_m).clamp(0.3, 3.0),
            _ => 1.0,
        }
    }

    /// Factor on the stroke of a cell in one cycle, counted from the first.
    pub fn stroke_factor(&self, cell: usize, cycle: f64) -> f64 {
        match *self {
            Self::AlternatingStroke { fraction } => match (cell, cycle.rem_euclid(2.0) < 1.0) {
                (0, true) | (1, false) => 1.0 + fraction,
                (0, false) | (1, true) => 1.0 - fraction,
                _ => 1.0,
            },
            Self::WanderingStroke {
                fraction,
                period_cycles,
            } => 1.0 + fraction * (TAU * cycle / period_cycles + cell as f64).sin(),
            _ => 1.0,
        }
    }

    /// Whether the strokes differ from cycle to cycle.
    pub fn changes_stroke(&self) -> bool {
        matches!(self, Self::AlternatingStroke { .. } | Self::WanderingStroke { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn the_kinds_of_both_splits_are_all_and_apart() {
        let mut kinds = [DEVELOPMENT_KINDS, TEST_KINDS].concat();
        kinds.sort_unstable();
        assert_eq!(kinds, (0..KINDS).collect::<Vec<u64>>());
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut names: Vec<&str> = (0..KINDS)
            .map(|kind| UnmodelledEffect::draw(kind, 4, &mut rng).name())
            .collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), KINDS as usize, "no two kinds share a name");
    }
}
