use super::*;
use crate::link::virtual_worm::camera::CLOCK_DRIFT;
use worm_estimator::config::PerCell;
use worm_physics::MAX_CELLS;
use worm_physics::{Physics, steady_cycle_of};

/// Gains as the servo's defaults make them.
const GAINS: Gains = Gains {
    velocity_p: 0.066,
    velocity_i: 11.5,
    position_p: 1.15,
    duty_limit: 1.0,
};

const GAIT_RAD_PER_S: f64 = TAU / 2.5;

fn smooth() -> Config {
    let mut config = Config::default();
    config.virtual_worm.scatter_share = 0.0;
    config
}

fn crawl(config: &Config, velocity_rad_per_s: f64, seconds: f64) -> Plant {
    let mut plant = Plant::new(config, None).expect("a worm");
    plant.set_drive(Drive::Velocity(velocity_rad_per_s), GAINS);
    plant.advance_to(seconds).expect("a worm");
    plant
}

/// `fraction` is what may be missing: a cycle ends within a step, a total at its end.
fn assert_closes(balance: &PlantLedger, fraction: f64) {
    let gone_j = balance.copper_j + balance.friction_inside_j + balance.actuator_net_j + balance.kinetic_j;
    assert!(
        (balance.electrical_j - gone_j).abs() <= fraction * balance.electrical_j,
        "electrical {} J, accounted for {gone_j} J",
        balance.electrical_j
    );
}

/// Table 1 of the paper, through motor and cam: advance, positive and net work of the third cycle.
#[test]
fn crawls_as_the_paper_says() {
    for (slope_deg, advance_mm, positive_mj, net_mj) in [
        (0.0, 6.833, 54.88, 46.88),
        (30.0, 4.611, 67.12, 62.03),
        (45.0, 2.072, 71.96, 67.99),
    ] {
        let mut config = smooth();
        config.canal.slope_deg = slope_deg;
        let plant = crawl(&config, GAIT_RAD_PER_S, 8.0);
        let cycle = &plant.ledger().cycles()[2];
        assert!(
            (cycle.advance_m * 1e3 - advance_mm).abs() < 1e-3,
            "{slope_deg}: {cycle:?}"
        );
        assert!(
            (cycle.actuator_positive_j * 1e3 - positive_mj).abs() < 0.05,
            "{slope_deg}: {cycle:?}"
        );
        assert!(
            (cycle.actuator_net_j * 1e3 - net_mj).abs() < 0.05,
            "{slope_deg}: {cycle:?}"
        );
        assert!(
            (cycle.loss_j - cycle.actuator_net_j).abs() < 1e-5,
            "{slope_deg}: {cycle:?}"
        );
    }
}

/// A body with mass swings after each jump of the force. Where it then is decides by a little how far tips slide, and its damper takes
/// some work; the accounts close.
#[test]
fn a_body_with_mass_crawls_a_little_differently() {
    let third_cycle = |damping_ratio: Option<f64>| {
        let mut config = smooth();
        config.virtual_worm.body_damping_ratio = damping_ratio;
        let plant = crawl(&config, GAIT_RAD_PER_S, 8.0);
        let cycle = plant.ledger().cycles()[2].clone();
        assert_closes(&cycle, 2e-3);
        (cycle.advance_m * 1e3, cycle.actuator_net_j * 1e3)
    };
    let (advance_mm, net_mj) = third_cycle(None);
    let (swinging_mm, swinging_mj) = third_cycle(Some(0.4));
    println!("{advance_mm:.3} and {swinging_mm:.3} mm, {net_mj:.2} and {swinging_mj:.2} mJ");
    let (further, more) = (swinging_mm / advance_mm - 1.0, swinging_mj / net_mj - 1.0);
    assert!((1e-4..0.03).contains(&further.abs()), "{further}");
    assert!((1e-4..0.05).contains(&more.abs()), "{more}");
}

#[test]
fn energy_closes_over_each_cycle_and_over_all() {
    let mut plant = crawl(&Config::default(), GAIT_RAD_PER_S, 10.0);
    assert_eq!(plant.ledger().cycles().len(), 3);
    for cycle in plant.ledger().cycles() {
        assert_closes(cycle, 1e-5);
    }
    plant.set_drive(Drive::Velocity(-GAIT_RAD_PER_S), GAINS);
    plant.advance_to(15.0).expect("a worm");
    plant.set_drive(Drive::Off, GAINS);
    plant.advance_to(16.0).expect("a worm");
    assert_closes(&plant.total(), 1e-9);
    assert_eq!(plant.motor().velocity_rad_per_s(), 0.0);
}

/// Long simulations take longer steps.
#[test]
fn longer_steps_change_little() {
    let run = |step_s| {
        let mut plant = Plant::with_step(&smooth(), None, step_s).expect("a worm");
        plant.set_drive(Drive::Velocity(GAIT_RAD_PER_S), GAINS);
        plant.advance_to(8.0).expect("a worm");
        plant.ledger().cycles()[2].clone()
    };
    let (fine, coarse) = (run(1e-4), run(1e-3));
    assert!(
        (coarse.advance_m / fine.advance_m - 1.0).abs() < 1e-6,
        "{coarse:?} {fine:?}"
    );
    assert!(
        (coarse.electrical_j / fine.electrical_j - 1.0).abs() < 1e-3,
        "{coarse:?} {fine:?}"
    );
    assert_closes(&coarse, 1e-4);
}

#[test]
fn motor_feels_the_load() {
    let config = smooth();
    let plant = crawl(&config, GAIT_RAD_PER_S, 3.0);
    let mean_a = {
        let mut plant = plant.clone();
        let mut sum_a = 0.0;
        for _ in 0..10_000 {
            plant.step().expect("a worm");
            sum_a += plant.motor().current_a();
        }
        sum_a / 10_000.0
    };
    let needs = budget(&config);
    let expected_a = (46.88e-3 + needs.friction_j) / TAU / 0.372; // net work of a turn, and friction
    assert!((mean_a - expected_a).abs() < 5e-4, "{mean_a} against {expected_a}");
}

/// What the model says that the motor needs for a cycle.
fn budget(config: &Config) -> worm_physics::MotorCycle {
    let physics = Physics::try_from(config).expect("a worm");
    let (_, load) = worm_physics::driven_cycle(&physics, config.gait.cycle_s).expect("it holds");
    config.motor().expect("a servo").cycle(&load, config.gait.cycle_s)
}

/// The energy budget and the virtual worm have one motor: what a steady cycle takes agrees, with the identified servo and with others.
#[test]
fn the_energy_budget_agrees_with_the_ledger() {
    for (servo, slope_deg) in [
        ("", 0.0),
        ("", 30.0),
        ("servo_effect = []\ninner_friction_n_m = 0.05", 0.0),
        (
            "servo_effect = [{ name = \"load-friction\", coefficient = 0.6, motor_share = 1.0 }]",
            20.0,
        ),
        (
            "servo_effect = [{ name = \"back-driving-friction\", ratio = 2.0 }]",
            0.0,
        ),
    ] {
        let text = format!("canal.slope_deg = {slope_deg}\n[virtual_worm]\nscatter_share = 0.0\n{servo}\n");
        let config = Config::from_toml(&text, std::path::Path::new("worm.toml")).expect("a valid configuration");
        let plant = crawl(&config, GAIT_RAD_PER_S, 11.0);
        let cycle = &plant.ledger().cycles()[3];
        let needs = budget(&config);
        println!("{servo} {slope_deg}: {needs:?} {cycle:?}");
        // The budget's winding has 25 °C, and the crawling one is warmer by some kelvin, the more so the more copper heat there is.
        for (predicted_j, true_j, within) in [
            (needs.energy_j, cycle.electrical_j, 0.015),
            (needs.copper_j, cycle.copper_j, 0.03),
            (needs.friction_j, cycle.friction_inside_j, 0.01),
        ] {
            assert!(
                (predicted_j / true_j - 1.0).abs() < within,
                "{servo}: {predicted_j} J against {true_j} J"
            );
        }
    }
}

/// With an arm on the horn energy closes, and the arm hangs where its weight and the motor agree.
#[test]
fn an_arm_is_lifted_and_falls() {
    let config = smooth();
    let arm = Pendulum {
        mass_kg: 0.3,
        length_m: 0.1,
        arm_mass_kg: 0.02,
        zero_rad: 0.0,
    };
    let mut plant = Plant::new(&config, None).expect("a worm");
    plant.carry(arm);
    plant.set_drive(Drive::Position(1.2), GAINS);
    plant.advance_to(2.0).expect("a worm");
    let held_rad = plant.motor().angle_rad();
    let holding_n_m = 0.372 * plant.motor().current_a();
    let friction_n_m = (holding_n_m - arm.torque_n_m(held_rad)).abs();
    assert!(
        held_rad > 0.3 && friction_n_m < 0.0092 + 0.6 * 0.3,
        "{held_rad} {friction_n_m}"
    );
    let closes = |plant: &Plant| {
        // What lifts the arm is the work that a worm would take.
        let lifted_j = arm.potential_j(plant.motor().angle_rad());
        let total = plant.total();
        assert_eq!(total.actuator_net_j, 0.0);
        assert_closes(
            &PlantLedger {
                actuator_net_j: lifted_j,
                ..total
            },
            1e-9,
        );
    };
    closes(&plant);
    plant.set_drive(Drive::Off, GAINS);
    plant.advance_to(6.0).expect("a worm");
    closes(&plant);
    assert_eq!(plant.motor().velocity_rad_per_s(), 0.0);
    assert!(plant.motor().angle_rad().abs() < 0.05, "{}", plant.motor().angle_rad());
    assert_eq!(plant.body().phase(), 0.0, "the worm rests");
}

#[test]
fn conditions_do_what_they_say() {
    let config = smooth();
    let base = crawl(&config, GAIT_RAD_PER_S, 5.0);
    let run = |change: &dyn Fn(&mut PlantConditions)| {
        let mut conditions = PlantConditions::default();
        change(&mut conditions);
        let mut plant = base.clone();
        plant
            .set_conditions(&conditions, CameraConditions::default())
            .expect("a worm");
        plant.advance_to(10.0).expect("a worm");
        let before = base.total();
        let after = plant.total();
        (
            plant,
            after.advance_m - before.advance_m,
            after.electrical_j - before.electrical_j,
        )
    };
    let (_, usual_m, usual_j) = run(&|_| {});
    let (plant, ..) = run(&|c| c.inner_friction_scale = 1e5);
    assert_eq!(plant.motor().velocity_rad_per_s(), 0.0);
    assert!(plant.motor().current_a() > 1.0);
    let (_, jammed_m, _) = run(&|c| c.stroke_scale[1] = 0.0);
    assert!(jammed_m < 0.8 * usual_m, "{jammed_m} of {usual_m}");
    let (_, _, stiff_j) = run(&|c| c.inner_friction_scale = 3.0);
    assert!(stiff_j > 2.0 * usual_j, "{stiff_j} of {usual_j}");
    let (_, dragged_m, _) = run(&|c| c.drag_n = 1.0);
    assert!(dragged_m < 0.9 * usual_m, "{dragged_m} of {usual_m}");
    let (plant, slid_m, slid_j) = run(&|c| c.drag_speed_m_per_s = 0.01);
    assert!((slid_m - (usual_m - 0.05)).abs() < 1e-6, "{slid_m} beside {usual_m}");
    assert!((slid_j - usual_j).abs() < 1e-9 && plant.total().backward_slide_m[3] > 0.05);
    let (plant, fallen_m, _) = run(&|c| {
        c.slope_deg = Some(60.0);
        c.friction_scale = [0.2; MAX_CELLS];
    });
    assert!(plant.body().slide_m_per_s() < 0.0 && fallen_m < -0.01, "{fallen_m}");
    assert_closes(&plant.total(), 1e-9);
    let (plant, ..) = run(&|c| c.supply_drop_v = 2.0);
    assert!(plant.motor().bus_v() < 3.0);
    let (plant, ..) = run(&|c| c.heated_to_c = Some(90.0));
    assert!(plant.motor().case_c() > 85.0);
}

/// With effects the body crawls as the model says it must; the energy balance still closes.
#[test]
fn effects_act_on_the_body() {
    for (name, parameters) in [
        ("pad-hardening", vec![("hardening", 1.0)]),
        ("backlash", vec![("play_m", 1e-3)]),
        ("viscous-drag", vec![("drag_n_s_per_m", 10.0)]),
        ("unequal-clamping", vec![("friction_factor", 0.6)]),
    ] {
        let mut config = smooth();
        config.effect.push(worm_estimator::config::Effect {
            name: name.to_owned(),
            cell: (name == "unequal-clamping").then_some(2),
            table: worm_estimator::config::TableFields::default(),
            parameters: parameters
                .iter()
                .map(|&(name, value)| (name.to_owned(), value))
                .collect(),
        });
        let plant = crawl(&config, GAIT_RAD_PER_S, 11.0);
        let physics = Physics::try_from(&config).expect("a worm");
        let outcome = steady_cycle_of(&physics, 2.5);
        let expected = outcome.cycle().expect("it holds");
        let cycle = &plant.ledger().cycles()[3];
        assert!(
            (cycle.advance_m - expected.advance_m).abs() < 2e-5,
            "{name}: {cycle:?} {expected:?}"
        );
        let (found_j, expected_j) = (cycle.actuator_net_j, expected.energy_actuator_net_j);
        assert!(
            (found_j / expected_j - 1.0).abs() < 0.01,
            "{name}: {found_j} J, not {expected_j} J"
        );
        assert_closes(&plant.total(), 1e-9);
    }
}

/// A body that comes to slide on its way, worn down, slides and does not stop the world.
#[test]
fn a_body_worn_down_slides() {
    let mut config = smooth();
    config.canal.slope_deg = 40.0;
    config.effect.push(worm_estimator::config::Effect {
        name: "wear".to_owned(),
        cell: None,
        table: worm_estimator::config::TableFields::default(),
        parameters: [("loss_per_cycle".to_owned(), 0.15)].into(),
    });
    let plant = crawl(&config, GAIT_RAD_PER_S, 40.0);
    assert!(plant.body().slide_m_per_s() < 0.0, "{}", plant.body().slide_m_per_s());
    assert!(plant.body().phase() > 14.0, "{}", plant.body().phase());
}

#[test]
fn same_seed_same_world() {
    let mut config = Config::default();
    config.worm.max_deformation_m = PerCell::Each(vec![2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3]);
    let one = crawl(&config, GAIT_RAD_PER_S, 6.0);
    let two = crawl(&config, GAIT_RAD_PER_S, 6.0);
    assert_eq!((one.total(), one.capture()), (two.total(), two.capture()));
    config.virtual_worm.seed = 2;
    assert_ne!(one.total(), crawl(&config, GAIT_RAD_PER_S, 6.0).total());
}

#[test]
fn camera_captures_at_its_rate_with_its_noise() {
    let config = smooth();
    let mut plant = Plant::new(&config, None).expect("a worm");
    let truth_m = plant.body().positions_m();
    let mut samples = 0;
    let mut square_sum = 0.0;
    let mut last = plant.capture().sample;
    for _ in 0..40_000 {
        plant.step().expect("a worm");
        if plant.capture().sample != last {
            last = plant.capture().sample;
            samples += 1;
            square_sum += (plant.capture().positions_m[2] - truth_m[2]).powi(2);
        }
    }
    assert!((1199..=1202).contains(&samples), "{samples} in 10 s at 120 Hz");
    let deviation_m = (square_sum / f64::from(samples)).sqrt();
    assert!((deviation_m - 1e-4).abs() < 1e-5, "{deviation_m}");
}

/// A camera that is late by two captures and a half shows the mean of what a prompt one showed two and three captures ago.
#[test]
fn a_late_camera_shows_what_was() {
    let film = |captures_late: f64| {
        let mut config = smooth();
        config.virtual_worm.noise_m = 0.0;
        config.effect.push(worm_estimator::config::Effect {
            name: "sensor-latency".to_owned(),
            cell: None,
            table: worm_estimator::config::TableFields::default(),
            parameters: [(
                "latency_s".to_owned(),
                captures_late / (config.tracker.rate_hz * (1.0 + CLOCK_DRIFT)),
            )]
            .into(),
        });
        let mut plant = Plant::new(&config, None).expect("a worm");
        plant.set_drive(Drive::Velocity(GAIT_RAD_PER_S), GAINS);
        let mut film_m = Vec::new();
        while plant.time_s() < 6.0 {
            plant.step().expect("a worm");
            if plant.capture().sample as usize > film_m.len() {
                film_m.push(plant.capture().positions_m[1]);
            }
        }
        film_m
    };
    let (prompt_m, late_m) = (film(0.0), film(2.5));
    assert!((prompt_m[700] - prompt_m[0]).abs() > 5e-3, "the worm crawls");
    for capture in 3..prompt_m.len() {
        let expected_m = 0.5 * (prompt_m[capture - 2] + prompt_m[capture - 3]);
        assert!((late_m[capture] - expected_m).abs() < 1e-9, "capture {capture}");
    }
}
