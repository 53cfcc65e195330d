use super::*;
use std::collections::BTreeMap;
use worm_physics::effect::LIBRARY;

fn file() -> &'static Path {
    Path::new("worm.toml")
}

/// The commented file documents the defaults, so it must contain them.
#[test]
fn the_commented_file_is_the_defaults() {
    assert_eq!(
        Config::from_toml(Config::COMMENTED, file()).expect("config/worm.toml is valid"),
        Config::default()
    );
}

/// The keys that the commented file leaves commented out must be right as well.
#[test]
fn the_commented_out_keys_are_accepted() {
    let text: String = Config::COMMENTED
        .lines()
        .map(|line| match line.strip_prefix("# ") {
            Some(rest) if rest.starts_with('[') || rest.split(' ').nth(1) == Some("=") => format!("{rest}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    let config = Config::from_toml(&text, file()).expect("every commented-out key is valid");
    assert_eq!(
        config.port.as_ref().map(|port| port.path.as_str()),
        Some("/dev/ttyUSB0")
    );
    assert!(config.battery.is_some() && config.black_box.is_some() && config.realtime.cpu.is_some());
    assert!(config.virtual_worm.max_deformation_m.is_some());
    assert_eq!(config.effect.len(), 3);
}

/// A line of the commented file for each effect of the library, with its parameters and what they may be.
#[test]
fn the_commented_file_lists_every_effect() {
    let mut effect_name = String::new();
    let mut effects = BTreeMap::new();
    for line in Config::COMMENTED.lines() {
        if let Some(line) = line.strip_prefix("#     ") {
            if let Some((name, _)) = line.split_once(' ').filter(|(name, _)| !name.is_empty()) {
                effect_name = name.to_owned();
            }
            let text: &mut String = effects.entry(effect_name.clone()).or_default();
            text.push_str(line);
            text.push('\n');
        }
    }
    assert_eq!(effects.len(), LIBRARY.len(), "{:?}", effects.keys());
    for effect in LIBRARY {
        let text = &effects[effect.name];
        for parameter in effect.parameters {
            let range = format!("{} to {}", parameter.min, parameter.max);
            assert!(
                text.contains(parameter.name) && text.contains(&range),
                "{}: {range}: {text}",
                effect.name
            );
        }
    }
}

#[test]
fn an_effect_is_read_from_the_command_line() {
    let drag: Effect = "constant-drag:force_n=-0.2".parse().expect("an effect");
    assert_eq!(
        (drag.name.as_str(), drag.cell, drag.parameters["force_n"]),
        ("constant-drag", None, -0.2)
    );
    let clamp: Effect = "unequal-clamping: cell=3, friction_factor=7e-1"
        .parse()
        .expect("an effect");
    assert_eq!((clamp.cell, clamp.parameters["friction_factor"]), (Some(3), 0.7));
    assert_eq!(clamp.parameters.len(), 1);
    for (text, expected) in [
        ("", "'' is no part of an effect: give NAME:PARAM=VALUE"),
        (":force_n=1", "is no part of an effect"),
        (
            "gremlins:force_n=1",
            "there is no effect `gremlins`: the library has unequal-clamping, ",
        ),
        ("constant-drag", "effect `constant-drag` needs `force_n`"),
        ("constant-drag:", "effect `constant-drag` needs `force_n`"),
        ("constant-drag:force_n", "'force_n' is no part of an effect"),
        ("constant-drag:force_n=1,", "'' is no part of an effect"),
        ("constant-drag:force_n=much", "force_n = 'much' is no number"),
        ("constant-drag:force_n=1,force_n=2", "force_n is given twice"),
        ("constant-drag:force=1", "has no parameter `force`: it has force_n"),
        ("constant-drag:force_n=100", "force_n = 100: must be from -4 to 4 N"),
        ("constant-drag:force_n=nan", "force_n = NaN: must be from -4 to 4 N"),
        (
            "constant-drag:force_n=1,cell=2",
            "concerns the whole worm: leave `cell` out",
        ),
        ("unequal-clamping:friction_factor=0.7", "say which `cell` it concerns"),
        ("unequal-clamping:friction_factor=0.7,cell=-1", "cell = '-1' is no cell"),
        ("unequal-clamping:friction_factor=0.7,cell=0", "give 1 to 16"),
        ("unequal-clamping:friction_factor=0.7,cell=17", "cell 17 of 16"),
    ] {
        let error = text.parse::<Effect>().expect_err(text).to_string();
        assert!(
            error.contains(expected),
            "for {text:?}\n  expected … {expected}\n  got      {error}"
        );
    }
}

#[test]
fn bad_values_are_named_with_file_place_and_remedy() {
    let table = [
        ("[worm]\nlegs = 4\n", "worm.toml:2:1: unknown field `legs`"),
        ("[worm\n", "worm.toml:1:6: "),
        ("[worm]\ncells = \"four\"\n", "worm.toml:2:9: invalid type"),
        (
            "[worm]\ncells = 1\nstep_order = [1]\n",
            "worm.toml: worm.cells = 1: must be from 2 to 16 cells",
        ),
        (
            "[battery]\nopen_circuit_v = [4.0, 4.9, 4.8, 5.6]\n",
            "worm.toml: battery.open_circuit_v = [4.0, 4.9, 4.8, 5.6]: must be 2 to 32 voltages, each above",
        ),
        (
            "[battery]\nopen_circuit_v = [3.0, 4.2]\n",
            "worm.toml: battery.open_circuit_v = [3.0, 4.2]: must begin with battery.empty_v",
        ),
        (
            "[battery]\nfull_v = 5.6\ncut_off_v = 5.7\n",
            "worm.toml: battery.cut_off_v = 5.7: must be below battery.full_v",
        ),
        (
            "[battery]\ngauge = \"BAT0\"\n",
            "worm.toml: battery.gauge = \"BAT0\": must be the absolute path",
        ),
        (
            "[black_box]\nfolder = \"boxes\"\n",
            "worm.toml: black_box.folder = \"boxes\": must be an absolute path",
        ),
        (
            "[black_box]\nlongest_s = 70.0\n",
            "worm.toml: black_box.longest_s = 70: must be at least before_s and after_s together, 80 s",
        ),
        (
            "[worm]\nname = \"../x\"\n",
            "worm.toml: worm.name = \"../x\": must be 1 to 16 of a-z",
        ),
        (
            "[worm]\nmass_kg = nan\n",
            "worm.toml: worm.mass_kg = NaN: must be from 0.001 to 100 kg",
        ),
        (
            "[worm]\nstep_order = [1, 2, 3, 3]\n",
            "worm.step_order = [1, 2, 3, 3]: must name each cell from 1 to 4 once",
        ),
        (
            "[worm]\nmax_deformation_m = [0.002, 0.001]\n",
            "worm.max_deformation_m = a list of 2: give one value, or one for each of the 4 cells",
        ),
        (
            "[worm]\nstiffness_n_per_m = [980.0, 980.0, 0.0, 980.0]\n",
            "worm.stiffness_n_per_m[3] = 0: must be from 1",
        ),
        (
            "[port]\npath = \"/dev/ttyUSB0\"\nbaud = 12345\n",
            "port.baud = 12345: must be one of [9600, 57600",
        ),
        (
            "[servo]\nwatchdog_ms = 30\n",
            "servo.watchdog_ms = 30: must be a multiple of 20 ms",
        ),
        ("[tracker]\nid = 1\n", "tracker.id = 1: must differ from servo.id"),
        (
            "[tracker]\npresent = false\n[emergency_stop]\nsource = \"tracker\"\n",
            "emergency_stop.source = \"tracker\": needs the tracker, and tracker.present = false: give \"gpio\"",
        ),
        (
            "[alarms]\njammed_cell = { policy = \"panic\", threshold = 0.5 }\n",
            "worm.toml:2:26: unknown variant `panic`",
        ),
        (
            "[alarms]\njammed_cell = { policy = \"stop\", threshold = 5.0 }\n",
            "alarms.jammed_cell.threshold = 5: must be",
        ),
        (
            "[gait]\ncycle_s = 0.5\n",
            "gait.cycle_s = 0.5: is 120.0 rev/min, beyond servo.velocity_limit_rev_per_min = 60",
        ),
        (
            "[control]\nrate_hz = 10.0\n",
            "servo.watchdog_ms = 80: must be at least two ticks at control.rate_hz (0.200 s)",
        ),
        (
            "[tracker]\nrate_hz = 20.0\n[control]\ntracker_timeout_s = 0.02\n",
            "control.tracker_timeout_s = 0.02: must be at least two samples",
        ),
        (
            "[topics]\nroot = \"relative\"\n",
            "topics.root = \"relative\": must be an absolute path",
        ),
        (
            "[[effect]]\nname = \"gremlins\"\nforce_n = 0.2\n",
            "worm.toml: effect = \"gremlins\": there is no effect `gremlins`: the library has unequal-clamping, ",
        ),
        (
            "[[effect]]\nname = \"constant-drag\"\nforce = 0.2\n",
            "effect = \"constant-drag\": effect `constant-drag` has no parameter `force`: it has force_n",
        ),
        (
            "[[effect]]\nname = \"constant-drag\"\nforce_n = \"much\"\n",
            "worm.toml:1:1: invalid type: string \"much\", expected f64",
        ),
        ("[[effect]]\nforce_n = 0.2\n", "worm.toml:1:1: missing field `name`"),
        (
            "[[effect]]\nname = \"unequal-clamping\"\nfriction_factor = 0.7\ncell = 5\n",
            "effect `unequal-clamping`: cell 5 of 4: give 1 to 4",
        ),
        (
            "[[effect]]\nname = \"unequal-clamping\"\nfriction_factor = 0.7\ncell = 0\n",
            "effect `unequal-clamping`: cell 0 of 4: give 1 to 4",
        ),
        (
            "[[effect]]\nname = \"table\"\naxis = \"place\"\ngrid = [0.0]\nvalue = [1.0]\n",
            "worm.toml: effect = \"table\": effect `table` needs `acts_on`: \"contact-force\" (values in N), \"friction-factor\", \"drive-displacement\" (values in m), \"motor-friction\" (values in N m) or \"motor-torque\" (values in N m)",
        ),
        (
            "[[effect]]\nname = \"table\"\nacts_on = \"contact-force\"\naxis = \"colour\"\ngrid = [0.0]\nvalue = [1.0]\n",
            "effect `table`: axis \"colour\": give one of deformation, deformation-rate, recent-deformation, speed, load, place, recent-slide, phase, slope, time, motor-speed, gear-load, output-load, motor-angle",
        ),
        (
            "[[effect]]\nname = \"table\"\nacts_on = \"contact-force\"\naxis = \"place\"\ngrid = [0.1, 0.0]\nvalue = [1.0, 2.0]\n",
            "effect `table`: grid of place: 0 comes after 0.1: give the points in ascending order",
        ),
        (
            "[[effect]]\nname = \"table\"\nacts_on = \"contact-force\"\naxis = [\"place\", \"slope\"]\ngrid = [[0.0, 0.1], [0.0]]\nvalue = [[1.0], [2.0, 3.0]]\n",
            "effect `table`: value: 2 values for 1 points of the grid: give one for each, a list for each point of the first axis",
        ),
        (
            "[[effect]]\nname = \"table\"\nacts_on = \"contact-force\"\naxis = \"place\"\ngrid = \"fine\"\nvalue = [1.0]\n",
            "expected a list of numbers, or with two axes a list of such lists",
        ),
        (
            "[[effect]]\nname = \"table\"\nacts_on = \"contact-force\"\naxis = \"place\"\ngrid = [0.0]\nvalue = [1.0]\nforce_n = 1.0\n",
            "effect `table` has no parameter `force_n`: it has acts_on, axis, grid, value, period, memory_s and cell",
        ),
        (
            "[[effect]]\nname = \"table\"\nacts_on = \"contact-force\"\naxis = \"place\"\ngrid = [0.0]\nvalue = [1.0]\nmemory_s = 0.2\n",
            "effect `table`: memory_s = 0.2: only a table over recent-deformation or recent-slide remembers: leave it out",
        ),
        (
            "[[effect]]\nname = \"table\"\nacts_on = \"motor-friction\"\naxis = \"gear-load\"\ngrid = [0.0]\nvalue = [0.1]\n",
            "effect `table`: acts_on = \"motor-friction\" is a law of the servo: give it in [[virtual_worm.servo_effect]], or as an [[effect]] of a servo's model",
        ),
        (
            "[[virtual_worm.servo_effect]]\nname = \"table\"\nacts_on = \"contact-force\"\naxis = \"place\"\ngrid = [0.0]\nvalue = [1.0]\n",
            "effect `table`: acts_on = \"contact-force\" is a law of the worm's cells: give it as an [[effect]] of the worm",
        ),
        (
            "[[virtual_worm.servo_effect]]\nname = \"table\"\nacts_on = \"motor-torque\"\naxis = \"gear-load\"\ngrid = [0.0]\nvalue = [0.1]\n",
            "effect `table`: acts_on = \"motor-torque\" cannot depend on gear-load: give motor-angle",
        ),
        (
            "[[virtual_worm.servo_effect]]\nname = \"load-friction\"\ncoefficient = 0.1\nmotor_share = 0.5\nvalue = [0.1]\n",
            "effect `load-friction` has no `value`: only `table` has, the library's effects have parameters",
        ),
        (
            "[[effect]]\nname = \"wear\"\nloss_per_cycle = 0.01\ngrid = [0.0]\n",
            "effect `wear` has no `grid`: only `table` has, the library's effects have parameters",
        ),
    ];
    for (text, expected) in table {
        let error = Config::from_toml(text, file()).expect_err(text).to_string();
        assert!(
            error.contains(expected),
            "for {text:?}\n  expected … {expected}\n  got      {error}"
        );
    }
}

#[test]
fn a_table_is_read_and_no_fifth_one() {
    let one = "[[effect]]\nname = \"table\"\nacts_on = \"friction-factor\"\naxis = [\"place\", \"slope\"]\nperiod = 0.041\n\
               grid = [[0, 0.02], [0.0, 30.0]]\nvalue = [[1, 0.9], [1.1, 1.0]]\ncell = 2\n";
    let config = Config::from_toml(one, file()).expect("a table");
    let settings = config.effect_settings().expect("it was checked");
    let table = settings[0].table().expect("it has a law");
    assert_eq!((settings[0].cell(), table.period()), (Some(1), Some(0.041)));
    assert_eq!(
        (table.grid(1), table.value()),
        (&[0.0, 30.0][..], &[1.0, 0.9, 1.1, 1.0][..])
    );
    let error = Config::from_toml(&one.repeat(5), file()).expect_err("five").to_string();
    assert!(error.contains("5 tables: give at most 4"), "{error}");
    let error = "table:value=1"
        .parse::<Effect>()
        .expect_err("on the command line")
        .to_string();
    assert!(error.contains("in an [[effect]] of a configuration file"), "{error}");
}

#[test]
fn all_problems_are_effect_name_at_once() {
    let error = Config::from_toml("[worm]\nmass_kg = 0.0\n[gait]\ncycle_s = 0.0\n", file()).expect_err("two problems");
    assert_eq!(error.to_string().lines().count(), 2, "{error}");
}

#[test]
fn inadvisable_settings_are_reported() {
    assert_eq!(Config::default().advice(), []);
    let inadvisable =
        "[port]\npath = \"/dev/ttyUSB0\"\nbaud = 57600\n[servo]\nwatchdog_ms = 20\n[control]\nrate_hz = 200.0\n";
    let config = Config::from_toml(inadvisable, file()).expect("valid");
    let keys: Vec<_> = config.advice().iter().map(|advice| advice.key).collect();
    assert_eq!(keys, ["port.baud", "servo.watchdog_ms"]);
}

#[test]
fn a_worm_needs_no_other_keys_to_have_no_tracker() {
    let source = |toml: &str| {
        let config = Config::from_toml(toml, file()).expect("a valid configuration");
        (
            config.position_source(),
            config.tracker_rate_hz().is_some(),
            config.advice().len(),
        )
    };
    assert_eq!(source(""), (PositionSource::Tracker, true, 0));
    // Its ID, rate and time-out do not matter then.
    let without = "[tracker]\npresent = false\nid = 1\nrate_hz = 20.0\n[control]\ntracker_timeout_s = 0.02\n";
    assert_eq!(source(without), (PositionSource::Nothing, false, 0));
    let may_die = "[control]\non_stale_tracker = \"continue\"\n";
    assert_eq!(source(may_die), (PositionSource::TrackerWhileItLasts, true, 0));
    let stops_all_the_same = format!("{may_die}[emergency_stop]\nsource = \"tracker\"\n");
    assert_eq!(
        source(&stops_all_the_same),
        (PositionSource::TrackerWhileItLasts, true, 1)
    );
    let example = include_str!("../../../../config/no-tracker.toml");
    assert_eq!(source(example), (PositionSource::Nothing, false, 0));
}
