//! The motor with its gears: winding, bridge, friction, inertia, the servo's own loops, and heat.
//!
//! All at the output shaft, with forward positive (the cam's frame; the servo's registers may count the other way):
//!
//! - current I = (D·V − k·ω)/R, with duty D in [−1, 1] of the bus voltage V. The winding's inductance is left out: its time
//!   constant is a fraction of a step.
//! - J·dω/dt = k·I − c·ω − sign(ω)·friction + ripple − load. Friction and ripple are those of a servo on a bench
//!   ([`ServoLaws`]): friction may depend on what motor and load put on the gears, and on ω.
//! - In velocity mode D = integral + P·(goal − ω), the integral growing with I·(goal − ω); in position mode D = P·(goal − angle). Both may
//!   act on what was some time ago, and the bridge may do nothing below some duty.
//!
//! Friction and ripple are held over a step, of a quarter of a millisecond. Then everything is linear in ω within it and is **solved
//! exactly**, not stepped: ω relaxes exponentially, and the means of ω and ω² over the step are known in closed form. So electrical
//! energy = copper heat + friction + load work + change of kinetic energy holds to rounding, at any step length and any inertia, and
//! a motor that comes to rest within a step stays at rest until its torque exceeds the friction.

use super::supply::Supply;
use worm_estimator::config::Config;
use worm_physics::effect::SettingError;
use worm_physics::servo::delay::DelayLine;
use worm_physics::servo::physics::{COPPER_PER_K, RESISTANCE_AT_C};
use worm_physics::servo::{ServoLaws, ServoMotor};

/// What the servo's bridge limits the current to, A: the largest that its registers can say (XL330-M288, register 38).
/// The register itself bounds the current in current modes only.
const BRIDGE_LIMIT_A: f64 = 1.75;

/// Heat capacities and resistances of an 18 g servo. The maker gives none; these make a stalled motor reach 70 °C in a
/// minute or two, and a crawling worm end a few kelvin above its surroundings.
mod heat {
    pub(super) const WINDING_J_PER_K: f64 = 2.0;
    pub(super) const WINDING_TO_CASE_K_PER_W: f64 = 8.0;
    pub(super) const CASE_J_PER_K: f64 = 14.0;
    pub(super) const CASE_TO_AIR_K_PER_W: f64 = 22.0;
    /// How fast a case that is heated from outside (a fault) takes the temperature on, s.
    pub(super) const HEATED_S: f64 = 1.0;
}

/// Command of the bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Nothing: the winding is open and the motor free.
    Off,
    /// Hold this duty, −1 to 1.
    Duty(f64),
    /// Turn at this velocity, rad/s.
    Velocity(f64),
    /// Turn to this angle, rad.
    Position(f64),
}

/// Gains of the servo's own loops, and the duty that they may use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Duty per velocity error, s/rad.
    pub velocity_p: f64,
    /// Duty per second and velocity error, 1/rad.
    pub velocity_i: f64,
    /// Duty per angle error, 1/rad.
    pub position_p: f64,
    /// Greatest duty, in [0, 1].
    pub duty_limit: f64,
}

/// What one step cost and where it went, J. `electrical_j` is the sum of the others.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepEnergy {
    /// ∫ V·D·I dt at the bridge; negative when the motor feeds back.
    pub electrical_j: f64,
    /// ∫ I²·R dt.
    pub copper_j: f64,
    /// Into friction, and into the gears' ripple, which gives it back within a wave.
    pub friction_j: f64,
    /// Against the load torque that the step was solved with.
    pub load_j: f64,
    /// Change of the kinetic energy.
    pub kinetic_j: f64,
}

/// The motor's state and constants.
#[derive(Debug, Clone)]
pub struct Motor {
    servo: ServoMotor,
    laws: ServoLaws,
    inertia_kg_m2: f64, // of the rotor behind the gears, and of what the horn carries
    winding_j_per_k: f64,
    winding_to_case_k_per_w: f64,
    friction_scale: f64,
    ambient_c: f64,
    heated_to_c: Option<f64>,
    angle_rad: f64,
    velocity_rad_per_s: f64,
    delayed_angle: DelayLine,
    delayed_velocity: DelayLine,
    integral: f64, // duty, in [-1, 1]
    duty: f64,     // in [-1, 1]
    current_a: f64,
    bus_v: f64,
    winding_c: f64,
    case_c: f64,
}

/// Torque balance J·dω/dt = a − b·ω, and the current i0 − i1·ω that goes with it.
struct Balance {
    a: f64,
    b: f64,
    i0: f64,
    i1: f64,
}

/// Means over a stretch of the exact solution.
struct Means {
    end: f64,
    mean: f64,
    mean_square: f64,
}

impl Motor {
    /// At rest, at angle 0, at the temperature around it.
    ///
    /// # Errors
    /// [`SettingError`] when the configuration was not checked and has no such servo effect.
    pub fn new(config: &Config) -> Result<Self, SettingError> {
        let worm_physics::Motor { servo, laws } = config.motor()?;
        let ambient_c = config.virtual_worm.ambient_c;
        let (winding_j_per_k, winding_to_case_k_per_w) = if laws.heat_k_per_j > 0.0 {
            (1.0 / laws.heat_k_per_j, laws.cooling_s * laws.heat_k_per_j)
        } else {
            (heat::WINDING_J_PER_K, heat::WINDING_TO_CASE_K_PER_W)
        };
        Ok(Self {
            inertia_kg_m2: servo.rotor_inertia_kg_m2,
            servo,
            laws,
            winding_j_per_k,
            winding_to_case_k_per_w,
            friction_scale: 1.0,
            ambient_c,
            heated_to_c: None,
            angle_rad: 0.0,
            velocity_rad_per_s: 0.0,
            delayed_angle: DelayLine::default(),
            delayed_velocity: DelayLine::default(),
            integral: 0.0,
            duty: 0.0,
            current_a: 0.0,
            bus_v: Supply::new(config).open_circuit_v(),
            winding_c: ambient_c,
            case_c: ambient_c,
        })
    }

    /// Puts something on the horn that turns with it.
    pub fn carry(&mut self, inertia_kg_m2: f64) {
        self.inertia_kg_m2 = self.servo.rotor_inertia_kg_m2 + inertia_kg_m2;
    }

    /// Angle of the cam, rad, counting whole turns.
    pub fn angle_rad(&self) -> f64 {
        self.angle_rad
    }

    /// Velocity of the cam, rad/s.
    pub fn velocity_rad_per_s(&self) -> f64 {
        self.velocity_rad_per_s
    }

    /// Duty of the bridge, −1 to 1.
    pub fn duty(&self) -> f64 {
        self.duty
    }

    /// Winding current, A, mean over the last step.
    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Voltage on the bus, V.
    pub fn bus_v(&self) -> f64 {
        self.bus_v
    }

    /// Temperature of the servo's case, as its register reports it, °C.
    pub fn case_c(&self) -> f64 {
        self.case_c
    }

    /// Scales dry and viscous friction inside. What grows with the load stays: scaled, it would soon lock the gears.
    pub fn set_friction_scale(&mut self, scale: f64) {
        self.friction_scale = scale;
    }

    /// Heats the case from outside to this temperature; `None` leaves it to itself.
    pub fn heat_to(&mut self, celsius: Option<f64>) {
        self.heated_to_c = celsius;
    }

    /// Forgets the velocity loop's integral, as switching torque on or changing the operating mode does.
    pub fn reset_loop(&mut self) {
        self.integral = 0.0;
    }

    /// Gives the shaft work that the step's load torque did not account for (negative: takes it). Returns what it could
    /// not take because it would have to reverse.
    pub fn give_kinetic(&mut self, work_j: f64) -> f64 {
        if self.velocity_rad_per_s == 0.0 {
            return work_j;
        }
        let squared = self.velocity_rad_per_s.powi(2) + 2.0 * work_j / self.inertia_kg_m2;
        if squared < 0.0 {
            self.velocity_rad_per_s = 0.0;
            return 0.5 * self.inertia_kg_m2 * squared;
        }
        self.velocity_rad_per_s = squared.sqrt().copysign(self.velocity_rad_per_s);
        0.0
    }

    /// Kinetic energy, J.
    pub fn kinetic_j(&self) -> f64 {
        0.5 * self.inertia_kg_m2 * self.velocity_rad_per_s.powi(2)
    }

    /// One step of `dt_s` against `load_n_m` (positive: resists turning forward).
    pub fn step(&mut self, drive: Drive, gains: &Gains, load_n_m: f64, supply: &mut Supply, dt_s: f64) -> StepEnergy {
        let resistance_ohm = self.servo.winding_ohm * (1.0 + COPPER_PER_K * (self.winding_c - RESISTANCE_AT_C));
        let k = self.servo.torque_constant;
        let start = self.velocity_rad_per_s;
        self.bus_v = supply.bus_v(
            self.duty * self.duty / resistance_ohm,
            self.duty * k * start / resistance_ohm,
            self.bus_v,
        );
        let ripple_n_m = self.laws.ripple_at_n_m(self.angle_rad + 0.5 * dt_s * start);
        let (goal, balance) = self.balance(drive, gains, load_n_m - ripple_n_m, resistance_ohm, dt_s);
        let driving = balance.a - balance.b * start; // without the friction that does not grow with ω
        let motor_n_m = k * (balance.i0 - balance.i1 * start) + ripple_n_m;
        // A motor at rest would go the way it is driven.
        let towards = if start == 0.0 {
            f64::EPSILON.copysign(driving)
        } else {
            start
        };
        let dry_n_m = self.servo.dry_n_m * self.friction_scale;
        let friction_n_m = self.laws.friction_n_m(dry_n_m, motor_n_m, load_n_m, towards);
        let moving_s;
        let means;
        let direction;
        if start == 0.0 && driving.abs() <= friction_n_m {
            (moving_s, direction) = (0.0, 0.0);
            means = Means {
                end: 0.0,
                mean: 0.0,
                mean_square: 0.0,
            };
        } else {
            direction = if start == 0.0 { driving.signum() } else { start.signum() };
            let a = balance.a - direction * friction_n_m;
            let full = relax(start, a, balance.b, self.inertia_kg_m2, dt_s);
            if start != 0.0 && full.end * start < 0.0 {
                moving_s = time_to_rest(start, a, balance.b, self.inertia_kg_m2).min(dt_s);
                means = Means {
                    end: 0.0,
                    ..relax(start, a, balance.b, self.inertia_kg_m2, moving_s)
                };
            } else {
                (moving_s, means) = (dt_s, full);
            }
        }
        let Balance { i0, i1, .. } = balance;
        let angle_rad = means.mean * moving_s;
        let square_integral = means.mean_square * moving_s;
        let current_square = i0 * i0 * dt_s - 2.0 * i0 * i1 * angle_rad + i1 * i1 * square_integral;
        let copper_j = resistance_ohm * current_square;
        let viscous = self.servo.viscous_n_m_s * self.friction_scale;
        let before_j = self.kinetic_j();
        self.velocity_rad_per_s = means.end;
        let energy = StepEnergy {
            electrical_j: copper_j + k * (i0 * angle_rad - i1 * square_integral),
            copper_j,
            friction_j: (direction * friction_n_m - ripple_n_m) * angle_rad + viscous * square_integral,
            load_j: load_n_m * angle_rad,
            kinetic_j: self.kinetic_j() - before_j,
        };
        self.angle_rad += angle_rad;
        self.current_a = i0 - i1 * means.mean * moving_s / dt_s;
        if let Some(goal) = goal {
            let saturated = self.duty.abs() >= gains.duty_limit && (goal - start) * self.duty > 0.0;
            if !saturated {
                let error_angle = goal * dt_s - angle_rad;
                self.integral =
                    (self.integral + gains.velocity_i * error_angle).clamp(-gains.duty_limit, gains.duty_limit);
            }
        }
        self.warm(energy.copper_j, energy.friction_j, dt_s);
        supply.draw(energy.electrical_j, self.bus_v, dt_s);
        energy
    }

    /// The torque balance of this step but for the friction that does not grow with ω, and the velocity goal where there is one. Sets
    /// the duty.
    fn balance(
        &mut self,
        drive: Drive,
        gains: &Gains,
        load_n_m: f64,
        resistance_ohm: f64,
        dt_s: f64,
    ) -> (Option<f64>, Balance) {
        let k = self.servo.torque_constant;
        let viscous = self.servo.viscous_n_m_s * self.friction_scale;
        let now = self.velocity_rad_per_s;
        let delay_s = self.laws.delay_s;
        let middle_rad = self.angle_rad + 0.5 * dt_s * now;
        let seen_rad = self.delayed_angle.pass(middle_rad, delay_s, dt_s);
        let seen_rad_per_s = self.delayed_velocity.pass(now, delay_s, dt_s);
        // D = d0 − d1·ω
        let (velocity_goal, mut d0, mut d1) = match drive {
            Drive::Off => {
                self.duty = 0.0;
                let free = Balance {
                    a: -load_n_m,
                    b: viscous,
                    i0: 0.0,
                    i1: 0.0,
                };
                return (None, free);
            }
            Drive::Duty(duty) => (None, duty, 0.0),
            Drive::Position(goal_rad) => (None, gains.position_p * (goal_rad - seen_rad), 0.0),
            Drive::Velocity(goal) if delay_s > 0.0 => {
                let duty = self.integral + gains.velocity_p * (goal - seen_rad_per_s);
                (Some(goal), duty, 0.0)
            }
            Drive::Velocity(goal) => (Some(goal), self.integral + gains.velocity_p * goal, gains.velocity_p),
        };
        let wanted = d0 - d1 * now;
        if wanted.abs() > gains.duty_limit {
            (d0, d1) = (gains.duty_limit.copysign(wanted), 0.0);
        } else if self.laws.duty(wanted) != wanted {
            (d0, d1) = (0.0, 0.0);
        }
        self.duty = d0 - d1 * now;
        let mut i0 = d0 * self.bus_v / resistance_ohm;
        let mut i1 = (d1 * self.bus_v + k) / resistance_ohm;
        let wanted_a = i0 - i1 * now;
        if wanted_a.abs() > BRIDGE_LIMIT_A {
            (i0, i1) = (BRIDGE_LIMIT_A.copysign(wanted_a), 0.0);
            if self.bus_v > 0.0 {
                self.duty = ((resistance_ohm * i0 + k * now) / self.bus_v).clamp(-1.0, 1.0);
            }
        }
        let balance = Balance {
            a: k * i0 - load_n_m,
            b: k * i1 + viscous,
            i0,
            i1,
        };
        (velocity_goal, balance)
    }

    fn warm(&mut self, copper_j: f64, friction_j: f64, dt_s: f64) {
        let into_case_w = (self.winding_c - self.case_c) / self.winding_to_case_k_per_w;
        let into_air_w = (self.case_c - self.ambient_c) / heat::CASE_TO_AIR_K_PER_W;
        self.winding_c += (copper_j - into_case_w * dt_s) / self.winding_j_per_k;
        self.case_c += (friction_j + (into_case_w - into_air_w) * dt_s) / heat::CASE_J_PER_K;
        if let Some(celsius) = self.heated_to_c {
            self.case_c += (celsius - self.case_c) * dt_s / heat::HEATED_S;
        }
    }
}

/// Solves J·dω/dt = a − b·ω from `start` over `dt_s`: the end, and the means of ω and ω² on the way.
///
/// With x = b·dt/J and the initial acceleration r = (a − b·start)/J, ω(s) = start + r·s·φ(b·s/J), φ(x) = (1 − e⁻ˣ)/x.
fn relax(start: f64, a: f64, b: f64, inertia: f64, dt_s: f64) -> Means {
    let x = b * dt_s / inertia;
    let gained = (a - b * start) / inertia * dt_s; // velocity gained at the initial acceleration
    let (end, mean, square) = if x < 1e-3 {
        (
            1.0 - x / 2.0 + x * x / 6.0,
            0.5 - x / 6.0 + x * x / 24.0,
            1.0 / 3.0 - x / 4.0 + x * x * 7.0 / 60.0,
        )
    } else {
        let e = (-x).exp();
        let phi = (1.0 - e) / x;
        let phi_twice = (1.0 - e * e) / (2.0 * x);
        (phi, (1.0 - phi) / x, (1.0 - 2.0 * phi + phi_twice) / (x * x))
    };
    Means {
        end: start + gained * end,
        mean: start + gained * mean,
        mean_square: start * start + 2.0 * start * gained * mean + gained * gained * square,
    }
}

/// When the solution of [`relax`] passes zero, s; it does when a and `start` have opposite signs.
fn time_to_rest(start: f64, a: f64, b: f64, inertia: f64) -> f64 {
    let ratio = -b * start / a; // in [0, ∞)
    if ratio < 1e-6 {
        -inertia * start / a
    } else {
        inertia / b * ratio.ln_1p()
    }
}

#[cfg(test)]
mod tests;
