use super::*;
use std::path::Path;
use worm_physics::servo::COUNT_RAD;

const HEADER: &str = "time_s,goal_rad,position_rad,velocity_rad_s,current_ma,input_v,temperature_c,torque_enabled";

/// A recording of an arm that swings, on a scale of so many rad a count, with the current of the last reading.
fn swing(count_rad: f64, speed: f64, current_ma: i32) -> String {
    let rows = (0..400).map(|reading| {
        let time_s = 0.005 * f64::from(reading);
        let position = (0.8 * (4.0 * time_s).sin() / count_rad).round() * count_rad;
        let velocity = speed * 3.2 * (4.0 * (time_s - 0.02)).cos();
        let current = if reading == 399 { current_ma } else { -3 };
        format!("{time_s:.4},0.0,{position:.6},{velocity:.5},{current},7.3,30,1")
    });
    let rows: Vec<String> = std::iter::once(HEADER.to_owned()).chain(rows).collect();
    rows.join("\n")
}

fn read(text: &str) -> Result<ServoRecording, String> {
    ServoRecording::read(text.as_bytes(), Path::new("run.csv")).map_err(|error| error.to_string())
}

#[test]
fn a_recording_is_read_with_the_sign_of_its_current() {
    let recording = read(&swing(COUNT_RAD, 1.0, -7)).expect("a recording");
    assert_eq!(recording.readings(), 400);
    assert!((recording.current_a[399] + 0.007).abs() < 1e-12 && recording.torque_enabled[0]);
}

#[test]
fn what_is_wrong_is_said_with_place_and_remedy() {
    let good = swing(COUNT_RAD, 1.0, -3);
    for (text, said) in [
        (
            good.replace("goal_rad", "target"),
            "run.csv: line 1: no column goal_rad",
        ),
        (
            swing(COUNT_RAD, 1.0, 65_533),
            "line 401: current_ma = 65533: that is -3 read without its sign",
        ),
        (
            good.replace("\n0.5000,", "\n0.4900,"),
            "line 102: time runs backward or stands still: 0.49 s after 0.495 s",
        ),
        (good.replace("\n0.5000,0.0", "\n0.5000,x"), "line 102: goal_rad is `x`"),
        (
            swing(5.11e-3, 1.0, -3),
            "another servo's scale: the positions change by 5.11 mrad at least",
        ),
        (
            swing(COUNT_RAD, 9.5, -3),
            "another servo's scale: the velocities are 9.",
        ),
        (
            good.replace(",0.0,0.000000,", ",2048.0,2048.0,"),
            "that is no angle in rad",
        ),
        (
            good.lines().take(40).collect::<Vec<_>>().join("\n"),
            "39 readings, at least 100 are needed",
        ),
        (String::new(), "no column time_s"),
    ] {
        let error = read(&text).expect_err(said);
        assert!(error.contains(said), "{error} for {said}");
    }
}

/// The loop of this swing pulls towards 0; a signed current follows, and one that holds an arm on one side may stay positive.
#[test]
fn a_current_that_is_never_negative_is_refused_where_the_servo_pulls_both_ways() {
    let with = |goal: &str, current: &dyn Fn(f64) -> f64| {
        let swing = swing(COUNT_RAD, 1.0, -3);
        let rows = swing.lines().skip(1).map(|row| {
            let mut fields: Vec<String> = row.split(',').map(str::to_owned).collect();
            let position: f64 = fields[2].parse().expect("a number");
            fields[1] = goal.to_owned();
            fields[4] = format!("{:.0}", current(position));
            fields.join(",")
        });
        let rows: Vec<String> = std::iter::once(HEADER.to_owned()).chain(rows).collect();
        read(&rows.join("\n")).err()
    };
    let signed = |position: f64| -400.0 * position;
    assert_eq!(with("0.0", &signed), None);
    assert_eq!(
        with("1.0", &|position| signed(position).abs()),
        None,
        "it pulls one way"
    );
    assert_eq!(with("0.0", &|_| 0.0), None, "nothing was measured");
    let error = with("0.0", &|position| signed(position).abs()).expect("without a sign");
    assert!(
        error.contains("run.csv: current_ma is hardly ever negative")
            && error.contains("sign of goal_rad less position_rad"),
        "{error}"
    );
}

/// An editor counts lines the same way whatever ends them.
#[test]
fn a_wrong_line_has_the_same_number_with_either_line_end() {
    let wrong = swing(COUNT_RAD, 1.0, -3).replace("\n0.5000,0.0", "\n0.5000,x");
    let commented = wrong.replace("\n0.5000,", "\n# then it stuck\n0.5000,");
    for (text, said) in [
        (&wrong, "run.csv: line 102: goal_rad"),
        (&commented, "run.csv: line 103: goal_rad"),
    ] {
        for text in [text.clone(), text.replace('\n', "\r\n")] {
            let error = read(&text).expect_err(said);
            assert!(error.starts_with(said), "{error} for {said}");
        }
    }
}

fn campaign(text: &str) -> Result<BenchCampaign, String> {
    BenchCampaign::from_toml(text, Path::new("here/bench.toml")).map_err(|error| error.to_string())
}

const CAMPAIGN: &str = "plant = \"servo-bench\"\n[bench]\nmass_kg = 0.49\nlength_m = 0.1\nsupply_v = 7.4\nservo = \"XL330-M288-T\"\n\
                        [[run]]\nrecording = \"a.csv\"\nposition_p_gain = 400\n";

#[test]
fn a_campaign_is_read_and_its_errors_have_a_line() {
    let read = campaign(CAMPAIGN).expect("a campaign");
    assert_eq!((read.pendulum.arm_mass_kg, read.runs[0].gain), (0.0, 400.0));
    assert_eq!(read.runs[0].recording, Path::new("here/a.csv"));
    for (from, to, said) in [
        (
            "mass_kg = 0.49\n",
            "",
            "here/bench.toml: line 2: [bench] has no mass_kg: give the mass at the end of the arm, in kg",
        ),
        (
            "mass_kg = 0.49",
            "mass_kg = 0",
            "line 3: mass_kg = 0: must be from 0.0001 to 100 kg",
        ),
        ("position_p_gain = 400\n", "", "line 8: a run without position_p_gain"),
        (
            "\"XL330-M288-T\"",
            "\"AX-12\"",
            "line 6: servo = \"AX-12\" is not known",
        ),
        ("supply_v", "voltage", "line 5: unknown field `voltage`"),
        (
            "[bench]\nmass_kg = 0.49\nlength_m = 0.1\nsupply_v = 7.4\nservo = \"XL330-M288-T\"\n",
            "",
            "there is no [bench]",
        ),
    ] {
        let error = campaign(&CAMPAIGN.replace(from, to)).expect_err(said);
        assert!(error.contains(said), "{error} for {said}");
    }
    let twice = format!("{CAMPAIGN}[[run]]\nrecording = \"a.csv\"\nposition_p_gain = 800\n");
    assert!(campaign(&twice).expect_err("twice").contains("listed twice"));
}

#[test]
fn the_plant_is_told_from_the_campaign() {
    let plant = |text: &str| plant_of(text, Path::new("c.toml")).map_err(|error| error.to_string());
    assert_eq!(plant(CAMPAIGN), Ok(Plant::ServoBench));
    assert_eq!(plant("[[run]]\nslope_deg = 0.0\n"), Ok(Plant::Worm));
    assert!(
        plant("plant = \"rover\"")
            .expect_err("unknown")
            .contains("line 1: plant = \"rover\"")
    );
}

#[test]
fn a_model_that_was_written_is_read_as_the_same() {
    use std::collections::BTreeMap;
    use worm_physics::effect::Setting;
    use worm_physics::{ActsOn, Axis, Table};
    let axes = [
        (Axis::GearLoad, vec![0.0, 0.25]),
        (Axis::MotorSpeed, vec![0.0, 1.5, 12.0]),
    ];
    let value = vec![0.0, 0.0625, 0.125, 0.25, 0.375, 0.5];
    let law = Table::new(ActsOn::MotorFriction, &axes, value, None).expect("a table");
    let turn = Table::new(
        ActsOn::MotorTorque,
        &[(Axis::MotorAngle, vec![0.0, 0.5])],
        vec![-0.125, 0.125],
        Some(1.25),
    );
    let values = BTreeMap::from([("coefficient".to_owned(), 0.25), ("motor_share".to_owned(), 0.75)]);
    let model = ServoModel {
        effects: vec![
            Setting::of_servo_by_names("load-friction", &values).expect("an effect"),
            Setting::of_servo_table(law).expect("of the motor"),
            Setting::of_servo_table(turn.expect("a table")).expect("of the motor"),
        ],
        ..ServoModel::xl330_m288_t()
    };
    let text = model.to_toml();
    assert_eq!(
        ServoModel::from_toml(&text, Path::new("model.toml")).expect(&text),
        model
    );
    for (from, to, said) in [
        (
            "winding_ohm = 3.4000",
            "winding_ohm = -1",
            "winding_ohm = -1: must be above 0",
        ),
        ("load-friction", "load-frictio", "did you mean `load-friction`?"),
        ("motor_share", "share", "share"),
        (
            "\"gear-load\"",
            "\"load\"",
            "acts_on = \"motor-friction\" cannot depend on load: give motor-speed, gear-load, output-load",
        ),
        ("motor-torque", "motor-friction", "cannot depend on motor-angle"),
        ("[-0.125, 0.125]", "[-0.125, 12.5]", "must be from -10 to 10 N m"),
        ("current = \"winding\"", "current = \"rotor\"", "unknown variant"),
    ] {
        let error = ServoModel::from_toml(&text.replace(from, to), Path::new("model.toml")).expect_err(said);
        assert!(error.to_string().contains(said), "{error} for {said}");
    }
}
