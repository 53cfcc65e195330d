//! `wormd study`: Tables 1 and 2 of the paper for any design, with every `[[effect]]`.

use super::{Failure, WormArgs, print};
use clap::Args;
use worm_physics::Worm;
use worm_physics::study::{Battery, Row, Study, Tables, study};

/// Arguments of `wormd study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Numbers of cells to compare
    #[arg(long, value_delimiter = ',', default_value = "3,4,5,6", value_name = "N,…")]
    cells: Vec<usize>,
    /// Slopes, in degrees
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "0,30,45",
        value_name = "DEG,…",
        allow_negative_numbers = true
    )]
    slopes: Vec<f64>,
    /// Also show how far this much battery energy takes each design, in joules; without it, the capacity of `[battery]`, if any
    #[arg(long, value_name = "J")]
    battery: Option<f64>,
    /// Share of the battery's energy that reaches the cells; without it, all
    #[arg(long, value_name = "SHARE")]
    efficiency: Option<f64>,
    /// Print one JSON array instead of tables; with a battery, each row also has range_m and range_cycles
    #[arg(long)]
    json: bool,
}

/// Runs `wormd study`.
///
/// # Errors
/// [`Failure::Unusable`] for a design that cannot be one.
pub fn run(args: &StudyArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let base = Worm::try_from(&config).map_err(Failure::unusable)?;
    if let Some(slope) = args.slopes.iter().find(|slope| !(-90.0..=90.0).contains(*slope)) {
        return Err(Failure::unusable(format!(
            "--slopes: {slope}°: give slopes from -90 to 90 degrees"
        )));
    }
    let rows = study(&Study {
        base: &base,
        effects: &config.effect_settings().map_err(Failure::unusable)?,
        cells: &args.cells,
        slopes_deg: &args.slopes,
        cycle_s: config.gait.cycle_s,
    })
    .map_err(Failure::unusable)?;
    let energy_j = args.battery.or(config.battery.map(|battery| battery.capacity_j));
    let battery = energy_j
        .map(|energy_j| Battery::new(energy_j, args.efficiency.unwrap_or(1.0)))
        .transpose()
        .map_err(Failure::unusable)?;
    if battery.is_none() && args.efficiency.is_some() {
        return Err(Failure::unusable(
            "--efficiency goes with --battery, or with a [battery] in the configuration",
        ));
    }
    if args.json {
        return print::line(as_json(&rows, battery)?);
    }
    print::line(Tables { rows: &rows, battery }.to_string().trim_end())
}

fn as_json(rows: &[Row], battery: Option<Battery>) -> Result<serde_json::Value, Failure> {
    let mut list = Vec::with_capacity(rows.len());
    for row in rows {
        let mut entry = serde_json::to_value(row).map_err(Failure::failed)?;
        if let Some(battery) = battery {
            let range = battery.range(row);
            entry["range_m"] = range.map(|range| range.distance_m).into();
            entry["range_cycles"] = range.map(|range| range.cycles).into();
        }
        list.push(entry);
    }
    Ok(list.into())
}
