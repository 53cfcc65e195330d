use super::*;

fn file() -> &'static Path {
    Path::new("worm.toml")
}

/// The commented file is the documentation of the defaults: it must say what they are.
#[test]
fn the_commented_file_is_the_defaults() {
    let text = include_str!("../../config/worm.toml");
    assert_eq!(
        Config::from_toml(text, file()).expect("config/worm.toml is valid"),
        Config::default()
    );
}

/// The keys that the commented file leaves commented out must be right as well.
#[test]
fn the_commented_out_keys_are_accepted() {
    let text: String = include_str!("../../config/worm.toml")
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
    assert!(config.battery.is_some() && config.realtime.cpu.is_some());
    assert!(config.virtual_worm.max_deformation_m.is_some());
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
            "servo.watchdog_ms = 100: must be at least two ticks at control.rate_hz (0.200 s)",
        ),
        (
            "[tracker]\nrate_hz = 20.0\n[control]\ntracker_timeout_s = 0.02\n",
            "control.tracker_timeout_s = 0.02: must be at least two samples",
        ),
        (
            "[topics]\nroot = \"relative\"\n",
            "topics.root = \"relative\": must be an absolute path",
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
fn all_problems_are_told_at_once() {
    let error = Config::from_toml("[worm]\nmass_kg = 0.0\n[gait]\ncycle_s = 0.0\n", file()).expect_err("two problems");
    assert_eq!(error.to_string().lines().count(), 2, "{error}");
}

#[test]
fn foolish_settings_are_advised_against() {
    assert_eq!(Config::default().advice(), []);
    let foolish =
        "[port]\npath = \"/dev/ttyUSB0\"\nbaud = 57600\n[servo]\nwatchdog_ms = 20\n[control]\nrate_hz = 200.0\n";
    let config = Config::from_toml(foolish, file()).expect("legal");
    let keys: Vec<_> = config.advice().iter().map(|advice| advice.key).collect();
    assert_eq!(keys, ["port.baud", "servo.watchdog_ms"]);
}
