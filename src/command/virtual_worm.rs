//! `wormd virtual-worm`: the simulated devices on a pseudo-terminal.

use super::{Failure, end_on_signal, print, report_grants};
use crate::attendance::{Parent, ParentPipe, announce_ready};
use crate::link::servo::BAUD_RATES;
use crate::link::virtual_worm::{Fault, Options, PortLink, Server, ServerError, VirtualWormReport};
use crate::realtime;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;
use worm_estimator::config::Config;
use worm_physics::servo::Pendulum;

/// The devices' priority lies this far below the loop's: a real servo answers however busy the computer is, and so must this one.
const PRIORITY_BELOW_LOOP: u8 = 10;
/// Least inertia of an arm, kg m²: less is no arm.
const MIN_ARM_KG_M2: f64 = 1e-7;

/// Runs the simulated servo and tracker behind a pseudo-terminal until SIGTERM or SIGINT.
///
/// Prints one line on standard output when ready: the path that a controller opens. Every DYNAMIXEL SDK can talk to it.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = Fault::help())]
pub struct VirtualWormArgs {
    /// Where to put a link to the pseudo-terminal; an older link there is replaced
    #[arg(long, value_name = "PATH")]
    pub link: PathBuf,
    /// Configuration; without it the worm of the paper
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// A fault, as listed below; may be given several times
    #[arg(long = "fault", value_name = "SPEC")]
    pub faults: Vec<Fault>,
    /// Take faults from `wormd fault` while it runs
    #[arg(long)]
    pub allow_faults: bool,
    /// An arm with a mass on the servo's horn in place of the cam, for `wormd servo-bench`: mass_kg=M,length_m=L[,arm_mass_kg=A]. The worm rests, and
    /// the arm hangs at 2048 counts
    #[arg(long, value_name = "ARM", value_parser = parse_arm)]
    pub arm: Option<Pendulum>,
    /// Set the servo to this baud rate, and answer only a peer that uses the servo's; without it any rate is understood
    #[arg(long, value_name = "BAUD", value_parser = parse_baud)]
    pub baud: Option<u32>,
    /// Write the ground truth about energy and distance to this file at the end, as JSON
    #[arg(long, value_name = "FILE")]
    pub ledger: Option<PathBuf>,
    /// Seed of all randomness, in place of the configured one
    #[arg(long)]
    pub seed: Option<u64>,
    /// Standard input is a pipe from the process that watches over the worm
    #[arg(long, hide = true)]
    pub supervised: bool,
}

fn parse_baud(text: &str) -> Result<u32, String> {
    let baud = text.parse().ok().filter(|baud| BAUD_RATES.contains(baud));
    baud.ok_or_else(|| format!("must be one of {BAUD_RATES:?}"))
}

fn parse_arm(text: &str) -> Result<Pendulum, String> {
    let mut arm = Pendulum::NONE;
    for part in text.split(',') {
        let (name, value) = part.split_once('=').unwrap_or((part, ""));
        let (value_of, max) = match name {
            "mass_kg" => (&mut arm.mass_kg, 100.0),
            "length_m" => (&mut arm.length_m, 10.0),
            "arm_mass_kg" => (&mut arm.arm_mass_kg, 100.0),
            _ => {
                return Err(format!(
                    "'{name}' is nothing of an arm: give mass_kg, length_m and arm_mass_kg"
                ));
            }
        };
        let number = value.parse().ok().filter(|number| (0.0..=max).contains(number));
        *value_of = number.ok_or_else(|| format!("{name} = '{value}': give a number from 0 to {max}"))?;
    }
    if arm.inertia_kg_m2() < MIN_ARM_KG_M2 {
        return Err("an arm needs mass_kg and length_m above 0".to_owned());
    }
    Ok(arm)
}

/// Runs `wormd virtual-worm` until a signal ends it.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration, fault, link or ledger that cannot be used; [`Failure::Failed`] when the devices or
/// their port fail while they run.
pub fn run(args: &VirtualWormArgs) -> Result<(), Failure> {
    print::log_in_background()?;
    let config = args
        .config
        .as_deref()
        .map_or_else(|| Ok(Config::default()), Config::load)?;
    let options = Options {
        faults: args.faults.clone(),
        seed: args.seed,
        baud: args.baud,
        arm: args.arm,
        ..Options::default()
    };
    let end = end_on_signal()?;
    if let Some(file) = &args.ledger {
        // A ledger that cannot be written is reported now, not after hours.
        std::fs::write(file, "").map_err(|error| Failure::unusable(ledger_error(file, &error)))?;
    }
    let mut server = Server::open(&config, &options).map_err(|error| match error {
        ServerError::Devices(_) => Failure::unusable(error),
        _ => Failure::failed(error),
    })?;
    if args.supervised {
        let parent = ParentPipe::watch(Duration::MAX, 0)
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        server.end_when_unused(move || parent.state() == Parent::Gone);
    }
    if args.allow_faults {
        server.allow_faults(&args.link).map_err(Failure::unusable)?;
    }
    let link = PortLink::create(&args.link, server.path()).map_err(Failure::unusable)?;
    report_grants(&realtime::request(&config.realtime, PRIORITY_BELOW_LOOP));
    // A parent that does not wait for this line may have closed the pipe.
    print::announce(args.link.display());
    if !args.supervised {
        announce_ready();
    }
    let devices = server.run(&end).map_err(Failure::failed)?;
    drop(link);
    if args.supervised
        && let Some(folder) = args.link.parent()
    {
        // The link lay in the worm's folder. After its parent was killed this is the last process to leave it.
        let _ = std::fs::remove_dir(folder);
    }
    match &args.ledger {
        Some(file) => write_ledger(file, &devices.report()),
        None => Ok(()),
    }
}

fn ledger_error(file: &Path, error: &io::Error) -> String {
    format!(
        "{}: cannot write the ledger: {error}; does its folder exist, and may you write there?",
        file.display()
    )
}

fn write_ledger(file: &Path, report: &VirtualWormReport) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(report).map_err(Failure::failed)?;
    std::fs::write(file, text + "\n").map_err(|error| Failure::failed(ledger_error(file, &error)))
}
