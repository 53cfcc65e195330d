//! How the static bound of a tip falls to the kinetic one once it slides, and comes back.

use crate::random::log_uniform;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// A tip slower than this rests, m/s.
const REST_M_S: f64 = 0.3e-3;
/// Shares of the Stribeck speed below which the bound is static and above which it is kinetic, to one in a thousand.
const REGIME_LIMITS: [f64; 2] = [1e-3, 7.0];

/// What the bound falls with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weakening {
    /// Stribeck's curve over the tip's speed, which friction feels with a lag.
    Velocity {
        stribeck_m_s: f64,
        /// 1 after Tustin, 2 after Gauss.
        power: i32,
        /// How late friction follows the speed, s.
        lag_s: f64,
    },
    /// The way since the contact broke; a rest heals it.
    Slip {
        drop_m: f64,
        /// Rest after which the static bound holds again, s.
        restored_s: f64,
    },
}

impl Weakening {
    pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
        if rng.random::<bool>() {
            Self::Velocity {
                stribeck_m_s: log_uniform(1e-3, 4e-3, rng),
                power: rng.random_range(1..=2),
                lag_s: log_uniform(4e-3, 12e-3, rng),
            }
        } else {
            Self::Slip {
                drop_m: log_uniform(20e-6, 200e-6, rng),
                restored_s: log_uniform(5e-3, 30e-3, rng),
            }
        }
    }

    /// How much of the static bound's excess is left to a tip that is pulled in a direction.
    pub fn static_excess(&self, friction_state: &FrictionState, sign: f64) -> f64 {
        match *self {
            Self::Velocity {
                stribeck_m_s, power, ..
            } => {
                let speed = friction_state.speed_m_s / stribeck_m_s;
                if speed < REGIME_LIMITS[0] {
                    1.0
                } else if speed > REGIME_LIMITS[1] {
                    0.0
                } else {
                    (-speed.powi(power)).exp()
                }
            }
            Self::Slip { drop_m, .. } => {
                let slid_m = sign * friction_state.slid_m;
                if slid_m > 0.0 { (-slid_m / drop_m).exp() } else { 1.0 }
            }
        }
    }
}

/// What a tip's friction remembers of its motion.
#[derive(Debug, Clone, Default)]
pub struct FrictionState {
    /// Speed as friction feels it, m/s.
    speed_m_s: f64,
    /// Way since the contact broke, m, with the sign of the direction.
    slid_m: f64,
    rested_s: f64,
}

impl FrictionState {
    /// After a time step in which the tip went `displacement_m`, `slipped_m` of it beyond its bristle's bend.
    pub fn update(&mut self, weakening: &Weakening, displacement_m: f64, slipped_m: f64, step_s: f64) {
        match *weakening {
            Weakening::Velocity { lag_s, .. } => {
                self.speed_m_s += (displacement_m.abs() - self.speed_m_s * step_s) / (lag_s + step_s);
            }
            Weakening::Slip { restored_s, .. } => {
                let moves = displacement_m.abs() > REST_M_S * step_s;
                self.rested_s = if moves { 0.0 } else { self.rested_s + step_s };
                if self.rested_s > restored_s || (moves && displacement_m * self.slid_m < 0.0) {
                    self.slid_m = 0.0;
                }
                self.slid_m += slipped_m;
            }
        }
    }
}
