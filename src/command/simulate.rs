//! `wormd simulate`: a recording from the model.

use super::{Failure, log_line};
use clap::Args;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use worm_analysis::experiment::{Simulation, SimulationError, simulate};
use worm_analysis::recording::{Recording, mcap, write_csv};
use worm_estimator::config::{Config, ConfigError, Effect};

/// Arguments of `wormd simulate`.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Slope of the canal, in degrees, positive uphill
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    slope: f64,
    /// Number of gait cycles
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    cycles: f64,
    /// The file to write, *.csv or *.mcap; an older one is replaced
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Configuration; without it the worm of the paper
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// An effect beyond the paper's theory, with its values; several may be given. config/worm.toml lists all names
    #[arg(
        long = "effect",
        value_name = "NAME:PARAM=VALUE,…[,cell=K]",
        allow_hyphen_values = true
    )]
    effects: Vec<Effect>,
    /// Samples per second, in Hz
    #[arg(long, value_name = "HZ", default_value_t = 120.0, allow_negative_numbers = true)]
    rate: f64,
    /// Standard deviation of one measured position, in metres
    #[arg(long, value_name = "M", default_value_t = 1e-4, allow_negative_numbers = true)]
    noise: f64,
    /// Seed of noise and dropouts
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Share of the positions that are not seen
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    dropout: f64,
    /// Largest tip deformation of each cell, in millimetres, cell 1 first; without it the configured ones
    #[arg(long, value_name = "MM,…", value_delimiter = ',', allow_negative_numbers = true)]
    max_deformation_mm: Option<Vec<f64>>,
    /// Time of a gait cycle, in seconds; without it the configured one
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    cycle_s: Option<f64>,
    /// Leave the gait phase out, as motion capture does
    #[arg(long)]
    positions_only: bool,
    /// Time at rest before and after, in seconds
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true)]
    rest: f64,
}

impl SimulateArgs {
    fn simulation(&self) -> Simulation {
        let in_metres = |list_mm: &Vec<f64>| list_mm.iter().map(|value_mm| value_mm * 1e-3).collect();
        Simulation {
            slope_deg: self.slope,
            cycles: self.cycles,
            rate_hz: self.rate,
            noise_m: self.noise,
            seed: self.seed,
            dropout_share: self.dropout,
            max_deformation_m: self.max_deformation_mm.as_ref().map(in_metres),
            cycle_s: self.cycle_s,
            rest_s: self.rest,
            positions_only: self.positions_only,
        }
    }
}

/// Runs `wormd simulate`. Prints what was written on one line of standard error.
///
/// # Errors
/// [`Failure::Unusable`] for arguments or a configuration that cannot be used and a worm that slides down; [`Failure::Failed`]
/// when the file cannot be written to its end.
pub fn run(args: &SimulateArgs) -> Result<(), Failure> {
    let (mut config, config_text) = match &args.config {
        Some(file) => {
            let (config, text) = Config::load_with_text(file)?;
            (config, Some(text))
        }
        None => (Config::default(), None),
    };
    config.effect.extend(args.effects.iter().cloned());
    let problems = config.problems();
    if !problems.is_empty() {
        let file = PathBuf::from("command line");
        return Err(ConfigError::Values { file, problems }.into());
    }
    let recording = simulate(&config, &args.simulation()).map_err(|error| match error {
        SimulationError::OutOfRange { .. } => Failure::unusable(format!("--{error}")),
        _ => Failure::unusable(error),
    })?;
    write(&recording, &config, config_text.as_deref(), &args.out)?;
    log_line(format_args!(
        "{}: {} samples of {} cells over {:.1} s: {}",
        args.out.display(),
        recording.samples(),
        recording.cells(),
        recording.time_s.last().copied().unwrap_or(0.0),
        recording.source.display()
    ));
    Ok(())
}

/// Writes the format of the file's extension.
fn write(recording: &Recording, config: &Config, config_text: Option<&str>, out: &Path) -> Result<(), Failure> {
    let extension = out.extension().map(|extension| extension.to_ascii_lowercase());
    match extension.as_deref().and_then(|extension| extension.to_str()) {
        Some("csv") => write_as_csv(recording, out),
        Some("mcap") => mcap::write(recording, config, config_text, out).map_err(Failure::failed),
        _ => Err(Failure::unusable(format!(
            "--out {}: name a file *.csv or *.mcap",
            out.display()
        ))),
    }
}

fn write_as_csv(recording: &Recording, out: &Path) -> Result<(), Failure> {
    let file = File::create(out).map_err(|error| {
        Failure::unusable(format!(
            "--out {}: {error}: does its folder exist, and may you write there?",
            out.display()
        ))
    })?;
    let mut file = BufWriter::new(file);
    write_csv(recording, &mut file)
        .and_then(|()| file.flush())
        .map_err(|error| Failure::failed(format!("{}: {error}: is the disk full?", out.display())))
}
