//! What a plain model of a servo leaves out; neutral by default. The bench, the virtual worm's motor and the energy of a gait cycle all take
//! their friction from here.

use crate::table::{ActsOn, Axis, Table};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Parts of a turn at which a torque over the angle is taken for its mean.
const PARTS_OF_TURN: u32 = 720;

/// Laws beyond dry and viscous friction, a winding and a stiff supply.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoLaws {
    /// Friction at rest beyond that of motion, N m, and the velocity at which it has fallen to 1/e, rad/s.
    pub stribeck_n_m: f64,
    /// See [`stribeck_n_m`](Self::stribeck_n_m).
    pub stribeck_rad_s: f64,
    /// Friction per torque on the gears, and which end of the gear train that is: 1 the motor's, 0 the arm's.
    pub load_friction: f64,
    /// See [`load_friction`](Self::load_friction).
    pub load_share: f64,
    /// Friction per square of the torque on the gears, 1/(N m), and which end of the gear train that is.
    pub load_squared_per_n_m: f64,
    /// See [`load_squared_per_n_m`](Self::load_squared_per_n_m).
    pub load_squared_share: f64,
    /// Friction that stays where the load drives the motor, over that where the motor drives the load.
    pub back_driving: f64,
    /// Play between gears and arm, rad.
    pub play_rad: f64,
    /// Amplitude of a torque that returns with the angle, N m; how often in a turn; and where it begins, turns of its own wave.
    pub ripple_n_m: f64,
    /// See [`ripple_n_m`](Self::ripple_n_m).
    pub ripple_waves: f64,
    /// See [`ripple_n_m`](Self::ripple_n_m).
    pub ripple_phase: f64,
    /// Resistance between the supply and the servo, Ω.
    pub supply_ohm: f64,
    /// How much the winding heats up per joule of copper heat, K/J, and how fast it cools down to the case, s.
    pub heat_k_per_j: f64,
    /// See [`heat_k_per_j`](Self::heat_k_per_j).
    pub cooling_s: f64,
    /// Age of the position that the loop acts on, s.
    pub delay_s: f64,
    /// Duty below which the bridge does nothing.
    pub dead_duty: f64,
    /// Laws that nobody derived, of the motor: friction over its speed and loads, and a torque over its angle.
    pub tables: Vec<Arc<Table>>,
}

impl Default for ServoLaws {
    fn default() -> Self {
        Self {
            stribeck_n_m: 0.0,
            stribeck_rad_s: 1.0,
            load_friction: 0.0,
            load_share: 0.5,
            load_squared_per_n_m: 0.0,
            load_squared_share: 0.5,
            back_driving: 1.0,
            play_rad: 0.0,
            ripple_n_m: 0.0,
            ripple_waves: 1.0,
            ripple_phase: 0.0,
            supply_ohm: 0.0,
            heat_k_per_j: 0.0,
            cooling_s: 10.0,
            delay_s: 0.0,
            dead_duty: 0.0,
            tables: Vec::new(),
        }
    }
}

/// A torque that returns with the angle, over a whole turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ripple {
    /// Its mean, N m, in the direction of the motor's.
    pub mean_n_m: f64,
    /// Its mean square, N² m².
    pub mean_square_n2_m2: f64,
    /// How far it is from its mean at most, N m.
    pub largest_n_m: f64,
}

impl ServoLaws {
    /// Friction against the motion, N m, but for the viscous part: the torque on the gears presses their teeth together. At rest it is the
    /// most that friction can hold. `dry_n_m` is the friction without load, `motor_n_m` what the motor gives, `load_n_m` what holds the
    /// output, positive against positive angles.
    pub fn friction_n_m(&self, dry_n_m: f64, motor_n_m: f64, load_n_m: f64, velocity_rad_s: f64) -> f64 {
        let on_gears = |share: f64| (share * motor_n_m + (1.0 - share) * load_n_m).abs();
        let mut friction = dry_n_m;
        if self.load_friction != 0.0 {
            friction += self.load_friction * on_gears(self.load_share);
        }
        if self.load_squared_per_n_m != 0.0 {
            friction += self.load_squared_per_n_m * on_gears(self.load_squared_share).powi(2);
        }
        if self.stribeck_n_m != 0.0 {
            friction += self.stribeck_n_m * (-(velocity_rad_s / self.stribeck_rad_s).powi(2)).exp();
        }
        for table in self.tables_of(ActsOn::MotorFriction) {
            friction += table
                .at(|axis| match axis {
                    Axis::MotorSpeed => velocity_rad_s.abs(),
                    Axis::GearLoad => on_gears(0.5),
                    _ => load_n_m * velocity_rad_s.signum(), // the load on the output
                })
                .0;
        }
        if self.back_driving != 1.0 && load_n_m * velocity_rad_s < 0.0 {
            friction *= self.back_driving;
        }
        friction.max(0.0)
    }

    /// The torque that returns with the angle, N m, in the direction of the motor's.
    pub fn ripple_at_n_m(&self, angle_rad: f64) -> f64 {
        let of_tables = self
            .tables_of(ActsOn::MotorTorque)
            .map(|table| table.at(|_| angle_rad).0);
        let other_n_m: f64 = of_tables.sum();
        if self.ripple_n_m == 0.0 {
            return other_n_m;
        }
        let wave = self.ripple_waves * angle_rad / TAU + self.ripple_phase;
        other_n_m + self.ripple_n_m * (TAU * wave).sin()
    }

    /// That torque over a whole turn.
    pub fn ripple_of_a_turn(&self) -> Ripple {
        if self.tables_of(ActsOn::MotorTorque).next().is_none() {
            return Ripple {
                mean_n_m: 0.0,
                mean_square_n2_m2: 0.5 * self.ripple_n_m * self.ripple_n_m,
                largest_n_m: self.ripple_n_m.abs(),
            };
        }
        let count = f64::from(PARTS_OF_TURN);
        let all = || (0..PARTS_OF_TURN).map(|part| self.ripple_at_n_m(TAU * f64::from(part) / count));
        let mean_n_m = all().sum::<f64>() / count;
        Ripple {
            mean_n_m,
            mean_square_n2_m2: all().map(|n_m| n_m * n_m).sum::<f64>() / count,
            largest_n_m: all().map(|n_m| (n_m - mean_n_m).abs()).fold(0.0, f64::max),
        }
    }

    fn tables_of(&self, acts_on: ActsOn) -> impl Iterator<Item = &Table> {
        let all = self.tables.iter().map(|table| &**table);
        all.filter(move |table| table.acts_on() == acts_on)
    }

    /// The duty that the bridge applies when this one is commanded.
    pub fn duty(&self, wanted: f64) -> f64 {
        if wanted.abs() < self.dead_duty { 0.0 } else { wanted }
    }
}
