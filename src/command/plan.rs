//! `wormd plan`: a route on the battery, and the best design for it.

use super::{Failure, WormArgs, print};
use clap::Args;
use std::path::PathBuf;
use worm_estimator::config::read_text;
use worm_plan::{Bounds, Route, Workbench, plan};

/// Longest gait cycle of the search where none is given, s.
const LONGEST_CYCLE_S: f64 = 10.0;

/// Arguments of `wormd plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// The route: CSV with the columns length_m and slope_deg, a line for each leg
    #[arg(long, value_name = "FILE")]
    route: PathBuf,
    /// Share of the battery's energy at the start, such as a gauge shows it: 0 to 1
    #[arg(long, default_value_t = 1.0, value_name = "SHARE")]
    charge: f64,
    /// Numbers of cells to try
    #[arg(long, value_delimiter = ',', default_value = "3,4,5,6,7,8", value_name = "N,…")]
    cells: Vec<usize>,
    /// Times of a gait cycle to try, in seconds; without it, from the servo's velocity limit to 10 s
    #[arg(long, value_parser = range, value_name = "LOW:HIGH")]
    cycle_s: Option<[f64; 2]>,
    /// Stiffnesses of the contacts to try, over the configured ones
    #[arg(long, value_parser = range, default_value = "0.5:4", value_name = "LOW:HIGH")]
    stiffness_factor: [f64; 2],
    /// Values of each of the two ranges
    #[arg(long, default_value_t = 32, value_name = "N")]
    steps: usize,
    /// Folder for plan.html and plan.json
    #[cfg(feature = "analysis")]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    json: bool,
}

/// Two numbers with a colon between them, or one that is both.
fn range(text: &str) -> Result<[f64; 2], String> {
    let (low, high) = text.split_once(':').unwrap_or((text, text));
    let number = |text: &str| {
        let value = text.trim().parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| format!("'{text}' is no number: give LOW:HIGH, such as 1:5, or one number"))
    };
    Ok([number(low)?, number(high)?])
}

/// Runs `wormd plan`.
///
/// # Errors
/// [`Failure::Unusable`] for a route, a configuration or bounds that cannot be used; [`Failure::Failed`] when the report cannot be
/// written.
pub fn run(args: &PlanArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let bench = Workbench::new(&config).map_err(Failure::unusable)?;
    let text = read_text(&args.route).map_err(|error| {
        let file = args.route.display();
        Failure::unusable(format!(
            "{file}: {error}: give a CSV file with the columns length_m and slope_deg"
        ))
    })?;
    let route = Route::from_csv(&text, &args.route).map_err(Failure::unusable)?;
    if !(0.0..=1.0).contains(&args.charge) {
        let charge = args.charge;
        return Err(Failure::unusable(format!(
            "--charge {charge}: give a share from 0 to 1"
        )));
    }
    let bounds = Bounds {
        cells: args.cells.clone(),
        cycle_s: args.cycle_s.unwrap_or_else(|| {
            let shortest_s = bench.shortest_cycle_s().max(0.5);
            [shortest_s, LONGEST_CYCLE_S.max(shortest_s)]
        }),
        stiffness_factor: args.stiffness_factor,
        steps: args.steps,
    };
    #[cfg(feature = "analysis")]
    if let Some(dir) = &args.out {
        worm_analysis::report::prepare(dir).map_err(Failure::unusable)?;
    }
    let plan = plan(&bench, &route, &bounds, args.charge).map_err(Failure::unusable)?;
    let json = serde_json::to_string(&plan).map_err(Failure::failed)?;
    #[cfg(feature = "analysis")]
    if let Some(dir) = &args.out {
        use worm_analysis::report;
        let title = args
            .route
            .file_stem()
            .map_or("route".into(), |stem| stem.to_string_lossy());
        let page = report::plan::write(dir, &plan, &title).map_err(Failure::failed)?;
        report::replace_file(dir.join("plan.json"), json.as_bytes()).map_err(Failure::failed)?;
        super::log_line(format_args!("{}: look at it in a browser", page.display()));
    }
    if args.json {
        return print::line(json);
    }
    #[cfg(feature = "analysis")]
    let text = worm_analysis::report::plan::text(&plan);
    // Tables need the report; a robot's small binary prints what programs read.
    #[cfg(not(feature = "analysis"))]
    let text = json;
    print::line(text)
}
