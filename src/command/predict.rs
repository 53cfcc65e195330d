//! `wormd predict`: how well a model predicts recordings, without fitting it.
//!
//! A worm is placed as its first samples show it, its gait is found in the positions where no phase was recorded, and everything else is the
//! configuration's. A servo starts at its first reading, under the recorded goals, and is never reset.

use super::dataset::plant_of;
use super::{Failure, log_line, print};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use worm_analysis::bench::{BenchCampaign, Plant, ServoModel};
use worm_analysis::experiment::RecordedRun;
use worm_analysis::explain::Prediction;
use worm_analysis::explain::servo::{Bench, ServoPredictionError, prediction_errors};
use worm_analysis::recording::{Campaign, OpenOptions, Recording};
use worm_estimator::config::Config;
use worm_estimator::number::significant;

/// Arguments of `wormd predict`.
#[derive(Debug, Args)]
pub struct PredictArgs {
    /// A campaign (TOML) of a worm's recordings, or of a servo on a bench
    #[arg(value_name = "CAMPAIGN")]
    campaign: PathBuf,
    /// The model to predict with, such as a model.toml of `wormd explain`; without it, the campaign's own
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

/// Runs `wormd predict`.
///
/// # Errors
/// [`Failure::Unusable`] for a campaign, recording or model that cannot be used.
pub fn run(args: &PredictArgs) -> Result<(), Failure> {
    match plant_of(&args.campaign)? {
        Plant::Worm => predict_worm(args),
        Plant::ServoBench => predict_servo(args),
    }
}

/// The model's name in the output.
fn model_name(config: Option<&Path>) -> Value {
    config.map_or(Value::Null, |file| json!(file.display().to_string()))
}

fn predict_servo(args: &PredictArgs) -> Result<(), Failure> {
    let campaign = BenchCampaign::load(&args.campaign).map_err(Failure::unusable)?;
    let recordings = campaign.open_all().map_err(Failure::unusable)?;
    let model = match &args.config {
        Some(file) => ServoModel::load(file).map_err(Failure::unusable)?,
        None => campaign.model.clone(),
    };
    let errors = prediction_errors(&Bench::new(&campaign, &recordings), &model);
    let mean = |of: &dyn Fn(&ServoPredictionError) -> f64| errors.iter().map(of).sum::<f64>() / errors.len() as f64;
    let mean_rad = mean(&|run| run.mean_absolute_error_rad);
    let mean_a = mean(&|run| run.mean_absolute_error_a);
    if args.json {
        return print::line(json!({
            "plant": "servo-bench",
            "model": model_name(args.config.as_deref()),
            "current_measures": model.current,
            "runs": errors,
            "mean_absolute_error_rad": mean_rad,
            "mean_absolute_error_a": mean_a,
        }));
    }
    for run in &errors {
        print::line(format!(
            "{}, gain {}: position off by {} mrad (rms {}), current by {} mA",
            run.recording,
            run.position_p_gain,
            significant(1e3 * run.mean_absolute_error_rad, 3),
            significant(1e3 * run.root_mean_square_error_rad, 3),
            significant(1e3 * run.mean_absolute_error_a, 3)
        ))?;
    }
    print::line(format!(
        "mean over the runs: position off by {} mrad, current by {} mA",
        significant(1e3 * mean_rad, 3),
        significant(1e3 * mean_a, 3)
    ))
}

fn predict_worm(args: &PredictArgs) -> Result<(), Failure> {
    let campaign = Campaign::load(&args.campaign).map_err(Failure::unusable)?;
    if campaign.runs.is_empty() {
        return Err(Failure::unusable(format!(
            "{}: it lists advances, which hold no positions to predict: list recordings",
            args.campaign.display()
        )));
    }
    let config = match &args.config {
        Some(file) => Config::load(file)?,
        None => campaign.config.clone(),
    };
    let recordings = campaign
        .open_all(&OpenOptions::default(), &mut |_| ())
        .map_err(Failure::unusable)?;
    let runs: Vec<RecordedRun<'_>> = campaign
        .runs
        .iter()
        .zip(&recordings)
        .map(|(run, recording)| RecordedRun {
            recording,
            slope_deg: run.slope_deg,
            payload_kg: run.payload_kg,
            cycle_s: run.cycle_s,
        })
        .collect();
    let prediction = Prediction::new(&runs, &config).map_err(Failure::unusable)?;
    let mut errors = Vec::with_capacity(runs.len());
    for (number, run) in runs.iter().enumerate() {
        let name = run.recording.source.display();
        let Some(predicted_m) = prediction.positions_m(number) else {
            log_line(format_args!(
                "note: {name}: this model slides down a slope of {}°",
                run.slope_deg
            ));
            errors.push((name.to_string(), f64::NAN, f64::NAN));
            continue;
        };
        let (absolute_m, square_m) = errors_m(run.recording, &predicted_m);
        errors.push((name.to_string(), absolute_m, square_m));
    }
    let mean_m = errors.iter().map(|(_, absolute_m, _)| absolute_m).sum::<f64>() / errors.len() as f64;
    if args.json {
        let runs: Vec<Value> = errors
            .iter()
            .zip(&campaign.runs)
            .map(|((recording, absolute_m, square_m), run)| {
                json!({
                    "recording": recording,
                    "slope_deg": run.slope_deg,
                    "mean_absolute_error_m": absolute_m,
                    "root_mean_square_error_m": square_m,
                })
            })
            .collect();
        return print::line(json!({
            "plant": "worm",
            "model": model_name(args.config.as_deref()),
            "runs": runs,
            "mean_absolute_error_m": mean_m,
        }));
    }
    for (recording, absolute_m, square_m) in &errors {
        print::line(format!(
            "{recording}: cells off by {} mm (rms {})",
            significant(1e3 * absolute_m, 3),
            significant(1e3 * square_m, 3)
        ))?;
    }
    print::line(format!(
        "mean over the runs: cells off by {} mm",
        significant(1e3 * mean_m, 3)
    ))
}

/// Mean absolute and root mean square error of all cells in all samples that show them, m.
fn errors_m(recording: &Recording, predicted_m: &[f64]) -> (f64, f64) {
    let cells = recording.cells();
    let (mut absolute_m, mut square_m2, mut count) = (0.0, 0.0, 0.0);
    for (cell, measured_m) in recording.position_m.iter().enumerate() {
        for (sample, measured_m) in measured_m.iter().enumerate() {
            let off_m = predicted_m
                .get(sample * cells + cell)
                .map_or(f64::NAN, |predicted_m| predicted_m - measured_m);
            if off_m.is_finite() {
                absolute_m += off_m.abs();
                square_m2 += off_m * off_m;
                count += 1.0;
            }
        }
    }
    (absolute_m / count, f64::sqrt(square_m2 / count))
}
