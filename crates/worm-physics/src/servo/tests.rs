use super::*;
use crate::effect::Setting;
use crate::{ActsOn, Axis, Table};

fn bench() -> ServoPhysics {
    let pendulum = Pendulum {
        mass_kg: 0.49,
        length_m: 0.1,
        arm_mass_kg: 0.0,
        zero_rad: 0.0,
    };
    ServoPhysics::new(ServoMotor::XL330_M288_T, pendulum, 7.4)
}

/// Angles every 5 ms under a goal that swings and a drop at the end, in steps of at most `longest_s`.
fn swing(physics: &ServoPhysics, longest_s: f64) -> Vec<f64> {
    let mut motion = ServoMotion::new(0.1, 0.0, 25.0);
    let at = |sample: u32| {
        let time_s = f64::from(sample) * 5e-3;
        let command = Command {
            gain: 400.0,
            goal_rad: 1.2 * (1.5 * time_s * time_s).sin(),
            torque_enabled: time_s < 3.0,
        };
        motion.advance(physics, &command, 5e-3, longest_s);
        motion.angle_rad()
    };
    (0..1000).map(at).collect()
}

fn with(change: impl FnOnce(&mut ServoLaws)) -> ServoPhysics {
    let mut physics = bench();
    change(&mut physics.laws);
    physics
}

#[test]
fn the_step_hardly_matters() {
    for (name, physics) in [
        ("plain", bench()),
        (
            "stribeck",
            with(|laws| (laws.stribeck_n_m, laws.stribeck_rad_s) = (0.05, 0.2)),
        ),
        (
            "load",
            with(|laws| (laws.load_friction, laws.load_squared_per_n_m) = (0.3, 0.3)),
        ),
        ("delay", with(|laws| laws.delay_s = 3e-3)),
        ("sag", with(|laws| laws.supply_ohm = 1.0)),
        ("play", with(|laws| laws.play_rad = 0.01)),
    ] {
        let (coarse, fine) = (swing(&physics, LONGEST_STEP_S), swing(&physics, 0.01 * LONGEST_STEP_S));
        let apart: Vec<f64> = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs()).collect();
        let mean = apart.iter().sum::<f64>() / apart.len() as f64;
        println!(
            "{name}: mean {:.3} mrad, most {:.3}",
            1e3 * mean,
            1e3 * apart.iter().fold(0.0, |a, &b| f64::max(a, b))
        );
        assert!(mean < COUNT_RAD, "{name}: {mean} rad");
    }
}

/// Gears that touch push, at any play: how far the arm goes grows with the play, without a jump.
#[test]
fn a_little_more_play_moves_the_arm_a_little_further() {
    let of_play = |play_rad: f64| swing(&with(|laws| laws.play_rad = play_rad), LONGEST_STEP_S);
    let mut before = (0.0, swing(&bench(), LONGEST_STEP_S));
    for play_rad in (1..=40).map(|step| 1e-3 * f64::from(step)) {
        let angles = of_play(play_rad);
        let apart = before.1.iter().zip(&angles).map(|(one, other)| (one - other).abs());
        let mean_rad = apart.sum::<f64>() / angles.len() as f64;
        assert!(
            mean_rad < 2.0 * (play_rad - before.0),
            "{play_rad} rad of play moves it {mean_rad} rad further than {} rad",
            before.0
        );
        before = (play_rad, angles);
    }
}

#[test]
fn an_arm_that_sticks_rests_exactly_and_starts_beyond_friction() {
    let physics = bench();
    let mut motion = ServoMotion::new(0.0, 0.0, 25.0);
    let hold = |goal_rad: f64| Command {
        gain: 100.0,
        goal_rad,
        torque_enabled: true,
    };
    let per_rad = physics.duty(100.0, 1.0, 0.0) * 7.4 / 3.4 * 0.37;
    let limit_rad = 0.02 / per_rad;
    motion.advance(&physics, &hold(0.98 * limit_rad), 1.0, LONGEST_STEP_S);
    assert_eq!((motion.angle_rad(), motion.velocity_rad_s()), (0.0, 0.0));
    motion.advance(&physics, &hold(1.1 * limit_rad), 1.0, LONGEST_STEP_S);
    assert!(motion.angle_rad() > 0.0);
}

#[test]
fn without_friction_the_energy_of_a_fall_stays() {
    let mut physics = bench();
    (physics.motor.dry_n_m, physics.motor.viscous_n_m_s) = (0.0, 0.0);
    let off = Command {
        gain: 100.0,
        goal_rad: 0.0,
        torque_enabled: false,
    };
    let energy_j = |motion: &ServoMotion| {
        let inertia = physics.pendulum.inertia_kg_m2() + physics.motor.rotor_inertia_kg_m2;
        0.5 * inertia * motion.velocity_rad_s().powi(2)
            + physics.pendulum.level_torque_n_m() * (1.0 - motion.angle_rad().cos())
    };
    let mut motion = ServoMotion::new(1.0, 0.0, 25.0);
    let start_j = energy_j(&motion);
    for _ in 0..1000 {
        motion.advance(&physics, &off, 5e-3, LONGEST_STEP_S);
        assert!(
            (energy_j(&motion) / start_j - 1.0).abs() < 0.01,
            "{} J of {start_j}",
            energy_j(&motion)
        );
    }
    assert_eq!(motion.energy(), Energy::default());
}

/// Lifted slowly, the motor's torque is that of the arm plus friction: dry, and as the load law says.
#[test]
fn load_on_the_gears_costs_what_the_law_says() {
    let physics = with(|laws| (laws.load_friction, laws.load_squared_per_n_m) = (0.2, 0.5));
    let mut motion = ServoMotion::new(0.0, 0.0, 25.0);
    let mut command = Command {
        gain: 800.0,
        goal_rad: 0.0,
        torque_enabled: true,
    };
    for _ in 0..4000 {
        command.goal_rad += 2.5e-4;
        motion.advance(&physics, &command, 5e-3, 1e-4);
    }
    let torque = physics.motor.torque_constant * motion.current_a(&physics, &command);
    let arm = physics.pendulum.torque_n_m(motion.angle_rad());
    let load = 0.5 * (torque + arm);
    let friction = 0.02 + 5e-3 * motion.velocity_rad_s() + load * (0.2 + 0.5 * load);
    assert!(
        (torque - arm - friction).abs() < 2e-3,
        "{torque} for {arm} and {friction}"
    );
}

/// What the library's laws say, said by tables: the same motion.
#[test]
fn a_table_does_what_the_effect_does_that_it_is_read_from() {
    let grid = |from: f64, to: f64, points: u32| -> Vec<f64> {
        (0..=points)
            .map(|at| from + (to - from) * f64::from(at) / f64::from(points))
            .collect()
    };
    let loads = grid(0.0, 1.0, 250);
    let speeds = grid(0.0, 12.0, 250);
    let turn = grid(0.0, 0.5 * std::f64::consts::TAU * (1.0 - 1.0 / 250.0), 249);
    let over_load = loads.iter().map(|load| load * (0.2 + 0.5 * load)).collect();
    let over_speed = speeds
        .iter()
        .map(|speed| 0.03 * (-(speed / 1.5).powi(2)).exp())
        .collect();
    let over_angle = turn.iter().map(|angle| 0.03 * (2.0 * angle + 0.6).sin()).collect();
    let half_turn = Some(0.5 * std::f64::consts::TAU);
    let tables = [
        (ActsOn::MotorFriction, Axis::GearLoad, loads, over_load, None),
        (ActsOn::MotorFriction, Axis::MotorSpeed, speeds, over_speed, None),
        (ActsOn::MotorTorque, Axis::MotorAngle, turn, over_angle, half_turn),
    ];
    let by_tables = tables.map(|(acts_on, axis, grid, value, period)| {
        let table = Table::new(acts_on, &[(axis, grid)], value, period).expect("a table");
        Setting::of_servo_table(table).expect("of the motor")
    });
    let by_laws = with(|laws| {
        (laws.load_friction, laws.load_squared_per_n_m) = (0.2, 0.5);
        (laws.stribeck_n_m, laws.stribeck_rad_s) = (0.03, 1.5);
        (laws.ripple_n_m, laws.ripple_waves) = (0.03, 2.0);
        laws.ripple_phase = 0.6 / std::f64::consts::TAU;
    });
    let plain = swing(&bench(), 1e-3);
    let [law, table] = [&by_laws, &bench().with(&by_tables)].map(|physics| swing(physics, 1e-3));
    let largest = |one: &[f64], other: &[f64]| {
        let apart = one.iter().zip(other).map(|(one, other)| (one - other).abs());
        apart.fold(0.0, f64::max)
    };
    assert!(largest(&law, &plain) > 0.1, "they do something");
    assert!(largest(&law, &table) < 2e-3, "{} rad", largest(&law, &table));
}

/// The load on the output is above 0 where it resists the motion: friction over it tells lifting from lowering.
#[test]
fn friction_over_the_load_on_the_output_tells_driving_from_being_driven() {
    let axis = [(Axis::OutputLoad, vec![-1.0, 0.0, 1.0])];
    let table = Table::new(ActsOn::MotorFriction, &axis, vec![0.3, 0.0, 0.1], None).expect("a table");
    let setting = Setting::of_servo_table(table).expect("of the motor");
    let physics = bench().with(&[setting]);
    for (load_n_m, velocity, more) in [
        (0.5, 1.0, 0.05),
        (0.5, -1.0, 0.15),
        (-0.5, -1.0, 0.05),
        (-0.5, 1.0, 0.15),
    ] {
        let friction = physics.friction_n_m(0.2, load_n_m, velocity) - physics.motor.dry_n_m;
        assert!(
            (friction - more).abs() < 1e-12,
            "{load_n_m} N m at {velocity} rad/s: {friction}"
        );
    }
}
