use super::*;

const GAINS: Gains = Gains {
    velocity_p: 0.066,
    velocity_i: 11.5,
    position_p: 1.15,
    duty_limit: 1.0,
};
const GAIT: f64 = 2.513;

/// The servo of a configuration that adds lines to `[virtual_worm]`.
fn motor_with(lines: &str) -> Motor {
    let text = format!("[virtual_worm]\n{lines}");
    let config = Config::from_toml(&text, std::path::Path::new("worm.toml")).expect("a valid configuration");
    Motor::new(&config).expect("a servo")
}

fn motor() -> Motor {
    motor_with("")
}

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
    let mut motor = motor();
    run(&mut motor, Drive::Velocity(GAIT), 0.0, 0.3, 2.5e-4);
    assert!((motor.velocity_rad_per_s() - GAIT).abs() < 0.01 * GAIT);
    run(&mut motor, Drive::Velocity(GAIT), 0.1, 0.5, 2.5e-4);
    assert!((motor.velocity_rad_per_s() - GAIT).abs() < 1e-3 * GAIT);
    // The torque balance at steady speed, with the energy budget's friction.
    let budget = Config::default().motor().expect("a servo");
    let expected_a = (0.1 + budget.friction_n_m(0.1, GAIT)) / 0.372;
    assert!(
        (motor.current_a() - expected_a).abs() < 5e-4,
        "{} {expected_a}",
        motor.current_a()
    );
}

#[test]
fn energy_closes_to_rounding_at_any_step_and_inertia() {
    for (dt_s, inertia) in [(1e-4, 2e-4), (1e-3, 2e-4), (1e-3, 1e-6), (1e-3, 1.0)] {
        let mut motor = motor();
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
        let mut motor = motor();
        run(&mut motor, Drive::Velocity(GAIT), 0.02, 1.0, dt_s);
        motor.angle_rad()
    };
    assert!((angle(1e-3) - angle(5e-5)).abs() < 5e-3);
}

#[test]
fn dry_friction_holds_a_small_torque() {
    let mut motor = motor();
    // 0.1 V make 11.2 mN m, which press the gears; friction is 9.2 + 0.81 · 0.316 · 11.2 = 12.1.
    run(&mut motor, Drive::Duty(0.02), 0.0, 0.5, 2.5e-4);
    assert_eq!((motor.velocity_rad_per_s(), motor.angle_rad()), (0.0, 0.0));
    assert!((motor.current_a() - 0.1 / 3.32).abs() < 1e-3);
    run(&mut motor, Drive::Duty(0.024), 0.0, 0.5, 2.5e-4); // 13.4 mN m against 12.6
    assert!(motor.velocity_rad_per_s() > 0.0);
}

/// Effects that only a servo with them has: energy closes with each, and each does what it says.
#[test]
fn servo_effects_act_and_the_energy_closes() {
    let effect = |text: &str| motor_with(&format!("servo_effect = [{{ {text} }}]"));
    let mean_a = |mut motor: Motor, load_n_m: f64, velocity: f64| {
        run(&mut motor, Drive::Velocity(velocity), load_n_m, 0.6, 2.5e-4);
        let mut before = motor.clone();
        let energy = run(&mut before, Drive::Velocity(velocity), load_n_m, 5.0, 2.5e-4);
        let gone = energy.copper_j + energy.friction_j + energy.load_j + energy.kinetic_j;
        assert!((energy.electrical_j - gone).abs() < 1e-9, "{gone}");
        energy.copper_j
    };
    let bare_j = |load_n_m, velocity| mean_a(motor_with("servo_effect = []"), load_n_m, velocity);
    let usual_j = bare_j(0.05, GAIT);
    for text in [
        "name = \"load-friction\", coefficient = 0.4, motor_share = 0.5",
        "name = \"load-squared-friction\", coefficient_per_n_m = 3.0, motor_share = 0.5",
        "name = \"gear-ripple\", amplitude_n_m = 0.05, waves_per_turn = 12.0, phase = 0.0",
        "name = \"stribeck-friction\", extra_n_m = 0.1, speed_rad_s = 5.0",
    ] {
        let copper_j = mean_a(effect(text), 0.05, GAIT);
        assert!(copper_j > 1.2 * usual_j, "{text}: {copper_j} J, {usual_j} J without");
    }
    // The arm drives: half of the dry friction is missing there, so the motor brakes more.
    let back = "name = \"back-driving-friction\", ratio = 0.0";
    assert!(mean_a(effect(back), -0.15, GAIT) > 1.05 * bare_j(-0.15, GAIT));
    // Where the motor drives, nothing changes, but for the moment in which the load turned it back before it started.
    assert!((mean_a(effect(back), 0.15, GAIT) / bare_j(0.15, GAIT) - 1.0).abs() < 1e-3);
    let mut dead = effect("name = \"duty-dead-band\", dead_duty = 0.1");
    run(&mut dead, Drive::Duty(0.09), 0.0, 0.5, 2.5e-4);
    assert_eq!(dead.angle_rad(), 0.0);
    let overshoot = |mut motor: Motor| {
        let mut supply = Supply::new(&Config::default());
        let steps = (0..2000).map(|_| {
            motor.step(Drive::Velocity(GAIT), &GAINS, 0.0, &mut supply, 2.5e-4);
            motor.velocity_rad_per_s()
        });
        steps.fold(0.0, f64::max)
    };
    let prompt = overshoot(motor_with("servo_effect = []"));
    assert!(overshoot(effect("name = \"loop-delay\", delay_s = 0.03")) > 1.02 * prompt);
    let mut hot = effect("name = \"winding-heat\", heat_k_per_j = 5.0, cooling_s = 50.0");
    let mut cool = motor_with("servo_effect = []");
    for motor in [&mut hot, &mut cool] {
        motor.set_friction_scale(1e5);
        run(motor, Drive::Duty(0.5), 0.0, 5.0, 1e-3);
    }
    assert!(hot.current_a() < 0.95 * cool.current_a());
}

#[test]
fn off_motor_coasts_to_rest_and_stays() {
    let mut motor = motor();
    run(&mut motor, Drive::Velocity(GAIT), 0.0, 0.3, 2.5e-4);
    run(&mut motor, Drive::Off, 0.0, 0.4, 2.5e-4); // J/c · ln(1 + c ω/dry) = 0.3 s
    assert_eq!((motor.velocity_rad_per_s(), motor.current_a()), (0.0, 0.0));
}

#[test]
fn blocked_motor_draws_stall_current_and_heats_up() {
    let mut motor = motor();
    motor.set_friction_scale(1e5);
    let e = run(&mut motor, Drive::Velocity(GAIT), 0.0, 30.0, 1e-3);
    assert!((1.1..1.5).contains(&motor.current_a()), "{}", motor.current_a());
    assert!(motor.winding_c > motor.case_c() && motor.case_c() > 30.0);
    assert!(motor.bus_v() < 4.8);
    assert!((e.electrical_j - e.copper_j).abs() < 1e-6);
}

#[test]
fn position_drive_arrives() {
    let mut motor = motor();
    run(&mut motor, Drive::Position(1.0), 0.02, 1.5, 2.5e-4);
    // What holds it off the goal is friction at rest, on either side of the load: 9.2 mN m and what the load adds, over P k V/R.
    let off_n_m = GAINS.position_p * (1.0 - motor.angle_rad()) * 0.372 * motor.bus_v() / 3.32;
    assert!(off_n_m > -1e-3 && off_n_m < 0.042, "{off_n_m} N m");
}
