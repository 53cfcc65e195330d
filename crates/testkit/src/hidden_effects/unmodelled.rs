//! Effects that no library names: the right answer to them is to name none.

use super::CELLS;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Something that the library does not know.
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
    /// A weak elastic pull towards a place ahead, which gives way further out.
    Anchor { place_m: f64, reach_m: f64, force_n: f64 },
    /// A wave on the cam's profile, of its own height for each cell, as a share of the stroke.
    ProfileError { wave_share: [f64; CELLS] },
    /// A bump in the canal that pushes each cell back as it passes.
    Obstacle { place_m: f64, force_n: f64 },
    /// Friction jumps in the middle of the second run and stays.
    FrictionJump { factor: f64 },
}

/// Width of an obstacle: twice the standard deviation of its Gaussian, m.
const OBSTACLE_M: f64 = 5e-3;
/// How many kinds there are.
pub const KINDS: u64 = 6;

impl UnmodelledEffect {
    /// One of the [`KINDS`], its figures thrown.
    pub fn draw(kind: u64, rng: &mut Xoshiro256PlusPlus) -> Self {
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
                wave_share: std::array::from_fn(|_| {
                    let fraction = rng.random_range(0.01..0.03);
                    if rng.random::<bool>() { fraction } else { -fraction }
                }),
            },
            4 => Self::Obstacle {
                // Where some cell passes on every slope: the first cell begins at 0 and goes on for 20 mm at least.
                place_m: rng.random_range(0.003..0.018),
                force_n: rng.random_range(0.5..1.5),
            },
            _ => {
                let fraction = rng.random_range(0.15..0.4);
                let factor = if rng.random::<bool>() {
                    1.0 + fraction
                } else {
                    1.0 - fraction
                };
                Self::FrictionJump { factor }
            }
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
        }
    }

    /// Its figures, by name.
    pub fn parameters(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::Corrugation { period_m, force_n, .. } => vec![("period_m", period_m), ("force_n", force_n)],
            Self::FrictionSwing {
                fraction,
                period_cycles,
                ..
            } => vec![("share", fraction), ("period_cycles", period_cycles)],
            Self::Anchor {
                place_m,
                reach_m,
                force_n,
            } => vec![("place_m", place_m), ("reach_m", reach_m), ("force_n", force_n)],
            Self::ProfileError { wave_share } => wave_share.map(|fraction| ("wave_share", fraction)).to_vec(),
            Self::Obstacle { place_m, force_n } => vec![("place_m", place_m), ("force_n", force_n)],
            Self::FrictionJump { factor } => vec![("factor", factor)],
        }
    }

    /// Force on a cell at a place, N, backward.
    pub fn on_cell_n(&self, place_m: f64) -> f64 {
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
            _ => 0.0,
        }
    }

    /// Force on the worm that has gone so far since the run's start, N, backward.
    pub fn on_worm_n(&self, gone_m: f64) -> f64 {
        match *self {
            Self::Anchor {
                place_m,
                reach_m,
                force_n,
            } => {
                let away = (gone_m - place_m) / reach_m;
                force_n * away * (0.5 * (1.0 - away * away)).exp()
            }
            _ => 0.0,
        }
    }

    /// Friction over what it would be, so many cycles after the run's start; `jumped` once a jump is due.
    pub fn friction_factor(&self, cycles: f64, jumped: bool) -> f64 {
        match *self {
            Self::FrictionSwing {
                fraction,
                period_cycles,
                angle_rad,
            } => 1.0 + fraction * (TAU * cycles / period_cycles + angle_rad).sin(),
            Self::FrictionJump { factor } if jumped => factor,
            _ => 1.0,
        }
    }
}
