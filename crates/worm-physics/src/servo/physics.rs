//! What a servo and its bench are.

use super::laws::ServoLaws;

/// Counts of the position in a turn.
pub const COUNTS_PER_TURN: f64 = 4096.0;
/// One count of the position, rad.
pub const COUNT_RAD: f64 = std::f64::consts::TAU / COUNTS_PER_TURN;
/// One count of the velocity, rad/s: 0.229 rev/min.
pub const SPEED_COUNT_RAD_S: f64 = 0.229 * std::f64::consts::TAU / 60.0;
/// What the product of position gain and error in counts is divided by for a duty of 1: the gain's unit, and the largest PWM value.
pub const FULL_DUTY: f64 = 256.0 * PWM_STEPS;
/// The largest PWM value of an X-series servo.
pub const PWM_STEPS: f64 = 885.0;
/// Acceleration of free fall, m/s².
const GRAVITY: f64 = 9.81;
/// Resistance of copper grows by this fraction per kelvin, from [`RESISTANCE_AT_C`] on.
pub const COPPER_PER_K: f64 = 0.00393;
/// Temperature at which the winding has its stated resistance, °C.
pub const RESISTANCE_AT_C: f64 = 25.0;

/// A motor with its gears, at the output shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoMotor {
    /// Torque per current, N m/A, and back EMF per velocity, V s/rad.
    pub torque_constant: f64,
    /// Resistance of winding and bridge at 25 °C, Ω.
    pub winding_ohm: f64,
    /// Inertia of the rotor behind the gears, kg m².
    pub rotor_inertia_kg_m2: f64,
    /// Dry friction, N m.
    pub dry_n_m: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_n_m_s: f64,
}

impl ServoMotor {
    /// DYNAMIXEL XL330-M288-T by its data sheet and by what its gears suggest. The sheet's stall (0.52 N m at 5 V and 1.47 A) gives winding
    /// and torque constant, with the gears' friction in them; rotor and friction are guesses of the right size.
    pub const XL330_M288_T: Self = Self {
        torque_constant: 0.37,
        winding_ohm: 3.4,
        rotor_inertia_kg_m2: 1.5e-3,
        dry_n_m: 0.02,
        viscous_n_m_s: 5e-3,
    };
}

/// An arm with a mass at its end, in the plane of gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pendulum {
    /// Mass at the end, kg.
    pub mass_kg: f64,
    /// From the shaft to that mass, m.
    pub length_m: f64,
    /// The arm's own mass, spread evenly along it, kg.
    pub arm_mass_kg: f64,
    /// Angle at which the arm really hangs down, rad.
    pub zero_rad: f64,
}

impl Pendulum {
    /// Nothing at all.
    pub const NONE: Self = Self {
        mass_kg: 0.0,
        length_m: 0.0,
        arm_mass_kg: 0.0,
        zero_rad: 0.0,
    };

    /// Inertia about the shaft, kg m².
    pub fn inertia_kg_m2(&self) -> f64 {
        (self.mass_kg + self.arm_mass_kg / 3.0) * self.length_m * self.length_m
    }

    /// Torque that holds the arm level, N m.
    pub fn level_torque_n_m(&self) -> f64 {
        GRAVITY * (self.mass_kg + 0.5 * self.arm_mass_kg) * self.length_m
    }

    /// Energy that the arm has at an angle beyond that of hanging down, J.
    pub fn potential_j(&self, angle_rad: f64) -> f64 {
        self.level_torque_n_m() * (1.0 - (angle_rad - self.zero_rad).cos())
    }

    /// Torque that holds the arm at an angle, N m.
    pub fn torque_n_m(&self, angle_rad: f64) -> f64 {
        self.level_torque_n_m() * (angle_rad - self.zero_rad).sin()
    }
}

/// A servo on its bench, with everything that is assumed of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoPhysics {
    /// Motor and gears.
    pub motor: ServoMotor,
    /// What a plain model leaves out.
    pub laws: ServoLaws,
    /// What it moves.
    pub pendulum: Pendulum,
    /// Voltage of the supply without load, V.
    pub supply_v: f64,
    /// Greatest duty, in (0, 1]: the servo's goal PWM over its largest.
    pub duty_limit: f64,
}

impl ServoPhysics {
    /// A motor on a bench, without effects.
    pub fn new(motor: ServoMotor, pendulum: Pendulum, supply_v: f64) -> Self {
        Self {
            motor,
            laws: ServoLaws::default(),
            pendulum,
            supply_v,
            duty_limit: 1.0,
        }
    }

    /// The duty that the position loop asks for: `gain` in the servo's own unit, position P gain of the control table.
    pub fn duty(&self, gain: f64, goal_rad: f64, angle_rad: f64) -> f64 {
        let duty = (gain * (goal_rad - angle_rad) / COUNT_RAD / FULL_DUTY).clamp(-self.duty_limit, self.duty_limit);
        self.laws.duty(duty)
    }

    /// Current in the winding, A, at a duty, a velocity, and a temperature of the winding.
    pub fn current_a(&self, duty: f64, velocity_rad_s: f64, winding_c: f64) -> f64 {
        let resistance_ohm = self.resistance_ohm(winding_c) + self.laws.supply_ohm * duty * duty;
        (duty * self.supply_v - self.motor.torque_constant * velocity_rad_s) / resistance_ohm
    }

    /// Resistance of winding and bridge, Ω.
    pub(super) fn resistance_ohm(&self, winding_c: f64) -> f64 {
        self.motor.winding_ohm * (1.0 + COPPER_PER_K * (winding_c - RESISTANCE_AT_C))
    }

    /// Friction against the motion, N m, but for the viscous part; see [`ServoLaws::friction_n_m`]. `arm_n_m` holds the arm.
    pub fn friction_n_m(&self, motor_n_m: f64, arm_n_m: f64, velocity_rad_s: f64) -> f64 {
        self.laws
            .friction_n_m(self.motor.dry_n_m, motor_n_m, arm_n_m, velocity_rad_s)
    }
}
