//! The motion of a servo and its arm under a goal, step by step.
//!
//! A step takes what depends on the angle at its middle, and what is linear in the velocity (back EMF, viscous friction) as the mean of its
//! ends. Then friction takes away as much velocity as it can, down to rest and never beyond. So an arm that sticks rests exactly, and starts when the other torques exceed
//! the friction. Where there is play, rotor and arm are two bodies while the play is open, and lose the energy of their impact when
//! it closes.

use super::delay::DelayLine;
use super::physics::ServoPhysics;

/// The longest step that [`ServoMotion::advance`] takes, s. Against steps of a hundredth of it, positions of an arm that swings fast differ by
/// less than a count (1.5 mrad) on average.
pub const LONGEST_STEP_S: f64 = 1e-3;

/// What the servo is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Position P gain, in the unit of the control table.
    pub gain: f64,
    /// Goal position, rad.
    pub goal_rad: f64,
    /// Whether the torque is on; off, the winding is open.
    pub torque_enabled: bool,
}

/// Energy since the start, J.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Taken from the supply; what the motor feeds back is taken off.
    pub electrical_j: f64,
    /// Heat of the winding.
    pub copper_j: f64,
}

/// The state of a servo and its arm.
#[derive(Debug, Clone)]
pub struct ServoMotion {
    angle_rad: f64,
    velocity_rad_s: f64,
    /// How far the rotor is ahead of the arm within the play, rad, and its velocity. The difference itself is kept: that of two angles
    /// would be rounded, and gears that touch would not always be seen to.
    ahead_rad: f64,
    rotor_rad_s: f64,
    winding_c: f64,
    case_c: f64,
    duty: f64,
    energy: Energy,
    /// Positions on their way to the loop.
    delayed: DelayLine,
}

/// Everything in a step that friction acts against.
struct Torques {
    /// Of the motor, N m: at rest, and how much less at each rad/s.
    motor: (f64, f64),
    /// That holds the arm, N m.
    arm_n_m: f64,
}

impl ServoMotion {
    /// At an angle and a velocity, the servo as warm as `case_c`, °C.
    pub fn new(angle_rad: f64, velocity_rad_s: f64, case_c: f64) -> Self {
        Self {
            angle_rad,
            velocity_rad_s,
            ahead_rad: 0.0,
            rotor_rad_s: velocity_rad_s,
            winding_c: case_c,
            case_c,
            duty: 0.0,
            energy: Energy::default(),
            delayed: DelayLine::default(),
        }
    }

    /// Angle of the arm, rad.
    pub fn angle_rad(&self) -> f64 {
        self.angle_rad
    }

    /// Velocity of the arm, rad/s.
    pub fn velocity_rad_s(&self) -> f64 {
        self.velocity_rad_s
    }

    /// Duty of the last step, −1 to 1.
    pub fn duty(&self) -> f64 {
        self.duty
    }

    /// Current in the winding at the end of the last step, A; 0 with the torque off.
    pub fn current_a(&self, physics: &ServoPhysics, command: &Command) -> f64 {
        if command.torque_enabled {
            physics.current_a(self.duty, self.rotor_rad_s, self.winding_c)
        } else {
            0.0
        }
    }

    /// Energy since the start.
    pub fn energy(&self) -> Energy {
        self.energy
    }

    /// Moves on by a time under a command, in equal steps of at most `longest_s`.
    pub fn advance(&mut self, physics: &ServoPhysics, command: &Command, time_s: f64, longest_s: f64) {
        // A little more than the longest step is no reason for two.
        let steps = (time_s / longest_s - 1e-9).ceil().max(1.0);
        let dt_s = time_s / steps;
        for _ in 0..steps as usize {
            self.step(physics, command, dt_s);
        }
    }

    fn step(&mut self, physics: &ServoPhysics, command: &Command, dt_s: f64) {
        let (motor, laws) = (&physics.motor, &physics.laws);
        let k = motor.torque_constant;
        // At the middle of the step, where the arm will be.
        let middle_rad = self.angle_rad + 0.5 * dt_s * self.velocity_rad_s;
        let acts_on_rad = self.delayed.pass(middle_rad, laws.delay_s, dt_s);
        self.duty = if command.torque_enabled {
            physics.duty(command.gain, command.goal_rad, acts_on_rad)
        } else {
            0.0
        };
        let resistance_ohm = physics.resistance_ohm(self.winding_c) + laws.supply_ohm * self.duty * self.duty;
        let torque_of_motor = if command.torque_enabled {
            (
                k * self.duty * physics.supply_v / resistance_ohm,
                k * k / resistance_ohm,
            )
        } else {
            (0.0, 0.0)
        };
        let mut torques = Torques {
            motor: torque_of_motor,
            arm_n_m: physics.pendulum.torque_n_m(middle_rad),
        };
        torques.motor.0 += laws.ripple_at_n_m(middle_rad);
        if laws.play_rad > 0.0 {
            self.move_with_play(physics, &torques, dt_s);
        } else {
            let inertia = motor.rotor_inertia_kg_m2 + physics.pendulum.inertia_kg_m2();
            let before = self.velocity_rad_s;
            self.velocity_rad_s = turned(physics, &torques, torques.arm_n_m, before, inertia, dt_s);
            self.angle_rad += 0.5 * dt_s * (before + self.velocity_rad_s);
            self.rotor_rad_s = self.velocity_rad_s;
        }
        if command.torque_enabled {
            let current_a = physics.current_a(self.duty, self.rotor_rad_s, self.winding_c);
            let copper_j = physics.resistance_ohm(self.winding_c) * current_a * current_a * dt_s;
            self.energy.copper_j += copper_j;
            self.energy.electrical_j += self.duty * current_a * physics.supply_v * dt_s;
            self.winding_c += laws.heat_k_per_j * copper_j;
        }
        if laws.heat_k_per_j > 0.0 {
            self.winding_c -= (self.winding_c - self.case_c) * (dt_s / laws.cooling_s).min(1.0);
        }
    }

    /// Rotor and arm with play between them.
    fn move_with_play(&mut self, physics: &ServoPhysics, torques: &Torques, dt_s: f64) {
        let rotor_kg_m2 = physics.motor.rotor_inertia_kg_m2;
        let arm_kg_m2 = physics.pendulum.inertia_kg_m2();
        let half = 0.5 * physics.laws.play_rad;
        let (arm_before, rotor_before) = (self.velocity_rad_s, self.rotor_rad_s);
        let side = if self.ahead_rad >= half {
            1.0
        } else if self.ahead_rad <= -half {
            -1.0
        } else {
            0.0
        };
        if side != 0.0 && (rotor_before - arm_before) * side >= 0.0 {
            let whole = rotor_kg_m2 + arm_kg_m2;
            let together = (rotor_kg_m2 * rotor_before + arm_kg_m2 * arm_before) / whole;
            let end = turned(physics, torques, torques.arm_n_m, together, whole, dt_s);
            // What the gears must put on the arm; they can only push.
            let pushed_n_m = arm_kg_m2 * (end - together) / dt_s + torques.arm_n_m;
            if pushed_n_m * side >= 0.0 {
                (self.velocity_rad_s, self.rotor_rad_s) = (end, end);
                self.angle_rad += 0.5 * dt_s * (together + end);
                self.ahead_rad = side * half;
                return;
            }
            (self.velocity_rad_s, self.rotor_rad_s) = (together, together);
        }
        let (arm_before, rotor_before) = (self.velocity_rad_s, self.rotor_rad_s);
        self.velocity_rad_s -= dt_s * torques.arm_n_m / arm_kg_m2;
        self.rotor_rad_s = turned(physics, torques, 0.0, rotor_before, rotor_kg_m2, dt_s);
        let arm_moves_rad = 0.5 * dt_s * (arm_before + self.velocity_rad_s);
        let rotor_moves_rad = 0.5 * dt_s * (rotor_before + self.rotor_rad_s);
        self.angle_rad += arm_moves_rad;
        self.ahead_rad = (self.ahead_rad + rotor_moves_rad - arm_moves_rad).clamp(-half, half);
    }
}

/// The velocity at the end of a step of what turns with the rotor against `load_n_m`.
fn turned(
    physics: &ServoPhysics,
    torques: &Torques,
    load_n_m: f64,
    before_rad_s: f64,
    inertia_kg_m2: f64,
    dt_s: f64,
) -> f64 {
    let (at_rest, per_rad_s) = torques.motor;
    let damping = 0.5 * dt_s * (per_rad_s + physics.motor.viscous_n_m_s);
    let damped = inertia_kg_m2 + damping;
    let free = ((inertia_kg_m2 - damping) * before_rad_s + dt_s * (at_rest - load_n_m)) / damped;
    let friction_n_m = physics.friction_n_m(at_rest - per_rad_s * free, load_n_m, free);
    let most = friction_n_m * dt_s / damped;
    if free.abs() <= most {
        0.0
    } else {
        free - most.copysign(free)
    }
}
