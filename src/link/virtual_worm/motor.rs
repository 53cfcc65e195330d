//! The motor with its gears: winding, bridge, friction, inertia, the servo's own velocity loop, and heat.
//!
//! All at the output shaft, with forward positive (the cam's frame; the servo's registers may count the other way):
//!
//! - current I = (D·V − k·ω)/R, with duty D in [−1, 1] of the bus voltage V. The winding's inductance is left out: its time
//!   constant is a fraction of a step.
//! - J·dω/dt = k·I − c·ω − sign(ω)·(dry friction) − load.
//! - D = integral + P·(goal − ω) in velocity mode, the integral growing with I·(goal − ω).
//!
//! Within a step this is linear in ω and is **solved exactly**, not stepped: ω relaxes exponentially, and the means of ω
//! and ω² over the step are known in closed form. So electrical energy = copper heat + friction + load work + change of
//! kinetic energy holds to rounding, at any step length and any inertia, and a motor that comes to rest within a step
//! stays at rest until its torque exceeds the dry friction.

use super::supply::Supply;
use worm_estimator::config::Config;

/// What the servo's bridge limits the current to, A: the largest that its registers can say (XL330-M288, register 38).
/// The register itself bounds the current in current modes only.
const BRIDGE_LIMIT_A: f64 = 1.75;

/// Resistance of copper grows by this share per kelvin.
const COPPER_PER_K: f64 = 0.00393;

/// Temperature at which the configured resistance holds, °C.
const RESISTANCE_AT_C: f64 = 25.0;

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
    /// Turn to this angle, at no more than this velocity.
    Position {
        /// Where to, rad.
        goal_rad: f64,
        /// Greatest velocity on the way, rad/s.
        max_velocity_rad_per_s: f64,
    },
}

/// Gains of the servo's own loops, and the duty that they may use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Duty per velocity error, s/rad.
    pub velocity_p: f64,
    /// Duty per second and velocity error, 1/rad.
    pub velocity_i: f64,
    /// Velocity per angle error, 1/s.
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
    /// Into dry and viscous friction.
    pub friction_j: f64,
    /// Against the load torque that the step was solved with.
    pub load_j: f64,
    /// Change of the kinetic energy.
    pub kinetic_j: f64,
}

/// The motor's state and constants.
#[derive(Debug, Clone)]
pub struct Motor {
    resistance_ohm: f64,
    torque_constant: f64, // N m/A and V s/rad
    inertia_kg_m2: f64,
    dry_n_m: f64,
    viscous: f64, // N m s/rad
    dry_scale: f64,
    ambient_c: f64,
    heated_to_c: Option<f64>,
    angle_rad: f64,
    velocity_rad_per_s: f64,
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
    pub fn new(config: &Config) -> Self {
        let virtual_worm = &config.virtual_worm;
        Self {
            resistance_ohm: config.servo.winding_resistance_ohm,
            torque_constant: config.servo.torque_constant_n_m_per_a,
            inertia_kg_m2: virtual_worm.inertia_kg_m2,
            dry_n_m: virtual_worm.inner_friction_n_m,
            viscous: virtual_worm.inner_viscous_n_m_s_per_rad,
            dry_scale: 1.0,
            ambient_c: virtual_worm.ambient_c,
            heated_to_c: None,
            angle_rad: 0.0,
            velocity_rad_per_s: 0.0,
            integral: 0.0,
            duty: 0.0,
            current_a: 0.0,
            bus_v: Supply::new(config).open_circuit_v(),
            winding_c: virtual_worm.ambient_c,
            case_c: virtual_worm.ambient_c,
        }
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

    /// Scales dry and viscous friction inside.
    pub fn set_friction_scale(&mut self, scale: f64) {
        self.dry_scale = scale;
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
        let resistance_ohm = self.resistance_ohm * (1.0 + COPPER_PER_K * (self.winding_c - RESISTANCE_AT_C));
        let k = self.torque_constant;
        let start = self.velocity_rad_per_s;
        self.bus_v = supply.bus_v(
            self.duty * self.duty / resistance_ohm,
            self.duty * k * start / resistance_ohm,
            self.bus_v,
        );
        let (goal, balance) = self.balance(drive, gains, load_n_m, resistance_ohm);
        let dry_n_m = self.dry_n_m * self.dry_scale;
        let driving = balance.a - balance.b * start; // without dry friction
        let moving_s;
        let means;
        let direction;
        if start == 0.0 && driving.abs() <= dry_n_m {
            (moving_s, direction) = (0.0, 0.0);
            means = Means {
                end: 0.0,
                mean: 0.0,
                mean_square: 0.0,
            };
        } else {
            direction = if start == 0.0 { driving.signum() } else { start.signum() };
            let a = balance.a - direction * dry_n_m;
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
        let viscous = self.viscous * self.dry_scale;
        let before_j = self.kinetic_j();
        self.velocity_rad_per_s = means.end;
        let energy = StepEnergy {
            electrical_j: copper_j + k * (i0 * angle_rad - i1 * square_integral),
            copper_j,
            friction_j: direction * dry_n_m * angle_rad + viscous * square_integral,
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

    /// The torque balance of this step but for dry friction, and the velocity goal where there is one. Sets the duty.
    fn balance(&mut self, drive: Drive, gains: &Gains, load_n_m: f64, resistance_ohm: f64) -> (Option<f64>, Balance) {
        let k = self.torque_constant;
        let viscous = self.viscous * self.dry_scale;
        let now = self.velocity_rad_per_s;
        let velocity_goal = match drive {
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
            Drive::Duty(_) => None,
            Drive::Velocity(goal) => Some(goal),
            Drive::Position {
                goal_rad,
                max_velocity_rad_per_s,
            } => {
                let wanted = gains.position_p * (goal_rad - self.angle_rad);
                Some(wanted.clamp(-max_velocity_rad_per_s, max_velocity_rad_per_s))
            }
        };
        // D = d0 − d1·ω
        let (mut d0, mut d1) = match (drive, velocity_goal) {
            (_, Some(goal)) => (self.integral + gains.velocity_p * goal, gains.velocity_p),
            (Drive::Duty(duty), None) => (duty, 0.0),
            (_, None) => (0.0, 0.0),
        };
        let wanted = d0 - d1 * now;
        if wanted.abs() > gains.duty_limit {
            (d0, d1) = (gains.duty_limit.copysign(wanted), 0.0);
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
        let into_case_w = (self.winding_c - self.case_c) / heat::WINDING_TO_CASE_K_PER_W;
        let into_air_w = (self.case_c - self.ambient_c) / heat::CASE_TO_AIR_K_PER_W;
        self.winding_c += (copper_j - into_case_w * dt_s) / heat::WINDING_J_PER_K;
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
mod tests {
    use super::*;

    const GAINS: Gains = Gains {
        velocity_p: 0.066,
        velocity_i: 11.5,
        position_p: 20.0,
        duty_limit: 1.0,
    };
    const GAIT: f64 = 2.513;

    fn run(motor: &mut Motor, drive: Drive, load_n_m: f64, seconds: f64, dt_s: f64) -> StepEnergy {
        let mut supply = Supply::new(&Config::default());
        let mut total = StepEnergy::default();
        for _ in 0..(seconds / dt_s).round() as usize {
            let step = motor.step(drive, &GAINS, load_n_m, &mut supply, dt_s);
            total.electrical_j += step.electrical_j;
            total.copper_j += step.copper_j;
            total.friction_j += step.friction_j;
            total.load_j += step.load_j;
            total.kinetic_j += step.kinetic_j;
        }
        total
    }

    #[test]
    fn reaches_the_commanded_velocity_and_keeps_it_under_load() {
        let mut motor = Motor::new(&Config::default());
        run(&mut motor, Drive::Velocity(GAIT), 0.0, 0.1, 2.5e-4);
        assert!((motor.velocity_rad_per_s() - GAIT).abs() < 0.01 * GAIT);
        run(&mut motor, Drive::Velocity(GAIT), 0.1, 0.3, 2.5e-4);
        assert!((motor.velocity_rad_per_s() - GAIT).abs() < 1e-3 * GAIT);
        let expected_a = (0.05 + 0.003 * GAIT + 0.1) / 0.39; // the torque balance at steady speed
        assert!((motor.current_a() - expected_a).abs() < 1e-3);
    }

    #[test]
    fn energy_closes_to_rounding_at_any_step_and_inertia() {
        for (dt_s, inertia) in [(1e-4, 2e-4), (1e-3, 2e-4), (1e-3, 1e-6), (1e-3, 1.0)] {
            let mut motor = Motor::new(&Config::default());
            motor.inertia_kg_m2 = inertia;
            for drive in [
                Drive::Velocity(GAIT),
                Drive::Velocity(-GAIT),
                Drive::Duty(0.8),
                Drive::Off,
            ] {
                let e = run(&mut motor, drive, 0.02, 0.5, dt_s);
                let gone = e.copper_j + e.friction_j + e.load_j + e.kinetic_j;
                assert!(
                    (e.electrical_j - gone).abs() < 1e-9,
                    "{drive:?} at {dt_s} s: {} against {gone}",
                    e.electrical_j
                );
            }
        }
    }

    #[test]
    fn step_length_hardly_matters() {
        let angle = |dt_s| {
            let mut motor = Motor::new(&Config::default());
            run(&mut motor, Drive::Velocity(GAIT), 0.02, 1.0, dt_s);
            motor.angle_rad()
        };
        assert!((angle(1e-3) - angle(5e-5)).abs() < 5e-3);
    }

    #[test]
    fn dry_friction_holds_a_small_torque() {
        let mut motor = Motor::new(&Config::default());
        run(&mut motor, Drive::Duty(0.05), 0.0, 0.5, 2.5e-4); // 0.25 V make 29 mN m, friction is 50
        assert_eq!((motor.velocity_rad_per_s(), motor.angle_rad()), (0.0, 0.0));
        assert!((motor.current_a() - 0.25 / 3.4).abs() < 1e-3);
    }

    #[test]
    fn off_motor_coasts_to_rest_and_stays() {
        let mut motor = Motor::new(&Config::default());
        run(&mut motor, Drive::Velocity(GAIT), 0.0, 0.3, 2.5e-4);
        run(&mut motor, Drive::Off, 0.0, 0.1, 2.5e-4);
        assert_eq!((motor.velocity_rad_per_s(), motor.current_a()), (0.0, 0.0));
    }

    #[test]
    fn blocked_motor_draws_stall_current_and_heats_up() {
        let mut motor = Motor::new(&Config::default());
        motor.set_friction_scale(1e5);
        let e = run(&mut motor, Drive::Velocity(GAIT), 0.0, 30.0, 1e-3);
        assert!((1.1..1.5).contains(&motor.current_a()), "{}", motor.current_a());
        assert!(motor.winding_c > motor.case_c() && motor.case_c() > 30.0);
        assert!(motor.bus_v() < 4.8);
        assert!((e.electrical_j - e.copper_j).abs() < 1e-6);
    }

    #[test]
    fn position_drive_arrives() {
        let mut motor = Motor::new(&Config::default());
        let drive = Drive::Position {
            goal_rad: 1.0,
            max_velocity_rad_per_s: 5.0,
        };
        run(&mut motor, drive, 0.02, 1.5, 2.5e-4);
        assert!((motor.angle_rad() - 1.0).abs() < 0.01, "{}", motor.angle_rad());
    }
}
