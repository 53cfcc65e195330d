//! `wormd servo-bench`: recordings of a servo that moves an arm, for `wormd explain`.

use super::{Failure, end_on_signal, log_line, print, suspend_on_signal};
use crate::control::{DriveError, link_settings};
use crate::link::servo::XL330_M288_MODEL;
use crate::link::{EmergencyStopInput, StopInputs, Tty, WormBus};
use crate::servo_bench::{Bench, BenchFiles, BenchServo, BenchSettings, RecordingError, Trajectory};
use clap::{Args, Subcommand};
use serde_json::{Value, json};
use std::io::{self, BufRead, IsTerminal};
use std::path::{Path, PathBuf};
use worm_estimator::config::{Config, EmergencyStop, EmergencyStopSource};

/// Arguments of `wormd servo-bench`.
#[derive(Debug, Args)]
pub struct ServoBenchArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Moves the arm along trajectories with several gains, and writes recordings and their campaign
    Record(RecordArgs),
}

/// Moves an arm on the servo's horn, and records what the servo reports.
///
/// The arm must hang freely and still: that is angle 0. It swings by --amplitude-deg to both sides: keep hands away. Ctrl-C switches the torque
/// off.
#[derive(Debug, Args)]
struct RecordArgs {
    #[command(flatten)]
    worm: super::WormArgs,
    /// Mass at the end of the arm, kg
    #[arg(long, value_name = "KG", value_parser = number::<100_000, 100>)]
    mass_kg: f64,
    /// From the shaft to that mass, m
    #[arg(long, value_name = "M", value_parser = number::<1_000, 10>)]
    length_m: f64,
    /// Mass of the arm itself, spread evenly, kg
    #[arg(long, value_name = "KG", default_value = "0", value_parser = number::<0, 100>)]
    arm_mass_kg: f64,
    /// Voltage of the supply without load, V; as the servo measures it unless given
    #[arg(long, value_name = "V", value_parser = number::<1, 60>)]
    supply_v: Option<f64>,
    /// The servo in the campaign: its name, or the file of its model
    #[arg(long, value_name = "NAME|FILE", default_value = XL330)]
    servo: String,
    /// A trajectory: sin_sin, sin_time_square, slow or lift; all of them unless given
    #[arg(long = "trajectory", value_name = "NAME", value_delimiter = ',')]
    trajectories: Vec<Trajectory>,
    /// Position P gain (register 84)
    #[arg(long = "gain", value_name = "GAIN", value_delimiter = ',', default_values_t = [100, 200, 400], value_parser = clap::value_parser!(u16).range(1..=16_383))]
    gains: Vec<u16>,
    /// Greatest angle of a goal, degrees
    #[arg(long, value_name = "DEG", default_value = "90", value_parser = number::<1, 120>)]
    amplitude_deg: f64,
    /// Readings a second; the bus may allow fewer
    #[arg(long, value_name = "HZ", default_value = "200", value_parser = number::<20, 1000>)]
    rate_hz: f64,
    /// Folder for the recordings and bench.toml
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Do not ask before the arm moves
    #[arg(long)]
    yes: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// The servo that `wormd explain` knows by name.
const XL330: &str = "xl330-m288-t";

/// A number from 1/`PER` (0 where `PER` is 0) to `MAX`.
fn number<const PER: u32, const MAX: u32>(text: &str) -> Result<f64, String> {
    let min = if PER == 0 { 0.0 } else { 1.0 / f64::from(PER) };
    let range = min..=f64::from(MAX);
    let value = text.parse().ok().filter(|value| range.contains(value));
    value.ok_or_else(|| format!("must be a number from {min} to {MAX}"))
}

/// Runs `wormd servo-bench`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments or a configuration that cannot be used, and without a yes; [`Failure::Failed`] when a recording fails. Torque
/// is off then, or the message says that it may not be.
pub fn run(args: &ServoBenchArgs) -> Result<(), Failure> {
    match &args.action {
        Action::Record(args) => record(args),
    }
}

fn record(args: &RecordArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let Some(port) = &config.port else {
        return Err(Failure::unusable(
            "recording needs a serial port: name one in the section [port] or with --port; to try it without a servo, run \
             `wormd virtual-worm --link PATH --arm mass_kg=0.2,length_m=0.1`",
        ));
    };
    if config.servo.model_number != XL330_M288_MODEL && args.servo == XL330 {
        return Err(Failure::unusable(format!(
            "servo.model_number is {}, another than the XL330-M288-T's: give the file of its model with --servo (docs/servo-bench.md)",
            config.servo.model_number
        )));
    }
    let emergency_stop = emergency_stop(&config)?;
    let link = link_settings(&config, port.baud).map_err(Failure::unusable)?;
    let settings = BenchSettings::new(&config, link, args.amplitude_deg.to_radians(), args.rate_hz);
    let trajectories = match args.trajectories.as_slice() {
        [] => &Trajectory::ALL[..],
        given => given,
    };
    if args.out.join(crate::servo_bench::files::CAMPAIGN).exists() {
        return Err(cannot_write(
            &args.out,
            &"it holds a bench.toml already: give a new folder",
        ));
    }
    confirm(args, trajectories.len() * args.gains.len())?;

    // Nobody leaves, or is suspended, while the arm moves.
    let signals = [end_on_signal()?, suspend_on_signal()?];
    let mut stops = StopInputs::new(&signals, emergency_stop);
    let path = Path::new(&port.path);
    let (tty, mut findings) = Tty::open(path, port.baud).map_err(|error| Failure::failed(DriveError::from(error)))?;
    let mut bus = WormBus::new(tty);
    let servo = BenchServo::prepare(&mut bus, settings, &mut findings, &mut stops);
    for finding in &findings {
        tracing::warn!("{finding}");
    }
    let mut servo = servo.map_err(Failure::failed)?;
    let bench = Bench {
        mass_kg: args.mass_kg,
        length_m: args.length_m,
        arm_mass_kg: args.arm_mass_kg,
        supply_v: args.supply_v.unwrap_or_else(|| servo.supply_v()),
        duty_limit: servo.duty_limit(),
        servo: servo_of_campaign(&args.servo),
    };
    let mut files = BenchFiles::create(&args.out, &bench).map_err(|error| cannot_write(&args.out, &error))?;
    let mut runs: Vec<Value> = Vec::new();
    for &trajectory in trajectories {
        for &gain in &args.gains {
            let readings = servo
                .record(trajectory, gain, &mut stops)
                .map_err(|error| recording_failed(trajectory, gain, runs.len(), &error))?;
            let file = files
                .add(trajectory, gain, &readings)
                .map_err(|error| cannot_write(&args.out, &error))?;
            let span_s = readings.last().map_or(0.0, |last| last.time_s - readings[0].time_s);
            let rate_hz = (readings.len() as f64 - 1.0) / span_s.max(f64::MIN_POSITIVE);
            let warmest_c = readings
                .iter()
                .map(|reading| reading.temperature_c)
                .fold(f64::MIN, f64::max);
            log_line(format_args!(
                "{file}: {} readings, {rate_hz:.0} a second, {warmest_c:.0} °C",
                readings.len()
            ));
            runs.push(json!({
                "recording": file,
                "trajectory": trajectory.name(),
                "position_p_gain": gain,
                "readings": readings.len(),
                "rate_hz": rate_hz,
                "temperature_c": warmest_c,
            }));
        }
    }
    servo.finish().map_err(Failure::failed)?;
    let campaign = files.campaign();
    if args.json {
        return print::line(json!({
            "campaign": campaign.display().to_string(),
            "supply_v": bench.supply_v,
            "duty_limit": bench.duty_limit,
            "runs": runs,
        }));
    }
    print::line(format_args!(
        "{} runs; next: wormd explain {} --out why",
        runs.len(),
        campaign.display()
    ))
}

/// The emergency stop on its own line. One at the tracker cannot be read: there is none on a bench.
fn emergency_stop(config: &Config) -> Result<Option<EmergencyStopInput>, Failure> {
    let at_tracker = |stop: &EmergencyStop| stop.source == EmergencyStopSource::Tracker;
    if config.emergency_stop.as_ref().is_some_and(at_tracker) {
        return Err(Failure::unusable(
            "emergency_stop.source is \"tracker\", and a bench has no tracker: give \"gpio\", or leave the section out and keep a hand on \
             the supply's switch",
        ));
    }
    EmergencyStopInput::open(config).map_err(Failure::unusable)
}

/// Asks whether the arm may move.
fn confirm(args: &RecordArgs, runs: usize) -> Result<(), Failure> {
    if args.yes {
        return Ok(());
    }
    if !io::stdin().is_terminal() {
        return Err(Failure::unusable(
            "the arm will move: give --yes where nobody can be asked",
        ));
    }
    log_line(format_args!(
        "The arm will swing up to {:.0} degrees to both sides, {runs} times for 6 s. Is it hanging freely, and is everybody clear of it? [yes/no]",
        args.amplitude_deg
    ));
    let mut answer = String::new();
    io::stdin().lock().read_line(&mut answer).map_err(Failure::failed)?;
    match answer.trim() {
        "yes" | "y" => Ok(()),
        _ => Err(Failure::unusable("not confirmed: nothing has moved")),
    }
}

/// The servo as the campaign names it: a file by its whole path, for the campaign lies elsewhere.
fn servo_of_campaign(servo: &str) -> String {
    match std::path::absolute(servo) {
        Ok(absolute) if servo.ends_with(".toml") => absolute.display().to_string(),
        _ => servo.to_owned(),
    }
}

fn recording_failed(trajectory: Trajectory, gain: u16, whole: usize, error: &RecordingError) -> Failure {
    Failure::failed(format!(
        "{} with gain {gain}: {error}. {whole} recordings before it are whole",
        trajectory.name()
    ))
}

fn cannot_write(folder: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure::unusable(format!("{}: {error}", folder.display()))
}
