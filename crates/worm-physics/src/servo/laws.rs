//! What a plain model of a servo leaves out; neutral by default. The bench, the virtual worm's motor and the energy of a gait cycle all take
//! their friction from here.

use std::f64::consts::TAU;

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
    /// Any other friction over speed and load.
    pub table: Option<Box<FrictionTable>>,
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
            table: None,
        }
    }
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
        if let Some(table) = &self.table {
            friction += table.friction_n_m(velocity_rad_s.abs(), on_gears(0.5));
        }
        if self.back_driving != 1.0 && load_n_m * velocity_rad_s < 0.0 {
            friction *= self.back_driving;
        }
        friction.max(0.0)
    }

    /// The torque that returns with the angle, N m, in the direction of the motor's.
    pub fn ripple_at_n_m(&self, angle_rad: f64) -> f64 {
        if self.ripple_n_m == 0.0 {
            return 0.0;
        }
        let wave = self.ripple_waves * angle_rad / TAU + self.ripple_phase;
        self.ripple_n_m * (TAU * wave).sin()
    }

    /// The duty that the bridge applies when this one is commanded.
    pub fn duty(&self, wanted: f64) -> f64 {
        if wanted.abs() < self.dead_duty { 0.0 } else { wanted }
    }
}

/// Speeds and loads at which a [`FrictionTable`] has its entries: rad/s and N m.
pub const TABLE_SPEEDS_RAD_S: [f64; 5] = [0.0, 0.4, 1.5, 4.0, 10.0];
/// See [`TABLE_SPEEDS_RAD_S`].
pub const TABLE_LOADS_N_M: [f64; 4] = [0.0, 0.15, 0.35, 0.7];
/// Entries of a [`FrictionTable`].
pub const TABLE_ENTRIES: usize = TABLE_SPEEDS_RAD_S.len() * TABLE_LOADS_N_M.len();

/// Friction in addition to every law, N m, over speed and load: bilinear between its entries, constant beyond them.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionTable {
    /// `[speed][load]`, flat, N m.
    pub entries_n_m: [f64; TABLE_ENTRIES],
}

impl FrictionTable {
    /// Friction at a speed and a load, both without sign, N m.
    pub fn friction_n_m(&self, speed_rad_s: f64, load_n_m: f64) -> f64 {
        let (speed, of_speed) = place(&TABLE_SPEEDS_RAD_S, speed_rad_s);
        let (load, of_load) = place(&TABLE_LOADS_N_M, load_n_m);
        let at = |speed: usize, load: usize| self.entries_n_m[speed * TABLE_LOADS_N_M.len() + load];
        let along = |speed: usize| at(speed, load) + of_load * (at(speed, load + 1) - at(speed, load));
        along(speed) + of_speed * (along(speed + 1) - along(speed))
    }
}

/// The node below a value, and how far the value is on the way to the next, 0 to 1.
fn place(nodes: &[f64], value: f64) -> (usize, f64) {
    let above = nodes.partition_point(|node| *node <= value).clamp(1, nodes.len() - 1);
    let (from, to) = (nodes[above - 1], nodes[above]);
    (above - 1, ((value - from) / (to - from)).clamp(0.0, 1.0))
}
