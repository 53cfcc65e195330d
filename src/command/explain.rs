//! `wormd explain`: where model and recordings disagree, which physical effect the model misses, and what to try next.
//!
//! It takes a campaign of recordings or of advances alone, one recording, the worm that is crawling now (`live`), or the campaign of a
//! servo on a bench (`servo`). What is stated of them is checked first (`conditions`). The answer is kept in a folder (`folder`) and printed.

mod conditions;
mod folder;
mod live;
mod servo;

use super::dataset::{Dataset, READING, SourceArgs};
use super::progress::Progress;
use super::{Failure, WormArgs, log_line, print};
use clap::{Args, ValueEnum};
use folder::Folder;
use serde::Serialize;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use worm_analysis::bench::Plant;
use worm_analysis::experiment::Progress as Step;
use worm_analysis::explain::{Answer, Evidence, ExplainError, Options, explain, explain_advances, model_update};
use worm_analysis::recording::Wanted;
use worm_analysis::report;
use worm_estimator::config::Config;
use worm_physics::effect::named_of_either;

/// Arguments of `wormd explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// A campaign (TOML) of several recordings or of advances, or one recording (CSV, Vicon Nexus CSV, C3D, MCAP)
    #[arg(value_name = "CAMPAIGN|RECORDING", required_unless_present = "live")]
    recording: Option<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
    /// Folder for report.html, report.json, model.toml with the effect in it, and model.diff
    #[arg(long, value_name = "DIR", required_unless_present = "json")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
    /// Seed of the search
    #[arg(long, value_name = "N", default_value_t = Options::default().seed)]
    seed: u64,
    /// What the model is taken to be wrong by everywhere: of a worm as a fraction of the tips' mean largest deformation, 0.004 unless given;
    /// of a servo of the positions' root mean square, 0.05 unless given; 0.0005 to 0.2
    #[arg(long, value_name = "FRACTION", value_parser = |text: &str| fraction(text, 0.0005..=0.2))]
    discrepancy: Option<f64>,
    /// Relative change below which an effect is not named: of a worm's advance or energy in a cycle, 0.02 unless given; of a servo's energy in
    /// a run or of its positions, 0.05 unless given; 0 to 0.5
    #[arg(long, value_name = "FRACTION", value_parser = |text: &str| fraction(text, 0.0..=0.5))]
    matters: Option<f64>,
    /// Relative change of the advance that an effect is expected to make, give or take a factor of 2.5; 0.01 to 0.5
    #[arg(long, value_name = "FRACTION", default_value_t = Options::default().expected_impact, value_parser = |text: &str| fraction(text, 0.01..=0.5))]
    expected_impact: f64,
    /// How much the friction of a worm's tip usually differs from one cycle to the next, give or take a factor of two: what moves the body much
    /// more irregularly is missing in the model; 0.001 to 0.2
    #[arg(long, value_name = "FRACTION", default_value_t = Options::default().scatter, value_parser = |text: &str| fraction(text, 0.001..=0.2))]
    scatter: f64,
    /// Leave an effect of the library out of the search, to see what it would say without; may be given several times
    #[arg(long, value_name = "EFFECT", value_parser = effect_name)]
    without: Vec<&'static str>,
    /// Take the motor's current as evidence, too: what it shows of the forces on the cells, as well as [self_sensing] knows the gears. A
    /// recording without positions is explained by it alone; with "alone" all are, and positions are not looked at
    #[arg(long, value_name = "EVIDENCE", value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "beside")]
    current: Option<Current>,
    /// Record the worm that is crawling now, into DIR/live.mcap, and explain that; at its configured slope unless --slope is
    /// given
    #[arg(long, conflicts_with = "recording", requires = "out")]
    live: bool,
    /// Name of the running worm, instead of the one in the configuration
    #[arg(long, value_name = "NAME", requires = "live")]
    name: Option<String>,
    /// Gait cycles to record of the running worm
    #[arg(long, value_name = "N", default_value_t = 8, requires = "live", value_parser = clap::value_parser!(u32).range(6..=1000))]
    cycles: u32,
}

/// How the motor's current is evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Current {
    /// Beside the positions, where there are any
    Beside,
    /// Instead of them
    Alone,
}

/// Runs `wormd explain`. Every verdict is a success.
///
/// # Errors
/// [`Failure::Unusable`] for a recording, campaign, configuration or folder that cannot be used, and a running worm that does
/// not crawl; [`Failure::Failed`] when the worm stops while it is recorded or a file cannot be written.
pub fn run(args: &ExplainArgs) -> Result<(), Failure> {
    if let Some(campaign) = args.recording.as_deref()
        && super::dataset::plant_of(campaign)? == Plant::ServoBench
    {
        return servo::run(args, campaign);
    }
    let mut progress = Progress::begin();
    let (source, dataset) = args.read(&mut progress)?;
    let folder = args.out.as_deref().map(Folder::prepare).transpose()?;
    let mut answer = match search(&dataset, args.options(Options::default()), &mut progress) {
        Ok(answer) => answer,
        Err((failure, stage)) => {
            if let Some(folder) = &folder {
                // The reason why there is no answer is the error to report, whether or not its file can be written.
                let _ = folder.write_failure(&failure, stage, &dataset.runs());
            }
            return Err(failure);
        }
    };
    let nominal = dataset.config_text.as_deref().unwrap_or(Config::COMMENTED);
    let model = model_update::model(nominal, &dataset.config, &answer);
    if let Ok(model) = &model {
        answer.figures.model_diff.clone_from(&model.diff);
    }
    let written = folder.as_ref().map(|folder| {
        progress.tell("report", 1.0);
        // First what would take another search to get back; the page, which can fail for more reasons, comes last.
        folder.write_answer(&answer)?;
        folder.write_model(&model.map_err(Failure::failed)?)?;
        folder.write_page(&answer, &title(&source))
    });
    drop(progress);
    let text = || report::explain::text(&answer);
    print_answer(args.json, &answer, &answer.warnings, text)?;
    written.transpose()?;
    if let Some(folder) = &folder {
        log_line(folder);
    }
    Ok(())
}

/// Prints an answer as JSON or as text, after the remarks on it.
fn print_answer(
    as_json: bool,
    answer: &impl Serialize,
    warnings: &[String],
    text: impl FnOnce() -> String,
) -> Result<(), Failure> {
    for warning in warnings {
        log_line(format_args!("note: {warning}"));
    }
    if as_json {
        print::line(serde_json::to_string(answer).map_err(Failure::failed)?)
    } else {
        print::line(text())
    }
}

/// The name of an effect of either library.
fn effect_name(text: &str) -> Result<&'static str, String> {
    let effect = named_of_either(text).map_err(|error| error.to_string())?;
    Ok(effect.name)
}

/// A number in a range.
fn fraction(text: &str, range: RangeInclusive<f64>) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if range.contains(&value) => Ok(value),
        _ => Err(format!("give a number from {} to {}", range.start(), range.end())),
    }
}

impl ExplainArgs {
    /// What is given, over the usual options of the plant.
    fn options(&self, usual: Options) -> Options {
        Options {
            seed: self.seed,
            discrepancy: self.discrepancy.unwrap_or(usual.discrepancy),
            matters: self.matters.unwrap_or(usual.matters),
            expected_impact: self.expected_impact,
            scatter: self.scatter,
            without: self.without.clone(),
            evidence: match self.current {
                None => Evidence::Positions,
                Some(Current::Beside) => Evidence::PositionsAndCurrent,
                Some(Current::Alone) => Evidence::CurrentAlone,
            },
        }
    }

    /// What is wanted of logs.
    fn wanted(&self) -> Wanted {
        let window_s = Wanted::USUAL_WINDOW_S;
        match self.current {
            None => Wanted::Positions,
            Some(Current::Beside) => Wanted::PositionsOrMotor { window_s },
            Some(Current::Alone) => Wanted::Motor { window_s },
        }
    }

    /// The data to explain, and where they come from.
    fn read(&self, progress: &mut Progress) -> Result<(PathBuf, Dataset), Failure> {
        if let Some(recording) = &self.recording {
            let dataset = self.source.read_also_advances(recording, self.wanted(), progress)?;
            return Ok((recording.clone(), dataset));
        }
        let worm = WormArgs {
            config: self.source.config.clone(),
            name: self.name.clone(),
            port: None,
        };
        let (config, text) = worm.load_with_text()?;
        let slope_deg = self.source.slope.unwrap_or(config.canal.slope_deg);
        let folder = self.out.as_deref().unwrap_or(Path::new("."));
        report::prepare(folder).map_err(Failure::unusable)?;
        let log = folder.join("live.mcap");
        live::record(&config, text, (self.cycles, self.current.is_some()), &log, progress)?;
        let dataset = self.source.read_recording(&log, slope_deg, self.wanted(), progress)?;
        Ok((log, dataset))
    }
}

/// The answer; or why there is none, and the stage that the search had reached.
fn search(dataset: &Dataset, options: Options, progress: &mut Progress) -> Result<Answer, (Failure, &'static str)> {
    let runs = dataset.runs();
    conditions::check(&runs, &dataset.config).map_err(|failure| (failure, "reading"))?;
    let mut stage = "gait";
    let mut report_step = |step: Step| {
        stage = step.stage;
        progress.tell(stage, READING + (1.0 - READING) * step.fraction);
    };
    let answer = match dataset.advances.is_empty() {
        true => explain(&runs, &dataset.config, &options, &mut report_step),
        false if options.evidence != Evidence::Positions => Err(ExplainError::NoCurrent),
        false => explain_advances(&dataset.advances, &dataset.config, &mut report_step),
    };
    answer.map_err(|error| (Failure::unusable(error), stage))
}

/// The title of the page.
fn title(source: &Path) -> String {
    source
        .file_stem()
        .map_or_else(|| "worm".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
