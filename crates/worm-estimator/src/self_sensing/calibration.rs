//! Friction of the gears from slow turns: lifted, where the motor drives nothing else, or on the level in the canal, where the torque profile
//! tells the gears from the tips.
//!
//! Dry friction and the part that grows with speed follow from several speeds: friction(ω) = dry + viscous · ω. The friction by the load on
//! the gears is taken as it is known; a lifted worm puts hardly any load on them.
//!
//! Every value scales with the torque constant, which no turn of the cam can tell.
//!
//! A worm that is said to be lifted, and lies in its canal, would give the friction of its tips as that of the gears. Its torque rises in the
//! step of every cell, and what pulls at it helps one way: [`touches`] looks for both.

mod touching;

pub use touching::{Touching, direction_difference, touches};

use super::gear::GearModel;
use super::{MotorSample, SelfSensing, SelfSensingConfig};
use crate::winding::Reported;
use std::f64::consts::TAU;
use worm_physics::Worm;

/// How far the cam turns before a lifted turn counts, cycles: the ramp, and the play of the gears.
const BEGIN_CYCLES: f64 = 0.25;
/// Parts of a turn whose means are compared.
const BLOCKS_PER_TURN: usize = 16;
/// Friction that no turn is surer of, N m: rounding of the current.
const FLOOR_N_M: f64 = 2e-4;
/// Standard deviation of the gears' friction that the fit of a profile begins with here, N m: it is what is sought.
const UNKNOWN_N_M: f64 = 0.03;
/// Standard deviation of the pull on a worm of which somebody says that it is level, N: some three degrees of a worm of a third of a kilogram.
const LEVEL_PULL_N: f64 = 0.2;
/// Cycles below which such a fit says nothing.
const FEWEST_CYCLES: f64 = 3.0;

/// The gears' friction at one velocity, without what the load on them adds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionAt {
    /// Velocity of the cam, rad/s, negative backward.
    pub velocity_rad_per_s: f64,
    /// Friction against it, N m.
    pub friction_n_m: f64,
    /// Its standard error for a torque constant that is right, N m.
    pub sigma_n_m: f64,
}

/// The gears' friction over the velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearFriction {
    /// Dry friction, N m.
    pub dry_n_m: f64,
    /// Its standard error, N m.
    pub dry_sigma_n_m: f64,
    /// Friction that grows with speed, N m s/rad.
    pub viscous_n_m_s_per_rad: f64,
    /// Its standard error, N m s/rad.
    pub viscous_sigma_n_m_s_per_rad: f64,
    /// Standard error of both together at the usual velocity, N m.
    pub sigma_n_m: f64,
}

/// What whole turns at one velocity say of a worm that should be lifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiftedTurns {
    /// The gears' friction, if it is lifted.
    pub friction: FrictionAt,
    /// By how much the torque rises in the step of a cell, in the mean of all steps, N m: by nothing, if it is lifted.
    pub step_rise_n_m: f64,
}

/// Friction in whole turns of a lifted worm at one velocity; none where there is no whole turn. `cells` is its number of cells.
pub fn lifted(samples: &[MotorSample], gear: &GearModel, cells: usize) -> Option<LiftedTurns> {
    let first = samples.first()?;
    let begin = first.phase;
    let mut blocks = Vec::new();
    let mut block = Block::default();
    let mut velocity = Block::default();
    for pair in samples.windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        let turned = (to.phase - from.phase).abs();
        let since = (to.phase - begin).abs() - BEGIN_CYCLES;
        let friction_n_m = friction_n_m(to, gear);
        if since < 0.0 || turned == 0.0 || !friction_n_m.is_finite() {
            continue;
        }
        if (since * BLOCKS_PER_TURN as f64) as usize > blocks.len() {
            blocks.push(std::mem::take(&mut block));
        }
        // How far the cell that moves has come in its step, from its middle, in the direction of the crawl.
        let middle = 0.5 * (to.phase + from.phase) * cells as f64;
        let since_middle = (middle - middle.floor() - 0.5) * (to.phase - from.phase).signum();
        block.add(turned, friction_n_m, since_middle);
        velocity.add(turned, to.velocity_rad_per_s, 0.0);
    }
    // A ripple of the torque averages out over whole turns alone.
    blocks.truncate(blocks.len() / BLOCKS_PER_TURN * BLOCKS_PER_TURN);
    if blocks.is_empty() || blocks.iter().any(|block| block.turned == 0.0) {
        return None;
    }
    let turns: Vec<f64> = blocks
        .chunks(BLOCKS_PER_TURN)
        .map(|turn| mean(turn.iter().map(Block::mean)))
        .collect();
    let friction_n_m = mean(turns.iter().copied());
    let apart = blocks.iter().map(|block| (block.mean() - friction_n_m).powi(2));
    let sigma_n_m = (apart.sum::<f64>() / (blocks.len() * (blocks.len() - 1)) as f64).sqrt();
    Some(LiftedTurns {
        friction: FrictionAt {
            velocity_rad_per_s: velocity.mean(),
            friction_n_m,
            sigma_n_m: sigma_n_m.hypot(FLOOR_N_M),
        },
        step_rise_n_m: Block::rise(&blocks),
    })
}

/// Friction by the torque profile of a worm that crawls forward on the level at one velocity; none before three whole cycles were fitted.
/// `known` says what is known of the worm.
pub fn level(samples: &[MotorSample], worm: &Worm, known: &SelfSensingConfig) -> Option<FrictionAt> {
    let turned = samples.last()?.phase - samples.first()?.phase;
    let took_s = samples.last()?.time_s - samples.first()?.time_s;
    let mut config = *known;
    config.gear.friction_sigma_n_m = UNKNOWN_N_M;
    config.pull_sigma_n = LEVEL_PULL_N;
    config.cycle_s = took_s / turned;
    if !(config.cycle_s.is_finite() && config.cycle_s > 0.0) {
        return None;
    }
    let mut sensing = SelfSensing::new(worm, &config);
    for sample in samples {
        sensing.update(sample);
    }
    sensing.finish();
    let (excess_n_m, sigma_n_m) = sensing
        .gear_excess_n_m()
        .filter(|_| sensing.sensed().is_some_and(|it| it.cycles >= FEWEST_CYCLES))?;
    let velocity_rad_per_s = TAU / config.cycle_s;
    Some(FrictionAt {
        velocity_rad_per_s,
        friction_n_m: known.gear.dry_n_m + known.gear.viscous_n_m_s_per_rad * velocity_rad_per_s + excess_n_m,
        sigma_n_m,
    })
}

/// Dry and viscous friction by what was found at several velocities, and by what is known before: `sigma` are the standard deviations of
/// that, N m and N m s/rad. The error of the torque constant is in the standard errors.
pub fn fit(points: &[FrictionAt], gear: &GearModel, sigma: [f64; 2], usual_rad_per_s: f64) -> GearFriction {
    // Normal equations of two unknowns.
    let mut information = [[sigma[0].powi(-2), 0.0], [0.0, sigma[1].powi(-2)]];
    let mut right = [
        gear.dry_n_m * information[0][0],
        gear.viscous_n_m_s_per_rad * information[1][1],
    ];
    for point in points {
        let row = [1.0, point.velocity_rad_per_s.abs()];
        let weight = point.sigma_n_m.powi(-2);
        for (at, left) in row.iter().enumerate() {
            right[at] += weight * left * point.friction_n_m;
            for (beside, other) in row.iter().enumerate() {
                information[at][beside] += weight * left * other;
            }
        }
    }
    let determinant = information[0][0] * information[1][1] - information[0][1] * information[1][0];
    let covariance = [
        [information[1][1] / determinant, -information[0][1] / determinant],
        [-information[1][0] / determinant, information[0][0] / determinant],
    ];
    let of = |at: usize| covariance[at][0] * right[0] + covariance[at][1] * right[1];
    let [dry_n_m, viscous_n_m_s_per_rad] = [of(0), of(1)].map(|value| value.max(0.0));
    let usual = [1.0, usual_rad_per_s.abs()];
    let variance: f64 = (0..2)
        .flat_map(|at| (0..2).map(move |beside| (at, beside)))
        .map(|(at, beside)| usual[at] * covariance[at][beside] * usual[beside])
        .sum();
    let by_constant = gear.torque_constant_sigma;
    GearFriction {
        dry_n_m,
        dry_sigma_n_m: covariance[0][0].sqrt().hypot(by_constant * dry_n_m),
        viscous_n_m_s_per_rad,
        viscous_sigma_n_m_s_per_rad: covariance[1][1].sqrt().hypot(by_constant * viscous_n_m_s_per_rad),
        sigma_n_m: variance
            .sqrt()
            .hypot(by_constant * (dry_n_m + viscous_n_m_s_per_rad * usual[1])),
    }
}

/// Friction of the gears that drive nothing, without what their own load adds, N m.
fn friction_n_m(sample: &MotorSample, gear: &GearModel) -> f64 {
    let winding_a = gear.winding_current_a(&Reported::from(sample));
    let motor_n_m = gear.torque_constant_n_m_per_a * winding_a * sample.velocity_rad_per_s.signum();
    motor_n_m - gear.load_friction_n_m(motor_n_m, 0.0)
}

/// A stretch of a turn.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    turned: f64,
    sum: f64,
    of_step: [f64; 3], // place in the step, its square, and place × value
}

impl Block {
    fn add(&mut self, turned: f64, value: f64, place: f64) {
        self.turned += turned;
        self.sum += turned * value;
        for (sum, term) in self.of_step.iter_mut().zip([place, place * place, place * value]) {
            *sum += turned * term;
        }
    }

    /// Slope of the straight line through all values over their places in a step: from its beginning to its end.
    fn rise(blocks: &[Self]) -> f64 {
        let total = |of: fn(&Self) -> f64| blocks.iter().map(of).sum::<f64>();
        let turned = total(|block| block.turned);
        let [place, square, product] =
            [0, 1, 2].map(|at| blocks.iter().map(|block| block.of_step[at]).sum::<f64>() / turned);
        (product - place * total(|block| block.sum) / turned) / (square - place * place)
    }

    fn mean(&self) -> f64 {
        self.sum / self.turned
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use super::super::gear::{CurrentSource, Ripple};
    use super::*;

    /// The gears that are known, and those that the readings are of.
    fn gears() -> [GearModel; 2] {
        let known = GearModel {
            dry_n_m: 0.009,
            viscous_n_m_s_per_rad: 0.006,
            load_friction: 0.3,
            load_share: 0.8,
            ..GearModel::plain(0.372, 3.3, 2e-3)
        };
        let mut ripple = [Ripple::default(); super::super::gear::MAX_RIPPLES];
        ripple[0] = Ripple {
            waves: 7.0,
            sine_n_m: 8e-4,
            cosine_n_m: -5e-4,
        };
        let real = GearModel {
            dry_n_m: 0.0125,
            viscous_n_m_s_per_rad: 0.004,
            ripple,
            ..known
        };
        [known, real]
    }

    /// Readings of a lifted worm at a velocity, for so many turns.
    fn turns(real: &GearModel, velocity_rad_per_s: f64, turns: f64) -> Vec<MotorSample> {
        let ticks = (turns * TAU / velocity_rad_per_s.abs() * 1000.0) as u64;
        let sample = |tick: u64| {
            let time_s = tick as f64 * 1e-3;
            let angle_rad = velocity_rad_per_s * time_s;
            let motor_n_m = real.motor_torque_n_m(0.0, velocity_rad_per_s) + real.ripple_n_m(angle_rad);
            MotorSample {
                time_s,
                phase: angle_rad / TAU,
                angle_rad,
                velocity_rad_per_s,
                current_a: (motor_n_m / real.torque_constant_n_m_per_a * 1e3).round() * 1e-3,
                bus_voltage_v: 5.0,
                duty: 0.2,
                temperature_c: 30.0,
                pitch_rad: f64::NAN,
                stamp_ns: tick * 1_000_000,
            }
        };
        (0..ticks).map(sample).collect()
    }

    #[test]
    fn lifted_turns_tell_dry_from_viscous_friction() {
        let [known, real] = gears();
        assert_eq!(known.source, CurrentSource::Winding);
        let points: Vec<FrictionAt> = [0.6, 1.25, 2.5, -0.6, -1.25, -2.5]
            .into_iter()
            .map(|velocity| {
                let turns = lifted(&turns(&real, velocity, 2.3), &known, 4).expect("two whole turns");
                turns.friction
            })
            .collect();
        for point in &points {
            let truth = real.dry_n_m + real.viscous_n_m_s_per_rad * point.velocity_rad_per_s.abs();
            let off = point.friction_n_m - truth;
            assert!(off.abs() < 2e-4, "{off} N m off at {} rad/s", point.velocity_rad_per_s);
        }
        let found = fit(&points, &known, [0.02, 0.01], 2.5);
        let off = [
            (found.dry_n_m - real.dry_n_m) / found.dry_sigma_n_m,
            (found.viscous_n_m_s_per_rad - real.viscous_n_m_s_per_rad) / found.viscous_sigma_n_m_s_per_rad,
        ];
        assert!(off.iter().all(|off| off.abs() < 2.0), "{found:?}");
        assert!(found.dry_sigma_n_m < 5e-4 && found.sigma_n_m < 7e-4, "{found:?}");
    }

    #[test]
    fn a_part_of_a_turn_says_nothing() {
        let [known, real] = gears();
        assert_eq!(lifted(&turns(&real, 2.5, 1.2), &known, 4), None);
        assert_eq!(lifted(&[], &known, 4), None);
        let mut unknown = turns(&real, 2.5, 2.3);
        unknown.iter_mut().for_each(|sample| sample.current_a = f64::NAN);
        assert_eq!(lifted(&unknown, &known, 4), None);
    }

    /// With one velocity the sum is known, and the two keep what was known of them.
    #[test]
    fn one_velocity_tells_their_sum() {
        let [known, _] = gears();
        let point = FrictionAt {
            velocity_rad_per_s: 2.5,
            friction_n_m: 0.03,
            sigma_n_m: 3e-4,
        };
        let found = fit(&[point], &known, [0.02, 0.01], 2.5);
        let sum = found.dry_n_m + 2.5 * found.viscous_n_m_s_per_rad;
        assert!((sum - 0.03).abs() < 1e-5, "{sum}");
        assert!(found.dry_sigma_n_m > 0.01 && found.sigma_n_m < 1e-3, "{found:?}");
    }
}
