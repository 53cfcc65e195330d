//! `wormd calibrate`: the friction of the gears from slow turns of a running worm, into a copy of its configuration.

use super::{Failure, WormArgs, end_on_signal, log_line, print, require_worm};
use crate::black_box::utc;
use crate::calibration::{self, Found, Stage};
use crate::supervisor::controller::refuse_foreign;
use crate::topics::Instance;
use clap::{ArgGroup, Args};
use serde::Serialize;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use toml_edit::{DocumentMut, Item, Table, value};
use worm_estimator::config::{CalibrationMode, Config};
use worm_estimator::self_sensing::calibration::{GearFriction, direction_difference};

/// What a motor that warms up, by some 10 K, changes of its gears' friction, as a share: it is in the standard deviation that is written.
const WARMING_SHARE: f64 = 0.03;

/// Arguments of `wormd calibrate`.
///
/// The worm must be running, and nobody else may drive it meanwhile. It turns its cam for one to two minutes, and holds at the end.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("where").required(true)))]
pub struct CalibrateArgs {
    /// The worm is held free: no tip touches anything. The most exact
    #[arg(long, group = "where")]
    lifted: bool,
    /// It lies in its canal, on the level; it crawls some cycles forward, and back
    #[arg(long, group = "where")]
    level: bool,
    #[command(flatten)]
    worm: WormArgs,
    /// The configuration to write: a copy of the worm's with what was found; an existing file is replaced
    #[arg(long, value_name = "FILE", default_value = "calibrated.toml")]
    out: PathBuf,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Runs `wormd calibrate`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments or a configuration that cannot be used, where no such worm runs, and where one that should be lifted
/// is not; [`Failure::Failed`] when the worm refuses, is stopped by somebody or does not turn evenly, after a signal, and when the file cannot
/// be written. The worm holds then.
pub fn run(args: &CalibrateArgs) -> Result<(), Failure> {
    print::log_in_background()?;
    let (config, text) = args.worm.load_with_text()?;
    let mode = if args.lifted {
        CalibrationMode::Lifted
    } else {
        CalibrationMode::Level
    };
    let mut document = parse(text.as_deref().unwrap_or_default())?;
    check_writable(&args.out)?;
    let end = end_on_signal()?;
    refuse_foreign(&config)?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    require_worm(&instance)?;
    let stages = calibration::stages(mode, &config);
    log_line(format_args!(
        "{}: turns its cam for {:.0} s, then holds; Ctrl-C ends that",
        config.worm.name,
        calibration::duration_s(&stages)
    ));
    let mut number = 0;
    let mut tell = |stage: &Stage| {
        number += 1;
        log_line(format_args!(
            "{number} of {}: {:+.3} cycles/s",
            stages.len(),
            stage.cycles_per_s
        ));
    };
    let found = calibration::calibrate(&instance, &config, mode, &end, &mut tell)?;
    let date = utc::rfc3339(SystemTime::now());
    write_into(&mut document, &config, mode, &date, &found);
    std::fs::write(&args.out, document.to_string())
        .map_err(|error| Failure::failed(cannot_write(&args.out, &error)))?;
    let report = Report::new(&config, mode, date, &found, &args.out);
    if args.json {
        print::line(serde_json::to_string(&report).map_err(Failure::failed)?)
    } else {
        print::line(report.in_words())
    }
}

fn parse(text: &str) -> Result<DocumentMut, Failure> {
    // The configuration was read from this text, so it is TOML.
    text.parse().map_err(Failure::failed)
}

/// Refuses a file that could not be written, before the worm moves.
fn check_writable(file: &Path) -> Result<(), Failure> {
    let is_there = file.exists();
    let refused = |error| Failure::unusable(cannot_write(file, &error));
    std::fs::OpenOptions::new()
        .append(true)
        .create(true)
        .open(file)
        .map_err(refused)?;
    if is_there {
        Ok(())
    } else {
        std::fs::remove_file(file).map_err(refused)
    }
}

fn cannot_write(file: &Path, error: &std::io::Error) -> String {
    format!(
        "{}: cannot be written: {error}: choose another file with --out",
        file.display()
    )
}

/// Puts what was found into the text of a configuration.
fn write_into(document: &mut DocumentMut, config: &Config, mode: CalibrationMode, date: &str, found: &Found) {
    let friction = &found.friction;
    let known = section(document, "self_sensing");
    set(known, "dry_friction_n_m", rounded(friction.dry_n_m));
    set(
        known,
        "viscous_friction_n_m_s_per_rad",
        rounded(friction.viscous_n_m_s_per_rad),
    );
    let usual_n_m = friction.dry_n_m + friction.viscous_n_m_s_per_rad * TAU * config.gait_cycles_per_s().abs();
    let sigma_n_m = friction.sigma_n_m.hypot(WARMING_SHARE * usual_n_m);
    set(known, "friction_sigma_n_m", rounded(sigma_n_m));
    let mut calibrated = Table::new();
    for (key, item) in [
        ("date", value(date)),
        (
            "mode",
            value(match mode {
                CalibrationMode::Lifted => "lifted",
                CalibrationMode::Level => "level",
            }),
        ),
        ("temperature_c", value(rounded(found.temperature_c))),
        ("supply_v", value(rounded(found.supply_v))),
        ("servo_model", value(i64::from(config.servo.model_number))),
        ("servo_id", value(i64::from(config.servo.id))),
        ("dry_friction_sigma_n_m", value(rounded(friction.dry_sigma_n_m))),
        (
            "viscous_friction_sigma_n_m_s_per_rad",
            value(rounded(friction.viscous_sigma_n_m_s_per_rad)),
        ),
    ] {
        calibrated.insert(key, item);
    }
    known.insert("calibrated", Item::Table(calibrated));
    // What plans, range and trips expect of the motor. A virtual worm's own truth is left alone.
    if config.port.is_some() {
        let motor = section(document, "virtual_worm");
        set(motor, "inner_friction_n_m", rounded(friction.dry_n_m));
        set(
            motor,
            "inner_viscous_n_m_s_per_rad",
            rounded(friction.viscous_n_m_s_per_rad),
        );
    }
}

/// A table of the file, made where it is missing.
fn section<'d>(document: &'d mut DocumentMut, name: &str) -> &'d mut dyn toml_edit::TableLike {
    let item = document.entry(name).or_insert_with(|| Item::Table(Table::new()));
    if !item.is_table_like() {
        *item = Item::Table(Table::new());
    }
    item.as_table_like_mut()
        .unwrap_or_else(|| unreachable!("it is one now"))
}

/// Sets a value, and keeps the comment beside the old one.
fn set(table: &mut dyn toml_edit::TableLike, key: &str, number: f64) {
    let mut item = value(number);
    if let (Some(old), Some(new)) = (table.get(key).and_then(Item::as_value), item.as_value_mut()) {
        *new.decor_mut() = old.decor().clone();
    }
    table.insert(key, item);
}

/// With four significant digits: what lies below says nothing.
fn rounded(number: f64) -> f64 {
    if number == 0.0 || !number.is_finite() {
        return number;
    }
    let digits = 3 - number.abs().log10().floor() as i32;
    let scale = 10f64.powi(digits);
    (number * scale).round() / scale
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Report {
    worm: String,
    mode: CalibrationMode,
    date: String,
    temperature_c: f64,
    supply_v: f64,
    turns: Vec<Turn>,
    dry_friction_n_m: Compared,
    viscous_friction_n_m_s_per_rad: Compared,
    friction_n_m: Compared,
    direction_difference_n_m: Option<f64>,
    cannot_tell: Vec<&'static str>,
    config: PathBuf,
}

/// Friction at one speed.
#[derive(Debug, Serialize)]
struct Turn {
    velocity_rad_s: f64,
    friction_n_m: f64,
    friction_sigma_n_m: f64,
}

/// A value beside the configured one.
#[derive(Debug, Serialize)]
struct Compared {
    value: f64,
    sigma: f64,
    configured: f64,
    /// By how many standard errors it differs from that.
    sigmas_off: f64,
}

impl Compared {
    fn new(value: f64, sigma: f64, configured: f64) -> Self {
        Self {
            value,
            sigma,
            configured,
            sigmas_off: (value - configured) / sigma,
        }
    }
}

impl Report {
    fn new(config: &Config, mode: CalibrationMode, date: String, found: &Found, out: &Path) -> Self {
        let friction: &GearFriction = &found.friction;
        let known = &config.self_sensing;
        let usual_rad_s = TAU * config.gait_cycles_per_s().abs();
        let at_usual = |dry: f64, viscous: f64| dry + viscous * usual_rad_s;
        Self {
            worm: config.worm.name.clone(),
            mode,
            date,
            temperature_c: found.temperature_c,
            supply_v: found.supply_v,
            turns: found
                .at
                .iter()
                .map(|at| Turn {
                    velocity_rad_s: at.velocity_rad_per_s,
                    friction_n_m: at.friction_n_m,
                    friction_sigma_n_m: at.sigma_n_m,
                })
                .collect(),
            dry_friction_n_m: Compared::new(friction.dry_n_m, friction.dry_sigma_n_m, known.dry_friction_n_m),
            viscous_friction_n_m_s_per_rad: Compared::new(
                friction.viscous_n_m_s_per_rad,
                friction.viscous_sigma_n_m_s_per_rad,
                known.viscous_friction_n_m_s_per_rad,
            ),
            friction_n_m: Compared::new(
                at_usual(friction.dry_n_m, friction.viscous_n_m_s_per_rad),
                friction.sigma_n_m,
                at_usual(known.dry_friction_n_m, known.viscous_friction_n_m_s_per_rad),
            ),
            direction_difference_n_m: direction_difference(&found.at).map(|(difference_n_m, _)| difference_n_m),
            cannot_tell: cannot_tell(mode),
            config: out.to_owned(),
        }
    }

    fn in_words(&self) -> String {
        let mut lines = vec![format!(
            "gears of {} at {:.0} °C and {:.2} V:",
            self.worm, self.temperature_c, self.supply_v
        )];
        let compared = |name: &str, unit: &str, it: &Compared| {
            let percent = 100.0 * (it.value / it.configured - 1.0);
            let relative = if percent.is_finite() {
                format!(
                    ", {percent:+.0} % of the configured one, {:.1} sigma",
                    it.sigmas_off.abs()
                )
            } else {
                String::new()
            };
            format!("{name} {:.2} ± {:.2} {unit}{relative}", 1e3 * it.value, 1e3 * it.sigma)
        };
        lines.push(compared("friction at the usual speed", "mN m", &self.friction_n_m));
        lines.push(compared("of that dry", "mN m", &self.dry_friction_n_m));
        lines.push(compared(
            "growing with speed",
            "mN m s/rad",
            &self.viscous_friction_n_m_s_per_rad,
        ));
        if let Some(difference_n_m) = self.direction_difference_n_m {
            lines.push(format!("forward less backward {:+.2} mN m", 1e3 * difference_n_m));
        }
        lines.extend(self.cannot_tell.iter().map(|what| format!("not told: {what}")));
        lines.push(format!(
            "{}: use it with --config when the worm is started next",
            self.config.display()
        ));
        lines.join("\n")
    }
}

fn cannot_tell(mode: CalibrationMode) -> Vec<&'static str> {
    let constant = "the torque constant, which every friction here scales with";
    match mode {
        CalibrationMode::Lifted => vec![
            constant,
            "friction by the load on the gears (self_sensing.load_friction): nothing loads them",
        ],
        CalibrationMode::Level => vec![
            constant,
            "friction by the load on the gears, but for what the tips load them with",
            "gears and drag apart: what resists throughout the cycle counts as the gears' friction; lifted they are told apart",
        ],
    }
}
